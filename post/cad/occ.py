"""Small tools on top of OpenCASCADE (the wheel cadquery-ocp-novtk, see ./bootstrap cad)."""
import importlib.util

import numpy as np

from post.results import ResultsError

INSTALL = ("OpenCASCADE is not installed for this Python: `./bootstrap cad` installs it into .venv "
           "(elsewhere: pip install -r post/requirements-cad.txt; 380 MB)")


def require():
    """One line on how to install what is missing."""
    if importlib.util.find_spec("OCP") is None:
        raise ResultsError(INSTALL)


def silence():
    """OpenCASCADE writes nothing to the screen by itself."""
    from OCP.Message import Message, Message_Printer
    Message.DefaultMessenger_s().RemovePrinters(Message_Printer.get_type_descriptor_s())


class FaceError(Exception):
    """Why a face cannot be written."""


def attempt(call, *arguments):
    """The result of a call; what OpenCASCADE raises becomes a FaceError. (Its exceptions have no
    class in common in Python.)"""
    try:
        return call(*arguments)
    except Exception as fault:
        if not type(fault).__module__.startswith("OCP"):
            raise
        raise FaceError(f"OpenCASCADE fails: {fault}") from None


def parts(shape, kind):
    """The faces, edges or the like of a shape, in the order of the file; shared ones repeatedly."""
    from OCP.TopExp import TopExp_Explorer
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def faces_in(shape):
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopoDS import TopoDS
    return [TopoDS.Face(face) for face in parts(shape, TopAbs_FACE)]


def compound_of(shapes):
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound
    builder, compound = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(compound)
    for shape in shapes:
        builder.Add(compound, shape)
    return compound


class ShapeTable:
    """Values by shape; the same shape in the other direction is the same key."""

    def __init__(self):
        self.lists = {}

    def __setitem__(self, shape, value):
        known = self.lists.setdefault(hash(shape), [])
        for entry in known:
            if entry[0].IsSame(shape):
                entry[1] = value
                return
        known.append([shape, value])

    def get(self, shape, default=None):
        for other, value in self.lists.get(hash(shape), ()):
            if other.IsSame(shape):
                return value
        return default

    def items(self):
        for known in self.lists.values():
            yield from known


def xyz(point):
    return np.array([point.X(), point.Y(), point.Z()])


def place_text(point, scale=1.0):
    """A place with four digits."""
    values = np.round(np.asarray(point) * scale, 9) + 0.0
    return "(" + ", ".join(f"{value:.5g}" for value in values) + ")"
