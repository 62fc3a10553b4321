"""Least squares with the uncertainty of what they find."""
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from post.results import ResultsError

ENOUGH = 1e-12       # half of the sum of the squares of weighted errors: no more starts
NEAR = 1e-5          # of the size of a constant where the search began: as near to its bound it is


@dataclass
class Fit:
    constants: np.ndarray
    deviations: np.ndarray     # standard deviations of the constants; NaN where they are not fixed
    at_bound: np.ndarray       # whether the data ask for constants beyond what the law takes
    misfit: float              # root of the mean square of the weighted errors
    errors: np.ndarray         # of the data, weighted


def fit(errors, starts, low=-np.inf, high=np.inf, names=()):
    """The best of the fits from several starts. `errors` are differences over their uncertainties,
    which also scale the deviations; a misfit above one counts as larger uncertainties."""
    best = None
    low, high = (np.broadcast_to(end, np.shape(starts[0])) for end in (low, high))
    for start in starts:
        try:
            found = least_squares(errors, np.array(start, float), bounds=(low, high), xtol=1e-14,
                                  ftol=1e-14, gtol=1e-14, x_scale="jac", max_nfev=2000)
        except ValueError:            # not finite there
            continue
        # Of fits that are as good the first one counts, the nearest to the first start as a rule.
        if best is None or found.cost < best.cost * (1 - 1e-6) - ENOUGH:
            best = found
        if best.cost <= ENOUGH:
            break
    if best is None:
        raise ResultsError(f"no constants {', '.join(names)} were found: the errors are not finite")
    constants, at_bound = on_bounds(errors, best, low, high, NEAR * np.abs(starts).max(axis=0))
    n, m = best.jac.shape
    misfit = np.sqrt(2 * best.cost / n)
    scale = max(1.0, np.sqrt(2 * best.cost / (n - m))) if n > m else 1.0
    _, values, rows = np.linalg.svd(np.where(at_bound, 0, best.jac), full_matrices=False)
    is_fixed = values > 1e-6 * values.max()
    # A constant with a part in a direction that no datum feels is not fixed by them.
    loose = np.linalg.norm(rows[~is_fixed], axis=0) if np.any(~is_fixed) else np.zeros(m)
    inverse = np.where(is_fixed, 1 / np.where(is_fixed, values, 1), 0)
    deviations = scale * np.linalg.norm(rows * inverse[:, None], axis=0)
    deviations[(loose > 1e-6) | at_bound] = np.nan
    return Fit(constants, deviations, at_bound, misfit, best.fun)


def on_bounds(errors, best, low, high, near):
    """The constants with those that only the search kept off a bound put on it, and which they are:
    the errors do not grow by it."""
    constants, at_bound = best.x.copy(), np.zeros(len(best.x), bool)
    for k, value in enumerate(best.x):
        for bound in (low[k], high[k]):
            if abs(value - bound) > near[k]:
                continue
            trial = constants.copy()
            trial[k] = bound
            with np.errstate(all="ignore"):
                cost = 0.5 * np.sum(errors(trial) ** 2)
            if cost <= best.cost * (1 + 1e-6) + ENOUGH:
                constants, at_bound[k] = trial, True
    return constants, at_bound
