"""Flow curves of *PLASTIC."""
from dataclasses import dataclass

import numpy as np


def voce(p, e):
    return p[0] + p[1] * (1 - np.exp(-p[2] * e))


def swift(p, e):
    return p[0] * (p[1] + e) ** p[2]


def ludwik(p, e):
    return p[0] + p[1] * e ** p[2]


def hockett_sherby(p, e):
    return p[1] - (p[1] - p[0]) * np.exp(-p[2] * e ** p[3])


@dataclass(frozen=True)
class Curve:
    name: str            # value of HARDENING of *PLASTIC
    value: object        # function of constants and plastic strain
    constants: tuple     # their names, in the order of the data line
    start: object        # function of strains and stresses: where the search begins
    low: tuple           # least constants
    high: tuple          # and largest ones, as *PLASTIC takes them


def voce_start(e, s):
    return [s[0], max(s[-1] - s[0], 1e-3 * s[-1]), 3 / max(e[-1], 1e-6)]


def swift_start(e, s):
    return [s[-1] / max(e[-1], 1e-6) ** 0.2, 0.01, 0.2]


CURVES = {one.name: one for one in (
    Curve("VOCE", voce, ("sigma_0", "Q", "b"), voce_start, (1e-9, 0, 0), (np.inf,) * 3),
    Curve("SWIFT", swift, ("K", "eps_0", "n"), swift_start, (1e-9, 1e-9, 0),
          (np.inf, np.inf, 1)),
    Curve("LUDWIK", ludwik, ("sigma_0", "K", "n"),
          lambda e, s: [0.9 * s[0], s[-1] - 0.9 * s[0], 0.5], (1e-9, 0, 1e-3),
          (np.inf, np.inf, 1)),
    Curve("HOCKETT SHERBY", hockett_sherby, ("sigma_0", "sigma_s", "m", "n"),
          lambda e, s: [s[0], 1.1 * s[-1], 3 / max(e[-1], 1e-6) ** 0.8, 0.8],
          (1e-9, 1e-9, 0, 1e-3), (np.inf, np.inf, np.inf, 1)))}
