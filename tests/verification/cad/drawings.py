"""Outlines from files with the whole program: a disk and a slotted plate, each by data lines, as a
table and as an IGES file, and from DXF drawings where ezdxf is there. Gravity gives the sheet the
momentum of its mass, so its area is known.

usage: drawings.py IGAFORM PROJECT
"""
import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy as np

PROJECT = pathlib.Path(sys.argv[2]).resolve()
sys.path.insert(0, str(PROJECT))

from post.cad import drawing  # noqa: E402
from post.cad.outlines import Arc, Line, Spline, area_of, chained, corners_of  # noqa: E402
from post.cad.outlines import write_curves, write_table  # noqa: E402
from post.results import ResultsError  # noqa: E402

DENSITY, THICKNESS, TIME, WEIGHT = 7.85e-9, 1.0, 1e-5, 1e6
DECK = """*UNITS
mm, t, s, N, MPa, mJ
*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*BLANK, MATERIAL=steel, ELEMENT=SHELL
x, -60, 60, 2, 24
y, -60, 60, 2, 24
z, -0.5, 0.5, 2, 1
*BLANK OUTLINE{option}
{lines}*GRAVITY
0, 0, -1e6
*DYNAMIC, EXPLICIT
1e-5
*OUTPUT, FRAMES=1, HISTORY=2
"""
DISK = np.pi * 50.0**2
SLOTTED = 100.0 * 60.0 - (np.pi * 8.0**2 + 40.0 * 16.0)    # a plate with a slot of 56 x 16


def area_in_run(igaform, folder, name, option="", lines=""):
    """Area of the sheet that a run keeps, by its momentum."""
    deck, result = folder / f"{name}.key", folder / f"{name}.h5"
    deck.write_text(DECK.format(option=option, lines=lines))
    done = subprocess.run([igaform, deck, "--out", result, "--quiet"], capture_output=True,
                          text=True, check=False, timeout=300,
                          env=dict(os.environ, OMP_WAIT_POLICY="passive"))
    assert done.returncode == 0, done.stderr
    with h5py.File(result) as file:
        time = file["history/time"][-1] + 0.5 * file["history/dt"][-1]     # of the velocities
        momentum = file["history/momentum"][-1, 2]
    return -momentum / (DENSITY * THICKNESS * WEIGHT * time)


def disk_pieces():
    """A circle as an arc, a rational spline of half a circle, and another arc."""
    w = np.sqrt(0.5)
    points = 50.0 * np.array([[0, 1, 0], [-1, 1, 0], [-1, 0, 0], [-1, -1, 0], [0, -1, 0]])
    spline = Spline(2, np.array([0, 0, 0, 1, 1, 2, 2, 2.0]), points, np.array([1, w, 1, w, 1]))
    return [Arc(np.zeros(3), 50.0, 0.0, np.pi / 2), spline,
            Arc(np.zeros(3), 50.0, -np.pi / 2, np.pi / 2)]


def slotted_pieces():
    corners = np.array([[-50, -30, 0], [50, -30, 0], [50, 30, 0], [-50, 30, 0.0]])
    sides = [Line(a, b) for a, b in zip(corners, np.roll(corners, -1, axis=0))]
    slot = [Line(np.array([-20, -8, 0.0]), np.array([20, -8, 0.0])),
            Arc(np.array([20, 0, 0.0]), 8.0, -np.pi / 2, np.pi),
            Line(np.array([20, 8, 0.0]), np.array([-20, 8, 0.0])),
            Arc(np.array([-20, 0, 0.0]), 8.0, np.pi / 2, np.pi)]
    return [piece for pair in zip(sides, slot) for piece in pair]


def by_files(igaform, folder):
    """Data lines, table and IGES file keep the same sheet."""
    shapes = (("disk", DISK, disk_pieces(), "CIRCLE, 0, 0, 50\n"),
              ("slotted", SLOTTED, slotted_pieces(),
               "START, -50, -30\nLINE, 50, -30\nLINE, 50, 30\nLINE, -50, 30\nSTART, -20, -8\n"
               "LINE, 20, -8\nARC, 28, 0, 20, 8\nLINE, -20, 8\nARC, -28, 0, -20, -8\n"))
    for name, exact, pieces, lines in shapes:
        loops = chained(pieces, 1e-6)
        write_table(str(folder / f"{name}.csv"), [corners_of(loop, 1e-5) for loop in loops], "MM")
        write_curves(str(folder / f"{name}.igs"), loops, "MM", 1e-6)
        areas = {"data lines": area_in_run(igaform, folder, name, lines=lines)}
        for ending in ("csv", "igs"):
            areas[ending] = area_in_run(igaform, folder, name, f", INPUT={name}.{ending}")
        for way, area in areas.items():
            print(f"{name} by {way}: area off by {area / exact - 1:.1e}")
            assert abs(area / exact - 1) < 1e-6, (name, way)


def plan(units):
    """A drawing of a slotted plate whose slot is a polyline with bulges in a block, with a circle,
    an ellipse, splines, a text and a hidden line beside it."""
    import ezdxf
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = units
    space = document.modelspace()
    for name in ("plate", "others", "hidden"):
        document.layers.add(name)
    document.layers.get("hidden").off()
    attributes = {"layer": "plate"}
    corners = [(-50, -30), (50, -30), (50, 30), (-50, 30)]
    for a, b in zip(corners[:3], corners[1:]):
        space.add_line(a, b, dxfattribs=attributes)
    space.add_line((-50, -30), (-50, 30), dxfattribs=attributes)
    block = document.blocks.new("slot")
    block.add_lwpolyline([(-20, -8, 0), (20, -8, 1), (20, 8, 0), (-20, 8, 1)], format="xyb",
                         close=True, dxfattribs=attributes)
    space.add_blockref("slot", (0, 0), dxfattribs=attributes)
    space.add_blockref("slot", (20, 5), dxfattribs={"layer": "hidden"})
    space.add_text("plate 100 x 60", dxfattribs=attributes)
    space.add_line((0, 0), (9, 9), dxfattribs={"layer": "hidden"})
    others = {"layer": "others"}
    space.add_circle((200, 0), 10, dxfattribs=others)
    space.add_ellipse((300, 0), (20, 0), 0.5, dxfattribs=others)
    space.add_arc((400, 0), 10, 30, 210, dxfattribs=others)
    space.add_arc((-700, 0), 10, -30, 150, dxfattribs={**others, "extrusion": (0, 0, -1)})
    angles = np.linspace(0, 2 * np.pi, 25)
    space.add_spline([(500 + 10 * np.cos(t), 10 * np.sin(t)) for t in angles], dxfattribs=others)
    space.add_polyline2d([(600, 0, 1), (610, 0, 1)], format="xyb", close=True, dxfattribs=others)
    return document


def convert(folder, *words, expect=0):
    done = subprocess.run([sys.executable, "-m", "post", "cad", *map(str, words)], cwd=folder,
                          capture_output=True, text=True, check=False, timeout=120,
                          env=dict(os.environ, PYTHONPATH=os.pathsep.join(
                              [str(PROJECT), *filter(None, [os.environ.get("PYTHONPATH")])])))
    assert done.returncode == expect, done.stderr + done.stdout
    return done.stdout + done.stderr


def by_drawings(igaform, folder):
    """Curves of every kind with their areas, units, layers; what is left out and what is wrong."""
    plan(4).saveas(folder / "plan.dxf")
    told = convert(folder, "plan.dxf", "--layer", "plate", "--out", "plate.csv")
    print(told)
    assert "lengths in millimetre: 8 curves (6 line, 2 arc) on layer plate" in told, told
    assert "1 TEXT" in told and "1 hidden LINE" in told, told
    convert(folder, "plan.dxf", "--layer", "plate")
    for name in ("plate.csv", "plan-outline.igs"):
        area = area_in_run(igaform, folder, "plate", f", INPUT={name}")
        print(f"{name}: area off by {area / SLOTTED - 1:.1e}")
        assert abs(area / SLOTTED - 1) < 1e-6, name
    told = convert(folder, "plan.dxf", "--layer", "others", "--tolerance", 1e-6, "--out", "o.csv",
                   expect=1)
    assert "ARC #" in told and "(391.34, -5)" in told and "20 from the nearest" in told, told
    document, others = plan(1), {"layer": "others"}
    for arc in document.modelspace().query("ARC"):
        document.modelspace().add_line(arc.start_point, arc.end_point, dxfattribs=others)
    document.saveas(folder / "plan.dxf")
    told = convert(folder, "plan.dxf", "--layer", "others", "--tolerance", 1e-6, "--out", "o.csv",
                   "--unit", "in")
    areas = sorted(float(line.split("area ")[1].split(",")[0]) for line in told.splitlines()
                   if "closed curve of" in line and "area" in line)
    assert "lengths in inch" in told, told
    expected = np.pi * np.array([5.0**2, 50, 50, 100, 100, 200])
    print("areas over the exact ones:", areas / expected)
    assert np.abs(areas / expected - 1).max() < 4e-4, areas         # a spline through 25 points
    assert np.abs(np.delete(areas / expected, 3) - 1).max() < 1e-6, areas


def refusals(folder):
    (folder / "damaged.dxf").write_text("0\nSECTION\n2\nHEADER\n9\n")
    told = convert(folder, "damaged.dxf", expect=1)
    assert "damaged.dxf' is damaged" in told or "cannot read" in told, told
    document = plan(4)
    document.saveas(folder / "plan.dxf")
    told = convert(folder, "plan.dxf", "--list", "--out", "x.step", expect=1)
    assert "--list is not for" in told and "written as .csv or .igs" in told, told
    told = convert(folder, "plan.dxf", "--layer", "sides", expect=1)
    assert "no curve on 'sides'; there are others, plate" in told, told
    (folder / "notes.csv").write_text("mine\n")
    told = convert(folder, "plan.dxf", "--layer", "plate", "--out", "notes.csv", expect=1)
    assert "left alone" in told and (folder / "notes.csv").read_text() == "mine\n", told
    document.modelspace().add_line((0, 0, 0), (1, 1, 50), dxfattribs={"layer": "plate"})
    document.saveas(folder / "plan.dxf")
    told = convert(folder, "plan.dxf", "--layer", "plate", expect=1)
    assert "one plane of constant z" in told, told


def is_missing_told(folder):
    """Without ezdxf one line says what to install."""
    (folder / "some.dxf").write_text("0\nSECTION\n")
    there = importlib.util.find_spec
    importlib.util.find_spec = lambda name, *more: None if name == "ezdxf" else there(name, *more)
    try:
        arguments = type("Arguments", (), {"file": "some.dxf", "quiet": True})()
        drawing.run(arguments, 1.0)
        raise AssertionError("it did not refuse")
    except ResultsError as fault:
        assert "pip install ezdxf" in str(fault) and "\n" not in str(fault), fault
    finally:
        importlib.util.find_spec = there


def main():
    igaform = str(pathlib.Path(sys.argv[1]).resolve())
    assert abs(area_of(corners_of(chained(disk_pieces(), 1e-9)[0], 1e-6)) / DISK - 1) < 1e-7
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        by_files(igaform, folder)
        is_missing_told(folder)
        if importlib.util.find_spec("ezdxf") is None:
            print("no ezdxf: drawings are not tried")
            return
        by_drawings(igaform, folder)
        refusals(folder)


main()
