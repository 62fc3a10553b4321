"""Damped bending of a shell, a strip on two supports, against a plate with a viscous moment.

With the moment eta against the rate of the curvature, eta = b rho c L^2 h^2/12 of the elements of
length L, and the stiffness D, a wave of the angular frequency w dies out as exp(-g t) with g = eta
w^2/(2 D). The lowest wave has w = (pi/l)^2 sqrt(D/(rho h)); higher ones die out at once.
"""
import numpy as np
from suite import Case

LENGTH, THICKNESS, DENSITY, E, NU = 40.0, 1.0, 7.85e-9, 210000.0, 0.3
STIFFNESS = E * THICKNESS**3 / 12 / (1 - NU**2)
OMEGA = (np.pi / LENGTH)**2 * np.sqrt(STIFFNESS / (DENSITY * THICKNESS))
SPEED = np.sqrt(E * (1 - NU) / (1 + NU) / (1 - 2 * NU) / DENSITY)     # of pressure waves


def decay(n, factor, omega):
    """Rate at which a wave of an angular frequency dies out [1/s]."""
    eta = factor * DENSITY * SPEED * (LENGTH / n)**2 * THICKNESS**2 / 12
    return eta * omega**2 / (2 * STIFFNESS)


def measured(run):
    """Angular frequency and rate of decay of the middle, without its first two periods."""
    t, z = run.time(), run.probes["middle"]["displacement"][:, 2]
    later = t > 4 * np.pi / OMEGA
    t, z = t[later], z[later]
    is_peak = np.flatnonzero((np.abs(z[1:-1]) >= np.abs(z[:-2]))
                             & (np.abs(z[1:-1]) > np.abs(z[2:]))) + 1
    is_peak = is_peak[np.abs(z[is_peak]) > 0.02 * np.abs(z).max()]
    times, heights = t[is_peak], np.log(np.abs(z[is_peak]))
    return np.pi / np.mean(np.diff(times)), -np.polyfit(times, heights, 1)[0]


def main():
    case = Case("Damped bending of a strip, shell", "Kirchhoff's plate with a viscous moment")
    traces = []
    for n, factor in ((4, 0.5), (8, 0.5), (4, 0.1)):
        run = case.run("bending_wave", n=n, bending=factor)
        omega, rate = measured(run)
        name = f"{n} elements, factor {factor}"
        case.error(f"frequency [1/s], {name}", omega, OMEGA, 0.04)
        case.error(f"decay [1/s], {name}", rate, decay(n, factor, omega), 0.02)
        case.deviation(f"energy error, {name}", run.history["energy_error"].max(), 2e-3)
        case.error(f"viscous energy over what the motion has lost, {name}",
                   run.history["viscous_energy"][-1],
                   run.history["kinetic_energy"][0] - run.history["kinetic_energy"][-1]
                   - run.history["internal_energy"][-1], 0.01)
        traces.append((name, "-", 1e3 * run.time(), run.probes["middle"]["displacement"][:, 2]))
    free = case.run("bending_wave", n=4, bending=0)
    case.deviation("largest change of the energy without viscosity",
                   np.ptp(free.history["kinetic_energy"] + free.history["internal_energy"])
                   / free.history["kinetic_energy"][0], 2e-3)
    case.panel("time [ms]", "deflection [mm]", traces)
    case.finish()


main()
