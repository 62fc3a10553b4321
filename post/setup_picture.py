"""The picture of a set-up: views from above and below, a section, and what there is to know."""
import os
import textwrap

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection
from PIL import Image

from post.cells import cut_triangles
from post.labels import Labels
from post.layout import add_axes
from post.picture import draw_with_vtk, window_of
from post.results import ResultsError
from post.style import SIDES, plt
from post.view import view_of

SIZE = 14.0, 9.6            # inches
PANEL = 1000, 560           # pixels of a view
ARROW = 0.16                # length, of the diagonal of the scene
BESIDE = 1e-3               # of the sheet, from a plane of symmetry to the section
COLUMNS = 66                # letters of a line of text
WHITE = 250                 # least value of a pixel on which nothing is drawn
MOST_ERRORS = 3             # in the picture; the page has all


def draw(results, facts, folder):
    figure = plt.figure(figsize=SIZE)
    figure.text(0.01, 0.985, facts.heading or "Set-up", fontsize=13, weight="bold", va="top")
    figure.text(0.01, 0.958, "set-up at the start", fontsize=11, va="top")
    add_key(figure)
    views = [view_of(results, above) for above in (1, -1)]
    for view, image, place, left in zip(views, *images(results, facts, views, folder), (0.0, 0.5)):
        add_view(figure, facts, view, image, place, left)
    add_section(figure.add_axes([0.055, 0.06, 0.43, 0.36]), results, facts)
    add_words(figure, facts)
    return figure


def add_key(figure):
    """What the colours mean."""
    names = {"blank": "blank", "sheet side": "side of a tool on which the blank lies",
             "back": "back of a tool"}
    handles = [matplotlib.patches.Patch(facecolor=SIDES[key], label=name)
               for key, name in names.items()]
    handles += [matplotlib.lines.Line2D([], [], color="black", linestyle=style, label=name,
                                        marker=">", markevery=[-1])
                for style, name in (("-", "motion"), ("--", "force"))]
    figure.legend(handles=handles, loc="upper right", bbox_to_anchor=(0.99, 0.99), ncols=5,
                  fontsize=9, borderaxespad=0)


def images(results, facts, views, folder):
    """Both views as arrays of colours, and which part of the screen they show."""
    places = [window_of(facts.scene.box(view) + room_of(facts, view), PANEL) for view in views]
    job = {"file": results.path, "frames": [0, 0], "field": "thickness", "tool": None, "planes": [],
           "views": [place | {"above": view.above} for view, place in zip(views, places)],
           "images": [os.path.join(folder, f"view{i}.png") for i in range(2)]}
    reason = draw_with_vtk(job)
    if reason is not None:
        raise ResultsError(f"VTK cannot draw here: {reason}")
    return [np.asarray(Image.open(path).convert("RGB")) for path in job["images"]], places


def room_of(facts, view):
    """How much the arrows of the tools need around the scene."""
    low, high = facts.scene.box(view)
    tails = [view.project(tail)[:2] for _, tail, _ in arrows(facts)]
    if not tails:
        return 0.0
    return np.array([np.minimum(np.min(tails, axis=0) - low, 0),
                     np.maximum(np.max(tails, axis=0) - high, 0)])


def arrows(facts):
    """Tool, tail and head of each arrow: it ends in the middle of the tool."""
    low, high = (f(facts.sheet.points, axis=0) for f in (np.min, np.max))
    length = ARROW * np.linalg.norm(high - low)
    for fact in facts.tools:
        parts = [part for part in facts.scene.tools if part.name == fact.name]
        if fact.drive is None or not parts or not np.any(fact.drive.vector):
            continue
        middle = 0.5 * (parts[0].points.min(axis=0) + parts[0].points.max(axis=0))
        step = length * fact.drive.vector / np.linalg.norm(fact.drive.vector)
        yield fact, middle - step, middle


def add_view(figure, facts, view, image, place, left):
    """A drawn view with arrows, names and first contacts on it."""
    width, height = image.shape[1], image.shape[0]
    scale = min(0.47 * SIZE[0] / width, 0.44 * SIZE[1] / height)
    axes = figure.add_axes([left + 0.25 - 0.5 * scale * width / SIZE[0], 0.46,
                            scale * width / SIZE[0], scale * height / SIZE[1]])
    (x0, y0), (x1, y1) = place["box"]
    axes.imshow(image, extent=(x0, x1, y0, y1), aspect="auto")
    axes.set_axis_off()
    axes.set_label("scene")
    for fact in facts.tools:
        if fact.has_gap:
            axes.plot(*view.project(fact.place)[:2], "x", color=fact.colour, markersize=8)
    rows, columns = np.nonzero(np.any(image[::2, ::2] < WHITE, axis=2))
    drawn = np.column_stack([(columns + 0.5) / image[::2, ::2].shape[1],
                             1 - (rows + 0.5) / image[::2, ::2].shape[0]])
    draw_arrows(axes, facts, lambda point: view.project(point)[:2], [],
                axes.transAxes.transform(drawn))
    name = "from above" if view.above > 0 else "from below"
    figure.text(left + 0.01, 0.915, name, fontsize=10)
    add_axes(figure, view, [left + 0.005, 0.46, 0.045, 0.045 * SIZE[0] / SIZE[1]])


def draw_arrows(axes, facts, project, lines, points=()):
    """The arrows, and their names where they cover neither lines nor pixels."""
    shown = [(fact, project(tail), project(head)) for fact, tail, head in arrows(facts)]
    shown = [(fact, tail, head) for fact, tail, head in shown if np.any(tail != head)]
    for fact, tail, head in shown:
        style = "--" if fact.drive.kind == "FORCE" else "-"
        axes.annotate("", head, tail, annotation_clip=False,
                      arrowprops={"arrowstyle": "-|>", "linestyle": style, "color": fact.colour,
                                  "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0})
    labels = Labels(axes, [*lines, *(np.array(ends) for _, *ends in shown)], points)
    for fact, tail, head in shown:
        labels.put(fact.name, tail, tail - head, fact.colour)


def section_place(results, facts, axis):
    """Where the sheet is cut: beside a plane of symmetry, else in its middle."""
    low, high = (float(f(facts.sheet.points[:, axis])) for f in (np.min, np.max))
    letter = "XYZ"[axis]
    faces = results.deck.symmetric_faces(letter)
    if f"{letter}_MIN" in faces:
        return low + BESIDE * (high - low)
    if f"{letter}_MAX" in faces:
        return high - BESIDE * (high - low)
    return 0.5 * (low + high) + 1e-7 * (high - low)


def add_section(axes, results, facts):
    """The section across the screen's axes: sheet, tools with both sides, arrows."""
    up = facts.view.up_axis
    right = 1 if up == 0 else 0
    depth = 3 - up - right
    place = section_place(results, facts, depth)
    origin, normal = place * np.eye(3)[depth], np.eye(3)[depth]
    drawn = []
    for part in [facts.scene.sheet, *facts.scene.tools]:
        segments, numbers = cut_triangles(part.points, part.triangles, origin, normal)
        lines = segments[..., [right, up]]
        drawn += list(lines)
        if part is facts.scene.sheet:
            axes.add_collection(LineCollection(lines, colors=SIDES["blank"], linewidths=2.0))
            continue
        corners = part.points[part.triangles[numbers]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = results.side(part.name) * normals[:, [right, up]]
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        shift = 0.006 * np.ptp(facts.sheet.points[:, right]) * normals
        axes.add_collection(LineCollection(lines, colors=SIDES["back"], linewidths=3.0))
        axes.add_collection(LineCollection(lines + shift[:, None], colors=SIDES["sheet side"],
                                           linewidths=3.0))
        axes.add_collection(LineCollection(lines + 0.5 * shift[:, None], linewidths=0.8,
                                           colors=part.colour, label=part.name))
    tails = [tail[[right, up]] for _, tail, _ in arrows(facts)]
    axes.update_datalim(np.reshape(tails, (-1, 2)))
    axes.margins(0.08)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.apply_aspect()
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())    # final, as the labels need them
    axes.set_aspect("equal", adjustable="box")
    draw_arrows(axes, facts, lambda point: point[[right, up]], drawn)
    axes.set(xlabel=f"{'xyz'[right]} [{facts.length}]", ylabel=f"{'xyz'[up]} [{facts.length}]")
    shown = place if abs(place) > 2 * BESIDE * np.ptp(facts.sheet.points[:, depth]) else 0.0
    axes.set_title(f"section at {'xyz'[depth]} = {shown:.4g} {facts.length}", fontsize=10,
                   loc="left")


def add_words(figure, facts):
    """What is known of blank and tools, line by line."""
    top, step = 0.435, 0.0185
    blocks = [("error", "#a00000", [words]) for words in facts.errors[:MOST_ERRORS]]
    blocks += [("blank", "black", facts.blank)]
    blocks += [(fact.name, fact.colour, fact.words) for fact in facts.tools]
    blocks += [("run", "black", facts.run)] if facts.run else []
    for name, colour, words in blocks:
        lines = textwrap.wrap("; ".join(words), COLUMNS)
        if top - step * (len(lines) + 1) < 0.01:
            figure.text(0.52, top, f"{len(facts.tools)} tools in all: see the page", fontsize=9,
                        va="top")
            return
        figure.text(0.52, top, name, fontsize=9, va="top", weight="bold", color=colour)
        for line in lines:
            figure.text(0.60, top, line, fontsize=9, va="top")
            top -= step
        top -= 0.4 * step
