"""Faces of a sheet with an outline, and trimmed tools, as trimmed surfaces (IGES entity 144): loops
in the parameters, of sheets in space as well."""
from dataclasses import dataclass

import numpy as np

from post.cad.writing import add_face
from post.iges_file import TRIMMED_MARK, Surface, write_entities
from post.splines import basis
from post.trimming import THIN, cross, loops_of, pieces_of

SMOOTH = 8 * THIN   # how far a corner of a smooth curve is off the line past it, of the parameters
TURN = 0.5          # and how much the curve turns there at most [rad]
RATIO = 4.0         # of the lengths of edges that follow each other on one curve
CLOSE = 2e-7        # of a curve to the surface, of its size
MOST = 512          # places that a curve is laid through


@dataclass
class Curve:
    """A B-spline without weights."""
    points: np.ndarray
    knots: np.ndarray
    degree: int

    @property
    def weights(self):
        return np.ones(len(self.points))

    def at(self, values):
        return basis(self.degree, self.knots, values) @ self.points


@dataclass
class Piece:
    """A rational Bezier curve."""
    degree: int
    points: np.ndarray
    weights: np.ndarray

    @property
    def knots(self):
        return np.repeat([0.0, 1.0], self.degree + 1)


@dataclass
class Face:
    surface: Surface
    loops: list           # of pairs of curves, in parameters and, if known, in space


def face_of_tool(surface, group):
    """A surface of a tool with the loops that a result has of it; without if it is not trimmed."""
    if group is None:
        return Face(surface, [])
    degrees, points = group["degrees"][:], group["points"][:]
    nets = np.split(points, np.cumsum(degrees + 1)[:-1])
    pieces = [Piece(int(degree), net[:, :2] / net[:, 2:], net[:, 2])
              for degree, net in zip(degrees, nets)]
    loops = [[(piece, None) for piece in pieces[last - n:last]]
             for n, last in zip(group["sizes"][:], np.cumsum(group["sizes"][:]))]
    corners = [np.array([piece.points[0] for piece, _ in loop]) for loop in loops]
    outer = int(np.argmax([np.ptp(net, axis=0).prod() for net in corners]))
    return Face(surface, [loops[outer], *loops[:outer], *loops[outer + 1:]])


def trimmed_faces(surface, is_flipped, regions):
    """A face for each piece that the regions leave. `is_flipped`: axis 1 of the surface runs
    against that of the patch."""
    ends = [(knots[0], knots[-1]) for knots in surface.knots]
    ranges = np.ptp(ends, axis=1)
    faces = []
    for piece in pieces_of(loops_of(regions, *np.transpose(ends))):
        loops = []
        for loop in piece:
            if is_flipped:
                loop = np.column_stack([sum(ends[0]) - loop[:, 0], loop[:, 1]])[::-1]
            flat = [flat_curve(line, ranges) for line in smooth_lines(loop, ranges)]
            loops.append([(curve, space_curve(curve, surface)) for curve in flat])
        faces.append(Face(surface, loops))
    return faces


def smooth_lines(loop, ranges):
    """A closed polygon as lines that end at its corners and at the ends of its straight parts. A
    closed curve without any is cut in two."""
    scaled = loop / ranges
    before, after = scaled - np.roll(scaled, 1, axis=0), np.roll(scaled, -1, axis=0) - scaled
    lengths = [np.linalg.norm(way, axis=1) for way in (before, after)]
    area = np.abs(cross(before, after))
    off = area / np.linalg.norm(before + after, axis=1)
    is_end = (off > SMOOTH) | (area > np.sin(TURN) * lengths[0] * lengths[1]) \
        | (np.sum(before * after, axis=1) <= 0) \
        | (np.maximum(*lengths) > RATIO * np.minimum(*lengths))
    if is_end.sum() < 2:
        is_end[[0, len(loop) // 2]] = True
    ends = np.flatnonzero(is_end)
    return [loop[np.arange(a, b + 1) % len(loop)]
            for a, b in zip(ends, [*ends[1:], ends[0] + len(loop)])]


def flat_curve(line, ranges):
    """A curve through some corners of a line, and close to the others."""
    if len(line) < 4:
        return joined(line)
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    along /= along[-1]
    n = 4
    while True:
        chosen = np.unique(np.linspace(0, len(line) - 1, n).round().astype(int))
        curve = through(along[chosen], line[chosen])
        off = np.abs((curve.at(along) - line) / ranges).max()
        if off <= THIN or len(chosen) == len(line):
            return curve
        if n >= MOST:
            return joined(line)
        n *= 2


def space_curve(flat, surface):
    """The curve of a surface above a curve in its parameters, with the same parameter."""
    size = np.ptp(surface.points.reshape(-1, 3), axis=0).max()
    n = 8
    while True:
        values = np.linspace(flat.knots[0], flat.knots[-1], n + 1)
        curve = through(values, positions(surface, flat.at(values)))
        between = (values[1:] + values[:-1]) / 2
        off = np.abs(curve.at(between) - positions(surface, flat.at(between))).max()
        if off <= CLOSE * size or n >= MOST:
            return curve
        n *= 2


def joined(line):
    """Straight lines from corner to corner."""
    values = np.linspace(0, 1, len(line))
    return Curve(line, np.concatenate([[0], values, [1]]), 1)


def through(values, places):
    """The cubic through places at values of its parameter (C. de Boor, A Practical Guide to
    Splines, chapter XIII: knots are means of three values)."""
    inner = (values[1:-3] + values[2:-2] + values[3:-1]) / 3
    knots = np.concatenate([np.repeat(values[0], 4), inner, np.repeat(values[-1], 4)])
    points = np.linalg.solve(basis(3, knots, values), places)
    points[[0, -1]] = places[[0, -1]]      # where the next curve begins, to the last digit
    return Curve(points, knots, 3)


def positions(surface, places):
    """Places of a surface in space."""
    u, v = (basis(degree, knots, values) for degree, knots, values in
            zip(surface.degrees, surface.knots, places.T))
    weights = np.einsum("ni,nj,ji->n", u, v, surface.weights, optimize=True)
    points = np.einsum("ni,nj,jic->nc", u, v, surface.points * surface.weights[..., None],
                       optimize=True)
    return points / weights[:, None]


def write_trimmed(path, faces, unit, author):
    """Write faces as a whole or not at all."""
    entities = []
    for face in faces:
        add_face(entities, face)
    farthest = max(float(np.abs(face.surface.points).max()) for face in faces)
    write_entities(path, entities, TRIMMED_MARK, (farthest, 0.0), unit, author)
