"""Plane-strain tension of a Swift material to its maximum load, in closed form.

With the plastic strain 2/sqrt(3) times the logarithmic strain e, F = A exp(-e) 2/sqrt(3) sigma_y;
it is largest where the slope of the stress equals the stress (A. Considere, Ann. Ponts Chaussees 9
(1885) 574): e = n - sqrt(3)/2 eps_0.
"""
import numpy as np
from suite import Case

K, EPS_0, N, LENGTH = 500.0, 0.002, 0.2, 10.0


def load(strain):
    """Force on a section of area one."""
    factor = 2 / np.sqrt(3)
    return factor * K * (EPS_0 + factor * strain)**N * np.exp(-strain)


def compare(case, element):
    """Load over strain of solids or shells; the line of the picture."""
    run = case.run("plane_strain_tension", element=element)
    moved = run.probes["end"]["displacement"][:, 0]
    work = run.history["external_work"]
    strain = np.log(1 + (moved[1:] + moved[:-1]) / (2 * LENGTH))
    force = np.diff(work) / np.diff(moved)
    is_plastic = (strain > 0.02) & (strain < 0.24)
    strain, force = strain[is_plastic], force[is_plastic]
    case.deviation(f"{element}: load from strain 0.02 to 0.24, rms",
                   np.sqrt(np.mean((force / load(strain) - 1)**2)), 0.01)
    # the top is flat: its place comes from a parabola through a wide part of it
    near = (strain > 0.12) & (strain < 0.24)
    cubic = np.polyfit(strain[near], force[near], 4)
    places = np.linspace(0.12, 0.24, 2001)
    top = places[np.argmax(np.polyval(cubic, places))]
    considere = N - np.sqrt(3) / 2 * EPS_0
    case.error(f"{element}: strain at the maximum load", top, considere, 0.03)
    case.error(f"{element}: maximum load [N]", np.polyval(cubic, top), load(considere), 0.003)
    return [(element, "-", strain, force), ("closed form", "k--", strain, load(strain)),
            ("Considere", "ko", [considere], [load(considere)])]


def main():
    case = Case("Plane-strain tension to the maximum load", "Considere (1885)")
    shell, *_ = compare(case, "SHELL")
    case.panel("logarithmic strain", "load [N]", [*compare(case, "SOLID"), shell])
    case.finish()


main()
