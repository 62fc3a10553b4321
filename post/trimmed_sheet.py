"""Faces of a sheet with an outline, and trimmed tools, as trimmed surfaces (IGES entity 144): loops
in the parameters, of sheets in space as well."""
from dataclasses import dataclass

import numpy as np

from post.cad.writing import add_face
from post.iges_file import TRIMMED_MARK, Surface, write_entities
from post.trimming import loops_of, pieces_of

PARTS = 4           # of an element that an edge of a loop crosses at most


@dataclass
class Curve:
    """A line of straight pieces as a B-spline of degree 1."""
    points: np.ndarray
    degree: int = 1

    @property
    def knots(self):
        n = len(self.points)
        return np.concatenate([[0.0], np.arange(n), [n - 1.0]])

    @property
    def weights(self):
        return np.ones(len(self.points))


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
    faces = []
    for piece in pieces_of(loops_of(regions, *np.transpose(ends))):
        loops = []
        for loop in piece:
            if is_flipped:
                loop = np.column_stack([sum(ends[0]) - loop[:, 0], loop[:, 1]])[::-1]
            places = divided(np.concatenate([loop, loop[:1]]), surface)
            space = positions(surface, places)
            space[-1] = space[0]
            loops.append([(Curve(places), Curve(space))])
        faces.append(Face(surface, loops))
    return faces


def divided(line, surface):
    """A line with more corners: no edge crosses more than a part of an element."""
    steps = [(knots[-1] - knots[0]) / (len(np.unique(knots)) - 1) / PARTS
             for knots in surface.knots]
    n = np.maximum(np.ceil(np.abs(np.diff(line, axis=0)) / steps).max(axis=1).astype(int), 1)
    rows = [a + np.arange(m)[:, None] / m * (b - a) for a, b, m in zip(line, line[1:], n)]
    return np.concatenate([*rows, line[-1:]])


def positions(surface, places):
    """Places of a surface in space."""
    u, v = (basis(degree, knots, values) for degree, knots, values in
            zip(surface.degrees, surface.knots, places.T))
    weights = np.einsum("ni,nj,ji->n", u, v, surface.weights, optimize=True)
    points = np.einsum("ni,nj,jic->nc", u, v, surface.points * surface.weights[..., None],
                       optimize=True)
    return points / weights[:, None]


def basis(degree, knots, values):
    """All basis functions at values, shape (values, functions) (recursion of M. G. Cox and C. de
    Boor)."""
    values = np.clip(values, knots[0], knots[-1])[:, None]
    is_last = (values >= knots[-1]) & (knots[1:] == knots[-1]) & (knots[:-1] < knots[-1])
    rows = (((knots[:-1] <= values) & (values < knots[1:])) | is_last).astype(float)
    for p in range(1, degree + 1):
        spans = knots[p:] - knots[:-p]
        shares = np.divide(rows, spans, out=np.zeros_like(rows), where=spans > 0)
        rows = (values - knots[:-p - 1]) * shares[:, :-1] + (knots[p + 1:] - values) * shares[:, 1:]
    return rows


def write_trimmed(path, faces, unit, author):
    """Write faces as a whole or not at all."""
    entities = []
    for face in faces:
        add_face(entities, face)
    farthest = max(float(np.abs(face.surface.points).max()) for face in faces)
    write_entities(path, entities, TRIMMED_MARK, (farthest, 0.0), unit, author)
