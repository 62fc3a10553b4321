"""The strip of the channel with input/umat_voce.f dropped in: the same profile as the built-in law.

usage: strip.py IGAFORM PROJECT_DIR LIMIT [NAME=VALUE ...]
"""
import pathlib
import re
import subprocess
import sys
import tempfile

import h5py

BUILT_IN = re.compile(r"\*ELASTIC\n210000, 0.3\n(\*\*.*\n)*\*PLASTIC.*\n250, 250, 6\n")
DROPPED_IN = "*USER MATERIAL, CONSTANTS=5\n210000, 0.3, 250, 250, 6\n*DEPVAR\n1\n1, EQPS\n"


def run(igaform, folder, name, settings, *options):
    sets = [word for setting in settings for word in ("--set", setting)]
    path = folder / f"{name}.h5"
    subprocess.run([igaform, str(folder / "channel_strip.key"), "--out", str(path), "--quiet",
                    *sets, *options], check=True)
    with h5py.File(path) as file:
        return file["nurbs/blank/points"][...], file["points/eqps"][...]


def main(igaform, project, limit, *settings):
    source = pathlib.Path(project).resolve() / "input"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "channel").symlink_to(source / "channel")
        for deck in ("channel_strip.key", "channel_forming.key"):
            (folder / deck).write_text((source / deck).read_text())
        points, eqps = run(igaform, folder, "built_in", settings)
        forming = folder / "channel_forming.key"
        text = forming.read_text()
        text, n_materials = BUILT_IN.subn(DROPPED_IN, text)
        assert n_materials == 1, "the deck has another material than this test expects"
        forming.write_text(text)
        user_points, user_eqps = run(igaform, folder, "dropped_in", settings, "--user",
                                     str(source / "umat_voce.f"))
    assert eqps.max() > 1e-3, "the sheet does not yield"
    distance = abs(points - user_points).max()
    print(f"shapes differ by {distance:.3g} mm at most, plastic strains by "
          f"{abs(eqps - user_eqps).max():.3g} of {eqps.max():.3g}")
    assert distance < float(limit), f"more than {limit} mm"


if __name__ == "__main__":
    main(*sys.argv[1:])
