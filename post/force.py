"""Forces of the tools against strokes, of the part that was modelled and of the full one.

A tool that moves is drawn against its own stroke, the way it moves most. A tool that is fixed or
that a force moves hardly travels: it is drawn against the stroke of the tool that travels farthest,
and a tool by force with mean and band. Other results and measured forces may be drawn beside.
"""
import csv
from typing import NamedTuple

import numpy as np

from post import model
from post.number_table import read_numbers
from post.results import Results, ResultsError, name_of
from post.steps import steps_of
from post.style import plt, save, tool_colour

BAND = (5, 95)       # per cent of the samples that lie below the edges of the band
WINDOW = 0.1         # of the samples, over which mean and band are taken
STYLES = ("--", ":", "-.")     # of the lines of other results


def add_arguments(command):
    command.add_argument("--tool", nargs="+", metavar="NAME",
                         help="tools to show (default: all that move)")
    command.add_argument("--parts", type=float, metavar="N",
                         help="the full part is so many times the modelled one (default: 2 for "
                              "each symmetry plane of the deck, times the width that *REDUCE left "
                              "out)")
    command.add_argument("--csv", metavar="FILE", help="write stroke and force of these tools too")
    command.add_argument("--with", dest="others", nargs="+", default=[], metavar="FILE",
                         help="more result files, with the same tools, to draw beside the first")
    command.add_argument("--measured", nargs="+", default=[], metavar="CSV",
                         help="tables of stroke and force of the full part")


def run(arguments):
    with Results(arguments.file) as results:
        figure = shown(results, arguments)
    save(figure, arguments.out)
    return 0


def shown(results, arguments):
    """The picture of the forces, which are printed too."""
    part, curves = told_forces(results, arguments)
    units = units_of(results)
    if arguments.csv:
        write_table(arguments.csv, [(one.name, one.stroke, one.load) for one in curves])
    own = f"{name_of(results.path)}: " if arguments.others else ""
    figure, axis = draw(curves, part, own, *units)
    for i, path in enumerate(arguments.others):
        with Results(path) as other:
            if units_of(other) != units:
                raise ResultsError(f"'{path}' is in {', '.join(units_of(other))}, not in "
                                   f"{', '.join(units)}")
            other_part, curves = told_forces(other, arguments)
        for one in curves:
            plot(axis, one, other_part, f"{name_of(path)}: {one.name}", STYLES[i % len(STYLES)])
    for path in arguments.measured:
        axis.plot(*read_numbers(path).T, "o", color="black", markersize=4, label=name_of(path))
    figure.legend(fontsize=8, loc="outside lower center", ncols=3)
    return figure


def told_forces(results, arguments):
    """What was modelled and the forces of the tools, which are printed."""
    part = Part(results, arguments.parts)
    curves = [curve(results, name) for name in chosen(results, arguments)]
    print(part.text)
    for one in curves:
        print(told(one, part, *units_of(results)))
    return part, curves


def units_of(results):
    """Units of length and force."""
    return results.unit("VTKHDF/Points"), results.unit(f"tools/{results.tools[0]}/force")


class Part:
    """How much of the full part was modelled. Forces in the file are those of the deck's width,
    also if *REDUCE made a strip of it."""

    def __init__(self, results, parts=None):
        planes = model.symmetry_planes(results).values()
        self.of_width = results.width_ratio
        self.of_file = 2.0 ** len(planes) if parts is None else parts / self.of_width
        self.times = self.of_file * self.of_width
        if self.of_file <= 0:
            raise ResultsError("--parts must be positive")
        reasons = []
        if parts is not None:
            reasons = ["--parts"]
        elif planes:
            reasons = ["symmetry " + ", ".join(planes)]
        if parts is None and self.of_width != 1:
            reasons.append(f"*REDUCE: width {self.of_width:.4g} times that of the strip")
        self.text = "full part: as modelled, no symmetry plane in the deck"
        if reasons:
            self.text = f"full part: {self.times:.4g} x the modelled part ({'; '.join(reasons)})"
        if model.is_plane_strain(results) and parts is None:
            self.text += ", a strip in plane strain"


class Curve(NamedTuple):
    """A tool's force over a stroke; `is_pressed`: a force moves the tool."""
    name: str
    stroke: np.ndarray
    load: np.ndarray
    along: str
    is_pressed: bool
    colour: str


def curve(results, name):
    """The force of a tool while it is in use."""
    used = in_use(results, name)
    stroke, load = stroke_and_force(results, name)
    is_pressed = name in model.tools_by_force(results)
    colour = tool_colour(results.tools.index(name))
    if not is_pressed and np.any(stroke):
        return Curve(name, stroke[used], load[used], name, False, colour)
    leader = max(results.tools, key=lambda tool: np.abs(stroke_and_force(results, tool)[0]).max())
    force = results.tool_history(name, "force")[used]
    pressed = force[:, np.argmax(np.abs(force).max(axis=0))]
    return Curve(name, stroke_and_force(results, leader)[0][used],
                 pressed * (np.sign(pressed.mean()) or 1), leader, is_pressed, colour)


def in_use(results, name):
    """Samples of the steps in which the sheet touches a tool."""
    force = results.tool_history(name, "force")
    used = np.zeros(len(force), dtype=bool)
    for step in steps_of(results):
        own = slice(step.samples.start + min(step.samples.start, 1), step.samples.stop)
        used[own] = np.any(force[own])
    return used if used.any() else ~used


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


def told(one, part, length, unit):
    """A line on a tool: forces of the full part, then of the modelled one in brackets."""
    def both(value):
        if part.times == 1:
            return f"{value:.5g} {unit}"
        return f"{part.of_file * value:.5g} {unit} (modelled {value / part.of_width:.5g})"

    if one.is_pressed:
        late = one.load[len(one.load) // 2:]
        low, high = np.percentile(late, BAND)
        return (f"{one.name}, second half: mean {both(late.mean())}, {BAND[0]} to {BAND[1]} % "
                f"{both(low)} to {both(high)}, extremes {both(late.min())} and {both(late.max())}")
    of_other = "" if one.along == one.name else f" of {one.along}"
    top = int(np.argmax(np.abs(one.load)))
    return (f"{one.name}: stroke{of_other} {one.stroke[-1]:.4g} {length}, largest force "
            f"{both(one.load[top])} at {one.stroke[top]:.4g} {length}, at the end "
            f"{both(one.load[-1])}")


def draw(curves, part, own, length, unit):
    """Forces of the full part, a second axis for the modelled one; `own` leads the labels."""
    figure, axis = plt.subplots(figsize=(8, 5), layout="constrained")
    for one in curves:
        plot(axis, one, part, own + one.name)
    axis.set(xlabel=f"stroke [{length}]", ylabel=f"force [{unit}]")
    if part.times != 1:
        axis.set_ylabel(f"force, full part [{unit}]")
        beside = axis.secondary_yaxis("right", functions=(lambda full: full / part.times,
                                                          lambda modelled: modelled * part.times))
        beside.set_ylabel(f"force, modelled part [{unit}]")
    axis.set_title(part.text, fontsize=9)
    return figure, axis


def plot(axis, one, part, label, style="-"):
    """The force of a tool over its stroke."""
    load = part.of_file * one.load
    if one.is_pressed:
        load, low, high = mean_and_band(load)
        label += f", mean and {BAND[0]} to {BAND[1]} %"
        axis.fill_between(one.stroke, low, high, color=one.colour, alpha=0.25, linewidth=0)
    if one.along != one.name:
        label += f", over the stroke of {one.along}"
    axis.plot(one.stroke, load, style, color=one.colour, label=label)


def mean_and_band(values):
    """Moving mean and percentiles of a history."""
    half = max(int(0.5 * WINDOW * len(values)), 1)
    near = [values[max(i - half, 0):i + half + 1] for i in range(len(values))]
    return np.array([(piece.mean(), *np.percentile(piece, BAND)) for piece in near]).T


def write_table(path, curves):
    """A CSV file with two columns a tool; columns end with the use of their tool."""
    longest = max(len(stroke) for _, stroke, _ in curves)
    columns = [[f"{value!r}" for value in map(float, column)] + [""] * (longest - len(column))
               for _, *columns in curves for column in columns]
    try:
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow([f"{name} {what}" for name, *_ in curves
                             for what in ("stroke", "force")])
            writer.writerows(zip(*columns))
    except OSError as fault:
        raise ResultsError(f"cannot write '{path}': {fault.strerror}") from None
