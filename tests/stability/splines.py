"""Volume of a trivariate spline, from its net alone."""
import numpy as np


def basis(degree, knots, places):
    """Values of all B-splines of a degree at places (rows), by the recursion of Cox and de Boor."""
    u = np.asarray(places)[:, None]
    values = ((knots[:-1] <= u) & (u < knots[1:])).astype(float)
    for d in range(1, degree + 1):
        rising = (u - knots[:-d - 1]) * over(knots[d:-1] - knots[:-d - 1])
        falling = (knots[d + 1:] - u) * over(knots[d + 1:] - knots[1:-d])
        values = rising * values[:, :-1] + falling * values[:, 1:]
    return values


def slopes(degree, knots, places):
    """Their derivatives."""
    lower = degree * basis(degree - 1, knots, places) * over(knots[degree:] - knots[:-degree])
    return lower[:, :-1] - lower[:, 1:]


def over(lengths):
    """1/length, 0 for a length of 0."""
    return np.divide(1.0, lengths, out=np.zeros_like(lengths), where=lengths > 0)


def gauss_rule(degree, knots):
    """Places and weights that integrate the determinant of the jacobian exactly."""
    place, weight = np.polynomial.legendre.leggauss(2 * degree)
    ends = np.unique(knots)
    half = np.diff(ends)[:, None] / 2
    return (ends[:-1, None] + half * (1 + place)).ravel(), (half * weight).ravel()


def volume(splines, net):
    """Of a net (zeta, eta, xi, 3) without weights; splines: degree, knots along xi, eta, zeta."""
    rules = [gauss_rule(*spline) for spline in splines]
    values = [basis(*spline, rule[0]) for spline, rule in zip(splines, rules)]
    along = [slopes(*spline, rule[0]) for spline, rule in zip(splines, rules)]
    columns = [np.einsum("ai,bj,ck,kjid->abcd", *(along[j] if i == j else values[j]
                                                  for j in range(3)), net) for i in range(3)]
    weights = np.einsum("a,b,c->abc", *(rule[1] for rule in rules))
    return np.abs(np.linalg.det(np.stack(columns, axis=-1)) * weights).sum()
