"""The modulus of unloading in tests with reversals, and the plastic strains that follow."""
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

ELASTIC = 0.5        # of the stress at a reversal: so much is unloaded elastically at first
LEAST_ROWS = 2       # that show a slope
LEAST_FALL = 0.03    # of the given modulus, and
N_DEVIATIONS = 3     # standard deviations of the mean slope: a fall by less is scatter
LARGEST_XI = 1e3     # the modulus has fallen after a plastic strain of 0.003
N_ROUNDS = 4         # plastic strains follow from moduli, and these are counted at plastic strains


@dataclass
class Unloading:
    """The modulus E - (E - E_a) (1 - exp(-xi p)) at the accumulated plastic strain p, as
    *UNLOADING MODULUS has it, and the slopes that show it."""
    young: float
    e_a: float
    xi: float = 0.0
    n_reversals: int = 0
    strains: list = field(default_factory=list)      # p at reversals where a slope can be seen
    slopes: list = field(default_factory=list)       # the slopes there

    @property
    def falls(self):
        return self.xi > 0

    def modulus(self, p):
        return self.young - (self.young - self.e_a) * (1 - np.exp(-self.xi * p))


def unloading_of(strain, stress, young, uncertainty):
    """The modulus from the unloading in a test, by its whole strains. It is the given
    one where the slopes agree with it within their scatter, and where none can be seen."""
    turns = reversals(strain, 0.5 * np.abs(stress).max() / young)
    rows, slopes, weights = [], [], []
    for turn, end in turns:
        unloaded = np.abs(stress[turn:end + 1] - stress[turn]) / max(abs(stress[turn]), 1e-300)
        # The peak lies between rows, so the row at the reversal is none of the slope.
        here = slice(turn + 1, turn + int(np.argmax(unloaded > ELASTIC)))
        if here.stop - here.start >= LEAST_ROWS:
            rows.append(turn)
            slopes.append(np.polyfit(strain[here], stress[here], 1)[0])
            weights.append(np.sum((strain[here] - strain[here].mean()) ** 2))
    found = Unloading(young, young, 0.0, len(turns), np.zeros(len(rows)), np.array(slopes))
    weights = np.array(weights)
    if not rows or np.average(slopes, weights=weights) > young - max(
            LEAST_FALL * young, N_DEVIATIONS * uncertainty / np.sqrt(weights.sum())):
        return found
    for _ in range(N_ROUNDS):
        plastic = plastic_strains(strain, stress, found.modulus)
        found.strains = np.cumsum(np.abs(np.diff(plastic, prepend=0.0)))[rows]

        def errors(constants):
            found.e_a, found.xi = constants
            return (found.modulus(found.strains) - slopes) * np.sqrt(weights) / uncertainty
        start = [np.clip(min(slopes), 0.01 * young, 0.99 * young),
                 min(1 / found.strains[0], 0.99 * LARGEST_XI)]
        found.e_a, found.xi = least_squares(errors, start, bounds=([0, 0], [young, LARGEST_XI]),
                                            x_scale=[young, 10]).x
    return found


def reversals(strain, least):
    """First and last rows of the way after each reversal by more than `least`."""
    turns, top, way = [0], 0, 0.0
    for i, value in enumerate(strain):
        if way == 0.0:
            way = np.sign(value - strain[0]) if abs(value - strain[0]) > least else 0.0
            top = i
        elif way * (value - strain[top]) >= 0:
            top = i
        elif way * (strain[top] - value) > least:
            turns.append(top)
            way, top = -way, i
    return list(zip(turns[1:], [*turns[2:], len(strain) - 1]))


def plastic_strains(strain, stress, modulus):
    """The whole strains less the elastic ones, with the modulus of the start of each step."""
    plastic = np.empty(len(strain))
    value = p = before = 0.0
    for i, (whole, force) in enumerate(zip(np.diff(strain, prepend=0.0), stress)):
        step = whole - (force - before) / modulus(p)
        value, p, before = value + step, p + abs(step), force
        plastic[i] = value
    return plastic
