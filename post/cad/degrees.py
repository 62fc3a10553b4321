"""NURBS of a high degree as NURBS of degree 5 at most, within a tolerance.

Along each axis whose degree is too high the homogeneous control points are interpolated at the
Greville points of knots of degree 5 that keep every break of the curve; the knot spans are halved
until samples of the curve are met. Ends stay where they are, weights stay weights.
(Interpolation: C. de Boor, A Practical Guide to Splines, revised edition, Springer 2001, ch. XIII.)
"""
import numpy as np

from post.splines import basis

MOST_DEGREE = 5          # that the solver reads
MOST_HALVINGS = 7        # of a knot span
SAMPLES = 7              # in a knot span, to compare
AIM = 0.5                # of the tolerance at samples, for what lies between them
SAME = 1e-10             # of the range of knots


def lowered(degree, knots, points, error_of, tolerance):
    """Knots and points (first axis along the knots) of degree 5, and their largest error with its
    index: `error_of` tells it for points of both at samples. Fails if it exceeds the tolerance."""
    ends, continuities = breaks_of(degree, knots)
    for halvings in range(MOST_HALVINGS + 1):
        new_knots = knots_between(ends, continuities, 2**halvings)
        places = greville(new_knots, MOST_DEGREE)
        new_points = solve(basis(MOST_DEGREE, new_knots, places),
                           apply(basis(degree, knots, places), points))
        at = samples(new_knots)
        error, where = error_of(apply(basis(degree, knots, at), points),
                                apply(basis(MOST_DEGREE, new_knots, at), new_points))
        if error <= AIM * tolerance:
            break
    return new_knots, new_points, error, at[where]


def breaks_of(degree, knots):
    """The distinct knots and the continuity at each; knots that differ by round-off are one."""
    first = np.flatnonzero(np.diff(knots, prepend=-np.inf) > SAME * (knots[-1] - knots[0]))
    ends, counts = knots[first], np.diff(np.append(first, len(knots)))
    ends[-1] = knots[-1]
    return ends, degree - counts


def knots_between(ends, continuities, n_parts):
    """Open knots of degree 5 with n parts of each span and the breaks in between."""
    knots = [np.full(MOST_DEGREE + 1, ends[0])]
    for i, (low, high) in enumerate(zip(ends, ends[1:])):
        knots.append(low + (high - low) * np.arange(1, n_parts) / n_parts)
        if i < len(ends) - 2:
            knots.append(np.full(np.clip(MOST_DEGREE - continuities[i + 1], 1, MOST_DEGREE), high))
    return np.concatenate([*knots, np.full(MOST_DEGREE + 1, ends[-1])])


def greville(knots, degree):
    """The mean of as many inner knots of each basis function as the degree."""
    means = [knots[i + 1:i + degree + 1].mean() for i in range(len(knots) - degree - 1)]
    return np.clip(means, knots[0], knots[-1])


def samples(knots):
    ends = np.unique(knots)
    steps = np.arange(SAMPLES) / SAMPLES
    return np.append((ends[:-1, None] + steps * np.diff(ends)[:, None]).ravel(), ends[-1])


def apply(matrix, points):
    return np.tensordot(matrix, points, 1)


def solve(matrix, values):
    return np.linalg.solve(matrix, values.reshape(len(values), -1)).reshape(
        len(matrix), *values.shape[1:])


def homogeneous(points, weights):
    return np.concatenate([points * weights[..., None], weights[..., None]], axis=-1)


def plain(values):
    """Points and weights of homogeneous control points."""
    return values[..., :-1] / values[..., -1:], values[..., -1]


def largest_distance(one, other):
    """Between homogeneous points at samples along the first axis, and at which of them."""
    gaps = np.linalg.norm(plain(one)[0] - plain(other)[0], axis=-1)
    gaps = gaps.reshape(len(gaps), -1).max(axis=1)
    return float(gaps.max()), int(gaps.argmax())
