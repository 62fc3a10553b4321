"""A scene drawn by matplotlib, triangles from the farthest to the nearest: for machines on which
VTK cannot draw. Surfaces that nearly touch may show through each other."""
import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection

from post.bands import colours_of
from post.style import paler

LIGHT = 0.35          # least brightness of a triangle that is seen from its edge


def draw_flat(scene, view, job):
    """The scene as an array of colours."""
    levels = np.array(job["levels"])
    corners, colours = [], []
    for part in [scene.sheet, *scene.tools]:
        is_shown = np.ones(len(part.triangles), dtype=bool)
        base = np.array(paler(part.colour)) if part.colour else None
        if base is None:
            values = part.values[part.triangles].mean(axis=1)
            band = np.clip(np.searchsorted(levels, values, "right") - 1, 0, len(levels) - 2)
            base = colours_of(levels)[band, :3]
        else:
            is_shown = scene.shown(part, view)
        triangles = part.points[part.triangles]
        corners.append(triangles[is_shown])
        colours.append((base * brightness(triangles, view))[is_shown])
    return painted(view.project(np.concatenate(corners)), np.concatenate(colours), job)


def brightness(triangles, view):
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    share = np.abs(normals @ view.to_eye) / np.where(lengths > 0, lengths, 1)
    return (LIGHT + (1 - LIGHT) * share)[:, None]


def painted(corners, colours, job):
    """Triangles on the screen, the nearest last."""
    order = np.argsort(corners[..., 2].mean(axis=1))
    (left, bottom), (right, top) = job["box"]
    figure = matplotlib.figure.Figure(figsize=np.array(job["window"]) / 100, dpi=100)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes([0, 0, 1, 1], xlim=(left, right), ylim=(bottom, top))
    axes.set_axis_off()
    axes.add_collection(PolyCollection(corners[order, :, :2], facecolors=colours[order],
                                       edgecolors=colours[order], linewidths=0.3))
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]
