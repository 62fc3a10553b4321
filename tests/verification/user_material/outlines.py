"""User materials in solids that an outline or a trim cuts, with and without weights."""
import h5py
import numpy as np

from common import FILES, INPUT, STEEL, VOCE, deck, user

ELASTIC = "*ELASTIC\n210000, 0.3\n"
RUN = """*BLANK OUTLINE
START, 0, 0.3
LINE, 24, 0.3
LINE, 24, 10
ARC, 20, 12, 13, 15.6
LINE, 0, 15.6
*AMPLITUDE, NAME=soft start
0, 0, 2e-5, 1
*BOUNDARY
XI_MIN, ENCASTRE
*BOUNDARY, TYPE=VELOCITY, AMPLITUDE=soft start
XI_MAX, 1, 1, {speed}
XI_MAX, 3, 3, {speed}
*STEP, NAME=draw
*DYNAMIC, EXPLICIT
3e-5
*OUTPUT, FRAMES=1, HISTORY=4
*END STEP
*STEP, NAME=hole
*DYNAMIC, EXPLICIT
1e-5
*TRIM, KEEP=OUTSIDE
CIRCLE, 11, 8, 3.1
*OUTPUT, FRAMES=1, HISTORY=4
*END STEP
"""
PLAIN = """*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, RULE={rule}
x, 0, 24, 2, 12
y, 0, 16, 2, 8
z, 0, 1, 2, 1
""" + RUN


def with_weights():
    """The same sheet with uneven weights, coarser."""
    axes = np.linspace(0, 24, 8), np.linspace(0, 16, 6), np.linspace(0, 1, 3)
    text = "*BLANK, NAME=sheet, MATERIAL=steel, TYPE=NURBS, RULE={rule}\n"
    for number, axis in enumerate(axes):
        knots = [0, 0, *range(len(axis) - 1), len(axis) - 2, len(axis) - 2]
        text += f"*KNOTS, PATCH=sheet, AXIS={number + 1}, DEGREE=2\n" \
            + ", ".join(map(str, knots)) + "\n"
    text += "*CONTROL POINTS, PATCH=sheet\n"
    for z in axes[2]:
        for y in axes[1]:
            for x in axes[0]:
                text += f"{x:.15g}, {y:.15g}, {z:.15g}, {1 + 0.1 * np.sin(x + 2 * y):.15g}\n"
    return text + RUN


def end_of(bench, *arguments, **options):
    """Control points, stress at the points that are left, and the history of the internal work."""
    path = bench.run(*arguments, **options)
    with h5py.File(path) as file:
        assert len(file["nurbs/blank/outlines"]) == 2
        found = [file[name][...] for name in ("nurbs/blank/points", "points/stress",
                                              "history/internal_energy")]
    return [values[np.isfinite(values)] for values in found]


def cut_solids_agree_with_built_in_laws(bench):
    """Voce as a UMAT, with gradients and without, and as a VUMAT; one thread and two."""
    built_in = ELASTIC + "*PLASTIC, HARDENING=VOCE\n250, 250, 6"
    small = user(VOCE, 1, ", KINEMATICS=SMALL")
    for body, rule in ((PLAIN, '"2,2,3"'), (PLAIN, "FULL"), (with_weights(), '"2,2,3"')):
        body = body.replace("{rule}", rule)
        expected = end_of(bench, deck(built_in, body))
        assert abs(expected[1]).max() > 250
        for law, name, limit in ((user(VOCE, 1), "umat_voce.f", 1e-8),
                                 (small, "umat_voce.f", 1e-8),
                                 (user(VOCE, 1), "vumat_voce.f", 2e-4)):
            found = end_of(bench, deck(law, body), INPUT / name)
            for value, other in zip(found, expected):
                assert abs(value - other).max() < limit * abs(other).max(), (rule, name)
            one = end_of(bench, deck(law, body), INPUT / name, threads=1)
            assert all(map(np.array_equal, found, one)), "threads change the result"


def cut_solids_store_the_work_that_they_do(bench):
    """The energy of a hyperelastic law follows from DFGRD1, the work from the strains: gradients
    refer to the places of the points of cut elements."""
    body = PLAIN[:PLAIN.index("*STEP, NAME=hole")].replace("{rule}", '"2,2,3"')
    path = bench.run(deck(user(STEEL, 1), body), FILES / "neo_hooke.f")
    with h5py.File(path) as file:
        energy = np.nansum(file["points/statev"][..., 0] * file["points/reference_volume"][...])
        work = file["history/internal_energy"][-1]
    assert energy > 1 and abs(energy / work - 1) < 1e-3, (energy, work)
