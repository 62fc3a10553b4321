"""Coarse and refined tools must form the same sheet (the seed's headline, figures 13 and 14), which
sinks into neither of them while it is bent.

usage: refined_tools.py IGAFORM COARSE_DECK REFINED_DECK LIMIT PENETRATION [NAME=VALUE ...]
LIMIT: largest distance of the final shapes [mm]; PENETRATION: deepest, part of the thickness
"""
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np


BENT = 112.0   # mm of closing, from which on the dies crush the sheet
CLOSING, THICKNESS = 150.0, 3.0   # mm, of the deck


def deepest(file):
    """Deepest penetration up to the end of bending, part of the thickness."""
    time = file["history/time"][...]
    depths = file["history/max_penetration"][time * CLOSING <= BENT * time[-1]]
    assert len(depths) > 100, "too few rows of history"
    return depths.max() / THICKNESS


def run(igaform, deck, path, settings):
    sets = [word for setting in settings for word in ("--set", setting)]
    subprocess.run([igaform, deck, "--out", path, "--threads", "2", "--quiet", *sets], check=True)
    with h5py.File(path) as file:
        n_faces = sum((len(np.unique(surface["knots_1"])) - 1)
                      * (len(np.unique(surface["knots_2"])) - 1)
                      for tool in file["nurbs/tools"].values() for surface in tool.values())
        return n_faces, file["nurbs/blank/points"][...], deepest(file)


def main(igaform, coarse_deck, refined_deck, limit, penetration, *settings):
    with tempfile.TemporaryDirectory() as folder:
        n_coarse, coarse, coarse_depth = run(igaform, coarse_deck,
                                             os.path.join(folder, "coarse.h5"), settings)
        n_refined, refined, refined_depth = run(igaform, refined_deck,
                                                os.path.join(folder, "refined.h5"), settings)
    assert n_refined > n_coarse, "the refined tools have no more faces than the coarse ones"
    distance = np.linalg.norm(coarse - refined, axis=-1).max()
    print(f"{n_coarse} and {n_refined} faces: final shapes differ by {distance:.3g} mm at most")
    assert distance < float(limit), f"more than {limit} mm"
    print(f"deepest penetration up to {BENT:g} mm closing over the thickness: "
          f"{coarse_depth:.3%} and {refined_depth:.3%}")
    assert 0 < max(coarse_depth, refined_depth) <= float(penetration), f"more than {penetration}"


if __name__ == "__main__":
    main(*sys.argv[1:])
