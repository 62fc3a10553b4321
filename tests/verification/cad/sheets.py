"""Sheets with outlines written as trimmed surfaces and read back as tools: what is inside must be
the same.

usage: sheets.py IGAFORM PROJECT
"""
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

PROJECT = pathlib.Path(sys.argv[2]).resolve()
sys.path.insert(0, str(PROJECT))

from post.results import Results  # noqa: E402
from post.scene import inside_outline  # noqa: E402
from post.trimmed_sheet import flat_curve, smooth_lines  # noqa: E402
from post.trimming import THIN, area_of, loops_of, pieces_of  # noqa: E402

HEAD = """*UNITS
mm, t, s, N, MPa, mJ
*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
"""
SHEET = HEAD + """*BLANK, NAME=sheet, MATERIAL=steel, ELEMENT=SHELL
x, -60, 60, 2, 24
y, -60, 60, 2, 24
z, -0.5, 0.5, 2, 1
*BLANK OUTLINE
CIRCLE, 0, 0, 50
*BLANK OUTLINE, KEEP=OUTSIDE
CIRCLE, 20, 0, 10
CIRCLE, 0, 50, 8
*BLANK OUTLINE
START, -60, -45
LINE, 60, -45
LINE, 60, 60
LINE, -60, 60
*DYNAMIC, EXPLICIT
1e-6
"""
READER = HEAD + """*BLANK, NAME=sheet, MATERIAL=steel
x, -4, 4, 2, 4
y, -4, 4, 2, 4
z, -501, -500, 2, 1
*TOOL, NAME=plate, TYPE=IGES, SIDE={side}, INPUT=sheet.igs
*CONTACT PAIR, TOOL=plate, FACE=Z_MAX
*BOUNDARY
X_MIN, PINNED
*DYNAMIC, EXPLICIT
1e-6
"""


def call(*words, expect=0):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False,
                          timeout=300, env=dict(os.environ, OMP_WAIT_POLICY="passive",
                                                PYTHONPATH=str(PROJECT)))
    assert done.returncode == expect, done.stderr + done.stdout
    return done.stdout + done.stderr


def triangle_areas(points, triangles):
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def read_back(igaform, folder, result, face):
    """Area of a face of the sheet of a result that the solver has read as a tool, and x of its
    centre."""
    told = call(sys.executable, "-m", "post", "iges", result, "--face", face, "--out",
                folder / "sheet.igs")
    assert "1 trimmed surface in MM" in told, told
    lines = (folder / "sheet.igs").read_text().splitlines()
    n_curves = sum(line.startswith("     126 ") and line[72] == "D" for line in lines) // 2
    print("curves:", n_curves)
    assert n_curves <= 12, n_curves      # an edge of the outline is one, and one in space
    side = "POSITIVE" if face == "ZETA_MIN" else "NEGATIVE"      # the reader's sheet lies below
    (folder / "reader.key").write_text(READER.format(side=side))
    call(igaform, folder / "reader.key", "--out", folder / "reader.h5", "--quiet")
    with Results(folder / "reader.h5") as results:
        points, triangles = results.tool_surfaces(0, 4)[0]
    areas = triangle_areas(points, triangles)
    return areas.sum(), areas @ points[triangles].mean(axis=1)[:, 0] / areas.sum()


def area_of_sheet(path):
    """Area of the mid-surface that the outline leaves, in the last frame."""
    with Results(path) as results:
        patch, frame = results.patches[0], results.frame()
        lines = [np.linspace(0, n, 8 * n + 1) for n in patch.n_elements[:2]]
        places = [*lines, [0.5 * patch.n_elements[2]]]
        points = patch.sample("Points", frame, *places).reshape(-1, 3)
        return triangle_areas(*inside_outline(patch, frame, places, points)[:2]).sum()


def flat_disk(igaform, folder):
    """A disk less a hole, a lens at its edge and a segment, of three outlines that cross."""
    radius, small, cut = 50.0, 8.0, 45.0
    lens = small**2 * np.arccos(small / (2 * radius)) \
        + radius**2 * np.arccos(1 - small**2 / (2 * radius**2)) \
        - 0.5 * small * np.sqrt(4 * radius**2 - small**2)
    segment = radius**2 * np.arccos(cut / radius) - cut * np.sqrt(radius**2 - cut**2)
    exact = np.pi * (radius**2 - 10.0**2) - lens - segment
    (folder / "disk.key").write_text(SHEET)
    call(igaform, folder / "disk.key", "--out", folder / "disk.h5", "--quiet")
    for face in ("MIDDLE", "ZETA_MIN", "ZETA_MAX"):
        area, x = read_back(igaform, folder, folder / "disk.h5", face)
        print(f"{face} of a disk, area over the exact one: {area / exact}, centre at x = {x}")
        assert abs(area / exact - 1) < 3e-4 and abs(x * exact / (-2000 * np.pi) - 1) < 1e-2, (area,
                                                                                              x)
    told = call(sys.executable, "-m", "post", "iges", folder / "disk.h5", "--face", "XI_MIN",
                expect=1)
    assert "there are ZETA_MIN, ZETA_MAX, MIDDLE" in told, told
    assert "2 trimmed surfaces in MM" in call(
        sys.executable, "-m", "post", "iges", folder / "disk.key", "--igaform", igaform, "--out",
        folder / "sheet.igs")


def formed_sheet(igaform, folder):
    """A sheet that was bent, trimmed, released and cut once more."""
    result = folder / "chain.h5"
    call(igaform, PROJECT / "input/verification/trim_chain.key", "--out", result, "--quiet")
    ratio = read_back(igaform, folder, result, "MIDDLE")[0] / area_of_sheet(result)
    print("formed sheet, area over that of the pictures:", ratio)
    assert abs(ratio - 1) < 2e-3, ratio


def square(low, high):
    return np.array([[low, low], [high, low], [high, high], [low, high]], dtype=float)


def loops():
    """Loops of regions in the plane: edges on the border and on each other, several pieces."""
    for regions, areas in (
            ([([square(0, 4), square(1, 2)], False)], [[16, -1]]),       # the border as outline
            ([([square(0, 4)], False), ([square(1, 3)], True)], [[16, -4]]),
            ([([square(-1, 2)], True)], [[12]]),                         # a corner cut away
            ([([square(1, 2)[::-1], square(2.5, 3)], False)], [[1], [0.25]]),
            ([([square(0, 2)], False), ([square(1, 3)], False)], [[1]]),
            ([([square(0, 2)], False), ([np.array([[0, 0], [1, 0], [1, 2], [0, 2.0]])], True)],
             [[2]])):
        found = [[area_of(loop) for loop in piece]
                 for piece in pieces_of(loops_of(regions, (0, 0), (4, 4)))]
        assert len(found) == len(areas), (found, areas)
        for piece, expected in zip(found, areas):
            assert np.allclose(piece, expected, atol=1e-6), (found, areas)


def edges():
    """A rounded rectangle has four straight edges and four arcs, a circle two of its own."""
    angle = np.linspace(0, np.pi / 2, 2000)
    corners = np.array([[10, 10], [-10, 10], [-10, -10], [10, -10.0]])
    turns = np.arange(4) * np.pi / 2
    ring = np.concatenate([c + 3 * np.column_stack([np.cos(angle + turn), np.sin(angle + turn)])
                           for c, turn in zip(corners, turns)])
    circle = 9 * np.column_stack([np.cos(4 * angle[:-1]), np.sin(4 * angle[:-1])])
    ranges = np.array([40.0, 40.0])
    for polygon, degrees in ((ring, [1] * 4 + [3] * 4), (circle, [3, 3])):
        loop, = loops_of([([polygon], False)], (-20, -20), (20, 20))
        curves = [flat_curve(line, ranges) for line in smooth_lines(loop, ranges)]
        assert sorted(curve.degree for curve in curves) == degrees, curves
        for curve in curves:
            places = curve.at(np.linspace(0, 1, 1000))
            if polygon is ring:
                off = np.linalg.norm(np.maximum(np.abs(places) - 10, 0), axis=1) - 3
            else:
                off = np.linalg.norm(places, axis=1) - 9
            assert np.abs(off).max() < 2 * THIN * 40, off
        for curve, following in zip(curves, curves[1:] + curves[:1]):
            assert (curve.points[-1] == following.points[0]).all()


def main():
    igaform = pathlib.Path(sys.argv[1]).resolve()
    loops()
    edges()
    with tempfile.TemporaryDirectory() as name:
        flat_disk(igaform, pathlib.Path(name))
        formed_sheet(igaform, pathlib.Path(name))


main()
