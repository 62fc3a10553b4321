"""The stability suite: hard scenes, each with a criterion that is computed, a margin, and the same
bits at one and two threads.

usage: stability.py IGAFORM DECKS OUT [--group NAME] [--scene NAME] [--long] [--record]

Runs the scenes of `scenes_*.py` on the decks of the folder DECKS, prints a table with what each
criterion came to beside its limit, and leaves it in OUT/GROUP.csv. A scene fails when a limit is
missed, when two threads change a bit, or when it uses half as much again of a limit as
`margins.csv`, beside this file, has it. `--record` writes that file anew for what was run.
"""
import argparse
import csv
import glob
import os
import shlex
import subprocess
import sys
import time
from dataclasses import dataclass, field

from run_results import Run, differing, numbers

HERE = os.path.dirname(os.path.abspath(__file__))
MARGINS = os.path.join(HERE, "margins.csv")
GROUPS = ("elastic", "shape", "plastic", "contact", "limit")
UNSEEN = 0.2   # of a limit: what stays below it may change freely
GROWTH = 1.5   # of the part of a limit that is used


@dataclass
class Mark:
    """A number that must neither be negative nor exceed its limit."""
    quantity: str
    value: float
    limit: float

    def used(self):
        """Part of the limit that is used."""
        return self.value / self.limit


@dataclass
class Scene:
    """One scene. `check` gets its run, and one for each of `others`, and returns marks."""
    name: str
    deck: str                                    # without its ending
    why: str                                     # why it is hard
    check: callable
    settings: dict = field(default_factory=dict)
    others: list = field(default_factory=list)   # settings on top of these, for runs to compare
    bits: dict = field(default_factory=dict)     # settings that shorten the run of two threads
    is_long: bool = False
    ends: tuple = ()                             # of a run that must fail: exit code, then words
    user: str = ""                               # file of a user's subroutine

    def command(self, settings=None):
        """What a reader types to run it."""
        sets = ["--set " + shlex.quote(f"{key}={value}")
                for key, value in (settings or self.settings).items()]
        return " ".join([f"igaform input/stability/{self.deck}.key", *sets])


class Suite:
    """Runs scenes and keeps what they came to."""

    def __init__(self, igaform, decks, out):
        self.igaform, self.decks, self.out = igaform, decks, out
        self.recorded = read_margins()
        self.rows, self.faults = [], []
        os.makedirs(out, exist_ok=True)

    def run(self, scene, settings, name, threads=1):
        """Run a scene's deck; the path of the results and all that it printed."""
        path = os.path.join(self.out, name + ".h5")
        for file in files_of(path):
            os.remove(file)
        words = [self.igaform, os.path.join(self.decks, scene.deck + ".key"),
                 "--threads", str(threads), "--quiet", "--out", path]
        if scene.user:
            words += ["--user", os.path.join(self.decks, scene.user)]
        words += [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
        # Threads may outnumber the cores here: they must sleep while they wait.
        done = subprocess.run(words, capture_output=True, text=True,
                              env=dict(os.environ, OMP_WAIT_POLICY="passive"))
        self.expect_end(scene, settings, done)
        return path, done.stdout + done.stderr

    def expect_end(self, scene, settings, done):
        code, *texts = scene.ends or (0,)
        said = done.stdout + done.stderr
        if done.returncode != code:
            self.faults.append(f"{scene.name}: exit code {done.returncode}, expected {code}; "
                               f"{scene.command(settings)}\n{said}")
        for text in texts:
            if text not in said:
                self.faults.append(f"{scene.name}: nothing of '{text}' in\n{said}")

    def play(self, scene):
        """Run a scene, compare threads, take its marks."""
        begun = time.monotonic()
        before = len(self.faults)
        path, said = self.run(scene, scene.settings, scene.name)
        if len(self.faults) > before:
            return
        runs = [load(path)]
        for i, other in enumerate(scene.others):
            runs.append(load(self.run(scene, scene.settings | other, f"{scene.name}_{i + 1}")[0]))
        self.compare_threads(scene, path, said)
        if len(self.faults) > before:
            return
        for mark in scene.check(*runs):
            self.take(scene, mark)
        self.miss_dropped(scene.name)
        print(f"      {scene.name}: {time.monotonic() - begun:.2f} s")

    def compare_threads(self, scene, path, said):
        """The same bits with one and with two threads."""
        settings = scene.settings | scene.bits
        if scene.bits:
            path, said = self.run(scene, settings, scene.name + "_bits")
        other, other_said = self.run(scene, settings, scene.name + "_threads", threads=2)
        if other_said.replace(stem(other), "") != said.replace(stem(path), ""):
            self.faults.append(f"{scene.name}: two threads change the message:\n{said}{other_said}")
        if os.path.exists(path) != os.path.exists(other):
            self.faults.append(f"{scene.name}: results with one number of threads alone")
        elif os.path.exists(path):
            changed = differing(numbers(path), numbers(other))
            if changed:
                self.faults.append(f"{scene.name}: two threads change {changed}")
            os.remove(other)

    def take(self, scene, mark):
        """Hold a mark against its limit and against the recorded margin."""
        used = mark.used()
        before = self.recorded.get((scene.name, mark.quantity))
        if not 0 <= used <= 1:
            self.faults.append(f"{scene.name}: {mark.quantity} {mark.value:.3g} is not "
                               f"within 0 and {mark.limit:g}; {scene.command()}")
        elif before is None:
            self.faults.append(f"{scene.name}: {mark.quantity} is not in margins.csv; "
                               "run with --record")
        elif used > max(UNSEEN, GROWTH * before):
            self.faults.append(f"{scene.name}: {mark.quantity} uses {used:.2f} of its limit, "
                               f"{before:.2f} when recorded: the margin is eaten; mend it, or run "
                               "with --record and say why")
        print(f"{used:6.3f}  {scene.name}: {mark.quantity} {mark.value:.3g}, "
              f"limit {mark.limit:g}")
        self.rows.append({"scene": scene.name, "quantity": mark.quantity,
                          "value": f"{mark.value:.3g}", "limit": f"{mark.limit:g}"})

    def miss_dropped(self, scene):
        """Criteria of a scene that were recorded and are not looked at any more."""
        seen = {row["quantity"] for row in self.rows if row["scene"] == scene}
        for name, quantity in self.recorded:
            if name == scene and quantity not in seen:
                self.faults.append(f"{scene}: {quantity} is in margins.csv, but no criterion any "
                                   "more; if it is to go, run with --record")


def stem(path):
    """Path of the results without their ending: what all files of a run begin with."""
    return path.removesuffix(".h5")


def files_of(path):
    """All files of a run."""
    return glob.glob(glob.escape(stem(path)) + ".*")


def load(path):
    """The results of a run; empty where it left none."""
    run = Run(path) if os.path.exists(path) else Run.__new__(Run)
    run.files = lambda: files_of(path)
    return run


def read_margins():
    """Part of each limit that was used when recorded, by scene and quantity."""
    if not os.path.exists(MARGINS):
        return {}
    with open(MARGINS, newline="", encoding="utf-8") as file:
        return {(row["scene"], row["quantity"]): float(row["value"]) / float(row["limit"])
                for row in csv.DictReader(file)}


def write_rows(path, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, ["scene", "quantity", "value", "limit"], lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def record(rows, names):
    """Put rows into margins.csv, in the order of the scenes `names`."""
    kept = []
    if os.path.exists(MARGINS):
        with open(MARGINS, newline="", encoding="utf-8") as file:
            kept = list(csv.DictReader(file))
    fresh = {row["scene"] for row in rows}
    kept = [row for row in kept if row["scene"] not in fresh and row["scene"] in names] + rows
    write_rows(MARGINS, sorted(kept, key=lambda row: names.index(row["scene"])))


def scenes_of(group):
    """The scenes of a group, from its module."""
    return __import__(f"scenes_{group}").SCENES


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("igaform", "decks", "out"):
        words.add_argument(name)
    words.add_argument("--group", choices=GROUPS, help="scenes of one group alone")
    words.add_argument("--scene", help="one scene alone")
    words.add_argument("--long", action="store_true", help="the long scenes in place of the short")
    words.add_argument("--record", action="store_true", help="write margins.csv")
    chosen = words.parse_args()
    suite = Suite(chosen.igaform, chosen.decks, chosen.out)
    names = [scene.name for group in GROUPS for scene in scenes_of(group)]
    for name in {name for name, _ in suite.recorded}.difference(names):
        suite.miss_dropped(name)
    for group in [chosen.group] if chosen.group else GROUPS:
        for scene in scenes_of(group):
            if chosen.scene in (None, scene.name) and (scene.is_long == chosen.long
                                                       or chosen.scene):
                suite.play(scene)
    write_rows(os.path.join(chosen.out, f"{chosen.group or 'all'}.csv"), suite.rows)
    if chosen.record:
        record(suite.rows, names)
        suite.faults = [fault for fault in suite.faults
                        if "margins.csv" not in fault and "when recorded" not in fault]
    for fault in suite.faults:
        print("FAIL  " + fault)
    print(f"{len(suite.rows)} criteria, {len(suite.faults)} faults")
    sys.exit(1 if suite.faults or not suite.rows else 0)


if __name__ == "__main__":
    main()
