"""Runs killed at random moments: after each the run is taken up again from the newest whole
checkpoint, or begun anew where there is none, and the result has the bits of the undisturbed run.
Of five kills two come at any time, and one each just after the result file has grown, after a
checkpoint has been begun, and at the end of the run. The scene has contact with friction, damping
and wear.

Usage: kill.py PROGRAM PROJECT [KILLS]
"""
import collections
import pathlib
import random
import sys
import tempfile
import time

import h5py

from common import PROJECT, begin, check_same, datasets, igaform, n_rows, opens

KILLS = int(sys.argv[3]) if len(sys.argv) > 3 else 10
SCENE = PROJECT / "tests" / "verification" / "contact" / "slider.key"
SETTINGS = ["--set", "friction=0.1", "--threads", "1"]
RESULT, CHECKPOINT, LOG = "k.h5", "k.ckpt.h5", "k.log"
SHORT = 3e-3        # seconds: more than a frame takes to write


def size(path):
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return -1


def await_growth(folder, run, seconds):
    """From a random moment on, wait until the result file grows."""
    time.sleep(random.uniform(0, seconds))
    before = size(folder / RESULT)
    while run.poll() is None and size(folder / RESULT) == before:
        pass


def await_checkpoint(folder, run, seconds):
    """From a random moment on, wait until a checkpoint is begun."""
    time.sleep(random.uniform(0, seconds))
    while run.poll() is None and not (folder / (CHECKPOINT + ".new")).exists():
        pass


def await_end(folder, run, rows):
    """Wait until all steps are done."""
    while run.poll() is None and n_rows(folder / LOG) < rows:
        pass


def counts_of(path):
    """Rows of all datasets that grow with the frames, and the status of a result that opens."""
    with h5py.File(path, "r") as file:
        found = {}
        file.visititems(lambda name, item: found.update({name: item.shape[0]}) if isinstance(
            item, h5py.Dataset) and item.maxshape[:1] == (None,) and item.shape[0] else None)
        steps = file["VTKHDF/Steps"].attrs.get("NSteps", 0)
        status = file["provenance"].attrs.get("status", b"") if "provenance" in file else b""
    return found, int(steps), bytes(status)


def is_within_frame(path, reference):
    """Are some datasets longer than the number of frames says?"""
    found, steps, _ = counts_of(path)
    whole, all_steps, _ = reference
    one = {name: rows // all_steps for name, rows in whole.items() if rows % all_steps == 0
           and name.startswith("VTKHDF")}
    return any(found.get(name, 0) not in (rows * steps, 0) for name, rows in one.items())


def phase(folder, run, reference):
    """What the run was at when it was killed, as its files tell."""
    if run.returncode == 0:
        return "finished"
    if not (folder / RESULT).exists():
        return "set-up"
    if (folder / (CHECKPOINT + ".new")).exists():
        return "writing a checkpoint"
    if not opens(folder / RESULT):
        return "writing the result, which did not open"
    if is_within_frame(folder / RESULT, reference):
        return "writing a frame, the result opened"
    if counts_of(folder / RESULT)[2] == b"completed":
        return "closing"
    if (folder / CHECKPOINT).exists():
        return "stepping, after a checkpoint"
    return "stepping, before the first checkpoint"


def main(folder):
    random.seed(7)
    path = folder / "deck.key"
    path.write_text(SCENE.read_text().split("*OUTPUT")[0] + "*CHECKPOINT, STEPS=150\n"
                    "*OUTPUT, FRAMES=12, HISTORY=100, FIELDS=WEAR\n")
    start = time.monotonic()
    igaform(folder, path, *SETTINGS, "--out", "full.h5")
    spent = time.monotonic() - start
    reference, shapes = datasets(folder / "full.h5"), counts_of(folder / "full.h5")
    rows = n_rows(folder / "full.log")
    counts, resumed = collections.Counter(), 0
    for number in range(KILLS):
        for file in folder.glob("k.*"):
            file.unlink()
        run = begin(folder, path, *SETTINGS, "--out", RESULT)
        if number % 5 < 2:
            time.sleep(random.uniform(0, spent))
        elif number % 5 == 2:
            await_growth(folder, run, 0.9 * spent)
        elif number % 5 == 3:
            await_checkpoint(folder, run, 0.9 * spent)
        else:
            await_end(folder, run, rows)
        if number % 5 > 1:
            time.sleep(SHORT * random.random()**3)
        run.kill()
        run.wait()
        counts[phase(folder, run, shapes)] += 1
        given = ["--out", RESULT]
        if (folder / CHECKPOINT).exists():
            given = ["--restart", CHECKPOINT]
            resumed += 1
        igaform(folder, path, *SETTINGS, *given)
        check_same(folder / RESULT, reference)
    for name, count in sorted(counts.items()):
        print(f"| {name} | {count} |")
    print(f"{KILLS} kills, {resumed} runs taken up from a checkpoint; all results have the bits of "
          "the undisturbed run")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        main(pathlib.Path(place))
