"""The runs of a study: which of them are finished, carrying out the others side by side."""
import hashlib
import json
import os
import re
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor, as_completed

import h5py

from post.results import ResultsError, text_of

INPUT = re.compile(r"\bINPUT\s*=\s*(?:\"([^\"]+)\"|([^,\s]+))", re.IGNORECASE)
FORECAST = re.compile(r"^run time +about +(\S+) s", re.MULTILINE)
FINAL = ("completed", "failed")     # a run that failed would fail again
FORECAST_IF_UNKNOWN = 1.0
GO_ON = "the same command goes on from there"


class Program:
    """The program under study."""

    def __init__(self, path):
        self.path = path
        if not os.access(path, os.X_OK) or os.path.isdir(path):
            raise ResultsError(f"there is no program '{path}': build igaform, or say where it is "
                               "with --igaform")
        self.version = subprocess.run([path, "--version"], capture_output=True, text=True,
                                      check=False).stdout.partition("\n")[0]
        with open(path, "rb") as file:
            self.digest = hashlib.file_digest(file, "sha256").hexdigest()


class Run:
    """One run: a deck with parameters, known by a digest of all that makes its result."""

    def __init__(self, deck, parameters, threads, program, folder):
        self.deck, self.parameters, self.threads = deck, parameters, threads
        self.program = program
        self.identity = identity(deck, parameters, threads, program.digest)
        self.result = os.path.join(folder, f"{self.identity}.h5")
        self.cost_file = os.path.join(folder, f"{self.identity}.json")
        self.cost = {}
        self.forecast = None

    @property
    def name(self):
        return " ".join(f"{key}={value}" for key, value in self.parameters.items())

    @property
    def status(self):
        """`completed` or `failed` as the result file says; else `missing`: it must run (again)."""
        try:
            with open(self.cost_file, encoding="utf-8") as file:
                self.cost = json.load(file)
            with h5py.File(self.result) as file:
                status = text_of(file["provenance"].attrs["status"])
        except (OSError, KeyError, ValueError):
            return "missing"
        return status if status in FINAL else "missing"

    def command(self, *more):
        sets = [word for name, value in self.parameters.items()
                for word in ("--set", f"{name}={value}")]
        return [self.program.path, self.deck, "--threads", str(self.threads), *sets, *more]

    def check(self):
        """Ask the program for the time the run should take; its complaint if it refuses it."""
        answer = subprocess.run(self.command("--check"), capture_output=True, text=True,
                                check=False)
        if answer.returncode:
            return answer.stderr.strip()
        found = FORECAST.search(answer.stdout)
        self.forecast = float(found.group(1)) if found else FORECAST_IF_UNKNOWN
        return ""

    def carry_out(self, started):
        """Run, and keep what it cost; `started` takes the process."""
        begin = time.monotonic()
        with open(self.result + ".txt", "w", encoding="utf-8") as said:
            process = subprocess.Popen(self.command("--out", self.result, "--quiet"),
                                       stdout=said, stderr=said,
                                       env={"OMP_WAIT_POLICY": "passive", **os.environ})
            started(process)
            _, code, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(code)
        if process.returncode < 0:
            return
        self.cost = {"cpu_seconds": usage.ru_utime + usage.ru_stime,
                     "wall_seconds": time.monotonic() - begin,
                     "memory_mb": usage.ru_maxrss / 1024, "forecast_seconds": self.forecast}
        with open(self.cost_file, "w", encoding="utf-8") as file:
            json.dump(self.cost, file)


def identity(deck, parameters, threads, program_digest):
    """Digest of deck with all its files, parameters, threads and program."""
    digest = hashlib.sha256(program_digest.encode())
    digest.update(f"threads {threads}\n".encode())
    for name in sorted(parameters):
        digest.update(f"{name.lower()}={parameters[name]}\n".encode())
    for path in deck_files(deck):
        with open(path, "rb") as file:
            digest.update(file.read())
        digest.update(b"\0")
    return digest.hexdigest()[:16]


def deck_files(deck):
    """The deck, then all files it names with INPUT, and those these name, each once."""
    files, waiting = [], [os.path.abspath(deck)]
    while waiting:
        path = waiting.pop(0)
        if path in files or not os.path.isfile(path):
            continue    # a missing one is the program's to report
        files.append(path)
        with open(path, encoding="utf-8", errors="replace") as file:
            for line in file:
                found = INPUT.search(line)
                if found and not line.startswith(("**", "$")):
                    name = found.group(1) or found.group(2)
                    waiting.append(os.path.normpath(os.path.join(os.path.dirname(path), name)))
    return files


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


def carry_out(runs, n_jobs):
    """Carry the runs out, `n_jobs` side by side, and tell how far it is."""
    before = time.monotonic()
    work = sum(run.forecast for run in runs)
    done, count, processes, stopped = 0.0, 0, set(), threading.Event()

    def one(run):
        if not stopped.is_set():
            run.carry_out(processes.add)
        return run

    with ThreadPoolExecutor(n_jobs) as pool:
        try:
            # The longest first, so that none is left alone at the end.
            futures = [pool.submit(one, run)
                       for run in sorted(runs, key=lambda run: -run.forecast)]
            for future in as_completed(futures):
                run = future.result()
                count += 1
                done += run.forecast
                left = (time.monotonic() - before) * (work - done) / done
                print(f"[{count}/{len(runs)}] {run.name}: {run.status}, "
                      f"{run.cost.get('cpu_seconds', 0):.1f} s of a core; about "
                      f"{duration(left)} left", flush=True)
        except KeyboardInterrupt:
            stopped.set()
            for process in processes:
                if process.returncode is None:
                    process.terminate()
            raise ResultsError(f"interrupted with {count} of {len(runs)} runs finished; {GO_ON}"
                               ) from None


def duration(seconds):
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
