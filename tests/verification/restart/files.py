"""Disks that are full, folders that cannot be written, files that vanish, numerics that fail.

Usage: files.py PROGRAM PROJECT
"""
import os
import pathlib
import resource
import tempfile

import h5py

from common import STRIP, begin, deck, igaform, n_rows, opens, wait_for

SMALL = ["--set", "n_x=4", "--set", "n_y=2", "--set", "end_time=2e-4"]


def a_full_disk_is_no_fault_of_the_numerics(folder):
    """A limit on the size of files, which write() meets as it would a full disk."""
    path = deck(folder, STRIP)
    igaform(folder, path, *SMALL, "--out", "whole.h5")
    size = (folder / "whole.h5").stat().st_size

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (9 * size // 10, 9 * size // 10))

    said = igaform(folder, path, *SMALL, "--out", "a.h5", code=4, preexec_fn=limit)
    assert "cannot write it" in said and "the run stops" in said, said
    for word in ("energy", "element", "unstable"):
        assert word not in said, said
    path = deck(folder, STRIP, "*CHECKPOINT, STEPS=20", name="saved.key")
    said = igaform(folder, path, *SMALL, "--out", "b.h5", code=4, preexec_fn=limit)
    assert "go on with --restart b.ckpt.h5" in said, said
    igaform(folder, path, *SMALL, "--restart", "b.ckpt.h5")
    assert opens(folder / "b.h5")


def folders_that_cannot_be_written(folder):
    path = deck(folder, STRIP)
    said = igaform(folder, path, "--out", "nowhere/a.h5", code=1)
    assert "nowhere/a.h5" in said and "No such file" in said, said
    if os.geteuid() != 0:
        (folder / "sealed").mkdir(mode=0o500)
        said = igaform(folder, path, "--out", "sealed/a.h5", code=1)
        assert "sealed/a.h5" in said and "Permission" in said, said


def an_include_that_vanished(folder):
    path = deck(folder, STRIP, "*CHECKPOINT, NUMBER=2")
    igaform(folder, path, *SMALL, "--out", "a.h5")
    before = (folder / "a.h5").read_bytes()
    path = deck(folder, folder / "gone.key", "*CHECKPOINT, NUMBER=2", name="gone_deck.key")
    said = igaform(folder, path, "--restart", "a.ckpt.h5", code=1)
    assert "gone.key" in said and "gone_deck.key:1" in said, said
    assert (folder / "a.h5").read_bytes() == before


def a_deleted_result(folder):
    path = deck(folder, STRIP, "*CHECKPOINT, STEPS=200")
    words = ["--set", "n_x=6", "--set", "end_time=1e-3", "--out", "a.h5"]
    run = begin(folder, path, *words)
    wait_for((folder / "a.ckpt.h5").exists)
    rows = n_rows(folder / "a.log")
    (folder / "a.h5").unlink()
    assert run.wait(60) == 4, (rows, run.returncode)
    log = (folder / "a.log").read_text()
    assert "deleted or moved it" in log and "--restart a.ckpt.h5" in log, log
    igaform(folder, path, *words[:4], "--restart", "a.ckpt.h5")
    assert opens(folder / "a.h5")


def failing_deck(folder, *lines):
    """A strip that is pulled until an element turns over: far too large a step."""
    text = STRIP.read_text().replace("*DYNAMIC, EXPLICIT", "*DYNAMIC, EXPLICIT, SAFETY=0.99")
    text = text.replace("X_MAX, 1, 1, <strain*length/(end_time - rise/2)>",
                        "X_MAX, 1, 1, <-3*length/end_time>")
    path = folder / "crush.key"
    path.write_text(text + "\n".join(lines) + "\n")
    return path


def a_failed_run_leaves_its_last_good_state(folder):
    path = failing_deck(folder)
    said = igaform(folder, path, *SMALL, "--out", "a.h5", code=2)
    assert "the last good state" in said and "--restart a.ckpt.h5" in said, said
    with h5py.File(folder / "a.h5") as file:
        assert file["provenance"].attrs["status"] == b"failed"
        assert file["frames/is_failed"][-1] == 1
    said = igaform(folder, path, *SMALL, "--restart", "a.ckpt.h5", code=2)
    assert "the last good state" in said, said
    path = failing_deck(folder, "*CHECKPOINT, RETRY=0.5")
    igaform(folder, path, *SMALL, "--out", "b.h5", code=2)
    assert "one more try from step" in (folder / "b.log").read_text()


if __name__ == "__main__":
    for test in (a_full_disk_is_no_fault_of_the_numerics, folders_that_cannot_be_written,
                 an_include_that_vanished, a_deleted_result,
                 a_failed_run_leaves_its_last_good_state):
        with tempfile.TemporaryDirectory() as place:
            test(pathlib.Path(place))
        print("passed:", test.__name__.replace("_", " "), flush=True)
