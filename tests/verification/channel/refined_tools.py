"""Coarse and refined tools must form the same sheet (the seed's headline, figures 13 and 14).

usage: refined_tools.py IGAFORM COARSE_DECK REFINED_DECK LIMIT [NAME=VALUE ...]
"""
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np


def run(igaform, deck, path, settings):
    sets = [word for setting in settings for word in ("--set", setting)]
    subprocess.run([igaform, deck, "--out", path, "--threads", "2", "--quiet", *sets], check=True)
    with h5py.File(path) as file:
        n_faces = sum((len(np.unique(surface["knots_1"])) - 1)
                      * (len(np.unique(surface["knots_2"])) - 1)
                      for tool in file["nurbs/tools"].values() for surface in tool.values())
        return n_faces, file["nurbs/blank/points"][...]


def main(igaform, coarse_deck, refined_deck, limit, *settings):
    with tempfile.TemporaryDirectory() as folder:
        n_coarse, coarse = run(igaform, coarse_deck, os.path.join(folder, "coarse.h5"), settings)
        n_refined, refined = run(igaform, refined_deck, os.path.join(folder, "refined.h5"),
                                 settings)
    assert n_refined > n_coarse, "the refined tools have no more faces than the coarse ones"
    distance = np.linalg.norm(coarse - refined, axis=-1).max()
    print(f"{n_coarse} and {n_refined} faces: final shapes differ by {distance:.3g} mm at most")
    assert distance < float(limit), f"more than {limit} mm"


if __name__ == "__main__":
    main(*sys.argv[1:])
