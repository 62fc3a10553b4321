"""The formed sheet in 3-D, coloured by a field, with the tools, drawn without a display.

VTK draws it in a process of its own, since a machine without usable graphics libraries can end that
process; matplotlib then draws a simpler picture.
"""
import json
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass

import numpy as np
from PIL import Image

from post.bands import round_levels
from post.fields import MEANINGS, OF_TOOLS, PRINCIPAL, RESULTANTS, available, source_of
from post.flat import draw_flat
from post.layout import compose
from post.mirror import parse_axes, planes_of
from post.results import Results, ResultsError, text_of
from post.scene import Scene, magnitude
from post.style import SHADED, save
from post.view import view_of

TIME_LIMIT = 600          # seconds for VTK
LARGEST = 1400, 1000      # pixels of the scene
MARGIN = 0.03             # of the larger side around it
LEAST_SHARE = 0.6, 0.15   # of the height that is the width, and of the width


def add_arguments(command):
    which = command.add_mutually_exclusive_group()
    which.add_argument("--frame", type=int, metavar="N",
                       help="frame from 0, negative from the end (default: the last)")
    which.add_argument("--time", type=float, metavar="T", help="the frame nearest to this time")
    add_size_argument(command)
    add_common_arguments(command)


def add_size_argument(command):
    command.add_argument("--small", action="store_const", const=SHADED,
                         help="write a PNG with 256 colours, a fifth as large")


def add_common_arguments(command):
    """Those of a film too."""
    command.add_argument("--field", metavar="NAME",
                         help="field of the colours, such as thinning, mises, displacement_z or "
                              "stress_xx; an unknown one lists all (default: eqps)")
    command.add_argument("--range", type=float, nargs=2, metavar=("LOW", "HIGH"),
                         help="range of the colours, extended to whole bands (default: without the"
                              " highest 2 %% of the sheet, which edges that were hit would fill)")
    command.add_argument("--tool", metavar="NAME",
                         help="show contact_pressure (default) or wear on this tool instead")
    command.add_argument("--mirror", type=parse_axes, default=(), metavar="AXES",
                         help="complete a half or quarter by its images in planes across X, Y, Z "
                              "or several of them (XY): the plane of XSYMM on X_MIN or X_MAX, "
                              "else x = 0; likewise the others")
    command.add_argument("--renderer", choices=("auto", "vtk", "matplotlib"), default="auto",
                         help="what draws (default: VTK, or matplotlib if VTK cannot)")


def run(arguments):
    with Results(arguments.file) as results:
        frame = results.frame(arguments.frame, arguments.time)
        job, contents = new_job(results, [frame], arguments)
        with tempfile.TemporaryDirectory() as folder:
            [image] = images_of(results, job, arguments.renderer, folder)
        save(finished(results, job, contents[0], image), arguments.out, arguments.small)
    return 0


@dataclass
class Contents:
    """What the text of a picture tells of a scene."""
    frame: int
    tools: list           # names and colours
    limits: tuple         # of the values
    box: np.ndarray       # lower left and upper right corner on the screen


def new_job(results, frames, arguments, largest=LARGEST):
    """What to draw, in terms of JSON, and the contents of each frame. Colours and the part of
    space that is shown are the same in all frames."""
    field = arguments.field or ("contact_pressure" if arguments.tool else "eqps")
    check_field(results, field, arguments.tool)
    limits = arguments.range
    if not limits:
        low, high = np.transpose([colour_limits(results, frame, field, arguments.tool)
                                  for frame in frames])
        limits = float(low.min()), float(high.max())
    job = {"file": os.path.abspath(arguments.file), "frames": frames, "field": field,
           "tool": arguments.tool, "levels": round_levels(*limits).tolist(),
           "planes": planes_of(results, arguments.mirror)}
    contents = [contents_of(results, frame, job) for frame in frames]
    job["extend"] = extension(job["levels"], [content.limits for content in contents])
    job["n_names"] = max(len(content.tools) for content in contents)
    boxes = np.array([content.box for content in contents])
    box = np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    return job | window_of(box, largest), contents


def window_of(box, largest):
    """A part of the screen with a margin, and its pixels."""
    middle, size = box.mean(axis=0), np.ptp(box, axis=0)
    size = np.maximum(size + 2 * MARGIN * size.max(), LEAST_SHARE * size[::-1])
    pixels = (size * np.min(largest / size)).astype(int)
    return {"box": [(middle - size / 2).tolist(), (middle + size / 2).tolist()],
            "window": pixels.tolist()}


def extension(levels, limits):
    """On which sides values lie beyond the scale, in the words of matplotlib."""
    slack = 1e-3 * (levels[1] - levels[0])
    is_below = min(low for low, _ in limits) < levels[0] - slack
    is_above = max(high for _, high in limits) > levels[-1] + slack
    return (("neither", "max"), ("min", "both"))[is_below][is_above]


def contents_of(results, frame, job):
    scene = scene_of(results, frame, job)
    values = scene.sheet.values
    return Contents(frame, [(part.name, part.colour) for part in scene.tools],
                    (float(values.min()), float(values.max())),
                    scene.box(view_of(results)))


def scene_of(results, frame, job):
    """The scene of a frame with its images."""
    scene = Scene(results, frame, job["field"], job["tool"])
    for axis, place in job["planes"]:
        scene.mirror(axis, place)
    return scene


def check_field(results, field, tool):
    """The file has the field, and the tool or the sheet does."""
    names = available(results)
    if field == "stress" and "stress_xx" in names:
        raise ResultsError("stress is a tensor: name a component or a principal value, "
                           + ", ".join(name for name in names if source_of(name) == "stress")
                           + "; mises is the von Mises stress")
    if field not in names:
        hint = ""
        for source, option in (("stress", "STRESS"), ("contact_pressure", "CONTACT"),
                               ("wear", "WEAR"), *((name, "RESULTANTS") for name in RESULTANTS)):
            if source_of(field) == source:
                hint = f"; the deck asks for it by *OUTPUT, FIELDS={option}"
        raise ResultsError(f"there is no field {field} in '{results.path}'; it has "
                           f"{', '.join(names)}{hint}")
    if tool and field not in OF_TOOLS:
        raise ResultsError(f"{field} is no field of tools; those are {' and '.join(OF_TOOLS)}")
    if field == "wear" and not tool:
        raise ResultsError("wear is a field of tools: say on which one with --tool NAME")


def colour_limits(results, frame, field, tool=None):
    """From the least value (of the plastic strain 0) to the one that 2 % exceed, if they exceed it
    by much."""
    if tool:
        return 0.0, float(results.tool_field(tool, field, frame, 1)[2].max())
    values = np.concatenate([magnitude(patch.field_inside(field, frame)).ravel()
                             for patch in results.patches])
    values = values[np.isfinite(values)]
    low = 0.0 if field in ("eqps", "edge_distance") else float(values.min())
    high = float(np.quantile(values, 0.98))
    if values.max() - low < 1.5 * (high - low) or high <= low:
        high = float(values.max())
    return low, high


def images_of(results, job, renderer, folder):
    """The scenes as arrays of colours, by VTK or else by matplotlib."""
    if renderer != "matplotlib":
        job["images"] = [os.path.join(folder, f"{i}.png") for i in range(len(job["frames"]))]
        reason = draw_with_vtk(job)
        if reason is None:
            return [np.asarray(Image.open(path).convert("RGB")) for path in job["images"]]
        if renderer == "vtk":
            raise ResultsError(f"VTK cannot draw here: {reason}")
        print(f"post: VTK cannot draw here ({reason}); a simpler picture instead", file=sys.stderr)
    return [draw_flat(scene_of(results, frame, job), view_of(results), job)
            for frame in job["frames"]]


def draw_with_vtk(job, module="post.render"):
    """Draw in another process by a module that takes the job; why it failed, or None."""
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join(sys.path))
    try:
        done = subprocess.run([sys.executable, "-m", module, json.dumps(job)],
                              capture_output=True, text=True, env=environment, check=False,
                              timeout=TIME_LIMIT * len(job["frames"]))
    except subprocess.TimeoutExpired:
        return f"no picture after {TIME_LIMIT} s"
    if done.returncode == 0 and all(map(os.path.exists, job["images"])):
        return None
    plain = re.sub(r"\x1b\[[0-9;]*m", "", done.stderr)   # VTK colours its messages
    lines = [line for line in plain.splitlines() if line.strip()]
    return lines[-1] if lines else f"exit code {done.returncode}"


def finished(results, job, contents, image):
    """The picture: scene, title, names, colours."""
    line = time_text(results, contents.frame)
    if job["tool"]:
        line = f"{job['tool']}, {line}"
    return compose(image, text_of(results.file["provenance/heading"][()]), line, contents.tools,
                   view_of(results), (np.array(job["levels"]), label_of(results, job["field"]),
                                      job["extend"]), job["n_names"])


def time_text(results, frame):
    unit = results.unit("VTKHDF/Steps/Values")
    return f"time {results.times[frame]:.4g}" + f" {unit}" * (unit != "time")


def label_of(results, field):
    """Meaning and unit."""
    source = source_of(field)
    unit = results.unit_of_field(source)
    meaning = PRINCIPAL.get(field, (0, MEANINGS.get(field)))[1]
    meaning = meaning or f"{source} {field.removeprefix(source + '_')}"
    return meaning if unit == "1" else f"{meaning} [{unit}]"
