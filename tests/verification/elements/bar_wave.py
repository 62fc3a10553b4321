"""A pulse of stress in a bar against d'Alembert's solution with its image behind the free end.

A traction T(t) on the end x = 0 starts the wave v = f(t - x/c) with f = T/(rho c); at the free end
it returns with the same sign. Its energy is the work at the end, A/(rho c) times the integral of
T^2. Row-sum masses slow waves down by (p + 1)(k h)^2/24 (see bar_modes); the time step takes a part
of it back, (omega dt)^2/24.
"""
import numpy as np
from suite import Case

LENGTH, DENSITY, E, STRESS, RISE = 100.0, 7.85e-9, 210000.0, 100.0, 1.0e-5
SPEED = np.sqrt(E / DENSITY)


def pulse(t):
    """Traction of the deck, the smooth pulse between its corners."""
    corners = np.linspace(0, RISE, 33)
    values = STRESS * (1 - np.cos(2 * np.pi * corners / RISE)) / 2
    return np.interp(t, corners, values, left=0.0, right=0.0)


def velocity(x, t):
    """Velocity at x until the echo has come back to x = 0."""
    return (pulse(t - x / SPEED) + pulse(t - (2 * LENGTH - x) / SPEED)) / (DENSITY * SPEED)


def main():
    case = Case("Wave in a bar", "d'Alembert's solution with an image")
    lines, traces = [], []
    meshes = (40, 80, 160) if case.is_long else (40, 80)
    for p in (1, 2, 3, 4):
        errors = []
        for n in meshes:
            run = case.run("bar_wave", p=p, n_x=n)
            t, v = run.time(), run.probes["middle"]["velocity"][:, 0]
            exact = velocity(LENGTH / 2, t)
            errors.append(np.linalg.norm(v - exact) / np.linalg.norm(exact))
        lines.append((f"p = {p}", "o-", [LENGTH / n for n in meshes], errors))
        traces.append((f"p = {p}, {n} elements", "-", 1e6 * t, 1e-3 * v))
        case.deviation(f"velocity at the middle, rms, p = {p}, {n} elements", errors[-1],
                       0.012 * (p + 1) * (80 / n)**2)
        case.rate(f"rate, p = {p}", [1 / n for n in meshes], errors, 1.6)
        if p == 2:
            first = t < 1.1 * LENGTH / SPEED
            arrival = (t * v)[first].sum() / v[first].sum() - RISE / 2
            case.error("arrival at the middle [s], p = 2", arrival, LENGTH / 2 / SPEED, 0.003)
            end = run.probes["end"]["velocity"][:, 0].max()
            case.error("doubled velocity at the free end [mm/s], p = 2", end,
                       2 * STRESS / (DENSITY * SPEED), 0.01)
            fine = np.linspace(0, RISE, 3201)
            work = np.trapezoid(pulse(fine)**2, fine) / (DENSITY * SPEED)
            energy = run.history["kinetic_energy"] + run.history["internal_energy"]
            case.error("energy of the wave [mJ], p = 2", energy[-1], work, 0.01)
            case.deviation("largest change of the energy behind the pulse, p = 2",
                           np.ptp(energy[t > RISE]) / work, 0.002)
    traces.append(("d'Alembert", "k--", 1e6 * t, 1e-3 * exact))
    case.panel("time [microseconds]", "velocity at the middle [m/s]", traces)
    case.panel("element [mm]", "rms error of the velocity", lines, "log")
    case.finish()


main()
