"""Where faces meet: how far apart they are along the edges between them, and edges of one face."""
from dataclasses import dataclass

import numpy as np

from post.cad.convert import edges_of
from post.cad.occ import ShapeTable, xyz

SAMPLES = 9          # along an edge


@dataclass
class Joints:
    """Lengths in mm."""
    n_shared: int = 0
    n_free: int = 0
    gap: float = 0.0                # largest between two faces
    gap_place: np.ndarray = None
    gap_faces: tuple = ()
    tolerance: float = 0.0          # largest edge tolerance that the file or its repair states
    tolerance_place: np.ndarray = None
    tolerance_face: int = 0


def find_joints(shapes, gap):
    """`shapes`: numbers and faces; edges no farther apart than a gap belong together."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
    from OCP.TopoDS import TopoDS
    joints = Joints()
    add_tolerances(joints, shapes)
    sewing = BRepBuilderAPI_Sewing(gap)
    for _, shape in shapes:
        sewing.Add(shape)
    sewing.Perform()
    sewn = []
    for number, shape in shapes:
        result = sewing.ModifiedSubShape(shape)
        sewn.append((number, TopoDS.Face(shape if result.IsNull() else result)))
    for edge, owners in edges_with_faces(sewn):
        if len(owners) == 1:
            joints.n_free += 1
            continue
        joints.n_shared += 1
        for (one, face), (other, second) in zip(owners, owners[1:]):
            distance, place = distance_between(edge, face, second)
            if distance > joints.gap:
                joints.gap, joints.gap_place, joints.gap_faces = distance, place, (one, other)
    return joints


def edges_with_faces(shapes):
    """Edges that are no points and no seams, with numbers and faces around them."""
    from OCP.BRep import BRep_Tool
    table = ShapeTable()
    for number, face in shapes:
        for edge in edges_of(face):
            if BRep_Tool.Degenerated_s(edge) or BRep_Tool.IsClosed_s(edge, face):
                continue
            if table.get(edge) is None:
                table[edge] = []
            table.get(edge).append((number, face))
    return table.items()


def add_tolerances(joints, shapes):
    from OCP.BRep import BRep_Tool
    for number, face in shapes:
        for edge in edges_of(face):
            tolerance = BRep_Tool.Tolerance_s(edge)
            if tolerance > joints.tolerance and not BRep_Tool.Degenerated_s(edge):
                first, last = BRep_Tool.Range_s(edge, face)
                joints.tolerance, joints.tolerance_face = tolerance, number
                joints.tolerance_place = on_face(edge, face, [0.5 * (first + last)])[0]


def distance_between(edge, one, other):
    """The largest distance of the places that two faces give to an edge, and where it is."""
    from OCP.BRep import BRep_Tool
    shares = np.linspace(0, 1, SAMPLES)
    places = []
    for face in (one, other):
        first, last = BRep_Tool.Range_s(edge, face)
        points = on_face(edge, face, first + shares * (last - first))
        if points is None:
            return 0.0, None
        places.append(points)
    gaps = np.linalg.norm(places[0] - places[1], axis=1)
    worst = gaps.argmax()
    return float(gaps[worst]), places[0][worst]


def on_face(edge, face, parameters):
    """Points of an edge by its parameter curve on a face."""
    from OCP.BRep import BRep_Tool
    curve = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)
    if curve is None:
        return None
    surface = BRep_Tool.Surface_s(face)
    flat = [curve.Value(parameter) for parameter in parameters]
    return np.array([xyz(surface.Value(point.X(), point.Y())) for point in flat])
