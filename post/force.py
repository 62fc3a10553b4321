"""Forces of the tools against their strokes, the way each tool moves most."""
import csv

import numpy as np

from post.results import Results, ResultsError
from post.style import plt, save, tool_colour


def add_arguments(command):
    command.add_argument("--tool", nargs="+", metavar="NAME",
                         help="tools to show (default: all that move)")
    command.add_argument("--csv", metavar="FILE", help="write stroke and force of these tools too")


def run(arguments):
    with Results(arguments.file) as results:
        curves = [(name, *stroke_and_force(results, name)) for name in chosen(results, arguments)]
        length = results.unit("VTKHDF/Points")
        force = results.unit(f"tools/{results.tools[0]}/force")
    for name, stroke, load in curves:
        top = int(np.argmax(np.abs(load)))
        print(f"{name}: stroke {stroke[-1]:.4g} {length}, largest force {load[top]:.5g} {force} at "
              f"{stroke[top]:.4g} {length}, force at the end {load[-1]:.5g} {force}")
    if arguments.csv:
        write_table(arguments.csv, curves)
    figure, axis = plt.subplots(figsize=(7.5, 4.5), layout="constrained")
    for i, (name, stroke, load) in enumerate(curves):
        axis.plot(stroke, load, color=tool_colour(i), label=name)
    axis.set(xlabel=f"stroke [{length}]", ylabel=f"force of the sheet against it [{force}]")
    axis.legend(fontsize=8)
    save(figure, arguments.out)
    return 0


def chosen(results, arguments):
    """The tools asked for, or those that move."""
    if not results.tools:
        raise ResultsError("there are no tools in this result")
    for name in arguments.tool or ():
        if name not in results.tools:
            raise ResultsError(f"there is no tool '{name}', but {', '.join(results.tools)}")
    if arguments.tool:
        return arguments.tool
    moving = [name for name in results.tools if np.any(results.tool_history(name, "displacement"))]
    if not moving:
        raise ResultsError("no tool moves: name one with --tool")
    return moving


def stroke_and_force(results, tool):
    """Displacement along the direction in which the tool has gone farthest, and the force of the
    sheet against that motion."""
    moved = results.tool_history(tool, "displacement")
    force = results.tool_history(tool, "force")
    farthest = moved[np.argmax(np.linalg.norm(moved, axis=1))]
    length = np.linalg.norm(farthest)
    if length == 0:
        axis = np.zeros(3)
        axis[np.argmax(np.abs(force).max(axis=0, initial=0))] = 1
    else:
        axis = farthest / length
    return moved @ axis, -(force @ axis)


def write_table(path, curves):
    """A CSV file with two columns a tool."""
    try:
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow([f"{name} {what}" for name, *_ in curves
                             for what in ("stroke", "force")])
            writer.writerows(zip(*(column for _, *columns in curves for column in columns)))
    except OSError as fault:
        raise ResultsError(f"cannot write '{path}': {fault.strerror}") from None
