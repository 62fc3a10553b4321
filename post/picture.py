"""The formed sheet in 3-D, coloured by a field, with the tools, drawn without a display.

VTK draws it in a process of its own, since a machine without usable graphics libraries can end that
process; matplotlib then draws a simpler picture.
"""
import os
import re
import subprocess
import sys

import numpy as np

from post.results import Results, ResultsError
from post.style import COLOUR_MAP, plt, save, tool_colour

FIELDS = {"eqps": "equivalent plastic strain", "mises": "von Mises stress",
          "thickness": "thickness", "thinning": "thinning",
          "major_strain": "major strain", "minor_strain": "minor strain",
          "contact_pressure": "contact pressure", "wear": "wear", "displacement": "displacement",
          "velocity": "velocity"}
TIME_LIMIT = 600   # seconds for VTK


def add_arguments(command):
    which = command.add_mutually_exclusive_group()
    which.add_argument("--frame", type=int, metavar="N",
                       help="frame from 0, negative from the end (default: the last)")
    which.add_argument("--time", type=float, metavar="T", help="the frame nearest to this time")
    command.add_argument("--field", choices=FIELDS,
                         help="field of the colours (default: eqps)")
    command.add_argument("--range", type=float, nargs=2, metavar=("LOW", "HIGH"),
                         help="range of the colours (default: without the highest 2 %% of it,"
                              " which edges that were hit would fill)")
    command.add_argument("--tool", metavar="NAME",
                         help="show contact_pressure (default) or wear on this tool instead")
    command.add_argument("--renderer", choices=("auto", "vtk", "matplotlib"), default="auto",
                         help="what draws (default: VTK, or matplotlib if VTK cannot)")


def run(arguments):
    with Results(arguments.file) as results:
        frame = results.frame(arguments.frame, arguments.time)
        field = arguments.field or ("contact_pressure" if arguments.tool else "eqps")
        check_field(field, arguments)
        limits = arguments.range or colour_limits(results, frame, field, arguments.tool)
        if arguments.renderer != "matplotlib":
            reason = draw_with_vtk(arguments.file, frame, field, limits, arguments.out,
                                   arguments.tool)
            if reason is None:
                print(f"picture written: {arguments.out}")
                return 0
            if arguments.renderer == "vtk":
                raise ResultsError(f"VTK cannot draw here: {reason}")
            print(f"post: VTK cannot draw here ({reason}); a simpler picture instead",
                  file=sys.stderr)
        if arguments.tool:
            figure = draw_tool_with_matplotlib(results, arguments.tool, frame, field, limits)
        else:
            figure = draw_with_matplotlib(results, frame, field, limits)
        save(figure, arguments.out)
    return 0


def check_field(field, arguments):
    """Some fields are those of tools, some those of the sheet."""
    if arguments.tool and field not in ("contact_pressure", "wear"):
        raise ResultsError(f"{field} is no field of tools; those are contact_pressure and wear")
    if field == "wear" and not arguments.tool:
        raise ResultsError("wear is a field of tools: say on which one with --tool NAME")


def colour_limits(results, frame, field, tool=None):
    """From the least value (of the plastic strain 0) to the one that 2 % exceed, if they exceed it
    by much."""
    if tool:
        return 0.0, max(float(results.tool_field(tool, field, frame, 1)[2].max()), 1e-12)
    values = np.concatenate([magnitude(patch.field(field, frame)).ravel()
                             for patch in results.patches])
    low = 0.0 if field == "eqps" else float(values.min())
    high = float(np.quantile(values, 0.98))
    if values.max() - low < 1.5 * (high - low) or high <= low:
        high = float(values.max())
    return low, max(high, low + 1e-12 * max(abs(low), 1))


def magnitude(values):
    """The values of a scalar field, the lengths of a vector field."""
    return values[..., 0] if values.shape[-1] == 1 else np.linalg.norm(values, axis=-1)


def draw_with_vtk(path, frame, field, limits, out, tool=None):
    """Draw in another process; why it failed, or None."""
    command = [sys.executable, "-m", "post.render", path, str(frame), field,
               *(repr(float(limit)) for limit in limits), out, tool or ""]
    environment = dict(os.environ)
    environment["PYTHONPATH"] = os.pathsep.join(sys.path)
    if os.path.exists(out):
        os.remove(out)
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT,
                              env=environment, check=False)
    except subprocess.TimeoutExpired:
        return f"no picture after {TIME_LIMIT} s"
    if done.returncode == 0 and os.path.exists(out):
        return None
    plain = re.sub(r"\x1b\[[0-9;]*m", "", done.stderr)   # VTK colours its messages
    lines = [line for line in plain.splitlines() if line.strip()]
    return lines[-1] if lines else f"exit code {done.returncode}"


def surface_samples(patch, frame, field, n_parts):
    """Upper face of a patch of the sheet and the field on it, on a grid of places."""
    n = patch.n_elements
    xi = np.linspace(0, n[0], n_parts * n[0] + 1)
    eta = np.linspace(0, n[1], n_parts * n[1] + 1)
    points = patch.sample("Points", frame, xi, eta, [n[2]])[0]
    values = patch.sample(field, frame, xi, eta, [n[2]])[0]
    return points, magnitude(values)


def draw_with_matplotlib(results, frame, field, limits):
    samples = [surface_samples(patch, frame, field, 2) for patch in results.patches]
    largest = max(values.max() for _, values in samples)
    figure = plt.figure(figsize=(10, 6), layout="constrained")
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    norm = plt.Normalize(*limits)
    for i, (nodes, corners) in enumerate(results.tool_surfaces(frame, 2)):
        if len(nodes):
            axes.plot_trisurf(nodes[:, 0], nodes[:, 2], nodes[:, 1], color=tool_colour(i),
                              triangles=np.concatenate([corners[:, [0, 1, 2]],
                                                        corners[:, [0, 2, 3]]]),
                              alpha=0.15, linewidth=0)
    for points, values in samples:
        x, z, y = np.moveaxis(points, -1, 0)
        axes.plot_surface(x, y, z, facecolors=plt.get_cmap(COLOUR_MAP)(norm(values)), rstride=1,
                          cstride=1, linewidth=0, antialiased=False, shade=False)
    box = [np.ptp(limit()) for limit in (axes.get_xlim, axes.get_ylim, axes.get_zlim)]
    axes.set_box_aspect(box, zoom=1.25)
    axes.set(xlabel="x", ylabel="z", zlabel="y")
    figure.colorbar(plt.cm.ScalarMappable(norm, COLOUR_MAP), ax=axes, shrink=0.6, extend="max",
                    label=colour_label(results, field, largest > limits[1]))
    figure.suptitle(title(results, frame))
    return figure


def draw_tool_with_matplotlib(results, tool, frame, field, limits):
    points, corners, values = results.tool_field(tool, field, frame, 2)
    figure = plt.figure(figsize=(10, 6), layout="constrained")
    axes = figure.add_subplot(projection="3d")
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    surface = axes.plot_trisurf(points[:, 0], points[:, 2], points[:, 1], triangles=triangles,
                                cmap=COLOUR_MAP, norm=plt.Normalize(*limits), linewidth=0)
    surface.set_array(values[triangles].mean(axis=1))
    axes.set_box_aspect([np.ptp(limit()) for limit in (axes.get_xlim, axes.get_ylim,
                                                       axes.get_zlim)], zoom=1.25)
    axes.set(xlabel="x", ylabel="z", zlabel="y")
    figure.colorbar(surface, ax=axes, shrink=0.6,
                    label=colour_label(results, field, values.max() > limits[1]))
    figure.suptitle(f"{tool}, {title(results, frame)}")
    return figure


def title(results, frame):
    return f"time {results.times[frame]:.4g} {results.unit('VTKHDF/Steps/Values')}"


def colour_label(results, field, is_exceeded):
    unit = results.unit(f"VTKHDF/PointData/{field}")
    label = FIELDS[field] if unit == "1" else f"{FIELDS[field]} [{unit}]"
    return label + ", more in places" if is_exceeded else label
