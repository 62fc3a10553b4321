"""B-splines."""

import numpy as np


def basis(degree, knots, values):
    """All basis functions at values, outside of the knots those at the nearer end: shape (values,
    functions) (recursion of M. G. Cox and C. de Boor). The end belongs to the last span."""
    values = np.clip(values, knots[0], knots[-1])[:, None]
    is_last = (values >= knots[-1]) & (knots[1:] == knots[-1]) & (knots[:-1] < knots[-1])
    rows = (((knots[:-1] <= values) & (values < knots[1:])) | is_last).astype(float)
    for p in range(1, degree + 1):
        spans = knots[p:] - knots[:-p]
        shares = np.divide(rows, spans, out=np.zeros_like(rows), where=spans > 0)
        rows = (values - knots[:-p - 1]) * shares[:, :-1] + (knots[p + 1:] - values) * shares[:, 1:]
    return rows
