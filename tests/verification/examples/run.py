"""The example decks of forming, short and coarse or as they stand, against what the manual states.

Usage: run.py IGAFORM PROJECT_FOLDER hemisphere|square_box short|long
"""
import os
import subprocess
import sys
import tempfile

import numpy as np

IGAFORM, PROJECT, NAME, LENGTH = sys.argv[1:5]
sys.path.insert(0, PROJECT)

from post.draw_in import Outline  # noqa: E402
from post.results import Results  # noqa: E402


def run(folder, **parameters):
    """Results of the deck with these parameters; kinetic and balance must be small."""
    path = os.path.join(folder, "example.h5")
    sets = [part for key, value in parameters.items() for part in ("--set", f"{key}={value}")]
    subprocess.run([IGAFORM, os.path.join(PROJECT, "input", NAME + ".key"), "--quiet", "--out",
                    path, *sets], check=True)
    results = Results(path)
    late = results.history("time") > 0.5 * results.times[-1]
    kinetic, internal = (results.history(f"{kind}_energy")[late]
                         for kind in ("kinetic", "internal"))
    between("kinetic over internal energy", (kinetic / internal).max(), 0,
            0.15 if LENGTH == "short" else 0.05)
    between("energy error", np.abs(results.history("energy_error")[late]).max(), 0, 1e-3)
    return results


def between(what, value, low, high):
    print(f"{what}: {value:.5g}, to lie from {low:.5g} to {high:.5g}")
    assert low <= value <= high, what


def thickness_strain(results):
    """Distance from the axis at the start and thickness strain at the end, of all columns."""
    radii, strains = [], []
    for patch in results.patches:
        start = patch.field("Points", 0)[0]
        radii.append(np.hypot(start[..., 0], start[..., 1]).ravel())
        thinning = patch.field("thinning", -1 % len(results.times))[0, ..., 0]
        strains.append(np.log1p(-thinning).ravel())
    return np.concatenate(radii), np.concatenate(strains)


def hemisphere(folder):
    """Thickness strain at the pole and its extreme, which lies under half the punch's radius."""
    if LENGTH == "short":
        results = run(folder, around=3, across=4, speed=20000, depth=18.6, frames=2)
        pole, extreme, where = (-0.112, 0.012), (-0.15, 0.015), (12, 22)
    else:
        results = run(folder)
        pole, extreme, where = (-0.20, 0.01), (-0.308, 0.015), (18, 27)
    radius, strain = thickness_strain(results)
    between("thickness strain at the pole", strain[np.argmin(radius)], pole[0] - pole[1],
            pole[0] + pole[1])
    between("extreme thickness strain", strain.min(), extreme[0] - extreme[1],
            extreme[0] + extreme[1])
    between("its place at the start [mm]", radius[np.argmin(strain)], *where)
    between("strain at the clamped edge", np.abs(strain[radius > 59.1]).max(), 0, 0.06)
    between("penetration over thickness", results.history("max_penetration").max() / 0.85, 0, 0.02)


def square_box(folder):
    """Draw-in along the sides and the diagonal."""
    if LENGTH == "short":
        results = run(folder, elements=14, depth=9, speed=15000, frames=2)
        side, diagonal = (1.1, 1.8), (0.7, 1.3)
    else:
        results = run(folder)
        side, diagonal = (26.7, 28.7), (17.0, 19.0)
    outline = Outline(results)
    start = outline.radii(outline.at(None), [0, 45, 90])
    now = outline.radii(outline.at(len(results.times) - 1), [0, 45, 90])
    drawn = np.subtract(start, now)
    between("draw-in along x [mm]", drawn[0], *side)
    between("draw-in along the diagonal [mm]", drawn[1], *diagonal)
    between("draw-in along y [mm]", drawn[2], *side)


def main():
    with tempfile.TemporaryDirectory() as folder:
        {"hemisphere": hemisphere, "square_box": square_box}[NAME](folder)


main()
