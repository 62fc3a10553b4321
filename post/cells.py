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


def evaluate_grid(values, weights, places, degree):
    """A field given on a grid of nodes (last axis: components) at a tensor grid of places; with
    weights the cells are rational Bezier cells."""
    if weights is not None:
        values = np.concatenate([values * weights, weights], axis=-1)
    for axis, line in enumerate(places):
        matrix = line_matrix(degree, values.shape[axis], line, weights is not None)
        values = np.moveaxis(np.tensordot(matrix, values, axes=(1, axis)), 0, axis)
    return values if weights is None else values[..., :-1] / values[..., -1:]


def interpolate_grid(values, places, degree):
    """As `evaluate_grid`, but along straight lines between the nodes: never out of their range."""
    for axis, line in enumerate(places):
        matrix = line_matrix(1, values.shape[axis], degree * np.asarray(line), False)
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
    all_points, all_corners, n = [], [], 0
    line = np.linspace(0, 1, n_parts + 1)
    numbers = np.arange((n_parts + 1)**2).reshape(n_parts + 1, n_parts + 1)
    corners = np.stack([numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, 1:], numbers[1:, :-1]],
                       axis=-1).reshape(-1, 4)
    for nodes in connectivity:
        degree = round(np.sqrt(len(nodes))) - 1
        j, i = np.array([(b, a) for a, b in quadrilateral_order(degree)]).T
        grid = np.empty((degree + 1, degree + 1, points.shape[1]))
        grid[j, i] = points[nodes]
        grid_weights = None
        if weights is not None:
            grid_weights = np.empty((degree + 1, degree + 1, 1))
            grid_weights[j, i, 0] = weights[nodes]
        all_points.append(evaluate_grid(grid, grid_weights, (line, line), degree)
                          .reshape(-1, points.shape[1]))
        all_corners.append(corners + n)
        n += len(all_points[-1])
    if not all_points:
        return np.empty((0, points.shape[1])), np.empty((0, 4), dtype=int)
    return np.concatenate(all_points), np.concatenate(all_corners)


def cut(points, corners, origin, normal):
    """Segments (m, 2, 3) in which a plane meets the facets."""
    height = (points - origin) @ normal
    segments = []
    for triangle in (corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]):
        h = height[triangle]
        # a corner in the plane counts as above it, so that every cut has exactly two ends
        above = h >= 0
        crossed = triangle[above.any(axis=1) & ~above.all(axis=1)]
        for t in crossed:
            ends = []
            for a, b in ((0, 1), (1, 2), (2, 0)):
                ha, hb = height[t[a]], height[t[b]]
                if (ha >= 0) != (hb >= 0):
                    ends.append(points[t[a]] + ha / (ha - hb) * (points[t[b]] - points[t[a]]))
            segments.append(ends)
    return np.array(segments).reshape(-1, 2, 3)
