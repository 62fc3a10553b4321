"""Check decks that combine features, and run some of them: exit code 0 if none ends in a way that
the manual does not name, tells a mass that is not density times volume, or no stable increment.

    combine.py IGAFORM [--decks N] [--seed N] [--runs N] [--seconds N] [--keep FOLDER]

Every deck is of its own seed, so that one that does harm can be made again by its number alone:
--seed NUMBER --decks 1. It is kept besides.
"""
import argparse
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import time

from combined_decks import DENSITY, new_deck

SECONDS = 600                    # for one deck on a busy machine
MOST_STEPS = 400                 # of a deck that is run
LEAST_TAKEN = 0.3                # of the decks: a generator of refused ones would test little
CRASH = re.compile(r"Sanitizer|runtime error|Fortran runtime|Backtrace|corrupt|Segmentation", re.I)
FAULT = re.compile(r"^\S+?:\d+: error: .*found .*; expected ", re.M)
OPTIONS = "detect_leaks=0:allocator_may_return_null=1"   # those of the compiler are known


def call(igaform, *arguments):
    """Exit code and both outputs; the code is none after a hang."""
    try:
        done = subprocess.run([igaform, *map(str, arguments)], capture_output=True, text=True,
                              timeout=SECONDS, stdin=subprocess.DEVNULL, errors="replace",
                              env=os.environ | {"OMP_NUM_THREADS": "1", "ASAN_OPTIONS": OPTIONS})
    except subprocess.TimeoutExpired:
        return None, "", ""
    return done.returncode, done.stdout, done.stderr


def check(igaform, deck, path):
    """Why the answer to --check is wrong (empty if it is not), and how many steps a run takes:
    0 for a refused deck."""
    code, out, err = call(igaform, path, "--check")
    if code is None:
        return f"no answer in {SECONDS} s", 0
    if code not in (0, 1) or CRASH.search(err):
        return f"ended with {code}: {err[:2000]}", 0
    if code == 1:
        return ("" if FAULT.search(err) else f"refused without a reason: {err[:500]}"), 0
    facts = dict(re.findall(r"^(mass|stable increment|steps) +(?:about )?(\S+)$", out, re.M))
    try:
        mass, step, n_steps = (float(facts[name]) for name in ("mass", "stable increment", "steps"))
    except (KeyError, ValueError):
        return f"without mass, step or number of steps: {out[:2000]}", 0
    ratio = mass/(deck.volume*DENSITY)
    slack = 1e-3 if deck.is_exact else 2e-2
    if not ratio > 1 - slack or (ratio > 1 + slack and not deck.is_scaled):
        return f"a mass of {ratio} times that of the volume", 0
    if not 0 < step < 1 or not n_steps > 0:
        return f"a stable increment of {step}, {n_steps} steps", 0
    return "", n_steps


def run(igaform, path, result):
    """Why a run of an accepted deck ended wrongly; empty if it did not. Numerics may fail, in
    words: what chance puts together may be beyond what they can do."""
    code, _, err = call(igaform, path, "--out", result, "--quiet")
    if code is None:
        return f"no end of the run in {SECONDS} s"
    if code not in (0, 2) or CRASH.search(err) or (code == 2 and not err.strip()):
        return f"run ended with {code}: {err[:2000]}"
    return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("igaform")
    parser.add_argument("--decks", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", type=int, default=8, help="one of so many short decks is run")
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--keep", type=pathlib.Path, default=pathlib.Path("fuzz_found"))
    options = parser.parse_args()
    counts = dict.fromkeys(("decks", "taken", "short", "run", "harmful"), 0)
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        path, result = pathlib.Path(folder, "deck.key"), pathlib.Path(folder, "deck.h5")
        for seed in range(options.seed, options.seed + options.decks):
            if time.monotonic() - begin > options.seconds or counts["harmful"] >= 50:
                break
            deck = new_deck(random.Random(seed))
            path.write_text(deck.text)
            why, n_steps = check(options.igaform, deck, path)
            counts["decks"] += 1
            counts["taken"] += n_steps > 0
            counts["short"] += 0 < n_steps < MOST_STEPS
            if 0 < n_steps < MOST_STEPS and (counts["short"] - 1) % options.runs == 0:
                counts["run"] += 1
                why = run(options.igaform, path, result)
                for left in pathlib.Path(folder).glob("deck.*"):
                    left.unlink()
            if why:
                counts["harmful"] += 1
                options.keep.mkdir(exist_ok=True)
                kept = options.keep/f"combined_{seed}.key"
                kept.write_text(deck.text)
                print(f"{kept}: {why}", flush=True)
    print(", ".join(f"{number} {name}" for name, number in counts.items()),
          f"in {time.monotonic() - begin:.0f} s")
    if counts["taken"] < LEAST_TAKEN*counts["decks"] or counts["run"] == 0:
        print("too few of them were taken and run")
        return 1
    return 1 if counts["harmful"] else 0


if __name__ == "__main__":
    sys.exit(main())
