"""Decks with static steps that are stopped and taken up again, or that fail.

Usage: static_steps.py PROGRAM PROJECT
"""
import signal

from common import begin, check_same, datasets, igaform, run_all, wait_for

STEEL = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
"""
# A sheet that falls on a die and is closed in by a holder: the springs of friction hold it.
CLOSED = STEEL + """*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, ELEMENT=SHELL
x, 0, 40, 2, 12
y, 0, 20, 2, 6
z, 0.3, 1.3, 2, 1
*TOOL, NAME=die, TYPE=PLANE, SIDE=POSITIVE
-5, -5, 0
60, 0, 0
0, 40, 0
*TOOL, NAME=holder, TYPE=PLANE, SIDE=NEGATIVE
-5, -5, 1.5
60, 0, 0
0, 40, 0
*CONTACT PAIR, TOOL=die, FACE=Z_MIN, FRICTION=0.1
*CONTACT PAIR, TOOL=holder, FACE=Z_MAX, FRICTION=0.1
*BOUNDARY
X_MIN, XSYMM
Y_MIN, YSYMM
*GRAVITY
0, 0, -9810
*STEP, NAME=gravity
*STATIC
0.5, 1
*OUTPUT, FRAMES=1, HISTORY=1
*END STEP
*STEP, NAME=close
*TOOL FORCE, TOOL=holder
0, 0, -8000
*STATIC
0.5, 1
*END STEP
*STEP, NAME=many
*FREQUENCY
120
*END STEP
*STEP, NAME=few
*FREQUENCY
5
*END STEP
"""
# An explicit step of 100 increments, and a static one in which nothing holds the plate.
LET_GO = STEEL + """*BLANK, NAME=plate, MATERIAL=steel, TYPE=BOX
x, 0, 20, 2, 4
y, 0, 10, 2, 2
z, 0, 1, 2, 1
*STEP, NAME=form
*BOUNDARY
X_MIN, ENCASTRE
*DYNAMIC, EXPLICIT
1e-5
*OUTPUT, FRAMES=1, HISTORY=1
*END STEP
*STEP, NAME=release
*BOUNDARY, OP=NEW
*GRAVITY
0, 0, -9810
*STATIC
1, 1
*OUTPUT, FRAMES=1, HISTORY=1
*END STEP
"""


def frequencies_go_on_bit_by_bit(folder):
    """Stopped while the first ones are sought, so that the run goes on with the others alone. At
    rest no kinetic energy is too large."""
    path = folder / "closed.key"
    path.write_text(CLOSED)
    igaform(folder, path, "--out", "full.h5", "--threads", 1)
    assert "kinetic energy" not in (folder / "full.log").read_text()
    run = begin(folder, path, "--out", "cut.h5", "--threads", 1)
    wait_for(lambda: (folder / "cut.log").exists() and " many" in (folder / "cut.log").read_text())
    run.send_signal(signal.SIGTERM)
    assert run.wait(60) == 3, run.returncode
    igaform(folder, path, "--restart", "cut.ckpt.h5", "--threads", 2)
    check_same(folder / "cut.h5", datasets(folder / "full.h5"))


def the_end_of_forming_is_kept(folder):
    """Where the static step after it fails, and a retry would change nothing."""
    path = folder / "let_go.key"
    path.write_text(LET_GO)
    said = igaform(folder, path, "--out", "full.h5", "--threads", 1, code=2)
    log = (folder / "full.log").read_text()
    steps = max(int(line.split()[1]) for line in log.splitlines() if "in step 1 of 2" in line)
    assert f"the last verified state, of step {steps}, time 1e-5," in said, said
    assert "RETRY" not in said, said
    again = igaform(folder, path, "--restart", "full.ckpt.h5", "--threads", 1, code=2)
    assert again.splitlines()[0] == said.splitlines()[0], again


def static_steps_may_come_after_a_restart(folder):
    """In a deck that had none, after a step that failed to find its equilibrium."""
    form = LET_GO.split("*STEP, NAME=release")[0]
    (folder / "form.key").write_text("*CHECKPOINT, NUMBER=1\n" + form)
    igaform(folder, "form.key", "--out", "a.h5")
    (folder / "both.key").write_text(LET_GO.replace("*BOUNDARY, OP=NEW\n", ""))
    igaform(folder, "both.key", "--out", "full.h5", "--threads", 1)
    igaform(folder, "both.key", "--restart", "a.ckpt.h5", "--threads", 2)
    check_same(folder / "a.h5", datasets(folder / "full.h5"))
    (folder / "fails.key").write_text(LET_GO)
    said = igaform(folder, "fails.key", "--out", "b.h5", code=2)
    assert "igaform fails.key --restart b.ckpt.h5" in said, said
    igaform(folder, "both.key", "--restart", "b.ckpt.h5", "--threads", 2)
    check_same(folder / "b.h5", datasets(folder / "full.h5"))


if __name__ == "__main__":
    run_all(frequencies_go_on_bit_by_bit, the_end_of_forming_is_kept,
            static_steps_may_come_after_a_restart)
