"""Draws a frame with VTK: `python -m post.render FILE FRAME FIELD LOW HIGH PNG TOOL`, the sheet if
TOOL is empty. See picture.py."""
import sys

import numpy as np
import pyvista

from post.picture import colour_label, magnitude, title
from post.results import Results
from post.section import Section
from post.style import COLOUR_MAP, tool_colour

N_PARTS = 4            # cuts of an element along and across the sheet
N_TOOL_PARTS = 6
WINDOW = (1600, 1000)
COLOUR_BAR = {"color": "black", "vertical": False, "width": 0.5, "position_x": 0.25,
              "position_y": 0.03, "height": 0.07, "fmt": "%.3g", "n_labels": 4}


def skin(results, frame, field):
    """The faces and edges of the sheet as a surface with the field on it."""
    surfaces = [patch_skin(patch, frame, field) for patch in results.patches]
    return surfaces[0] if len(surfaces) == 1 else surfaces[0].merge(surfaces[1:])


def patch_skin(patch, frame, field):
    n = patch.n_elements
    xi, eta, zeta = (np.linspace(0, n[d], k * n[d] + 1) for d, k in ((0, N_PARTS), (1, N_PARTS),
                                                                    (2, 2)))
    points = patch.sample("Points", frame, xi, eta, zeta)
    values = patch.sample(field, frame, xi, eta, zeta)
    values = magnitude(values)
    grid = pyvista.StructuredGrid(*(points[..., d] for d in range(3)))
    grid.point_data[field] = values.ravel(order="F")
    return grid.extract_surface(algorithm="dataset_surface")


def element_lines(results, frame):
    """The boundaries of the elements, a little off both faces so that these do not hide them."""
    lines = pyvista.MultiBlock()
    for patch in results.patches:
        n = patch.n_elements
        fine = [np.linspace(0, n[d], 2 * N_PARTS * n[d] + 1) for d in range(2)]
        for zeta in (-0.05, n[2] + 0.05):
            along = patch.sample("Points", frame, fine[0], np.arange(n[1] + 1), [zeta])[0]
            across = patch.sample("Points", frame, np.arange(n[0] + 1), fine[1], [zeta])[0]
            for line in [*along, *np.swapaxes(across, 0, 1)]:
                lines.append(pyvista.lines_from_points(line))
    return lines.combine()


def is_above(points, sheet, up):
    """Whether a tool lies above the sheet where both are close to each other."""
    some = points[::max(len(points) // 300, 1)]
    nearest = sheet.points[[sheet.find_closest_point(point) for point in some]]
    close = np.argsort(np.linalg.norm(some - nearest, axis=1))[:max(len(some) // 3, 1)]
    return ((some - nearest)[close] @ up).mean() > 0


def surface_of(points, corners):
    return pyvista.PolyData(points, np.hstack([np.full((len(corners), 1), 4), corners]))


def tool_skin(results, tool, frame, field):
    """A tool with the field on it."""
    points, corners, values = results.tool_field(tool, field, frame, N_TOOL_PARTS)
    surface = surface_of(points, corners)
    surface.point_data[field] = values
    return surface


def add_tools(plotter, results, frame, sheet):
    """Tools in glass with their outlines, those above the sheet clearer; names in a legend."""
    labels = []
    up = Section(results).axes[1]
    for i, (points, corners) in enumerate(results.tool_surfaces(frame, N_TOOL_PARTS)):
        if not len(points):
            continue
        mesh = surface_of(points, corners)
        mesh = mesh.clean(tolerance=1e-6).compute_normals(auto_orient_normals=False)
        opacity = 0.06 if is_above(points, sheet, up) else 0.3
        plotter.add_mesh(mesh, color=tool_colour(i), opacity=opacity, smooth_shading=True)
        outline = mesh.extract_feature_edges(boundary_edges=True, feature_edges=False,
                                             manifold_edges=False, non_manifold_edges=False)
        if outline.n_cells:
            plotter.add_mesh(outline, color=tool_colour(i), line_width=3)
        labels.append([results.tools[i], tool_colour(i)])
    if labels:
        plotter.add_legend(labels, bcolor=None, face="rectangle", size=(0.11, 0.07),
                           loc="upper right")


def main(path, frame, field, low, high, out, tool):
    frame = int(frame)
    with Results(path) as results:
        plotter = pyvista.Plotter(off_screen=True, window_size=WINDOW)
        plotter.set_background("white")
        plotter.enable_anti_aliasing("ssaa")
        plotter.enable_depth_peeling(8)
        surface = tool_skin(results, tool, frame, field) if tool else skin(results, frame, field)
        label = colour_label(results, field, surface[field].max() > float(high))
        size = surface.length
        plotter.add_mesh(surface, scalars=field, cmap=COLOUR_MAP, smooth_shading=True,
                         clim=(float(low), float(high)),
                         split_sharp_edges=True, specular=0.2, ambient=0.25,
                         scalar_bar_args={"title": label + "\n", **COLOUR_BAR})
        if not tool:
            add_elements(plotter, results, frame)
            add_tools(plotter, results, frame, surface)
        text = f"{tool}, {title(results, frame)}" if tool else title(results, frame)
        plotter.add_text(text, position="upper_left", font_size=12, color="black")
        plotter.add_axes(color="black")
        look(plotter, size, Section(results).axes)
        plotter.screenshot(out)


def add_elements(plotter, results, frame):
    """Lines between the elements, unless there are too many to see."""
    if sum(np.prod(patch.n_elements[:2]) for patch in results.patches) > 5000:
        return
    lines = plotter.add_mesh(element_lines(results, frame), color="black", opacity=0.3,
                             line_width=1)
    lines.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    lines.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0, -4)


def look(plotter, size, axes):
    """From the front, above and a little aside; the sheet's length runs to the right, up is across
    its thickness."""
    along, up = axes
    front = np.cross(along, up)
    plotter.camera.up = up
    centre = np.array(plotter.center)
    plotter.camera.focal_point = centre
    plotter.camera.position = centre + 3 * size * (-0.35 * along + 0.45 * up + 0.8 * front)
    plotter.reset_camera()
    plotter.camera.zoom(1.3)


if __name__ == "__main__":
    main(*sys.argv[1:])
