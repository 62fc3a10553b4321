"""Command line of the package: `python -m post` or `igaform-post`, COMMAND FILE [options]."""
import argparse
import importlib
import os
import re
import sys

from post.results import ResultsError

# Name, module and meaning of the commands that draw one result file into one picture.
PICTURES = (
    ("picture", "picture", "the formed sheet in 3-D with the plastic strain and the tools"),
    ("profile", "profile", "a section of the sheet and the tools at chosen times"),
    ("history", "history", "energies and tool forces against time"),
    ("fld", "fld", "forming-limit diagram: strains in the sheet's plane and a limit curve"),
    ("force", "force", "forces of the tools against their strokes"),
    ("draw-in", "draw_in", "how far the edge of the sheet has moved inwards"),
    ("earing", "earing", "height of the rim of a cup against the angle, beside measured ones"),
    ("springback", "springback", "angles between straight stretches of a section"),
    ("material", "material", "tests of a material: stress-strain, r-values, yield locus"),
    ("compare", "compare", "a strip of the channel against reference data"))
# Those with arguments of their own.
OTHERS = (
    ("report", "report", "one HTML page on a run, with its pictures in it"),
    ("verification", "verification", "pictures and table of the verification suite"),
    ("movie", "movie", "a film of the frames: pictures of one view and one colour scale"),
    ("setup", "setup", "the set-up of a deck as a picture and as a page that turns, without a run"),
    ("watch", "watch", "progress, energies and time step of a run while it goes on"),
    ("bench", "bench", "measurements of igaform_bench: share of the bound, targets, comparison of "
                       "two runs, pictures"),
    ("iges", "iges", "IGES file of a tool or the blank of a result or deck"),
    ("cad", "cad.command", "STEP, IGES or BREP of a CAD system as tools; list, picture and choice "
                           "of their faces"),
    ("economy", "economy", "what ran, what was skipped and what that saved in five scenes"),
    ("processes", "processes", "what a run would take by other numbers of processes, or through "
                               "another network"),
    ("fit", "fit.command", "constants of a material from measured data, with deck lines"),
    ("study", "study.command", "what accuracy costs: many runs of a deck compared"),
    ("study-page", "study.page", "the manual's page on what accuracy costs"))


def parser(chosen):
    """All commands by name, and the arguments of the chosen one: its module alone is imported,
    for the libraries of the pictures take a second to load."""
    is_installed = os.path.basename(sys.argv[0]).startswith("igaform-post")
    top = argparse.ArgumentParser(prog="igaform-post" if is_installed else "python -m post",
                                  description="Pictures and tables from igaform's result files.")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, path, text in PICTURES + OTHERS:
        command = commands.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        if name != chosen:
            continue
        module = importlib.import_module(f"post.{path}")
        is_picture = (name, path, text) in PICTURES
        if is_picture:
            command.add_argument("file", metavar="FILE", help="result file of igaform")
            command.add_argument("-o", "--out", metavar="PNG",
                                 help="the picture to write (default: FILE without its ending, "
                                      f"-{name}.png)")
        module.add_arguments(command)
        command.set_defaults(run=module.run, is_picture=is_picture,
                             ending=getattr(module, "ENDING", ".png"))
    return top


def main():
    chosen = next((word for word in sys.argv[1:] if not word.startswith("-")), "")
    arguments = parser(chosen).parse_args()
    if arguments.out is None and arguments.command == "verification":
        arguments.out = arguments.file
    elif arguments.out is None:
        stem = re.sub(r"(?<=.)\.(h5|[A-Za-z]+)$", "", arguments.file)   # mu0.05 keeps its point
        arguments.out = f"{stem}-{arguments.command}{arguments.ending}"
    try:
        folder = arguments.out
        if arguments.command != "verification":
            folder = os.path.dirname(arguments.out) or "."
        if not os.path.isdir(folder):
            raise ResultsError(f"there is no folder '{folder}' to write to")
        if arguments.is_picture:
            importlib.import_module("post.style").check_format(arguments.out)
        return arguments.run(arguments)
    except ResultsError as error:
        print(f"post: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
