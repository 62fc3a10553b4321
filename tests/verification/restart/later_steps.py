"""Steps of the deck that have not begun may change, come and go when a run is taken up again.

A sheet is drawn over a roll, cut and let go, all in explicit steps; a bar meets it at last. What is
run on from a checkpoint has the bits of the whole run of the deck that it goes on with.

Usage: later_steps.py PROGRAM PROJECT
"""
import h5py
import numpy as np

from common import check_same, datasets, igaform, run_all

DRAW = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*PLASTIC, HARDENING=SWIFT
500, 0.005, 0.2
*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, ELEMENT=SHELL
x, -30, 30, 2, 9
y, -20, 20, 2, 6
z, -0.5, 0.5, 2, 1
*TOOL, NAME=roll, TYPE=CYLINDER
0, -40, -8.6, 0, 80, 0
8, 0, 360
*TOOL, NAME=bar, TYPE=CYLINDER
0, -40, 9, 0, 80, 0
4, 0, 360
*CONTACT PAIR, TOOL=roll, FACE=Z_MIN, FRICTION=0.1
*AMPLITUDE, NAME=soft
0, 0, 2e-4, 1, 1, 1
*STEP, NAME=draw
*BOUNDARY
X_MIN, ENCASTRE
X_MAX, ENCASTRE
*DYNAMIC, EXPLICIT
6e-4
*TOOL MOTION, TOOL=roll, AMPLITUDE=soft
0, 0, 8000
*OUTPUT, FRAMES=2, HISTORY=10
*END STEP
"""
CUT = """*STEP, NAME=cut
*DYNAMIC, EXPLICIT
2e-4
*TRIM, NAME=disk
CIRCLE, {x}, 0.7, {radius}
*BOUNDARY, OP=NEW
*MODEL CHANGE, REMOVE
roll
*OUTPUT, FRAMES=2, HISTORY=10
*END STEP
"""
CUT_BY_TABLE = CUT.replace("\nCIRCLE, {x}, 0.7, {radius}", ", INPUT=disk.csv")
SQUARE = "-9,-8\n9,-8\n9,8\n-9,8\n"
# The pair of the bar begins after the cut.
MEET = """*STEP, NAME=meet
*DYNAMIC, EXPLICIT
2e-4
*CONTACT PAIR, TOOL=bar, FACE=Z_MAX, DAMPING=0.1
*TOOL MOTION, TOOL=bar, AMPLITUDE={curve}
0, 0, -20000
*OUTPUT, FRAMES=2, HISTORY=10
*END STEP
"""
LASTING = "*CHECKPOINT, NUMBER=1\n" + DRAW
KNOCK = "*AMPLITUDE, NAME=knock\n0, 0, 1e-4, 1, 1, 1\n"


def write(folder, name, *parts):
    path = folder / name
    path.write_text("".join(parts))
    return path


def goes_on_as_the_whole(folder, path, checkpoint, threads=2):
    """The bits of a run that goes on with a deck are those of all of that deck. Its log."""
    igaform(folder, path.name, "--out", "whole.h5", "--threads", 1)
    igaform(folder, path.name, "--restart", checkpoint, "--out", "on.h5", "--threads", threads)
    check_same(folder / "on.h5", datasets(folder / "whole.h5"))
    return (folder / "on.log").read_text()


def a_trim_that_fails_can_be_mended(folder):
    """The end of the step before is saved, and the message says how to go on."""
    bad = write(folder, "bad.key", DRAW, CUT.format(x=100, radius=12))
    said = igaform(folder, bad.name, "--out", "a.h5", code=2)
    line = bad.read_text().splitlines().index("*TRIM, NAME=disk") + 1
    assert f"step 2 cannot begin: bad.key:{line}: *TRIM, NAME=disk: " in said, said
    assert "in 'a.ckpt.h5', the end of step 1 of the deck" in said, said
    assert "igaform bad.key --restart a.ckpt.h5" in said and "RETRY" not in said, said
    again = igaform(folder, bad.name, "--restart", "a.ckpt.h5", code=2)
    assert again.splitlines()[-2:] == said.splitlines()[-2:], again
    good = write(folder, "good.key", DRAW, CUT.format(x=1, radius=12))
    told = igaform(folder, good.name, "--check", "--restart", "a.ckpt.h5")
    log = goes_on_as_the_whole(folder, good, "a.ckpt.h5")
    for text in (told, log):
        assert f"deck after step 1, now: *TRIM (good.key:{line})" in text, text
        assert f"deck after step 1, before: *TRIM (bad.key:{line})" in text, text
        assert text.count("after step 1") == 2, text
    with h5py.File(folder / "on.h5") as file:
        text = file["provenance/deck_text"][()].decode()
        assert text.rstrip().endswith(good.read_text().rstrip()), text
        assert file["provenance/deck_file"][()] == b"good.key"
        assert b"CIRCLE, 1," in file["provenance/deck_resolved"][()]


def steps_come_and_go(folder):
    """Steps with the first trim of a deck, its table, and the first use of a tool and of an
    amplitude; the same without them."""
    short = write(folder, "short.key", LASTING)
    igaform(folder, short.name, "--out", "a.h5")
    (folder / "disk.csv").write_text(SQUARE)
    long = write(folder, "long.key", KNOCK, LASTING, CUT_BY_TABLE, MEET.format(curve="knock"))
    log = goes_on_as_the_whole(folder, long, "a.ckpt.h5")
    for words in ("*AMPLITUDE (long.key:", "*STEP (", "*TRIM (", "*CONTACT PAIR (",
                  "the file 'disk.csv'"):
        assert f"deck after step 1, now: {words}" in log, log
    assert log.count("now: *DYNAMIC (") == 2 and "*END STEP" not in log, log
    with h5py.File(folder / "on.h5") as file:
        distance = file["VTKHDF/PointData/edge_distance"][:]
        assert len(distance) == file["VTKHDF/Points"].shape[0], distance.shape
        assert list(file["frames/process_step"].attrs["names"].decode().split(", ")) == \
            ["draw", "cut", "meet"]
    igaform(folder, long.name, "--out", "b.h5", "--wall", "1e-9", code=3)
    (folder / "disk.csv").unlink()
    igaform(folder, short.name, "--restart", "b.ckpt.h5")
    with h5py.File(folder / "a.h5") as one, h5py.File(folder / "b.h5") as other:
        distance = other["VTKHDF/PointData/edge_distance"][:]
        assert (distance > 30).all() and len(distance) == other["VTKHDF/Points"].shape[0]
        for name in ("VTKHDF/Points", "VTKHDF/PointData/mises", "history/internal_energy"):
            assert np.array_equal(one[name][:], other[name][:], equal_nan=True), name


def a_pair_that_begins_after_a_trim(folder):
    """Its springs fit the masses that the trim leaves, whether the run was stopped or not."""
    cut, meet = CUT.format(x=1, radius=12), MEET.format(curve="soft")
    failing = write(folder, "failing.key", DRAW, cut,
                    meet.replace("*TOOL", "*TRIM, NAME=all\nCIRCLE, 100, 0, 1\n*TOOL"))
    igaform(folder, failing.name, "--out", "b.h5", code=2)
    log = goes_on_as_the_whole(folder, write(folder, "pair.key", DRAW, cut, meet), "b.ckpt.h5")
    assert "deck after step 2, before: *TRIM (failing.key:" in log, log
    with h5py.File(folder / "on.h5") as file:
        assert np.abs(file["tools/bar/force"][:]).max() > 1, "the bar meets nothing"


def what_was_simulated_must_be_the_same(folder):
    """Keywords of the step under way and before it, what they name, and their files."""
    cut = CUT_BY_TABLE
    (folder / "disk.csv").write_text(SQUARE)
    path = write(folder, "a.key", DRAW, cut)
    igaform(folder, path.name, "--out", "a.h5", "--wall", "1e-9", code=3)
    igaform(folder, write(folder, "b.key", LASTING, cut).name, "--out", "b.h5")

    def refused(checkpoint, text, keyword, step):
        said = igaform(folder, write(folder, "c.key", text).name, "--restart", checkpoint,
                       "--out", "c.h5", code=1)
        assert "rejected: it belongs to another deck" in said and f"{keyword} (c.key:" in said, said
        assert f"it is of step {step}, and only later steps" in said, said
        assert not (folder / "c.h5").exists()

    refused("a.ckpt.h5", DRAW.replace("2e-4, 1, 1", "3e-4, 1, 1") + cut, "*AMPLITUDE", 1)
    refused("a.ckpt.h5", DRAW.replace("0, 0, 8000", "0, 0, 9000") + cut, "*TOOL MOTION", 1)
    refused("b.ckpt.h5", DRAW + cut.replace("NAME=disk", "NAME=disk, KEEP=OUTSIDE"), "*TRIM", 2)
    refused("b.ckpt.h5", DRAW.replace("6e-4", "5e-4") + cut, "*DYNAMIC", 2)
    said = igaform(folder, write(folder, "c.key", DRAW).name, "--restart", "b.ckpt.h5", code=1)
    assert "*STEP (b.key:" in said and "does not exist now" in said, said
    stiff = CUT.format(x=1, radius=12).replace("*MODEL CHANGE, REMOVE\nroll\n", "")
    pair = "TOOL=bar, FACE=Z_MAX, PENALTY SCALE=1.2"
    both = write(folder, "c.key", DRAW, stiff, MEET.format(curve="soft").replace(
        "TOOL=bar, FACE=Z_MAX", pair))
    said = igaform(folder, both.name, "--restart", "a.ckpt.h5", "--out", "c.h5", code=1)
    assert "rejected: its state does not fit this deck: contact roll" in said, said
    assert ": its penalty is 0.4" in said and "now and was 0.5, since" in said, said
    (folder / "disk.csv").write_text(SQUARE.replace("8", "7"))
    said = igaform(folder, path.name, "--restart", "b.ckpt.h5", code=1)
    assert "the file 'disk.csv' is new or not what it was" in said, said


def a_pair_that_has_ended_may_have_any_penalty(folder):
    """Tools that begin together share what the roll, gone before, had alone when it had it."""
    ended = CUT.format(x=1, radius=12)
    igaform(folder, write(folder, "a.key", LASTING, ended).name, "--out", "a.h5")
    both = write(folder, "both.key", LASTING, ended, MEET.format(curve="soft").replace(
        "FACE=Z_MAX", "FACE=Z_MAX, PENALTY SCALE=1.2").replace(
        "*TOOL", "*MODEL CHANGE, ADD\nroll\n*TOOL"))
    igaform(folder, both.name, "--restart", "a.ckpt.h5", "--out", "on.h5")
    with h5py.File(folder / "on.h5") as file:
        assert np.abs(file["tools/bar/force"][:]).max() > 1, "the bar meets nothing"


def a_check_refuses_what_a_run_refuses(folder):
    """A tool that begins to rotate has no torque in the history so far; other fields. Nothing is
    left of the check, and the result stays."""
    igaform(folder, write(folder, "a.key", LASTING).name, "--out", "a.h5")
    turn = MEET.format(curve="soft").replace("\n0, 0, -20000", ", TYPE=ANGULAR VELOCITY\n"
                                             "0, 0, 9, 0, 1, 0\n100")
    write(folder, "turn.key", LASTING, turn)
    write(folder, "wear.key", LASTING.replace("HISTORY=10", "HISTORY=10, FIELDS=WEAR"))
    write(folder, "good.key", LASTING, CUT.format(x=1, radius=12))
    files = {file.name: file.read_bytes() for file in folder.iterdir()}
    for name, reason in (("turn", "tool 'bar' rotates"), ("wear", "FIELDS=NONE"), ("good", "")):
        words = [f"{name}.key", "--restart", "a.ckpt.h5"]
        checked = igaform(folder, *words, "--check", code=1 if reason else 0)
        assert {file.name: file.read_bytes() for file in folder.iterdir()} == files
        said = igaform(folder, *words, "--out", "on.h5", code=1 if reason else 0)
        assert reason in said and said in checked, (checked, said)


if __name__ == "__main__":
    run_all(a_trim_that_fails_can_be_mended, steps_come_and_go, a_pair_that_begins_after_a_trim,
            what_was_simulated_must_be_the_same, a_pair_that_has_ended_may_have_any_penalty,
            a_check_refuses_what_a_run_refuses)
