"""Closed curves of a plane: pieces chained end to end, as polygons, tables and IGES files."""
import contextlib
import os
from dataclasses import dataclass

import numpy as np

from post.cad.writing import curve_text
from post.iges_file import OUTLINE_MARK, Entity, values_text, write_entities
from post.results import ResultsError

TABLE_MARK = "# Outline of igaform, lengths in "
MOST_PARTS = 2**16        # of a piece between two knots


class Piece:
    """Ends are (x, y); `layer` and `name` say where a piece comes from."""
    layer = name = ""

    @property
    def ends(self):
        points = self.corners(np.inf)
        return points[0], points[-1]


@dataclass
class Line(Piece):
    start: np.ndarray
    end: np.ndarray
    kind: str = "line"

    def scale(self, factor):
        self.start, self.end = self.start * factor, self.end * factor

    def box(self):
        return np.minimum(self.start, self.end), np.maximum(self.start, self.end)

    def corners(self, _):
        return np.array([self.start[:2], self.end[:2]])

    def entity(self):
        return Entity(110, values_text([110], np.concatenate([self.start, self.end])))


@dataclass
class Arc(Piece):
    """Counter-clockwise; angles in radians, 2 pi for a circle."""
    centre: np.ndarray
    radius: float
    start: float
    turn: float
    kind: str = "arc"

    def scale(self, factor):
        self.centre, self.radius = self.centre * factor, self.radius * factor

    def box(self):
        points = self.corners(1e-3 * self.radius)
        z = self.centre[2]
        return np.append(points.min(axis=0), z), np.append(points.max(axis=0), z)

    def corners(self, tolerance):
        """Chords leave the arc by radius (1 - cos(angle/2))."""
        step = 2 * np.arccos(max(1 - tolerance / self.radius, 0.5))
        angles = self.start + np.linspace(0, self.turn, int(np.ceil(self.turn / step)) + 1)
        points = self.centre[:2] + self.radius * np.column_stack([np.cos(angles), np.sin(angles)])
        if self.kind == "circle":
            points[-1] = points[0]
        return points

    def entity(self):
        first, last = self.ends
        return Entity(100, values_text([100], np.concatenate(
            [self.centre[[2, 0, 1]], first, last])))


@dataclass
class Spline(Piece):
    """Points are not multiplied by their weights."""
    degree: int
    knots: np.ndarray
    points: np.ndarray
    weights: np.ndarray
    kind: str = "spline"

    def scale(self, factor):
        self.points = self.points * factor

    def box(self):
        return self.points.min(axis=0), self.points.max(axis=0)

    def corners(self, tolerance):
        """Each span of knots in equal parts, so many that its middles lie by the chords."""
        spans = np.unique(self.knots[self.degree:len(self.points) + 1])
        parts = []
        for low, high in zip(spans, spans[1:]):
            n = 1 if self.degree == 1 else 4
            while True:
                x = self.at(np.linspace(low, high, 2 * n + 1))
                off = np.abs(x[1::2] - (x[:-1:2] + x[2::2]) / 2).max()
                if off <= tolerance or n >= MOST_PARTS:
                    break
                n *= 2
            parts.append(x[::2] if not parts else x[2::2])
        return np.concatenate(parts)

    def at(self, values):
        """Positions at parameters (rule of C. de Boor)."""
        p, n = self.degree, len(self.points)
        c = np.column_stack([self.points[:, :2] * self.weights[:, None], self.weights])
        spans = np.clip(np.searchsorted(self.knots, values, "right") - 1, p, n - 1)
        rows = [c[spans - p + i] for i in range(p + 1)]
        for r in range(1, p + 1):
            for i in range(p, r - 1, -1):
                low = self.knots[spans - p + i]
                share = ((values - low) / (self.knots[spans + i - r + 1] - low))[:, None]
                rows[i] = (1 - share) * rows[i - 1] + share * rows[i]
        return rows[p][:, :2] / rows[p][:, 2:]

    def entity(self):
        return Entity(126, curve_text(self))


def chained(curves, gap):
    """Closed loops of pieces; those in the other sense come as (piece, True)."""
    left, loops = sorted(curves, key=lambda piece: is_short(piece, gap)), []
    while left and not is_short(left[0], gap):
        piece = left.pop(0)
        loop, (start, end) = [(piece, False)], piece.ends
        while np.linalg.norm(end - start) > gap:
            found = [(min(np.linalg.norm(x - end) for x in other.ends), i)
                     for i, other in enumerate(left)]
            near = [i for distance, i in sorted(found) if distance <= gap]
            if not near or sum(not is_short(left[i], gap) for i in near) > 1:
                refuse(loop[-1][0], end, start, piece, near, found, left, gap)
            piece_next = left.pop(near[0])
            first, last = piece_next.ends
            is_turned = np.linalg.norm(last - end) < np.linalg.norm(first - end)
            end = first if is_turned else last
            loop.append((piece_next, is_turned))
        loops.append(loop)
    return loops


def is_short(piece, gap):
    """Is a piece too short to be a curve of its own? It may be a part of one, or lie in its gap."""
    corners = piece.corners(gap)
    return (np.ptp(corners, axis=0) <= gap).all()


def refuse(piece, end, start, first, near, found, left, gap):
    """Say where a loop is open, or where it branches."""
    place = f"({end[0]:.6g}, {end[1]:.6g})"
    if near:
        raise ResultsError(f"{piece.name} on layer {piece.layer} meets {len(near)} others at "
                           f"{place}: curves of an outline meet in pairs (--layer takes some)")
    candidates = [(np.linalg.norm(end - start), first)] + [(d, left[i]) for d, i in found]
    distance, other = min(candidates, key=lambda pair: pair[0])
    raise ResultsError(f"{piece.name} on layer {piece.layer} ends at {place}, {distance:.6g} from "
                       f"the nearest end, of {other.name}: the outline is open (--gap is "
                       f"{gap:.6g})")


def corners_of(loop, tolerance):
    """Corners of a loop, each once."""
    parts = []
    for piece, is_turned in loop:
        corners = piece.corners(tolerance)
        parts.append((corners[::-1] if is_turned else corners)[:-1])
    return np.concatenate(parts)


def area_of(corners):
    x, y = corners.T
    return abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))) / 2


def write_curves(path, loops, unit, gap):
    """An IGES file of the pieces of all loops."""
    pieces = [piece for loop in loops for piece, _ in loop]
    farthest = max(float(np.abs(piece.box()).max()) for piece in pieces)
    write_entities(path, [piece.entity() for piece in pieces], OUTLINE_MARK, (farthest, gap), unit,
                   "igaform post cad")


def write_table(path, polygons, unit):
    """A table of corners, an empty line between curves; as a whole or not at all."""
    draft = os.path.realpath(path) + ".igaform-new"
    lines = [TABLE_MARK + unit, "x,y"]
    for i, polygon in enumerate(polygons):
        lines += [""] * (i > 0) + [f"{x!r},{y!r}" for x, y in polygon.tolist()]
    try:
        with open(draft, "w", encoding="ascii", newline="\n") as file:
            file.write("\n".join(lines) + "\n")
        os.replace(draft, os.path.realpath(path))
    except OSError as fault:
        with contextlib.suppress(OSError):
            os.remove(draft)
        raise ResultsError(f"cannot write '{path}': {fault.strerror}") from None
