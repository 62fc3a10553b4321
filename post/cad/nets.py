"""Faces of OpenCASCADE as plain arrays: the surface and its loops of curves, as IGES holds them.

The normal of every face of a solid points outwards: where OpenCASCADE has a face reversed, axis 1
of its surface is reversed here. Loops run with the face on their left, each curve from where the
one before ends, to the last bit.
"""
from dataclasses import dataclass, field, replace

import numpy as np

from post.cad.degrees import MOST_DEGREE, homogeneous, largest_distance, lowered, plain, samples
from post.cad.occ import FaceError, parts, place_text, xyz
from post.iges_file import Surface
from post.splines import basis

CLOSE = 1e-9        # of a range of parameters: the same value
STRAIGHT = 1e-3     # of the tolerance: off a straight line by no more is straight
CURVE_SHARE = 0.1   # of the tolerance, for curves


@dataclass
class Curve:
    """A curve as NURBS. Points have two coordinates in the parameters of a surface, else three."""
    degree: int
    knots: np.ndarray
    points: np.ndarray
    weights: np.ndarray

    def reversed(self):
        return Curve(self.degree, (self.knots[0] + self.knots[-1]) - self.knots[::-1],
                     self.points[::-1].copy(), self.weights[::-1].copy())


@dataclass
class TrimmedFace:
    number: int                                   # of the face in the file read
    surface: Surface
    loops: list = field(default_factory=list)     # lists of pairs: in the parameters, in space
                                                  # (None: an edge that is a point); outer first;
                                                  # none: the whole surface, as of a sphere
    off: float = 0.0                              # deviation where degrees are reduced
    place: np.ndarray = None                      # of the largest


def trimmed_face(number, face, edges, tolerance, gap):
    """A face on a NURBS surface. `edges`: table of edges with better curves in space; `tolerance`:
    largest deviation where degrees are reduced; `gap`: largest break of a loop in space."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepTools import BRepTools
    from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED, TopAbs_WIRE
    from OCP.TopoDS import TopoDS
    is_reversed = face.Orientation() == TopAbs_REVERSED
    forward = TopoDS.Face(face.Oriented(TopAbs_FORWARD))
    geometry = bspline_surface(forward)
    surface, off, place = lowered_surface(surface_arrays(geometry, f"F{number}"), tolerance)
    outer = BRepTools.OuterWire_s(forward)
    if outer.IsNull():
        raise FaceError("it has no boundary")
    wires = [outer] + [TopoDS.Wire(wire) for wire in parts(forward, TopAbs_WIRE)
                       if not wire.IsSame(outer)]
    trimmed = TrimmedFace(number, surface, [], off, place)
    if len(wires) == 1 and is_whole(wires[0], forward, geometry):
        return turned(trimmed) if is_reversed else trimmed
    for wire in wires:
        pieces = wire_pieces(wire, forward, edges,
                             lambda pair: simple_pair(pair, trimmed.surface, tolerance))
        pieces = closed_loop(pieces, geometry, max(gap, BRep_Tool.Tolerance_s(forward)))
        if pieces:
            trimmed.loops.append(pieces)
    if not trimmed.loops:
        raise FaceError("none of its loops has a curve")
    check_inside(trimmed, geometry, gap)
    return turned(trimmed) if is_reversed else trimmed


def is_whole(wire, face, surface):
    """Is a face a whole sphere, torus or the like, bounded by seams and poles alone?"""
    from OCP.BRep import BRep_Tool
    from OCP.BRepTools import BRepTools
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopoDS import TopoDS
    u1, u2, v1, v2 = surface.Bounds()
    slack = 1e-6 * np.array([u2 - u1, u2 - u1, v2 - v1, v2 - v1])
    if np.any(np.abs(np.subtract(BRepTools.UVBounds_s(face), (u1, u2, v1, v2))) > slack):
        return False
    return all(BRep_Tool.Degenerated_s(edge) or BRep_Tool.IsClosed_s(edge, face)
               for edge in map(TopoDS.Edge, parts(wire, TopAbs_EDGE)))


def bspline_surface(face):
    """The surface of a face with its location applied, with knots repeated at both ends; periodic
    ones become open."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepTools import BRepTools
    from OCP.Geom import (Geom_BezierSurface, Geom_BSplineSurface,
                          Geom_RectangularTrimmedSurface)
    from OCP.GeomConvert import GeomConvert
    surface = BRep_Tool.Surface_s(face)
    if not isinstance(surface, Geom_BSplineSurface):
        if not isinstance(surface, Geom_BezierSurface):
            surface = Geom_RectangularTrimmedSurface(surface, *BRepTools.UVBounds_s(face))
        surface = GeomConvert.SurfaceToBSplineSurface_s(surface)
    is_plain = not surface.IsUPeriodic() and not surface.IsVPeriodic() \
        and has_open_ends(surface.UMultiplicities(), surface.UDegree()) \
        and has_open_ends(surface.VMultiplicities(), surface.VDegree())
    return surface if is_plain else opened(surface, BRepTools.UVBounds_s(face))


def has_open_ends(multiplicities, degree):
    """Are the first and the last knot repeated as often as an open knot vector has them?"""
    ends = multiplicities.Value(multiplicities.Lower()), multiplicities.Value(
        multiplicities.Upper())
    return min(ends) == degree + 1


def opened(surface, box):
    """The surface cut to its own parameters, or, if periodic, to those of a face elsewhere."""
    from OCP.collections import Array1_double
    surface = surface.Copy()
    bounds = surface.Bounds()
    wanted = list(bounds)
    for axis, is_periodic in enumerate((surface.IsUPeriodic(), surface.IsVPeriodic())):
        low, high = bounds[2 * axis:2 * axis + 2]
        slack = CLOSE * (high - low)
        if is_periodic and not (box[2 * axis] >= low - slack
                                and box[2 * axis + 1] <= high + slack):
            wanted[2 * axis] = box[2 * axis]
            wanted[2 * axis + 1] = min(box[2 * axis + 1], box[2 * axis] + high - low)
    surface.Segment(*wanted)
    for axis, (knots, set_knots) in enumerate(((surface.UKnots, surface.SetUKnots),
                                               (surface.VKnots, surface.SetVKnots))):
        shift = wanted[2 * axis] - surface.Bounds()[2 * axis]       # whole periods
        if abs(shift) > CLOSE * (bounds[2 * axis + 1] - bounds[2 * axis]):
            values = knots()
            moved = Array1_double(values.Lower(), values.Upper())
            for i in range(values.Lower(), values.Upper() + 1):
                moved.SetValue(i, values.Value(i) + shift)
            set_knots(moved)
    return surface


def surface_arrays(surface, label):
    """A surface of OpenCASCADE as arrays, indices (v, u)."""
    n_u, n_v = surface.NbUPoles(), surface.NbVPoles()
    points = np.array([[xyz(surface.Pole(i + 1, j + 1)) for i in range(n_u)] for j in range(n_v)])
    weights = np.ones((n_v, n_u))
    if surface.IsURational() or surface.IsVRational():
        weights = np.array([[surface.Weight(i + 1, j + 1) for i in range(n_u)]
                            for j in range(n_v)])
    knots = tuple(np.array(list(sequence), dtype=float)
                  for sequence in (surface.UKnotSequence(), surface.VKnotSequence()))
    check_numbers(weights, points, *knots)
    return Surface(label, (surface.UDegree(), surface.VDegree()), knots, points, weights)


def check_numbers(weights, *arrays):
    if not all(np.isfinite(values).all() for values in (weights, *arrays)):
        raise FaceError("numbers that are not finite")
    if not weights.min() > 0:
        raise FaceError(f"a weight of {weights.min():.3g}, not above 0")


def wire_pieces(wire, face, edges, simplified):
    """Curves of the edges of a wire in its order: in the parameters, and in space or None. They
    are simplified before they are reversed, so that faces on both sides have the same."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepTools import BRepTools_WireExplorer
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_REVERSED
    explorer = BRepTools_WireExplorer(wire, face)
    pieces = []
    while explorer.More():
        edge = explorer.Current()
        first, last = BRep_Tool.Range_s(edge, face)
        flat = BRep_Tool.CurveOnSurface_s(edge, face, first, last)
        if flat is None:
            raise FaceError("no parameter curve at " + edge_text(edge))
        given = edges.get(edge, edge)
        space = None if BRep_Tool.Degenerated_s(edge) else BRep_Tool.Curve_s(given, 0.0, 0.0)
        pair = curve_arrays(flat, first, last), \
            None if space is None else curve_arrays(space, *BRep_Tool.Range_s(given))
        pair = simplified(pair)
        if edge.Orientation() == TopAbs_REVERSED:
            pair = tuple(curve and curve.reversed() for curve in pair)
        pieces.append(pair)
        explorer.Next()
    n = sum(1 for _ in parts(wire, TopAbs_EDGE))
    if len(pieces) != n:
        raise FaceError(f"{n - len(pieces)} of {n} edges of a loop do not join the others")
    return pieces


def edge_text(edge):
    """Where an edge begins."""
    from OCP.BRep import BRep_Tool
    from OCP.TopExp import TopExp
    vertex = TopExp.FirstVertex_s(edge)
    return "an edge" if vertex.IsNull() else place_text(xyz(BRep_Tool.Pnt_s(vertex)))


def curve_arrays(curve, first, last):
    """A curve between two parameters as arrays."""
    from OCP.Geom import Geom_BSplineCurve, Geom_TrimmedCurve
    from OCP.Geom2d import Geom2d_BSplineCurve, Geom2d_Curve, Geom2d_TrimmedCurve
    from OCP.Geom2dConvert import Geom2dConvert
    from OCP.GeomConvert import GeomConvert
    is_flat = isinstance(curve, Geom2d_Curve)
    kind, trim, convert = (
        (Geom2d_BSplineCurve, Geom2d_TrimmedCurve, Geom2dConvert.CurveToBSplineCurve_s) if is_flat
        else (Geom_BSplineCurve, Geom_TrimmedCurve, GeomConvert.CurveToBSplineCurve_s))
    if not isinstance(curve, kind):
        start = curve.Value(first)
        curve = convert(trim(curve, first, last))
        first, last = curve.FirstParameter(), curve.LastParameter()
        if curve.Value(first).Distance(start) > CLOSE * (1 + abs(start.X()) + abs(start.Y())):
            raise FaceError("a curve whose start moves when it becomes NURBS")
    slack = CLOSE * (last - first)
    is_whole = abs(curve.FirstParameter() - first) <= slack \
        and abs(curve.LastParameter() - last) <= slack
    if curve.IsPeriodic() or not is_whole \
            or not has_open_ends(curve.Multiplicities(), curve.Degree()):
        curve = curve.Copy()
        if not curve.IsPeriodic():
            first = max(first, curve.FirstParameter())
            last = min(last, curve.LastParameter())
        curve.Segment(first, last)
    n = curve.NbPoles()
    points = [curve.Pole(i + 1) for i in range(n)]
    points = np.array([[p.X(), p.Y()] if is_flat else [p.X(), p.Y(), p.Z()] for p in points])
    weights = np.array([curve.Weight(i + 1) for i in range(n)])
    knots = np.array(list(curve.KnotSequence()), dtype=float)
    check_numbers(weights, points, knots)
    return Curve(curve.Degree(), knots, points, weights)


def lowered_surface(surface, tolerance):
    """The surface with degrees that the solver reads, how far it is off, and where most."""
    if max(surface.degrees) <= MOST_DEGREE:
        return surface, 0.0, None
    degrees, knots = list(surface.degrees), list(surface.knots)
    net = homogeneous(surface.points, surface.weights)      # (v, u, coordinates)
    for axis in range(2):
        if degrees[axis] <= MOST_DEGREE:
            continue
        net = np.swapaxes(net, 0, 1) if axis == 0 else net
        across = basis(degrees[1 - axis], knots[1 - axis], samples(knots[1 - axis]))
        knots[axis], net, _, _ = lowered(
            degrees[axis], knots[axis], net,
            lambda one, other, across=across: largest_distance(
                across @ one, across @ other),
            0.5 * tolerance)
        net = np.swapaxes(net, 0, 1) if axis == 0 else net
        degrees[axis] = MOST_DEGREE
    points, weights = plain(net)
    check_numbers(weights, points)
    reduced = Surface(surface.label, tuple(degrees), tuple(knots), points, weights)
    at = [samples(one) for one in knots]
    places, others = (surface_points(one, at) for one in (surface, reduced))
    gaps = np.linalg.norm(places - others, axis=-1)
    worst = np.unravel_index(gaps.argmax(), gaps.shape)
    if gaps.max() > tolerance:
        raise FaceError(f"a degree of {max(surface.degrees)}; with {MOST_DEGREE} it is off by "
                        f"{gaps.max():.3g} at {place_text(places[worst])}, which is more than "
                        "--tolerance")
    return reduced, float(gaps.max()), places[worst]


def surface_points(surface, at):
    """Points of a surface at a grid of parameters (u, v): shape (v, u, 3)."""
    rows = [basis(*axis) for axis in zip(surface.degrees, surface.knots, at)]
    return plain(rows[0] @ np.tensordot(rows[1], homogeneous(surface.points, surface.weights),
                                        1))[0]


def stretch(surface):
    """Largest lengths of the derivatives along u and v, about."""
    lengths = []
    for axis, (degree, knots) in enumerate(zip(surface.degrees, surface.knots)):
        steps = np.linalg.norm(np.diff(surface.points, axis=1 - axis), axis=-1)
        spans = knots[degree + 1:-1] - knots[1:-degree - 1]
        spans = spans if axis == 0 else spans[:, None]
        lengths.append(float(np.max(degree * steps / np.where(spans > 0, spans, np.inf))))
    return np.array(lengths) * surface.weights.max() / surface.weights.min()


def curve_points(curve):
    at = samples(curve.knots)
    return plain(basis(curve.degree, curve.knots, at) @ homogeneous(curve.points,
                                                                    curve.weights))[0]


def simple_pair(pair, surface, tolerance):
    """The curves of an edge with degrees that the solver reads; what is straight in the parameters
    becomes a line."""
    flat, space = pair
    metric = stretch(surface)
    line = straight(flat, metric, STRAIGHT * tolerance)
    if line is None:
        line = lowered_curve(flat, metric, CURVE_SHARE * tolerance)
    return line, space and lowered_curve(space, np.ones(3), CURVE_SHARE * tolerance)


def straight(curve, metric, tolerance):
    """The straight line between the ends of a curve that nowhere leaves it, else None."""
    first, last = curve.points[[0, -1]] * metric
    length = np.linalg.norm(last - first)
    if not length > tolerance:
        return None
    way = (last - first) / length
    steps = curve.points * metric - first
    along = steps @ way
    off = np.linalg.norm(steps - along[:, None] * way, axis=1)
    if off.max() > tolerance or along.min() < -tolerance or along.max() > length + tolerance:
        return None
    points = curve.points[[0, -1]].copy()
    for axis in range(2):
        if np.ptp(points[:, axis]) * metric[axis] <= tolerance:
            points[:, axis] = points[:, axis].mean()
    return Curve(1, np.array([0.0, 0.0, 1.0, 1.0]), points, np.ones(2))


def lowered_curve(curve, metric, tolerance):
    """A curve with a degree that the solver reads; lengths of coordinates: `metric`."""
    if curve.degree <= MOST_DEGREE:
        return curve
    scale = np.append(metric, 1.0)
    knots, net, error, _ = lowered(
        curve.degree, curve.knots, homogeneous(curve.points, curve.weights),
        lambda one, other: largest_distance(one * scale, other * scale), tolerance)
    if error > tolerance:
        raise FaceError(f"a curve of degree {curve.degree}; with {MOST_DEGREE} it is off by "
                        f"{error:.3g}, which is more than a tenth of --tolerance")
    points, weights = plain(net)
    check_numbers(weights, points)
    points[[0, -1]] = curve.points[[0, -1]]
    return Curve(MOST_DEGREE, knots, points, weights)


def closed_loop(pieces, surface, tolerance):
    """The pieces with ends that meet to the last bit. A jump between parameters of one place in
    space is a pole or the like: a straight piece is put there."""
    joined = []
    for i, (flat, space) in enumerate(pieces):
        joined.append((flat, space))
        following = pieces[(i + 1) % len(pieces)][0]
        gap = flat.points[-1], following.points[0]
        if np.array_equal(*gap):
            continue
        places = [xyz(surface.Value(*((1 - s) * gap[0] + s * gap[1])))
                  for s in np.linspace(0, 1, 5)]
        breaks = [np.linalg.norm(place - places[0]) for place in places]
        if max(breaks) > tolerance:
            raise FaceError(f"a loop that is open by {breaks[-1]:.3g} at {place_text(places[0])}"
                            if breaks[-1] > tolerance else
                            f"a loop that jumps over a seam at {place_text(places[0])}")
        if is_jump(*gap, surface):
            joined.append((Curve(1, np.array([0.0, 0.0, 1.0, 1.0]), np.array(gap), np.ones(2)),
                           None))
        else:
            following.points[0] = flat.points[-1]
    return joined


def is_jump(one, other, surface):
    """Are two pairs of parameters farther apart than round-off and gaps make them?"""
    u1, u2, v1, v2 = surface.Bounds()
    return bool(np.any(np.abs(one - other) > 1e-3 * np.array([u2 - u1, v2 - v1])))


def check_inside(trimmed, surface, tolerance):
    """Refuse parameter curves that leave the surface by more than a tolerance in space."""
    u1, u2, v1, v2 = surface.Bounds()
    low, high = np.array([u1, v1]), np.array([u2, v2])
    metric = stretch(trimmed.surface)
    for flat, _ in (pair for loop in trimmed.loops for pair in loop):
        places = curve_points(flat)
        inside = np.clip(places, low, high)
        ways = np.linalg.norm((places - inside) * metric, axis=1)
        if ways.max() > tolerance:
            where = xyz(surface.Value(*inside[ways.argmax()]))
            raise FaceError(f"a parameter curve that leaves the surface by {ways.max():.3g} at "
                            f"{place_text(where)}")


def turned(trimmed):
    """The face with axis 1 of its surface reversed, and so its normal."""
    surface = trimmed.surface
    first, last = surface.knots[0][0], surface.knots[0][-1]
    knots = ((first + last) - surface.knots[0][::-1], surface.knots[1])
    surface = Surface(surface.label, surface.degrees, knots, surface.points[:, ::-1],
                      surface.weights[:, ::-1])
    loops = []
    for loop in trimmed.loops:
        pairs = [tuple(curve and curve.reversed() for curve in pair) for pair in reversed(loop)]
        for flat, _ in pairs:
            flat.points[:, 0] = (first + last) - flat.points[:, 0]
        loops.append(pairs)
    return replace(trimmed, surface=surface, loops=loops)
