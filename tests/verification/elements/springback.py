"""A wide strip, perfectly plastic, bent to a radius R and let go.

Released, it keeps the curvature 1/R' = 1/R (1 - 3 q + 4 q^3), q = R s/(E' t), with s = 2/sqrt(3) of
the yield stress and E' = E/(1 - nu^2) (W. F. Hosford and R. M. Caddell, Metal Forming). This takes
the stress along the strip to stop at s where the elastic line meets it; by von Mises' condition it
leaves that line earlier and comes to s gradually, which matters at small curvatures. The second
reference integrates that stress and sums the moment over the same points through the thickness.
"""
import numpy as np
from suite import Case

E, NU, YIELD, THICKNESS = 210000.0, 0.3, 250.0, 1.0
PLANE_E, FLOW = E / (1 - NU**2), 2 * YIELD / np.sqrt(3)


def curvatures(run):
    """Curvature when bent and when released, from the angle of the end plane."""
    upper, lower = (run.probes[f"{side} end"]["displacement"] for side in ("upper", "lower"))
    angle = np.arctan2(lower[:, 0] - upper[:, 0], THICKNESS + upper[:, 1] - lower[:, 1])
    is_bent = run.history["process_step"] == 1
    return angle[is_bent][-1] / THICKNESS, angle[-1] / THICKNESS


def curvatures_of_shell(run):
    """The same of the deck of a shell, from the chord of an arc."""
    length, end = 0.5 * THICKNESS, run.probes["end"]["displacement"]
    curvature = 2 * np.arctan2(-end[:, 1], length + end[:, 0]) / length
    return curvature[run.history["process_step"] == 1][-1], curvature[-1]


def sprung(curvature):
    """Share of the curvature that goes, after Hosford and Caddell."""
    q = np.minimum(FLOW / (PLANE_E * THICKNESS * np.asarray(curvature)), 0.5)
    return 3 * q - 4 * q**3


def fibre(strains):
    """Stress along the strip at rising strains along it: plane strain, no stress through the
    thickness, Prandtl and Reuss."""
    elastic = PLANE_E * np.array([[1, NU], [NU, 1]])
    stress, found = np.zeros(2), []
    for step in np.diff(strains, prepend=0):
        flow = np.array([2 * stress[0] - stress[1], 2 * stress[1] - stress[0]])
        change = elastic[:, 0] * step
        trial = stress + change
        if trial @ trial - trial[0] * trial[1] > YIELD**2:
            change -= elastic @ flow * (flow @ change) / (flow @ elastic @ flow)
            trial = stress + change
            trial *= YIELD / np.sqrt(trial @ trial - trial[0] * trial[1])
        stress = trial
        found.append(stress[0])
    return np.array(found)


def sprung_by_rule(curvature, layers, points):
    """Share of the curvature that goes, with the moment of a composite Gauss rule."""
    places, weights = np.polynomial.legendre.leggauss(points)
    y = THICKNESS * ((np.arange(layers)[:, None] + (places + 1) / 2) / layers - 0.5)
    strains = np.linspace(0, curvature * THICKNESS / 2, 5000)
    stress = np.sign(y) * np.interp(curvature * np.abs(y), strains, fibre(strains))
    moment = np.sum(weights * THICKNESS / (2 * layers) * stress * y)
    return 12 * moment / (PLANE_E * THICKNESS**3 * curvature)


def main():
    case = Case("Bending and springback of a wide strip", "Hosford and Caddell")
    bent, released = curvatures(case.run("springback", **{"yield": 1e6}))
    case.deviation("elastic, R = 80 t: share that stays", released / bent, 1e-4)
    dots = []
    for radius, limit in ((200, 0.04), (80, 0.01), (20, 0.01)):
        bent, released = curvatures(case.run("springback", R=radius))
        case.error(f"curvature when bent, R = {radius} t", bent, 1 / radius, 2e-3)
        case.error(f"springback, R = {radius} t, 2x3 points", 1 - released / bent,
                   float(sprung(bent)), limit)
        case.error(f"springback, R = {radius} t, 2x3 points, against the sum over these",
                   1 - released / bent, sprung_by_rule(bent, 2, 3), 0.02)
        dots.append((FLOW / (PLANE_E * THICKNESS * bent), 1 - released / bent))
    rules, errors = ((1, 3), (2, 3), (2, 5), (6, 3)), []
    for layers, points in rules:
        bent, released = curvatures(case.run("springback", R=80, rule=f"2,2,{layers}x{points}"))
        share, exact = 1 - released / bent, sprung_by_rule(bent, 200, 2)
        case.error(f"springback, R = 80 t, {layers}x{points} points, against the sum over these",
                   share, sprung_by_rule(bent, layers, points), 0.02)
        errors.append(abs(share / exact - 1))
    case.deviation("springback, R = 80 t, 6x3 points, against the sum over many", errors[-1], 0.02)
    shells = []
    for radius in (200, 80, 20, 10):
        bent, released = curvatures_of_shell(case.run("wide_plate", R=radius))
        case.error(f"springback of a shell, R = {radius} t, 2x3 points, against the sum over "
                   "these", 1 - released / bent, sprung_by_rule(bent, 2, 3), 0.005)
        case.error(f"springback of a shell, R = {radius} t", 1 - released / bent,
                   float(sprung(bent)), 0.04 if radius > 80 else 0.02)
        shells.append((FLOW / (PLANE_E * THICKNESS * bent), 1 - released / bent))
    q = np.linspace(0, 0.5, 100)
    case.panel("R s/(E' t)", "springback / curvature", [
        ("Hosford and Caddell", "k-", q, 3 * q - 4 * q**3), ("2x3 points", "o", *zip(*dots)),
        ("shell, 2x3 points", "s", *zip(*shells))])
    case.panel("points through the thickness", "error of springback, R = 80 t",
               [("against many", "o-", [layers * points for layers, points in rules], errors)],
               "log")
    case.finish()


if __name__ == "__main__":
    main()
