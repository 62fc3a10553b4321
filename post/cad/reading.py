"""The faces of a STEP, IGES or BREP file with names, colours and layers. Lengths are mm."""
from dataclasses import dataclass, field

from post.cad.kinds import kind_of, schema_of
from post.cad.occ import ShapeTable
from post.results import ResultsError

# Entities of IGES that are surfaces or solids, and others that faces cannot be made of.
IGES_SURFACES = (108, 114, 118, 120, 122, 128, 140, 143, 144, 186, 190, 192, 194, 196, 198, 510)
IGES_CURVES = (100, 102, 104, 106, 110, 112, 116, 126, 130)
IGES_MESH = (134, 136)


@dataclass
class Traits:
    """What a part or face is called and how it looks; what a face lacks comes from its part."""
    names: tuple = ()       # from the outermost part to the face
    colour: str = ""        # as #rrggbb
    layer: str = ""

    def over(self, outer):
        return Traits(outer.names + self.names, self.colour or outer.colour,
                      self.layer or outer.layer)


@dataclass
class Face:
    number: int             # from 1, in the order of the file
    shape: object           # TopoDS_Face
    traits: Traits
    is_solid: bool          # a face of a solid: its outside is known

    @property
    def name(self):
        return self.traits.names[-1] if self.traits.names else ""


@dataclass
class Model:
    path: str
    kind: str               # such as STEP AP214
    unit: str               # of the file
    faces: list
    n_solids: int
    notes: list = field(default_factory=list)


def read_model(path):
    """All faces of a file."""
    kind = kind_of(path)
    if kind == "BREP":
        model = Model(path, kind, "", [], 0, ["BREP files name no unit of length: taken as mm"])
        add_faces(model, brep_shape(path), Traits(), ShapeTable())
    else:
        reader, document = transferred(path, kind)
        model = Model(path, f"{kind} {schema_of(path)}".strip() if kind == "STEP" else kind,
                      *(step_facts(reader) if kind == "STEP" else iges_facts(reader)))
        walk_document(model, document)
    if not model.faces:
        raise ResultsError(f"'{path}' has no face: {why_no_face(path, kind)}")
    return model


def brep_shape(path):
    from OCP.BinTools import BinTools
    from OCP.BRep import BRep_Builder
    from OCP.BRepTools import BRepTools
    from OCP.TopoDS import TopoDS_Shape
    shape = TopoDS_Shape()
    with open(path, "rb") as file:
        is_binary = file.read(64).startswith(b"Open CASCADE Topology")
    is_read = BinTools.Read_s(shape, path) if is_binary else \
        BRepTools.Read_s(shape, path, BRep_Builder())
    if not is_read or shape.IsNull():
        raise ResultsError(f"'{path}' cannot be read: OpenCASCADE finds no shape in it")
    return shape


def transferred(path, kind):
    """The reader of a file and the document with its shapes."""
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.IGESCAFControl import IGESCAFControl_Reader
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFApp import XCAFApp_Application
    from OCP.XCAFDoc import XCAFDoc_ShapeTool
    XCAFDoc_ShapeTool.SetAutoNaming_s(False)
    name = TCollection_ExtendedString("BinXCAF")
    document = TDocStd_Document(name)
    XCAFApp_Application.GetApplication_s().NewDocument(name, document)
    reader = STEPCAFControl_Reader() if kind == "STEP" else IGESCAFControl_Reader()
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    for switch in ("Color", "Layer", "Name"):
        getattr(reader, f"Set{switch}Mode")(True)
    if kind == "IGES":
        reader.SetReadVisible(True)
    if reader.ReadFile(path) != IFSelect_RetDone:
        raise ResultsError(f"'{path}' cannot be read: it is damaged or no {kind} file")
    if not reader.Transfer(document) and kind == "STEP" and not step_roots(reader):
        raise ResultsError(f"'{path}' has no shape: {why_no_face(path, kind)}")
    return reader, document


def step_roots(reader):
    return reader.Reader().NbRootsForTransfer()


def step_facts(reader):
    """Unit of the file."""
    from OCP.collections import Sequence_TCollection_AsciiString
    units = [Sequence_TCollection_AsciiString() for _ in range(3)]
    reader.Reader().FileUnits(*units)
    names = [units[0].Value(i + 1).ToCString() for i in range(units[0].Length())]
    return ", ".join(dict.fromkeys(names)), [], 0


def iges_facts(reader):
    """Unit of the file, and what is blanked in it."""
    model = reader.IGESModel()
    name = model.GlobalSection().UnitName()
    scale = model.GlobalSection().Scale()
    notes = []
    entities = [model.Entity(i + 1) for i in range(model.NbEntities())]
    n_blanked = sum(entity.BlankStatus() != 0 and entity.SubordinateStatus() in (0, 2)
                    and entity.TypeNumber() in IGES_SURFACES for entity in entities)
    if n_blanked:
        notes.append(f"{n_blanked} blanked surface{'s' * (n_blanked > 1)} left out")
    if scale != 1:
        notes.append(f"model scale {scale:g} applied")
    return name.String().ToCString() if name else "", [], 0, notes


def why_no_face(path, kind):
    """What a file holds instead of faces."""
    with open(path, "rb") as file:
        text = file.read()
    if kind == "STEP":
        content = text.upper()
        for words, what in (((b"TESSELLATED_FACE", b"TRIANGULATED_FACE", b"TRIANGULATED_SURFACE",
                              b"TESSELLATED_SHELL", b"COORDINATES_LIST"),
                             "only facets (a tessellation), which are a mesh"),
                            ((b"VOLUME_3D_ELEMENT", b"SURFACE_3D_ELEMENT", b"NODE_SET"),
                             "a finite-element mesh"),
                            ((b"ADVANCED_FACE", b"FACE_SURFACE"),
                             "its faces are damaged: OpenCASCADE makes none of them"),
                            ((b"DOCUMENT_FILE", b"EXTERNALLY_DEFINED"),
                             "it names parts in other files: convert those"),
                            ((b"CURVE", b"LINE(", b"POLYLINE"), "only curves"),
                            ((b"CARTESIAN_POINT",), "only points")):
            if any(word in content for word in words):
                return what
        return "no geometry"
    types = {int(line[:8]) for line in text.decode("latin-1").splitlines()
             if line[72:73] == "D" and line[:8].strip().isdigit()}
    for numbers, what in ((IGES_SURFACES, "its surfaces are blanked or damaged"),
                          (IGES_MESH, "a finite-element mesh"), (IGES_CURVES, "only curves")):
        found = sorted(types.intersection(numbers))
        if found:
            return f"{what} (IGES {', '.join(map(str, found))})"
    return "no geometry"


def walk_document(model, document):
    from OCP.collections import Sequence_TDF_Label
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool
    main = document.Main()
    tools = (XCAFDoc_DocumentTool.ShapeTool_s(main), XCAFDoc_DocumentTool.ColorTool_s(main),
             XCAFDoc_DocumentTool.LayerTool_s(main))
    free = Sequence_TDF_Label()
    tools[0].GetFreeShapes(free)
    for i in range(free.Length()):
        walk(model, tools, free.Value(i + 1), TopLoc_Location(), Traits())
    n_hidden = sum(note == "hidden" for note in model.notes)
    model.notes = [note for note in model.notes if note != "hidden"]
    if n_hidden:
        model.notes.append(f"{n_hidden} hidden part{'s' * (n_hidden > 1)} left out")


def walk(model, tools, label, place, outer):
    """Parts of an assembly, each at its place."""
    from OCP.collections import Sequence_TDF_Label
    from OCP.TDF import TDF_Label
    shapes, colours, _ = tools
    if not colours.IsVisible_s(label):
        model.notes.append("hidden")
        return
    own = traits_of(tools, label).over(outer)
    if shapes.IsReference_s(label):
        part = TDF_Label()
        shapes.GetReferredShape_s(label, part)
        walk(model, tools, part, place.Multiplied(shapes.GetLocation_s(label)), own)
    elif shapes.IsAssembly_s(label):
        components = Sequence_TDF_Label()
        shapes.GetComponents_s(label, components)
        for i in range(components.Length()):
            walk(model, tools, components.Value(i + 1), place, own)
    else:
        table = ShapeTable()
        subs = Sequence_TDF_Label()
        shapes.GetSubShapes_s(label, subs)
        for i in range(subs.Length()):
            table[shapes.GetShape_s(subs.Value(i + 1))] = traits_of(tools, subs.Value(i + 1))
        add_faces(model, shapes.GetShape_s(label), own, table, place)


def traits_of(tools, label):
    """Name, colour and layer of a label by itself."""
    from OCP.collections import Sequence_TDF_Label
    from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
    from OCP.XCAFDoc import XCAFDoc_ColorGen, XCAFDoc_ColorSurf
    _, colours, layers = tools
    colour, name = Quantity_Color(), name_of(label)
    traits = Traits((name,) if name else ())
    for kind in (XCAFDoc_ColorSurf, XCAFDoc_ColorGen):
        if not traits.colour and colours.GetColor_s(label, kind, colour):
            values = colour.Values(Quantity_TOC_sRGB)
            traits.colour = "#" + "".join(f"{round(255 * value):02x}" for value in values)
    found = Sequence_TDF_Label()
    if layers.GetLayers(label, found):
        traits.layer = name_of(found.Value(1))
    return traits


def name_of(label):
    """The name of a label on one line, without commas, which separate names in options."""
    from OCP.TDataStd import TDataStd_Name
    if not label.IsAttribute(TDataStd_Name.GetID_s()):    # without one, FindAttribute crashes
        return ""
    name = TDataStd_Name()
    label.FindAttribute(TDataStd_Name.GetID_s(), name)
    return " ".join(name.Get().ToExtString().replace(",", " ").split())


def add_faces(model, shape, outer, table, place=None, is_solid=False):
    """The faces below a shape, with what they and the shapes around them are called."""
    from OCP.TopAbs import TopAbs_FACE, TopAbs_SOLID
    from OCP.TopoDS import TopoDS, TopoDS_Iterator
    own = table.get(shape)
    traits = own.over(outer) if own else outer
    if shape.ShapeType() == TopAbs_FACE:
        face = TopoDS.Face(shape.Moved(place, False) if place else shape)
        model.faces.append(Face(len(model.faces) + 1, face, traits, is_solid))
        return
    if shape.ShapeType() == TopAbs_SOLID:
        model.n_solids += 1
        is_solid = True
    children = TopoDS_Iterator(shape)
    while children.More():
        add_faces(model, children.Value(), traits, table, place, is_solid)
        children.Next()
