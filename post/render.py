"""Draws frames with VTK: `python -m post.render JOB`, a job in JSON as `Job.text` of picture.py has
it. A process of its own, since a machine without usable graphics libraries can end it."""
import json
import sys
from dataclasses import replace

import numpy as np
import pyvista
from matplotlib.colors import ListedColormap
from vtkmodules.vtkFiltersHybrid import vtkPolyDataSilhouette

from post.bands import colours_of
from post.picture import scene_of
from post.results import Results
from post.scene import welded
from post.style import SIDES, paler
from post.view import view_of

EDGE_ANGLE = 40.0      # degrees between facets that make an edge of the shading


def shaded(part):
    """A mesh with normals that are smooth but at edges."""
    part = welded(part)
    mesh = pyvista.PolyData.from_regular_faces(part.points, part.triangles)
    if part.values is not None:
        mesh.point_data["values"] = part.values
    return mesh.compute_normals(split_vertices=True, feature_angle=EDGE_ANGLE,
                                auto_orient_normals=False, consistent_normals=False)


def add_sheet(plotter, scene, levels):
    """The sheet in bands of colour, and the lines between its elements."""
    plotter.add_mesh(shaded(scene.sheet), scalars="values", cmap=ListedColormap(colours_of(levels)),
                     n_colors=len(levels) - 1, clim=(levels[0], levels[-1]), smooth_shading=True,
                     specular=0.1, ambient=0.35, diffuse=0.7, show_scalar_bar=False)
    add_lines(plotter, scene)


def add_lines(plotter, scene):
    """The lines between the elements, if there are few enough."""
    if scene.lines:
        lines = plotter.add_mesh(lines_mesh(scene.lines), color="black", opacity=0.3, line_width=2)
        lines.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        lines.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0, -4)


def lines_mesh(arrays):
    """One mesh of arrays of lines (lines, points, 3)."""
    cells, n = [], 0
    for lines in arrays:
        count, length = lines.shape[:2]
        numbers = n + np.arange(count * length).reshape(count, length)
        cells.append(np.column_stack([np.full(count, length), numbers]).ravel())
        n += count * length
    return pyvista.PolyData(np.concatenate([lines.reshape(-1, 3) for lines in arrays]),
                            lines=np.concatenate(cells))


def add_tools(plotter, scene, view):
    """Tools where the sheet lies before them, and the outlines of all."""
    for colour in sorted({part.colour for part in scene.tools}):
        parts = [part for part in scene.tools if part.colour == colour]
        fronts = [shaded(replace(part, triangles=part.triangles[is_shown])) for part in parts
                  if (is_shown := scene.shown(part, view)).any()]
        if fronts:
            plotter.add_mesh(pyvista.merge(fronts, merge_points=False), color=paler(colour),
                             smooth_shading=True, ambient=0.4, diffuse=0.65)
        outline = pyvista.merge([outline_of(part, view) for part in parts], merge_points=False)
        if outline.n_cells:
            plotter.add_mesh(outline, color=colour, line_width=4)


def outline_of(part, view):
    """Edges of a surface, and where it turns away from the eye."""
    part = welded(part)
    outline = vtkPolyDataSilhouette()
    outline.SetInputData(pyvista.PolyData.from_regular_faces(part.points, part.triangles))
    outline.SetDirectionToSpecifiedVector()
    outline.SetVector(*(-view.to_eye))
    outline.SetEnableFeatureAngle(False)
    outline.SetBorderEdges(True)
    outline.Update()
    return pyvista.wrap(outline.GetOutput())


def look(plotter, view, box):
    """Parallel to the rule of the view; the box (right and up from, to) fills the picture."""
    low, high = np.array(box)
    middle = 0.5 * (low + high) @ np.array([view.right, view.up])
    camera = plotter.camera
    camera.focal_point = middle
    camera.position = middle + 10 * np.linalg.norm(high - low) * view.to_eye
    camera.up = view.up
    camera.parallel_projection = True
    camera.parallel_scale = 0.5 * (high - low)[1]
    plotter.reset_camera_clipping_range()


def add_setup(plotter, results, scene, view):
    """The blank in one colour; tools behind it in the colours of their two sides."""
    plotter.add_mesh(shaded(replace(scene.sheet, values=None)), color=SIDES["blank"],
                     ambient=0.35, diffuse=0.7)
    for part in scene.tools:
        plotter.add_mesh(outline_of(part, view), color=part.colour, line_width=4)
        if scene.place_of(part, view.up_axis)[0] == (view.above > 0):
            triangles = part.triangles[:, ::results.side(part.name)]
            plotter.add_mesh(shaded(replace(part, triangles=triangles)), color=SIDES["sheet side"],
                             ambient=0.35, diffuse=0.7, backface_params={"color": SIDES["back"]})


def new_plotter(window):
    plotter = pyvista.Plotter(off_screen=True, window_size=window)
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def draw(results, job, i):
    """The picture of a frame, or a view of a set-up."""
    is_setup = "views" in job
    view = view_of(results, job["views"][i]["above"] if is_setup else 1)
    place = job["views"][i] if is_setup else job
    plotter = new_plotter(place["window"])
    scene = scene_of(results, job["frames"][i], job)
    if is_setup:
        add_lines(plotter, scene)
        add_setup(plotter, results, scene, view)
    else:
        add_sheet(plotter, scene, np.array(job["levels"]))
        add_tools(plotter, scene, view)
    look(plotter, view, place["box"])
    plotter.screenshot(job["images"][i])
    plotter.close()


def main(text):
    job = json.loads(text)
    with Results(job["file"]) as results:
        for i in range(len(job["frames"])):
            draw(results, job, i)


if __name__ == "__main__":
    main(sys.argv[1])
