"""Criteria that several scenes share: numbers worked out from a run."""
import numpy as np
from splines import volume
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


def penetration(run, thickness, limit):
    return Mark("penetration over thickness", run.history["max_penetration"].max() / thickness,
                limit)


def impulse(run, limit):
    """Change of momentum of a blank that nothing but tools acts on against the impulse of their
    forces, which is exact where each step is a row of the history."""
    h = run.history
    force = sum(tool["force"] for tool in run.tools.values())
    given = np.cumsum(force[1:] * np.diff(h["time"])[:, None], axis=0)
    lost = h["momentum"][1:] - h["momentum"][0] + given
    steps_of_a_row = np.ptp(h["step"]) / (len(h["step"]) - 1)
    return [Mark("steps of a row of the history less 1", steps_of_a_row - 1, 1e-12),
            Mark("momentum against the impulse of the tools",
                 np.abs(lost).max() / np.abs(h["momentum"]).max(), limit)]


def volume_change(run, limit):
    """Of a box of one patch without weights, from the start to the end."""
    before = np.prod(np.ptp(run.blank_start, axis=0))
    return Mark("change of volume", abs(volume(run.splines, run.net) / before - 1), limit)


def finite(run):
    """Nothing in the results may be other than a number."""
    bad = sum((~np.isfinite(values)).sum() for values in
              [*run.history.values(), *run.at_points.values(), run.points])
    return Mark("NaN or infinite values", float(bad), 0.5)


def stopped(run):
    """A run that must end with a reason: exit code and words of the message are checked before.
    All frames and rows but those of the failure hold numbers; there is a state to go on from."""
    missing = not any(".ckpt" in file for file in run.files())
    return [finite_before(run), Mark("missing states to go on from", float(missing), 0.5)]


def finite_before(run):
    bad = sum((~np.isfinite(values[:-1])).sum() for values in [*run.history.values(), run.frames])
    return Mark("NaN or infinite values before", float(bad), 0.5)


def stopped_at_once(run):
    """It failed in its first step: no state is worth going on from."""
    return [finite_before(run), Mark("steps", run.history["step"][-1], 0.5)]


def refused(run):
    """Refused input leaves nothing behind."""
    return [Mark("files left behind", float(len(run.files())), 0.5)]
