"""Membrane and bending patch tests on distorted blocks, plain and rational.

Pulled along x with free sides, a block carries E ln(lambda), or the flow stress, along x and
nothing else, however its elements are shaped. Bent about y with nu = 0 it carries E k (z - h/2);
displacements -k x^2/2 are in the space of bilinear shapes from degree 2 on, not in a rational one.
Gauss points integrate rational functions up to an error that falls with their number.
"""
import numpy as np
from suite import Case

E = 210000.0


def membrane_error(case, strain, stress, **settings):
    """Largest error of a stress component at any point, by the stress along x."""
    found = case.run("patch_membrane", strain=strain, **settings).at_points["stress"].reshape(-1, 6)
    return np.abs(found - stress * np.array([1, 0, 0, 0, 0, 0])).max() / stress


def bending_error(case, **settings):
    """Likewise, by the stress at the face."""
    strain = 1.0e-8
    points = case.run("patch_bending", strain=strain, **settings).at_points
    found = points["stress"].reshape(-1, 6)
    found[:, 0] -= E * strain * (points["reference_position"].reshape(-1, 3)[:, 2] - 1)
    return np.abs(found).max() / (E * strain)


def voce_stress(strain):
    """Uniaxial stress of 250 + 250 (1 - exp(-6 eqps)) at a logarithmic strain."""
    eqps = strain
    for _ in range(50):
        eqps = strain - (500 - 250 * np.exp(-6 * eqps)) / E
    return 500 - 250 * np.exp(-6 * eqps)


def main():
    case = Case("Patch tests on distorted blocks", "constant stress; E k z")
    for p in (1, 2, 3, 4):
        case.deviation(f"membrane, polynomial, p = {p}",
                       membrane_error(case, 1e-3, E * 1e-3, p=p, w=0), 2e-6)
    case.deviation("membrane, polynomial, p = 2, logarithmic plastic strain 0.05",
                   membrane_error(case, 0.05, voce_stress(0.05), w=0, rise=4e-3), 1e-4)
    points = (3, 4, 5, 6)
    errors = [membrane_error(case, 1e-3, E * 1e-3, q=q) for q in points]
    for q, error, limit in zip(points, errors, (4e-3, 2e-4, 1e-5, 1e-6)):
        case.deviation(f"membrane, rational, p = 2, {q} points each way", error, limit)
    for p in (2, 3, 4):
        case.deviation(f"bending, polynomial, p = {p}", bending_error(case, p=p, w=0), 1e-4)
    lines = []
    for p, low in ((2, 1.3), (3, 2.2)):
        meshes = (2, 4)
        row = [bending_error(case, p=p, w=1, n=n) for n in meshes]
        case.deviation(f"bending, rational, p = {p}, 8 x 8 elements", row[-1], 0.04 / 10**(p - 2))
        case.rate(f"rate of bending, rational, p = {p}", [1 / n for n in meshes], row, low)
        lines.append((f"p = {p}", "o-", [5 / n for n in meshes], row))
    case.panel("Gauss points each way", "error of stress, membrane, rational",
               [("p = 2", "o-", points, errors)], "log")
    case.panel("element [mm]", "error of stress, bending, rational", lines, "log")
    case.finish()


main()
