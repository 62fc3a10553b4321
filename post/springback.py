"""Angles between straight stretches of the sheet's mid-section, and the curl of each.

A stretch is straight where the radius of curvature exceeds `--radius`; of the stretches found,
those shorter than `--shortest` are passed over. `--stretch FROM TO` takes stretches of material
instead, by their coordinates along the sheet at the start. Lines are fitted by least squares of the
distance, circles by Kasa's method. Of a U-section from the bottom outwards the first two angles are
theta 1 (bottom and wall) and theta 2 (wall and flange) of NUMISHEET'93.
"""
import numpy as np

from post.results import Results, ResultsError
from post.section import Section
from post.style import BLANK, plt, save, tool_colour


def add_arguments(command):
    which = command.add_mutually_exclusive_group()
    which.add_argument("--frame", type=int, metavar="N",
                       help="frame from 0, negative from the end (default: the last)")
    which.add_argument("--time", type=float, metavar="T", help="the frame nearest to this time")
    command.add_argument("--stretch", type=float, nargs=2, action="append",
                         metavar=("FROM", "TO"), help="a stretch by coordinates along the sheet at "
                         "the start; give two or more")
    command.add_argument("--radius", type=float, metavar="R",
                         help="least radius of what counts as straight (default: 30 thicknesses)")
    command.add_argument("--shortest", type=float, metavar="L",
                         help="length of the shortest stretch (default: 8 thicknesses)")


def run(arguments):
    with Results(arguments.file) as results:
        frame = results.frame(arguments.frame, arguments.time)
        section = Section(results)
        line = section.sheet(frame)[1]
        thickness = float(np.median(section.thickness(frame)))
        if arguments.stretch:
            parts = [by_start(section.start, *bounds) for bounds in arguments.stretch]
        else:
            parts = straight_parts(line, arguments.radius or 30 * thickness,
                                   arguments.shortest or 8 * thickness)
        if len(parts) < 2:
            raise ResultsError(f"{len(parts)} straight stretch found, an angle needs two: change "
                               "--radius or --shortest, or give --stretch")
        unit = results.unit("VTKHDF/Points")
        fits = [fitted(line[part]) for part in parts]
        print(f"{'stretch':>7} {'from':>10} {'to':>10} {'length':>10} {'direction':>10} "
              f"{'off line':>9} {'radius':>10}")
        for i, (part, fit) in enumerate(zip(parts, fits)):
            print(f"{i + 1:7d} {section.start[part[0]]:10.3f} {section.start[part[-1]]:10.3f} "
                  f"{fit['length']:10.3f} {fit['direction']:10.3f} {fit['rms']:9.2g} "
                  f"{fit['radius']:10.4g}")
        for i, (a, b) in enumerate(zip(fits, fits[1:])):
            print(f"angle between stretches {i + 1} and {i + 2}: {angle_between(a, b):.3f} degrees")
        figure = draw(section, line, parts, fits, unit)
    save(figure, arguments.out)
    return 0


def by_start(start, low, high):
    """Places whose coordinate at the start lies between two bounds."""
    places = np.flatnonzero((start >= min(low, high)) & (start <= max(low, high)))
    if len(places) < 3:
        raise ResultsError(f"no stretch of the sheet lies between {low:g} and {high:g}: it goes "
                           f"from {start.min():g} to {start.max():g}")
    return places


def straight_parts(line, radius, shortest):
    """Runs of places where the line is straighter than `radius` over at least `shortest`."""
    steps = np.diff(line, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    turns = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))
    curvature = np.abs(turns) / (0.5 * (lengths[:-1] + lengths[1:]))
    is_straight = np.concatenate([curvature[:1], curvature, curvature[-1:]]) * radius < 1
    arc = np.concatenate([[0], np.cumsum(lengths)])
    edges = np.flatnonzero(np.diff(np.concatenate([[0], is_straight.astype(int), [0]])))
    return [np.arange(a, b) for a, b in zip(edges[::2], edges[1::2])
            if b - a >= 3 and arc[b - 1] - arc[a] >= shortest]


def fitted(points):
    """Line and circle of a stretch: direction in degrees, distance from the line, length and
    radius."""
    centre = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - centre)
    along = axes[0] * np.sign((points[-1] - points[0]) @ axes[0])
    off = (points - centre) @ [-along[1], along[0]]
    return {"direction": float(np.degrees(np.arctan2(along[1], along[0]))), "along": along,
            "centre": centre, "rms": float(np.sqrt(np.mean(off**2))),
            "length": float(np.ptp((points - centre) @ along)),
            "radius": circle_radius(points - centre)}


def circle_radius(points):
    """Radius of the circle that fits best in the algebraic sense (I. Kasa 1976); inf for a line."""
    size = np.abs(points).max()
    matrix = np.column_stack([points / size, np.ones(len(points))])
    solution, _, rank, values = np.linalg.lstsq(matrix, np.sum((points / size)**2, axis=1),
                                                rcond=None)
    if rank < 3 or values[-1] < 1e-6 * values[0]:
        return float("inf")
    return float(size * np.sqrt(solution[2] + 0.25 * np.sum(solution[:2]**2)))


def angle_between(a, b):
    """Angle enclosed by two stretches, 180 degrees if one goes on in the direction of the other."""
    turn = b["direction"] - a["direction"]
    return 180 - abs((turn + 180) % 360 - 180)


def draw(section, line, parts, fits, unit):
    figure, axis = plt.subplots(figsize=(8, 5), layout="constrained")
    axis.plot(*line.T, color=BLANK, linewidth=0.9, label="mid-section")
    for i, (part, fit) in enumerate(zip(parts, fits)):
        half = 0.5 * fit["length"] * fit["along"]
        ends = np.array([fit["centre"] - 1.15 * half, fit["centre"] + 1.15 * half])
        axis.plot(*ends.T, color=tool_colour(i), linewidth=0.8)
        axis.plot(*line[part].T, color=tool_colour(i), linewidth=2.2, alpha=0.6,
                  label=f"stretch {i + 1}, {fit['direction']:.2f} degrees")
    for a, b in zip(fits, fits[1:]):
        middle = 0.5 * (a["centre"] + b["centre"])
        axis.annotate(f"{angle_between(a, b):.2f}°", middle, fontsize=9)
    axis.set_aspect("equal")
    axis.set(xlabel=f"{section.axis_names[0]} [{unit}]", ylabel=f"{section.axis_names[1]} [{unit}]")
    axis.legend(fontsize=8)
    return figure
