"""Runs of igaform-mpi that stop, fail, are killed or cannot begin, and are continued by other
numbers of processes and threads.

Usage: stops.py PROGRAM PROJECT MPI_PROGRAM MPIRUN [TEST ...]
"""
import os
import pathlib
import re
import resource
import signal
import sys

from common import (PROJECT, check_same, datasets, igaform, n_rows, opens, run_all, wait_for)
from failures import CRUSH, FLOOR, HARD, TOO_FAST, ringing, tried_from
from mpi import begin_mpi, igaform_mpi

STABILITY = PROJECT / "input" / "stability"
SLIDER = PROJECT / "tests" / "verification" / "contact" / "slider.key"
PARAMETERS = ["--set", "friction=0.1", "--set", "time=3e-3"]
SHELL_BOX = [PROJECT / "input" / "square_box.key", *(word for one in (
    "depth=1.5", "elements=20", "frames=2", "element=SHELL", "mass_factor=1", "rule=SHEET")
    for word in ("--set", one))]


def slider(folder, saving="*CHECKPOINT, STEPS=300\n"):
    """A scene with contact, friction, damping and wear that is long enough to be stopped."""
    path = folder / "deck.key"
    path.write_text(SLIDER.read_text().split("*OUTPUT")[0] + saving +
                    "*OUTPUT, FRAMES=12, HISTORY=300, FIELDS=<fields>\n")
    return [path, *PARAMETERS, "--threads", 1]


def whole(folder):
    """Results of the undisturbed run by igaform."""
    igaform(folder, *slider(folder), "--out", "whole.h5")
    return datasets(folder / "whole.h5")


def by_rows(path, is_shell=False):
    """The block of `ringing` with enough elements across for each process to move its own rows, or
    a thin plate."""
    text = path.read_text()
    changes = {"y, 0, 10, 2, 1\n": "y, 0, 10, 2, 16\n"}
    if is_shell:
        changes |= {"TYPE=BOX\n": "TYPE=BOX, ELEMENT=SHELL\n",
                    "z, 0, 10, 2, 1\n": "z, 0, 1, 1, 1\n"}
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    wide = path.with_name(f"{'plate' if is_shell else 'wide'}_{path.name}")
    wide.write_text(text)
    return wide


def processes_of(run):
    """Numbers of the system of the processes that mpirun has started, in the order of MPI."""
    found, waiting = {}, [run.pid]
    while waiting:
        place = pathlib.Path("/proc") / str(waiting.pop())
        try:
            for thread in (place / "task").iterdir():
                waiting += map(int, (thread / "children").read_text().split())
            environment = dict(pair.split("=", 1) for pair in (place / "environ").read_text()
                               .split("\0") if "=" in pair)
        except OSError:
            continue
        rank = environment.get("OMPI_COMM_WORLD_RANK", environment.get("PMI_RANK"))
        if rank is not None:
            found[int(rank)] = int(place.name)
    return [found[rank] for rank in sorted(found)]


def is_alive(number):
    """Is there a process of this number, other than one that has ended and waits for its parent?"""
    try:
        state = pathlib.Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"


def begin_slider(processes, folder, *words, **options):
    """A run of which some history samples are taken; with the system's numbers of its processes."""
    (folder / "a.log").unlink(missing_ok=True)
    run = begin_mpi(processes, folder, *slider(folder), *words, **options)
    wait_for(lambda: n_rows(folder / "a.log") > 50 or run.poll() is not None)
    assert run.poll() is None, run.returncode
    return run, processes_of(run)


def words_of_igaform(said):
    """Without what mpirun tells of exit codes."""
    return re.sub(r"^-{40,}$.*?^-{40,}$\n", "", said, flags=re.MULTILINE | re.DOTALL).strip()


def any_number_continues(folder):
    """Stopped by a signal or the clock, and continued by another number of processes."""
    reference = whole(folder)
    for before, after, threads in ((3, 1, 2), (2, 4, 1)):
        run, numbers = begin_slider(before, folder, "--out", "a.h5")
        os.kill(numbers[0], signal.SIGTERM)
        assert run.wait(60) == 3, run.returncode
        words = [*slider(folder)[:-1], threads, "--restart", "a.ckpt.h5"]
        if after == 1:
            igaform(folder, *words)
        else:
            igaform_mpi(after, folder, *words)
        check_same(folder / "a.h5", reference)
    for wall in (1e-9, 2e-3):
        igaform(folder, *slider(folder), "--wall", wall, "--out", "b.h5", code=3)
        igaform_mpi(2, folder, *slider(folder), "--restart", "b.ckpt.h5")
        check_same(folder / "b.h5", reference)
    igaform_mpi(2, folder, *slider(folder), "--wall", "1e-9", "--out", "c.h5", code=3)
    igaform_mpi(3, folder, *slider(folder), "--restart", "c.ckpt.h5")
    check_same(folder / "c.h5", reference)


def rows_are_taken_up_by_any_number(folder):
    """The wide block on a floor, damped, and a shell between tools: each process moves its own
    rows, which change hands."""
    floor = ringing(folder, "*CHECKPOINT, STEPS=100\n*DAMPING, ALPHA=1000\n" + FLOOR, "2e-4",
                    safety=0.9)
    for words in ([by_rows(floor)], SHELL_BOX):
        words = [*words, "--threads", 1]
        igaform(folder, *words, "--out", "whole.h5")
        reference = datasets(folder / "whole.h5")
        igaform_mpi(3, folder, *words, "--out", "a.h5")
        assert "rows of control points each process moves" in (folder / "a.log").read_text()
        check_same(folder / "a.h5", reference)
        for before, after in ((3, 2), (2, 4)):
            igaform_mpi(before, folder, *words, "--wall", "1e-3", "--out", "a.h5", code=3)
            igaform_mpi(after, folder, *words, "--restart", "a.ckpt.h5")
            check_same(folder / "a.h5", reference)


def mpirun_hands_signals_on(folder):
    """SIGUSR1 saves and the run goes on. After SIGTERM mpirun leaves a second to save the state, so
    that it is this one or the last checkpoint from which the run goes on."""
    reference = whole(folder)
    run, _ = begin_slider(2, folder, "--out", "a.h5")
    saved = n_saved(folder)
    run.send_signal(signal.SIGUSR1)
    wait_for(lambda: n_saved(folder) > saved)
    assert run.wait(60) == 0, run.returncode
    check_same(folder / "a.h5", reference)
    run, numbers = begin_slider(2, folder, "--out", "a.h5")
    run.send_signal(signal.SIGTERM)
    assert run.wait(60) != 0
    wait_for(lambda: not any(map(is_alive, numbers)))
    igaform_mpi(3, folder, *slider(folder), "--restart", "a.ckpt.h5")
    check_same(folder / "a.h5", reference)


def n_saved(folder):
    return (folder / "a.log").read_text().count("checkpoint a.ckpt.h5 at step")


def a_killed_process_ends_all(folder):
    """Within seconds, and the last checkpoint is whole."""
    reference = whole(folder)
    for killed in (0, 1):
        run, numbers = begin_slider(3, folder, "--out", "a.h5")
        wait_for((folder / "a.ckpt.h5").exists)
        os.kill(numbers[killed], signal.SIGKILL)
        wait_for(lambda: not any(map(is_alive, numbers)), seconds=10)
        assert run.wait(10) not in (0, 3), run.returncode
        igaform_mpi(2, folder, *slider(folder), "--restart", "a.ckpt.h5")
        check_same(folder / "a.h5", reference)


def a_full_disk_ends_all(folder):
    """The first process writes, and the others learn that it cannot."""
    reference = whole(folder)
    run, numbers = begin_slider(2, folder, "--out", "a.h5", stderr=-1, text=True)
    wait_for((folder / "a.ckpt.h5").exists)
    room = (folder / "a.h5").stat().st_size
    resource.prlimit(numbers[0], resource.RLIMIT_FSIZE, (room, room))
    said = run.communicate(timeout=60)[1]
    assert run.returncode == 4, (run.returncode, said)
    assert said.count("error: result file 'a.h5'") == 1 and "--restart a.ckpt.h5" in said, said
    igaform_mpi(2, folder, *slider(folder), "--restart", "a.ckpt.h5")
    check_same(folder / "a.h5", reference)


def user_deck(folder, old="", new=""):
    """A bar of enough elements for several tiles, with a law in which something may be replaced."""
    law, deck = ((STABILITY / name).read_text() for name in ("fails_beyond.f", "user_law.key"))
    assert old in law and "x, 0, 8, 2, 8" in deck
    (folder / "law.f").write_text(law.replace(old, new, 1))
    (folder / "user.key").write_text(deck.replace("x, 0, 8, 2, 8", "x, 0, 32, 2, 32"))
    return ["user.key", "--user", "law.f", "--threads", 1]


def failures_are_reported_once(folder):
    """In the words of igaform, whichever process works the element: an inverted one, a law that
    fails, a tool that is too deep, a lost balance of energy."""
    floor = ringing(folder, FLOOR, "1e-5", safety=0.8, motion=TOO_FAST).rename(folder / "floor.key")
    lost = ringing(folder, "")
    for words in ([CRUSH, *HARD, "--set", "n_x=12"], user_deck(folder), [floor], [by_rows(floor)],
                  [by_rows(floor, is_shell=True)], [by_rows(lost)], [lost]):
        told = igaform(folder, *words, "--out", "a.h5", code=2).strip()
        reference = datasets(folder / "a.h5")
        for count in (2, 3):
            said = igaform_mpi(count, folder, *words, "--out", "a.h5", code=2)
            assert words_of_igaform(said) == told, f"{said}\n\nigaform: {told}"
            check_same(folder / "a.h5", reference)


def a_retry_begins_at_the_same_state(folder):
    saving = "*CHECKPOINT, STEPS=10, RETRY=0.5\n"
    # A plate needs a time step that is too long by more.
    plate = by_rows(ringing(folder, saving + FLOOR, "2e-4", safety=1.15), is_shell=True)
    path = ringing(folder, saving, "2e-4")
    for deck in (path, by_rows(path), plate.rename(folder / "plate.key")):
        igaform(folder, deck, "--out", "b.h5", "--threads", 1)
        reference, tried = datasets(folder / "b.h5"), tried_from(folder)
        for count in (2, 3):
            igaform_mpi(count, folder, deck, "--out", "b.h5", "--threads", 1)
            assert tried_from(folder) == tried
            check_same(folder / "b.h5", reference)


def a_wrong_deck_is_reported_once(folder):
    """All its errors, and nothing is written."""
    text = SLIDER.read_text().replace("TOOL=plane,", "TOOL=plain,")
    (folder / "wrong.key").write_text(text.replace("<way/", "<wax/"))
    told = igaform(folder, "wrong.key", "--out", "a.h5", code=1).strip()
    assert "plain" in told and "wax" in told, told
    said = igaform_mpi(3, folder, "wrong.key", "--out", "a.h5", code=1)
    assert words_of_igaform(said) == told, said
    assert [file.name for file in folder.iterdir()] == ["wrong.key"], list(folder.iterdir())


def a_deck_that_one_process_cannot_read(folder):
    """Another one than the first, in a folder of its own: it says so, and none begins."""
    (folder / "other").mkdir()
    (folder / "slider.key").write_text(SLIDER.read_text())
    turn = "[ ${OMPI_COMM_WORLD_RANK:-$PMI_RANK} = 1 ] && cd other; exec \"$0\" \"$@\""
    said = words_of_igaform(igaform_mpi(3, folder, "slider.key", "--out", "a.h5", code=1,
                                        within=["sh", "-c", turn]))
    assert said.splitlines() == ["slider.key: error: found no file `slider.key`; expected a "
                                 "readable text file of keywords or data",
                                 "1 error, 0 warnings"], said
    assert not list(folder.rglob("a.*")), list(folder.rglob("a.*"))


def each_process_has_its_file_of_messages(folder):
    """Together they have the lines of the run by igaform, whatever was in them before."""
    words = [*user_deck(folder, "      G = ", "      WRITE(7,*) 'at',NOEL,NPT,KINC\n      G = "),
             "--set", "limit=1"]
    igaform(folder, *words, "--out", "m.h5")
    reference = (folder / "m.msg").read_text().splitlines()
    names = ["m.msg", "m.1.msg", "m.2.msg"]
    for name in names[1:]:
        (folder / name).write_text(f"{reference[0]}\nof an earlier run\n")
    igaform_mpi(3, folder, *words, "--out", "m.h5")
    lines = [(folder / name).read_text().splitlines() for name in names]
    assert all(len(those) > 1000 and those[0] == reference[0] for those in lines), lines
    assert sorted(line for those in lines for line in those[1:]) == sorted(reference[1:])
    (folder / "m.2.msg").write_text("mine\n")
    said = igaform_mpi(3, folder, *words, "--out", "m.h5", code=1)
    assert "message file 'm.2.msg'" in said and (folder / "m.2.msg").read_text() == "mine\n", said


def a_law_that_ends_the_run(folder):
    """In another process than the first: one message, which the log has too."""
    words = [*user_deck(folder, "STRESS(1) = SQRT(-STRAN(1))", "CALL XIT"), "--out", "a.h5"]
    told = igaform(folder, *words, code=2).splitlines()[0]
    assert "ended the run (XIT) in element" in told, told
    for count in (2, 3):
        said = igaform_mpi(count, folder, *words, code=2)
        assert [line for line in said.splitlines() if "igaform: " in line] == [told], said
        assert told.removeprefix("igaform: ") in (folder / "a.log").read_text()


TESTS = (a_wrong_deck_is_reported_once, a_deck_that_one_process_cannot_read,
         any_number_continues, rows_are_taken_up_by_any_number, mpirun_hands_signals_on,
         a_killed_process_ends_all,
         a_full_disk_ends_all, failures_are_reported_once, a_retry_begins_at_the_same_state,
         each_process_has_its_file_of_messages, a_law_that_ends_the_run)

if __name__ == "__main__":
    names = {test.__name__.replace("_", " "): test for test in TESTS}
    run_all(*(names[name] for name in sys.argv[5:] or names))
