"""A clamped square plate from thick to thin: deflection under pressure and lowest frequency.

The reference is the plate of R. D. Mindlin (J. Appl. Mech. 18 (1951) 31-38) with the shear factor
5/6, by the method of Ritz: on the square from -1 to 1 all fields are (1 - x^2)(1 - y^2) times
polynomials, the deflection even in x and y, the rotations odd in their own direction. Its thin
limit is 35.985 sqrt(D/(rho t))/a^2 (A. W. Leissa, Vibration of Plates, NASA SP-160, 1969).
"""
import numpy as np
from suite import Case

E, NU, DENSITY, LENGTH = 210000.0, 0.3, 7.85e-9, 100.0


def functions(n, is_odd, x):
    """Values and slopes of (1 - x^2) x^(2 i + is_odd), with Legendre polynomials for the powers."""
    values, slopes = [], []
    for i in range(n):
        legendre = np.polynomial.Legendre.basis(2 * i + is_odd)
        bubble = 1 - x**2
        values.append(bubble * legendre(x))
        slopes.append(bubble * legendre.deriv()(x) - 2 * x * legendre(x))
    return np.array(values), np.array(slopes)


def mindlin(thickness, n=10):
    """Deflection at the middle by the pressure, and lowest angular frequency."""
    x, weights = np.polynomial.legendre.leggauss(40)
    even, even_slope = functions(n, 0, x)
    odd, odd_slope = functions(n, 1, x)

    def product(a, b):
        return np.einsum("ip,jq->ijpq", a, b).reshape(n * n, -1)

    half = LENGTH / 2
    even_slope, odd_slope = even_slope / half, odd_slope / half
    w, w_x, w_y = product(even, even), product(even_slope, even), product(even, even_slope)
    b, b_x, b_y = product(odd, even), product(odd_slope, even), product(odd, even_slope)
    c, c_x, c_y = product(even, odd), product(even_slope, odd), product(even, odd_slope)
    none = np.zeros_like(w)
    area = np.outer(weights, weights).ravel() * half**2
    rigidity = E * thickness**3 / 12 / (1 - NU**2)
    shear = 5 / 6 * E / (2 * (1 + NU)) * thickness

    def energy(rows, other, factor):
        return factor * (np.vstack(rows) * area) @ np.vstack(other).T

    bend_x, bend_y = [none, b_x, none], [none, none, c_y]
    twist = [none, b_y, c_x]
    shear_x, shear_y = [w_x, b, none], [w_y, none, c]
    stiffness = (energy(bend_x, bend_x, rigidity) + energy(bend_y, bend_y, rigidity)
                 + energy(bend_x, bend_y, NU * rigidity) + energy(bend_y, bend_x, NU * rigidity)
                 + energy(twist, twist, (1 - NU) / 2 * rigidity)
                 + energy(shear_x, shear_x, shear) + energy(shear_y, shear_y, shear))
    mass = (energy([w, none, none], [w, none, none], DENSITY * thickness)
            + energy([none, b, none], [none, b, none], DENSITY * thickness**3 / 12)
            + energy([none, none, c], [none, none, c], DENSITY * thickness**3 / 12))
    load = np.concatenate([w @ area, np.zeros(2 * n * n)])
    solution = np.linalg.solve(stiffness, load)
    middle_even, _ = functions(n, 0, np.array([0.0]))
    shape = np.outer(middle_even[:, 0], middle_even[:, 0]).ravel()
    values = np.linalg.eigvals(np.linalg.solve(stiffness, mass))
    return shape @ solution[:n * n], 1 / np.sqrt(values.real.max())


def compare_shells(case):
    """Shells of any slenderness against the thin limit."""
    fine = LENGTH / 1000
    deflection, omega = mindlin(fine)
    unit = deflection * E * fine**3 / 12 / (1 - NU**2) / LENGTH**4
    frequency = omega / (2 * np.pi) * 1000 / 100   # at a/t = 100: as the thickness
    for p, n, limit in ((2, 8, 0.01), (3, 8, 0.03)):
        found = case.modes("clamped_plate", 1, p=p, n=n, slenderness=100, element="SHELL",
                           scaling=1)[0]
        case.error(f"lowest frequency [Hz], shell, p = {p}, {n} x {n} elements, a/t = 100",
                   found, frequency, limit)
        run = case.run("clamped_plate", p=p, n=n, slenderness=30, element="SHELL", scaling=1)
        case.error(f"deflection [mm], shell, p = {p}, {n} x {n} elements, a/t = 30",
                   abs(run.probes["middle"]["displacement"][-1, 2]),
                   1e-4 * LENGTH / 30 * unit / 0.00126, 0.02)


def main():
    case = Case("Clamped square plate, thick to thin", "Mindlin's plate (1951) by Ritz")
    thin = mindlin(LENGTH / 1000)[1] * LENGTH**2 / np.sqrt(
        E * (LENGTH / 1000)**2 / 12 / (1 - NU**2) / DENSITY)
    assert abs(thin / 35.985 - 1) < 1e-3, f"the reference misses the thin plate: {thin}"
    # degree 2 through the thickness makes shear stresses constant there: factor 1, not 5/6
    for p, p_z, slenderness, limit in ((3, 2, 10, 0.05), (3, 3, 10, 0.03), (3, 2, 30, 0.03)):
        run = case.run("clamped_plate", p=p, p_z=p_z, slenderness=slenderness)
        thickness = LENGTH / slenderness
        rigidity = E * thickness**3 / 12 / (1 - NU**2)
        pressure = 1e-4 * thickness * rigidity / 0.00126 / LENGTH**4
        case.error(f"deflection [mm], p = {p}, {p_z} through the thickness, 4 x 4 elements of a "
                   f"quarter, a/t = {slenderness}",
                   abs(run.probes["middle"]["displacement"][-1, 2]),
                   pressure * mindlin(thickness)[0], limit)
    compare_shells(case)
    lines = []
    meshes = (("NONE", 2, 4, None), ("NONE", 2, 6, None), ("ANS", 2, 4, 0.05), ("NONE", 3, 4, 0.06))
    if case.is_long:
        meshes = (*meshes, ("NONE", 3, 8, 0.02))
    slenderness = np.array([10, 30, 1000])
    if case.is_long:
        slenderness = np.array([10, 30, 100, 300, 1000])
    for projection, p, n, limit in meshes:
        exact = np.array([mindlin(LENGTH / s)[1] / (2 * np.pi) for s in slenderness])
        found = np.array([case.modes("clamped_plate", 1, p=p, n=n, slenderness=s,
                                     projection=projection)[0]
                          for s in slenderness])
        name = f"{projection}, p = {p}, {n} x {n} elements"
        lines.append((name, "o-", slenderness, found / exact))
        if limit:
            case.deviation(f"lowest frequency, {name}, largest error from "
                           "a/t = 30 to 1000", np.abs(found / exact - 1)[1:].max(), limit)
        else:
            case.between(f"lowest frequency by the exact one, {name}, "
                         "a/t = 1000: locked", found[-1] / exact[-1], 1.5, 10)
    case.panel("slenderness a/t", "lowest frequency by the exact one", lines, "log")
    case.finish()


main()
