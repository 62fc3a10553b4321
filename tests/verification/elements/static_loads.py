"""Static steps under loads and in contact.

A cantilever far beyond small deflections is compared with the elastica, which is integrated here; a
strip bent over round tools with the same strip bent slowly in an explicit step; a sheet that falls
on a die, is closed in, stretched and released with what its forces and energies must add up to.
"""
import numpy as np
from static_runs import iterations, same_bits
from suite import Case

WEIGHT = 7.85e-9 * 9810 * 40 * 20   # of the sheet that falls [N]


def elastica(load, n=200):
    """Shortening and deflection of the end over the length, for P L^2/(E I): theta'' = -P cos theta
    from the clamp on, by Runge-Kutta steps; the slope at the clamp by bisection."""
    def end(slope):
        state, h = np.array([0.0, slope, 0.0, 0.0]), 1 / n

        def rates(s):
            return np.array([s[1], -load * np.cos(s[0]), np.cos(s[0]), np.sin(s[0])])

        for _ in range(n):
            a = rates(state)
            b = rates(state + h / 2 * a)
            c = rates(state + h / 2 * b)
            state = state + h / 6 * (a + 2 * b + 2 * c + rates(state + h * c))
        return state

    low, high = 0.0, load
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if end(middle)[1] < 0 else (low, middle)
    final = end(low)
    return 1 - final[2], final[3]


def cantilever(case):
    """Deflections of the order of the length. Those of a shell do not depend on the increments; the
    strains of solids are summed up along them."""
    for load, element, first, limit in ((1, "SHELL", 0.5, 5e-4), (5, "SHELL", 0.5, 5e-4),
                                        (5, "SHELL", 0.1, 5e-4), (5, "SOLID", 0.1, 3e-3)):
        shortening, deflection = elastica(load)
        way = case.run("elastica", element=element, load=load,
                       first=first).probes["end"]["displacement"][-1] / 100
        at = f"elastica, P L^2 = {load} E I, {element}, first increment {first}"
        case.error(f"{at}: deflection", way[2], deflection, limit)
        case.error(f"{at}: shortening", -way[0], shortening, limit)


def bending(case):
    """The punch force where the explicit one no longer swings, and the shape released."""
    for element in ("SOLID", "SHELL"):
        shapes, forces, energies = [], [], []
        for mode, period in (("static", 1), ("explicit", 12e-3)):
            run = case.run("static_bend", element=element, mode=mode, period=period)
            bent = run.history["process_step"] == 1
            # in an explicit run the force swings about its mean while the strip is bent
            forces.append(run.tools["punch"]["force"][bent, 2][10:16].mean())
            energies.append(run.history["plastic_work"][-1])
            shapes.append(run.blank)
            case.deviation(f"energy balance, {element}, {mode}",
                           run.history["energy_error"][-1], 5e-4)
            if mode == "static":
                case.between(f"bent, {element}: iterations of an increment, in the mean",
                             iterations(case, "static_bend").mean(), 4, 18)
        case.error(f"bent, {element}: punch force against the explicit one", *forces, 0.03)
        case.error(f"bent, {element}: plastic work against the explicit one", *energies, 0.02)
        case.deviation(f"bent, {element}: shape released, over the stroke",
                       np.abs(shapes[0] - shapes[1]).max() / 12, 0.03)


def chain(case):
    """Gravity, a holder with a force, stretching, springback, in one deck."""
    for element in ("SOLID", "SHELL"):
        run = case.run("press_chain", element=element)
        step = run.history["process_step"]
        die, holder = (run.tools[name]["force"][:, 2] for name in ("die", "holder"))
        last = [np.flatnonzero(step == k)[-1] for k in (1, 2, 3, 4)]
        case.error(f"{element}: weight on the die", -die[last[0]], WEIGHT, 1e-5)
        case.error(f"{element}: force of the holder", holder[last[1]], 8000, 1e-6)
        case.error(f"{element}: holder and weight on the die", -die[last[1]], 8000 + WEIGHT, 1e-6)
        case.error(f"{element}: holder after the stretching", holder[last[2]], 8000, 2e-3)
        energy = run.history["energy_error"][last]
        for name, error, limit in zip(("gravity", "holder", "stretching", "springback"), energy,
                                      (1e-6, 1e-6, 1e-4, 5e-4)):
            case.deviation(f"{element}: energy balance after {name}", error, limit)
        elastic = run.history["internal_energy"][last[3]] - run.history["plastic_work"][last[3]]
        case.deviation(f"{element}: elastic energy left over plastic work",
                       elastic / run.history["plastic_work"][last[3]], 1e-3)


def hold(case):
    """A sheet that a force presses stays as it is from step to step, static and explicit."""
    for element in ("SOLID", "SHELL"):
        run = case.run("pressed_hold", element=element)
        step = run.history["process_step"]
        last = [np.flatnonzero(step == k)[-1] for k in (1, 2, 3, 4)]
        place = run.probes["end"]["displacement"][last]
        case.between(f"{element}: pressed by [mm]", -place[0, 2], 0.003, 0.03)
        case.deviation(f"{element} held: change of place over that",
                       np.abs(place[1:] - place[0]).max() / -place[0, 2], 1e-4)
        kinetic = np.abs(run.history["kinetic_energy"][step > 1]).max()
        case.deviation(f"{element} held: kinetic energy over that in the contact",
                       kinetic / run.history["contact_energy"][-1], 1e-12)
        case.deviation(f"{element} held: error of energy", run.history["energy_error"][-1], 1e-8)


def main():
    case = Case("Static steps under loads and in contact",
                "elastica; the explicit step; equilibrium of forces")
    cantilever(case)
    bending(case)
    chain(case)
    hold(case)
    same_bits(case, "static_bend", 6, 23, stroke=4)
    case.finish()


if __name__ == "__main__":
    main()
