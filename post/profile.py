"""Mid-section of the sheet with both faces, the mid-surface and the tools at chosen times."""
import numpy as np
from matplotlib.collections import LineCollection

from post.results import Results
from post.section import Section
from post.style import BLANK, plt, save, tool_colour


def add_arguments(command):
    command.add_argument("--times", type=float, nargs="+", metavar="T",
                         help="times to show (default: four, equally spaced to the end)")


def run(arguments):
    with Results(arguments.file) as results:
        if arguments.times:
            frames = [results.frame(time=t) for t in arguments.times]
        else:
            last = len(results.times) - 1
            frames = sorted({round(last * k / 4) for k in range(1, 5)})
        figure = draw(results, frames)
    save(figure, arguments.out)
    return 0


def draw(results, frames):
    """One panel per frame, all with the same scale."""
    section = Section(results)
    unit = results.unit("VTKHDF/Points")
    corners = [section.sheet(f).reshape(-1, 2) for f in frames]
    corners += [lines.reshape(-1, 2) for f in frames for lines in section.tools(f)]
    low, high = (f([f(c, axis=0) for c in corners if len(c)], axis=0) for f in (np.min, np.max))
    margin = 0.03 * (high - low).max()
    rows = (high - low)[1] / (high - low)[0] * 8.5 + 0.7
    figure, panels = plt.subplots(len(frames), 1, figsize=(9.5, rows * len(frames)), sharex=True,
                                  sharey=True, squeeze=False, layout="constrained")
    for panel, frame in zip(panels[:, 0], frames):
        draw_panel(panel, section, frame)
        panel.set_title(f"time {results.times[frame]:.4g} {results.unit('VTKHDF/Steps/Values')}",
                        loc="left", fontsize=9)
        panel.set_ylabel(f"{section.axis_names[1]} [{unit}]")
    panels[-1, 0].set_xlabel(f"{section.axis_names[0]} [{unit}]")
    panels[0, 0].set(xlim=(low[0] - margin, high[0] + margin),
                     ylim=(low[1] - margin, high[1] + margin))
    panels[0, 0].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=4, fontsize=8)
    return figure


def draw_panel(panel, section, frame):
    lower, middle, upper = section.sheet(frame)
    panel.fill([*lower[:, 0], *upper[::-1, 0]], [*lower[:, 1], *upper[::-1, 1]], color=BLANK,
               alpha=0.25, linewidth=0)
    for line, label, style in ((lower, "faces", "-"), (upper, None, "-"),
                               (middle, "mid-surface", "--")):
        panel.plot(line[:, 0], line[:, 1], style, color=BLANK, label=label,
                   linewidth=0.6 if style == "--" else 0.9)
    for i, segments in enumerate(section.tools(frame)):
        panel.add_collection(LineCollection(segments, colors=tool_colour(i), linewidths=1.2,
                                            label=section.results.tools[i]))
    panel.set_aspect("equal")
