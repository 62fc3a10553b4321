"""Trimmed tools from CAD: exit code 0 if a die cut into pieces forms a sheet as the whole one does.

usage: trimmed.py IGAFORM CASE
"""
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile

import h5py
import numpy as np

PROJECT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(PROJECT))

from post.results import Results  # noqa: E402

DECK = """*UNITS
mm, t, s, N, MPa, mJ
*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*PLASTIC, HARDENING=VOCE
250, 250, 6
*BLANK, NAME=sheet, MATERIAL=steel
x, -20, 20, 2, 16
y, -6, 6, 2, 5
z, 0, 1, 2, 1
*TOOL, NAME=die, TYPE=IGES, SIDE=NEGATIVE, INPUT={file}
{more}*TOOL MOTION, TOOL=die
0, 0, -20000
*CONTACT PAIR, TOOL=die, FACE=Z_MAX, COUNT="3,3"{friction}
*BOUNDARY
X_MIN, PINNED
X_MAX, PINNED
*DYNAMIC, EXPLICIT
1.5e-4
*OUTPUT, FRAMES=2, HISTORY=20
"""
N = (10, 6)            # pieces along the die
SIZE = np.array([60.0, 24.0])


class Iges:
    """A file of entities (IGES 5.3, fixed columns)."""

    def __init__(self):
        self.directory, self.values = [], []

    def add(self, kind, *values, status="00000000"):
        """Append an entity; its directory number."""
        number, first = len(self.directory) + 1, len(self.values) + 1
        text = ",".join([str(kind)] + [f"{v:d}" if isinstance(v, (int, np.integer))
                                       else repr(float(v)) for v in values]) + ";"
        while text:
            cut = text.rindex(",", 0, 64) + 1 if len(text) > 64 else len(text)
            self.values.append(f"{text[:cut]:<64}{number:8d}P{len(self.values) + 1:7d}")
            text = text[cut:]
        count = len(self.values) - first + 1
        self.directory += [f"{kind:8d}{first:8d}{0:8d}{0:8d}{0:8d}{0:8d}{0:8d}{0:8d}{status}D"
                           f"{number:7d}", f"{kind:8d}{0:8d}{0:8d}{count:8d}{0:8d}{'':32}D"
                           f"{number + 1:7d}"]
        return number

    def write(self, path):
        start = f"{'Surfaces and loops of a test.':<72}S{1:7d}"
        line = "1H,,1H;,,8HTEST.IGS,7Higaform,1H1,32,38,6,308,15,,1.,2,2HMM;"
        counts = zip("SGDP", (1, 1, len(self.directory), len(self.values)))
        last = "".join(f"{letter}{n:7d}" for letter, n in counts)
        path.write_text("\n".join([start, f"{line:<72}G{1:7d}"] + self.directory + self.values
                                  + [f"{last:<72}T{1:7d}"]) + "\n")


def add_die(file, status="00000000"):
    """A cubic surface with a round rib along y that fades towards its ends, one span of knots each
    4 by 6, parameters equal to x and y at the start of the net."""
    knots = [np.concatenate([np.zeros(3), np.linspace(0, size, n + 1), np.full(3, size)])
             for size, n in zip(SIZE, (15, 4))]
    x, y = (np.array([u[i + 1:i + 4].mean() for i in range(len(u) - 4)]) for u in knots)
    xx, yy = np.meshgrid(x - SIZE[0] / 2, y - SIZE[1] / 2)
    z = 12 - 10.5 * np.exp(-(xx / 9) ** 2) + 0.01 * yy ** 2
    points = np.stack([xx, yy, z], -1).reshape(-1, 3)
    return file.add(128, len(x) - 1, len(y) - 1, 3, 3, 0, 0, 1, 0, 0, *knots[0], *knots[1],
                    *np.ones(len(points)), *points.ravel(), 0.0, SIZE[0], 0.0, SIZE[1],
                    status=status)


def side(start, step, n):
    """Control points in the parameter plane of a side of a mesh; inner ones are waves."""
    points = np.array(start) + np.outer(np.arange(4) / 3, step)
    across = 1 - int(step[1])
    if 0 < start[across] < n[across]:
        points[1:3, across] += np.array([0.14, -0.11]) * (1 + 0.3 * (sum(start) % 3))
    return points / n * SIZE


def cut_die(path, n=N):
    """The die as n[0] by n[1] pieces, each the whole surface and a loop of four cubics."""
    file = Iges()
    for j in range(n[1]):
        for i in range(n[0]):
            surface = add_die(file, "00010000")
            corners = [side(start, step, n) for start, step in (
                ((i, j), (1, 0)), ((i + 1, j), (0, 1)), ((i, j + 1), (1, 0)), ((i, j), (0, 1)))]
            curves = [file.add(126, 3, 3, 1, 0, 1, 0, *([0.0] * 4), *([1.0] * 4), *([1.0] * 4),
                               *np.hstack([net, np.zeros((4, 1))]).ravel(), 0.0, 1.0, 0., 0., 1.,
                               status="00010500") for net in corners]
            loop = file.add(102, 4, *curves, status="00010500")
            curve = file.add(142, 0, surface, loop, 0, 1, status="00010500")
            file.add(144, surface, 1, 0, curve)
    file.write(path)


def run(igaform, deck, *words, expect=0):
    done = subprocess.run([igaform, deck, *words], capture_output=True, text=True, check=False,
                          timeout=300, env=dict(os.environ, OMP_WAIT_POLICY="passive"))
    assert done.returncode == expect, done.stderr + done.stdout
    return done.stdout + done.stderr


def pieces(igaform, folder):
    """Forces of a rib on a strip with friction: whole, in pieces, and the same of offsets."""
    file = Iges()
    add_die(file)
    file.write(folder / "whole.igs")
    cut_die(folder / "cut.igs")
    results = {}
    for name in ("whole", "cut"):
        deck = folder / f"{name}.key"
        deck.write_text(DECK.format(file=f"{name}.igs", more="", friction=", FRICTION=0.1"))
        told = run(igaform, deck, "--check")
        if name == "cut":
            assert f"{N[0] * N[1]} surfaces" in told, told
        run(igaform, deck, "--out", folder / f"{name}.h5", "--quiet")
        with h5py.File(folder / f"{name}.h5") as result:
            results[name] = (result["tools/die/force"][()], result["points/eqps"][()])
    for k, what in enumerate(("force", "plastic strain")):
        whole, cut = results["whole"][k], results["cut"][k]
        error = np.abs(whole - cut).max() / np.abs(whole).max()
        print(f"{what}: {error:.1e} of {np.abs(whole).max():.4g}")
        assert np.abs(whole).max() > 1e-3, "the die does not press"
        assert error < 1e-6, what


HOLED = """*UNITS
mm, t, s, N, MPa, mJ
*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*BLANK, NAME=sheet, MATERIAL=steel
x, {x[0]}, {x[1]}, 2, 4
y, 0, 4, 2, 4
z, -6, -5, 2, 1
*TOOL, NAME=plate, TYPE=IGES, INPUT=plate.igs
*TOOL PLACEMENT, TOOL=plate, CLEARANCE=0.25
0, 0, -1
*CONTACT PAIR, TOOL=plate, FACE=Z_MAX
*BOUNDARY
X_MIN, PINNED
*DYNAMIC, EXPLICIT
1e-6
"""


def shown_area(path, tool):
    """Area of a tool as pictures of a result have it, which end at its trims."""
    with Results(path) as results:
        points, triangles = dict(zip(results.tools, results.tool_surfaces(0, 4)))[tool]
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def check_written(igaform, folder):
    """What `post iges` writes of a trimmed tool has its loops when it is read back."""
    told = subprocess.run([sys.executable, "-m", "post", "iges", folder / "plate.h5", "--part",
                           "plate", "--out", folder / "again.igs"], capture_output=True, text=True,
                          check=False, env=dict(os.environ, PYTHONPATH=str(PROJECT)))
    assert "7 trimmed surfaces in MM" in told.stdout, told.stderr
    deck = folder / "again.key"
    deck.write_text(HOLED.format(x=(13, 17)).replace("plate.igs", "again.igs"))
    run(igaform, deck, "--out", folder / "again.h5", "--quiet")
    n_trimmed = 0
    with h5py.File(folder / "plate.h5") as one, h5py.File(folder / "again.h5") as other:
        for i in range(7):
            loops = [file[f"nurbs/tools/plate/surface_{i + 1}"].get("loops")
                     for file in (one, other)]
            assert (loops[0] is None) == (loops[1] is None), i
            n_trimmed += loops[0] is not None
            for name in ("sizes", "degrees", "points") if loops[0] else ():
                first, second = (np.sort(group[name][()], axis=0) for group in loops)
                assert np.allclose(first, second, rtol=0, atol=1e-9), (i, name)
    assert n_trimmed == 2, n_trimmed      # the faces with the hole; others fill their rectangles


def converter(igaform, folder):
    """A plate of 60 x 40 x 2 with a hole of radius 6 at (5, 2) as OpenCASCADE writes it
    (BRepBuilderAPI_NurbsConvert, IGESControl_Writer, write.surfacecurve.mode 1): a sheet below its
    solid part stops it at the clearance, one below the hole passes through at a known distance."""
    shutil.copy(pathlib.Path(__file__).parent / "plate.igs", folder)
    deck = folder / "plate.key"
    deck.write_text(HOLED.format(x=(13, 17)))
    told = run(igaform, deck, "--check")
    assert "7 surfaces of 98 entities" in told and "2 loops" in told, told
    assert "moved by (0, 0, -4.75), clearance 0.25" in told, told
    run(igaform, deck, "--out", folder / "plate.h5", "--quiet")
    area = shown_area(folder / "plate.h5", "plate")
    exact = 2 * (60 * 40 - np.pi * 36) + 2 * 200 + 2 * np.pi * 6 * 2
    print("area of the plate in pictures over the exact one", area / exact)
    assert abs(area / exact - 1) < 5e-4, area
    check_written(igaform, folder)
    deck.write_text(HOLED.format(x=(3, 7)))
    told = run(igaform, deck, "--check", expect=1)
    distance = float(told.split("passes the sheet at a distance of ")[1].split(";")[0])
    print("distance of the corners of the sheet from the hole", distance)
    assert abs(distance - (6 - 8 ** 0.5)) < 1e-6, told


def many(igaform, folder):
    """Processor time of `--check` with 1,000 and 10,000 pieces in a file. The limits are twice the
    times that it may take on a machine without other work, 5 and 60 s."""
    for n, limit in (((40, 25), 10.0), ((125, 80), 120.0)):
        cut_die(folder / "cut.igs", n)
        deck = folder / "cut.key"
        deck.write_text(DECK.format(file="cut.igs", more="", friction=""))
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        told = run(igaform, deck, "--check", "--threads", "1")
        seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        print(f"{n[0] * n[1]} faces: {seconds:.1f} s of processor time")
        assert f"{n[0] * n[1]} surfaces of" in told, told
        assert seconds < limit, seconds


CASES = {"pieces": pieces, "converter": converter, "many_long": many}
if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        CASES[sys.argv[2]](str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(name))
