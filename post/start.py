"""The state at the start of a deck: a result with the first frame alone."""
import os
import subprocess
import sys

from post.program import PROGRAM
from post.results import ResultsError


def add_deck_arguments(command):
    """How a deck is read."""
    command.add_argument("--set", action="append", default=[], metavar="NAME=VALUE",
                         help="replace the value of a *PARAMETER of the deck")
    command.add_argument("--user", action="append", default=[], metavar="FILE",
                         help="UMAT or VUMAT of the deck's *USER MATERIAL")
    command.add_argument("--igaform", default=PROGRAM, metavar="PROGRAM",
                         help="the program that reads decks (default: build/native/bin/igaform, "
                              "else that of PATH)")


def start_of_deck(arguments, result):
    """Write the first frame. The program reports what is wrong with the deck."""
    done = check(arguments, result)
    sys.stderr.write(done.stderr)
    if done.returncode:
        raise ResultsError(f"igaform rejects '{arguments.file}'")


def checked_start(arguments, result):
    """Write the first frame, also of a set-up with errors; the report of --check and its errors and
    warnings."""
    done = check(arguments, result)
    if not os.path.exists(result):
        raise ResultsError(f"igaform rejects '{arguments.file}', and there is nothing to draw:\n"
                           f"{done.stderr.strip()}")
    return done.stdout, done.stderr


def check(arguments, result):
    """Check the deck of a command and write its first frame, if the program can."""
    if not os.access(arguments.igaform, os.X_OK) or os.path.isdir(arguments.igaform):
        raise ResultsError(f"there is no program '{arguments.igaform}' to read a deck: build "
                           "igaform, or say where it is with --igaform")
    words = [word for name in ("set", "user") for value in getattr(arguments, name)
             for word in (f"--{name}", value)]
    return subprocess.run([arguments.igaform, arguments.file, "--check", "--start", "--out", result,
                           *words], capture_output=True, text=True, errors="replace", check=False)
