"""What is known of each face: kind, area, smallest radius, box; and the table of --list."""
from dataclasses import dataclass

import numpy as np

from post.cad.occ import xyz

SAMPLES = 9               # along each axis of a face, to find its smallest radius
AREA_ERROR = 1e-8         # relative; without one, knot lines inside a face are not heeded
FLAT, TIP = 1e-9, 1e8     # curvature times the face's size that counts as none, as infinite
KINDS = {"Plane": "plane", "Cylinder": "cylinder", "Cone": "cone", "Sphere": "sphere",
         "Torus": "torus", "BezierSurface": "Bezier", "BSplineSurface": "B-spline",
         "SurfaceOfRevolution": "revolved", "SurfaceOfExtrusion": "extruded",
         "OffsetSurface": "offset"}


@dataclass
class Facts:
    """Lengths in mm."""
    kind: str
    area: float
    radius: float          # smallest radius of curvature, infinite if flat
    low: np.ndarray        # corners of the box
    high: np.ndarray


def facts_of(face):
    """The facts of a face of a model."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    low, high = box_of(face.shape)
    surface = BRepAdaptor_Surface(face.shape, True)
    kind = surface.GetType().name.removeprefix("GeomAbs_")
    return Facts(KINDS.get(kind, "other"), area_of(face.shape),
                 smallest_radius(surface, kind, face.shape, np.linalg.norm(high - low)), low, high)


def area_of(shape):
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, properties, AREA_ERROR)
    return abs(properties.Mass())


def box_of(shape):
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    if box.IsVoid():
        return np.zeros(3), np.zeros(3)
    return xyz(box.CornerMin()), xyz(box.CornerMax())


def smallest_radius(surface, kind, shape, size):
    """Of a cylinder, sphere or torus exactly, else of samples within the face."""
    if kind == "Plane":
        return np.inf
    if kind == "Cylinder":
        return surface.Cylinder().Radius()
    if kind == "Sphere":
        return surface.Sphere().Radius()
    if kind == "Torus":
        torus = surface.Torus()
        bend = np.cos(np.linspace(surface.FirstVParameter(), surface.LastVParameter(), 100))
        across = np.abs(bend / (torus.MajorRadius() + torus.MinorRadius() * bend)).max()
        return 1 / max(1 / torus.MinorRadius(), across)
    curvature = sampled_curvature(surface, shape)
    if curvature * size > TIP:
        return 0.0
    return 1 / curvature if curvature * size > FLAT else np.inf


def sampled_curvature(surface, shape):
    """The largest principal curvature at samples that lie in the face or on its edges."""
    from OCP.BRepClass import BRepClass_FaceClassifier
    from OCP.BRepLProp import BRepLProp_SLProps
    from OCP.gp import gp_Pnt2d
    from OCP.TopAbs import TopAbs_OUT
    u1, u2, v1, v2 = (surface.FirstUParameter(), surface.LastUParameter(),
                      surface.FirstVParameter(), surface.LastVParameter())
    largest = 0.0
    for u in np.linspace(u1, u2, SAMPLES):
        for v in np.linspace(v1, v2, SAMPLES):
            properties = BRepLProp_SLProps(surface, u, v, 2, 1e-12)
            if not properties.IsCurvatureDefined():
                continue
            curvature = max(abs(properties.MaxCurvature()), abs(properties.MinCurvature()))
            if curvature <= largest:
                continue
            classifier = BRepClass_FaceClassifier(shape, gp_Pnt2d(u, v), 1e-9)
            if classifier.State() != TopAbs_OUT:
                largest = curvature
    return largest


def table_lines(faces, facts, scale, unit):
    """Lines of the table. Lengths are multiplied by a scale."""
    heads = ["face", "kind", f"area {unit}2", f"radius {unit}", "from", "to", "colour", "layer",
             "name"]
    rows = [heads]
    for face in faces:
        one = facts[face.number]
        corners = [" ".join(f"{value:.5g}" for value in np.round(corner * scale, 9) + 0.0)
                   for corner in (one.low, one.high)]
        rows.append([str(face.number), one.kind, f"{one.area * scale**2:.6g}",
                     "-" if np.isinf(one.radius) else f"{one.radius * scale:.5g}", *corners,
                     face.traits.colour or "-", face.traits.layer or "-", face.name or "-"])
    widths = [max(len(row[i]) for row in rows) for i in range(len(heads))]
    is_right = [i in (0, 2, 3) for i in range(len(heads))]
    return ["  ".join(f"{text:>{width}}" if right else f"{text:<{width}}"
                      for text, width, right in zip(row, widths, is_right)).rstrip()
            for row in rows]
