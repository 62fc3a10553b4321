"""`python -m post cad PLAN.dxf`: the closed curves of a DXF drawing as a table (CSV) or an IGES
file for `*BLANK OUTLINE` and `*TRIM`. The package ezdxf reads them."""
import contextlib
import importlib.util
import os
import sys
from collections import Counter

import numpy as np

from post.cad.outlines import (Arc, Line, Spline, area_of, chained, corners_of, write_curves,
                               write_table)
from post.results import ResultsError, counted

MISSING = ("DXF drawings need the Python package ezdxf, which is not installed: `.venv/bin/pip "
           "install ezdxf` (or ./bootstrap cad) installs it")
# $INSUNITS: name and length in mm.
LENGTHS = {1: ("inch", 25.4), 2: ("foot", 304.8), 3: ("mile", 1609344.0), 4: ("millimetre", 1.0),
           5: ("centimetre", 10.0), 6: ("metre", 1e3), 7: ("kilometre", 1e6),
           8: ("microinch", 2.54e-5), 9: ("mil", 0.0254), 10: ("yard", 914.4),
           13: ("micrometre", 1e-3), 14: ("decimetre", 100.0)}
MOST_DEGREE = 5
FLAT = 1e-6               # of the extent: how far curves may leave one plane of constant z
NEAR, GAP = 1e-6, 1e-4    # of the extent: corners off the curves, ends that meet


def is_drawing(path):
    """Is a file a DXF drawing, by its name or its begin?"""
    if os.path.splitext(path)[1].lower() == ".dxf":
        return True
    with contextlib.suppress(OSError), open(path, "rb") as file:
        head = file.read(200)
        return head.split()[:2] == [b"0", b"SECTION"] or head.startswith(b"AutoCAD Binary DXF")
    return False


def default_path(path):
    return f"{os.path.splitext(os.path.basename(path))[0]}-outline.igs"


def run(arguments, millimetres):
    """`millimetres`: of the unit of the options and of what is written."""
    if importlib.util.find_spec("ezdxf") is None:
        raise ResultsError(MISSING)
    say = (lambda text: None) if arguments.quiet else print
    drawing = read_drawing(arguments.file)
    name, length = unit_of(drawing, arguments)
    curves, skipped = curves_of(drawing, arguments)
    for curve in curves:
        curve.scale(length / millimetres)
    extent = flat_extent(curves)
    tolerance = arguments.tolerance or NEAR * extent
    gap = arguments.gap or GAP * extent
    loops = chained(curves, gap)
    polygons = [corners_of(loop, tolerance) for loop in loops]
    kinds = Counter(curve.kind for curve in curves)
    say(f"{arguments.file}: DXF {drawing.acad_release}, lengths in {name}: "
        f"{counted(len(curves), 'curve')} ("
        + ", ".join(f"{n} {kind}" for kind, n in kinds.most_common()) + ") on layer "
        + ", ".join(sorted({curve.layer for curve in curves})))
    for loop, polygon in zip(loops, polygons):
        low, high = polygon.min(axis=0), polygon.max(axis=0)
        say(f"  closed curve of {counted(len(loop), 'piece')}, area {area_of(polygon):.8g}, box "
            f"({low[0]:.6g}, {low[1]:.6g}) to ({high[0]:.6g}, {high[1]:.6g})")
    if skipped:
        say("  left out: " + ", ".join(f"{n} {kind}" for kind, n in skipped.most_common()))
    if arguments.out.lower().endswith(".csv"):
        write_table(arguments.out, polygons, arguments.unit)
        n = sum(map(len, polygons))
        say(f"{arguments.out}: {counted(len(loops), 'closed curve')} of {n} corners in "
            f"{arguments.unit}")
    else:
        write_curves(arguments.out, loops, arguments.unit, gap)
        say(f"{arguments.out}: {counted(len(curves), 'curve')} in {arguments.unit}")
    return 0


def faults_of(arguments):
    """Options that do not go with a drawing."""
    faults = [f"option --{name} is not for a DXF drawing" for name, value in (
        ("list", arguments.list), ("picture", arguments.picture), ("faces", arguments.faces),
        ("without", arguments.without), ("color", arguments.colour), ("name", arguments.name),
        ("seen-from", arguments.seen_from)) if value]
    if not arguments.out.lower().endswith((".igs", ".iges", ".csv")):
        faults.append(f"'{arguments.out}': the outline of a drawing is written as .csv or .igs")
    return faults


def read_drawing(path):
    import ezdxf
    try:
        return ezdxf.readfile(path)
    except OSError as fault:
        raise ResultsError(f"cannot read '{path}': {fault.strerror or 'no DXF file'}") from None
    except Exception as fault:       # of a damaged file ezdxf lets any kind through
        raise ResultsError(f"'{path}' is damaged: {fault or type(fault).__name__}") from None


def unit_of(drawing, arguments):
    """Name of the unit of the drawing and its length in mm; without one that of --unit."""
    code = int(drawing.header.get("$INSUNITS", 0))
    if code in LENGTHS:
        return LENGTHS[code]
    if code:
        raise ResultsError(f"'{arguments.file}' has a unit that is not known ($INSUNITS {code})")
    print(f"post: warning: '{arguments.file}' names no unit ($INSUNITS): its lengths are taken as "
          f"{arguments.unit}, that of --unit", file=sys.stderr)
    from post.cad.command import MILLIMETRES
    return f"{arguments.unit} (not named)", MILLIMETRES[arguments.unit]


def curves_of(drawing, arguments):
    """Curves on layers that are shown, and what else was there by its kind."""
    hidden = {layer.dxf.name.lower() for layer in drawing.layers
              if layer.is_off() or layer.is_frozen()}
    wanted = [word.strip().lower() for word in (arguments.layer or "").split(",") if word.strip()]
    curves, skipped, layers = [], Counter(), set()
    for entity, layer, is_shown in plain_entities(drawing.modelspace(), hidden):
        if not is_shown:
            skipped["hidden " + entity.dxftype()] += 1
            continue
        layers.add(layer)
        if wanted and layer.lower() not in wanted:
            skipped[f"{entity.dxftype()} on layer {layer}"] += 1
            continue
        pieces = pieces_of(entity)
        if not pieces:
            skipped[entity.dxftype()] += 1
        for piece in pieces:
            piece.layer, piece.name = layer, f"{entity.dxftype()} #{entity.dxf.handle or '?'}"
        curves += pieces
    missing = [word for word in wanted if word not in {layer.lower() for layer in layers}]
    if missing:
        raise ResultsError(f"--layer: no curve on '{missing[0]}'; there are "
                           + ", ".join(sorted(layers)))
    if not curves:
        raise ResultsError(f"'{arguments.file}' has no curve for an outline: no LINE, ARC, CIRCLE, "
                           "ELLIPSE, LWPOLYLINE, POLYLINE or SPLINE that is shown")
    return curves, skipped


def plain_entities(entities, hidden, of_insert="0"):
    """Entities with those of blocks that are inserted, their layers and whether they are shown.

    What a block has on layer 0 is on that of the insert; hidden inserts come as a whole."""
    for entity in entities:
        layer = entity.dxf.get("layer", "0")
        if layer == "0":
            layer = of_insert
        is_shown = layer.lower() not in hidden and not entity.dxf.get("invisible", 0)
        if entity.dxftype() == "INSERT" and is_shown:
            for one in entity.multi_insert() if entity.mcount > 1 else [entity]:
                yield from plain_entities(one.virtual_entities(), hidden, layer)
        else:
            yield entity, layer, is_shown


def pieces_of(entity):
    """Lines, arcs and splines of an entity; none of one that is no curve of a plane."""
    kind = entity.dxftype()
    if kind == "LINE":
        return lines_of([entity.dxf.start, entity.dxf.end])
    if kind in ("ARC", "CIRCLE"):
        return [arc_of(entity)]
    if kind == "LWPOLYLINE":
        points = [(x, y, bulge) for x, y, bulge in entity.get_points("xyb")]
        return polyline_of(entity, points, entity.closed, entity.dxf.elevation)
    if kind == "POLYLINE" and entity.is_2d_polyline:
        points = [(*vertex.dxf.location.vec2, vertex.dxf.bulge) for vertex in entity.vertices]
        return polyline_of(entity, points, entity.is_closed, entity.dxf.elevation.z)
    if kind == "POLYLINE" and entity.is_3d_polyline:
        points = list(entity.points())
        return lines_of(points + points[:1] if entity.is_closed else points)
    if kind == "ELLIPSE":
        from ezdxf.math import rational_bspline_from_ellipse
        return [spline_of(entity, rational_bspline_from_ellipse(entity.construction_tool()))]
    if kind == "SPLINE":
        try:
            return [spline_of(entity, entity.construction_tool())]
        except ValueError as fault:
            raise ResultsError(f"{name_of(entity)} is damaged: {fault}") from None
    return []


def name_of(entity):
    return f"{entity.dxftype()} #{entity.dxf.handle} on layer {entity.dxf.layer}"


def lines_of(points):
    points = [np.array([p[0], p[1], p[2]], float) for p in points]
    return [Line(a, b) for a, b in zip(points, points[1:]) if np.any(a != b)]


def way_up(entity):
    """+1, or -1 for an entity that is seen from below: its x axis is turned round then."""
    normal = entity.dxf.get("extrusion", (0, 0, 1))
    if abs(normal[0]) + abs(normal[1]) > 1e-9 * abs(normal[2]):
        raise ResultsError(f"{name_of(entity)} does not lie in a plane of constant z")
    return 1.0 if normal[2] > 0 else -1.0


def arc_of(entity):
    """An arc or a circle, from its start counter-clockwise to its end."""
    way, centre = way_up(entity), np.array(entity.dxf.center)
    angles = (0.0, 360.0) if entity.dxftype() == "CIRCLE" else (entity.dxf.start_angle,
                                                                entity.dxf.end_angle)
    turn = (angles[1] - angles[0]) % 360 or 360.0
    if abs(entity.dxf.radius) == 0:
        raise ResultsError(f"{name_of(entity)} has no radius")
    start = np.radians(angles[0])
    if way < 0:
        start = np.pi - start - np.radians(turn)
    return Arc(centre * [way, 1, way], abs(entity.dxf.radius), start, np.radians(turn),
               "circle" if turn == 360 else "arc")


def polyline_of(entity, points, is_closed, z):
    """Straight pieces, and arcs where a vertex has a bulge: the tangent of a quarter of the angle
    of the arc to the next vertex, positive counter-clockwise."""
    way, pieces = way_up(entity), []
    pairs = list(zip(points, points[1:] + points[:1]))
    for (ax, ay, bulge), (bx, by, _) in pairs if is_closed else pairs[:-1]:
        a, b = np.array([way * ax, ay, way * z]), np.array([way * bx, by, way * z])
        if np.all(a == b):
            continue
        if bulge == 0:
            pieces.append(Line(a, b))
            continue
        bulge *= way
        across = np.array([a[1] - b[1], b[0] - a[0], 0.0])
        centre = (a + b) / 2 + across * (1 - bulge**2) / (4 * bulge)
        first = (a if bulge > 0 else b) - centre
        pieces.append(Arc(centre, np.linalg.norm(first), np.arctan2(first[1], first[0]),
                          4 * np.arctan(abs(bulge)), "arc"))
    return pieces


def spline_of(entity, curve):
    points = np.array([tuple(point) for point in curve.control_points])
    weights = np.array(curve.weights() or np.ones(len(points)))
    knots = np.array(curve.knots())
    if curve.degree > MOST_DEGREE:
        raise ResultsError(f"{name_of(entity)} has degree {curve.degree}; at most {MOST_DEGREE} "
                           "is read")
    if len(knots) != len(points) + curve.degree + 1 or np.any(np.diff(knots) < 0) \
            or np.any(weights <= 0):
        raise ResultsError(f"{name_of(entity)} is damaged: its knots, points and weights do not "
                           "fit each other")
    return Spline(curve.degree, knots, points, weights,
                  "ellipse" if entity.dxftype() == "ELLIPSE" else "spline")


def flat_extent(curves):
    """Largest extent along x and y; all curves must lie at one z."""
    boxes = [curve.box() for curve in curves]
    low, high = np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)
    extent = float(np.max(high[:2] - low[:2]))
    if high[2] - low[2] > FLAT * extent:
        raise ResultsError(f"curves from z = {low[2]:.6g} to {high[2]:.6g}: an outline lies in one "
                           "plane of constant z (--layer takes some of the curves)")
    return extent
