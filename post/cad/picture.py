"""A picture of the faces in colours with their numbers."""
import os
import tempfile

import matplotlib
import numpy as np
from PIL import Image

from post.cad.choice import direction
from post.cad.facets import facets_of
from post.layout import DOTS, HEAD, add_axes
from post.picture import LARGEST, draw_with_vtk, window_of
from post.results import ResultsError, counted
from post.style import paler, plt, save
from post.view import View

FOOT = 0.8               # inches below the scene, for the axes
COLOURS = [paler(colour, 0.55) for colour in matplotlib.colormaps["tab10"].colors]
HIDDEN = 0.9             # of grey: faces of the file that are not taken
LEAST_PIXELS = 60        # of a face that gets its number
MOST_NUMBERS = 400
NUMBER_SIZE = 7
LINE_PIXELS, HALF_DIGIT = 20, 5


def draw_picture(model, faces, facts, arguments):
    """Draw the faces that are taken in colours, the others in grey."""
    low = np.min([one.low for one in facts.values()], axis=0)
    high = np.max([one.high for one in facts.values()], axis=0)
    facets = facets_of(model.faces, float(np.linalg.norm(high - low)))
    if not len(facets.triangles):
        raise ResultsError("no face can be triangulated for the picture")
    view = view_for(arguments)
    place = window_of(box_on_screen(facets, view), LARGEST)
    with tempfile.TemporaryDirectory() as folder:
        image, owners = images(facets, model, faces, view, place, folder)
    save(compose(image, owners, model, faces, view), arguments.picture, arguments.small)


def view_for(arguments):
    """The eye is above, or where --seen-from has it."""
    towards = np.array(direction(arguments.seen_from)) if arguments.seen_from else np.eye(3)[2]
    axis = int(np.argmax(np.abs(towards)))
    return View(axis, 1 if towards[axis] > 0 else -1)


def box_on_screen(facets, view):
    places = view.project(facets.points)[:, :2]
    return np.array([places.min(axis=0), places.max(axis=0)])


def images(facets, model, faces, view, place, folder):
    """The scene as an array of colours, and the index of the face in each pixel, -1: none."""
    taken = {face.number for face in faces}
    numbers = [face.number for face in model.faces]
    colours = np.array([COLOURS[number % len(COLOURS)] if number in taken else (HIDDEN,) * 3
                        for number in numbers])
    mesh = os.path.join(folder, "facets.npz")
    np.savez(mesh, points=facets.points, triangles=facets.triangles, owners=facets.owners,
             colours=colours)
    job = {"mesh": mesh, "frames": [0], "axis": view.up_axis, "above": view.above,
           "images": [os.path.join(folder, "scene.png"), os.path.join(folder, "owners.png")],
           **place}
    reason = draw_with_vtk(job, "post.cad.render")
    if reason is not None:
        raise ResultsError(f"VTK cannot draw here: {reason}")
    scene, code = (np.asarray(Image.open(path).convert("RGB")) for path in job["images"])
    owners = code.astype(int) @ [1, 256, 65536] - 1
    return scene, np.where(owners < len(numbers), owners, -1)


def compose(image, owners, model, faces, view):
    """The scene with the numbers in the faces that are seen."""
    height, width = image.shape[:2]
    size = width / DOTS, height / DOTS + HEAD + FOOT
    figure = plt.figure(figsize=size)
    axes = figure.add_axes([0, FOOT / size[1], 1, height / DOTS / size[1]])
    axes.imshow(image, aspect="auto")
    axes.set_axis_off()
    axes.set_label("scene")
    shown = numbers_on(axes, owners, model, {face.number for face in faces})
    figure.text(0.12 / size[0], 1 - 0.12 / size[1], os.path.basename(model.path), fontsize=12,
                va="top", weight="bold")
    figure.text(0.12 / size[0], 1 - 0.36 / size[1],
                f"{len(faces)} of {counted(len(model.faces), 'face')}; {shown} numbered",
                fontsize=11, va="top")
    add_axes(figure, view, [0.1 / size[0], 0.05 / size[1], 0.7 / size[0], 0.7 / size[1]])
    return figure


def numbers_on(axes, owners, model, taken):
    """Write numbers into the faces with enough pixels, large faces first, well inside them and
    beside each other; returns how many."""
    found, counts = np.unique(owners[owners >= 0], return_counts=True)
    order = found[np.argsort(-counts)][:MOST_NUMBERS]
    shown = []
    for i in order:
        text = str(model.faces[i].number)
        if int(text) not in taken or counts[found == i] < LEAST_PIXELS:
            continue
        row, column = inner_pixel(owners == i)
        if any(abs(row - other_row) < LINE_PIXELS
               and abs(column - other_column) < HALF_DIGIT * (len(text) + len(other) + 1)
               for other, other_row, other_column in shown):
            continue
        axes.text(column, row, text, fontsize=NUMBER_SIZE, ha="center", va="center",
                  bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.6})
        shown.append((text, row, column))
    return len(shown)


def inner_pixel(mask):
    """A pixel of a mask that lies well inside it: the last left when it is worn off its edges."""
    rows, columns = np.nonzero(mask)
    top, left = rows.min(), columns.min()
    inner = np.pad(mask[top:rows.max() + 1, left:columns.max() + 1], 1)
    step = 1
    while True:
        worn = inner.copy()
        for axis in (0, 1):
            for way in (-step, step):
                worn &= shifted(inner, way, axis)
        if not worn.any():
            break
        inner, step = worn, min(2 * step, 8)
    rows, columns = np.nonzero(inner)
    nearest = np.hypot(rows - rows.mean(), columns - columns.mean()).argmin()
    return rows[nearest] + top - 1, columns[nearest] + left - 1


def shifted(mask, way, axis):
    """The mask moved along an axis, with nothing where it has left."""
    moved = np.zeros_like(mask)
    source, target = [slice(None)] * 2, [slice(None)] * 2
    source[axis] = slice(None, -way) if way > 0 else slice(-way, None)
    target[axis] = slice(way, None) if way > 0 else slice(None, way)
    moved[tuple(target)] = mask[tuple(source)]
    return moved
