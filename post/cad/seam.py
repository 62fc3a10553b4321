"""Faces of revolution whose seam lies elsewhere than at parameter 0.

OpenCASCADE makes NURBS of them whose parameter curves are off. So the surface is turned about its
axis until it begins where the face does, and the parameter curves are moved by as much.
"""
import math

from post.cad.occ import parts

SLACK = 1e-9
SOMEWHERE = 0.5       # along axis 2: off the poles


def with_usual_seam(face):
    """The face, or one of the same shape with parameters from 0 to a full turn at most. All edges
    have parameter curves."""
    from OCP.BRep import BRep_Builder, BRep_Tool
    from OCP.BRepTools import BRepTools
    from OCP.TopAbs import TopAbs_FORWARD, TopAbs_WIRE
    from OCP.TopoDS import TopoDS, TopoDS_Face
    forward = TopoDS.Face(face.Oriented(TopAbs_FORWARD))
    surface, axis = round_surface(BRep_Tool.Surface_s(forward))
    if surface is None:
        return face
    first, last = BRepTools.UVBounds_s(forward)[:2]
    if first > -SLACK and last < 2 * math.pi + SLACK:
        return face
    builder, new = BRep_Builder(), TopoDS_Face()
    builder.MakeFace(new, turned_surface(surface, axis, first), BRep_Tool.Tolerance_s(face))
    for wire in parts(forward, TopAbs_WIRE):
        move_curves(builder, TopoDS.Wire(wire), forward, new, first)
        builder.Add(new, wire)
    return TopoDS.Face(new.Oriented(face.Orientation()))


def round_surface(surface):
    """The whole surface and its axis; None for one that is none of revolution."""
    from OCP.Geom import (Geom_ConicalSurface, Geom_CylindricalSurface,
                          Geom_RectangularTrimmedSurface, Geom_SphericalSurface,
                          Geom_SurfaceOfRevolution, Geom_ToroidalSurface)
    while isinstance(surface, Geom_RectangularTrimmedSurface):
        surface = surface.BasisSurface()
    if isinstance(surface, Geom_SurfaceOfRevolution):
        return surface, surface.Axis()
    if isinstance(surface, (Geom_ConicalSurface, Geom_CylindricalSurface, Geom_SphericalSurface,
                            Geom_ToroidalSurface)):
        return surface, surface.Position().Axis()
    return None, None


def turned_surface(surface, axis, angle):
    """The surface turned so that its parameter 0 lies where the angle was. Left-handed ones turn
    the other way."""
    place = surface.Value(angle, SOMEWHERE)
    turned = [surface.Rotated(axis, way * angle) for way in (1, -1)]
    return min(turned, key=lambda one: one.Value(0.0, SOMEWHERE).Distance(place))


def move_curves(builder, wire, face, new, shift):
    """Give the edges of a wire parameter curves on the new face."""
    from OCP.BRep import BRep_Tool
    from OCP.gp import gp_Vec2d
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FORWARD, TopAbs_REVERSED
    from OCP.TopoDS import TopoDS
    way = gp_Vec2d(-shift, 0.0)
    for edge in map(TopoDS.Edge, parts(wire, TopAbs_EDGE)):
        tolerance = BRep_Tool.Tolerance_s(edge)
        first, last = BRep_Tool.Range_s(edge, face)
        sides = [TopoDS.Edge(edge.Oriented(side)) for side in (TopAbs_FORWARD, TopAbs_REVERSED)]
        curves = [BRep_Tool.CurveOnSurface_s(side, face, 0.0, 0.0).Translated(way)
                  for side in sides[:1 + BRep_Tool.IsClosed_s(edge, face)]]
        builder.UpdateEdge(sides[0], *curves, new, tolerance)
        builder.Range(sides[0], new, first, last)
