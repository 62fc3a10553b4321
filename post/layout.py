"""A drawn scene with its title above, and names of the tools, colour scale and axes beside it."""
import textwrap

import matplotlib
import numpy as np

from post.bands import colours_of, level_texts
from post.style import paler, plt

DOTS = 150            # per inch
HEAD = 0.62           # inches above the scene
COLUMN = 2.0          # inches beside it
LEAST_HEIGHT = 5.2    # inches below the head, for the column
MOST_NAMES = 6        # of tools
NAME_HEIGHT = 0.25    # inches
LETTERS = 8           # of the title per inch


def compose(image, heading, line, tools, view, scale, n_names):
    """A figure of these parts; `tools`: names and colours; `scale`: its edges, its label, and on
    which sides values lie beyond it, below room for a number of names; None: no scale."""
    width, height = image.shape[1] / DOTS, image.shape[0] / DOTS
    body = max(height, LEAST_HEIGHT)
    size = width + COLUMN, body + HEAD
    figure = plt.figure(figsize=size)
    scene = figure.add_axes([0, (body - height) / 2 / size[1], width / size[0], height / size[1]])
    scene.imshow(image, aspect="auto")
    scene.set_axis_off()
    scene.set_label("scene")
    heading = textwrap.shorten(heading, int(LETTERS * size[0]), placeholder=" ...")
    figure.text(0.12 / size[0], 1 - 0.12 / size[1], heading, fontsize=12, va="top", weight="bold")
    figure.text(0.12 / size[0], 1 - 0.36 / size[1], line, fontsize=11, va="top")
    left = (width + 0.15) / size[0]
    add_names(figure, tools, left, body / size[1])
    top = body - NAME_HEIGHT * (min(n_names, MOST_NAMES + 1) + 1)
    if scale is not None:
        add_scale(figure, scale, [left, 1.0 / size[1], 0.2 / size[0], (top - 1.0) / size[1]])
    add_axes(figure, view, [left, 0.05 / size[1], 0.7 / size[0], 0.7 / size[1]])
    return figure


def add_names(figure, tools, left, top):
    """The tools and their colours, those beyond a number of them in a count."""
    handles = [matplotlib.patches.Patch(facecolor=paler(colour), edgecolor=colour, label=name)
               for name, colour in tools[:MOST_NAMES]]
    if len(tools) > MOST_NAMES:
        handles.append(matplotlib.patches.Patch(facecolor="none", edgecolor="none",
                                                label=f"and {len(tools) - MOST_NAMES} more"))
    if handles:
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(left, top), fontsize=10,
                      borderaxespad=0, handlelength=1.2)


def add_scale(figure, scale, box):
    levels, label, extend = scale
    colours = colours_of(levels)
    cmap = matplotlib.colors.ListedColormap(colours).with_extremes(under=colours[0],
                                                                   over=colours[-1])
    norm = matplotlib.colors.BoundaryNorm(levels, len(colours))
    axes = figure.add_axes(box)
    bar = figure.colorbar(matplotlib.cm.ScalarMappable(norm, cmap), cax=axes, extend=extend,
                          ticks=levels, spacing="proportional")
    bar.ax.set_yticklabels(level_texts(levels), fontsize=10)
    bar.ax.minorticks_off()
    bar.set_label(label, fontsize=10)


def add_axes(figure, view, box):
    """The directions of the coordinates."""
    axes = figure.add_axes(box)
    axes.set(xlim=(-1, 1), ylim=(-1, 1))
    axes.set_axis_off()
    arrows = view.project(np.eye(3))
    for name, (right, up, _) in zip("xyz", arrows):
        axes.annotate("", 0.7 * np.array([right, up]), (0, 0),
                      arrowprops={"arrowstyle": "->", "shrinkA": 0, "shrinkB": 0})
        axes.text(0.9 * right, 0.9 * up, name, ha="center", va="center", fontsize=10)
