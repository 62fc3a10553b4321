"""Scenes by several processes, of one and two threads each: every dataset of the results has the
bits of the run by igaform.

Usage: same_bits.py PROGRAM PROJECT MPI_PROGRAM MPIRUN PROCESSES [SCENE ...]
"""
import pathlib
import sys
import tempfile

import h5py

from common import PROJECT, check_same, datasets, igaform
from mpi import igaform_mpi

COUNTS = [int(count) for count in sys.argv[5].split(",")]
CHOSEN = sys.argv[6:]

EVERY = 7                       # increments of --rebalance
CLOSING = ["closing=8"]         # mm: both dies hit the sheet and yield it
BOX = ["depth=1.5", "elements=20", "frames=2"]
CUP = ["depth=1", "around=4", "across=4", "frames=2"]
SHELLS = ["element=SHELL", "mass_factor=1", "rule=SHEET"]

# The deck, its parameters, and what must not be zero in its results.
ENERGIES = [f"history/{name}_energy" for name in ("internal", "contact", "friction")]
YIELDING = [*ENERGIES[:2], "frames/eqps"]
RUBBING = [*YIELDING, ENERGIES[2]]
SCENES = {
    "strip": ("input/channel_strip.key", CLOSING, YIELDING),
    "channel": ("input/channel_quick.key", CLOSING, YIELDING),
    "shell channel": ("input/channel_quick.key", [*CLOSING, "element=SHELL"], YIELDING),
    "ANS": ("input/channel_quick.key", [*CLOSING, "projection=ANS"], YIELDING),
    "smooth BBAR": ("input/channel_quick.key", [*CLOSING, "projection=BBAR", "space=SMOOTH"],
                    YIELDING),
    "box": ("input/square_box.key", BOX, [*RUBBING, "tools/holder/displacement"]),
    "shell box": ("input/square_box.key", [*BOX, *SHELLS],
                  [*RUBBING, "tools/holder/displacement"]),
    "patches": ("input/hemisphere.key", CUP, ENERGIES),
    "shell patches": ("input/hemisphere.key", [*CUP, *SHELLS], ENERGIES),
    "disk": ("input/disk_punch.key", ["depth=2"], ENERGIES[:2]),
    "shell disk": ("input/disk_punch.key", ["depth=2", "element=SHELL"], ENERGIES[:2]),
    "closed ring": ("tests/verification/processes/spinning_ring.key", [],
                    ["history/kinetic_energy", "history/internal_energy"]),
    "joints": ("input/verification/three_sheets.key", [], ENERGIES[:1]),
    "relaxation": ("tests/verification/patches/cup_pressure.key", [], ["history/damping_energy"]),
    "bead": ("tests/verification/bead/strip.key", [], ["history/friction_energy"]),
    "wear": ("tests/verification/contact/slider.key", ["friction=0.1"],
             ["VTKHDF/PointData/wear"]),
    "late pair": ("tests/verification/contact/late.key", ["lift=0.2", "friction=0.2"], ENERGIES),
    "late pair of a shell": ("tests/verification/processes/late_plate.key", [],
                             [*RUBBING, "history/damping_energy"]),
    "late roll, trims": ("input/verification/trim_press.key", [], RUBBING),
    "modes": ("input/verification/touched_strip.key", [], ["modes/step_2/frequency"]),
    "held": ("input/verification/pressed_hold.key", [], ENERGIES[:2]),
    "pieces": ("input/verification/trim_pieces.key", [], ENERGIES[:1]),
    "draw, trim, release": ("input/verification/trim_chain.key", [], RUBBING),
    "solid draw, trim, release": ("input/verification/trim_chain.key", ["element=SOLID"], RUBBING),
    "CAD tools": ("input/cad_rail.key", ["size=12", "depth=3", "frames=2"], RUBBING),
    "draw bending": ("input/u_bend.key", ["stroke=3"], RUBBING),
}
# Whose control points each process moves by rows.
BY_ROWS = ["channel", "shell channel", "box", "shell box", "late pair", "late pair of a shell",
           "held"]
# A user's law, in enough elements for the blocks of a VUMAT to lie in several tiles.
STRIP = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*USER MATERIAL, CONSTANTS=5{law}
210000, 0.3, 250, 250, 6
*DEPVAR
1
1, EQPS
*BLANK, NAME=strip, MATERIAL=steel, TYPE=BOX
x, 0, 40, 2, 24
y, 0, 20, 2, 12
z, 0, 1, 2, 1
*AMPLITUDE, NAME=soft start
0, 0, 2e-5, 1
*BOUNDARY
X_MIN, ENCASTRE
*BOUNDARY, TYPE=VELOCITY, AMPLITUDE=soft start
X_MAX, 1, 2, 20000
*DYNAMIC, EXPLICIT
4e-5
*OUTPUT, FRAMES=4, HISTORY=8
"""
USER_LAWS = {"UMAT": ("", "umat_voce.f"), "VUMAT": (", TYPE=VUMAT", "vumat_voce.f"),
             "UMAT on one thread": (", THREADSAFE=NO", "umat_voce.f")}


def scene(folder, name):
    """Words of the command that runs a scene, and what must not be zero in its results."""
    if name in USER_LAWS:
        law, source = USER_LAWS[name]
        deck = folder / "deck.key"
        deck.write_text(STRIP.format(law=law))
        return [deck, "--user", PROJECT / "input" / source], ["frames/eqps"]
    deck, parameters, effects = SCENES[name]
    return [PROJECT / deck, *(word for one in parameters for word in ("--set", one))], effects


def check(folder, name):
    """One scene, with all counts of processes."""
    words, effects = scene(folder, name)
    igaform(folder, *words, "--threads", 1, "--out", "one.h5")
    with h5py.File(folder / "one.h5") as file:
        zero = [effect for effect in effects if not any_number(file, effect)]
    assert not zero, f"{name}: {zero} are zero"
    reference = datasets(folder / "one.h5")
    for count in COUNTS:
        for threads in (1, 2):
            # Two threads come with work that changes hands often.
            igaform_mpi(count, folder, *words, "--threads", threads, "--out", "shared.h5",
                        *(["--rebalance", EVERY] if threads == 2 else []))
            check_same(folder / "shared.h5", reference)
            rows = [line for line in (folder / "shared.log").read_text().splitlines()
                    if line.startswith("rows ")]
            assert count == 1 or (name in BY_ROWS) == (" of " in rows[-1]), (name, rows)
    print(f"{name}: {len(reference)} datasets have the same bits", flush=True)


def any_number(file, name):
    """Is any number of a dataset, or of those of a group, not zero?"""
    item = file[name]
    return item[...].any() if isinstance(item, h5py.Dataset) else any(
        any_number(item, part) for part in item)


def main():
    names = [*SCENES, *USER_LAWS]
    assert set(CHOSEN) <= set(names), f"unknown: {set(CHOSEN) - set(names)}; there are {names}"
    for name in CHOSEN or names:
        with tempfile.TemporaryDirectory() as place:
            check(pathlib.Path(place), name)


if __name__ == "__main__":
    main()
