"""A thick cylinder under pressure: Lame's solution, and the one of R. Hill (The Mathematical Theory
of Plasticity, 1950, chapter 5) for a perfectly plastic one in plane strain, under pressure and when
the pressure has gone: the cylinder then loses the stress of Lame.

Hill's stresses hold for von Mises' flow too where the axial stress is the mean of the others; that
is so in the plastic zone once the elastic strain is small beside the plastic one, and everywhere
for nu = 0.5. The deck has nu = 0.45 and so little stress that the shape stays that of the start.
"""
import numpy as np
from suite import Case

E, A, B = 210000.0, 20.0, 40.0


def polar(points):
    """Radius, radial and hoop stress at all integration points."""
    x, y = points["reference_position"].reshape(-1, 3)[:, :2].T
    s = points["stress"].reshape(-1, 6)
    r = np.hypot(x, y)
    c, d = x / r, y / r
    radial = s[:, 0] * c * c + s[:, 1] * d * d + 2 * s[:, 3] * c * d
    return r, radial, s[:, 0] + s[:, 1] - radial


def hill(pressure, strength):
    """Radius of the plastic zone under a pressure; strength in shear."""
    low, high = A, B
    for _ in range(100):
        c = (low + high) / 2
        if strength * (2 * np.log(c / A) + 1 - c * c / (B * B)) < pressure:
            low = c
        else:
            high = c
    return c


def elastic(case):
    """Lame: displacement and stress for degrees 2 to 4; a rate of static errors needs no mass."""
    nu, pressure = 0.3, 0.01
    meshes = (2, 4, 8) if case.is_long else (2, 4)
    ratio = pressure * A**2 / (B**2 - A**2)
    inside = (1 + nu) / E * ratio * ((1 - 2 * nu) * A + B**2 / A)
    lines = []
    for p in (2, 3, 4):
        errors = []
        for n in meshes:
            run = case.run("thick_cylinder", n_r=n, n_t=2, **{"raise": p - 2})
            r, _, hoop = polar(run.at_points)
            exact = ratio * (1 + B**2 / r**2)
            errors.append(np.linalg.norm(hoop - exact) / np.linalg.norm(exact))
        case.error(f"displacement inside [mm], p = {p}, {n} elements across",
                   run.probes["inside"]["displacement"][-1, 0], inside, 2e-3)
        case.deviation(f"hoop stress, rms, p = {p}, {n} elements across", errors[-1],
                       {2: 1e-2, 3: 3e-3, 4: 2e-3}[p])
        lines.append((f"p = {p}", "o-", [(B - A) / n for n in meshes], errors))
        if p == 2:
            case.rate("rate of the hoop stress, p = 2", [1 / n for n in meshes], errors, 1.5)
    case.panel("element [mm]", "rms error of the hoop stress, elastic", lines, "log")


def plastic(case):
    """Hill: stresses and the displacement outside at nine tenths of the limit pressure; what is
    left of the stresses without it."""
    nu, flow = 0.45, 25.0
    strength = flow / np.sqrt(3)
    pressure = 0.9 * 2 * strength * np.log(B / A)
    c = hill(pressure, strength)
    settings = {"nu": nu, "n_r": 8, "n_t": 2, "pressure": pressure, "yield": flow, "largest": 0.05}
    run = case.run("thick_cylinder", **settings)
    r, radial, hoop = polar(run.at_points)
    is_plastic = r < c
    s = (c / B)**2
    exact_radial = strength * np.where(is_plastic, 2 * np.log(r / c) - 1 + s, s - (c / r)**2)
    exact_hoop = strength * np.where(is_plastic, 2 * np.log(r / c) + 1 + s, s + (c / r)**2)
    case.deviation("elastoplastic radial stress, rms by the pressure",
                   np.sqrt(np.mean((radial - exact_radial)**2)) / pressure, 0.02)
    case.deviation("elastoplastic hoop stress, rms by the flow stress",
                   np.sqrt(np.mean((hoop - exact_hoop)**2)) / flow, 0.03)
    case.error("displacement outside [mm], elastoplastic",
               run.probes["outside"]["displacement"][-1, 0],
               2 * strength * s * (1 - nu**2) / E * B, 0.01)
    reached = r[run.at_points["eqps"].ravel() > 1e-7].max()
    case.error("radius of the plastic zone [mm]", reached, c, 0.04)
    case.deviation("energy balance, elastoplastic", run.history["energy_error"][-1], 1e-3)
    unloaded = case.run("thick_cylinder", period=2, **settings)
    _, radial_left, hoop_left = polar(unloaded.at_points)
    lame = pressure * A**2 / (B**2 - A**2)
    left_radial = exact_radial - lame * (1 - B**2 / r**2)
    left_hoop = exact_hoop - lame * (1 + B**2 / r**2)
    case.deviation("unloaded: radial stress left, rms by the pressure",
                   np.sqrt(np.mean((radial_left - left_radial)**2)) / pressure, 0.02)
    case.deviation("unloaded: hoop stress left, rms by the flow stress",
                   np.sqrt(np.mean((hoop_left - left_hoop)**2)) / flow, 0.03)
    case.deviation("unloaded: plastic strain since the load, largest over the elastic one",
                   np.abs(unloaded.at_points["eqps"] - run.at_points["eqps"]).max() * E / flow,
                   1e-6)
    order = np.argsort(r)
    case.panel("radius [mm]", "stress [MPa], elastoplastic", [
        ("radial", ".", r, radial), ("hoop", ".", r, hoop), ("hoop, unloaded", ".", r, hoop_left),
        ("Hill", "k-", r[order], exact_radial[order]), ("", "k-", r[order], exact_hoop[order]),
        ("", "k-", r[order], left_hoop[order])])


def main():
    case = Case("Thick cylinder under internal pressure, radii 20 and 40 mm, plane strain",
                "Lame; Hill (1950)")
    elastic(case)
    plastic(case)
    case.finish()


main()
