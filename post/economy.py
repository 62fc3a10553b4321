"""What ran and what slept in five scenes, and what sleeping saved: each runs as it is and with
`--no-skip`, one thread, processor time."""
import os
import re
import tempfile

import h5py
import numpy as np

from post.program import PROGRAM, PROJECT
from post.results import ResultsError

# Title, deck below input/, settings.
SCENES = (
    ("free vibration", "economy/free_vibration.key", ()),
    ("elastic bending", "economy/elastic_bending.key", ()),
    ("gravity alone", "economy/gravity.key", ()),
    ("channel, strip", "channel_strip.key", ("n_x=70", "closing=60", "frames=1", "history=100")),
    ("channel, full width", "channel_forming.key",
     ("n_x=70", "closing=60", "frames=1", "history=100")))


def add_arguments(command):
    command.add_argument("-o", "--out", default="economy.md", metavar="FILE",
                         help="file of the table (default: economy.md)")
    command.add_argument("--igaform", default=PROGRAM, metavar="PROGRAM",
                         help="the program (default: build/native/bin/igaform, else that of PATH)")
    command.add_argument("--quick", action="store_true", help="a fifth of the way of the channels")


def run(arguments):
    """All scenes, and the table on paper."""
    if not os.path.isfile(arguments.igaform):
        raise ResultsError(f"there is no program '{arguments.igaform}': build igaform, or say "
                           "where it is with --igaform")
    lines = ["| scene | what ran, share of its time | what slept | CPU s | awake | saved |",
             "|---|---|---|---:|---:|---:|"]
    with tempfile.TemporaryDirectory() as folder:
        for title, deck, settings in SCENES:
            if arguments.quick:
                settings = [setting.replace("closing=60", "closing=12") for setting in settings]
            lines.append(row(arguments.igaform, folder, title, deck, settings))
    text = "\n".join(lines)
    print(text)
    with open(arguments.out, "w", encoding="utf-8") as file:
        file.write(text + "\n")
    return 0


def row(program, folder, title, deck, settings):
    asleep = Outcome(program, folder, deck, settings)
    awake = Outcome(program, folder, deck, (*settings, "--no-skip"))
    for name in ("internal_energy", "kinetic_energy"):
        one, two = (outcome.history[name] for outcome in (asleep, awake))
        if not np.allclose(one, two, rtol=0, atol=1e-3*np.abs(one).max()):
            raise ResultsError(f"{title}: sleeping changes the {name.replace('_', ' ')}")
    saved = 1 - asleep.seconds/awake.seconds
    return (f"| {title} | {asleep.ran} | {asleep.slept} | {asleep.seconds:.2f} | "
            f"{awake.seconds:.2f} | {100*saved:.0f} % |")


class Outcome:
    """One run: processor time, time shares of its effects, what slept."""

    def __init__(self, program, folder, deck, options):
        path = os.path.join(folder, "run.h5")
        command = [program, os.path.join(PROJECT, "input", deck), "--out", path, "--threads", "1",
                   "--quiet"]
        for option in options:
            command += [option] if option.startswith("--") else ["--set", option]
        process = os.spawnv(os.P_NOWAIT, program, command)
        _, status, usage = os.wait4(process, 0)
        if status != 0:
            raise ResultsError(f"'{' '.join(command)}' failed")
        self.seconds = usage.ru_utime + usage.ru_stime
        with h5py.File(path) as file:
            self.history = {name: file[f"history/{name}"][()]
                            for name in ("internal_energy", "kinetic_energy")}
            effects = {name: group["seconds"][()] for name, group in
                       file["timings/effects"].items()}
            eqps = np.concatenate([np.ravel(values) for values in last_eqps(file)])
            eqps = eqps[~np.isnan(eqps)]
        total = sum(effects.values())
        self.ran = ", ".join(f"{name} {100*seconds/total:.0f} %" for name, seconds in
                             sorted(effects.items(), key=lambda item: -item[1])
                             if seconds >= 0.005*total)
        with open(path.removesuffix(".h5") + ".log", encoding="utf-8") as log:
            culled = re.findall(r"^contact (.*): \d+ of \d+ points tested, ([0-9.]+) % culled",
                                log.read(), re.MULTILINE)
        slept = [f"search of {name.lower()} at {float(share):.1f} % of the points"
                 for name, share in culled]
        if np.all(eqps <= 0):
            slept.append("return map everywhere")
        elif np.any(eqps <= 0):
            slept.append(f"return map at {100*np.mean(eqps <= 0):.0f} % of the points")
        self.slept = ", ".join(slept) or "nothing"


def last_eqps(file):
    """Plastic strain of all points at the end, by patch; NaN where outlines leave nothing."""
    found = []
    file["points"].visititems(lambda name, item: found.append(item[()]) if isinstance(
        item, h5py.Dataset) and name.split("/")[-1] == "eqps" else None)
    return found
