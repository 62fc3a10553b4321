"""User subroutines in shells: the form for shells, and that of solids without stress 33."""
import h5py
import numpy as np

from common import FILES, INPUT, STEEL, VOCE, deck, same, user

SHELL = """*BLANK, NAME=strip, MATERIAL=steel, ELEMENT=SHELL
x, 0, 10, 2, 3
y, 0, 4, 2, 2
z, 0, 1, 2, 1
"""
RUN = """*AMPLITUDE, NAME=soft start
0, 0, 1e-5, 1
*BOUNDARY
{low_x}, {hold}
*BOUNDARY, TYPE=VELOCITY, AMPLITUDE=soft start
{high_x}, {component}, {component}, {{speed}}
*DYNAMIC, EXPLICIT
2e-5
*BULK VISCOSITY
0, 0
*OUTPUT, FRAMES=1, HISTORY=1
"""
AXES = {"low_x": "XI_MIN", "high_x": "XI_MAX"}
PULL = SHELL + RUN.format(hold="XSYMM", component=1, **AXES)
SWING = SHELL + RUN.format(hold="ENCASTRE", component=2, **AXES)
BEND = SHELL + RUN.format(hold="ENCASTRE", component=3, **AXES)
PRESSED = BEND + "*PRESSURE\nZETA_MAX, 20\n"
SPACE = ", STRESS STATE=THREE DIMENSIONAL"
EQPS = "\n1, EQPS"
KINDS = ("UNIAXIAL", "EQUIBIAXIAL", "PLANE STRAIN", "SIMPLE SHEAR")
PLASTIC = f"*ELASTIC\n{STEEL}\n*PLASTIC, HARDENING=VOCE\n250, 250, 6"
ELASTIC = f"*ELASTIC\n{STEEL}\n"


def both_forms_agree_with_built_in_laws(bench):
    """Axes that follow R (Green and Naghdi) against those that follow the spin: as alike as shear
    is small. Both forms have the same axes, and so the same results, but for the search."""
    for body, limit in ((SWING, 2e-5), (PRESSED, 1e-5)):
        built_in = bench.values(deck(PLASTIC, body))
        forms = [bench.values(deck(user(VOCE, 1, options, EQPS), body), source)
                 for options, source in (("", FILES / "voce_sheet.f"),
                                         (SPACE, INPUT / "umat_voce.f"),
                                         ("", FILES / "vumat_sheet.f"),
                                         (SPACE, INPUT / "vumat_voce.f"))]
        for form in forms:
            same(form, built_in, limit)
            same(form, forms[0], 1e-8)
            assert abs(form[2] - forms[0][2]).max() < 1e-8
        assert forms[0][2].max() > 1e-3, "the strip does not yield"
    one = bench.values(deck(user(VOCE, 1, SPACE, EQPS), SWING), INPUT / "vumat_voce.f", threads=1)
    two = bench.values(deck(user(VOCE, 1, SPACE, EQPS), SWING), INPUT / "vumat_voce.f", threads=2)
    assert all(np.array_equal(a, b) for a, b in zip(one, two)), "threads change the result"


def material_tests_know_both_forms(bench):
    """The built-in law in plane stress, and both forms of UMAT and VUMAT; shear turns the axes."""
    tests = "".join(f"*MATERIAL TEST, NAME={kind}, MATERIAL=steel, TYPE={kind}, INCREMENTS=50, "
                    f"STRESS STATE=PLANE STRESS, ANGLE=25\n0.1\n" for kind in KINDS)
    results = []
    for law, files in ((PLASTIC, []),
                       (user(VOCE, 1, "", EQPS), [FILES / "voce_sheet.f"]),
                       (ELASTIC + user(VOCE, 1, SPACE, EQPS), [INPUT / "umat_voce.f"]),
                       (ELASTIC + user(VOCE, 1, "", EQPS), [FILES / "vumat_sheet.f"]),
                       (user(VOCE, 1, SPACE, EQPS), [INPUT / "vumat_voce.f"])):
        path = bench.run(deck(law, "") + tests, *files, command=["material"])
        with h5py.File(path) as file:
            results.append({kind: [file["tests"][kind][name][...] for name in
                                   ("stress", "strain", "eqps")] for kind in KINDS})
    for kind in KINDS:
        for result in results[1:]:
            limit = 1e-5 if kind == "SIMPLE SHEAR" else 1e-9
            for one, other, scale in zip(result[kind], results[0][kind], (400, 0.1, 0.1)):
                assert abs(one - other).max() < limit * scale, (kind, abs(one - other).max())
        assert results[0][kind][2].max() > 0.05


def restarts_continue_with_the_same_bits(bench):
    law = deck(user(VOCE, 13, "", EQPS), SWING) + "*CHECKPOINT, STEPS=100000000\n"
    whole = bench.values(law, FILES / "voce_sheet.f")
    bench.run(law, FILES / "voce_sheet.f", code=3, result="cut.h5", options=["--wall", "1e-9"])
    rest = bench.values(law, FILES / "voce_sheet.f", result="cut.h5", threads=1,
                        options=["--restart", "cut.ckpt.h5"])
    assert all(np.array_equal(a, b) for a, b in zip(whole, rest)), "a restart changes the result"


def sheets_are_described_to_the_law(bench):
    """Numbers, size and place of the points of layers; no rotation against the axes."""
    law = ELASTIC + user(VOCE, 13, "", EQPS)
    state = bench.values(deck(law, PULL), FILES / "voce_sheet.f")[2].reshape(-1, 13)
    with h5py.File(bench.folder / "a.h5") as file:
        place = file["points/reference_position"][...].reshape(-1, 3)
    assert (state[:, [1, 2, 4]] == [2, 3, 1]).all()
    layer = state[:, 5].astype(int)
    assert set(layer) == set(range(1, 7)) and set(state[:, 3]) == {1, 2, 3, 4}
    assert (np.diff(place[np.argsort(layer, kind="stable"), 2]) > -1e-12).all()
    assert (state[:, 6] == 0).all(), "DROT is no unit matrix"
    assert abs(state[:, 9] - (10 / 3 * 2) ** 0.5).max() < 1e-12
    assert abs(state[:, 11:] - place[:, 1:]).max() < 0.1 and state[:, 7].max() > 1.01
    blocks = bench.values(deck(ELASTIC + user(VOCE, 8, "", EQPS), PULL), FILES / "vumat_sheet.f")[2]
    blocks = blocks.reshape(-1, 8)
    assert (blocks[:, 1:3] == [3, 1]).all() and (blocks[:, 3:5] == state[:, [3, 5]]).all()
    assert abs(blocks[:, 6] - state[:, 7]).max() < 1e-6


def gradients_store_the_work_that_strains_do(bench):
    """The energy of a hyperelastic law follows from DFGRD1, the internal work from the strains."""
    for body, speed in ((PULL, 1e5), (SWING, 1e5), (BEND, 2e4)):
        path = bench.run(deck(user(STEEL, 1, SPACE), body, speed), FILES / "neo_hooke.f")
        with h5py.File(path) as file:
            energy = (file["points/statev"][..., 0] * file["points/reference_volume"][...]).sum()
            work = file["history/internal_energy"][-1]
        assert energy > 1 and abs(energy / work - 1) < 1e-4, (energy, work)


def turned_patch():
    """The strip with its axis 1 along y and its axis 2 against x."""
    lines = "*BLANK, NAME=strip, MATERIAL=steel, ELEMENT=SHELL, TYPE=NURBS\n"
    knots = ("0, 0, 0, 0.5, 1, 1, 1", "0, 0, 0, 1, 2, 3, 3, 3", "0, 0, 1, 1")
    for axis, text in enumerate(knots):
        lines += f"*KNOTS, PATCH=strip, AXIS={axis + 1}, DEGREE={(2, 2, 1)[axis]}\n{text}\n"
    lines += "*CONTROL POINTS, PATCH=strip\n"
    for z in (0, 1):
        for x in (0, 1 / 6, 1 / 2, 5 / 6, 1):
            for y in (0, 0.25, 0.75, 1):
                lines += f"{10 - 10 * x:.15g}, {4 * y}, {z}\n"
    return lines + RUN.format(low_x="ETA_MAX", high_x="ETA_MIN", hold="ENCASTRE", component=2)


def axes_of_the_material_begin_along_x(bench):
    """A law that is stiffer along axis 1: the same, however the sheet is parametrized."""
    results = []
    law = ELASTIC + user("210000, 0.3, 1e9, 0, 0, 2", 1)
    for body in (SWING, turned_patch()):
        stress = bench.values(deck(law, body), FILES / "voce_sheet.f")[1].reshape(-1, 6)
        with h5py.File(bench.folder / "a.h5") as file:
            place = file["points/reference_position"][...].reshape(-1, 3)
        results.append(stress[np.lexsort(place.round(6).T)])
    scale = abs(results[0]).max()
    assert scale > 100 and abs(results[1] - results[0]).max() < 1e-9 * scale


def laws_of_solids_are_told_of_the_option(bench):
    """However a law of solids shows in the form for shells: the option is named."""
    option = "STRESS STATE=THREE DIMENSIONAL of *USER MATERIAL"
    for law, source, words in (
            (ELASTIC + user(VOCE, 1), INPUT / "umat_voce.f", ["UMAT", "DDSDDE of a solid"]),
            (user(VOCE, 1), INPUT / "umat_voce.f", ["UMAT", "shear alone"]),
            (user(STEEL, 2), FILES / "jstep_hypo.f", ["UMAT", "past the end of"]),
            (user(STEEL), FILES / "neo_hooke.f", ["UMAT", "past the end of STRESS"]),
            (ELASTIC + user(VOCE, 1), INPUT / "vumat_voce.f",
             ["VUMAT", "past the end of stressNew"])):
        bench.run(deck(law, PULL), source, code=2)
        bench.says(option, "element", "point", *words)
