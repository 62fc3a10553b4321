"""Laws for cyclic tests: stress along a path of plastic strains with turning points."""
import math
from dataclasses import dataclass

import numpy as np
from scipy.special import lambertw

from post.fit.hardening import voce


def back_stresses(p, strain):
    """Stress along a path of plastic strains with turning points, by Voce and back stresses
    of Armstrong and Frederick: p = sigma_0, Q, b, then C and gamma of each. Exact where the path
    goes on in one direction."""
    c, gamma = np.array(p[3::2]), np.array(p[4::2])
    eqps, back = 0.0, np.zeros(len(c))
    stress = np.empty(len(strain))
    way = 1.0
    for i, step in enumerate(np.diff(strain, prepend=0.0)):
        way = np.sign(step) if step else way
        fade = np.exp(-gamma * abs(step))
        back = back * fade + way * c * np.where(gamma > 1e-9, (1 - fade) / np.maximum(gamma, 1e-9),
                                                abs(step))
        eqps += abs(step)
        stress[i] = back.sum() + way * voce(p, eqps)
    return stress


def two_surfaces(p, strain):
    """The same by F. Yoshida and T. Uemori, Int. J. Plasticity 18 (2002), 661-686, in tension and
    compression: p = Y, B - Y, C, m, b, h, R_sat. From one strain to the next all parts are in
    closed form, with R in the size of the gap taken at the middle."""
    size, spare, rate, m, b, h, r_sat = p
    theta = beta = r = centre = radius = 0.0
    stress = np.empty(len(strain))
    way = 1.0
    for i, step in enumerate(np.diff(strain, prepend=0.0)):
        way = math.copysign(1.0, step) if step else way
        step = abs(step)
        before = beta
        beta = way * b + (beta - way * b) * math.exp(-m * step)
        excess = way * (beta - centre) - radius
        grown = r
        if excess >= 0:        # it left the region of stagnation within the step, at `leaves`
            leaves = max(way * before, way * centre + radius)
            left, gone = b - way * before, b - leaves
            inside = math.log(left / gone) / m if 0 < gone < left and m > 0 else 0.0
            r = r_sat + (r - r_sat) * math.exp(-m * max(step - inside, 0.0))
            radius += h * excess
            centre += way * (1 - h) * excess
        gap = max(spare + 0.5 * (grown + r), 1e-9 * size)
        theta = way * approached(way * theta, gap, rate * step)
        stress[i] = way * size + theta + beta
    return stress


def approached(theta, gap, amount):
    """Where dtheta/dx = gap - sqrt(gap abs(theta)) sign(theta) leads from x = 0 to `amount`. With
    y = 1 - sign(theta) sqrt(abs(theta)/gap) half of x is what ln y - y rises by up to -1, where
    theta is 0, and falls by from there on."""
    y = max(1 - math.copysign(math.sqrt(abs(theta) / gap), theta), 1e-12)
    level = math.log(y) - y
    rise = -1 - level if y > 1 else 0.0
    if 0.5 * amount < rise:
        y = root(level + 0.5 * amount, -1)
    else:
        y = root((-1 if y > 1 else level) - (0.5 * amount - rise), 0)
    return gap * (1 - y) * abs(1 - y)


def root(level, branch):
    """y with ln y - y = level: above 1 on the branch -1, below it on the branch 0."""
    return -lambertw(-math.exp(min(level, -1 - 1e-12)), branch).real


@dataclass(frozen=True)
class CyclicLaw:
    stress: object       # function of constants and plastic strains
    constants: object    # function of the number of back stresses: names
    starts: object       # function of the largest stress and that number: where to begin
    high: object         # largest constants; the least are 0, but for the first
    lines: object        # function of constants: those of the deck


def voce_starts(largest, n_back):
    fast = [30 * 10 ** k for k in range(n_back)]
    return [[share * largest, 0.2 * largest, b,
             *[x for g in fast for x in (0.3 * largest * g / n_back, g)]]
            for share in (0.3, 0.6) for b in (2.0, 20.0)]


def voce_lines(p):
    lines = ["*PLASTIC, HARDENING=VOCE", row(p[:3])]
    back = [row(pair) for pair in p[3:].reshape(-1, 2) if pair[0] > 0]
    return "\n".join(lines + (["*BACK STRESS", *back] if back else []))


def row(values):
    return ", ".join(f"{value:.6g}" for value in values)


LAWS = {
    "VOCE": CyclicLaw(
        back_stresses,
        lambda n: ["sigma_0", "Q", "b",
                   *[f"{c}_{k + 1}" for k in range(n) for c in ("C", "gamma")]],
        voce_starts, np.inf, voce_lines),
    "YOSHIDA UEMORI": CyclicLaw(
        two_surfaces, lambda _: ["Y", "B - Y", "C", "m", "b", "h", "R_sat"],
        lambda largest, _: [[0.35 * largest, 0.15 * largest, c, m, 0.1 * largest, 0.4,
                             0.3 * largest]
                            for c, m in ((200.0, 10.0), (600.0, 20.0), (100.0, 5.0))],
        [np.inf, np.inf, np.inf, np.inf, np.inf, 1.0, np.inf],
        lambda p: f"*PLASTIC, HARDENING=YOSHIDA UEMORI\n{row([p[0], p[0] + p[1], *p[2:]])}")}
