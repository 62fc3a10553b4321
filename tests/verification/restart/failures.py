"""Numerics that fail: the last verified state, a retry, what the result holds then.

Usage: failures.py PROGRAM PROJECT
"""
import pathlib
import signal

import h5py
import numpy as np

from common import STRIP, begin, check_same, datasets, igaform, n_rows, run_all, wait_for

SMALL = ["--set", "n_x=4", "--set", "n_y=2", "--set", "end_time=2e-4", "--threads", "1"]
CRUSH = STRIP.parent / "stability" / "pull.key"
HARD = ["--set", "strain=-1.2", "--set", "rate=-50000", "--threads", "1"]

# An elastic block that turns and breathes through two steps of the deck. With a time step 5 % too
# large its balance of energy is lost after some fifty steps; it holds with half the step.
RINGING = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*BLANK, NAME=block, MATERIAL=steel, TYPE=BOX
x, 0, 40, 2, 4
y, 0, 10, 2, 1
z, 0, 10, 2, 1
*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY
ALL, 0, 0, 3000, 20, 5, 5
*BULK VISCOSITY
0, 0
{more}
*STEP, NAME=one
*DYNAMIC, EXPLICIT, SAFETY={safety}
{end}
*OUTPUT, FRAMES={frames}, HISTORY={rows}
*END STEP
*STEP, NAME=two
*DYNAMIC, EXPLICIT, SAFETY={safety}
1e-4
{motion}
*OUTPUT, FRAMES=2, HISTORY=10
*END STEP
"""
# A floor that shoots into the block within the first step of the deck's second step.
FLOOR = """*TOOL, NAME=floor, TYPE=PLANE
-50, -50, -0.5
150, 0, 0
0, 150, 0
*CONTACT PAIR, TOOL=floor, FACE=Z_MIN
*PENETRATION LIMIT
0.05, 0.1"""
TOO_FAST = "*TOOL MOTION, TOOL=floor\n0, 0, 4e6"


def ringing(folder, more, end="5e-4", rows=20, safety=1.05, motion="", frames=3):
    path = folder / "ringing.key"
    path.write_text(RINGING.format(more=more, end=end, rows=rows, safety=safety,
                                   motion=motion, frames=frames).replace("\n\n", "\n"))
    return path


def good_step(said):
    """Step of the state that a failed run says to have saved."""
    return int(said.split("the last verified state, of step ")[1].split(",")[0])


def tried_from(folder):
    return int((folder / "b.log").read_text().split("retry from step")[1].split(",")[0])


def last_step(log):
    return int(log.read_text().split("all steps")[-1].split()[2])


def goes_on_like_the_run_that_failed(folder, path, *words):
    """Taken up from its last verified state the run fails in the same way."""
    said = igaform(folder, path, *words, "--out", "a.h5", code=2)
    with h5py.File(folder / "a.h5") as file:
        assert file["provenance"].attrs["status"] == b"failed"
        assert file["frames/is_failed"][-1] == 1 and not file["frames/is_failed"][:-1].any()
        assert (np.diff(file["VTKHDF/Steps/Values"][:]) > 0).all()
        assert (np.diff(file["history/time"][:]) > 0).all()
    reference = datasets(folder / "a.h5")
    igaform(folder, path, *words, "--restart", "a.ckpt.h5", code=2)
    check_same(folder / "a.h5", reference)
    return good_step(said), last_step(folder / "a.log")


def the_last_good_state_is_near_the_failure(folder):
    good, end = goes_on_like_the_run_that_failed(folder, CRUSH, *HARD)
    assert end - 220 < good < end, (good, end)


def a_checkpoint_holds_a_good_state(folder):
    """However often the state is saved, none reaches the disk in which the failure has begun: a run
    goes on from there for as many steps as a state must have behind it to count as good."""
    for steps in (1, 10, 17):
        path = ringing(folder, f"*CHECKPOINT, STEPS={steps}")
        good = good_step(igaform(folder, path, "--out", "a.h5", code=2))
        log = (folder / "a.log").read_text()
        saved = [int(line.split("at step")[1].split(",")[0]) for line in log.splitlines()
                 if line.startswith("checkpoint a.ckpt.h5 at step")]
        assert max(saved, default=1) <= good <= last_step(folder / "a.log") - 20, (saved, good)
        igaform(folder, path, "--restart", "a.ckpt.h5", code=2)
        assert last_step(folder / "a.log") >= good + 20, (steps, good)


def the_message_tells_what_cannot_be_saved(folder):
    (folder / "a.ckpt.h5.igaform-new").mkdir()       # in the way of the file
    said = igaform(folder, CRUSH, *HARD, "--out", "a.h5", code=2)
    assert "cannot be saved: checkpoint 'a.ckpt.h5' not written: " in said, said
    assert "--restart" not in said and not (folder / "a.ckpt.h5").exists(), said


def a_failure_just_behind_a_frame(folder):
    """The step that fails follows the last frame of a step of the deck."""
    path = ringing(folder, FLOOR, "1e-5", safety=0.8, motion=TOO_FAST)
    goes_on_like_the_run_that_failed(folder, path)
    with h5py.File(folder / "a.h5") as file:
        assert file["frames/is_failed"][:].tolist() == [0, 0, 0, 0, 1]


def a_smaller_step_saves_the_run(folder):
    """The retry comes to the end, with its smaller step in the next step of the deck too."""
    path = ringing(folder, "")
    igaform(folder, path, "--out", "a.h5", code=2)
    for saving in ("OFF", "STEPS=1", "STEPS=10"):
        path = ringing(folder, f"*CHECKPOINT, {saving}, RETRY=0.5")
        igaform(folder, path, "--out", "b.h5", "--threads", 1)
        the_second_try_is_sound(folder)
        (folder / "b.ckpt.h5").unlink(missing_ok=saving == "OFF")


def the_second_try_is_sound(folder):
    log = (folder / "b.log").read_text()
    assert log.count("retry from step") == 1, log
    with h5py.File(folder / "b.h5") as file:
        assert file["provenance"].attrs["status"] == b"completed"
        assert not file["frames/is_failed"][:].any()
        assert len(file["VTKHDF/Steps/Values"]) == 6 and len(file["history/time"]) == 31
        assert (np.diff(file["history/time"][:]) > 0).all()
        dt, step = file["history/dt"][:], file["history/process_step"][:]
        late = file["history/step"][:] > tried_from(folder)
        assert (dt[late] < 0.55 * dt[0]).all() and (step[late] == 2).sum() == 10, dt
        assert np.abs(file["history/energy_error"][:]).max() < 1e-4


def clock_and_signals_change_nothing(folder):
    """A retry begins at the same state and ends with the same bits whenever the run is saved:
    at signals that come in every step, by the clock whenever it can be."""
    path = ringing(folder, "*CHECKPOINT, OFF, RETRY=0.5")
    igaform(folder, path, "--out", "b.h5", "--threads", 1)
    reference, tried = datasets(folder / "b.h5"), tried_from(folder)
    run = begin(folder, path, "--out", "b.h5", "--threads", 1)
    log = folder / "b.log"
    log.unlink()
    wait_for(log.exists)
    while run.poll() is None:
        run.send_signal(signal.SIGUSR1)
    assert run.returncode == 0, log.read_text()
    assert "checkpoint b.ckpt.h5 at step" in log.read_text()
    assert tried_from(folder) == tried
    check_same(folder / "b.h5", reference)
    path = ringing(folder, "*CHECKPOINT, MINUTES=1e-9, RETRY=0.5")
    igaform(folder, path, "--out", "b.h5", "--threads", 1)
    assert log.read_text().count("checkpoint b.ckpt.h5 at step") > 5
    assert tried_from(folder) == tried
    check_same(folder / "b.h5", reference)


def a_stop_before_the_failure_changes_nothing(folder):
    """The run that is stopped in a state in which the failure grows goes on to the same end."""
    path = ringing(folder, "*CHECKPOINT, OFF, RETRY=0.5")
    igaform(folder, path, "--out", "full.h5", "--threads", 1)
    reference = datasets(folder / "full.h5")
    for n in range(4):
        run = begin(folder, path, "--out", f"{n}.h5", "--threads", 1)
        wait_for(lambda: n_rows(folder / f"{n}.log") > 2 * n)
        run.send_signal(signal.SIGTERM)
        if run.wait(60) == 3:
            igaform(folder, path, "--restart", f"{n}.ckpt.h5", "--threads", 2)
        check_same(folder / f"{n}.h5", reference)


def frames_close_together_prove_nothing(folder):
    """A state counts as good behind as many steps when the next frame comes before that."""
    for n in (23, 46, 92, 230):
        path = ringing(folder, "*CHECKPOINT, RETRY=0.5", rows=n, frames=n)
        igaform(folder, path, "--out", "b.h5", "--threads", 1)
        with h5py.File(folder / "b.h5") as file:
            assert len(file["VTKHDF/Steps/Values"]) == n + 3
            assert (np.diff(file["VTKHDF/Steps/Values"][:]) > 0).all()
            assert not file["frames/is_failed"][:].any()
        said = igaform(folder, ringing(folder, "", rows=n, frames=n), "--out", "a.h5", code=2)
        assert good_step(said) <= last_step(folder / "a.log") - 20, said


def a_smaller_step_outlives_an_interruption(folder):
    """A run that is stopped after its retry has begun goes on with the smaller step."""
    path = ringing(folder, "*CHECKPOINT, OFF, RETRY=0.5", "1.2e-2", 800)
    igaform(folder, path, "--out", "full.h5", "--threads", 1)
    log = folder / "b.log"
    for _ in range(5):   # on a busy machine it may end before the signal comes
        log.unlink(missing_ok=True)
        run = begin(folder, path, "--out", "b.h5", "--threads", 1)
        wait_for(lambda: log.exists() and "retry" in log.read_text() and n_rows(log) > 100)
        run.send_signal(signal.SIGTERM)
        if run.wait(60) == 3:
            break
    assert run.returncode == 3, run.returncode
    igaform(folder, path, "--restart", "b.ckpt.h5", "--threads", 2)
    check_same(folder / "b.h5", datasets(folder / "full.h5"))
    assert not (folder / "b.ckpt.h5").exists()


def a_step_that_does_not_come_to_rest(folder):
    """A relaxation that another step follows: its end is the frame marked failed, and but one."""
    text = (STRIP.parent / "verification" / "clamped_plate.key").read_text()
    text = text.replace("*DYNAMIC RELAXATION", "*STEP, NAME=rest\n*DYNAMIC RELAXATION")
    (folder / "rest.key").write_text(text.replace("periods = 12", "periods = 0.2") + "*END STEP\n"
                                     "*STEP, NAME=next\n*DYNAMIC, EXPLICIT\n1e-5\n*END STEP\n")
    said = igaform(folder, "rest.key", "--set", "n=2", "--out", "a.h5", code=2)
    assert "not at rest" in said and "--restart a.ckpt.h5" in said, said
    with h5py.File(folder / "a.h5") as file:
        assert file["frames/is_failed"][:].tolist() == [0, 1]
        assert file["VTKHDF/Steps/Values"][-1] == file["history/time"][-1]


def a_second_try_from_the_start_of_a_step(folder):
    """What begins to fail in a later step of the deck, before a state of it has been verified, is
    tried from the first state of that step; not from one taken when the failure had grown. The bits
    do not depend on when the run was saved or stopped; without RETRY the last verified state is
    that of the step before."""
    def two_steps(saving):
        path = ringing(folder, saving, "1e-5", rows=1, frames=1)
        before, behind = path.read_text().split("*STEP, NAME=two")
        path.write_text(before + "*STEP, NAME=two" + behind.replace("1e-4", "2e-4").replace(
            "HISTORY=10", "HISTORY=8"))
        return path

    path = two_steps("*CHECKPOINT, OFF, RETRY=0.5")
    igaform(folder, path, "--out", "b.h5", "--threads", 1)
    reference = datasets(folder / "b.h5")
    with h5py.File(folder / "b.h5") as file:
        step, process_step = file["history/step"][:], file["history/process_step"][:]
        assert tried_from(folder) == step[process_step == 1].max() + 1, (step, process_step)
        assert len(step) == 10 and not file["frames/is_failed"][:].any()
        assert np.abs(file["history/energy_error"][:]).max() < 0.01
    igaform(folder, path, "--wall", "1e-9", "--out", "c.h5", code=3)
    igaform(folder, path, "--restart", "c.ckpt.h5", "--threads", 2)
    check_same(folder / "c.h5", reference)
    for saving in ("MINUTES=1e-9", "STEPS=1", "STEPS=27"):
        igaform(folder, two_steps(f"*CHECKPOINT, {saving}, RETRY=0.5"), "--out", "b.h5")
        with h5py.File(folder / "b.h5") as file:
            assert np.abs(file["history/energy_error"][:]).max() < 0.01
        if saving != "STEPS=27":
            check_same(folder / "b.h5", reference)
    goes_on_like_the_run_that_failed(folder, two_steps(""))


def a_second_try_may_fail_too(folder):
    text = STRIP.read_text().replace("*DYNAMIC, EXPLICIT", "*DYNAMIC, EXPLICIT, SAFETY=0.99")
    text = text.replace("X_MAX, 1, 1, <strain*length/(end_time - rise/2)>",
                        "X_MAX, 1, 1, <-3*length/end_time>")
    path = folder / "crush.key"
    path.write_text(text + "*CHECKPOINT, RETRY=0.5\n")
    said = igaform(folder, path, *SMALL, "--out", "b.h5", code=2)
    assert (folder / "b.log").read_text().count("retry from step") == 1
    assert "the last verified state" in said and "--restart b.ckpt.h5" in said, said
    with h5py.File(folder / "b.h5") as file:
        assert file["frames/is_failed"][-1] == 1


def no_second_try_across_steps_of_the_deck(folder):
    """The state kept is of the step before: the run fails, with the frame that says so."""
    path = ringing(folder, FLOOR + "\n*CHECKPOINT, RETRY=0.5", "1e-5", safety=0.8,
                   motion=TOO_FAST)
    igaform(folder, path, "--out", "b.h5", code=2)
    log = (folder / "b.log").read_text()
    assert "no retry: the state kept last does not fit, it is of step 1" in log, log
    with h5py.File(folder / "b.h5") as file:
        assert file["frames/is_failed"][:].tolist() == [0, 0, 0, 0, 1]
        assert file["provenance"].attrs["status"] == b"failed"


if __name__ == "__main__":
    run_all(the_last_good_state_is_near_the_failure, a_checkpoint_holds_a_good_state,
            the_message_tells_what_cannot_be_saved, a_failure_just_behind_a_frame,
            a_smaller_step_saves_the_run, clock_and_signals_change_nothing,
            a_stop_before_the_failure_changes_nothing, frames_close_together_prove_nothing,
            a_smaller_step_outlives_an_interruption,
            a_step_that_does_not_come_to_rest, a_second_try_from_the_start_of_a_step,
            a_second_try_may_fail_too,
            no_second_try_across_steps_of_the_deck)
