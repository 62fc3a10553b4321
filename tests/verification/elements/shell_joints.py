"""Joints of shells that pass moments: a disk of five patches, a strip bent into its plastic range,
sheets at an angle and three at a line.

Kirchhoff's plate of the radius R has the lowest frequency lambda/R^2 sqrt(D/(rho t)), lambda =
10.2158 clamped and 4.9351 simply supported with a Poisson's ratio of 0.3 (A. W. Leissa, Vibration
of Plates, NASA SP-160, 1969). A quarter between planes of symmetry has this mode,
too: a hinge there lowers it. The strip has a knot as often as the degree where the moment is
largest; the reference is the same strip without it. The frames of sheets follow from beam theory,
as their Poisson's ratio is zero.
"""
import numpy as np
from suite import Case

E, NU, DENSITY, RADIUS, THICKNESS = 210000.0, 0.3, 7.85e-9, 50.0, 1.0
LAMBDA = {"ENCASTRE": 10.2158, "PINNED": 4.9351}
RATIO = 2.081          # of the second frequency to the first, clamped


def exact(support):
    """Lowest frequency of the disk [1/time]."""
    rigidity = E * THICKNESS**3 / (12 * (1 - NU**2))
    return (LAMBDA[support] / RADIUS**2 * np.sqrt(rigidity / (DENSITY * THICKNESS))
            / (2 * np.pi))


def sag(case, **settings):
    """Deflection of the middle of the strip at rest [mm]."""
    return case.run("joined_strip", **settings).probes["middle"]["displacement"][-1, 2]


def frames(case):
    """A wall of 20 on a floor of 40, and a stem of 20 between two such floors, pulled along x."""
    force, floor, wall, rigidity = 0.4, 40.0, 20.0, 210000.0 * 4 / 12
    for degrees in (90, 60):
        rise = wall * np.sin(np.radians(degrees))
        exact = force * (wall * rise**2 / 3 + rise**2 * floor) / rigidity
        found = case.run("mitred_sheets", degrees=degrees).probes["tip"]["displacement"][-1, 0]
        case.error(f"sheets at {degrees} degrees, deflection [mm]", found, exact, 0.01)
    exact = force * (wall**2 * floor / 8 + wall**3 / 3) / rigidity
    found = case.run("three_sheets").probes["tip"]["displacement"][-1, 0]
    case.error("three sheets at a line, deflection [mm]", found, exact, 0.01)


def main():
    case = Case("Joints of shells: disk of five patches, strip in its plastic range,"
                " sheets at angles", "Leissa (1969); the strip without a joint; beams")
    lines = []
    for support in LAMBDA:
        meshes = (2, 4, 6) if case.is_long else (2, 4)
        found = np.array([case.modes("disk_modes", 2, n=n, support=support) for n in meshes])
        errors = found[:, 0] / exact(support) - 1
        case.deviation(f"disk, {support}, lowest frequency, {meshes[-1]} elements along an eighth",
                       errors[-1], 0.02 * (4 / meshes[-1]))
        case.rate(f"disk, {support}, rate", [RADIUS / n for n in meshes], errors, 0.9)
        if support == "ENCASTRE":
            case.error("disk, ENCASTRE, second frequency over the first",
                       found[-1, 1] / found[-1, 0], RATIO, 0.02)
        quarter = case.modes("quarter_disk", 1, n=meshes[-1], support=support)[0]
        case.error(f"quarter of a disk, {support}, lowest frequency over that of the whole",
                   quarter, found[-1, 0], 1e-6)
        lines.append((support, "o-", meshes, np.abs(errors)))
    hinged = case.modes("disk_modes", 1, n=4, joints="HINGED")[0]
    case.between("disk, ENCASTRE, hinged seams: frequency over that of the plate",
                 hinged / exact("ENCASTRE"), 0, 0.9)
    for load in (0.1, 0.32):
        case.error(f"strip, pressure {load} MPa, deflection [mm]", sag(case, load=load),
                   sag(case, load=load, knot=0.3), 0.01)
    frames(case)
    case.panel("elements along an eighth of the circle", "error of the frequency", lines, "log")
    case.finish()


main()
