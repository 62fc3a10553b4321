"""Flexural frequencies of a simply supported plate against the exact solution of three-dimensional
elasticity, whose edges keep deflection and tangential motion and carry no normal stress.

u = U(z) cos(a x) sin(b y), v = V(z) sin cos, w = W(z) sin sin solve the equations of motion for all
thicknesses (S. Srinivas, C. V. Joga Rao, A. K. Rao, J. Sound Vib. 12 (1970) 187-199); what remains
are ordinary equations in z, solved here on Chebyshev places.
"""
import numpy as np
from suite import Case, chebyshev, lame, pencil_frequencies

E, NU, DENSITY, LENGTH = 210000.0, 0.3, 7.85e-9, 100.0


def exact(m, n, thickness):
    """Lowest frequency of the plate with m and n half waves."""
    first, shear = lame(E, NU)
    a, b = m * np.pi / LENGTH, n * np.pi / LENGTH
    z, d = chebyshev(16, -thickness / 2, thickness / 2)
    one, d2 = np.eye(len(z)), d @ d
    p = first + shear
    laplace = shear * (d2 - (a * a + b * b) * one)
    motion = np.block([
        [laplace - p * a * a * one, -p * a * b * one, p * a * d],
        [-p * a * b * one, laplace - p * b * b * one, p * b * d],
        [-p * a * d, -p * b * d, laplace + p * d2]]) / DENSITY
    zero = np.zeros_like(one)
    stresses = [np.hstack([d, zero, a * one]), np.hstack([zero, d, b * one]),
                np.hstack([-first * a * one, -first * b * one, (first + 2 * shear) * d])]
    free = np.vstack([stress[[0, -1]] for stress in stresses])
    return pencil_frequencies(motion, free, 3)[0]


def thin(thickness, m=1, n=1):
    """Kirchhoff's plate with m and n half waves."""
    rigidity = E * thickness**3 / (12 * (1 - NU**2))
    return ((m**2 + n**2) * np.pi**2 / LENGTH**2 * np.sqrt(rigidity / (DENSITY * thickness))
            / (2 * np.pi))


def main():
    case = Case("Simply supported plate, 100 x 100 x 10 mm",
                "three-dimensional elasticity, Srinivas, Joga Rao and Rao (1970)")
    thickness = 10.0
    reference = exact(1, 1, thickness)
    assert abs(exact(1, 1, 1.0) / thin(1.0) - 1) < 1e-3, "the reference misses the thin plate"
    assert exact(1, 1, thickness) < exact(1, 3, thickness) < exact(3, 3, thickness)
    lines = []
    for p in (2, 3, 4):
        # the coarsest meshes on which no short wave of degree p lies below
        meshes = ((8, 2), (11, 3)) if p == 4 else ((3, 1), (6, 2), (9, 3))
        if not case.is_long:
            meshes = meshes[:-1]
        sizes = [LENGTH / 2 / n for n, _ in meshes]
        errors = [case.lowest("plate_modes", p=p, n=n, n_z=n_z) / reference - 1
                  for n, n_z in meshes]
        n, n_z = meshes[-1]
        case.deviation(f"frequency, p = {p}, {n} x {n} x {n_z} elements of a quarter", errors[-1],
                       0.028 * (6 / n)**1.5)
        if case.is_long:
            case.rate(f"rate, p = {p}", sizes, errors, 1.4, 2.4)
        lines.append((f"p = {p}", "o-", sizes, np.abs(errors)))
    for p in (2, 3, 4):
        meshes = (6, 9, 12) if case.is_long else (6, 9)
        errors = [case.lowest("plate_modes", p=p, n=n, element="SHELL") / thin(thickness) - 1
                  for n in meshes]
        case.deviation(f"frequency of a shell against Kirchhoff's plate, p = {p}, {meshes[-1]} x "
                       f"{meshes[-1]} elements of a quarter", errors[-1],
                       0.004 * p * (9 / meshes[-1])**2)
        case.rate(f"rate, shell, p = {p}", meshes, errors, -2.4, -1.6)
        lines.append((f"shell, p = {p}", "s--", [LENGTH / 2 / n for n in meshes], np.abs(errors)))
    fine = case.modes("plate_modes", 4, n=60, element="SHELL", thickness=1)
    for frequency, waves in zip(fine, ((1, 1), (1, 3), (3, 1), (3, 3))):
        case.error(f"frequency of a fine shell, {waves[0]} x {waves[1]} half waves, 60 x 60 "
                   "elements of a quarter", frequency, thin(1.0, *waves), 0.0018)
    case.panel("element [mm]", "error of the frequency", lines, "log")
    case.finish()


main()
