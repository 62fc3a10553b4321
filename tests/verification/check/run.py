"""What the program tells of a model without running it, against the run: counts, mass, step and
steps of `--check`, frequencies of `--modes`; and how it begins, with short waiting of threads.

usage: run.py IGAFORM SOURCE
"""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import h5py
import numpy as np

PROGRAM, INPUT = sys.argv[1], pathlib.Path(sys.argv[2]) / "input"
STRIP = INPUT / "tension_strip.key"
SMALL = ("--set", "n_x=5", "--set", "n_y=3")
EDGES = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*BLANK, NAME=strip, MATERIAL=steel, TYPE=BOX, ELEMENT={element}
x, 0, 40, 2, 5
y, 0, 10, 2, 3
z, 0, 1, 2, 1
*BOUNDARY
X_MIN, ENCASTRE
Y_MIN, YSYMM
X_MAX, PINNED
*PRESSURE
Z_MAX, 0.1
*DYNAMIC, EXPLICIT
1.0e-4
"""


def igaform(folder, *words, code=0, program=PROGRAM):
    done = subprocess.run([program, *map(str, words)], cwd=folder, capture_output=True, text=True,
                          timeout=100)
    assert done.returncode == code, f"{words}: exit code {done.returncode}, not {code}\n" \
                                    f"{done.stdout}\n{done.stderr}"
    return done.stdout, done.stderr


def check(folder, deck, *words):
    """What --check tells, label by label; the effects in a list. It leaves no file."""
    before = sorted(folder.iterdir())
    out, err = igaform(folder, deck, "--check", *words)
    assert err == "" and sorted(folder.iterdir()) == before, err
    told = {"effect": []}
    for line in out.splitlines():
        label, words = line[:17].strip(), line[17:]
        if label == "effect":
            told[label].append(words)
        else:
            told.setdefault(label, words)
    return told


def effects_of(log):
    return re.findall(r"^effect     (\S.*)$", log.read_text(), re.M)


def close(told, expected, tolerance):
    number = float(re.search(r"[-+.\deE]+", told)[0])
    assert abs(number / expected - 1) <= tolerance, (told, expected)


def counts_are_those_of_the_run(folder):
    deck = folder / "strip.key"
    deck.write_text(STRIP.read_text().replace("*OUTPUT", "*BULK VISCOSITY\n0, 0\n*OUTPUT"))
    words = (*SMALL, "--set", "end_time=1e-4")
    told = check(folder, deck, *words)
    igaform(folder, deck, *words, "--quiet", "--out", "a.h5")
    with h5py.File(folder / "a.h5") as file:
        nets = file["nurbs/blank/points"].shape[:-1]
        per_element = np.array(file["points/eqps"].shape[::-1]) // [5, 3, 1]
        steps, dt = int(file["history/step"][-1]), file["history/dt"][0]
        mass = file["provenance/blank_mass"][()]
    assert told["blank"] == "strip" and told["elements"] == "15 (5 x 3 x 1)", told
    assert told["degrees"] == "2 x 2 x 2", told
    assert told["control points"] == str(np.prod(nets)) == str(7 * 5 * 3), told
    assert told["points"].startswith(f"{np.prod(per_element)} an element (3 x 3 x 3)"), told
    assert told["tools"] == "0" and "patch" not in told and "seams" not in told, told
    close(told["mass"], mass, 1e-3)
    close(told["mass"], 7.85e-9 * 40 * 10 * 1, 1e-3)
    close(told["stable increment"], dt / 0.8, 0.2)      # equal shares between outputs round it down
    close(told["steps"], steps, 0.05)
    assert told["effect"] == effects_of(folder / "a.log"), told
    assert told["effect"] == [f"boundary {face}" for face in ("X_MIN", "Y_MIN", "Z_MIN", "X_MAX")]


def supports_of_several_components_are_told_once(folder):
    """Each component of a clamped edge, and of what follows a plane of symmetry, is an effect."""
    deck = folder / "sheet.key"
    deck.write_text("""*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, ELEMENT=SHELL
x, 0, 30, 2, 4
y, 0, 20, 2, 3
z, 0, 1, 2, 1
*BOUNDARY
X_MIN, XSYMM
Y_MIN, YSYMM
X_MAX, ENCASTRE
*BULK VISCOSITY
0, 0
*DYNAMIC, EXPLICIT
1e-5
""")
    told = check(folder, deck)
    igaform(folder, deck, "--quiet", "--out", "a.h5")
    assert told["effect"] == effects_of(folder / "a.log"), told
    assert [words.split(",")[0] for words in told["effect"]] == \
        ["symmetry", "boundary X_MIN", "boundary Y_MIN", "boundary X_MAX"], told


def more_mass_makes_steps_longer(folder):
    """The share of the mass that is added goes with the square of the step."""
    plain = check(folder, STRIP, *SMALL)
    step = float(plain["stable increment"])
    deck = folder / "scaled.key"
    deck.write_text(STRIP.read_text() + f"*MASS SCALING, STEP={1.4 * 0.8 * step}\n")
    told = check(folder, deck, *SMALL)
    added = [words for words in told["effect"] if words.startswith("mass scaling")]
    assert len(added) == 1 and added[0].startswith("mass scaling, added mass "), told
    ratio = float(told["stable increment"]) / step
    assert ratio > 1.3, ratio
    close(added[0].split()[-1], (ratio**2 - 1) * float(plain["mass"]), 0.01)
    close(told["steps"], float(plain["steps"].split()[1]) / ratio, 0.05)


def steps_of_the_deck_add_up(folder):
    text = STRIP.read_text()
    before, dynamic = text.split("*DYNAMIC, EXPLICIT")
    dynamic = "*DYNAMIC, EXPLICIT" + dynamic
    deck = folder / "two.key"
    deck.write_text(f"{before}*STEP, NAME=pull\n{dynamic}*END STEP\n*STEP, NAME=more\n"
                    f"{dynamic.replace('<end_time>', '<3*end_time>')}*END STEP\n")
    one, two = check(folder, STRIP, *SMALL), check(folder, deck, *SMALL)
    assert two["steps of deck"] == "2, of the first these effects" and "steps of deck" not in one
    close(two["steps"], 4 * float(one["steps"].split()[1]), 0.01)
    assert two["effect"] == one["effect"], two


def patches_are_told_one_by_one(folder):
    out = igaform(folder, INPUT / "disk_punch.key", "--check")[0]
    counts = [int(line.split()[1]) for line in out.splitlines() if line.startswith("elements")]
    names = [line.split()[1] for line in out.splitlines() if line.startswith("patch ")]
    assert len(counts) == len(names) == 5, out
    assert f"all patches      {sum(counts)} elements" in out, out
    assert re.search(r"seams            \d+ control points at \d+ locations", out), out


def edges_of_shells_tell_the_row_they_hold(folder):
    """A clamped edge and one in a plane of symmetry; a hinge, and solids, hold the edge alone."""
    deck = folder / "edges.key"
    for element, rows in (("SHELL", {"X_MIN": True, "Y_MIN": True, "X_MAX": False}),
                          ("SOLID", {"X_MIN": False, "Y_MIN": False, "X_MAX": False})):
        deck.write_text(EDGES.format(element=element))
        told = [words for words in check(folder, deck)["effect"] if "boundary" in words]
        assert len(told) == 3, told
        for face, has_row in rows.items():
            assert all(("next row" in words) == has_row for words in told if face in words), told


def modes_are_listed_as_asked(folder):
    """As many as asked for or as there are, in order, each with its period."""
    for asked, there in (("3", 3), ("9999", None)):
        out, _ = igaform(folder, STRIP, "--set", "n_x=1", "--set", "n_y=1", "--modes", asked)
        rows = np.array([line.split() for line in out.splitlines()[1:]], dtype=float)
        held = 3 * 9 + 9               # of 27 points the symmetry planes and the pulled end
        assert len(rows) == (there or 3 * 27 - held), len(rows)
        assert (rows[:, 0] == np.arange(1, len(rows) + 1)).all()
        assert (np.diff(rows[:, 1]) >= 0).all() and (rows[:, 1] > 0).all()
        assert np.allclose(rows[:, 1] * rows[:, 2], 1, rtol=1e-8)


def modes_without_mumps_are_as_with(folder):
    """A copy that no lib/libigaform_mumps.so lies above: the same of a blank whose matrix may be
    dense, a refusal of a larger one. More than the iteration serves are refused as well."""
    alone = folder / "bin" / "one" / "igaform"
    alone.parent.mkdir(parents=True)
    shutil.copy(PROGRAM, alone)
    small = STRIP, "--set", "n_x=12", "--set", "n_y=6", "--modes", 5
    with_it, without = ([float(line.split()[1]) for line in out.splitlines()[1:]] for out, _ in
                        (igaform(folder, *small), igaform(folder, *small, program=alone)))
    assert np.allclose(with_it, without, rtol=1e-8, atol=0), (with_it, without)
    large = STRIP, "--set", "n_x=60", "--set", "n_y=30"
    out, err = igaform(folder, *large, "--modes", 1, code=1, program=alone)
    assert out == "" and "5000" in err and "MUMPS" in err and err.count("\n") == 1, (out, err)
    if not (pathlib.Path(PROGRAM).parents[1] / "lib" / "libigaform_mumps.so").exists():
        return
    rows = igaform(folder, *large, "--modes", 3)[0].splitlines()[1:]
    assert len(rows) == 3 and float(rows[0].split()[1]) < 1.02 * with_it[0], rows
    out, err = igaform(folder, *large, "--modes", 9999, code=1)
    assert out == "" and "9999" in err and err.count("\n") == 1, (out, err)


BAR = """*PARAMETER
n = 1
*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*BLANK, MATERIAL=steel, TYPE=BOX, RULE=FULL
x, 0, 100, 2, 12
y, 0, 10, 2, <n>
z, 0, 10, 2, <n>
*BOUNDARY
X_MIN, ENCASTRE
*DYNAMIC, EXPLICIT
1e-6
"""


def bars_of_few_elements_are_told(folder):
    """The loss that --check tells, and the frequency of torsion, which is the fifth, behind two
    pairs of bending; no word where a plane of symmetry holds the bar."""
    exact = np.sqrt(210000 / 2.6 / 7.85e-9 * 0.1406 * 6) / 400
    deck = folder / "bar.key"
    for n, told in (1, 29), (3, 11), (4, None):
        deck.write_text(BAR)
        err = igaform(folder, deck, "--check", "--set", f"n={n}")[1]
        losses = re.findall(r"bar.key:\d+: warning: .*torsion are about (\d+) % too low", err)
        assert losses == ([str(told)] if told else []), err
        if n == 3:
            rows = igaform(folder, deck, "--modes", 5, "--set", f"n={n}")[0].splitlines()[1:]
            torsion = float(rows[4].split()[1])
            assert 0.02 < 1 - torsion / exact < 0.13, torsion / exact
    for held in "Y_MIN, YSYMM\n", "ALL, ZSYMM\n":
        deck.write_text(BAR.replace("*DYNAMIC", "*BOUNDARY\n" + held + "*DYNAMIC"))
        assert "warning" not in igaform(folder, deck, "--check")[1], held
    deck.write_text(BAR.replace("*DYNAMIC", "*BOUNDARY\nX_MAX, ENCASTRE\n*DYNAMIC"))
    assert "torsion" in igaform(folder, deck, "--check")[1]


def threads_wait_shortly_unless_told(folder):
    """Looked at while the program waits for a deck from a pipe."""
    os.mkfifo(folder / "deck")
    plain = {name: value for name, value in os.environ.items()
             if not name.startswith(("OMP_", "GOMP_"))}
    for own, spins in (({}, "3000"), ({"GOMP_SPINCOUNT": "7"}, "7"),
                       ({"OMP_WAIT_POLICY": "active"}, None), ({"OMP_PROC_BIND": "true"}, None),
                       ({"OMP_PLACES": "cores"}, None), ({"GOMP_CPU_AFFINITY": "0"}, None)):
        run = subprocess.Popen([PROGRAM, "deck", "--set", "a= b'c"], cwd=folder, env=plain | own)
        try:
            place = pathlib.Path(f"/proc/{run.pid}")
            wait_for(lambda: waits_for_a_writer(place))
            there = dict(word.split("=", 1) for word in
                         (place / "environ").read_text().split("\0") if "=" in word)
            assert there.get("GOMP_SPINCOUNT") == spins, (own, there.get("GOMP_SPINCOUNT"))
            words = (place / "cmdline").read_text().split("\0")
            assert words[1:] == ["deck", "--set", "a= b'c", ""], words
            run.send_signal(signal.SIGTERM)
            assert run.wait(10) == -signal.SIGTERM
        finally:
            run.kill()
            run.wait()


def waits_for_a_writer(place):
    """Sleeping in the opening of a pipe, which happens only after the program has begun anew."""
    try:
        return (place / "syscall").read_text().split()[0] in ("2", "257")    # open, openat
    except OSError:
        return False


def wait_for(condition):
    end = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


if __name__ == "__main__":
    for test in (counts_are_those_of_the_run, supports_of_several_components_are_told_once,
                 more_mass_makes_steps_longer, steps_of_the_deck_add_up,
                 patches_are_told_one_by_one,
                 edges_of_shells_tell_the_row_they_hold, modes_are_listed_as_asked,
                 modes_without_mumps_are_as_with, bars_of_few_elements_are_told,
                 threads_wait_shortly_unless_told):
        with tempfile.TemporaryDirectory() as place:
            test(pathlib.Path(os.path.realpath(place)))
        print("passed:", test.__name__.replace("_", " "))
