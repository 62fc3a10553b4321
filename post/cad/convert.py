"""Faces as NURBS of degree 5 at most, with parameter curves on all edges, by OpenCASCADE."""
from dataclasses import dataclass, field

from post.cad.nets import trimmed_face
from post.cad.occ import FaceError, ShapeTable, attempt, compound_of, faces_in, parts
from post.cad.seam import with_usual_seam


@dataclass
class Conversion:
    """The faces to write, those that cannot be, and what was done."""
    faces: list = field(default_factory=list)         # of TrimmedFace
    shapes: list = field(default_factory=list)        # numbers and TopoDS_Face, repaired
    refused: list = field(default_factory=list)       # number and reason
    n_curves: int = 0                                 # parameter curves
    n_made: int = 0                                   # of these, made here
    n_reduced: int = 0                                # faces of reduced degree
    deviation: tuple = (0.0, 0, None)                 # largest, face, place
    degrees: tuple = (0, 0)                           # largest along the axes


def convert(faces, tolerance, gap):
    """Convert faces of a model. `tolerance`: largest deviation where degrees are reduced; `gap`:
    largest break of a loop; both mm."""
    done = Conversion()
    done.shapes = fixed(faces, done)
    converter = converter_of(done.shapes)
    for number, shape in done.shapes:
        try:
            face, edges = as_nurbs(shape, converter)
            add(done, attempt(trimmed_face, number, face, edges, tolerance, gap))
        except FaceError as fault:
            done.refused.append((number, str(fault)))
    done.refused.sort()
    return done


def add(done, face):
    """Add a face to those to write."""
    done.faces.append(face)
    done.n_curves += sum(len(loop) for loop in face.loops)
    done.degrees = tuple(map(max, done.degrees, face.surface.degrees))
    if face.place is not None:
        done.n_reduced += 1
        done.deviation = max(done.deviation, (face.off, face.number, face.place),
                             key=lambda item: item[0])


def fixed(faces, done):
    """The faces repaired: order of edges, missing parameter curves, seams, poles. One may become
    several."""
    from OCP.ShapeFix import ShapeFix_Shape
    compound = compound_of(face.shape for face in faces)
    done.n_made = sum(n_missing(face.shape) for face in faces)
    fix = ShapeFix_Shape(compound)
    fix.Perform()
    shapes = []
    for face in faces:
        result = fix.Context().Apply(face.shape)
        pieces = [] if result.IsNull() else faces_in(result)
        if not pieces:
            done.refused.append((face.number, "nothing of it is left after repair"))
        shapes += [(face.number, piece) for piece in pieces]
    for _, shape in shapes:
        add_missing_curves(shape)
    return [(number, shape if n_missing(shape) else with_usual_seam(shape))
            for number, shape in shapes]


def edges_of(face):
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopoDS import TopoDS
    return [TopoDS.Edge(edge) for edge in parts(face, TopAbs_EDGE)]


def has_curve(edge, face):
    """A parameter curve is stored, or follows from the plane."""
    from OCP.BRep import BRep_Tool
    return BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0) is not None


def n_missing(face):
    return sum(not has_curve(edge, face) for edge in edges_of(face))


def add_missing_curves(face):
    """Project the edges that have a curve in space alone."""
    from OCP.BRep import BRep_Tool
    from OCP.ShapeFix import ShapeFix_Edge
    for edge in edges_of(face):
        if not has_curve(edge, face):
            ShapeFix_Edge().FixAddPCurve(edge, face, BRep_Tool.IsClosed_s(edge, face), 0.0)


def converter_of(shapes):
    """Makes NURBS of all faces that need it at once, which is fastest; None if it fails."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
    curved = [shape for _, shape in shapes if not keeps_parameters(shape)]
    try:
        return attempt(BRepBuilderAPI_NurbsConvert, compound_of(curved), True) if curved else None
    except FaceError:
        return None


def as_nurbs(shape, converter):
    """A face on a surface that is NURBS, with parameter curves that fit it, and a table from its
    edges to those of the shape: faces that share an edge have its very curve. Planes and NURBS
    stay as they are, as do their parameters."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
    from OCP.TopoDS import TopoDS
    if keeps_parameters(shape):
        return shape, ShapeTable()
    converter = converter or attempt(BRepBuilderAPI_NurbsConvert, compound_of([shape]), True)
    new = attempt(converter.ModifiedShape, shape)       # as if the face were not reversed
    edges = ShapeTable()
    for edge in edges_of(shape):
        edges[attempt(converter.ModifiedShape, edge)] = edge
    return TopoDS.Face(new.Composed(shape.Orientation())), edges


def keeps_parameters(face):
    """Is the surface a plane or NURBS?"""
    from OCP.BRep import BRep_Tool
    from OCP.Geom import Geom_BezierSurface, Geom_BSplineSurface, Geom_Plane
    return isinstance(BRep_Tool.Surface_s(face),
                      (Geom_BezierSurface, Geom_BSplineSurface, Geom_Plane))
