"""`python -m post iges FILE`: a tool or the blank of a result, or of a deck, as an IGES file."""
import difflib
import os
import re
import sys
import tempfile

import h5py
import numpy as np

from post.iges_file import UNITS, Surface, write_iges
from post.results import ResultsError, counted, open_results, text_of
from post.splines import basis
from post.start import add_deck_arguments, start_of_deck
from post.trimmed_sheet import Face, face_of_tool, trimmed_faces, write_trimmed

FACES = ("XI_MIN", "XI_MAX", "ETA_MIN", "ETA_MAX", "ZETA_MIN", "ZETA_MAX")
MIDDLE = "MIDDLE"
LARGE = "ZETA_MIN", "ZETA_MAX"
OUTWARD = ("XI_MAX", "ETA_MIN", "ZETA_MAX")    # their axis 1 x axis 2 points out of the solid


def add_arguments(command):
    command.add_argument("file", metavar="FILE", help="result file of igaform, or a deck")
    command.add_argument("-o", "--out", default="", metavar="IGS",
                         help="the file to write (default: FILE without its ending, -PART.igs, "
                              "here)")
    command.add_argument("--part", default="blank", metavar="NAME",
                         help="tool, or blank (the default)")
    command.add_argument("--face", default="", metavar="NAME",
                         help="a face of the blank, such as ZETA_MAX, or MIDDLE: half-way through")
    command.add_argument("--unit", "--length", dest="unit", default="", metavar="UNIT",
                         help="unit of the lengths (default: that of *UNITS)")
    command.add_argument("--quiet", action="store_true", help="errors and warnings only")
    add_deck_arguments(command)


def run(arguments):
    """Nothing is written before all that was asked for is there."""
    path = arguments.out or default_path(arguments)
    if os.path.isfile(arguments.file) and h5py.is_hdf5(arguments.file):
        shapes = Shapes(arguments.file)
    else:
        shapes = shapes_of_deck(arguments)
    surfaces = part_of(shapes, arguments)
    is_trimmed = isinstance(surfaces[0], Face)
    unit = unit_of(shapes, arguments.unit.upper())
    if os.path.exists(path) and os.path.samefile(path, arguments.file):
        raise ResultsError(f"'{path}' is the file to read")
    write = write_trimmed if is_trimmed else write_iges
    write(path, surfaces, unit, f"igaform {shapes.version}")
    if not arguments.quiet:
        kind = "trimmed surface" if is_trimmed else "surface"
        print(f"{path}: {counted(len(surfaces), kind)} in {unit}")
    return 0


def default_path(arguments):
    """The name of the result or deck with the part's behind it."""
    base = re.sub(r"(?<=.)\.(h5|[A-Za-z]+)$", "", os.path.basename(arguments.file))
    return f"{base}-{arguments.part}.igs".replace(" ", "_")


class Shapes:
    """The exact geometry of blank and tools in a results file, as its last frame has them."""

    def __init__(self, path):
        with open_results(path) as file:
            if not file.get("nurbs/blank"):
                raise ResultsError(f"'{path}' has no shapes under /nurbs")
            try:
                blank = file["nurbs/blank"]
                patches = {"": blank} if "degrees" in blank else dict(
                    sorted(blank.items(), key=lambda item: int(item[1].attrs["patch"])))
                self.solids = {name: net_of(group, 3) for name, group in patches.items()}
                self.tools = {name: [net_of(group[f"surface_{i + 1}"], 2, name)
                                     for i in range(len(group))]
                              for name, group in file["nurbs/tools"].items()}
                self.trimmed_tools = {
                    name: [face_of_tool(surface, group[f"surface_{i + 1}"].get("loops"))
                           for i, surface in enumerate(self.tools[name])]
                    for name, group in file["nurbs/tools"].items()
                    if any("loops" in surface for surface in group.values())}
                first = next(iter(patches.values()))
                self.outlines = [region_of(group) for _, group in
                                 sorted(first.get("outlines", {}).items(), key=number_of)]
                self.unit = text_of(first["points"].attrs.get("unit", b"")).upper()
                self.version = text_of(file["provenance/version"][()])
            except (KeyError, OSError, RuntimeError, TypeError, ValueError) as fault:
                raise ResultsError(f"'{path}' has no whole shapes under /nurbs: {fault}") from None


def number_of(item):
    """The number at the end of the name of a group."""
    return int(item[0].rpartition("_")[2])


def region_of(group):
    """Closed polygons in the parameters of axes 1 and 2, and whether what lies outside is left."""
    corners, sizes = group["corners"][:], group["sizes"][:]
    return np.split(corners, np.cumsum(sizes)[:-1]), bool(group["is_outside"][()])


def net_of(group, n_axes, label=""):
    """Degrees, knots, control points and weights of a solid or a surface; they fit each other."""
    degrees = tuple(int(degree) for degree in group["degrees"][:])
    knots = tuple(group[f"knots_{axis + 1}"][:] for axis in range(n_axes))
    net = Surface(label, degrees, knots, group["points"][:], group["weights"][:])
    grid = tuple(len(knots[axis]) - degrees[axis] - 1 for axis in reversed(range(n_axes)))
    if net.weights.shape != grid or net.points.shape != (*grid, 3):
        raise ValueError(f"points and knots that do not fit each other at {group.name}")
    if not all(np.isfinite(values).all() for values in (*knots, net.points, net.weights)):
        raise ValueError(f"numbers that are not finite at {group.name}")
    return net


def shapes_of_deck(arguments):
    """Blank and tools as a run starts with them."""
    with tempfile.TemporaryDirectory() as folder:
        result = os.path.join(folder, "start.h5")
        start_of_deck(arguments, result)
        return Shapes(result)


def part_of(shapes, arguments):
    """The surfaces of the tool of that name, or the outer faces of the blank; trimmed ones as
    faces."""
    wanted = squeezed(arguments.part)
    for name, surfaces in shapes.tools.items():
        if squeezed(name) == wanted:
            if arguments.face:
                raise ResultsError("option --face goes with the blank, not with a tool")
            return shapes.trimmed_tools.get(name, surfaces)
    if wanted == "BLANK" and shapes.outlines:
        return trimmed_part(shapes, squeezed(arguments.face))
    if wanted == "BLANK":
        return outer_faces(shapes.solids, squeezed(arguments.face))
    names = ["blank", *shapes.tools]
    near = difflib.get_close_matches(arguments.part, names, 1, 0.5)
    raise ResultsError(f"no part '{arguments.part}'; there are {', '.join(names)}"
                       + "".join(f"; did you mean {name}?" for name in near))


def trimmed_part(shapes, wanted):
    """The large faces of a sheet with an outline, or one of them, or its mid-surface."""
    if wanted not in ("", *LARGE, MIDDLE):
        raise ResultsError(f"no face '{wanted}' of a sheet with an outline; there are "
                           f"{', '.join((*LARGE, MIDDLE))}")
    (patch, solid), = shapes.solids.items()
    faces = []
    for face in [wanted] if wanted else LARGE:
        surface = middle_of(solid, patch or MIDDLE) if face == MIDDLE else \
            face_of(solid, face, patch or face)
        faces += trimmed_faces(surface, face not in (MIDDLE, *OUTWARD), shapes.outlines)
    return faces


def squeezed(name):
    return " ".join(name.upper().split())


def outer_faces(solids, wanted):
    """Faces that lie on no other, with their normals outwards; all of them, or those of a name. Or
    the mid-surfaces."""
    if wanted == MIDDLE:
        return [middle_of(solid, patch or MIDDLE) for patch, solid in solids.items()]
    if wanted and wanted not in FACES:
        raise ResultsError(f"no face '{wanted}'; there are {', '.join((*FACES, MIDDLE))}")
    tolerance = 1e-6 * max(float(np.ptp(solid.points)) for solid in solids.values())
    faces = [(face, face_of(solid, face, patch or face)) for patch, solid in solids.items()
             for face in FACES]
    nets = [surface.points for _, surface in faces]
    free = [surface for i, (face, surface) in enumerate(faces)
            if wanted in ("", face) and not is_joined(nets, i, tolerance)]
    if not free:
        raise ResultsError(f"no free face {wanted}")
    return free


def middle_of(solid, label):
    """The surface half-way through a solid along axis 3, with the normals of ZETA_MAX."""
    knots = solid.knots[2]
    shares = basis(solid.degrees[2], knots, [0.5 * (knots[0] + knots[-1])])[0]
    weights = np.tensordot(shares, solid.weights, 1)
    points = np.tensordot(shares, solid.weights[..., None] * solid.points, 1) / weights[..., None]
    return Surface(label, solid.degrees[:2], solid.knots[:2], points, weights)


def face_of(solid, face, label):
    """A face of a solid as a surface whose axis 1 x axis 2 points outwards."""
    axis, is_last = divmod(FACES.index(face), 2)
    along = [i for i in range(3) if i != axis]
    points, weights = (np.take(values, -is_last, axis=2 - axis)
                       for values in (solid.points, solid.weights))
    knots = [solid.knots[i] for i in along]
    if face not in OUTWARD:
        points, weights = points[:, ::-1], weights[:, ::-1]
        knots[0] = (knots[0][0] + knots[0][-1]) - knots[0][::-1]
    return Surface(label, tuple(solid.degrees[i] for i in along), tuple(knots), points, weights)


def is_joined(nets, i, tolerance):
    """Does a face lie on another, or has it no area since its lines of one direction are points?"""
    net = nets[i]
    if min(np.ptp(net, axis=axis).max() for axis in (0, 1)) <= tolerance:
        return True
    ways = [flipped for way in (net, net.swapaxes(0, 1))
            for flipped in (way, way[::-1], way[:, ::-1], way[::-1, ::-1])]
    return any(way.shape == other.shape and np.abs(way - other).max() <= tolerance
               for j, other in enumerate(nets) if j != i for way in ways)


def unit_of(shapes, wanted):
    """The unit of --unit, else the one that the deck names, else millimetres with a warning."""
    if wanted and wanted not in UNITS:
        raise ResultsError("option --unit needs MM, CM, M, IN, FT or the like, not "
                           f"'{wanted}'")
    if wanted or shapes.unit in UNITS:
        return wanted or shapes.unit
    print("post: warning: the deck names no unit of length (*UNITS): written as MM; --unit UNIT "
          "says otherwise", file=sys.stderr)
    return "MM"
