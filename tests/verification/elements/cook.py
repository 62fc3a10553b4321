"""Cook's membrane, plane strain, nu = 0.4999: displacement of the upper right corner.

The reference is one quadrilateral with polynomials of high degree, (1 + xi) P_i(xi) P_j(eta), which
do not lock. The same routine must find the 23.96 that is known for the middle of the right edge in
plane stress with nu = 1/3 (R. D. Cook, J. Struct. Div. ASCE 100 (1974) 1851-1863; limit of refined
meshes). Young's modulus and the force on the edge are one.
"""
import numpy as np
from suite import Case


def displacement(nu, is_plane_strain, eta, degree=30):
    """Vertical displacement at (1, eta) of the right edge."""
    points, weights = np.polynomial.legendre.leggauss(2 * degree)
    legendre = [np.polynomial.Legendre.basis(i) for i in range(degree + 1)]
    line = np.array([(1 + points) * p(points) for p in legendre[:degree]])
    line_slope = np.array([p(points) + (1 + points) * p.deriv()(points) for p in legendre[:degree]])
    cross = np.array([p(points) for p in legendre])
    cross_slope = np.array([p.deriv()(points) for p in legendre])

    def product(a, b):
        return np.einsum("ip,jq->ijpq", a, b).reshape(a.shape[0] * b.shape[0], -1)

    xi, eta_points = (grid.ravel() for grid in np.meshgrid(points, points, indexing="ij"))
    # x = 24 (1 + xi), y between the lines from (0, 0) to (48, 44) and from (0, 44) to (48, 60)
    y_xi = 11 * (1 - eta_points) + 4 * (1 + eta_points)
    y_eta = 22 - 7 * (1 + xi)
    by_xi, by_eta = product(line_slope, cross), product(line, cross_slope)
    d_y = by_eta / y_eta
    d_x = (by_xi - d_y * y_xi) / 24
    area = np.outer(weights, weights).ravel() * 24 * y_eta
    if is_plane_strain:
        first, shear = nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu))
    else:
        first, shear = nu / (1 - nu**2), 1 / (2 * (1 + nu))
    xx, yy, xy = (d_x * area) @ d_x.T, (d_y * area) @ d_y.T, (d_x * area) @ d_y.T
    stiff = first + 2 * shear
    matrix = np.block([[stiff * xx + shear * yy, first * xy + shear * xy.T],
                       [first * xy.T + shear * xy, stiff * yy + shear * xx]])
    edge = cross @ weights / 2
    load = np.kron([2.0 * p(1.0) for p in legendre[:degree]], edge)
    solution = np.linalg.solve(matrix, np.concatenate([np.zeros_like(load), load]))
    at_place = np.kron([2.0 * p(1.0) for p in legendre[:degree]], [p(eta) for p in legendre])
    return at_place @ solution[len(load):]


def main():
    case = Case("Cook's membrane, plane strain, nu = 0.4999",
                "polynomials of degree 30; Cook (1974) for plane stress")
    known = displacement(1 / 3, False, 0.0)
    assert abs(known / 23.96 - 1) < 2e-3, f"the reference misses the known value: {known}"
    exact = displacement(0.4999, True, 1.0)
    meshes = (2, 4, 8, 16) if case.is_long else (2, 4)
    # projection, degree, samples each way: p + 1 samples leave the volume strain as it is
    limits = {("BBAR", 2, 3): 0.5, ("BBAR", 2, 2): 0.16, ("ANS", 2, 2): 0.16, ("BBAR", 2, 1): 0.06,
              ("BBAR", 3, 4): 0.12, ("BBAR", 3, 2): 0.07}
    lines = []
    for (projection, p, s), limit in limits.items():
        name = f"{projection}, p = {p}, {s} samples" if s <= p else f"NONE, p = {p}"
        shares = []
        for n in meshes:
            run = case.run("cook", p=p, n=n, projection=projection, s=s)
            moved = run.probes["corner"]["displacement"][-1, 1] / (16 * 1e-4)
            shares.append(moved / exact)
        case.error(f"corner, {name}, {n} x {n} elements", moved, exact, limit)
        lines.append((name, "o-", meshes, shares))
    case.panel("elements along a side", "displacement of the corner by the exact one", lines)
    case.finish()


main()
