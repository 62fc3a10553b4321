"""Static steps with large rotations.

A strip that an end moment rolls up closes the circle at M = 2 pi E I/L. The pinched hemisphere is
compared with the table of Sze, Liu and Lo. A strip that is bent until it yields and then turned as
a whole has the same springback, turned. One that stays elastic comes back straight from a
deflection of 0.4 of its length in two increments. Where the tangent is that of the state, an
iteration of Newton's method reduces the residual by orders of magnitude.
"""
import os
import subprocess

import numpy as np
from run_results import Run
from static_runs import iterations, last_residuals
from suite import Case

# K. Y. Sze, X. H. Liu, S. H. Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569: ways of the points
# that are pulled and pushed, under forces of 200 and 400
SZE = ((3.406, 5.902), (4.067, 8.178))

# of bent_strip.key
LENGTH, ELEMENTS, BACK, DOWN = 40.0, 10, 3.6, 15.0


def roll_up(case):
    """Curvature, energy and place of the end of a strip that has become a circle."""
    length, young, thickness = 12.0, 1.2e6, 0.05
    rigidity = young * thickness**3 / 12
    for turns in (0.5, 1):
        curvature = 2 * np.pi * turns / length
        run = case.run("roll_up", turns=turns)
        way = {name: probe["displacement"][-1] for name, probe in run.probes.items()}
        for name, s in (("middle", length / 2), ("end", length)):
            there = np.array([np.sin(curvature * s), 0, 1 - np.cos(curvature * s)]) / curvature
            case.deviation(f"{turns} turns of the strip: place of the {name} over the length",
                           np.linalg.norm(way[name] + [s, 0, 0] - there) / length, 1.5e-3)
        case.error(f"{turns} turns of the strip: energy",
                   run.history["internal_energy"][-1], rigidity * curvature**2 * length / 2, 2e-3)


def hemisphere(case):
    """Two meshes: the ways under both forces, and that they come closer to the table."""
    errors = []
    for n, limits in ((16, (0.04, 0.065)), (24, (0.013, 0.023))):
        run = case.run("hemisphere_pinched", n=n)
        step = run.history["process_step"]
        for k, (pulled, pushed) in enumerate(SZE):
            last = np.flatnonzero(step == k + 1)[-1]
            ways = (run.probes["pulled"]["displacement"][last, 0],
                    -run.probes["pushed"]["displacement"][last, 1])
            for name, way, table, limit in zip(("pulled", "pushed"), ways, (pulled, pushed),
                                               limits):
                case.error(f"hemisphere, {n} x {n} elements, force {200 * (k + 1)}: {name} by",
                           way, table, limit)
        errors.append(ways[1] / SZE[1][1] - 1)
    case.rate("hemisphere: order of the error of the way pushed", (1 / 16, 1 / 24), errors, 2)


def supports_that_turn(angles):
    """Steps in which the rows of control points that are held turn from one angle to the next,
    each in one increment, so that all of the strip can follow as a rigid body."""
    rows = (("X_MIN", 0.0, 0.0), ("beside", LENGTH / ELEMENTS / 2, 0.0),
            ("X_MAX", LENGTH - BACK, -DOWN))
    text = ""
    for before, after in zip(angles[:-1], angles[1:]):
        c, s = np.cos(after) - np.cos(before), np.sin(after) - np.sin(before)
        text += ("*STEP, NAME=turn\n*STATIC\n1, 1\n*BOUNDARY, OP=NEW\nY_MIN, YSYMM\nY_MAX, YSYMM\n"
                 "*BOUNDARY, TYPE=VELOCITY\n")
        for name, x, z in rows:
            text += f"{name}, 1, 1, {c * x - s * z:.17g}\n{name}, 3, 3, {s * x + c * z:.17g}\n"
        text += "*OUTPUT, FRAMES=1, HISTORY=1\n*END STEP\n"
    return text


def run_after_bending(case, name, lines, steps, *settings):
    """Results of steps after the bending of `bent_strip.key`, with lines before it."""
    deck, result = (os.path.join(case.out, f"{case.name}_{name}{end}") for end in (".key", ".h5"))
    bent = os.path.abspath(os.path.join(case.decks, "bent_strip.key"))
    with open(deck, "w", encoding="utf-8") as file:
        file.write(f'{lines}*INCLUDE, INPUT="{bent}"\n{steps}')
    subprocess.run([case.igaform, deck, "--threads", "1", "--quiet", *settings, "--out", result],
                   check=True)
    return Run(result)


def bent_and_turned(case, angles):
    """Bend the strip, turn it, let its end go; the results."""
    size = LENGTH / ELEMENTS
    return run_after_bending(
        case, "turned", f"*SET, NAME=beside\nx, {0.4 * size}, {0.6 * size}\n",
        supports_that_turn(angles) +
        "*STEP, NAME=release\n*STATIC\n0.25, 1\n*BOUNDARY, OP=NEW\nY_MIN, YSYMM\n"
        "Y_MAX, YSYMM\nX_MIN, 1, 3\nbeside, 1, 3\n*OUTPUT, FRAMES=1, HISTORY=4\n*END STEP\n",
        "--set", "element=SHELL")


def let_go(case):
    """The elastic strip comes back straight in two increments, without a cut."""
    for element in ("SOLID", "SHELL"):
        run = run_after_bending(
            case, "let_go", "",
            "*STEP, NAME=release\n*STATIC\n0.5, 1\n*BOUNDARY, OP=NEW\nY_MIN, YSYMM\n"
            "Y_MAX, YSYMM\nX_MIN, ENCASTRE\n*OUTPUT, FRAMES=1, HISTORY=2\n*END STEP\n",
            "--set", f"element={element}", "--set", "flow_stress=25000")
        case.deviation(f"elastic strip let go, {element}: shape over the length",
                       np.abs(run.frames[-1] - run.frames[0]).max() / LENGTH, 1e-4)
        done = iterations(case, "let_go")
        case.between(f"elastic strip let go, {element}: increments", len(done), 52, 52)
        case.between(f"elastic strip let go, {element}: iterations", done[50:].sum(), 4, 20)


def turned(case):
    """Springback of the strip as it lies, and turned by 37 degrees before."""
    angle = np.radians(37)
    straight = bent_and_turned(case, [0.0])
    other = bent_and_turned(case, np.linspace(0, angle, 26))
    back = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0],
                     [-np.sin(angle), 0, np.cos(angle)]])
    way = np.abs(straight.frames[-1] - straight.frames[-2]).max()
    case.between("strip: way of the springback [mm]", way, 1, 4)
    for at, name in ((-2, "before"), (-1, "after")):
        case.deviation(f"strip turned by 37 degrees: shape {name} the springback over the length",
                       np.abs(other.frames[at] @ back.T - straight.frames[at]).max() / LENGTH, 1e-8)
    case.deviation("strip turned by 37 degrees: energy left",
                   other.history["internal_energy"][-1] / straight.history["internal_energy"][-1]
                   - 1, 1e-7)


def convergence(case):
    """What an iteration leaves of a residual below 0.05, by a new tangent and by one that was
    kept, in the last two of all increments."""
    for element in ("SOLID", "SHELL"):
        case.run("bent_strip", element=element)
        residuals, are_new = last_residuals(case, "bent_strip")
        left, is_new = residuals[:, 1:] / residuals[:, :-1], are_new[:, 1:]
        is_near = residuals[:, :-1] < 0.05
        for name, which, median, most in (("new", is_new & is_near, 2e-3, 1e-2),
                                          ("kept", ~is_new & is_near, 5e-2, 0.4)):
            case.deviation(f"bent strip, {element}: left by a {name} tangent, median",
                           np.median(left[which]), median)
            case.deviation(f"bent strip, {element}: left by a {name} tangent, at most",
                           left[which].max(), most)


def main():
    case = Case("Static steps with large rotations",
                "closed form; Sze, Liu, Lo (2004); the strip that is not turned")
    roll_up(case)
    hemisphere(case)
    turned(case)
    let_go(case)
    convergence(case)
    case.finish()


main()
