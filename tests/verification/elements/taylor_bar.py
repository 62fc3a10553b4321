"""Taylor bar: copper, radius 3.2 mm, length 32.4 mm, 227 m/s against a wall without friction.

There is no closed form. After 80 microseconds the codes compared by Y. Y. Zhu and S. Cescotto
(IJNME 38 (1995) 1987-2015) and by G. T. Camacho and M. Ortiz (CMAME 142 (1997) 269-301) give final
lengths of 21.26 to 21.49 mm, radii of the foot of 6.97 to 7.24 mm and largest plastic strains of
2.47 to 3.25. The length may be 0.5 % outside of that. The plastic strain on the axis of the foot
grows with the mesh, beyond what their meshes give.
"""
import numpy as np
from suite import Case


def main():
    case = Case("Taylor bar, 227 m/s", "Zhu and Cescotto (1995); Camacho and Ortiz (1997)")
    n_x, n_r = (36, 3) if case.is_long else (20, 2)
    limit = 3.7 if case.is_long else 3.25
    run = case.run("taylor_bar", n_x=n_x, around=n_r, across=n_r)
    end = 32.4 + run.probes["end"]["displacement"][:, 0]
    rim = 3.2 + run.probes["rim"]["displacement"][:, 1]
    corner = np.linalg.norm(np.sqrt(0.5) * np.array([0, 3.2, 3.2])
                            + run.probes["corner"]["displacement"], axis=1)
    mesh = f"{n_x} x {3 * n_r * n_r} elements of a quarter"
    case.between(f"final length [mm], {mesh}", end[-1], 0.995 * 21.26, 1.005 * 21.49)
    case.between(f"radius of the foot [mm], {mesh}", rim[-1], 6.97, 7.24)
    case.between(f"largest plastic strain, {mesh}", run.at_points["eqps"].max(), 2.47, limit)
    case.deviation("roundness: radius at 45 degrees by that at 0", corner[-1] / rim[-1] - 1, 0.01)
    case.deviation("energy balance", np.abs(run.history["energy_error"]).max(), 0.005)
    on_side = np.isclose(run.start[:, 1], 3.2) & np.isclose(run.start[:, 2], 0)
    side = run.points[on_side][np.argsort(run.start[on_side, 0])]
    t = 1e6 * run.time()
    case.panel("radius [mm]", "x [mm]", [
        ("outline at 80 microseconds", "-", side[:, 1], side[:, 0]),
        ("at the start", "k--", [3.2, 3.2], [0, 32.4])])
    case.panel("time [microseconds]", "[mm]", [("length", "-", t, end),
                                               ("radius of the foot", "-", t, rim)])
    case.finish()


main()
