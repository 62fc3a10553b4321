"""Necking of a round steel bar, radius 6.413 mm, half length 26.667 mm, ends clamped.

The largest load is that of Considere (1885) for the flow stress over the true strain,
450 + 129.24 e + 265 (1 - exp(-16.93 e)) MPa; the clamped ends lower it by 0.1 %. Beyond it there
is no closed form: load and neck at 6 mm are held to the finest meshes of docs/verification.md.
"""
import numpy as np
from suite import Case


def load_at(run, speed, way):
    """Load of the whole bar where its half is longer by `way`: slope of the work over the way."""
    time, work = run.time(), run.history["external_work"]
    ramp = 0.1 * 6 / speed
    moved = np.where(time < ramp, speed * time**2 / (2 * ramp), speed * (time - ramp / 2))
    near = np.abs(moved - way) < 0.15
    return 4 * np.polyfit(moved[near] - way, work[near], 2)[1]


def main():
    case = Case("Necking of a round bar", "Considere (1885); finer meshes")
    strain = np.linspace(0, 0.5, 50001)
    stress = 450 + 129.24 * strain + 265 * (1 - np.exp(-16.93 * strain))
    largest = np.pi * 6.413**2 * (stress * np.exp(-strain)).max()
    speed, n_x = (1000, 28) if case.is_long else (2000, 7)
    run = case.run("necking", n_x=n_x, speed=speed)
    loads = [load_at(run, speed, way) for way in np.linspace(2, 5.8, 39)]
    what = f"{n_x} elements along, {speed} mm/s"
    case.error(f"largest load [N], {what}", max(loads), largest, 0.005)
    case.deviation("energy balance", np.abs(run.history["energy_error"]).max(), 0.005)
    if case.is_long:
        case.error(f"load at 6 mm [N], {what}", load_at(run, speed, 6), 53700, 0.045)
        case.error(f"radius of the neck [mm], {what}",
                   6.413 + run.probes["neck"]["displacement"][-1, 1], 6.413 * 0.636, 0.03)
    else:
        case.between(f"load at 5.8 mm over the largest, {what}", loads[-1] / max(loads), 0.6, 0.85)
    case.panel("way of each end [mm]", "load [N]", [
        (what, "-", np.linspace(2, 5.8, 39), loads),
        ("largest load of Considere", "k--", [2, 5.8], [largest, largest])])
    case.finish()


main()
