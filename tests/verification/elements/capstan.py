"""A belt that slides over a quarter of a cylinder: the forces at its ends have the ratio
exp(mu pi/2) (L. Euler; J. A. Eytelwein). The two forces are the components of the tool's force.
"""
import numpy as np
from suite import Case

RISE = 3.0e-3


def main():
    case = Case("Belt over a quarter of a cylinder", "exp(mu pi/2)")
    lines = []
    for friction in (0.1, 0.3) if case.is_long else (0.3,):
        run = case.run("capstan", friction=friction)
        force = -run.tools["drum"]["force"]
        late = run.time() > 1.1 * RISE
        top, side = force[late, 0].mean(), force[late, 1].mean()
        case.error(f"force at the top [N], friction {friction}", top, 1.0, 0.003)
        case.error(f"ratio of the forces, friction {friction}", side / top,
                   np.exp(friction * np.pi / 2), 0.003)
        case.deviation(f"energy balance, friction {friction}",
                       np.abs(run.history["energy_error"][late]).max(), 1e-5)
        lines.append((f"friction {friction}", "-", 1e3 * run.time(), force[:, 1] / top))
        lines.append(("", "k--", [0, 6], [np.exp(friction * np.pi / 2)] * 2))
    run = case.run("belt")
    late, force = run.time() > 2.4e-3, -run.tools["drum"]["force"]
    # the forces act at the mid-surface, the friction on the drum
    exact = np.exp(0.3 * np.pi / 2 * 50 / 50.25)
    case.error("ratio of the forces, shell, friction 0.3",
               force[late, 1].sum() / force[late, 0].sum(), exact, 0.003)
    case.deviation("energy balance, shell", np.abs(run.history["energy_error"][late]).max(), 1e-5)
    case.panel("time [ms]", "force at the side over that at the top", lines)
    case.finish()


main()
