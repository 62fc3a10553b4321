"""A strip of shells drawn over the radius of a die without friction.

The punch force less the tension is the work, per length, of bending the sheet to the radius and
straightening it again under that tension. The reference sums it over elastic-plastic layers in
plane strain. Elements that are long for the radius need more: docs/shells.md has the table.
"""
import numpy as np
from suite import Case

THICKNESS, RADIUS, TENSION, WIDTH = 0.8, 15.0, 60.0, 10.0
PLANE_E = 206000 / (1 - 0.3**2)
# Hill 1948 in plane strain: stress along the strip over the equivalent stress.
R_0, R_90 = 1.79, 2.27
H, F_PLUS_H = R_0 / (1 + R_0), R_0 / (1 + R_0) * (1 + 1 / R_90)
FACTOR = 1 / np.sqrt(1 - H**2 / F_PLUS_H)


def flow(eqps):
    """Flow stress along the strip, and its slope by the equivalent plastic strain."""
    stress = FACTOR * 565.32 * (0.007117 + eqps)**0.2589
    return stress, 0.2589 * stress / (0.007117 + eqps)


def returned(stress, eqps, strain):
    """Stress and equivalent plastic strain of layers after an increment of strain."""
    trial = stress + PLANE_E * strain
    gain = np.zeros_like(trial)
    for _ in range(8):
        now, slope = flow(eqps + FACTOR * gain)
        gain = np.maximum(gain + (np.abs(trial) - PLANE_E * gain - now)
                          / (PLANE_E + FACTOR * slope), 0.0)
    return trial - np.sign(trial) * PLANE_E * gain, eqps + FACTOR * gain


def work_of_a_bend(thickness=THICKNESS, n_layers=40, n_steps=400):
    """Work per length of the strip, bent to the radius and straightened [force]."""
    z = ((np.arange(n_layers) + 0.5) / n_layers - 0.5) * thickness
    stress, eqps = np.full(n_layers, TENSION), np.zeros(n_layers)
    step, work, moment = 1 / (RADIUS + thickness / 2) / n_steps, 0.0, 0.0
    for bend in [step] * n_steps + [-step] * n_steps:
        low, high = -2e-3, 2e-3
        for _ in range(30):
            middle = (low + high) / 2
            is_high = returned(stress, eqps, middle + bend * z)[0].mean() > TENSION
            low, high = (low, middle) if is_high else (middle, high)
        stress, eqps = returned(stress, eqps, middle + bend * z)
        before, moment = moment, (stress * z).mean() * thickness
        work += (before + moment) / 2 * bend + TENSION * thickness * middle
    return WIDTH * work


def force_of_bending(run):
    """Mean of the punch force less the tension, once the sheet lies around both radii."""
    way = -run.tools["punch"]["displacement"][:, 2]
    force = run.tools["punch"]["force"][:, 2]
    return force[(way > 40) & (way < 73)].mean() - TENSION * WIDTH * THICKNESS


def main():
    case = Case("Strip drawn over a radius of 19 thicknesses, shells", "the sum over layers")
    reference = work_of_a_bend()
    case.error("force of bending [N], elements of a quarter of the radius, Greville points",
               force_of_bending(case.run("drawn_strip")), reference, 0.1)
    if case.is_long:
        for points, size, least, most in (("GAUSS", 7.5, 1.7, 2.3), ("GREVILLE", 7.5, 1.3, 1.7),
                                          ("GAUSS", 5, 1.2, 1.6), ("GREVILLE", 5, 1.05, 1.3),
                                          ("GREVILLE", 1.5, 0.9, 1.1)):
            run = case.run("drawn_strip", size=size, points=points)
            case.between(f"the same over the reference, {points}, radius over element "
                         f"{RADIUS / size:g}", force_of_bending(run) / reference, least, most)
    case.finish()


main()
