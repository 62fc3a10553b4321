"""Progress, energies and time step of a run in the terminal, while it goes on.

The log beside the result tells where the run is at every history time; the result file holds the
history up to the last frame. It is opened without a lock, so the run is not disturbed, and a look
that meets it in the middle of a write is left out.
"""
import fcntl
import os
import re
import sys
import time

import h5py

from post.results import ResultsError, counted, text_of

STEP = re.compile(r"^step +(\d+)  time +(\S+) \( *(\S+) %\)  dt +(\S+)  energy error +(\S+)"
                  r"(?:  left (\S+))?(?: +((?:in )?step \d+ of \d+ .*))?")
ENERGIES = ("external_work", "internal_energy", "plastic_work", "kinetic_energy",
            "contact_energy", "friction_energy", "viscous_energy", "damping_energy")
TAIL = 65536        # bytes of a log that are looked at
BAR = 40            # characters


def add_arguments(command):
    command.add_argument("file", metavar="FILE", help="result file of a run, finished or not")
    command.add_argument("--every", type=float, default=2.0, metavar="SECONDS",
                         help="pause between two looks (default: 2)")
    command.add_argument("--once", action="store_true", help="look once and end")
    command.set_defaults(out="")


def run(arguments):
    if not os.path.isfile(arguments.file):
        raise ResultsError(f"there is no file '{arguments.file}'")
    if arguments.every <= 0:
        raise ResultsError(f"--every {arguments.every:g}: more than 0 is needed")
    if not is_result(arguments.file):
        raise ResultsError(f"'{arguments.file}' is no result file of igaform")
    shown, n_shown = {}, 0
    try:
        while True:
            is_alive = is_being_written(arguments.file)
            shown.update(last_progress(arguments.file))
            shown.update(last_history(arguments.file))
            text = "\n".join(lines(arguments.file, shown, is_alive))
            if sys.stdout.isatty() and n_shown:
                print(f"\033[{n_shown}A\033[J", end="")
            print(text, flush=True)
            n_shown = text.count("\n") + 1
            if arguments.once or not is_alive:
                return 0
            time.sleep(arguments.every)
    except KeyboardInterrupt:
        return 0


def is_result(path):
    """Whether it is one, or becomes one: a run is writing to it."""
    if is_being_written(path):
        return True
    try:
        with h5py.File(path, "r", locking=False) as file:
            return "history" in file and "provenance" in file
    except OSError:     # a killed run may leave a file that does not open
        with open(path, "rb") as file:
            return file.read(8) == b"\x89HDF\r\n\x1a\n"


def is_being_written(path):
    """Whether a run holds the file: it has a shared lock on it."""
    try:
        with open(path, "rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:     # no such file any more, or a file system without locks
        return os.path.isfile(path) and last_history(path).get("status") == "running"
    return False


def last_progress(path):
    """What the log beside the result says last: where the run is, and an error; nothing without."""
    try:
        with open(path.removesuffix(".h5") + ".log", "rb") as log:
            log.seek(max(0, log.seek(0, os.SEEK_END) - TAIL))
            text = log.read().decode(errors="replace")
    except OSError:
        return {}
    lines_of_log = text.splitlines()
    errors = [line for line in lines_of_log if line.startswith("error: ")]
    told = {"error": errors[-1]} if errors else {}
    found = [match for match in map(STEP.match, lines_of_log) if match]
    if not found:
        return told
    names = ("step", "time", "share", "dt", "energy_error", "left", "process")
    return told | {name: value or "" for name, value in zip(names, found[-1].groups())}


def last_history(path):
    """Status and last row of the history in the file; nothing if it cannot be read just now."""
    try:
        with h5py.File(path, "r", locking=False) as file:
            history = file["history"]
            n = min(history[name].shape[0] for name in (*ENERGIES, "time", "max_penetration"))
            row = {name: float(history[name][n - 1]) for name in
                   (*ENERGIES, "max_penetration")} if n else {}
            row["units"] = {name: text_of(history[name].attrs["unit"])
                            for name in (*ENERGIES, "time", "max_penetration")}
            if n:
                row["row_time"] = float(history["time"][n - 1])
            row["status"] = text_of(file["provenance"].attrs["status"])
            row["frames"] = int(file["VTKHDF/Steps"].attrs["NSteps"])
            return row
    except (OSError, KeyError, RuntimeError, ValueError):
        return {}


def lines(path, shown, is_alive):
    """What is known, for people."""
    status = shown.get("status", "unknown")
    if status == "running" and not is_alive:
        status = "ended by an " + shown["error"] if "error" in shown else \
            "ended without a word (killed?)"
    yield f"{path}: {status}, {counted(shown.get('frames', 0), 'frame')}"
    units = shown.get("units", {})
    if "share" in shown:
        is_known = shown["share"] != "--"    # of a relaxation not from the start
        n = round(BAR * min(100.0, float(shown["share"])) / 100) if is_known else 0
        left = f"  left {shown['left']}" if shown["left"] and is_alive else ""
        process = f"  {shown['process']}" if shown["process"] else ""
        yield f"  [{'#' * n}{'.' * (BAR - n)}] {shown['share']} %{left}{process}"
        yield (f"  step {shown['step']}  time {shown['time']} {units.get('time', '')}  "
               f"dt {shown['dt']}  energy error {shown['energy_error']}")
    if "row_time" in shown:
        yield f"  energies [{units['external_work']}] at the last frame, time {shown['row_time']:g}"
        largest = max(abs(shown[name]) for name in ENERGIES) or 1.0
        for name in ENERGIES:
            if shown[name]:
                bar = "#" * round(BAR * abs(shown[name]) / largest)
                yield f"    {name.replace('_', ' '):16}{shown[name]:12.4g}  {bar}"
        if shown["max_penetration"]:
            yield (f"    {'penetration':16}{shown['max_penetration']:12.4g} "
                   f"{units['max_penetration']}")
