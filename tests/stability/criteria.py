"""Criteria that several scenes share: numbers worked out from a run."""
import numpy as np
from stability import Mark


def energy_error(run, limit):
    """Largest error of the energy balance over the largest energy of the run. (The history has it
    over the energies of the moment, which may be next to nothing.)"""
    h = run.history
    scale = max((h["kinetic_energy"] + h["internal_energy"]).max(),
                np.abs(h["external_work"]).max(), h["kinetic_energy"][0])
    return Mark("energy error", np.abs(lack(run)).max() / scale, limit)


def lack(run):
    """Energy of all kinds less work and energy of the start."""
    h = run.history
    kinds = ("kinetic", "internal", "viscous", "contact", "friction", "damping")
    return (sum(h[f"{kind}_energy"] for kind in kinds) - h["external_work"]
            - h["kinetic_energy"][0])


def elastic_drift(run, limit):
    """Change of kinetic and stored elastic energy of an elastic body that nothing acts on, from
    its mean over the first quarter of the run to that over the last."""
    h = run.history
    total = h["kinetic_energy"] + h["internal_energy"] - h["plastic_work"]
    quarter = len(total) // 4
    return Mark("drift of kinetic and elastic energy",
                abs(total[-quarter:].mean() - total[:quarter].mean()) / total[0], limit)


def yield_excess(run, flow, limit):
    """Largest excess of von Mises' stress over the flow stress at any point."""
    s = run.at_points["stress"].reshape(-1, 6)
    mises = np.sqrt(0.5 * ((s[:, 0] - s[:, 1])**2 + (s[:, 1] - s[:, 2])**2
                           + (s[:, 2] - s[:, 0])**2) + 3 * (s[:, 3:]**2).sum(axis=1))
    return Mark("stress beyond the yield surface",
                max(0.0, (mises / flow(run.at_points["eqps"].ravel()) - 1).max()), limit)


def momentum_drift(run, limit, kind="momentum"):
    """Change of a momentum over its largest size, of a body that nothing acts on."""
    values = run.history[kind]
    size = np.linalg.norm(values, axis=1).max()
    name = "linear momentum" if kind == "momentum" else "angular momentum"
    return Mark(f"drift of the {name}", np.linalg.norm(values - values[0], axis=1).max() / size,
                limit)


def rest(run, limit):
    """Kinetic energy at the end over the largest ever."""
    kinetic = run.history["kinetic_energy"]
    return Mark("kinetic energy left", abs(kinetic[-1]) / kinetic.max(), limit)


def penetration(run, thickness, limit):
    return Mark("penetration over thickness", run.history["max_penetration"].max() / thickness,
                limit)


def finite(run):
    """Nothing in the results may be other than a number."""
    bad = sum((~np.isfinite(values)).sum() for values in
              [*run.history.values(), *run.at_points.values(), run.points])
    return Mark("values that are no numbers", float(bad), 0.5)
