"""Disks that are full, folders that cannot be written, files that vanish, names of all kinds.

Usage: files.py PROGRAM PROJECT
"""
import ctypes
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import time

import h5py

from common import (PROJECT, STRIP, begin, check_same, datasets, deck, igaform, n_rows, opens,
                    run_all, wait_for)

STABILITY = PROJECT / "input" / "stability"
SMALL = ["--set", "n_x=4", "--set", "n_y=2", "--set", "end_time=2e-4", "--threads", "1"]


def a_full_disk_is_no_fault_of_the_numerics(folder):
    """A limit on the size of files, which write() meets as it would a full disk."""
    path = deck(folder, STRIP)
    igaform(folder, path, *SMALL, "--out", "whole.h5")
    size = (folder / "whole.h5").stat().st_size

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (9 * size // 10, 9 * size // 10))

    said = igaform(folder, path, *SMALL, "--out", "a.h5", code=4, preexec_fn=limit)
    assert "a.h5" in said, said
    for word in ("energy", "element", "unstable"):
        assert word not in said, said
    path = deck(folder, STRIP, "*CHECKPOINT, STEPS=20", name="saved.key")
    said = igaform(folder, path, *SMALL, "--out", "b.h5", code=4, preexec_fn=limit)
    assert "--restart b.ckpt.h5" in said, said
    igaform(folder, path, *SMALL, "--restart", "b.ckpt.h5")
    assert opens(folder / "b.h5")


def a_checkpoint_that_finds_no_room_leaves_the_one_before(folder):
    """A disk with room for the result, but not for the last checkpoint."""
    path = deck(folder, STRIP, "*CHECKPOINT, STEPS=20")
    igaform(folder, path, *SMALL, "--out", "whole.h5")
    result, checkpoint = ((folder / name).stat().st_size for name in ("whole.h5", "whole.ckpt.h5"))
    room = (result + checkpoint) // 2
    assert result < room < checkpoint, (result, checkpoint)
    igaform(folder, path, *SMALL, "--out", "a.h5",
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)))
    log = (folder / "a.log").read_text()
    assert "warning: checkpoint 'a.ckpt.h5'" in log, log
    assert not (folder / "a.ckpt.h5.igaform-new").exists()
    assert (folder / "a.ckpt.h5").stat().st_size <= room
    written = [line for line in log.splitlines() if line.startswith("checkpoint a.ckpt.h5 at")]
    reference = datasets(folder / "whole.h5")
    check_same(folder / "a.h5", reference)
    igaform(folder, path, *SMALL, "--restart", "a.ckpt.h5")
    check_same(folder / "a.h5", reference)
    step = written[-1].split(" at ")[1]
    assert f"restart    from a.ckpt.h5, {step}" in (folder / "a.log").read_text(), log


def a_stop_without_room_says_so(folder):
    """Nothing is saved: that is not the exit code of a run that can go on."""
    words = [STRIP, "--set", "n_x=40", "--set", "end_time=0.1", "--wall", "0.01", "--out", "n.h5"]
    igaform(folder, *words, code=3)
    size = sum((folder / name).stat().st_size for name in ("n.h5", "n.ckpt.h5"))//2
    (folder / "n.ckpt.h5").unlink()

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    said = igaform(folder, *words, code=4, preexec_fn=limit)
    assert "error" in said and "--restart" not in said, said


def obey_permissions():
    """For the user root, whom they do not bind: without the capabilities that override them."""
    if os.geteuid() == 0:
        drop, override, read_search = 24, 1, 2      # of Linux: PR_CAPBSET_DROP, CAP_DAC_...
        libc = ctypes.CDLL(None, use_errno=True)
        for capability in (override, read_search):
            if libc.prctl(drop, capability, 0, 0, 0) != 0:
                raise OSError(ctypes.get_errno(), "prctl")


def folders_that_cannot_be_written(folder):
    path = deck(folder, STRIP)
    said = igaform(folder, path, "--out", "nowhere/a.h5", code=1)
    assert "nowhere/a.h5" in said and "No such file" in said, said
    (folder / "sealed").mkdir(mode=0o500)
    said = igaform(folder, path, "--out", "sealed/a.h5", code=1, preexec_fn=obey_permissions)
    assert "sealed/a.h5" in said and "Permission" in said, said
    assert not list((folder / "sealed").iterdir())
    # The folder may be written, an earlier result may not.
    igaform(folder, path, *SMALL, "--out", "kept.h5")
    kept = (folder / "kept.h5").read_bytes()
    (folder / "kept.h5").chmod(0o400)
    said = igaform(folder, path, "--out", "kept.h5", code=1, preexec_fn=obey_permissions)
    assert "kept.h5" in said and "Permission denied" in said, said
    assert (folder / "kept.h5").read_bytes() == kept


def a_folder_that_is_sealed_under_way(folder):
    """The run comes to its end; only what needs a new file, the checkpoint, is not written, which a
    quiet run tells too, with the reason."""
    place = folder / "place"
    place.mkdir()
    path = deck(folder, STRIP, "*CHECKPOINT, STEPS=100")
    words = ["--set", "n_x=4", "--set", "end_time=2e-3", "--threads", "1"]
    run = begin(folder, path, *words, "--out", "place/a.h5", preexec_fn=obey_permissions,
                stderr=subprocess.PIPE, text=True)
    wait_for((place / "a.ckpt.h5").exists)
    place.chmod(0o500)
    said = run.communicate(timeout=60)[1]
    assert run.returncode == 0, run.returncode
    place.chmod(0o700)
    log = (place / "a.log").read_text()
    told = "warning: checkpoint 'place/a.ckpt.h5' "
    assert told in log and f"igaform: {told}" in said, (log, said)
    assert "Permission denied" in said and "error:" not in said, said
    assert opens(place / "a.h5")
    reference = datasets(place / "a.h5")
    igaform(folder, path, *words, "--restart", "place/a.ckpt.h5")
    check_same(place / "a.h5", reference)


def a_checkpoint_that_cannot_go_is_told(folder):
    """That of a run that is complete, in a folder that is sealed meanwhile."""
    place = folder / "place"
    place.mkdir()
    words = ["--set", "n_x=4", "--set", "n_y=2", "--set", "end_time=2e-3", "--threads", "1"]
    run = begin(folder, STRIP, *words, "--out", "place/a.h5", preexec_fn=obey_permissions,
                stderr=subprocess.PIPE, text=True)
    wait_for(lambda: n_rows(place / "a.log") > 1)
    run.send_signal(signal.SIGUSR1)
    wait_for((place / "a.ckpt.h5").exists)
    place.chmod(0o500)
    said = run.communicate(timeout=60)[1]
    place.chmod(0o700)
    assert run.returncode == 0 and (place / "a.ckpt.h5").exists(), run.returncode
    assert "checkpoint place/a.ckpt.h5" in said and "Permission denied" in said, said
    assert "removed, since" not in (place / "a.log").read_text()


def an_include_that_vanished(folder):
    path = deck(folder, STRIP, "*CHECKPOINT, NUMBER=2")
    igaform(folder, path, *SMALL, "--out", "a.h5")
    before = (folder / "a.h5").read_bytes()
    path = deck(folder, folder / "gone.key", "*CHECKPOINT, NUMBER=2", name="gone_deck.key")
    said = igaform(folder, path, "--restart", "a.ckpt.h5", code=1)
    assert "gone.key" in said and "gone_deck.key:1" in said, said
    assert (folder / "a.h5").read_bytes() == before


def an_empty_file_may_be_replaced(folder):
    """As a run leaves it that is killed at once; no other file is touched."""
    path = deck(folder, STRIP)
    (folder / "a.h5").write_bytes(b"")
    igaform(folder, path, *SMALL, "--out", "a.h5")
    assert opens(folder / "a.h5")
    (folder / "b.h5").write_text("mine")
    assert "left alone" in igaform(folder, path, *SMALL, "--out", "b.h5", code=1)
    assert (folder / "b.h5").read_text() == "mine"
    with h5py.File(folder / "c.h5", "w") as file:
        file["mine"] = 1
    before = (folder / "c.h5").read_bytes()
    assert "left alone" in igaform(folder, path, *SMALL, "--out", "c.h5", code=1)
    assert (folder / "c.h5").read_bytes() == before


def a_disk_that_is_full_at_the_start(folder):
    """What does not begin leaves nothing."""
    path = deck(folder, STRIP)
    for room in (0, 3000, 20000):
        said = igaform(folder, path, *SMALL, "--out", "a.h5", code=1,
                       preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)))
        assert "'a.h5'" in said, said
        assert not (folder / "a.h5").exists(), room


def what_a_killed_run_began_goes_away(folder):
    path = deck(folder, STRIP)
    for name in ("a.h5.igaform-new", "a.ckpt.h5.igaform-new", "b.h5.igaform-new"):
        (folder / name).write_text("half of it")
    igaform(folder, path, *SMALL, "--out", "a.h5")
    assert sorted(file.name for file in folder.glob("*.igaform-new")) == ["b.h5.igaform-new"]
    path = deck(folder, STRIP, "*CHECKPOINT, NUMBER=2")
    igaform(folder, path, *SMALL, "--out", "a.h5")
    (folder / "a.h5.igaform-new").write_text("half of it")
    igaform(folder, path, *SMALL, "--restart", "a.ckpt.h5")
    assert not (folder / "a.h5.igaform-new").exists()


def what_others_made_is_left_alone(folder):
    """By a run that goes on, too: a text, HDF5 of another program, a pipe, a checkpoint, a log."""
    path = deck(folder, STRIP, "*CHECKPOINT, NUMBER=2")
    igaform(folder, path, *SMALL, "--out", "a.h5")
    saved = (folder / "a.ckpt.h5").read_bytes()
    (folder / "text.h5").write_text("mine")
    with h5py.File(folder / "other.h5", "w") as file:
        file["mine"] = 1
    (folder / "saved.h5").write_bytes(saved)
    (folder / "diary.log").write_text("mine\n")
    os.mkfifo(folder / "pipe.h5")
    before = {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()}
    for name, reason in (("text", "not a result"), ("other", "not a result"),
                         ("saved", "a checkpoint of"), ("diary", "no log"),
                         ("pipe", "a pipe")):
        for more in ([], ["--restart", "a.ckpt.h5"]):
            said = igaform(folder, path, *SMALL, *more, "--out", name + ".h5", code=1)
            assert reason in said, (name, more, said)
    said = igaform(folder, path, *SMALL, "--restart", "a.ckpt.h5", "--out", "a.ckpt.h5", code=1)
    assert "checkpoint" in said, said
    now = {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()}
    assert now == before, set(now) ^ set(before)


PULL = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*MATERIAL TEST, NAME=pull, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=2
0.01
"""


def texts_of_others_are_left_alone(folder):
    """One rule for each text that is written: a file of somebody, a link to it, a pipe, a folder
    stay as they are; what igaform has written, or an empty file, is replaced."""
    (folder / "law.f").write_text((STABILITY / "fails_beyond.f").read_text())
    (folder / "list.txt").write_text("nowhere.key --out n.h5\n")
    (folder / "pull.key").write_text(PULL)
    user_law = [STABILITY / "user_law.key", "--user", "law.f", "--threads", 1, "--out", "u.h5"]
    words = {"u.msg": user_law,
             "u.log": [STRIP, *SMALL, "--out", "u.h5"],
             "n.err": ["batch", "list.txt"], "list_summary.csv": ["batch", "list.txt"],
             "m-pull.csv": ["material", "pull.key", "--out", "m.h5"]}
    for name, command in words.items():
        place, mine = folder / name, folder / "mine.txt"
        mine.write_text("mine\n")
        for kind in ("file", "link", "pipe", "folder"):
            {"file": lambda: place.write_text("mine\n"), "folder": place.mkdir,
             "link": lambda: place.symlink_to("mine.txt"), "pipe": lambda: os.mkfifo(place)}[kind]()
            before = place.lstat().st_ino
            said = igaform(folder, *command, code=4 if name == "m-pull.csv" else 1, limit=20)
            assert "left alone" in said and name in said, (name, kind, said)
            assert mine.read_text() == "mine\n" and place.lstat().st_ino == before, (name, kind)
            assert kind != "file" or place.read_text() == "mine\n", name
            assert name[0] != "u" or not (folder / "u.h5").exists(), (name, kind)
            place.rmdir() if kind == "folder" else place.unlink()
        code = {"u.msg": 2, "n.err": 1, "list_summary.csv": 1}.get(name, 0)
        place.touch()
        mine.unlink()
        igaform(folder, *command, code=code)
        if name == "u.msg":       # nothing was written to unit 7
            assert not place.exists()
            place.write_text("igaform: messages of the user's subroutines (unit 7)\nold\n")
        else:                     # by another name, and by a link that stays one
            mine.write_bytes(place.read_bytes())
            place.unlink()
            place.symlink_to("mine.txt")
        igaform(folder, *command, code=code)
        assert name == "u.msg" or place.is_symlink() and mine.stat().st_size > 10, name
        place.unlink(missing_ok=True)
        for left in ("u.h5", "u.ckpt.h5"):
            (folder / left).unlink(missing_ok=True)


def a_link_to_the_result_stays(folder):
    """To a disk with more room, say: result and checkpoint are where the links lead to."""
    (folder / "far").mkdir()
    path = deck(folder, STRIP, "*CHECKPOINT, NUMBER=2")
    igaform(folder, path, *SMALL, "--out", "far/a.h5")
    reference = datasets(folder / "far" / "a.h5")
    for name in ("a.h5", "a.ckpt.h5"):
        (folder / name).symlink_to(pathlib.Path("far") / name)
    (folder / "far" / "a.h5").write_bytes(b"")
    igaform(folder, path, *SMALL, "--restart", "a.ckpt.h5")
    igaform(folder, path, *SMALL, "--out", "a.h5")
    assert (folder / "a.h5").is_symlink() and (folder / "a.ckpt.h5").is_symlink()
    check_same(folder / "far" / "a.h5", reference)
    assert sorted(file.name for file in (folder / "far").iterdir()) == ["a.ckpt.h5", "a.h5",
                                                                       "a.log"]


def a_disk_that_is_full_for_a_while(folder):
    """Rows that could not be written with a checkpoint are missing: the run ends, for it must not
    come to its end without them. Later it goes on from the checkpoint before."""
    source = folder / "rows.key"
    source.write_text(STRIP.read_text().replace("FRAMES=10, HISTORY=200", "FRAMES=1, HISTORY=2000"))
    path = deck(folder, source, "*CHECKPOINT, STEPS=500")
    words = ["--set", "n_x=4", "--set", "n_y=2", "--set", "end_time=2e-3", "--threads", "1"]
    igaform(folder, path, *words, "--out", "full.h5")
    run = begin(folder, path, *words, "--out", "a.h5")
    wait_for((folder / "a.ckpt.h5").exists)
    room = (folder / "a.h5").stat().st_size
    resource.prlimit(run.pid, resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
    log = folder / "a.log"
    wait_for(lambda: "cannot write it" in log.read_text() or run.poll() is not None)
    resource.prlimit(run.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
    assert run.wait(60) == 4, log.read_text()
    assert "/history" in log.read_text(), log.read_text()
    igaform(folder, path, *words, "--restart", "a.ckpt.h5")
    check_same(folder / "a.h5", datasets(folder / "full.h5"))


def a_deleted_result(folder):
    path = deck(folder, STRIP, "*CHECKPOINT, STEPS=200")
    words = ["--set", "n_x=6", "--set", "end_time=1e-3", "--out", "a.h5"]
    run = begin(folder, path, *words)
    wait_for((folder / "a.ckpt.h5").exists)
    rows = n_rows(folder / "a.log")
    (folder / "a.h5").unlink()
    assert run.wait(60) == 4, (rows, run.returncode)
    log = (folder / "a.log").read_text()
    assert "replaced" in log and "--restart a.ckpt.h5" in log, log
    igaform(folder, path, *words[:4], "--restart", "a.ckpt.h5")
    assert opens(folder / "a.h5")


def a_result_cut_short(folder):
    """In its place, by somebody else: it has holes where frames were, whatever is added to it. So
    nothing is added, at the end too, and the checkpoint does not get a copy of it."""
    path = deck(folder, STRIP, "*CHECKPOINT, STEPS=200")
    words = ["--set", "n_x=4", "--set", "n_y=2", "--set", "end_time=1e-3", "--threads", 1]
    for size in (0, 10_000_000):
        (folder / "a.ckpt.h5").unlink(missing_ok=True)
        run = begin(folder, path, *words, "--out", "a.h5")
        wait_for((folder / "a.ckpt.h5").exists)
        os.truncate(folder / "a.h5", size)
        assert run.wait(60) == 4, (size, run.returncode)
        log = (folder / "a.log").read_text()
        assert f"{size} bytes" in log, log
        assert "--restart a.ckpt.h5" in log, log
    igaform(folder, path, *words, "--restart", "a.ckpt.h5")
    assert opens(folder / "a.h5")
    shorter = STRIP.read_text().replace("FRAMES=10, HISTORY=200", "FRAMES=1, HISTORY=2000")
    (folder / "rows.key").write_text(shorter)
    run = begin(folder, "rows.key", *words, "--out", "e.h5")
    wait_for(lambda: n_rows(folder / "e.log") > 20)
    os.truncate(folder / "e.h5", (folder / "e.h5").stat().st_size - 1)
    assert run.wait(60) == 4, run.returncode


def a_replaced_result(folder):
    """Another file of its name is not what the run writes to, nor what it saves: some of these
    moments are between the flush of a result and its copy in the checkpoint."""
    path = deck(folder, STRIP, "*CHECKPOINT, STEPS=200")
    words = ["--set", "n_x=6", "--set", "end_time=3e-4", "--threads", "1"]
    igaform(folder, path, *words, "--out", "full.h5")
    reference = datasets(folder / "full.h5")
    n_seen = 0
    for wait in range(10):
        run = begin(folder, path, *words, "--out", "a.h5")
        wait_for((folder / "a.ckpt.h5").exists)
        shutil.copy(folder / "a.h5", folder / "copy.h5")
        time.sleep(0.003*wait)
        (folder / "copy.h5").rename(folder / "a.h5")
        if run.wait(60) != 0:   # on a busy machine it may have come to its end before
            n_seen += 1
            assert run.returncode == 4, (wait, run.returncode)
            assert "replaced" in (folder / "a.log").read_text()
            igaform(folder, path, *words, "--restart", "a.ckpt.h5")
            check_same(folder / "a.h5", reference)
        for name in ("a.h5", "a.ckpt.h5", "a.log"):
            (folder / name).unlink()
    assert n_seen > 2, n_seen


def names_do_not_reach_a_shell(folder):
    """Blanks, quotes, semicolons and what a shell would carry out, in every place for a name."""
    odd = "a b;'$(touch trap)`touch trap`&|>trap"
    place = folder / (odd + " folder")
    place.mkdir()
    (place / (odd + ".inc")).write_text(STRIP.read_text())
    path = place / (odd + ".key")
    path.write_text(f'*INCLUDE, INPUT="{odd}.inc"\n*CHECKPOINT, NUMBER=2\n')
    path = path.rename(place / (odd + '".key'))    # a quote cannot stand in an *INCLUDE
    igaform(folder, path, *SMALL, "--out", place / (odd + ".h5"))
    igaform(folder, path, *SMALL, "--restart", place / (odd + ".ckpt.h5"))
    log = (place / (odd + ".log")).read_text()
    assert f"reads      {place.resolve() / (odd + '.inc')}\n" in log, log
    for words in (["watch", "--once"], ["history", "--out", place / (odd + ".png")]):
        done = subprocess.run([sys.executable, "-m", "post", words[0], place / (odd + ".h5"),
                               *words[1:]], cwd=folder, capture_output=True, text=True,
                              env=os.environ | {"PYTHONPATH": str(PROJECT)}, timeout=100)
        assert done.returncode == 0, done.stderr
    left = sorted(file.name for file in place.iterdir())
    assert left == sorted(odd + ending for ending in (".inc", '".key', ".h5", ".log", ".ckpt.h5",
                                                      ".png")), left
    assert [file.name for file in folder.iterdir()] == [place.name], list(folder.iterdir())


if __name__ == "__main__":
    run_all(a_full_disk_is_no_fault_of_the_numerics, a_stop_without_room_says_so,
            a_checkpoint_that_finds_no_room_leaves_the_one_before,
            folders_that_cannot_be_written, a_folder_that_is_sealed_under_way,
            a_checkpoint_that_cannot_go_is_told,
            an_include_that_vanished, an_empty_file_may_be_replaced,
            what_others_made_is_left_alone, texts_of_others_are_left_alone,
            a_link_to_the_result_stays,
            a_disk_that_is_full_for_a_while, what_a_killed_run_began_goes_away,
            a_deleted_result, a_result_cut_short, a_replaced_result,
            a_disk_that_is_full_at_the_start,
            names_do_not_reach_a_shell)
