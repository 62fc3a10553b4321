"""A static step in little memory: factors go to the disk, and where that does not do the run ends
with a message and the state before. Of its two increments the second finds less memory free, since
BLAS holds its buffer by then."""
import os
import re
import resource
import subprocess

import numpy as np
from run_results import Run
from suite import Case

DECK = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*BLANK, NAME=plate, MATERIAL=steel, TYPE=BOX
x, 0, 100, 2, 40
y, 0, 100, 2, 40
z, 0, 1, 2, 1
*BOUNDARY
X_MIN, ENCASTRE
*STATIC
0.5, 1
*PRESSURE
Z_MAX, 1e-5
*OUTPUT, FRAMES=1, HISTORY=1
"""
MB = 2**20
FREE = r"need (\d+) MB, or (\d+) MB with factors on disk, beside (\d+) MB for BLAS, and (\S+) MB"


def run(case, limit):
    """With so much address space [MB]; what the program said, its code, and its result."""
    path = os.path.join(case.out, f"{case.name}_{limit}")
    with open(path + ".key", "w", encoding="utf-8") as file:
        file.write(DECK)
    done = subprocess.run(
        [case.igaform, path + ".key", "--threads", "1", "--out", path + ".h5"], text=True,
        capture_output=True, check=False, timeout=300,
        preexec_fn=lambda: limit and resource.setrlimit(resource.RLIMIT_AS, (limit * MB,) * 2))
    return done.stdout + done.stderr, done.returncode, path + ".h5"


def main():
    case = Case("Factors in little memory", "the run with enough of it")
    _, code, path = run(case, 0)
    case.between("exit code with enough memory", code, 0, 0)
    whole = Run(path)
    # What the program takes before differs from machine to machine.
    limit = 200
    said, code, path = run(case, limit)
    case.between("exit code with too little", code, 2, 2)
    found = re.search(FREE, said)
    case.between("messages of it", 0 if found is None else 1, 1, 1)
    case.between("frames of it, that of the start", len(Run(path).frames), 1, 1)
    in_memory, _, of_blas, free = (float(number) for number in found.groups())
    # In memory they ask for 1.2 times this; on disk they leave room for what the first increment
    # keeps beside.
    limit += int(of_blas + 1.1 * in_memory - free)
    said, code, path = run(case, limit)
    case.between("exit code with enough for factors on disk", code, 0, 0)
    if code:
        print(said[-2000:])
    case.between("lines of the log on it", said.count("static     factors on disk"), 1, 1)
    case.deviation("shape with factors on disk, over the deflection",
                   np.abs(Run(path).points - whole.points).max()
                   / np.abs(whole.points - whole.start).max(), 1e-9)
    case.finish()


if __name__ == "__main__":
    main()
