"""Runs stopped by a signal or a limit of time go on bit by bit the same, with other threads too.

Usage: restart.py PROGRAM PROJECT
"""
import io
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

import h5py

from common import (PROJECT, STRIP, begin, check_same, datasets, deck, igaform, n_rows, run_all,
                    wait_for)

sys.path.append(str(PROJECT / "tests/stability/fuzz"))
from damage import parts, sealed  # noqa: E402

VERIFICATION = PROJECT / "input" / "verification"
# Deck, parameters, and what state it has that must survive.
DECKS = (
    (STRIP, "n_x=6 end_time=4e-4", "plasticity, viscosity, prescribed motion"),
    (VERIFICATION / "friction_block.key", "", "contact with friction"),
    (VERIFICATION / "turntable.key", "turn=1.5e-4 history=20000",
     "a tool that turns, a row in each step"),
    (PROJECT / "tests/verification/contact/slider.key", "", "contact, wear of the tool"),
    (VERIFICATION / "clamped_plate.key", "n=4", "pressure, dynamic relaxation"),
    ("press and release", "", "several patches, a moving tool, a draw bead, two steps of the deck"),
    ("press and release", "element=SHELL", "joints of shells"),
    (VERIFICATION / "bending_wave.key", "", "viscosity of bending"),
)


def settings(text):
    return [word for setting in text.split() for word in ("--set", setting)]


def press_and_release(folder):
    """A disk pressed over a ball, held back by a bead, and released in a second step."""
    text = (PROJECT / "input/disk_punch.key").read_text().replace("n = 4", "n = 1")
    text = text.replace("depth = 10", "depth = 2")
    text = text.replace("*DYNAMIC", "*STEP, NAME=press\n*DRAW BEAD, NAME=row, WIDTH=20\n20\n"
                        "30, -30, 1\n30, 30, 1\n*DYNAMIC")
    path = folder / "press.key"
    path.write_text(text + "*END STEP\n*STEP, NAME=release\n*MODEL CHANGE, REMOVE\nball, row\n"
                    "*DYNAMIC, EXPLICIT\n<0.5*depth/speed>\n*OUTPUT, FRAMES=3\n*END STEP\n")
    return path


def goes_on_bit_by_bit(folder, source, parameters):
    """Stop a run twice, at a third and at two thirds, each time with other threads."""
    path = press_and_release(folder) if source == "press and release" else deck(folder, source)
    words = settings(parameters)
    igaform(folder, path, *words, "--out", "full.h5", "--threads", 1)
    reference = datasets(folder / "full.h5")
    with h5py.File(folder / "full.h5") as file:
        wear = file["VTKHDF/PointData"].get("wear")
        assert wear is None or wear[:].any()
    rows = n_rows(folder / "full.log")
    for share in (3, 1.5):
        given = ["--restart", "cut.ckpt.h5"] if (folder / "cut.ckpt.h5").exists() else \
            ["--out", "cut.h5"]
        run = begin(folder, path, *words, *given, "--threads", 1 if share < 2 else 2)
        wait_for(lambda: n_rows(folder / "cut.log") > rows / share or run.poll() is not None)
        run.send_signal(signal.SIGTERM)
        assert run.wait(60) in (0, 3), run.returncode
    igaform(folder, path, *words, "--restart", "cut.ckpt.h5", "--threads", 2)
    check_same(folder / "cut.h5", reference)
    with h5py.File(folder / "cut.h5") as file:
        effects, all_steps = file["timings/effects"], file["timings/steps"][()]
        seconds = sum(effect["seconds"][()] for effect in effects.values())
        assert effects["blank/calls"][()] == all_steps, (effects["blank/calls"][()], all_steps)
        assert seconds <= file["timings/wall_seconds"][()] < 1.5 * seconds + 1, seconds


def signals_save_and_stop(folder):
    path = deck(folder, STRIP, "*CHECKPOINT, STEPS=100000000")
    words = settings("n_x=8 end_time=1e-2")
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        run = begin(folder, path, *words, "--out", "s.h5")
        wait_for(lambda: n_rows(folder / "s.log") > 1)
        run.send_signal(number)
        assert run.wait(60) == 3, run.returncode
        log = (folder / "s.log").read_text()
        assert f"stopped by {number.name} at step" in log and "checkpoint s.ckpt.h5" in log, log
        assert log.endswith("continue with --restart s.ckpt.h5\n"), log
        with h5py.File(folder / "s.h5") as file:
            assert file["provenance"].attrs["status"] == b"interrupted"
        (folder / "s.log").unlink()
        (folder / "s.ckpt.h5").unlink()
    run = begin(folder, path, *words, "--out", "s.h5")
    wait_for(lambda: n_rows(folder / "s.log") > 1)
    run.send_signal(signal.SIGUSR1)
    wait_for((folder / "s.ckpt.h5").exists)
    rows = n_rows(folder / "s.log")
    wait_for(lambda: n_rows(folder / "s.log") > rows)
    run.kill()
    run.wait()
    igaform(folder, path, *words, "--out", "w.h5", "--wall", "0.01", code=3)
    assert "limit of 0.01" in (folder / "w.log").read_text()
    igaform(folder, path, *words, "--out", "w.h5", "--restart", "w.ckpt.h5", "--wall", "1e-9",
            code=3)
    assert "no state since the restart" in (folder / "w.log").read_text()


def an_early_wish_to_save_waits(folder):
    """The program begins itself anew with other settings; while that is loaded a signal waits."""
    environment = {key: value for key, value in os.environ.items()
                   if key not in ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT")}
    for _ in range(5):
        run = begin(folder, STRIP, *settings("n_x=4 end_time=1e-5"), "--out", "e.h5",
                    env=environment)
        begun = pathlib.Path(f"/proc/{run.pid}/environ")
        while b"GOMP_SPINCOUNT" not in begun.read_bytes():
            assert run.poll() is None
        run.send_signal(signal.SIGUSR1)
        assert run.wait(60) == 0, run.returncode


def a_complete_run_leaves_no_checkpoint(folder):
    """A deck without *CHECKPOINT is saved by the clock, for as long as the run is not complete."""
    words = ["--threads", 1, *settings("n_x=4 end_time=4e-3"), "--out", "s.h5"]
    igaform(folder, STRIP, *settings("n_x=4 end_time=1e-4"), "--out", "q.h5")
    assert sorted(file.name for file in folder.iterdir()) == ["q.h5", "q.log"]
    log = (folder / "q.log").read_text()
    assert "every 15 minutes" in log, log
    run = begin(folder, STRIP, *words)
    wait_for(lambda: n_rows(folder / "s.log") > 1)
    run.send_signal(signal.SIGUSR1)
    wait_for((folder / "s.ckpt.h5").exists)
    run.send_signal(signal.SIGTERM)
    assert run.wait(60) == 3 and (folder / "s.ckpt.h5").exists(), run.returncode
    igaform(folder, STRIP, *words[:-2], "--restart", "s.ckpt.h5")
    assert sorted(folder.glob("s.*")) == [folder / "s.h5", folder / "s.log"]
    an_overtaken_checkpoint_goes(folder)
    path = deck(folder, STRIP, "*CHECKPOINT, OFF")
    assert "failures" in (igaform(folder, path, *words[:-1], "o.h5") or
                          (folder / "o.log").read_text())
    path = deck(folder, STRIP, "*CHECKPOINT, OFF, STEPS=5")
    assert "*CHECKPOINT: found OFF" in igaform(folder, path, code=1)


def an_overtaken_checkpoint_goes(folder):
    """One that an earlier run of this deck left; not one that is further, nor another deck's."""
    text, saved = STRIP.read_text().replace("n_x = 16", "n_x = 4"), "*CHECKPOINT, NUMBER=1\n"
    short, long = (text.replace("<end_time>\n", f"{end}\n") for end in ("1e-5", "2e-5"))
    for begun, then, is_gone in ((short + saved, long, True), (long + saved, short, False),
                                 (short.replace("n_x = 4", "n_x = 5") + saved, long, False)):
        for name, content in (("begun.key", begun), ("then.key", then)):
            (folder / name).write_text(content)
        igaform(folder, "begun.key", "--out", "t.h5")
        left = (folder / "t.ckpt.h5").read_bytes()
        igaform(folder, "then.key", "--out", "t.h5")
        assert (folder / "t.ckpt.h5").exists() != is_gone, (folder / "t.log").read_text()
        assert is_gone or (folder / "t.ckpt.h5").read_bytes() == left


def the_clock_saves(folder):
    path = deck(folder, STRIP, "*CHECKPOINT, MINUTES=1e-4")
    igaform(folder, path, *settings("n_x=4 end_time=4e-4"), "--out", "m.h5", "--threads", 1)
    log = (folder / "m.log").read_text()
    assert 2 < log.count("checkpoint m.ckpt.h5 at step") < 1000, log
    assert (folder / "m.ckpt.h5").exists() and "the run is complete" not in log, log


def steps_apart(folder, asked):
    """What the log announces, and what comes between the checkpoints that it tells of, but for the
    first state and the end, which are not put off."""
    path = deck(folder, STRIP, f"*CHECKPOINT, STEPS={asked}")
    igaform(folder, path, *settings("n_x=4 end_time=1e-4"), "--out", "s.h5")
    log = (folder / "s.log").read_text()
    said = int(re.search(r"saves .* every (\d+) steps", log)[1])
    saved = [int(step) for step in re.findall(r"checkpoint s.ckpt.h5 at step (\d+)", log)][1:-1]
    return said, sorted(after - before for before, after in zip(saved, saved[1:]))


def the_end_of_a_relaxation_is_saved(folder):
    """Which comes before the end time."""
    path = deck(folder, VERIFICATION / "clamped_plate.key", "*CHECKPOINT, STEPS=5000")
    igaform(folder, path, *settings("n=2"), "--out", "r.h5", "--threads", 1)
    log, reference = (folder / "r.log").read_text(), datasets(folder / "r.h5")
    last = re.findall(r"^step +(\d+)", log, re.MULTILINE)[-1]
    assert f"checkpoint r.ckpt.h5 at step {last}," in log, log
    igaform(folder, path, *settings("n=2"), "--restart", "r.ckpt.h5", "--threads", 1)
    check_same(folder / "r.h5", reference)


def progress_of_a_relaxation_is_that_of_its_decay(folder):
    """Shares in the log never fall and end next to all of it, far before the time limit."""
    igaform(folder, VERIFICATION / "clamped_plate.key", *settings("n=4"), "--out", "p.h5",
            "--threads", 1)
    log = (folder / "p.log").read_text()
    shares = re.findall(r"^step .*\( *(\S+) %\)", log, re.MULTILINE)
    known = [float(share) for share in shares if share != "--"]
    assert 10 < len(known) < len(shares), shares
    assert known == sorted(known) and known[-1] == 100 and 85 < known[-2] < 100, known
    igaform(folder, VERIFICATION / "springback.key", "--out", "s.h5", "--threads", 1)
    log = (folder / "s.log").read_text()
    assert re.search(r"\( 50.0 %\).* left \S+ in step 1 of 2 bend$", log, re.MULTILINE), log
    assert re.search(r"\(100.0 %\).* in step 2 of 2 release$", log, re.MULTILINE), log
    watch = [sys.executable, "-m", "post", "watch", folder / "s.h5", "--once"]
    said = subprocess.run(watch, cwd=PROJECT, capture_output=True, text=True, check=True).stdout
    assert "100.0 %" in said and "in step 2 of 2 release" in said, said


def states_are_saved_as_far_apart_as_the_log_says(folder):
    for asked in (1, 21):
        said, found = steps_apart(folder, asked)
        assert said == 21 and set(found) == {21} and len(found) > 5, (asked, said, found)
    said, found = steps_apart(folder, 30)     # some are put off by states that go with a frame
    assert said == 30 and found[0] >= 21 and found[-1] < 30 + 21, (said, found)
    assert abs(sum(found)/len(found) - 30) < 1.5, found


def saving_leaves_no_trace(folder):
    """Balances that are looked at for a checkpoint alone, between rows, change nothing."""
    source = VERIFICATION / "friction_block.key"
    igaform(folder, source, "--out", "a.h5")
    path = deck(folder, source, "*CHECKPOINT, NUMBER=8")
    igaform(folder, path, "--out", "b.h5")
    assert (folder / "b.log").read_text().count("checkpoint b.ckpt.h5 at step") > 5
    check_same(folder / "b.h5", datasets(folder / "a.h5"))


def a_result_has_one_writer(folder):
    """A run under way keeps its file; to be asked twice at once to stop, as a member of a group and
    by the one who started it, costs nothing."""
    path, words = deck(folder, STRIP, "*CHECKPOINT, STEPS=50"), settings("n_x=8 end_time=1e-2")
    run = begin(folder, path, *words, "--out", "o.h5")
    wait_for((folder / "o.ckpt.h5").exists)
    said = igaform(folder, path, *words, "--restart", "o.ckpt.h5", code=1)
    assert "another program" in said, said
    run.send_signal(signal.SIGTERM)
    run.send_signal(signal.SIGTERM)
    assert run.wait(60) == 3, run.returncode


def line_of(path, start):
    lines = path.read_text().splitlines()
    return 1 + [line.startswith(start) for line in lines].index(True)


def other_user_subroutines_are_refused(folder):
    """By what stands in them and in what they include, wherever they are."""
    stability = PROJECT / "input" / "stability"
    source = (stability / "fails_beyond.f").read_text()
    path, user = stability / "user_law.key", folder / "law.f"
    words = ["--user", "law.f", "--threads", "1"]
    user.write_text(source)
    igaform(folder, path, *words, "--out", "a.h5", code=2)      # and leaves its last verified state
    user.write_text(source + "C     another law\n")
    said = igaform(folder, path, *words, "--restart", "a.ckpt.h5", code=1)
    assert "other user subroutines" in said, said
    (folder / "sub").mkdir()
    (folder / "sub" / "same.f").write_text(source)
    igaform(folder, path, "--user", "sub/same.f", *words[2:], "--restart", "a.ckpt.h5",
            code=2)


def messages_of_user_subroutines_stay(folder):
    """What they wrote to unit 7 before the restart is there behind it."""
    stability = PROJECT / "input" / "stability"
    source = (stability / "fails_beyond.f").read_text()
    (folder / "law.f").write_text(source.replace(
        "      RETURN\n", "      IF (NOEL.EQ.1.AND.NPT.EQ.1) WRITE(7,*) TIME(2)\n      RETURN\n"))
    words = [stability / "user_law.key", "--user", "law.f", "--threads", "1"]
    igaform(folder, *words, "--out", "m.h5", code=2)
    before = (folder / "m.msg").read_text()
    igaform(folder, *words, "--restart", "m.ckpt.h5", code=2)
    now = (folder / "m.msg").read_text()
    assert len(before) > 100 and len(now) > len(before) and now.startswith(before)


def strangers_are_refused(folder):
    path, words = deck(folder, STRIP, "*CHECKPOINT, NUMBER=2"), settings("n_x=4 end_time=1e-4")
    igaform(folder, path, *words, "--out", "a.h5")
    before = (folder / "a.h5").read_bytes()
    whole = (folder / "a.ckpt.h5").read_bytes()

    def refused(content, reason, *more, deck_path=path):
        (folder / "b.ckpt.h5").write_bytes(content)
        said = igaform(folder, deck_path, *more, "--restart", "b.ckpt.h5", code=1)
        assert reason in said, said
        assert not (folder / "b.h5").exists() and (folder / "a.h5").read_bytes() == before

    for place in (10, len(whole) // 3, len(whole) - 200):
        damaged = bytearray(whole)
        damaged[place] ^= 4
        refused(bytes(damaged), "checksum", *words)
    refused(whole[:-1], " end ", *words)
    refused(whole[:len(whole) // 2], " end ", *words)
    state, result = parts(whole)
    refused(sealed(state[:8] + b"\0" + state[9:], result), "format", *words)
    refused(whole[1000:], "length", *words)
    refused(b"", "no checkpoint", *words)
    refused(before, "no checkpoint", *words)
    refused(whole, "another deck", *settings("n_x=4 end_time=1e-4 width=9"))
    # The end time of this deck is in its amplitude too.
    refused(whole, f"*AMPLITUDE ({STRIP}:{line_of(STRIP, '*AMPL')})",
            *settings("n_x=4 end_time=2e-4"))
    longer = deck(folder, STRIP, "*HISTORY POINT, NAME=middle", "0.5, 0.5, 0.5", name="longer.key")
    refused(whole, f"*HISTORY POINT ({longer}:2)", *words, deck_path=longer)
    short = folder / "short.key"
    short.write_text(STRIP.read_text().replace("<end_time>\n", "5e-5\n"))
    refused(whole, "end time", *words, deck_path=short)
    said = igaform(folder, path, *words, "--restart", "nowhere.ckpt.h5", code=1)
    assert "nowhere.ckpt.h5" in said, said


def what_may_differ(folder):
    """A later end, other output, a deleted result."""
    lines = STRIP.read_text().replace("*OUTPUT, FRAMES=10, HISTORY=200", "").replace("n_x = 16",
                                                                                  "n_x = 4")
    one, other = folder / "one.key", folder / "other.key"
    one.write_text(lines + "*OUTPUT, FRAMES=4, HISTORY=8\n*CHECKPOINT, NUMBER=2\n")
    moved = lines.replace("<end_time>\n", "2e-3\n")
    other.write_text(moved + "*OUTPUT, FRAMES=16, HISTORY=32\n")
    igaform(folder, one, "--out", "a.h5")
    (folder / "a.h5").unlink()
    igaform(folder, other, "--restart", "a.ckpt.h5")
    with h5py.File(folder / "a.h5") as file:
        time = file["VTKHDF/Steps/Values"][:]
        assert abs(time[-1] - 2e-3) < 1e-12 and abs(time[1] - 2.5e-4) < 1e-8, time
        assert (time[1:] > time[:-1]).all() and len(time) == 13, time
        assert file["provenance"].attrs["status"] == b"completed"


def another_build_is_refused(folder):
    """By what it was built with, of the same commit too. With the option the run continues, and the
    log says so. With a file of another form no option helps."""
    path, words = deck(folder, STRIP, "*CHECKPOINT, NUMBER=2"), settings("n_x=4 end_time=2e-5")
    igaform(folder, path, *words, "--out", "a.h5")
    with h5py.File(folder / "a.h5") as file:
        told = file["provenance/build"][()].decode()
    for line in ("program    0.", "compiler   ", "options    -", "lapack     ", "kernels    222"):
        assert f"\n{line}" in f"\n{told}", told
    assert "native" not in told, told
    state, result = parts((folder / "a.ckpt.h5").read_bytes())
    option = re.search(r"-O\S+", told)[0].encode()
    cases = {f"options then -O9, now {option.decode()}": state.replace(option, b"-O9"),
             "kernels then 333": state.replace(b"kernels    222", b"kernels    333")}
    with h5py.File(io.BytesIO(state), "r+") as file:
        del file.attrs["form"]
        file.flush()
        older = file.id.get_file_image()
    before = (folder / "a.h5").read_bytes()
    for reason, changed in cases.items():
        (folder / "b.ckpt.h5").write_bytes(sealed(changed, result))
        more = ["--restart", "b.ckpt.h5", "--out", "a.h5"]
        said = igaform(folder, path, *words, *more, code=1)
        assert said.count("\n") == 1 and reason in said and "--restart-any-build" in said, said
        assert (folder / "a.h5").read_bytes() == before and not list(folder.glob("*.igaform-new"))
        igaform(folder, path, *words, *more, "--restart-any-build")
        log = (folder / "a.log").read_text()
        assert "another build" in log and reason in log, log
        before = (folder / "a.h5").read_bytes()
    (folder / "b.ckpt.h5").write_bytes(sealed(older, result))
    said = igaform(folder, path, *words, *more, "--restart-any-build", code=1)
    assert "rejected: it was written by igaform 0." in said and "another form" in said, said
    igaform(folder, path, *words, "--restart", "a.ckpt.h5", "--restart-any-build")
    assert (folder / "a.log").read_text().count("another build") == len(cases)


def other_fields_are_refused(folder):
    """Frames of one file have the same fields and cells: nothing is touched, both values told."""
    text = STRIP.read_text().replace("n_x = 16", "n_x = 4").replace("n_y = 4", "n_y = 1")
    text = text.replace("<end_time>\n", "2e-5\n") + "*CHECKPOINT, NUMBER=1\n"
    kinds = {"NONE": "", "CONTACT": ", FIELDS=CONTACT", "WEAR": ", FIELDS=WEAR",
             "BOTH": ', FIELDS="STRESS, WEAR"', "BEZIER": ", CELLS=BEZIER"}
    told_as = {"BEZIER": "NONE", "BOTH": '"WEAR, STRESS"'}
    for kind, options in kinds.items():
        (folder / f"{kind}.key").write_text(text.replace("HISTORY=200", "HISTORY=20" + options))
        igaform(folder, f"{kind}.key", "--threads", 1)
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    for was in kinds:
        for now in kinds:
            words = [f"{now}.key", "--restart", f"{was}.ckpt.h5", "--out", f"{now}.h5"]
            if was == now:
                continue
            said = igaform(folder, *words, code=1)
            fields = [told_as.get(kind, kind) for kind in (was, now)]
            cells = [("BEZIER" if kind == "BEZIER" else "LAGRANGE") for kind in (was, now)]
            for option, (then, here) in (("FIELDS", fields), ("CELLS", cells)):
                told = f"{option}={then}" in said and f"{option}={here}" in said
                assert told == (then != here), (was, now, said)
    now = {file.name: file.read_bytes() for file in folder.iterdir()}
    assert now == before, set(now) ^ set(before)
    igaform(folder, "WEAR.key", "--restart", "WEAR.ckpt.h5")


if __name__ == "__main__":
    for source, parameters, state in DECKS:
        with tempfile.TemporaryDirectory() as place:
            goes_on_bit_by_bit(pathlib.Path(place), source, parameters)
        print(f"passed: {getattr(source, 'stem', source)} goes on bit by bit ({state})", flush=True)
    run_all(signals_save_and_stop, an_early_wish_to_save_waits,
            a_complete_run_leaves_no_checkpoint, the_clock_saves,
            the_end_of_a_relaxation_is_saved, progress_of_a_relaxation_is_that_of_its_decay,
            states_are_saved_as_far_apart_as_the_log_says, saving_leaves_no_trace,
            a_result_has_one_writer, strangers_are_refused,
            other_user_subroutines_are_refused, messages_of_user_subroutines_stay, what_may_differ,
            another_build_is_refused, other_fields_are_refused)
