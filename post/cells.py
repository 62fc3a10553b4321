"""Curved cells of VTK on tensor grids: evaluation between their nodes."""
from math import comb

import numpy as np


def shape_functions(degree, t, is_bezier):
    """Lagrange polynomials on equal places, or Bernstein polynomials, at t in [0, 1]."""
    t = np.asarray(t, dtype=float)
    if is_bezier:
        return np.array([comb(degree, i) * t**i * (1 - t)**(degree - i)
                         for i in range(degree + 1)]).T
    nodes = np.arange(degree + 1) / degree
    rows = []
    for i in range(degree + 1):
        others = np.delete(nodes, i)
        rows.append(np.prod([(t - x) / (nodes[i] - x) for x in others], axis=0))
    return np.array(rows).T


def line_matrix(degree, n_nodes, places, is_bezier):
    """From the nodes of a line of cells to places, which count cells from 0."""
    places = np.atleast_1d(np.asarray(places, dtype=float))
    n_cells = (n_nodes - 1) // degree
    cell = np.clip(np.floor(places).astype(int), 0, n_cells - 1)
    matrix = np.zeros((len(places), n_nodes))
    values = shape_functions(degree, places - cell, is_bezier)
    for i in range(degree + 1):
        matrix[np.arange(len(places)), cell * degree + i] = values[:, i]
    return matrix


def evaluate_grid(values, weights, places, degrees):
    """A field given on a grid of nodes (last axis: components) at a tensor grid of places; with
    weights the cells are rational Bezier cells. A degree for each axis."""
    if weights is not None:
        values = np.concatenate([values * weights, weights], axis=-1)
    for axis, line in enumerate(places):
        matrix = line_matrix(degrees[axis], values.shape[axis], line, weights is not None)
        values = np.moveaxis(np.tensordot(matrix, values, axes=(1, axis)), 0, axis)
    return values if weights is None else values[..., :-1] / values[..., -1:]


def interpolate_grid(values, places, degrees):
    """As `evaluate_grid`, but along straight lines between the nodes: never out of their range."""
    for axis, line in enumerate(places):
        matrix = line_matrix(1, values.shape[axis], degrees[axis] * np.asarray(line), False)
        values = np.moveaxis(np.tensordot(matrix, values, axes=(1, axis)), 0, axis)
    return values


def quadrilateral_order(degree):
    """Grid place (i, j) of each node of a quadrilateral in VTK's order."""
    d = degree
    inner = range(1, d)
    corners = [(0, 0), (d, 0), (d, d), (0, d)]
    edges = ([(i, 0) for i in inner] + [(d, i) for i in inner]
             + [(i, d) for i in inner] + [(0, i) for i in inner])
    return corners + edges + [(i, j) for j in inner for i in inner]


def facets(points, weights, connectivity, n_parts):
    """Curved quadrilaterals cut into flat ones: points (n, 3) and corners (m, 4). Columns of the
    points behind the third are fields, which are carried along."""
    if weights is not None:
        points = np.column_stack([points * weights[:, None], weights])
    line = np.linspace(0, 1, n_parts + 1)
    numbers = np.arange((n_parts + 1)**2).reshape(n_parts + 1, n_parts + 1)
    corners = np.stack([numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, 1:], numbers[1:, :-1]],
                       axis=-1).reshape(-1, 4)
    all_points, all_corners, n = [], [], 0
    for n_nodes in sorted({len(nodes) for nodes in connectivity}):
        nodes = np.array([cell for cell in connectivity if len(cell) == n_nodes])
        degree = round(np.sqrt(n_nodes)) - 1
        j, i = np.array([(b, a) for a, b in quadrilateral_order(degree)]).T
        grid = np.empty((len(nodes), degree + 1, degree + 1, points.shape[1]))
        grid[:, j, i] = points[nodes]
        shapes = shape_functions(degree, line, weights is not None)
        cells = np.einsum("aj,bi,mjic->mabc", shapes, shapes, grid, optimize=True)
        all_points.append(cells.reshape(-1, points.shape[1]))
        firsts = n + len(numbers.flat) * np.arange(len(nodes))
        all_corners.append((firsts[:, None, None] + corners).reshape(-1, 4))
        n += len(all_points[-1])
    if not all_points:
        return np.empty((0, points.shape[1] - (weights is not None))), np.empty((0, 4), dtype=int)
    cut_points = np.concatenate(all_points)
    if weights is not None:
        cut_points = cut_points[:, :-1] / cut_points[:, -1:]
    return cut_points, np.concatenate(all_corners)


def triangles_of(corners):
    """Two triangles for each quadrilateral."""
    return np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def clip(points, triangles, height):
    """The part of a surface where the height of its points is positive. Columns of the points
    behind the third are fields, which are carried along."""
    return clip_with_border(points, triangles, height)[:2]


def clip_with_border(points, triangles, height):
    """As `clip`, and the edges (m, 2) of its triangles along which it was cut."""
    height = np.where(np.abs(height) < 1e-9 * np.ptp(points[:, :3]), 0.0, height)
    triangles = triangles[(height > 0)[triangles].any(axis=1)]   # others touch it at most
    parts, n, border = [points], len(points), []
    inside = (height >= 0)[triangles]
    kept = [triangles[inside.all(axis=1)]]
    for count in (1, 2):          # corners inside; the one that differs from the others goes first
        crossed = triangles[inside.sum(axis=1) == count]
        lone = (inside[inside.sum(axis=1) == count] == (count == 1)).argmax(axis=1)
        a, b, c = (crossed[np.arange(len(crossed)), (lone + k) % 3] for k in range(3))
        shares = [(height[a] / (height[a] - height[end]))[:, None] for end in (b, c)]
        parts += [points[a] + share * (points[end] - points[a])
                  for share, end in zip(shares, (b, c))]
        ab, ac = (n + np.arange(len(crossed)) + k * len(crossed) for k in range(2))
        border.append(np.stack([ab, ac], axis=1))
        kept += [np.stack([a, ab, ac], axis=1)] if count == 1 else \
            [np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)]
        n += 2 * len(crossed)
    return np.concatenate(parts), np.concatenate(kept), np.concatenate(border)


def cut(points, corners, origin, normal):
    """Segments (m, 2, 3) in which a plane meets the facets."""
    return cut_triangles(points, triangles_of(corners), origin, normal)[0]


def cut_triangles(points, triangles, origin, normal):
    """Segments (m, 2, 3) in which a plane meets triangles, and the numbers of these."""
    height = (points - origin) @ normal
    # a corner in the plane counts as above it, so that every cut has exactly two ends
    above = (height >= 0)[triangles]
    numbers = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    lone = np.argmax(above[numbers] == (above[numbers].sum(axis=1) == 1)[:, None], axis=1)
    a, b, c = (triangles[numbers, (lone + k) % 3] for k in range(3))
    ends = [points[a] + (height[a] / (height[a] - height[end]))[:, None] * (points[end] - points[a])
            for end in (b, c)]
    return np.stack(ends, axis=1).reshape(-1, 2, 3), numbers
