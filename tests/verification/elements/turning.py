"""Tools that turn: a block on a turntable follows its angle, and rolls without friction form the
same strip whether or not they turn.
"""
import numpy as np
from suite import Case

ANGLE = 30.0


def main():
    case = Case("Tools that turn", "rigid rotation; symmetry of a roll")
    run = case.run("turntable", angle=ANGLE)
    end, middle = (run.probes[name]["displacement"] for name in ("end", "middle"))
    arm = end[:, :2] - middle[:, :2] + [6, 0]
    angle = np.degrees(np.unwrap(np.arctan2(arm[:, 1], arm[:, 0])))
    case.error("angle of the block [degrees]", angle[-1], ANGLE, 1e-6)
    case.deviation("energy balance, turntable", np.abs(run.history["energy_error"]).max(), 1e-6)
    case.deviation("work of friction over kinetic energy",
                   run.history["friction_energy"][-1] / run.history["kinetic_energy"].max(), 1e-6)
    table = run.tools["table"]["displacement"]
    case.deviation("way of the table's axis [mm]", np.abs(table).max(), 1e-12)

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
