"""Draws the part with a texture by its strains, in a process of its own:
`python -m post.zone_render JOB`, see zone_map.py."""
import json
import sys

import numpy as np
import pyvista

from post.render import add_lines, look, new_plotter, shaded
from post.results import Results
from post.view import view_of
from post.zone_map import scene_of_layer


def main(text):
    job = json.loads(text)
    frame = job["frames"][0]
    with Results(job["file"]) as results, np.load(job["table"]) as zones:
        scene = scene_of_layer(results, frame, job["layer"], job["planes"])
        part = shaded(scene.sheet)
        places = (part["values"] - zones["low"]) / (zones["high"] - zones["low"])
        part.active_texture_coordinates = np.clip(places, 0, 1)
        texture = pyvista.Texture(zones["texture"][::-1])
        texture.interpolate = False
        plotter = new_plotter(job["window"])
        plotter.add_mesh(part, texture=texture, smooth_shading=True, specular=0.0, ambient=0.45,
                         diffuse=0.65)
        add_lines(plotter, scene)
        look(plotter, view_of(results), job["box"])
        plotter.screenshot(job["images"][0])


if __name__ == "__main__":
    main(sys.argv[1])
