"""Contact patch test: a block pressed between two planes has a uniform stress, for every kind of
slave points and every degree that may keep it.
"""
import numpy as np
from suite import Case

AREA = 20 * 16
# Crossings of knots are fewer than the splines of degree 2 and up; largest error and loss of force.
KNOT = {2: (0.454, 0.116), 3: (1.49, 0.229), 4: (2.56, 0.297)}


def main():
    case = Case("Block pressed between two planes, slave points", "uniform stress")
    forces = {}
    for points in ("GAUSS", "GREVILLE", "KNOT"):
        for p in (1, 2, 3, 4):
            run = case.run("contact_patch", p=p, points=points)
            worst, forces[points, p] = errors(run)
            if points == "KNOT" and p in KNOT:
                off, lack = KNOT[p]
                case.between(f"largest error of stress, {points}, p = {p}", worst,
                             0.9 * off, 1.1 * off)
                case.between(f"force that is lacking, {points}, p = {p}",
                             1 - forces[points, p] / forces["GAUSS", p], lack - 0.02, lack + 0.02)
            else:
                case.deviation(f"largest error of stress, {points}, p = {p}", worst, 2e-6)
                case.error(f"force [N], {points}, p = {p}", forces[points, p],
                           forces["GAUSS", p], 1e-6)
    for points in ("GAUSS", "GREVILLE"):
        worst, _ = errors(case.run("contact_patch", p=3, points=points, ratio=4))
        case.deviation(f"largest error of stress, {points}, p = 3, graded mesh", worst, 2e-6)
    case.finish()


def errors(run):
    """Largest deviation from the stress of the force alone, over it, and the force."""
    force = run.tools["plate"]["force"][-1, 2]
    stress = run.at_points["stress"].reshape(-1, 6).copy()
    stress[:, 2] += force / AREA
    return np.abs(stress).max() * AREA / force, force


main()
