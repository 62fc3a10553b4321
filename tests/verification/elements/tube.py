"""A thin tube as a shell with exact arcs: pressure from inside, and frequencies of its sections.

The hoop force follows from the pressure on the inner face, p a; the tube widens by
p a R (1 - nu^2)/(E t). Inextensional vibration in plane strain with n waves has
w^2 = E'/(rho R^4) t^2/12 n^2 (n^2 - 1)^2/(n^2 + 1) (A. E. H. Love, Mathematical Theory of
Elasticity, 4th ed., 1927); the quarter holds n = 2, 4 ... The half, two arcs with a joint between
that passes moments, holds a rigid motion and n = 2, 3 ...
"""
import numpy as np
from suite import Case

E, NU, DENSITY, RADIUS, THICKNESS = 210000.0, 0.3, 7.85e-9, 40.0, 1.0
PLANE_E = E / (1 - NU**2)


def exact(n):
    """Frequency [1/time] with n waves round the tube."""
    return (n * (n**2 - 1) / np.sqrt(n**2 + 1) * THICKNESS / RADIUS**2
            * np.sqrt(PLANE_E / 12 / DENSITY) / (2 * np.pi))


def main():
    case = Case("Thin tube as a shell: pressure and vibration", "closed form; Love (1927)")
    pressed = case.run("tube")
    inner, rise = RADIUS - THICKNESS / 2, 5.0e-4
    late = pressed.time() > rise
    for name, way in (("end", [1, 0, 0]), ("middle", [np.sqrt(0.5), np.sqrt(0.5), 0])):
        moved = (pressed.probes[name]["displacement"][late] @ way).mean()
        case.error(f"tube widens, {name} [mm], 12 elements", moved,
                   inner * RADIUS / PLANE_E / THICKNESS, 0.003)
    # over the layers of both halves, each with three Gauss points
    weights = np.tile(np.polynomial.legendre.leggauss(3)[1] / 4, 2)
    stress = pressed.at_points["stress"].reshape(6, -1, 6)
    radial = -0.5    # the mean of -1 inside and nothing outside
    hoop = np.einsum("k,kp->p", weights, stress[:, :, 0] + stress[:, :, 1]) - radial
    case.error("hoop force [N/mm], mean", hoop.mean() * THICKNESS, inner, 0.003)
    case.deviation("hoop force, largest deviation", np.abs(hoop / hoop.mean() - 1).max(), 0.003)
    lines = []
    for p in (2, 3, 4):
        meshes = (12, 24, 48) if case.is_long else (12, 24)
        found = np.array([case.modes("tube", 2, p=p, n=n) for n in meshes])
        for k, waves in enumerate((2, 4)):
            errors = found[:, k] / exact(waves) - 1
            case.deviation(f"frequency of {waves} waves, p = {p}, {meshes[-1]} elements",
                           errors[-1], 0.015 * (24 / meshes[-1])**2)
            lines.append((f"p = {p}, {waves} waves", "o-", meshes, np.abs(errors)))
    for p in (2, 3):
        half = case.modes("tube", 3, p=p, n=12, angle=180, end="YSYMM")[1:]
        for waves, found in zip((2, 3), half):
            case.deviation(f"half of two arcs, frequency of {waves} waves, p = {p}, 12 elements "
                           "each", found / exact(waves) - 1, 0.02)
    case.panel("elements of a quarter", "error of the frequency", lines, "log")
    case.finish()


main()
