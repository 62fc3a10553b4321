"""The state at the start of a deck: a result with the first frame alone."""
import os
import subprocess
import sys

from post.program import PROGRAM
from post.results import ResultsError

SHORT = "1e-9"     # a run of so many minutes ends after its first step


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
    """Write the first frame of a run that stops at once. The program reports what is wrong with the
    deck."""
    done = call(arguments, result, "--wall", SHORT, "--quiet")
    is_run = done.returncode in (0, 3)
    sys.stderr.writelines(line for line in done.stderr.splitlines(keepends=True)
                          if not (is_run and line.startswith("igaform: warning: ")))
    if not is_run:
        raise ResultsError(f"igaform cannot begin a run of '{arguments.file}'")


def checked_start(arguments, result):
    """Write the first frame, and return the report of --check and its warnings. A program whose
    --check writes no frame runs until its first."""
    done = call(arguments, result, "--check")
    if done.returncode:
        raise ResultsError(f"igaform rejects '{arguments.file}':\n{done.stderr.strip()}")
    if not os.path.exists(result):
        start_of_deck(arguments, result)
    return done.stdout, done.stderr


def call(arguments, result, *options):
    """Run the program on the deck of a command."""
    if not os.access(arguments.igaform, os.X_OK) or os.path.isdir(arguments.igaform):
        raise ResultsError(f"there is no program '{arguments.igaform}' to read a deck: build "
                           "igaform, or say where it is with --igaform")
    words = [word for name in ("set", "user") for value in getattr(arguments, name)
             for word in (f"--{name}", value)]
    return subprocess.run([arguments.igaform, arguments.file, "--out", result, *options, *words],
                          capture_output=True, text=True, errors="replace", check=False)
