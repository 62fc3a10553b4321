"""The picture of springback: sections, angles as arcs between what they measure, radii of curl."""
import numpy as np

from post.labels import Labels
from post.style import BLANK, TOOLS, plt, titled

COLOURS = {"formed": "#8a8a8a", "released": BLANK, "section": BLANK}
MEASURE = TOOLS[0]
CURVED = 0.08        # a stretch that turns by more than this is drawn as a circle [rad]
ARC = 0.055          # radius of the arcs, part of the picture's width
ROOM = 0.08          # around the sections, part of their size
FLATTEST = 0.45      # height of the picture over its width
SECANT = 0.5 / 3**0.5   # where a curve crosses its fitted line, from the middle, part of its length
EVEN = 175           # degrees: beyond it, on both sides of 180, two lines show the angle, no arc
CORNERS = 0.5        # from the sections, part of their size: corners that the picture shows


def draw(section, states):
    """The sections of all states; of the last one what was measured."""
    unit = section.results.unit("VTKHDF/Points")
    low, high = window(states)
    size = (high - low).max()
    figure, axis = plt.subplots(figsize=(1.2, 1.5) + 8 * (high - low) / size,
                                layout="constrained")
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    lines = []
    for state in states:
        lines += draw_state(axis, state, len(states) > 1, section)
    last = states[-1]
    lines += [line for fit, part in zip(last.fits, last.parts)
              for line in draw_fit(axis, fit, last.line[part])]
    axis.set(xlabel=f"{section.axis_names[0]} [{unit}]", ylabel=f"{section.axis_names[1]} [{unit}]")
    names = [" → ".join(state.name for state in states)] * (len(states) > 1)
    axis.set_title(titled(", ".join([*names, section.name])))
    figure.legend(fontsize=8, loc="outside lower center", ncols=2)
    corners = [draw_corner(axis, last, i, ARC * size) for i in range(len(last.angles))]
    lines += [line for _, _, pieces in corners for line in pieces]
    labels = Labels(axis, lines)
    for i, (place, along, _) in enumerate(corners):
        labels.put(angle_text(states, i), place, along)
    for i, fit in enumerate(last.fits):
        if is_curved(fit):
            place = last.line[last.parts[i][len(last.parts[i]) // 2]]
            labels.put(radius_text(states, i, unit), place, fit["circle"] - place, MEASURE)
    return figure


def window(states):
    """Corners of the picture: the sections, and room for the labels."""
    points = np.concatenate([state.line for state in states])
    low, high = points.min(axis=0), points.max(axis=0)
    near = CORNERS * (high - low)
    for corner in corners_of(states[-1]):
        if np.all((corner > low - near) & (corner < high + near)):
            points = np.concatenate([points, [corner]])
    low, high = points.min(axis=0), points.max(axis=0)
    size = (high - low).max()
    room = np.maximum(ROOM * size, 0.5 * (FLATTEST * size - (high - low)))
    return low - room, high + room


def is_even(angle):
    """Whether the sheet continues nearly straight."""
    return abs(angle - 180) < 180 - EVEN


def corners_of(state):
    """Where the fitted lines of each angle meet, unless they are nearly parallel."""
    return [meeting(a, b) for a, b, angle in zip(state.fits, state.fits[1:], state.angles)
            if not is_even(angle)]


def is_curved(fit):
    """Whether one sees the curvature of a stretch."""
    return fit["length"] / fit["radius"] > CURVED


def draw_state(axis, state, is_named, section):
    name = state.name if is_named else "mid-surface"
    axis.plot(*state.line.T, color=COLOURS[state.name], linewidth=1.4,
              label=f"{name}, time {state.time:.4g} "
                    f"{section.results.unit('VTKHDF/Steps/Values')}")
    return [state.line]


def draw_fit(axis, fit, points):
    """A straight stretch as a band, a curved one as a piece of its circle with a radius."""
    if not is_curved(fit):
        axis.plot(*points.T, color=MEASURE, linewidth=5, alpha=0.25, solid_capstyle="butt")
        return []
    rays = points[[0, -1]] - fit["circle"]
    angles = np.unwrap(np.arctan2(rays[:, 1], rays[:, 0]))
    turn = np.linspace(*angles, 60)
    arc = fit["circle"] + fit["radius"] * np.column_stack([np.cos(turn), np.sin(turn)])
    axis.plot(*arc.T, color=MEASURE, linewidth=2.2, linestyle="--")
    return [arc]


def draw_corner(axis, state, i, radius):
    """The arc of an angle at the corner of two fitted lines, with the lines as its legs, which end
    where a curved stretch crosses them: the place of its label, the direction to put it, and the
    lines drawn."""
    a, b = state.fits[i], state.fits[i + 1]
    if is_even(state.angles[i]):
        return draw_even(axis, a, b)
    corner = meeting(a, b)
    legs = [fit["middle"] - corner for fit in (a, b)]
    reach = [np.linalg.norm(leg) - SECANT * fit["length"] if is_curved(fit) else 0
             for leg, fit in zip(legs, (a, b))]
    legs = [leg / np.linalg.norm(leg) for leg in legs]
    first, second = np.unwrap([np.arctan2(leg[1], leg[0]) for leg in legs])
    if state.angles[i] > 180:
        second -= np.copysign(2 * np.pi, second - first)
    turn = np.linspace(first, second, 40)
    arc = corner + radius * np.column_stack([np.cos(turn), np.sin(turn)])
    axis.plot(*arc.T, color="black", linewidth=1)
    drawn = [arc]
    for leg, length in zip(legs, reach):
        line = np.array([corner, corner + max(length, 1.5 * radius) * leg])
        axis.plot(*line.T, color="black", linewidth=0.7, linestyle=(0, (4, 3)))
        drawn.append(line)
    middle = np.array([np.cos(turn[20]), np.sin(turn[20])])
    return corner + radius * middle, middle, drawn


def draw_even(axis, a, b):
    """Both fitted lines through the gap between the stretches; between them is the angle. Returns
    as `draw_corner`."""
    ends = [a["middle"] + 0.5 * a["length"] * a["along"],
            b["middle"] - 0.5 * b["length"] * b["along"]]
    gap = np.linalg.norm(ends[1] - ends[0])
    drawn = [np.array([ends[0], ends[0] + gap * a["along"]]),
             np.array([ends[1] - gap * b["along"], ends[1]])]
    for line in drawn:
        axis.plot(*line.T, color="black", linewidth=0.7, linestyle=(0, (4, 3)))
    return 0.5 * (ends[0] + ends[1]), np.array([0.0, 1.0]), drawn


def meeting(a, b):
    """Point where two fitted lines meet."""
    matrix = np.column_stack([a["along"], -b["along"]])
    return a["middle"] + np.linalg.solve(matrix, b["middle"] - a["middle"])[0] * a["along"]


def angle_text(states, i):
    return f"angle {i + 1}: " + " → ".join(f"{state.angles[i]:.1f}°" for state in states)


def radius_text(states, i, unit):
    """Radius of a stretch in all states; as formed it may be straight."""
    texts = [f"{state.fits[i]['radius']:.0f} {unit}" if is_curved(state.fits[i]) else "straight"
             for state in states]
    return "radius: " + " → ".join(texts)
