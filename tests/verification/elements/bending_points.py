"""Points through the thickness that the springback of a wide plate takes, from sharp to flat bends.

The plate of springback.py, perfectly plastic, is bent and released in a static step with several
rules through the thickness. The reference sums the moment over many points; what a rule misses at
other radii, and so the table of docs/forming.md, follows from sums alone.
"""
import numpy as np
from springback import curvatures, curvatures_of_shell, fibre, sprung_by_rule
from suite import Case

RULES = ((1, 3), (1, 5), (2, 2), (2, 3), (4, 5))
# errors of the springback at R/t = 10, 40, 200 that must not be passed
LIMITS = {(1, 3): (0.15, 0.15, 0.07), (1, 5): (0.06, 0.06, 0.03), (2, 2): (0.01, 0.01, 0.05),
          (2, 3): (0.01, 0.01, 0.04), (4, 5): (0.01, 0.01, 0.01)}
OF_SOLID = 0.025    # what a solid of one quadratic element adds
BANDS = ((5, 20), (20, 40), (40, 80), (80, 160), (160, 320))
MOST = {(2, 2): (0.001, 0.004, 0.015, 0.05, 0.06), (2, 3): (0.001, 0.004, 0.015, 0.015, 0.036),
        (2, 5): (0.001, 0.004, 0.005, 0.01, 0.015), (4, 5): (0.001, 0.002, 0.003, 0.004, 0.004)}


def runs(case):
    """Errors of the springback in the program."""
    for deck, name, measure, added in (("wide_plate", "shell", curvatures_of_shell, 0.0),
                                       ("springback", "solid", curvatures, OF_SOLID)):
        for k, radius in enumerate((10, 40, 200)):
            for layers, points in RULES:
                bent, released = measure(case.run(deck, R=radius, release="static",
                                                  rule=f"2,2,{layers}x{points}"))
                case.error(f"springback of the {name}, R = {radius} t, {layers}x{points} points, "
                           "against the sum over many", 1 - released / bent,
                           sprung_by_rule(bent, 200, 2), LIMITS[layers, points][k] + added)


def moment(curvature, rule, strains, stresses):
    """Moment of a strip of thickness 1 as a rule sums it up."""
    places, weights = np.polynomial.legendre.leggauss(rule[1])
    y = (np.arange(rule[0])[:, None] + (places + 1) / 2) / rule[0] - 0.5
    return np.sum(weights / (2 * rule[0]) * np.abs(y)
                  * np.interp(curvature * np.abs(y), strains, stresses))


def sums(case):
    """Largest errors over ranges of radii."""
    strains = np.r_[np.linspace(0, 0.01, 20001), np.linspace(0.01, 0.15, 1401)[1:]]
    stresses = fibre(strains)
    radii = np.geomspace(5 / np.sqrt(2), 320 * np.sqrt(2), 250)
    exact = np.array([moment(1 / r, (200, 3), strains, stresses) for r in radii])
    middles, lines = 5 * 2.0 ** np.arange(7), []
    for rule in ((1, 3), (1, 5), (2, 2), (2, 3), (2, 5), (4, 5)):
        found = np.array([moment(1 / r, rule, strains, stresses) for r in radii])
        errors = np.abs(found / exact - 1)
        lines.append((f"{rule[0]}x{rule[1]}", "o-", middles,
                      [errors[np.abs(np.log2(radii / r)) <= 0.5].max() for r in middles]))
        for (low, high), limit in zip(BANDS, MOST.get(rule, ())):
            inside = (radii >= low) & (radii <= high)
            case.deviation(f"sum over {rule[0]}x{rule[1]} points, R/t from {low} to {high}",
                           errors[inside].max(), limit)
    case.panel("R/t, steel of 250 MPa", "largest error of springback", lines, "log")


def main():
    case = Case("Points through the thickness of a bent plate", "sum over many points")
    runs(case)
    sums(case)
    case.finish()


main()
