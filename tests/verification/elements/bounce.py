"""A block bounces askew: what it brings comes back or is told as friction or damping, and a block
that slides all through a flat bounce loses what Coulomb's law says.
"""
import numpy as np
from suite import Case

MASS = 7.85e-9 * 10 * 10 * 5
SPEED, MU = 1.0e5, 0.1     # much faster than the block vibrates, so no point sticks


def parts(run):
    """The energies at the end, as parts of what the block brought."""
    h = run.history
    names = ("kinetic", "internal", "contact", "friction", "damping")
    return {name: h[f"{name}_energy"][-1] / h["kinetic_energy"][0] for name in names}


def main():
    case = Case("Block that bounces askew", "conservation of energy, Coulomb's law")
    lines = []
    scenes = {"elastic": {}, "friction": {"friction": 0.2}, "friction 2": {"friction": 2},
              "damping": {"damping": 0.1}, "both": {"friction": 0.2, "damping": 0.1}}
    for name, options in scenes.items():
        run = case.run("bounce", **options)
        end, h = parts(run), run.history
        case.deviation(f"energy balance, {name}", np.abs(h["energy_error"]).max(), 1e-3)
        case.deviation(f"energy left in springs, {name}", end["contact"], 1e-12)
        case.between(f"most energy in springs, {name}",
                     h["contact_energy"].max() / h["kinetic_energy"][0], 0.2, 0.6)
        kept = end["kinetic"] + end["internal"]
        if name == "elastic":
            case.error("energy that comes back", kept, 1.0, 1e-3)
        for effect in ("friction", "damping"):
            if effect in options or name == "both":
                case.between(f"lost to {effect}, {name}", end[effect], 0.02, 0.7)
            elif name != "friction 2" or effect == "damping":
                case.deviation(f"lost to {effect}, {name}", end[effect], 0)
        lines.append((name, "-", 1e6 * run.time(),
                      (h["kinetic_energy"] + h["internal_energy"]) / h["kinetic_energy"][0]))
    run = case.run("bounce", slope_x=0, slope_y=0, along=SPEED, friction=MU, end_time=4e-5)
    change = run.history["momentum"][-1] - run.history["momentum"][0]
    case.error("momentum along the plane over that across it", -change[0] / change[2], MU, 5e-4)
    case.error("work of friction [mJ]", run.history["friction_energy"][-1],
               -change[0] * (SPEED + 0.5 * change[0] / MASS), 5e-3)
    case.panel("time [us]", "energy of the block over that at the start", lines)
    case.finish()


main()
