"""A block on an incline with Coulomb friction against the closed form: it sticks below the angle
whose tangent is the coefficient of friction, and slides above with a = g (sin - mu cos).
"""
import numpy as np
from suite import Case

MU, G, MASS = 0.3, 1.0e6, 7.85e-9 * 20 * 20 * 10
RISE = 1.2e-3          # pressing and drawing are over
LIMIT = np.degrees(np.arctan(MU))


def main():
    case = Case("Block on an incline, friction 0.3", "rigid body, closed form")
    lines = []
    # The thickness of a shell changes without work of the pressure, so its balance is that of a
    # material that keeps it.
    shell = {"element": "SHELL", "poisson": 0}
    for slope, settings in ((0.95 * LIMIT, {}), (1.05 * LIMIT, {}), (30.0, {}),
                            (0.95 * LIMIT, shell), (30.0, shell)):
        run = case.run("friction_block", slope=slope, **settings)
        name = f"{slope:.1f} degrees" + (", shell" if settings else "")
        time, energy = run.time(), run.history["friction_energy"]
        way, speed = (run.probes["middle"][key][:, 0] for key in ("displacement", "velocity"))
        late = time > RISE + 0.25e-3
        angle = np.radians(slope)
        pressed = MU * G * np.cos(angle)
        exact = max(G * np.sin(angle) - pressed, 0.0)
        if exact > 0:
            # the block shears to and fro while it slides, so the slope of a line through the speed
            fit = np.polyfit(time[late], speed[late], 1)[0]
            case.error(f"acceleration at {name} [mm/s^2]", fit, exact, 0.005)
            loss = (energy[-1] - energy[late][0]) / (MASS * pressed)
            case.error(f"work of friction at {name}, as way [mm]", loss,
                       way[-1] - way[late][0], 0.02)
        else:
            # what is left is the spring of the penalty and the shear of the block
            case.between(f"way at {name} [mm]", way[-1], 0, 1.0e-3)
            drift = np.polyfit(time[late], way[late], 1)[0]
            case.between(f"speed at {name} [mm/s]", abs(drift), 0, 0.05)
        case.deviation(f"energy balance at {name}",
                       np.abs(run.history["energy_error"][late]).max(), 1e-5)
        lines.append((name, "-", 1e3 * time, way))
        lines.append(("", "k--", 1e3 * time[late], way[late][0] + speed[late][0]
                      * (time[late] - time[late][0]) + exact / 2 * (time[late] - time[late][0])**2))
    case.panel("time [ms]", "way down the slope [mm]", lines)
    case.finish()


main()
