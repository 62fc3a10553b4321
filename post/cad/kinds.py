"""What kind of file a CAD file is, told by its content, and why some kinds cannot be tools."""
import os
import re

from post.results import ResultsError

HEAD = 4096        # bytes that tell the kind
STL_HEAD, STL_FACET = 84, 50      # bytes of a binary STL file

MESH = ("is a mesh ({}): facets have no curvature, so contact on them is neither smooth nor exact; "
        "save the surfaces from the CAD system as STEP or IGES")
NATIVE = "is a file of {} alone: save it there as STEP (AP214 or AP242) or IGES"
ARCHIVE = "is compressed ({}): unpack it first"
# By the start of the content.
STARTS = ((rb"\s*solid\b[^\0]*\bfacet\s+normal\b", MESH.format("STL")),
          (rb"ply\s", MESH.format("PLY")), (rb"OFF\s", MESH.format("OFF")),
          (rb"\$MeshFormat", MESH.format("Gmsh")), (rb"# vtk DataFile", MESH.format("VTK")),
          (rb"\*KEYWORD", MESH.format("LS-DYNA")), (rb"glTF", MESH.format("glTF")),
          (rb"#VRML", MESH.format("VRML")),
          (rb"\x1f\x8b", ARCHIVE.format("gzip")),
          (rb"\s*0\s*\r?\n\s*SECTION\b", "is a DXF drawing, which has no surfaces"),
          (rb"%PDF", "is a PDF document"),
          (rb"3D Geometry File Format", NATIVE.format("Rhino")),
          (rb"\*\*ABCDEFGHIJKLMNOPQRSTUVWXYZ", NATIVE.format("Parasolid")),
          (rb"\d{3,5} \d+ \d+ \d+\s*\r?\n\d+ .*ACIS", NATIVE.format("ACIS")),
          (rb"\x89HDF", "is an HDF5 file, such as a result of igaform: `python -m post iges` "
                        "writes its shapes"),
          (rb"version https://git-lfs", "is a pointer of Git LFS, not the file itself"))
# By the ending of the name, where the content tells nothing.
ENDINGS = {".stl": MESH.format("STL"), ".obj": MESH.format("OBJ"), ".3mf": MESH.format("3MF"),
           ".bdf": MESH.format("Nastran"), ".nas": MESH.format("Nastran"),
           ".inp": MESH.format("Abaqus"), ".msh": MESH.format("Gmsh"),
           ".vtu": MESH.format("VTK"), ".vtp": MESH.format("VTK"), ".gltf": MESH.format("glTF"),
           ".wrl": MESH.format("VRML"), ".amf": MESH.format("AMF"),
           ".catpart": NATIVE.format("CATIA"), ".catproduct": NATIVE.format("CATIA"),
           ".prt": NATIVE.format("NX or Creo"), ".sldprt": NATIVE.format("SolidWorks"),
           ".ipt": NATIVE.format("Inventor"), ".fcstd": NATIVE.format("FreeCAD"),
           ".jt": NATIVE.format("JT"), ".sat": NATIVE.format("ACIS"),
           ".x_b": NATIVE.format("Parasolid"), ".x_t": NATIVE.format("Parasolid"),
           ".dxf": "is a DXF drawing, which has no surfaces", ".zip": ARCHIVE.format("ZIP"),
           ".stpz": ARCHIVE.format("ZIP"), ".dwg": "is a drawing, which has no surfaces"}


def kind_of(path):
    """STEP, IGES or BREP; other files are refused with the reason."""
    try:
        with open(path, "rb") as file:
            head = file.read(HEAD)
        size = os.path.getsize(path)
    except OSError as fault:
        raise ResultsError(f"cannot read '{path}': {fault.strerror}") from None
    if not head:
        raise ResultsError(f"'{path}' is empty")
    if re.match(rb"\s*(/\*.*?\*/\s*)*ISO-10303-21\s*;", head, re.DOTALL):
        return "STEP"
    if b"CASCADE Topology V" in head or head.startswith((b"DBRep_DrawableShape",
                                                         b"Open CASCADE Topology")):
        return "BREP"
    if re.search(rb"^.{72}S[ 0]{0,6}1\s*$", head.split(b"\n", 1)[0]):
        return "IGES"
    raise ResultsError(f"'{path}' {reason(path, head, size)}")


def reason(path, head, size):
    """Why a file of another kind is refused."""
    for start, words in STARTS:
        if re.match(start, head):
            return words
    n_facets = int.from_bytes(head[STL_HEAD - 4:STL_HEAD], "little")
    if size == STL_HEAD + STL_FACET * n_facets:
        return MESH.format("STL")
    if re.search(rb"^.{72}C[ 0]{0,6}1\s*$", head.split(b"\n", 1)[0]):
        return "is IGES in its compressed format: save it with fixed columns of 80"
    words = ENDINGS.get(os.path.splitext(path)[1].lower())
    return words or ("is no STEP, IGES or BREP file: its content starts with "
                     + ascii(head[:24].decode("latin-1")))


def schema_of(path):
    """The application protocol that a STEP file names, as AP214; empty if it names none known."""
    with open(path, "rb") as file:
        head = file.read(16 * HEAD).decode("latin-1").upper()
    found = re.search(r"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'", head)
    schema = found.group(1) if found else ""
    for start, name in (("CONFIG_CONTROL", "AP203"), ("CONFIGURATION_CONTROL", "AP203"),
                        ("AP203", "AP203"), ("AUTOMOTIVE", "AP214"),
                        ("AP242", "AP242"), ("AP209", "AP209"), ("STRUCTURAL", "AP209"),
                        ("ASSOCIATIVE", "AP202"), ("AP2", "")):
        if schema.startswith(start):
            return name or schema[:5]
    return schema.split()[0] if schema else ""
