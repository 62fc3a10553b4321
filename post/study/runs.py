"""The runs of a study: which of them are finished; `igaform batch` carries out the others."""
import csv
import hashlib
import json
import os
import re
import shlex
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor

import h5py

from post.results import ResultsError

FORECAST = re.compile(r"^run time +about +(\S+) s", re.MULTILINE)
FINAL = ("completed", "failed")     # a run that failed would fail again
FORECAST_IF_UNKNOWN = 1.0
LIST, TABLE = "runs.txt", "runs_summary.csv"
GO_ON = "the same command continues"


class Program:
    """The program under study."""

    def __init__(self, path):
        self.path = os.path.abspath(path)
        if not os.access(path, os.X_OK) or os.path.isdir(path):
            raise ResultsError(f"there is no program '{path}': build igaform, or say where it is "
                               "with --igaform")
        self.version = subprocess.run([path, "--version"], capture_output=True, text=True,
                                      check=False).stdout.partition("\n")[0]


class Run:
    """One run: its result is named by a digest of the deck's path, parameters and threads."""

    def __init__(self, deck, parameters, threads, program, folder):
        self.deck, self.parameters, self.threads = os.path.abspath(deck), parameters, threads
        self.program = program
        said = repr((self.deck, sorted(parameters.items()), threads))
        self.identity = hashlib.sha256(said.encode()).hexdigest()[:16]
        self.base = os.path.join(folder, self.identity)
        self.result = f"{self.base}.h5"
        self.status = "due"         # as the table of `igaform batch` has it
        self.forecast = None

    @property
    def name(self):
        return " ".join(f"{key}={value}" for key, value in self.parameters.items())

    @property
    def is_finished(self):
        return self.status in FINAL

    def words(self, *more):
        sets = [word for name, value in self.parameters.items()
                for word in ("--set", f"{name}={value}")]
        return [self.deck, "--threads", str(self.threads), *sets, *more]

    def check(self):
        """Ask the program for the time the run should take; its complaint if it refuses it."""
        answer = subprocess.run([self.program.path, *self.words("--check")], capture_output=True,
                                text=True, check=False)
        if answer.returncode:
            return answer.stderr.strip()
        found = FORECAST.search(answer.stdout)
        self.forecast = float(found.group(1)) if found else FORECAST_IF_UNKNOWN
        with open(f"{self.base}.json", "w", encoding="utf-8") as file:
            json.dump({"forecast_seconds": self.forecast}, file)
        return ""

    def cost(self):
        """Times of a finished run and the forecast of it."""
        columns = {}
        if os.path.isfile(f"{self.base}.json"):
            with open(f"{self.base}.json", encoding="utf-8") as file:
                columns = json.load(file)
        try:
            with h5py.File(self.result) as file:
                columns["cpu_seconds"] = float(file["timings/cpu_seconds"][()])
        except (OSError, KeyError):     # it failed before it had a result
            pass
        return columns


def batch(runs, program, folder, *options, **more):
    """`igaform batch` on a list of runs, those with the longest forecast first."""
    table = os.path.join(folder, TABLE)
    if os.path.exists(table):       # that of an earlier study says nothing of this one
        os.remove(table)
    lines = {run.identity: shlex.join(run.words("--out", f"{run.identity}.h5"))
             for run in sorted(runs, key=lambda run: -(run.forecast or 0))}
    with open(os.path.join(folder, LIST), "w", encoding="utf-8") as file:
        file.write("\n".join(lines.values()) + "\n")
    return subprocess.Popen([program.path, "batch", LIST, *options], cwd=folder, text=True,
                            env={"OMP_WAIT_POLICY": "passive", **os.environ}, **more)


def read_states(runs, folder):
    """Take the status of each run of the list from the table of the batch."""
    table = os.path.join(folder, TABLE)
    if not os.path.isfile(table):
        raise ResultsError(f"`igaform batch` ended without its table '{table}'; {GO_ON}")
    with open(table, newline="", encoding="utf-8") as file:
        states = {row["result"]: row["status"] for row in csv.DictReader(file)}
    for run in runs:
        run.status = states.get(f"{run.identity}.h5", run.status)


def find_finished(runs, program, folder):
    """Let the program say which runs are finished with this deck and this program."""
    said = batch(runs, program, folder, "--summary", "--quiet",
                 stderr=subprocess.PIPE).communicate()[1]
    if not os.path.isfile(os.path.join(folder, TABLE)):
        raise ResultsError(said.strip())
    read_states(runs, folder)
    busy = [run.name for run in runs if run.status == "running"]
    if busy:
        raise ResultsError(f"another process carries out {len(busy)} of the runs, such as "
                           f"{busy[0]}; wait until it has ended")


def check_all(runs, n_jobs):
    """Let the program check the decks of all runs; every complaint is told, once each."""
    complaints = {}
    with ThreadPoolExecutor(n_jobs) as pool:
        try:
            answers = list(pool.map(Run.check, runs))
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
            raise ResultsError(f"interrupted before the first run; {GO_ON}") from None
    for run, said in zip(runs, answers):
        lines = [line for line in said.splitlines() if "error: " in line]
        for line in lines or filter(None, [said]):
            complaints.setdefault(line, []).append(run)
    if complaints:
        raise ResultsError("\n".join(f"{line}\n  in {len(those)} of the runs, such as "
                                     f"{those[0].name}" for line, those in complaints.items()))


def carry_out(runs, due, program, folder, n_jobs):
    """Carry out the runs that are due, `n_jobs` side by side, and report the progress."""
    for run in due:     # from its start: a cost has no parts
        if os.path.exists(f"{run.base}.ckpt.h5"):
            os.remove(f"{run.base}.ckpt.h5")
    before, work, done = time.monotonic(), sum(run.forecast for run in due), 0.0
    process = batch(due, program, folder, "--jobs", str(n_jobs), stdout=subprocess.PIPE)
    try:
        for line in process.stdout:
            for run in due if line.startswith("[") else ():
                if run.identity in line:
                    done += run.forecast
                    left = (time.monotonic() - before) * (work - done) / done
                    print(f"{line.split(']')[0]}] {run.name}: {line.rpartition(': ')[2].strip()}, "
                          f"about {duration(left)} left", flush=True)
        process.wait()
    except KeyboardInterrupt:
        process.terminate()
        process.communicate()
        read_states(runs, folder)
        raise ResultsError(f"interrupted with {sum(run.is_finished for run in runs)} of "
                           f"{len(runs)} runs finished; {GO_ON}") from None
    read_states(runs, folder)


def duration(seconds):
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
