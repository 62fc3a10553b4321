"""What scripts on static steps share: increments from the log, and runs whose bits must agree."""
import os
import signal
import subprocess
import time

import numpy as np
from run_results import differing, numbers


def iterations(case, deck):
    """Of each increment of the static steps, from the log."""
    with open(os.path.join(case.out, f"{case.name}_{deck}.log"), encoding="utf-8") as log:
        return np.array([int(line.split(",")[1].split()[0]) for line in log
                         if line.startswith("static     time")])


def last_residuals(case, deck):
    """The last three residuals of each increment with three at least, over the largest force, and
    whether each came by a new tangent: the log has the others in parentheses."""
    with open(os.path.join(case.out, f"{case.name}_{deck}.log"), encoding="utf-8") as log:
        rows = [line.split("residual")[1].split(" of ")[0].split(",") for line in log
                if line.startswith("static     time")]
    rows = [row for row in rows if len(row) == 3]
    return (np.array([[float(word.strip(" ()")) for word in row] for row in rows]),
            np.array([["(" not in word for word in row] for row in rows]))


def n_increments(log):
    """Static increments that a log names."""
    with open(log, encoding="utf-8") as file:
        return sum(line.startswith("static     time") for line in file)


def same_bits(case, deck, stop_after, n_increments_of_all, **settings):
    """Two threads, and a run that is stopped between two increments and taken up again."""
    program, path, _, _, *sets = case.command(deck, settings)
    words = [program, path, *sets, "--quiet"]
    whole, other, cut = (os.path.join(case.out, f"{case.name}_{name}")
                         for name in ("whole", "threads", "cut"))
    subprocess.run([*words, "--threads", "1", "--out", whole + ".h5"], check=True)
    subprocess.run([*words, "--threads", "2", "--out", other + ".h5"], check=True)
    case.between(f"{deck}, two threads: datasets with other bits",
                 len(differing(numbers(whole + ".h5"), numbers(other + ".h5"))), 0, 0)
    open(cut + ".log", "w", encoding="utf-8").close()
    run = subprocess.Popen([*words, "--threads", "1", "--out", cut + ".h5"])
    while run.poll() is None and n_increments(cut + ".log") < stop_after:
        time.sleep(0.005)
    run.send_signal(signal.SIGTERM)
    case.between(f"{deck}, stopped: exit code", run.wait(60), 3, 3)
    case.between(f"{deck}, stopped after increments", n_increments(cut + ".log"), stop_after,
                 n_increments_of_all - 1)
    subprocess.run([*words, "--threads", "2", "--restart", cut + ".ckpt.h5"], check=True)
    case.between(f"{deck}, taken up again: datasets with other bits",
                 len(differing(numbers(whole + ".h5"), numbers(cut + ".h5"))), 0, 0)
