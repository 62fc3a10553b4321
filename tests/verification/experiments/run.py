"""Decks of input/experiments against measured values, as docs/experiments.md states them.

Usage: run.py IGAFORM PROJECT_FOLDER NAME_OF_DECK
"""
import os
import subprocess
import sys
import tempfile

import numpy as np

IGAFORM, PROJECT, NAME = sys.argv[1:4]
sys.path.insert(0, PROJECT)

from post.draw_in import Outline  # noqa: E402
from post.earing import Profile, rim_of, table_of  # noqa: E402
from post.force import stroke_and_force  # noqa: E402
from post.number_table import read_numbers  # noqa: E402
from post.results import Results  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
SHELL = {"element": "SHELL", "rule": "SHEET", "mass_factor": 1}


def run(folder, **parameters):
    """Results of the deck with these parameters; the balance must close."""
    path = os.path.join(folder, "experiment.h5")
    sets = [part for key, value in parameters.items() for part in ("--set", f"{key}={value}")]
    subprocess.run([IGAFORM, os.path.join(PROJECT, "input", "experiments", NAME + ".key"),
                    "--quiet", "--out", path, *sets], check=True)
    results = Results(path)
    between("energy error", np.abs(results.history("energy_error")).max(), 0, 2e-3)
    return results


def between(what, value, low, high):
    print(f"{what}: {value:.5g}, to lie from {low:.5g} to {high:.5g}")
    assert low <= value <= high, what


def profile(folder, **parameters):
    with run(folder, **parameters) as results:
        return Profile(NAME, *rim_of(results))


def cup_2090(folder):
    """The published constants make two ears too many; with the measured r-values they are gone."""
    published = profile(folder)
    between("ears", published.ears(), 8, 8)
    between("rim at 90 above 75 degrees [mm]", np.subtract(*published.at([90, 75])), 0.4, 0.8)
    refitted = profile(folder, potential="2090/refitted.inc")
    between("ears, refitted", refitted.ears(), 6, 6)
    between("rim at 90 above 75 degrees [mm]", np.subtract(*refitted.at([90, 75])), -0.3, 0.1)
    for cup in (published, refitted):
        between("highest place [degrees]", cup.angles[np.argmax(cup.heights)], 38, 48)
        between("earing [mm]", cup.earing, 5, 6.5)


def cup_6016(folder):
    """Mean height as measured; too little earing with Barlat, too much with Hill."""
    measured = Profile("measured", *table_of(os.path.join(HERE, "cup_6016.csv")))
    between("measured earing [mm]", measured.earing, 1.3, 1.5)
    barlat, hill = profile(folder), profile(folder, potential="6016/hill48.inc")
    sheet = profile(folder, potential="6016/yld2000.inc", **SHELL)
    between("earing with Yld2000-2d, shells [mm]", sheet.earing, 0, 0.5)
    for cup in (barlat, hill, sheet):
        between("mean height over the measured one", cup.mean / measured.mean, 0.95, 1.01)
    between("earing with Yld2004-18p [mm]", barlat.earing, 0, 0.5)
    between("earing with Hill's function [mm]", hill.earing, 2.5, 3.5)
    between("ears with Hill's function", hill.ears(), 4, 4)
    between("valley [degrees]", hill.angles[np.argmin(hill.heights)], 40, 50)


def box_aluminium(folder):
    """Draw-in at two depths of the punch, as solid and as shell, over the measured ones."""
    for parameters in ({}, SHELL):
        with run(folder, **parameters) as results:
            outline = Outline(results)
            moved = np.linalg.norm(results.tool_history("punch", "displacement"), axis=1)
            at_frames = np.interp(results.times, results.tool_history("punch", "time"), moved)
            start = np.array(outline.radii(outline.at(None), [0, 45]))
            for stroke, measured, limits in ((15, (5.3, 3.3), (0.95, 1.15)),
                                             (40, (28.5, 15.0), (0.96, 1.09))):
                frame = int(np.argmin(np.abs(at_frames - stroke)))
                drawn = start - outline.radii(outline.at(frame), [0, 45])
                for name, value, real in zip(("side", "diagonal"), drawn, measured):
                    between(f"{name} at {stroke} mm, draw-in over measured", value / real, *limits)


def cup_ddq(folder):
    """Punch force and draw-in; Hill's function overstates how much more comes in at 45 degrees."""
    measured = read_numbers(os.path.join(HERE, "cup_ddq.csv"))[1:]
    barlat89 = {"potential": "ddq/barlat89.inc", **SHELL}
    for name, spread, parameters in (("Hill", (6, 9), {}), ("BARLAT89", (3.5, 6), barlat89)):
        with run(folder, **parameters) as results:
            stroke, force = stroke_and_force(results, "punch")
            for at, value in measured:
                near = 4 * force[np.abs(stroke - at) <= 1.5].mean()
                between(f"{name}, force at {at:g} mm over measured", near / value, 0.85, 1.1)
            outline = Outline(results)
            drawn = np.subtract(*(outline.radii(outline.at(frame), [0, 45, 90])
                                  for frame in (None, len(results.times) - 1)))
        for angle, value, real in zip((0, 90), drawn[::2], (29.0, 27.5)):
            between(f"{name}, draw-in at {angle} over measured", value / real, 0.94, 1.1)
        between(f"{name}, draw-in at 45 less that at 0 and 90, 3.75 mm measured",
                drawn[1] - 0.5 * (drawn[0] + drawn[2]), *spread)


with tempfile.TemporaryDirectory() as scratch:
    {"cup_2090": cup_2090, "cup_6016": cup_6016, "cup_ddq": cup_ddq,
     "box_aluminium": box_aluminium}[NAME](scratch)
