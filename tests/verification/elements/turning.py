"""Tools that turn: a block on a turntable follows its angle, and rolls without friction form the
same strip whether or not they turn.
"""
import numpy as np
from suite import Case

ANGLE = 30.0
LENGTH, WIDTH, HEIGHT, DENSITY, G = 12, 8, 3, 7.85e-9, 1e7
MASS = DENSITY * LENGTH * WIDTH * HEIGHT


def torques(case, run):
    """Torque of a block that the table takes along, and of one that slides on it."""
    time, torque = run.tools["table"]["time"], run.tools["table"]["torque"]
    spin = run.history["angular_momentum"][:, 2]
    impulse = np.append(0, np.cumsum(0.5 * (torque[1:, 2] + torque[:-1, 2]) * np.diff(time)))
    case.deviation("impulse of the torque and angular momentum of the block",
                   np.abs(impulse + spin).max() / spin.max(), 1e-4)
    slides = case.run("turntable", angle=ANGLE, friction=0.05)
    x, y = np.meshgrid((np.arange(400) + 0.5) / 400 * LENGTH - LENGTH / 2,
                       (np.arange(400) + 0.5) / 400 * WIDTH - WIDTH / 2)
    at = slice(np.searchsorted(time, 8e-4), np.searchsorted(time, 1.4e-3))
    torque = slides.tools["table"]["torque"][at, 2].mean()
    case.error("torque of sliding under even pressure [N mm]", torque,
               -0.05 * MASS * G * np.hypot(x, y).mean(), 2e-2)


def follow(case, run, name, limit=1e-6):
    """The angle of what the table takes along, and what that costs."""
    end, middle = (run.probes[probe]["displacement"] for probe in ("end", "middle"))
    arm = end[:, :2] - middle[:, :2] + [6, 0]
    angle = np.degrees(np.unwrap(np.arctan2(arm[:, 1], arm[:, 0])))
    case.error(f"angle of the {name} [degrees]", angle[-1], ANGLE, 1e-6)
    case.deviation(f"energy balance, turntable, {name}",
                   np.abs(run.history["energy_error"]).max(), limit)
    case.deviation(f"work of friction over kinetic energy, {name}",
                   run.history["friction_energy"][-1] / run.history["kinetic_energy"].max(), 1e-6)
    return angle


def main():
    case = Case("Tools that turn", "rigid rotation; symmetry of a roll")
    shell = case.run("turntable", angle=ANGLE, element="SHELL")
    follow(case, shell, "shell", limit=5e-6)
    run = case.run("turntable", angle=ANGLE)
    angle = follow(case, run, "block")
    table = run.tools["table"]["displacement"]
    case.deviation("way of the table's axis [mm]", np.abs(table).max(), 1e-12)

    torques(case, run)
    still = case.run("rolls", spin=0)
    for spin, limit in ((3e4, 1e-4), (3e5, 2e-3)):
        turning = case.run("rolls", spin=spin)
        case.deviation(f"strip between rolls at {spin:g} degrees/s [mm]",
                       np.abs(turning.net - still.net).max(), limit)
    drawn = case.run("rolls", spin=3e4, friction=0.2)
    case.deviation("energy balance, rolls with friction",
                   np.abs(drawn.history["energy_error"]).max(), 1e-3)
    case.between("friction moves the strip [mm]", np.abs(drawn.net - still.net).max(), 1e-2, 1)
    case.panel("time [ms]", "angle [degrees]", [("block", "-", 1e3 * run.time(), angle)])
    case.finish()


main()
