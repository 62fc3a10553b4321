"""Angles between straight stretches of a section of the sheet, and the curl of each: released, and
of the same material as formed.

A stretch is straight where the radius of curvature exceeds `--radius`; of the stretches found,
those shorter than `--shortest` are passed over. `--stretch FROM TO` takes stretches of material
instead, by their coordinates along the sheet at the start. Lines are fitted by least squares of the
distance, circles by Kasa's method; a stretch has a radius where its circle fits much better than
its line. Of a U-section from the bottom outwards the first two angles are theta 1 (bottom and wall)
and theta 2 (wall and flange) of NUMISHEET'93.
"""
import sys

import numpy as np

from post.results import Results, ResultsError
from post.section import Section
from post.section_line import add_section_argument
from post.springback_picture import draw
from post.steps import frame_before_release
from post.style import save

BETTER = 0.3   # a circle must be as much closer to a stretch than its line to have a radius


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
    add_section_argument(command)


def run(arguments):
    with Results(arguments.file) as results:
        figure = measured(results, arguments)
    save(figure, arguments.out)
    return 0


def measured(results, arguments):
    """The picture of the angles, which are printed too."""
    frame = results.frame(arguments.frame, arguments.time)
    section = Section(results, arguments.section)
    print(section.place)
    parts = stretches(section, frame, arguments)
    formed = frame_before_release(results, frame)
    if "is_failed" in results.file["frames"] and results.file["frames/is_failed"][frame]:
        print("warning: this frame is where the run failed, not a released part", file=sys.stderr)
    states = [State("section" if formed is None else "released", section, frame, parts)]
    if formed is not None:
        states.insert(0, State("formed", section, formed, parts))
    for state in states:
        state.angles = angles_of(state, states[0])
        state.tell(section.start)
    tell_angles(states)
    return draw(section, states)


def stretches(section, frame, arguments):
    """Places of each stretch along the section."""
    if arguments.stretch:
        return [by_start(section.start, *bounds) for bounds in arguments.stretch]
    thickness = float(np.median(section.thickness(frame)))
    parts = straight_parts(section.sheet(frame)[1], arguments.radius or 30 * thickness,
                           arguments.shortest or 8 * thickness)
    if len(parts) < 2:
        raise ResultsError(f"{len(parts)} straight stretch found, an angle needs two: change "
                           "--radius or --shortest, or give --stretch")
    return parts


class State:
    """The section at a frame with the fits of its stretches."""

    def __init__(self, name, section, frame, parts):
        self.name, self.parts = name, parts
        self.time = section.results.times[frame]
        self.line = section.sheet(frame)[1]
        self.fits = [fitted(self.line[part]) for part in parts]
        self.turns = [turn_between(a, b) for a, b in zip(self.fits, self.fits[1:])]
        self.angles = []

    def tell(self, start):
        """A table of the stretches."""
        print(f"{self.name}, time {self.time:.4g}")
        print(f"{'stretch':>7} {'from':>10} {'to':>10} {'length':>10} {'direction':>10} "
              f"{'off line':>9} {'radius':>10}")
        for i, (part, fit) in enumerate(zip(self.parts, self.fits)):
            print(f"{i + 1:7d} {start[part[0]]:10.3f} {start[part[-1]]:10.3f} "
                  f"{fit['length']:10.3f} {fit['direction']:10.3f} {fit['rms']:9.2g} "
                  f"{fit['radius']:10.4g}")


def tell_angles(states):
    """The angles of all states, and how much the release has changed them."""
    for i, angles in enumerate(zip(*(state.angles for state in states))):
        text = ", ".join(f"{angle:.3f} degrees {state.name}" if len(states) > 1 else
                         f"{angle:.3f} degrees" for angle, state in zip(angles, states))
        change = f", springback {angles[1] - angles[0]:+.3f} degrees" if len(states) > 1 else ""
        print(f"angle between stretches {i + 1} and {i + 2}: {text}{change}")


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
    """Line and circle of a stretch: direction in degrees, distance from the line, length, radius
    and centre of the circle."""
    middle = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - middle)
    along = axes[0] * np.sign((points[-1] - points[0]) @ axes[0])
    off = (points - middle) @ [-along[1], along[0]]
    radius, centre = circle(points - middle)
    rms = float(np.sqrt(np.mean(off**2)))
    if np.isfinite(radius):
        off_circle = np.linalg.norm(points - middle - centre, axis=1) - radius
        if np.sqrt(np.mean(off_circle**2)) > BETTER * rms:
            radius = float("inf")
    return {"direction": float(np.degrees(np.arctan2(along[1], along[0]))), "along": along,
            "middle": middle, "rms": rms,
            "length": float(np.ptp((points - middle) @ along)),
            "radius": radius, "circle": middle + centre}


def circle(points):
    """Radius and centre of the circle that fits best in the algebraic sense (I. Kasa 1976); inf for
    a line."""
    size = np.abs(points).max()
    matrix = np.column_stack([points / size, np.ones(len(points))])
    solution, _, rank, values = np.linalg.lstsq(matrix, np.sum((points / size)**2, axis=1),
                                                rcond=None)
    if rank < 3 or values[-1] < 1e-6 * values[0]:
        return float("inf"), np.full(2, np.inf)
    centre = 0.5 * solution[:2]
    return float(size * np.sqrt(solution[2] + np.sum(centre**2))), size * centre


def wrapped(degrees):
    """An angle between -180 and 180 degrees."""
    return (degrees + 180) % 360 - 180


def turn_between(a, b):
    """By how much the direction of a stretch differs from that of the one before, in degrees."""
    return wrapped(b["direction"] - a["direction"])


def angles_of(state, first):
    """Angles enclosed by neighbouring stretches, 180 degrees if one continues in the direction of
    the other, and more if they are bent to the other side than those of the first state."""
    return [180 - (-1 if before < 0 else 1) * (before + wrapped(turn - before))
            for turn, before in zip(state.turns, first.turns)]
