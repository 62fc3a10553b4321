"""Yield functions in plane stress, as functions of degree one of s11, s22, s12.

Derivatives are taken by complex steps, so powers of differences are written as powers of squares.
"""
from dataclasses import dataclass

import numpy as np

STEP = 1e-30


def power(difference, exponent):
    """abs(difference)**exponent, with derivatives by complex steps."""
    return (difference * difference + 1e-200) ** (0.5 * exponent)


def principal(a, b, c):
    """Principal values of [[a, c], [c, b]]."""
    mean, radius = 0.5 * (a + b), np.sqrt((0.5 * (a - b)) ** 2 + c * c + 1e-60)
    return mean + radius, mean - radius


def hill48(p, s, _):
    """Hill 1948 from r_0, r_45, r_90, scaled to tension along axis 1."""
    r0, r45, r90 = p
    g = 1 / (1 + r0)
    h, f = r0 * g, r0 * g / r90
    n = (f + g) * (r45 + 0.5)
    return np.sqrt(g * s[0] ** 2 + f * s[1] ** 2 + h * (s[0] - s[1]) ** 2 + 2 * n * s[2] ** 2)


def barlat89(p, s, m):
    """F. Barlat and J. Lian, Int. J. Plasticity 5 (1989), 51-66: a, h, p with c = 2 - a."""
    a, h, q = p
    k1 = 0.5 * (s[0] + h * s[1])
    k2 = np.sqrt((0.5 * (s[0] - h * s[1])) ** 2 + (q * s[2]) ** 2 + 1e-60)
    total = a * power(k1 + k2, m) + a * power(k1 - k2, m) + (2 - a) * power(2 * k2, m)
    return (0.5 * total) ** (1 / m)


def yld2000(p, s, m):
    """Yld2000-2d, F. Barlat et al., Int. J. Plasticity 19 (2003), 1297-1319: alpha_1 to alpha_8."""
    a1, a2, a3, a4, a5, a6, a7, a8 = p
    x1, x2 = principal((2 * a1 * s[0] - a1 * s[1]) / 3, (2 * a2 * s[1] - a2 * s[0]) / 3, a7 * s[2])
    l11 = (-2 * a3 + 2 * a4 + 8 * a5 - 2 * a6) / 9
    l12 = (a3 - 4 * a4 - 4 * a5 + 4 * a6) / 9
    l21 = (4 * a3 - 4 * a4 - 4 * a5 + a6) / 9
    l22 = (-2 * a3 + 8 * a4 + 2 * a5 - 2 * a6) / 9
    y1, y2 = principal(l11 * s[0] + l12 * s[1], l21 * s[0] + l22 * s[1], a8 * s[2])
    total = power(x1 - x2, m) + power(2 * y2 + y1, m) + power(2 * y1 + y2, m)
    return (0.5 * total) ** (1 / m)


def yld2004(p, s, m):
    """Yld2004-18p, F. Barlat et al., Int. J. Plasticity 21 (2005), 1009-1039, without the shears
    through the sheet: c12 c13 c21 c23 c31 c32 c66 of both transforms."""
    d1, d2 = (2 * s[0] - s[1]) / 3, (2 * s[1] - s[0]) / 3
    d3 = -(d1 + d2)
    values = []
    for c12, c13, c21, c23, c31, c32, c66 in (p[:7], p[7:]):
        pair = principal(-c12 * d2 - c13 * d3, -c21 * d1 - c23 * d3, c66 * s[2])
        values.append((*pair, -c31 * d1 - c32 * d2))
    total = sum(power(x - y, m) for x in values[0] for y in values[1])
    return (0.25 * total) ** (1 / m)


def bbc2005(p, s, m):
    """D. Banabic et al., Int. J. Plasticity 21 (2005), 493-512: a b L M N P Q R, m = 2 k."""
    a, b, l, em, n, q, u, r = p
    g = l * s[0] + em * s[1]
    h = np.sqrt((n * s[0] - q * s[1]) ** 2 + s[2] ** 2 + 1e-60)
    f = np.sqrt((u * s[0] - r * s[1]) ** 2 + s[2] ** 2 + 1e-60)
    total = a * (power(h + g, m) + power(h - g, m)) + b * (power(h + f, m) + power(h - f, m))
    return total ** (1 / m)


def yld91(p, s, m):
    """F. Barlat, D. J. Lege and J. C. Brem, Int. J. Plasticity 7 (1991), 693-712: c1 c2 c3 c6."""
    c1, c2, c3, c6 = p
    x, y = (c3 * (s[0] - s[1]) + c2 * s[0]) / 3, (c1 * s[1] - c3 * (s[0] - s[1])) / 3
    s1, s2 = principal(x, y, c6 * s[2])
    s3 = -(x + y)
    return (0.5 * (power(s1 - s2, m) + power(s2 - s3, m) + power(s3 - s1, m))) ** (1 / m)


@dataclass(frozen=True)
class YieldFunction:
    name: str            # value of TYPE of *POTENTIAL
    value: object        # function of constants, stress and exponent
    constants: tuple     # their names
    start: tuple         # those of an isotropic sheet
    has_exponent: bool = True
    limited: tuple = ()  # least and largest value of the first ones, as *POTENTIAL takes them
    is_even: bool = False    # of the exponent, which must be a whole number then

    @property
    def bounds(self):
        free = (-np.inf, np.inf)
        return list(self.limited) + [free] * (len(self.constants) - len(self.limited))

    def stress(self, p, m, angle):
        """Yield stress in tension at an angle [degrees]."""
        return 1 / self.value(p, tension(angle), m)

    def r_value(self, p, m, angle):
        """Plastic strain across over that through the sheet, in tension at an angle."""
        e = self.slopes(p, m, tension(angle))
        t = np.radians(angle)
        across = e[0] * np.sin(t) ** 2 + e[1] * np.cos(t) ** 2 - e[2] * np.sin(t) * np.cos(t)
        return -across / (e[0] + e[1])

    def biaxial(self, p, m):
        """Yield stress under equal stresses, and the plastic strain 22 over 11 there."""
        s = np.array([1.0, 1.0, 0.0])
        e = self.slopes(p, m, s)
        return 1 / self.value(p, s, m), e[1] / e[0]

    def slopes(self, p, m, s):
        """Derivatives by s11, s22, s12."""
        out = []
        for k in range(3):
            t = s.astype(complex)
            t[k] += 1j * STEP
            out.append(self.value(p, t, m).imag / STEP)
        return np.array(out)


def tension(angle):
    """Stress of tension at an angle [degrees] to axis 1."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return np.array([c * c, s * s, c * s])


TRANSFORM = ("c12", "c13", "c21", "c23", "c31", "c32", "c66")
FUNCTIONS = {one.name: one for one in (
    YieldFunction("HILL48", hill48, ("r_0", "r_45", "r_90"), (1, 1, 1), False,
                  ((1e-3, np.inf),) * 3),
    YieldFunction("BARLAT89", barlat89, ("a", "h", "p"), (1, 1, 1), True, ((1e-3, 1.999),), True),
    YieldFunction("YLD91", yld91, ("c1", "c2", "c3", "c6"), (1,) * 4),
    YieldFunction("YLD2000", yld2000, tuple(f"alpha_{k}" for k in range(1, 9)), (1,) * 8,
                  is_even=True),
    YieldFunction("BBC2005", bbc2005, ("a", "b", "L", "M", "N", "P", "Q", "R"), (0.5,) * 8,
                  True, ((1e-6, np.inf), (0, np.inf)), True),
    YieldFunction("YLD2004", yld2004, tuple(f"{c}'" for c in TRANSFORM)
                  + tuple(f"{c}''" for c in TRANSFORM), (1,) * 14))}


def data_line(function, p, m):
    """Data lines of *POTENTIAL."""
    p = [f"{value:.6g}" for value in p]
    if function.name == "YLD91":
        p = [*p[:3], "1", "1", p[3]]
    if function.name == "BARLAT89":
        p.insert(1, f"{2 - float(p[0]):.6g}")
    if function.name == "BBC2005":
        m = 0.5 * m
    if function.name == "YLD2004":
        lines = [", ".join([*part[:6], "1", "1", part[6]]) for part in (p[:7], p[7:])]
        return "\n".join([*lines, f"{m:g}"])
    return ", ".join(p + ([f"{m:g}"] if function.has_exponent else []))
