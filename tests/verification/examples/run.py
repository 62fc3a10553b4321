"""The example decks of forming, short and coarse or as they stand, against what the manual states.

Usage: run.py IGAFORM PROJECT_FOLDER NAME_OF_DECK short|long
"""
import os
import shutil
import subprocess
import sys
import tempfile

import numpy as np

IGAFORM, PROJECT, NAME, LENGTH = sys.argv[1:5]
sys.path.insert(0, PROJECT)

import membrane  # noqa: E402
from post.draw_in import Outline  # noqa: E402
from post.results import Results  # noqa: E402
from post.section import Section  # noqa: E402
from post.springback import by_start, fitted, turn_between  # noqa: E402


def run(folder, options=(), deck=None, name="example.h5", since=0.5, **parameters):
    """Results of the deck with these parameters; kinetic energy and balance must be small from this
    part of the first step on."""
    deck = deck or os.path.join(PROJECT, "input", NAME + ".key")
    path = os.path.join(folder, name)
    sets = [part for key, value in parameters.items() for part in ("--set", f"{key}={value}")]
    subprocess.run([IGAFORM, deck, "--quiet", "--out", path, *options, *sets], check=True)
    with open(path[:-3] + ".log", encoding="utf-8") as log:
        warnings = [line for line in log if line.startswith("warning: with masses")]
    assert LENGTH == "short" or not warnings, warnings
    results = Results(path)
    step = results.history("process_step")
    late = results.history("time") > since * results.history("time")[step == 1][-1]
    kinetic, internal = (results.history(f"{kind}_energy")[late]
                         for kind in ("kinetic", "internal"))
    between("kinetic over internal energy", (kinetic / internal).max(), 0,
            0.15 if LENGTH == "short" else 0.05)
    between("energy error", np.abs(results.history("energy_error")[late]).max(), 0, 1e-3)
    return results


def between(what, value, low, high):
    print(f"{what}: {value:.5g}, to lie from {low:.5g} to {high:.5g}")
    assert low <= value <= high, what


def hemisphere(folder):
    """Thickness strain at the pole and its extreme, which lies under half the punch's radius; all
    along the radius as in a membrane."""
    if LENGTH == "short":
        results = run(folder, around=3, across=4, speed=20000, depth=18.6, frames=2)
        extreme, where = (-0.15, 0.015), (12, 22)
        radius, strain = membrane.columns(results)
        between("thickness strain at the pole", strain[np.argmin(radius)], -0.124, -0.1)
    else:
        results = run(folder)
        radius, strain = membrane.columns(results)
        middle, reference = membrane.profile()
        extreme, where = (reference.min(), 0.01), (20, 27)
        for low in range(0, 48, 8):
            here, there = [(r >= low) & (r < low + 8) for r in (radius, middle)]
            between(f"thickness strain from {low} to {low + 8} mm less that of a membrane",
                    strain[here].mean() - reference[there].mean(), -0.025, 0.025)
    between("extreme thickness strain", strain.min(), extreme[0] - extreme[1],
            extreme[0] + extreme[1])
    between("its place at the start [mm]", radius[np.argmin(strain)], *where)
    between("strain at the clamped edge", np.abs(strain[radius > 59.1]).max(), 0, 0.06)
    between("penetration over thickness", results.history("max_penetration").max() / 0.85, 0, 0.02)


def square_box(folder):
    """Draw-in along the sides and the diagonal; the holder presses with its force."""
    if LENGTH == "short":
        results = run(folder, elements=14, depth=9, speed=15000, frames=2)
        side, diagonal = (1.7, 2.4), (1.1, 1.9)
    else:
        results = run(folder)
        side, diagonal = (27.5, 29.5), (17.1, 19.1)
    outline = Outline(results)
    start = outline.radii(outline.at(None), [0, 45, 90])
    now = outline.radii(outline.at(len(results.times) - 1), [0, 45, 90])
    drawn = np.subtract(start, now)
    between("draw-in along x [mm]", drawn[0], *side)
    between("draw-in along the diagonal [mm]", drawn[1], *diagonal)
    between("draw-in along y [mm]", drawn[2], *side)
    late = results.tool_history("holder", "time") > 0.5 * results.times[-1]
    force = results.tool_history("holder", "force")[late, 2]
    between("mean force of the holder [N]", force.mean(), 0.97 * 4900, 1.03 * 4900)
    between("its least force [N]", force.min(), 0.85 * 4900, 4900)
    between("its largest force [N]", force.max(), 4900, 1.15 * 4900)
    thinning = results.patches[0].field("thinning", len(results.times) - 1)
    between("largest thickening", -thinning.min(), 0, 0.34)


def s_rail(folder):
    """Draw-in of a coarse rail, alike after half a turn about z; force of the holder, thinning."""
    results = run(folder, ("--threads", "1"), size=10.5, depth=12, speed=4500, holder=20000,
                  frames=2)
    outline = Outline(results)
    angles = (45, 90, 135, 225, 270, 315)
    drawn = np.subtract(outline.radii(outline.at(None), angles),
                        outline.radii(outline.at(2), angles))
    for angle, value, low, high in zip(angles, drawn, (8.2, 5.2, 10.2), (9.2, 6, 11.3)):
        between(f"draw-in at {angle} degrees [mm]", value, low, high)
    between("its change by half a turn [mm]", np.abs(drawn[:3] - drawn[3:]).max(), 0, 0.05)
    in_draw = results.history("process_step") == 1
    late = in_draw & (results.history("time") > 0.5 * results.history("time")[in_draw][-1])
    force = results.tool_history("holder", "force")[late, 2].mean()
    between("mean force of the holder [N]", force, 0.95 * 20000, 1.05 * 20000)
    thinning = results.patches[0].field("thinning", 2)
    between("largest thinning", thinning.max(), 0.04, 0.055)


def u_bend(folder):
    """Angles of the wall to bottom and flange in the tools and released; force of the holder."""
    one = "--threads", "1"
    if LENGTH == "short":
        with open(os.path.join(PROJECT, "input", "u_bend.key"), encoding="utf-8") as file:
            text = file.read()
        text = text[:text.index("*REFINE")] + text[text.index("** straight lines"):]
        deck = os.path.join(folder, "short.key")
        with open(deck, "w", encoding="utf-8") as file:
            file.write(text)
        shutil.copytree(os.path.join(PROJECT, "input", "springback"),
                        os.path.join(folder, "springback"))
        short = {"length": 50, "n_x": 28, "stroke": 10, "speed": 5000}
        results = run(folder, one, deck, **short)
        compare_relaxations(folder, results, deck, short)
        stretches = (2, 18), (26, 32), (42, 49)
        drawn, opening = ((112.9, 110.0), 1.0), ((1.6, 1.4), 0.4)
    else:
        results = run(folder, one)
        stretches = (2, 18), (35, 80), (105, 170)
        drawn, opening = ((91.7, 90.0), 0.7), ((15.3, -12.0), 0.8)
    section = Section(results)
    step = results.history("process_step")
    late = (results.history("time") > 0.5 * results.history("time")[step == 1][-1]) & (step == 1)
    force = results.tool_history("holder", "force")[late, 1].mean()
    between("mean force of the holder [N]", force, 0.9 * 35, 1.1 * 35)
    kinetic, internal = (results.history(f"{kind}_energy")[late]
                         for kind in ("kinetic", "internal"))
    between("kinetic over internal energy, drawing", (kinetic / internal).max(), 0,
            0.1 if LENGTH == "short" else 0.05)
    between("penetration over thickness", results.history("max_penetration").max() / 0.78, 0, 0.02)
    ways = results.tool_history("holder", "displacement")[:, 1]
    between("way of the holder in all [mm]", np.abs(ways).max(), 0, 1)
    between("way of the holder once released [mm]", np.abs(ways[step > 1] - ways[-1]).max(), 0, 0)
    angles = []
    for frame in (10, len(results.times) - 1):
        line = section.sheet(frame)[1]
        fits = [fitted(line[by_start(section.start, *bounds)]) for bounds in stretches]
        angles.append([180 - abs(turn_between(a, b)) for a, b in zip(fits, fits[1:])])
    for i, before, after in zip((0, 1), *angles):
        between(f"angle {i + 1} in the tools", before, drawn[0][i] - drawn[1],
                drawn[0][i] + drawn[1])
        between(f"springback of angle {i + 1}", after - before, opening[0][i] - opening[1],
                opening[0][i] + opening[1])


def compare_relaxations(folder, static, deck, short):
    """Damping ends where the static step does, but for what the swinging sheet yields; stops at
    maxima of the kinetic energy end where damping does, at a wide limit already."""
    one = "--threads", "1"
    damped = run(folder, one, deck, "damped.h5", release="relaxed", rest_energy=1e-5, **short)
    path = os.path.join(folder, "springback", "relaxed.inc")
    with open(path, encoding="utf-8") as file:
        text = file.read()
    with open(path, "w", encoding="utf-8") as file:
        file.write(text.replace("RELAXATION,", "RELAXATION, METHOD=KINETIC,"))
    stopped = run(folder, one, deck, "stops.h5", release="relaxed", rest_energy=1e-3, **short)
    released = []
    for section in map(Section, (static, damped, stopped)):
        line = section.sheet(len(section.results.times) - 1)[1]
        released.append(np.diff([fitted(line[by_start(section.start, *bounds)])["direction"]
                                 for bounds in ((2, 18), (26, 32), (42, 49))]))
    between("static angles less those by damping", np.abs(released[1] - released[0]).max(),
            0, 0.5)
    between("angles by stops less those by damping", np.abs(released[2] - released[1]).max(),
            0, 0.2)


def channel_springback(folder):
    """How far the two ends of the strip turn against each other when the dies go."""
    results = run(folder, ("--threads", "1"), since=0.75)
    between("penetration over thickness", results.history("max_penetration").max() / 3, 0, 0.02)
    section = Section(results)
    turned = []
    for frame in (10, len(results.times) - 1):
        line = section.sheet(frame)[1]
        ends = [fitted(line[by_start(section.start, *bounds)])["direction"]
                for bounds in ((0, 100), (500, 600))]
        turned.append(ends[1] - ends[0])
    between("angle between the ends, formed", turned[0], 10.2, 11.6)
    between("springback of this angle", turned[1] - turned[0], 12.0, 13.4)
    for name in ("springback", "channel"):
        shutil.copytree(os.path.join(PROJECT, "input", name), os.path.join(folder, name))
    compare_elastic_releases(folder)
    compare_opened_dies(folder)


def compare_elastic_releases(folder):
    """With a law that cannot yield once the dies are gone, the damped strip comes to rest where the
    static step ends."""
    inputs = os.path.join(PROJECT, "input")
    with open(os.path.join(inputs, "channel_springback.key"), encoding="utf-8") as file:
        text = file.read()
    head, rest = text.split("*PLASTIC, HARDENING=VOCE\n250, 250, 6\n")
    deck = os.path.join(folder, "elastic.key")
    with open(deck, "w", encoding="utf-8") as file:
        file.write(head + "*USER MATERIAL, CONSTANTS=5, KINEMATICS=SMALL\n"
                          "210000, 0.3, 250, 250, 6\n*DEPVAR\n1\n" + rest)
    with open(os.path.join(inputs, "umat_voce.f"), encoding="utf-8") as file:
        law = file.read()
    assert law.count("DONE = Q .LE. FLOW\n") == 1
    user = os.path.join(folder, "elastic.f")
    with open(user, "w", encoding="utf-8") as file:
        file.write(law.replace("DONE = Q .LE. FLOW\n", "DONE = Q .LE. FLOW .OR. KSTEP .GE. 2\n"))
    angles = [turns_along(run(folder, ("--user", user, "--threads", "1"), deck, release + ".h5",
                              since=0.75, release=release)) for release in ("static", "relaxed")]
    between("angles by the static step less those by damping",
            np.abs(np.subtract(*angles)).max(), 0, 0.05)


def turns_along(results):
    """How far stretches of the channel turn against each other at the end."""
    section = Section(results)
    line = section.sheet(len(results.times) - 1)[1]
    return np.diff([fitted(line[by_start(section.start, *bounds)])["direction"]
                    for bounds in ((0, 50), (90, 180), (330, 420), (500, 600))])


def compare_opened_dies(folder):
    """At rest between the dies, the strip springs back as far by a static step as under dies that
    open so slowly that it does not swing."""
    with open(os.path.join(PROJECT, "input", "channel_springback.key"), encoding="utf-8") as file:
        text = file.read()
    before, static = text.split("** three components hold the rigid motion")
    static = static[static.index("*STEP"):]
    before = before.replace("*AMPLITUDE",
                            "*AMPLITUDE, NAME=open\n0, 0, 0.1, 2, 0.2, 0\n*AMPLITUDE", 1)
    damped = "*DYNAMIC, EXPLICIT\n{}\n*DAMPING, ALPHA={}\n"
    before += "*STEP, NAME=hold\n" + damped.format(0.06, 800) + "*END STEP\n"
    opened = "*STEP, NAME=open\n" + damped.format(0.2, 500)
    for die, way in (("lower", -40), ("upper", 40)):
        opened += f"*TOOL MOTION, TOOL={die} die, AMPLITUDE=open\n0, {way / 0.2}, 0\n"
    opened += "*END STEP\n" + static.replace("*INCLUDE, INPUT=springback/<release>.inc\n",
                                             damped.format(0.1, 500))
    angles = []
    for name, steps in (("held", static), ("opened", opened)):
        deck = os.path.join(folder, name + ".key")
        with open(deck, "w", encoding="utf-8") as file:
            file.write(before + steps)
        angles.append(turns_along(run(folder, ("--threads", "1"), deck, name + ".h5", since=0.75)))
    between("angles by the static step less those under opening dies",
            np.abs(np.subtract(*angles)).max(), 0, 1e-4)


def main():
    with tempfile.TemporaryDirectory() as folder:
        {"hemisphere": hemisphere, "s_rail": s_rail, "square_box": square_box, "u_bend": u_bend,
         "channel_springback": channel_springback}[NAME](folder)


main()
