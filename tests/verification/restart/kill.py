"""Runs killed at random moments, and some of them once more when they have been taken up again:
each goes on from the newest whole checkpoint, or begins anew where there is none, and the result
has the bits of the undisturbed run. Of five kills two come at any time, and one each just after the
result file has grown, after a checkpoint has been begun, and at the end. A run that has ended
before it is killed does not count: it is begun again from the same files. The scene has contact
with friction, damping and wear.

Usage: kill.py PROGRAM PROJECT [KILLS]
"""
import collections
import random
import re
import signal
import sys
import time

import h5py

from common import PROJECT, begin, check_same, datasets, igaform, opens, run_all

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


def text_of(log):
    return log.read_text() if log.exists() else ""


def last_saved_step(log):
    """Of the checkpoint in hand, 0 where there is none."""
    return max(map(int, re.findall(r"checkpoint \S+ at step (\d+)", text_of(log))), default=0)


def await_growth(folder, run):
    """Wait until the result file grows."""
    before = size(folder / RESULT)
    while run.poll() is None and size(folder / RESULT) == before:
        pass


def await_checkpoint(folder, run):
    """Wait until a checkpoint is begun."""
    while run.poll() is None and not (folder / (CHECKPOINT + ".igaform-new")).exists():
        pass


def await_end(folder, run):
    """Wait until all steps are done."""
    while run.poll() is None and "(100.0 %)" not in text_of(folder / LOG):
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


def phase(folder, n_begun, reference):
    """What the run was at when it was killed, as its files tell."""
    if (folder / (RESULT + ".igaform-new")).exists():
        return "while the result was put back"
    if text_of(folder / LOG).count("\nstarted ") == n_begun:
        return "in set-up"
    if (folder / (CHECKPOINT + ".igaform-new")).exists():
        return "while a checkpoint was written"
    if not opens(folder / RESULT):
        return "while the result was written, which did not open"
    if is_within_frame(folder / RESULT, reference):
        return "while a frame was written, the result opened"
    if counts_of(folder / RESULT)[2] == b"completed":
        return "while closing"
    if (folder / CHECKPOINT).exists():
        return "stepping, after a checkpoint"
    return "stepping, before the first checkpoint"


class Killer:
    """Kills runs of one deck."""

    def __init__(self, folder):
        self.folder, self.deck = folder, folder / "deck.key"
        self.deck.write_text(SCENE.read_text().split("*OUTPUT")[0] + "*CHECKPOINT, STEPS=150\n"
                             "*OUTPUT, FRAMES=12, HISTORY=100, FIELDS=WEAR\n")
        start = time.monotonic()
        igaform(folder, self.deck, *SETTINGS, "--out", "full.h5")
        self.spent = time.monotonic() - start
        self.reference, self.shapes = datasets(folder / "full.h5"), counts_of(folder / "full.h5")
        self.n_steps = last_saved_step(folder / "full.log")
        self.n_kills = self.n_too_late = self.n_resumed = 0
        self.counts = {False: collections.Counter(), True: collections.Counter()}

    def files(self):
        return list(self.folder.glob("k.*"))

    def words(self):
        """How the run is begun now."""
        given = ["--restart", CHECKPOINT] if (self.folder / CHECKPOINT).exists() else \
            ["--out", RESULT]
        return [self.deck, *SETTINGS, *given]

    def wait(self, run, kind):
        left = self.spent * (1 - last_saved_step(self.folder / LOG) / self.n_steps)
        if kind != 4:
            time.sleep(random.uniform(0, left if kind < 2 else 0.9 * left))
        if kind > 1:
            (await_growth, await_checkpoint, await_end)[kind - 2](self.folder, run)
            time.sleep(SHORT * random.random()**3)

    def kill(self):
        """Kill a run that has not ended."""
        before = {file: file.read_bytes() for file in self.files()}
        n_begun = text_of(self.folder / LOG).count("\nstarted ")
        while True:
            run = begin(self.folder, *self.words())
            self.wait(run, self.n_kills % 5)
            run.kill()
            if run.wait() == -signal.SIGKILL:
                break
            assert run.returncode == 0, run.returncode
            self.n_too_late += 1
            for file in self.files():
                file.unlink()
            for file, content in before.items():
                file.write_bytes(content)
        self.n_kills += 1
        self.counts[bool(before)][phase(self.folder, n_begun, self.shapes)] += 1

    def finish(self):
        """Take the run up again and look at its result."""
        self.n_resumed += (self.folder / CHECKPOINT).exists()
        igaform(self.folder, *self.words())
        check_same(self.folder / RESULT, self.reference)
        assert not list(self.folder.glob("*.igaform-new"))

    def report(self):
        print("| killed | first run | taken up again |\n|---|---|---|")
        for name in sorted(set(self.counts[False]) | set(self.counts[True])):
            print(f"| {name} | {self.counts[False][name]} | {self.counts[True][name]} |")
        print(f"{self.n_kills} kills, all before the end of a run of {self.spent:.2f} s "
              f"({self.n_too_late} came too late and were drawn anew); {self.n_resumed} runs went "
              "on from a checkpoint to their end; all results have the bits of the undisturbed run")


def killed_runs_lose_nothing(folder):
    random.seed(7)
    killer = Killer(folder)
    while killer.n_kills < KILLS:
        for file in killer.files():
            file.unlink()
        killer.kill()
        if random.random() < 0.6 and killer.n_kills < KILLS:
            killer.kill()
        killer.finish()
    killer.report()


if __name__ == "__main__":
    run_all(killed_runs_lose_nothing)
