"""A section of the sheet with both faces, the mid-surface and the tools at chosen times."""
import numpy as np
from matplotlib.collections import LineCollection

from post.results import Results
from post.section import Section
from post.section_line import add_section_argument
from post.style import BLANK, plt, save, titled, tool_colour

MARGIN = 0.08     # around the sheet, part of its size
TALL = 0.45       # height over width from which panels stand in two columns


def add_arguments(command):
    command.add_argument("--times", type=float, nargs="+", metavar="T",
                         help="times to show (default: four, equally spaced to the end)")
    add_section_argument(command)


def run(arguments):
    with Results(arguments.file) as results:
        if arguments.times:
            frames = [results.frame(time=t) for t in arguments.times]
        else:
            last = len(results.times) - 1
            frames = sorted({round(last * k / 4) for k in range(1, 5)})
        section = Section(results, arguments.section)
        print(section.place)
        figure = draw(section, frames)
    save(figure, arguments.out)
    return 0


def draw(section, frames):
    """One panel per frame, all with the same scale: around the sheet, which tools may overhang."""
    results = section.results
    unit = results.unit("VTKHDF/Points")
    points = np.concatenate([section.sheet(frame).reshape(-1, 2) for frame in frames])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = MARGIN * (high - low).max()
    low, high = low - margin, high + margin
    ratio = (high - low)[1] / (high - low)[0]
    n_columns = 2 if ratio > TALL and len(frames) > 1 else 1
    n_rows = -(-len(frames) // n_columns)
    figure, panels = plt.subplots(
        n_rows, n_columns, sharex=True, sharey=True, squeeze=False, layout="constrained",
        figsize=(9.5, (8.5 / n_columns * ratio + 0.4) * n_rows + 0.6))
    for panel, frame in zip(panels.flat, frames):
        draw_panel(panel, section, frame)
        panel.set_title(f"time {results.times[frame]:.4g} {results.unit('VTKHDF/Steps/Values')}",
                        loc="left", fontsize=9)
    for panel in panels.flat[len(frames):]:
        panel.set_axis_off()
    for panel in panels[:, 0]:
        panel.set_ylabel(f"{section.axis_names[1]} [{unit}]")
    for panel in panels[-1]:
        panel.set_xlabel(f"{section.axis_names[0]} [{unit}]")
    panels[0, 0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    figure.suptitle(titled(section.name), fontsize=10)
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5,
                  fontsize=8)
    return figure


def draw_panel(panel, section, frame):
    lower, middle, upper = section.sheet(frame)
    panel.fill([*lower[:, 0], *upper[::-1, 0]], [*lower[:, 1], *upper[::-1, 1]], color=BLANK,
               alpha=0.25, linewidth=0)
    for line, label, style in ((lower, "faces", "-"), (upper, None, "-"),
                               (middle, "mid-surface", "--")):
        panel.plot(line[:, 0], line[:, 1], style, color=BLANK, label=label,
                   linewidth=0.6 if style == "--" else 0.9)
    present = section.results.tools_present(frame)
    for i, (name, segments) in enumerate(zip(section.results.tools, section.tools(frame))):
        if name in present:
            panel.add_collection(LineCollection(segments, colors=tool_colour(i), linewidths=1.2,
                                                label=name), autolim=False)
    panel.set_aspect("equal")
