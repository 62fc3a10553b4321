"""Dies as solids of a CAD system: an S-rail and a cross-shaped cup, each as STEP, as IGES with
trimmed surfaces (144) and as IGES with a solid (186).

    python input/cad/tools.py     writes them here; needs OpenCASCADE (./bootstrap cad)

The forms are those of the S-rail of NUMISHEET'96 and of cross-shaped cups of the literature. No
drawing of either was found, so all dimensions are our own: those of ../s_rail/tools.py for the
S-rail, chosen here for the cup. Lengths are mm. Faces that touch the sheet are red and on the layer
ACTIVE; the others are grey.
"""
import math
import os

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import (BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace,
                                BRepBuilderAPI_MakeWire)
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepGProp import BRepGProp
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakePrism
from OCP.GC import GC_MakeArcOfCircle
from OCP.gp import gp_Pnt, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.IGESCAFControl import IGESCAFControl_Writer
from OCP.IGESControl import IGESControl_Controller
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Printer
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

FOLDER = os.path.dirname(os.path.abspath(__file__))
SAME = 1e-6

# S-rail: straight, arc to the left, arc to the right, straight; along x.
RAIL_LENGTH, RAIL_RADIUS, RAIL_TURN = 150.0, 90.0, math.radians(45)
RAIL_WALL, RAIL_EDGE = 31.0, 9.0         # half of the opening; radii above and below the wall
RAIL_DEPTH, RAIL_TOP = 60.0, -0.92       # the sheet lies on z = RAIL_TOP
RAIL_SIDE, RAIL_BLOCK = 160.0, 80.0      # half of the block along y, its height

# Cup: two bars across each other.
CUP_WIDTH = 25.0                         # half of a bar's width
CUP_OUTER, CUP_INNER = 12.0, 15.0        # radii of the corners in plan, outer and re-entrant
CUP_REACH = CUP_WIDTH + CUP_INNER + CUP_OUTER    # half of a bar's length: arc follows arc
CUP_EDGE, CUP_DEPTH, CUP_TOP = 6.0, 40.0, 0.0
CUP_SIDE, CUP_BLOCK = 100.0, 60.0        # half of the block, its height


def edge_line(a, b, z):
    return BRepBuilderAPI_MakeEdge(gp_Pnt(*a, z), gp_Pnt(*b, z)).Edge()


def edge_arc(a, middle, b, z):
    arc = GC_MakeArcOfCircle(gp_Pnt(*a, z), gp_Pnt(*middle, z), gp_Pnt(*b, z)).Value()
    return BRepBuilderAPI_MakeEdge(arc).Edge()


def prism(edges, depth):
    """A plane outline drawn upwards."""
    wire = BRepBuilderAPI_MakeWire()
    for edge in edges:
        wire.Add(edge)
    return BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire.Wire(), True).Face(),
                                 gp_Vec(0, 0, depth)).Shape()


def rail_side(offset, z):
    """Edges of one side of the opening from left to right."""
    run, rise = RAIL_RADIUS * math.sin(RAIL_TURN), RAIL_RADIUS * (1 - math.cos(RAIL_TURN))

    def on_arc(centre, radius, angle):
        return centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)

    first, second = (-run, RAIL_RADIUS - rise), (run, rise - RAIL_RADIUS)
    inner, outer = RAIL_RADIUS - offset, RAIL_RADIUS + offset
    down, up, turn = -math.pi / 2, math.pi / 2, RAIL_TURN
    a, b, c = (on_arc(first, inner, down + share * turn) for share in (0, 0.5, 1))
    _, d, e = (on_arc(second, outer, up + share * turn) for share in (1, 0.5, 0))
    far = RAIL_LENGTH + 10
    return ([edge_line((-far, a[1]), a, z), edge_arc(a, b, c, z), edge_arc(c, d, e, z),
             edge_line(e, (far, e[1]), z)], (-far, a[1]), (far, e[1]))


def s_rail():
    """A block with a groove along the S, open at its ends."""
    bottom = RAIL_TOP - RAIL_DEPTH - RAIL_EDGE
    left, a, b = rail_side(RAIL_WALL, bottom)
    right, c, d = rail_side(-RAIL_WALL, bottom)
    groove = prism([*left, edge_line(b, d, bottom), *reversed(right), edge_line(c, a, bottom)], 200)
    block = BRepPrimAPI_MakeBox(gp_Pnt(-RAIL_LENGTH, -RAIL_SIDE, RAIL_TOP - RAIL_BLOCK),
                                gp_Pnt(RAIL_LENGTH, RAIL_SIDE, RAIL_TOP)).Shape()
    ends = (lambda point: abs(abs(point.X()) - RAIL_LENGTH) < SAME)
    return rounded(BRepAlgoAPI_Cut(block, groove).Shape(), RAIL_EDGE, (bottom, RAIL_TOP),
                   lambda ends_of, _: not all(map(ends, ends_of)),
                   lambda point: max(abs(point.X()) - RAIL_LENGTH,
                                     abs(point.Y()) - RAIL_SIDE) > -SAME)


def cross():
    """A block with a cross-shaped pocket."""
    bottom = CUP_TOP - CUP_DEPTH
    edges = []
    for k in range(4):
        a, b, r, s = CUP_REACH, CUP_WIDTH, CUP_OUTER, CUP_INNER
        e, f = r * (1 - math.sqrt(0.5)), s * (1 - math.sqrt(0.5))
        places = [(a, r - b), (a, b - r), (a - e, b - e), (a - r, b), (b + f, b + f), (b, a - r),
                  (b - e, a - e), (b - r, a)]
        cos, sin = ((1, 0), (0, 1), (-1, 0), (0, -1))[k]
        p = [(cos * x - sin * y, sin * x + cos * y) for x, y in places]
        edges += [edge_line(p[0], p[1], bottom), edge_arc(p[1], p[2], p[3], bottom),
                  edge_arc(p[3], p[4], p[5], bottom), edge_arc(p[5], p[6], p[7], bottom)]
    pocket = prism(edges, 200)
    block = BRepPrimAPI_MakeBox(gp_Pnt(-CUP_SIDE, -CUP_SIDE, CUP_TOP - CUP_BLOCK),
                                gp_Pnt(CUP_SIDE, CUP_SIDE, CUP_TOP)).Shape()
    return rounded(BRepAlgoAPI_Cut(block, pocket).Shape(), CUP_EDGE, (bottom, CUP_TOP),
                   lambda *_: True,
                   lambda point: max(abs(point.X()), abs(point.Y())) > CUP_SIDE - SAME)


def rounded(shape, radius, levels, fits, is_outside):
    """Round the edges of the opening above and below its walls."""
    fillet = BRepFilletAPI_MakeFillet(shape)
    seen = []
    for edge in parts(shape, TopAbs_EDGE):
        edge = TopoDS.Edge(edge)
        middle = centre(edge, BRepGProp.LinearProperties_s)
        ends = end_points(edge)
        is_level = any(all(abs(point.Z() - z) < SAME for point in (*ends, middle)) for z in levels)
        if not is_level or is_outside(middle) or not fits(ends, middle):
            continue
        if not any(edge.IsSame(other) for other in seen):
            seen.append(edge)
            fillet.Add(radius, edge)
    return fillet.Shape()


def end_points(edge):
    from OCP.BRep import BRep_Tool
    from OCP.TopExp import TopExp
    return [BRep_Tool.Pnt_s(find(edge)) for find in (TopExp.FirstVertex_s, TopExp.LastVertex_s)]


def parts(shape, kind):
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def centre(shape, measure=BRepGProp.SurfaceProperties_s):
    properties = GProp_GProps()
    measure(shape, properties)
    return properties.CentreOfMass()


def is_active(face, sides):
    """All but the sides and the bottom of the block."""
    point = centre(face)
    x, y, bottom = sides
    return abs(abs(point.X()) - x) > SAME and abs(abs(point.Y()) - y) > SAME \
        and point.Z() > bottom + SAME


def document_of(shape, name, sides):
    """The solid with its name, colours and layers."""
    form = TCollection_ExtendedString("BinXCAF")
    document = TDocStd_Document(form)
    XCAFApp_Application.GetApplication_s().NewDocument(form, document)
    main = document.Main()
    shapes, colours, layers = (XCAFDoc_DocumentTool.ShapeTool_s(main),
                               XCAFDoc_DocumentTool.ColorTool_s(main),
                               XCAFDoc_DocumentTool.LayerTool_s(main))
    label = shapes.AddShape(shape, False)
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    grey, red = (Quantity_Color(*values, Quantity_TOC_sRGB)
                 for values in ((0.6, 0.6, 0.6), (0.8, 0.2, 0.2)))
    colours.SetColor(label, grey, XCAFDoc_ColorSurf)
    for face in parts(shape, TopAbs_FACE):
        if is_active(face, sides):
            part = shapes.AddSubShape(label, face)
            colours.SetColor(part, red, XCAFDoc_ColorSurf)
            layers.SetLayer(part, TCollection_ExtendedString("ACTIVE"))
    return document


def write(shape, name, sides):
    document = document_of(shape, name.replace("_", " "), sides)
    Interface_Static.SetCVal_s("write.step.schema", "AP214IS")
    step = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.surfacecurve.mode", 1)
    step.Transfer(document, STEPControl_AsIs)
    step.Write(os.path.join(FOLDER, f"{name}.step"))
    for solid, ending in ((0, "144"), (1, "186")):
        Interface_Static.SetCVal_s("write.iges.unit", "MM")
        Interface_Static.SetIVal_s("write.iges.brep.mode", solid)
        iges = IGESCAFControl_Writer()
        iges.Transfer(document)
        iges.Write(os.path.join(FOLDER, f"{name}_{ending}.igs"))


if __name__ == "__main__":
    Message.DefaultMessenger_s().RemovePrinters(Message_Printer.get_type_descriptor_s())
    IGESControl_Controller.Init_s()
    write(s_rail(), "s_rail_die", (RAIL_LENGTH, RAIL_SIDE, RAIL_TOP - RAIL_BLOCK))
    write(cross(), "cross_die", (CUP_SIDE, CUP_SIDE, CUP_TOP - CUP_BLOCK))
