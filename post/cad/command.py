"""`python -m post cad FILE`: STEP, IGES or BREP of a CAD system as the trimmed surfaces that the
solver reads; a table and a picture of the faces; a choice of them. DXF drawings as outlines."""
import multiprocessing
import os
import re
import sys

from post.cad import drawing, occ
from post.cad.choice import add_choice_arguments
from post.cad.kinds import kind_of
from post.iges_file import UNITS, why_left_alone
from post.picture import add_size_argument
from post.results import ResultsError
from post.style import check_format

MILLIMETRES = {"MM": 1.0, "CM": 10.0, "M": 1e3, "KM": 1e6, "UM": 1e-3, "IN": 25.4, "INCH": 25.4,
               "FT": 304.8, "MI": 1609344.0, "MIL": 0.0254, "UIN": 2.54e-5}


def add_arguments(command):
    command.add_argument("file", metavar="FILE",
                         help="STEP (AP203, AP214, AP242), IGES or BREP; or a DXF drawing, whose "
                              "closed curves become an outline")
    command.add_argument("-o", "--out", default="", metavar="IGS",
                         help="the file to write (default, without --list and --picture: FILE "
                              "without its ending, -tool.igs, here; of a drawing -outline.igs, "
                              "or NAME.csv for a table)")
    command.add_argument("--list", action="store_true",
                         help="a table of the faces: number, kind, area, smallest radius of "
                              "curvature, corners of the box, colour, layer, name")
    command.add_argument("--picture", default="", metavar="PNG",
                         help="draw the faces in colours with their numbers")
    add_size_argument(command)
    add_choice_arguments(command)
    command.add_argument("--tolerance", type=float, metavar="LENGTH",
                         help="largest deviation where degrees above 5 are reduced (default: 0.001 "
                              "mm, and at most 1e-5 of the diagonal)")
    command.add_argument("--gap", type=float, metavar="LENGTH",
                         help="edges no farther apart than this belong together (default: 0.1 mm, "
                              "and at most 1e-3 of the diagonal)")
    command.add_argument("--unit", default="MM", metavar="UNIT",
                         help="unit of the lengths written, listed and given here (default: MM); "
                              "that of FILE is read from it")
    command.add_argument("--quiet", action="store_true", help="errors and warnings only")


def run(arguments):
    """Nothing is written before all that was asked for is there."""
    check(arguments)
    if drawing.is_drawing(arguments.file):
        return drawing.run(arguments, MILLIMETRES[arguments.unit])
    occ.require()
    return in_child(arguments)


def check(arguments):
    """What is wrong with the arguments, all in one go."""
    faults = []
    arguments.unit = arguments.unit.upper()
    if arguments.unit not in UNITS:
        faults.append(f"option --unit needs MM, CM, M, IN, FT or the like, not '{arguments.unit}'")
    for name in ("tolerance", "gap"):
        value = getattr(arguments, name)
        if value is not None and not 0 < value < float("inf"):
            faults.append(f"option --{name} needs a length above 0, not {value:g}")
    is_drawing = drawing.is_drawing(arguments.file)
    if is_drawing:
        arguments.out = arguments.out or drawing.default_path(arguments.file)
        faults += drawing.faults_of(arguments)
    if not arguments.out and not arguments.list and not arguments.picture:
        base = re.sub(r"(?<=.)\.[A-Za-z0-9]+$", "", os.path.basename(arguments.file))
        arguments.out = f"{base}-tool.igs"
    if arguments.out:
        why = why_left_alone(arguments.out)
        if why:
            faults.append(f"cannot write '{arguments.out}': {why}; it is left alone; name another "
                          "with --out")
    for option in ("out", "picture"):
        folder = os.path.dirname(getattr(arguments, option)) or "."
        if not os.path.isdir(folder):
            faults.append(f"there is no folder '{folder}' to write to")
    if arguments.picture:
        try:
            check_format(arguments.picture)
        except ResultsError as fault:
            faults.append(str(fault))
    try:
        if not is_drawing:
            kind_of(arguments.file)
        if arguments.out and os.path.exists(arguments.out) \
                and os.path.samefile(arguments.out, arguments.file):
            faults.append(f"'{arguments.out}' is the file to read")
    except ResultsError as fault:
        faults.append(str(fault))
    if faults:
        raise ResultsError("\npost: ".join(faults))


def in_child(arguments):
    """Work in a process of its own, since a damaged file can end OpenCASCADE and its process."""
    sys.stdout.flush()
    child = multiprocessing.get_context("fork").Process(target=work_alone, args=(arguments,))
    child.start()
    child.join()
    if child.exitcode < 0:
        raise ResultsError(f"'{arguments.file}' ends OpenCASCADE (signal {-child.exitcode}): the "
                           "file is damaged, or meets an error of OpenCASCADE")
    return child.exitcode


def work_alone(arguments):
    """Exit code 1 after what the user can put right."""
    from post.cad.work import work
    try:
        work(arguments, MILLIMETRES[arguments.unit])
    except ResultsError as fault:
        print(f"post: {fault}", file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:      # whoever reads has enough
        os._exit(1)
