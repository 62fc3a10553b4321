"""Tools from CAD: exit code 0 if what was written as IGES and read back runs like the original.

usage: run.py IGAFORM CASE INPUT
"""
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile

import h5py
import numpy as np

PROJECT = pathlib.Path(sys.argv[3]).resolve().parent
sys.path.insert(0, str(PROJECT))

from post.iges_file import Surface, write_iges  # noqa: E402

DIES = ("lower die", "upper die")
STRIP = {"closing": 12, "n_x": 35, "frames": 2, "history": 10}   # until the dies bend the strip


def call(igaform, *words, expect=0):
    done = subprocess.run([igaform, *map(str, words)], capture_output=True, text=True, check=False,
                          env=dict(os.environ, OMP_WAIT_POLICY="passive"), timeout=300)
    assert done.returncode == expect, done.stderr + done.stdout
    return done.stdout + done.stderr


def iges(igaform, *words, expect=0, limit=None):
    """What `python -m post iges` says; `limit`: the largest file that the system lets it write."""
    done = subprocess.run(
        [sys.executable, "-m", "post", "iges", "--igaform", igaform, *map(str, words)],
        capture_output=True, text=True, check=False, timeout=300,
        env=dict(os.environ, OMP_WAIT_POLICY="passive", PYTHONPATH=str(PROJECT)),
        preexec_fn=limit and (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))))
    assert done.returncode == expect, done.stderr + done.stdout
    return done.stdout + done.stderr


def numbers(path, *groups):
    """All arrays below the groups of a result file."""
    found = {}
    with h5py.File(path) as file:
        for group in groups:
            file[group].visititems(lambda key, item, group=group: found.update(
                {f"{group}/{key}": item[()]}) if isinstance(item, h5py.Dataset) else None)
    return found


def settings(**values):
    return [word for item in values.items() for word in ("--set", "{}={}".format(*item))]


def strip_of_cad_dies(igaform, folder, inputs):
    """The dies of the channel as IGES files give the strip of the tables, bit for bit."""
    decks = folder / "input"
    shutil.copytree(inputs, decks, ignore=shutil.ignore_patterns("*.h5", "studies"))
    strip = decks / "channel_strip.key"
    lines = []
    for die, side in zip(DIES, ("NEGATIVE", "POSITIVE")):
        name = die.replace(" ", "_") + ".igs"
        told = iges(igaform, strip, "--part", die, "--out", decks / "channel" / name)
        assert "1 surface in MM" in told, told
        lines.append(f"*TOOL, NAME={die}, TYPE=IGES, SIDE={side}, INPUT={name}\n")
    table, cad = folder / "table.h5", folder / "cad.h5"
    call(igaform, strip, "--out", table, "--quiet", *settings(**STRIP))
    (decks / "channel" / "dies.inc").write_text("".join(lines))
    told = call(igaform, strip, "--check", *settings(**STRIP))
    assert re.search("D1 rational B-spline surface upper di, area .* 2 x 2, 22 x 12", told), told
    call(igaform, strip, "--out", cad, "--quiet", *settings(**STRIP))
    assert "tool lower die from" in (folder / "cad.log").read_text()
    first, second = (numbers(path, "history", "points", "nurbs", "tools") for path in (table, cad))
    assert first.keys() == second.keys()
    for name, values in first.items():
        if "wall" not in name:
            assert np.array_equal(values, second[name], equal_nan=True), name
    assert first["points/eqps"].max() > 1e-3, "the dies do not press"
    print("largest plastic strain", first["points/eqps"].max())

    # The formed blank from the result: its faces, and one of them exactly.
    out = folder / "blank.igs"
    assert "6 surfaces in MM" in iges(igaform, cad, "--out", out)
    told = iges(igaform, cad, "--part", "sheet", "--out", out, expect=1)
    assert "blank, lower die, upper die" in told, told
    iges(igaform, cad, "--face", "ZETA_MAX", "--out", out)
    points = written_points(out)
    net = first["nurbs/blank/points"][-1].reshape(-1, 3)   # zeta last in Fortran, first here
    assert np.array_equal(points[np.lexsort(points.T)], net[np.lexsort(net.T)])
    iges(igaform, cad, "--face", "MIDDLE", "--out", out)
    middle = np.tensordot([0.25, 0.5, 0.25], first["nurbs/blank/points"], 1).reshape(-1, 3)
    assert np.abs(written_points(out) - middle).max() < 1e-9 * np.abs(middle).max()


def written_points(path):
    """Control points of the one surface of a file that post wrote."""
    values = written_values(path)
    k1, k2, m1, m2 = (int(value) for value in values[1:5])
    n = (k1 + 1) * (k2 + 1)
    first = 10 + k1 + m1 + 2 + k2 + m2 + 2 + n
    return values[first:first + 3 * n].reshape(-1, 3)


def written_values(path):
    """All values of the entities of a file that post wrote."""
    values = "".join(line[:64].strip() for line in path.read_text().splitlines()
                     if line[72:73] == "P").replace(";", ",").rstrip(",").split(",")
    return np.array([float(value.replace("D", "e")) for value in values])


DRUM = """*UNITS
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
y, -2, 2, 2, 2
z, 0, 1, 2, 1
{tool}
*TOOL MOTION, TOOL=drum
0, 0, -20000
*CONTACT PAIR, TOOL=drum, FACE=Z_MAX, COUNT="3,3"
*BOUNDARY
X_MIN, PINNED
X_MAX, PINNED
*DYNAMIC, EXPLICIT
2.5e-4
*OUTPUT, FRAMES=2, HISTORY=10
"""


def four_quarters(igaform, folder, _):
    """A cylinder of four surfaces, two of them inside out, presses like one surface."""
    one = folder / "one.key"
    one.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=CYLINDER\n0, -5, 11, 0, 10, 0\n10"))
    quarters = []
    for i in range(4):
        deck = folder / f"quarter{i}.key"
        deck.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=CYLINDER\n0, -5, 11, 0, 10, 0\n"
                                    f"10, {90 * i + 45}, 90"))
        part = folder / f"quarter{i}.igs"
        iges(igaform, deck, "--part", "drum", "--out", part)
        quarters.append(part)
    (folder / "four.igs").write_text(joined(quarters, inside_out=(1, 3)))
    four = folder / "four.key"
    four.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=IGES, INPUT=four.igs"))
    told = call(igaform, four, "--check")
    assert "joints: 4 pairs" in told and "2 surfaces" in told, told
    higher = folder / "higher.key"
    higher.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=CYLINDER\n0, -5, 20, 0, 10, 0\n10\n"
                                  "*TOOL PLACEMENT, TOOL=drum, CLEARANCE=0.5\n0, 0, -1"))
    told = call(igaform, higher, "--check")
    for words in "drum", "(0, 0, -8.5)", "0.5":
        assert words in told, told
    for deck in (one, four):
        call(igaform, deck, "--out", deck.with_suffix(".h5"), "--quiet")
    log = (folder / "four.log").read_text()   # areas and boxes cost time that no run needs
    assert "D1 rational B-spline surface, degrees 2 x 1" in log and ", area" not in log, log
    first, second = (numbers(folder / name, "nurbs/blank", "tools", "points")
                     for name in ("one.h5", "four.h5"))
    for name in ("nurbs/blank/points", "tools/drum/force", "points/eqps"):
        error = np.abs(first[name] - second[name]).max() / np.abs(first[name]).max()
        print(f"{name}: {error:.1e}")
        assert error < 1e-9, name
    assert first["points/eqps"].max() > 1e-3, "the drum does not press"


def joined(paths, inside_out):
    """One file of the surfaces of several; some have their first axis reversed."""
    head, directory, values = [], [], []
    for i, path in enumerate(paths):
        lines = path.read_text().splitlines()
        if not head:
            head = [line for line in lines if line[72:73] in "SG"]
        text = "".join(line[:64].strip() for line in lines if line[72:73] == "P").rstrip(";")
        text = reversed_axis(text.split(",")) if i in inside_out else text
        first = len(values) + 1
        for piece in pieces(text + ";"):
            values.append(f"{piece:<64}{2 * i + 1:8d}P{len(values) + 1:7d}")
        numbers_of = (128, first, 0, 0, 0, 0, 0, 0)
        directory.append("".join(f"{n:8d}" for n in numbers_of) + f"00000000D{2 * i + 1:7d}")
        numbers_of = (128, 0, 0, len(values) - first + 1, 0)
        directory.append("".join(f"{n:8d}" for n in numbers_of) + " " * 32 + f"D{2 * i + 2:7d}")
    counts = [sum(line[72:73] == letter for line in head) for letter in "SG"]
    last = "".join(f"{letter}{n:7d}" for letter, n in zip(
        "SGDP", counts + [len(directory), len(values)]))
    return "\n".join(head + directory + values + [f"{last:<72}T{1:7d}"]) + "\n"


def reversed_axis(values):
    """Values of an entity 128 with its first axis the other way round."""
    k1, k2, m1, m2 = (int(value) for value in values[1:5])
    n1, n2 = k1 + 1, k2 + 1
    at = [10, 10 + n1 + m1 + 1]
    at += [at[1] + n2 + m2 + 1, at[1] + n2 + m2 + 1 + n1 * n2, at[1] + n2 + m2 + 1 + 4 * n1 * n2]
    knots = [float(value) for value in values[at[0]:at[1]]]
    knots = [repr(knots[0] + knots[-1] - knot) for knot in knots[::-1]]
    weights = values[at[2]:at[3]]
    points = values[at[3]:at[4]]
    weights = [w for j in range(n2) for w in weights[j * n1:(j + 1) * n1][::-1]]
    rows = [[points[3 * k:3 * k + 3] for k in range(j * n1, (j + 1) * n1)][::-1] for j in range(n2)]
    points = [x for row in rows for point in row for x in point]
    return ",".join(values[:10] + knots + values[at[1]:at[2]] + weights + points + values[at[4]:])


def pieces(text):
    """Text in pieces of at most 64 characters that end with a comma."""
    while len(text) > 64:
        cut = text.rindex(",", 0, 64) + 1
        yield text[:cut]
        text = text[cut:]
    yield text


def tools_in_place(igaform, folder, _):
    """A placed tool and the offset that goes along are written where a run begins with them, of
    a result where its last frame has them."""
    deck, result, out = folder / "placed.key", folder / "placed.h5", folder / "part.igs"
    deck.write_text(DRUM.format(
        tool="*TOOL, NAME=drum, TYPE=CYLINDER\n0, -5, 311, 0, 10, 0\n10, 45, 90\n"
             "*TOOL, NAME=lid, TYPE=OFFSET, OF=drum\n-2\n*CONTACT PAIR, TOOL=lid, FACE=Z_MIN\n"
             "*TOOL PLACEMENT, TOOL=drum, CLEARANCE=0.5\n0, 0, -1").replace("2.5e-4", "1e-6"))
    call(igaform, deck, "--out", result, "--quiet")
    lowest = []
    for part, way in ("drum", -20000 * 1e-6), ("lid", 0):
        written = []
        for source in (deck, result):
            iges(igaform, source, "--part", part, "--out", out)
            written.append(written_points(out))
        assert np.allclose(written[0] + [0, 0, way], written[1], rtol=0, atol=1e-12), written
        lowest.append(written[0][:, 2].max())
    assert lowest[0] < 30, "the tool was left where the deck has it"
    print("highest points", lowest)


def refusals(igaform, folder, _):
    """What cannot be done is reported, with exit code 1 and no file left behind."""
    deck = folder / "drum.key"
    deck.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=IGES, INPUT=missing.igs"))
    told = call(igaform, deck, "--check", expect=1)
    assert "drum.key:14: error: *TOOL: " in told and "missing.igs" in told, told
    files = pathlib.Path(__file__).resolve().parents[3] / "input" / "cad"
    told = call(igaform, "faces", files / "s_rail_die_tool.igs")
    # a quarter of a cylinder of radius 9
    assert re.search(r"D63 .* F3, area 1221, box \(-150, -66.36, -9.92\) to ", told), told
    assert told.count(" trimmed surface F") == 27, told
    # one of them as a bounded surface: a tool is refused, the list says which
    odd = folder / "odd.igs"
    odd.write_text("".join(line.replace("144", "143", 1) if re.search("D     6[34]$|     63P", line)
                           else line for line in (files / "s_rail_die_tool.igs").open()))
    told = call(igaform, "faces", odd)
    assert "\nD63 bounded surface F3, not read: bounded in space\n" in told, told
    assert told.count(" trimmed surface F") == 26, told
    deck.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=IGES, INPUT=odd.igs"))
    assert "at D63: found a surface or curve bounded in space" in call(igaform, deck, expect=1)
    odd.unlink()
    for file in (files / "s_rail_die.step", folder / "missing.igs"):
        assert f"error: IGES: found {'no file ' * (file.suffix == '.igs')}`{file}`" in call(
            igaform, "faces", file, expect=1)
    deck.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=IGES"))
    told = call(igaform, deck, expect=1)
    assert "drum.key:14: error: *TOOL: " in told and "INPUT" in told, told
    deck.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=CYLINDER, INPUT=x.igs, LENGTH=M\n"
                                "0, -5, 11, 0, 10, 0\n10"))
    told = call(igaform, deck, expect=1)
    assert "option INPUT" in told and "TYPE=CYLINDER" in told, told
    assert "option LENGTH" in told, told
    deck.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=CYLINDER\n0, -5, 11, 0, 10, 0\n10"))
    other = folder / "other.key"
    text = deck.read_text()
    for units, words, unit in (("mm, t", (), "MM"), ("mm, t", ("--unit", "in"), "IN"),
                               ("cm, g", (), "CM"), ("", (), "MM"), ("", ("--length", "m"), "M")):
        other.write_text(text.replace("mm, t", units) if units else text.split("mJ\n")[1])
        told = iges(igaform, other, "--out", folder / "sheet.igs", *words)
        assert f"6 surfaces in {unit}\n" in told, told
        name = unit.replace("IN", "INCH")
        assert f",{len(name)}H{name}," in "".join(
            line[:72] for line in (folder / "sheet.igs").read_text().splitlines()
            if line[72:73] == "G"), unit
        assert ("post: warning: " in told) == (not units + "".join(words))
    (folder / "sheet.igs").unlink()
    told = call(igaform, "iges", deck, "--part", "drum", expect=1)
    assert told.count("\n") == 1 and "'python -m post iges FILE'" in told, told
    for words, told in ((("--unit", "furlong"), "MM"),
                        (("--part", "drum", "--face", "XI_MIN"), "blank"),
                        (("--part", "drun"), "'drun'; there are blank, drum; did you mean drum?"),
                        (("--face", "top"), "'TOP'"),
                        (("--out", folder / "nowhere" / "x.igs"), "nowhere"),
                        (("--set", "x=1"), "x"), (("--igaform", folder), "program"),
                        (("--out", deck), "drum.key")):
        said = iges(igaform, deck, *words, expect=1)
        assert told in said and not list(folder.glob("*.igs*")), said
    for name, told in (("none.key", "none.key"), ("text.h5", "text.h5"),
                       ("other.h5", "other.h5"),
                       ("tests.h5", "/nurbs"),
                       ("cut.h5", "/nurbs")):
        damaged(folder / name)
        said = iges(igaform, folder / name, "--out", folder / "x.igs", expect=1)
        assert told in said and "Traceback" not in said and not list(folder.glob("x.*")), said
        (folder / name).unlink(missing_ok=True)
    result = folder / "start.h5"
    call(igaform, deck, "--out", result, "--wall", "1e-9", "--quiet", expect=3)
    said = iges(igaform, result, "--out", folder / "x.igs", expect=1, limit=300)
    assert "x.igs': File too large" in said and not list(folder.glob("x.*")), said
    for path in folder.glob("start.*"):
        path.unlink()
    files_of_others(igaform, deck, folder)
    assert "drum.key" in [path.name for path in folder.iterdir()]
    iges(igaform, deck, "--part", "drum", "--out", folder / "drum.igs", "--length", "CM")
    text = (folder / "drum.igs").read_text()
    (folder / "drum.igs").write_text(text[:len(text) // 2])
    deck.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=IGES, INPUT=drum.igs"))
    told = call(igaform, deck, expect=1)
    assert "drum.igs:" in told, told
    assert not list(folder.glob("*.h5")) and not list(pathlib.Path().glob("drum.h5"))


def damaged(path):
    """A file that holds no shapes, by its name."""
    if path.name == "text.h5":
        path.write_text("no HDF5")
    elif path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            file.attrs["generator"] = "else" if path.name == "other.h5" else "igaform"
            if path.name == "cut.h5":
                file["nurbs/blank/degrees"] = [2, 2, 2]


def files_of_others(igaform, deck, folder):
    """A file of somebody, a link to it, a pipe, a folder stay as they are; an empty file and one
    that post has written are replaced, by a link that stays one."""
    place, mine = folder / "b.igs", folder / "mine.txt"
    words = (deck, "--part", "drum", "--out", place)
    mine.write_text("mine\n")
    for make in (lambda: place.write_text("mine\n"), place.mkdir,
                 lambda: place.symlink_to("mine.txt"), lambda: os.mkfifo(place)):
        make()
        before = place.lstat().st_ino
        said = iges(igaform, *words, expect=1)
        assert "b.igs" in said, said
        assert mine.read_text() == "mine\n" and place.lstat().st_ino == before, said
        place.rmdir() if place.is_dir() else place.unlink()
    mine.write_text("")
    place.symlink_to("mine.txt")
    for _ in range(2):
        iges(igaform, *words)
        assert place.is_symlink() and len(written_points(mine)) == 18, "a link was replaced"
    mine.unlink()
    place.unlink()


def awkward_surfaces():
    """Numbers with many digits, large and small ones, weights and knots of any scale."""
    random = np.random.default_rng(1)
    knots = (np.array([0, 0, 0, 1 / 3, 1, 1, 1]) / 3 + 1e5,
             np.array([-2, -2, 1 / 7, 1 / 7 + 1, 9, 9]))
    points = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="xy"), axis=-1) / 3
    points = np.dstack([points, random.normal(size=(4, 4)) * 1e-9])
    weights = (1 + random.random((4, 4))) * 1e-3
    yield Surface("a very long label", (2, 1), knots, points, weights)
    yield Surface("", (2, 1), knots, points * 1e7 + 5e11, np.ones((4, 4)))
    yield Surface("BALL", (1, 2), knots[::-1], points * [-1, 1, 1] - 1e-7, weights.T)


def values_read_back(igaform, folder, _):
    """What Python writes is what the file says, bit for bit, and what the program reads of it."""
    path, deck, result = folder / "written.igs", folder / "read.key", folder / "read.h5"
    for surface in awkward_surfaces():
        for unit, scale in ("MM", 1), ("IN", 25.4):
            write_iges(str(path), [surface], unit, "igaform test")
            n_eta, n_xi = surface.weights.shape
            heads = [128, n_xi - 1, n_eta - 1, *surface.degrees, 0, 0, np.ptp(surface.weights) == 0,
                     0, 0]
            ends = [knots[i] for knots in surface.knots for i in (0, -1)]
            expected = np.concatenate([heads, *surface.knots, surface.weights.ravel(),
                                       surface.points.ravel(), ends])
            assert np.array_equal(written_values(path), expected), surface.label
            deck.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=IGES, INPUT=written.igs")
                            .replace('*CONTACT PAIR, TOOL=drum, FACE=Z_MAX, COUNT="3,3"\n', ""))
            told = call(igaform, deck, "--check")
            assert f"D1 rational B-spline surface {surface.label[:8]}".rstrip() in told, told
            call(igaform, deck, "--out", result, "--wall", "1e-9", expect=3)
            read = numbers(result, "nurbs/tools/drum/surface_1")
            read = {name.rsplit("/", 1)[1]: values for name, values in read.items()}
            assert np.array_equal(read["degrees"], surface.degrees)
            assert np.array_equal(read["weights"], surface.weights)
            assert all(np.array_equal(read[f"knots_{i + 1}"], surface.knots[i]) for i in (0, 1))
            error = np.abs(read["points"] / scale - surface.points).max()
            assert error <= (0 if scale == 1 else 1e-12 * np.abs(surface.points).max()), error


def free_faces(igaform, folder, inputs):
    """Faces where patches are joined, to others or to themselves, are left out; normals point
    outwards."""
    out = folder / "part.igs"
    for name, n_faces in ("two_boxes", 10), ("ring", 4), ("cup_free", 24):
        deck = pathlib.Path(inputs).parent / "tests" / "verification" / "patches" / f"{name}.key"
        told = iges(igaform, deck, "--out", out)
        assert f"{n_faces} surfaces in MM" in told, told
    deck = folder / "sheet.key"
    deck.write_text(DRUM.format(tool="*TOOL, NAME=drum, TYPE=CYLINDER\n0, -5, 11, 0, 10, 0\n10"))
    for name, n_xi, outwards in (
            ("XI_MIN", 4, (-1, 0, 0)), ("XI_MAX", 4, (1, 0, 0)), ("ETA_MIN", 18, (0, -1, 0)),
            ("ETA_MAX", 18, (0, 1, 0)), ("ZETA_MIN", 18, (0, 0, -1)), ("ZETA_MAX", 18, (0, 0, 1))):
        iges(igaform, deck, "--face", name.lower(), "--out", out)
        points = written_points(out)
        normal = np.cross(points[1] - points[0], points[n_xi] - points[0])
        assert np.allclose(normal / np.linalg.norm(normal), outwards), name
        assert (points @ outwards == points[0] @ outwards).all(), name


def main(igaform, case, inputs):
    cases = {"strip": strip_of_cad_dies, "quarters": four_quarters, "placed": tools_in_place,
             "values": values_read_back, "faces": free_faces, "refusals": refusals}
    with tempfile.TemporaryDirectory() as folder:
        cases[case](igaform, pathlib.Path(folder), inputs)


if __name__ == "__main__":
    main(*sys.argv[1:])
