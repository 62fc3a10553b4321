"""Frequencies of a thick ring in plane strain against two-dimensional elasticity.

u_r = U(r) cos(n t), u_t = V(r) sin(n t) turn the equations of motion into ordinary ones in r (A. E.
H. Love, Mathematical Theory of Elasticity, 4th ed., 1927), solved here on Chebyshev places. The
quarter with its two planes of symmetry holds n = 0, 2, 4 ...
"""
import numpy as np
from suite import Case, chebyshev, lame, pencil_frequencies

E, NU, DENSITY, A, B = 210000.0, 0.3, 7.85e-9, 20.0, 40.0


def exact(n):
    """Frequencies with n waves round the ring."""
    first, shear = lame(E, NU)
    stiff = first + 2 * shear
    r, d = chebyshev(24, A, B)
    one, s = np.eye(len(r)), np.diag(1 / r)
    # stresses from (U, V): radial, hoop, shear
    radial = np.hstack([stiff * d + first * s, first * n * s])
    hoop = np.hstack([first * d + stiff * s, stiff * n * s])
    shears = shear * np.hstack([-n * s, d - s])
    motion = np.vstack([d @ radial + s @ (radial - hoop) + n * s @ shears,
                        d @ shears + 2 * s @ shears - n * s @ hoop]) / DENSITY
    free = np.vstack([radial[[0, -1]], shears[[0, -1]]])
    return pencil_frequencies(motion, free, 2)


def main():
    case = Case("Thick ring, radii 20 and 40 mm, plane strain: lowest frequency",
                "two-dimensional elasticity, Love (1927)")
    reference = exact(2)[0]
    assert reference < min(exact(n)[0] for n in (4, 6, 8)), "another mode is the lowest"
    lines = []
    for p in (2, 3, 4):
        # from 10 elements on, no short wave of degree 4 lies below
        meshes = ((10 if p == 4 else 6), 12, 18) if case.is_long else ((10 if p == 4 else 6), 12)
        errors = [case.lowest("ring_modes", n_r=n // 2, n_t=n, **{"raise": p - 2})
                  / reference - 1 for n in meshes]
        sizes = [90 / n for n in meshes]
        case.deviation(f"lowest frequency, p = {p}, {meshes[-1]} elements round the quarter",
                       errors[-1], 0.0025 * (p + 1) * (12 / meshes[-1])**2)
        case.rate(f"rate, p = {p}", sizes, errors, 1.7, 2.3)
        lines.append((f"p = {p}", "o-", sizes, np.abs(errors)))
    case.panel("element [degrees]", "error of the frequency", lines, "log")
    case.finish()


main()
