"""Command line of the package: `python -m post` or `igaform-post`, COMMAND FILE [options]."""
import argparse
import os
import sys

from post import (bench, compare, draw_in, economy, fld, force, history, iges, material, picture,
                  profile, springback, verification, watch)
from post.results import ResultsError
from post.study import command as study
from post.study import page
from post.style import check_format


def parser():
    is_installed = os.path.basename(sys.argv[0]).startswith("igaform-post")
    top = argparse.ArgumentParser(prog="igaform-post" if is_installed else "python -m post",
                                  description="Pictures and tables from igaform's result files.")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for module, name, text in (
            (picture, "picture", "the formed sheet in 3-D with the plastic strain and the tools"),
            (profile, "profile", "the sheet's mid-section and the tools at chosen times"),
            (history, "history", "energies and tool forces against time"),
            (fld, "fld", "forming-limit diagram: strains in the sheet's plane and a limit curve"),
            (force, "force", "forces of the tools against their strokes"),
            (draw_in, "draw-in", "how far the edge of the sheet has moved inwards"),
            (springback, "springback", "angles between straight stretches of the mid-section"),
            (material, "material", "tests of a material: stress-strain, r-values, yield locus"),
            (compare, "compare", "a strip of the channel against reference data")):
        command = commands.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        command.add_argument("file", metavar="FILE", help="result file of igaform")
        command.add_argument("-o", "--out", metavar="PNG",
                             help="the picture to write (default: FILE without its ending, "
                                  f"-{name}.png)")
        module.add_arguments(command)
        command.set_defaults(run=module.run, is_picture=True)
    command = commands.add_parser("verification",
                                  help="pictures and table of the verification suite")
    command.add_argument("file", metavar="FOLDER", help="records that the tests have left")
    command.add_argument("-o", "--out", metavar="FOLDER",
                         help="folder of the pictures (default: that of the records)")
    command.set_defaults(run=verification.run, is_picture=False)
    for module, name, text in (
            (watch, "watch", "progress, energies and time step of a run while it goes on"),
            (bench, "bench", "measurements of igaform_bench: share of the bound, targets, "
                             "comparison of two runs, pictures"),
            (iges, "iges", "IGES file of a tool or the blank of a result or deck"),
            (economy, "economy", "what ran, what slept and what that saved in five scenes"),
            (study, "study", "what accuracy costs: many runs of a deck compared"),
            (page, "study-page", "the manual's page on what accuracy costs")):
        command = commands.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        module.add_arguments(command)
        command.set_defaults(run=module.run, is_picture=False)
    return top


def main():
    arguments = parser().parse_args()
    if arguments.out is None and arguments.command == "verification":
        arguments.out = arguments.file
    elif arguments.out is None:
        arguments.out = arguments.file.removesuffix(".h5") + f"-{arguments.command}.png"
    try:
        folder = arguments.out
        if arguments.command != "verification":
            folder = os.path.dirname(arguments.out) or "."
        if not os.path.isdir(folder):
            raise ResultsError(f"there is no folder '{folder}' to write to")
        if arguments.is_picture:
            check_format(arguments.out)
        return arguments.run(arguments)
    except ResultsError as fault:
        print(f"post: {fault}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
