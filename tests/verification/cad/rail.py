"""The S-rail of input/cad_rail.key with the die from STEP, from IGES with trimmed surfaces (144)
and from IGES with a solid (186): forces, draw-in and thinning must agree. The stored files serve.

    python rail.py IGAFORM INPUT OUT
"""
import os
import subprocess
import sys

import h5py
import numpy as np

SETTINGS = {"size": 12, "depth": 12, "frames": 2}
SAME = 1e-4     # of the peak force, of the range of thinning and of the way of the edge


def run(program, deck, out, die):
    """Punch force, thinning and displacement at the end of the draw."""
    sets = [word for key, value in {**SETTINGS, "die": f"cad/{die}"}.items()
            for word in ("--set", f"{key}={value}")]
    path = os.path.join(out, die.replace(".igs", ".h5"))
    subprocess.run([program, deck, "--quiet", "--threads", "2", "--out", path, *sets], check=True)
    with h5py.File(path) as file:
        n = int(file["VTKHDF/NumberOfPoints"][0])
        drawn = slice(SETTINGS["frames"] * n, (SETTINGS["frames"] + 1) * n)
        return (file["tools/punch/force"][:, 2], file["VTKHDF/PointData/thinning"][drawn],
                file["VTKHDF/PointData/displacement"][drawn, 1])


def main():
    program, decks, out = sys.argv[1:4]
    os.makedirs(out, exist_ok=True)
    deck = os.path.join(decks, "cad_rail.key")
    first = run(program, deck, out, "s_rail_die_tool.igs")
    is_good = np.ptp(first[0]) > 1e4 and np.nanmax(first[1]) > 1e-3
    for die in ("s_rail_die_144_tool.igs", "s_rail_die_186_tool.igs"):
        for name, one, other in zip(("force", "thinning", "displacement"), first,
                                    run(program, deck, out, die)):
            there = np.isfinite(one) & np.isfinite(other)
            apart = np.abs(one - other)[there].max() / np.ptp(one[there])
            good = apart <= SAME and np.array_equal(np.isfinite(one), np.isfinite(other))
            is_good = is_good and good
            print(f"{'good' if good else 'FAIL'}  {die}: {name} apart by {apart:.2e} of its range")
    sys.exit(0 if is_good else 1)


main()
