"""Draws faces with VTK: `python -m post.cad.render JOB`, a job in JSON as picture.py has it: a
shaded scene, and one whose colours are the numbers of the faces."""
import json
import sys

import numpy as np
import pyvista

from post.render import look, new_plotter
from post.view import View

EDGE = "#404040"


def scene_mesh(data):
    mesh = pyvista.PolyData.from_regular_faces(data["points"], data["triangles"])
    mesh.cell_data["colours"] = np.round(255 * data["colours"][data["owners"]]).astype(np.uint8)
    return mesh


def add_edges(plotter, data):
    """Edges of the facets that only one face has: its outline."""
    triangles, owners = data["triangles"], data["owners"]
    pairs = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]],
                                    triangles[:, [2, 0]]]), axis=1)
    keys = np.column_stack([np.tile(owners, 3), pairs])
    _, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
    edges = pairs[first[counts == 1]]
    if len(edges):
        cells = np.column_stack([np.full(len(edges), 2), edges]).ravel()
        lines = plotter.add_mesh(pyvista.PolyData(data["points"], lines=cells), color=EDGE,
                                 line_width=2)
        lines.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        lines.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0, -4)


def draw_scene(job, data, view):
    plotter = new_plotter(job["window"])
    plotter.add_mesh(scene_mesh(data), scalars="colours", rgb=True, ambient=0.45, diffuse=0.6,
                     show_scalar_bar=False)
    add_edges(plotter, data)
    look(plotter, view, job["box"])
    plotter.screenshot(job["images"][0])
    plotter.close()


def draw_numbers(job, data, view):
    """Without light or smoothing: the colour of a pixel is one more than the index of its face."""
    plotter = pyvista.Plotter(off_screen=True, window_size=job["window"], lighting="none")
    plotter.set_background("white")
    plotter.disable_anti_aliasing()
    mesh = pyvista.PolyData.from_regular_faces(data["points"], data["triangles"])
    code = data["owners"] + 1
    mesh.cell_data["code"] = np.stack([code >> shift & 255 for shift in (0, 8, 16)],
                                      axis=1).astype(np.uint8)
    plotter.add_mesh(mesh, scalars="code", rgb=True, lighting=False, show_scalar_bar=False)
    look(plotter, view, job["box"])
    plotter.screenshot(job["images"][1])
    plotter.close()


def main(text):
    job = json.loads(text)
    view = View(job["axis"], job["above"])
    with np.load(job["mesh"]) as data:
        data = dict(data)
    draw_scene(job, data, view)
    draw_numbers(job, data, view)


if __name__ == "__main__":
    main(sys.argv[1])
