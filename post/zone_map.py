"""The zones of the forming-limit diagram on the part, with a legend beside it.

The strains of a layer are the coordinates of a texture, a picture of the diagram's zones: so zones
meet in sharp lines within the elements too. VTK draws the part as in `post picture`.
"""
import os
import tempfile
import textwrap

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch
from PIL import Image

from post import picture
from post.layout import compose
from post.mirror import planes_of
from post.results import ResultsError, text_of
from post.view import view_of
from post.zones import ZONES

SIDE = 1024                              # pixels of the texture
NAME_LETTERS = 18                        # of a line of the legend
STRAINS = "minor_strain", "major_strain"
PLACES = {"middle": 0.5, "top": 1.0, "bottom": 0.0}   # of the layers through the thickness


class Layer:
    """A patch with the fields of one layer at all places through its thickness."""

    def __init__(self, patch, layer):
        self.patch, self.n_elements = patch, patch.n_elements
        self.zeta = [PLACES[layer] * patch.n_elements[2]]

    def elements_left(self, frame):
        return self.patch.elements_left(frame)

    def inside(self, frame, xi, eta):
        return self.patch.inside(frame, xi, eta)

    def sample(self, name, frame, xi, eta, zeta):
        if name not in STRAINS:
            return self.patch.sample(name, frame, xi, eta, zeta)
        return np.repeat(self.patch.sample(name, frame, xi, eta, self.zeta), len(zeta), axis=0)


class LayerOf:
    """A result as one of its layers shows it."""

    def __init__(self, results, layer):
        self.results = results
        self.patches = [Layer(patch, layer) for patch in results.patches]

    def __getattr__(self, name):
        return getattr(self.results, name)


def scene_of_layer(results, frame, layer, planes):
    """The scene of a frame; the values of its sheet are minor and major strain."""
    scenes = [picture.scene_of(LayerOf(results, layer), frame,
                               {"field": field, "tool": None, "planes": planes})
              for field in STRAINS]
    scenes[0].sheet.values = np.column_stack([scene.sheet.values for scene in scenes])
    return scenes[0]


def draw(results, frame, layer, borders, name, mirror=()):
    """A figure with the part; zones that do not occur are not named."""
    view, planes = view_of(results), planes_of(results, mirror)
    sheet = scene_of_layer(results, frame, layer, planes).sheet
    places = view.project(sheet.points)[:, :2]
    job = {"file": os.path.abspath(results.path), "frames": [frame], "layer": layer,
           "planes": planes,
           **picture.window_of(np.array([places.min(axis=0), places.max(axis=0)]),
                               picture.LARGEST)}
    image = drawn_part(job, borders, sheet.values.min(axis=0), sheet.values.max(axis=0))
    figure = compose(image, text_of(results.file["provenance/heading"][()]),
                     f"forming-limit zones, {name}, {picture.time_text(results, frame)}", [], view,
                     None, 0)
    here = set(borders.zone(*sheet.values.T))
    scene = figure.axes[0].get_position()
    figure.legend(handles=[Patch(color=zone.colour, label=textwrap.fill(zone.name, NAME_LETTERS))
                           for i, zone in enumerate(ZONES) if i in here],
                  loc="upper left", bbox_to_anchor=(scene.x1, scene.y1), fontsize=10)
    return figure


def drawn_part(job, borders, low, high):
    """Pixels of the part."""
    high = np.maximum(high, low + 1e-12)
    strains = np.meshgrid(*np.linspace(low, high, SIDE).T)
    colours = np.array([to_rgb(zone.colour) for zone in ZONES])[borders.zone(*strains)]
    with tempfile.TemporaryDirectory() as folder:
        job["table"] = os.path.join(folder, "zones.npz")
        job["images"] = [os.path.join(folder, "part.png")]
        np.savez(job["table"], texture=(255 * colours + 0.5).astype(np.uint8), low=low, high=high)
        reason = picture.draw_with_vtk(job, "post.zone_render")
        if reason is not None:
            raise ResultsError(f"VTK cannot draw here: {reason}")
        return np.asarray(Image.open(job["images"][0]).convert("RGB"))
