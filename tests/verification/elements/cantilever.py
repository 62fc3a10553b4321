"""A cantilever under a dead end load against the beam of E. Reissner (ZAMP 23 (1972) 795-804),
which is the elastica with the small shear and stretch that a solid has, too.

With the load P across the undeformed axis and the angle t, E I t'' = -P x', x' = (1 + e) cos t
- g sin t, z' = (1 + e) sin t + g cos t, e = P sin t/(E A), g = P cos t/(5/6 G A); t' starts from
the value with which it ends at zero.
"""
import numpy as np
from suite import Case

LENGTH, HEIGHT, LOAD = 100.0, 5.0, 3.0


def beam(load, n=2000):
    """Places along the deformed axis for load = P L^2/(E I), by the rule of Runge and Kutta."""
    inertia = HEIGHT**2 / 12          # by the area
    force = load * inertia / LENGTH**2   # by E and the area

    def slope(state):
        angle = state[2]
        stretch, shear = force * np.sin(angle), force * np.cos(angle) * 2 * 6 / 5
        along = (1 + stretch) * np.cos(angle) - shear * np.sin(angle)
        return np.array([along, (1 + stretch) * np.sin(angle) + shear * np.cos(angle), state[3],
                         -force / inertia * along])

    def march(curvature):
        h, states = LENGTH / n, [np.array([0.0, 0.0, 0.0, curvature])]
        for _ in range(n):
            y = states[-1]
            a = slope(y)
            b = slope(y + h / 2 * a)
            c = slope(y + h / 2 * b)
            states.append(y + h / 6 * (a + 2 * b + 2 * c + slope(y + h * c)))
        return np.array(states)

    old, new = 0.5 * load / LENGTH, 0.7 * load / LENGTH
    end = march(old)[-1, 3]
    for _ in range(30):
        result = march(new)
        if abs(result[-1, 3]) < 1e-12:
            break
        secant = (result[-1, 3] - end) / (new - old)
        old, new, end = new, new - result[-1, 3] / secant, result[-1, 3]
    return result[:, :2]


def main():
    case = Case("Cantilever under a dead end load, P L^2/(E I) = 3", "Reissner's beam (1972)")
    exact = beam(LOAD)
    lines = []
    meshes = ((2, 8), (2, 16), (3, 8), (3, 16)) if case.is_long else ((2, 8), (3, 8))
    for p, n, element, rule in (*(mesh + ("SOLID", "FULL") for mesh in meshes),
                                (2, 16, "SHELL", "SHEET")):
        run = case.run("cantilever", p=p, n_x=n, element=element, rule=rule)
        tip = run.probes["tip"]["displacement"][run.time() > 2.1e-2].mean(axis=0)
        tip += np.array([LENGTH, 0, 0])
        what = f"p = {p}, {n} elements" + ", shell" * (element == "SHELL")
        case.error(f"end, along [mm], {what}", tip[0], exact[-1, 0], 0.008)
        case.error(f"end, across [mm], {what}", tip[2], exact[-1, 1], 0.008)
        middle = np.abs(run.start[:, 2]) < 1e-6
        shape = run.points[middle]
        lines.append((what, "o", shape[:, 0], shape[:, 2]))
    lines.append(("Reissner", "k-", exact[:, 0], exact[:, 1]))
    case.panel("x [mm]", "z [mm]", lines)
    case.finish()


main()
