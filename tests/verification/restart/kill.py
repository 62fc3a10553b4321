"""Runs killed at random moments: after each the run is taken up again from the newest whole
checkpoint, or begun anew where there is none, and the result has the bits of the undisturbed run.

Usage: kill.py PROGRAM PROJECT [KILLS]
"""
import collections
import pathlib
import random
import sys
import tempfile
import time

from common import STRIP, begin, check_same, datasets, deck, igaform, opens

KILLS = int(sys.argv[3]) if len(sys.argv) > 3 else 10
SETTINGS = ["--set", "n_x=4", "--set", "n_y=2", "--set", "end_time=2e-4", "--threads", "1"]


def phase(folder, run):
    """What the run was at when it was killed, as its files tell."""
    if run.returncode == 0:
        return "finished"
    if not (folder / "k.h5").exists():
        return "set-up"
    if (folder / "k.ckpt.h5.new").exists():
        return "writing a checkpoint"
    return "stepping, frames" if (folder / "k.ckpt.h5").exists() else "before the first checkpoint"


def main(folder):
    random.seed(7)
    path = deck(folder, STRIP, "*CHECKPOINT, STEPS=40")
    start = time.monotonic()
    igaform(folder, path, *SETTINGS, "--out", "full.h5")
    spent = time.monotonic() - start
    reference = datasets(folder / "full.h5")
    counts, unreadable, resumed = collections.Counter(), 0, 0
    for _ in range(KILLS):
        for file in folder.glob("k.*"):
            file.unlink()
        run = begin(folder, path, *SETTINGS, "--out", "k.h5")
        time.sleep(random.uniform(0, spent))
        run.kill()
        run.wait()
        counts[phase(folder, run)] += 1
        unreadable += (folder / "k.h5").exists() and not opens(folder / "k.h5")
        given = ["--out", "k.h5"]
        if (folder / "k.ckpt.h5").exists():
            given = ["--restart", "k.ckpt.h5"]
            resumed += 1
        igaform(folder, path, *SETTINGS, *given)
        check_same(folder / "k.h5", reference)
    for name, count in sorted(counts.items()):
        print(f"{name:30}{count:5}")
    print(f"{KILLS} kills, {resumed} runs taken up from a checkpoint, {unreadable} result files "
          "that could not be read until then; all results have the bits of the undisturbed run")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        main(pathlib.Path(place))
