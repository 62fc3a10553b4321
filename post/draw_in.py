"""Draw-in: how far the edge of the sheet has moved inwards along chosen directions."""
import numpy as np

from post.labels import Labels
from post.results import Results, ResultsError
from post.style import BLANK, plt, save, tool_colour

N_PER_ELEMENT = 8    # places along an edge
ROOM = 0.2          # around the outline, part of its size
SAME = 1e-6          # of the sheet's size: edges that coincide at the start are joined


def add_arguments(command):
    command.add_argument("--angles", type=float, nargs="+", metavar="DEGREES",
                         default=[0.0, 45.0, 90.0],
                         help="directions in the plane of the sheet, from its first coordinate "
                              "axis (default: 0 45 90)")
    command.add_argument("--centre", type=float, nargs=2, metavar=("A", "B"),
                         help="point that the directions start from (default: the origin if it is "
                              "within the sheet or on its planes of symmetry, else the middle of "
                              "the sheet)")
    which = command.add_mutually_exclusive_group()
    which.add_argument("--times", type=float, nargs="+", metavar="T",
                       help="times to show (default: the end)")
    which.add_argument("--tool", nargs="+", metavar=("NAME", "STROKE"),
                       help="show the frames nearest to these strokes of a tool")


def run(arguments):
    with Results(arguments.file) as results:
        frames = frames_of(results, arguments)
        outline = Outline(results, arguments.centre)
        unit = results.unit("VTKHDF/Points")
        start = outline.radii(outline.at(None), arguments.angles)
        rows = []
        for frame in frames:
            now = outline.radii(outline.at(frame), arguments.angles)
            rows += [(results.times[frame], angle, a, b, a - b)
                     for angle, a, b in zip(arguments.angles, start, now)]
        print(f"{'time':>12} {'angle':>7} {'start':>10} {'now':>10} {'draw-in':>10} [{unit}]")
        for row in rows:
            print("{:12.5g} {:7.4g} {:10.4f} {:10.4f} {:10.4f}".format(*row))
        figure = draw(results, outline, frames, arguments.angles, unit)
    save(figure, arguments.out)
    return 0


def frames_of(results, arguments):
    if arguments.times:
        return [results.frame(time=t) for t in arguments.times]
    if not arguments.tool:
        return [last_with_edge(results)]
    name, *strokes = arguments.tool
    if name not in results.tools or not strokes:
        raise ResultsError(f"--tool needs one of {', '.join(results.tools)} and strokes")
    moved = np.linalg.norm(results.tool_history(name, "displacement"), axis=1)
    at_frames = np.interp(results.times, results.tool_history(name, "time"), moved)
    try:
        return [int(np.argmin(np.abs(at_frames - float(stroke)))) for stroke in strokes]
    except ValueError:
        raise ResultsError("strokes must be numbers") from None


def last_with_edge(results):
    """The last frame at which nothing of the sheet is trimmed."""
    start = results.patches[0].elements_left(0)
    if start is None:
        return len(results.times) - 1
    for frame in reversed(range(len(results.times))):
        if np.array_equal(results.patches[0].elements_left(frame), start):
            return frame
    return 0


class Outline:
    """The outer edges of the sheet's mid-surface, seen along its normal."""

    def __init__(self, results, centre=None):
        self.results = results
        first = results.patches[0]
        n = first.n_elements
        corner = self._start(first, [0, n[0]], [0, n[1]], [0, n[2]])
        normal = np.cross(corner[0, 0, 1] - corner[0, 0, 0], corner[0, 1, 0] - corner[0, 0, 0])
        up = int(np.argmax(np.abs(normal)))
        self.axes = [axis for axis in range(3) if axis != up]
        self.names = ["xyz"[axis] for axis in self.axes]
        self.edges = self._outer_edges()
        points = np.concatenate(self.at(None))
        low, high = points.min(axis=0), points.max(axis=0)
        self.size = np.linalg.norm(high - low)
        if centre is None:
            centre = self._default_centre(low, high)
        self.centre = np.asarray(centre, dtype=float)

    def _default_centre(self, low, high):
        """The origin if it is within the sheet or on its planes of symmetry, else the middle of the
        sheet."""
        slack = SAME * self.size
        deck = self.results.deck
        for axis, a, b in zip(self.axes, low, high):
            reach = slack if deck.symmetric_faces("XYZ"[axis]) or not deck.records else -slack
            if a > reach or b < -reach:
                return 0.5 * (low + high)
        return np.zeros(2)

    @staticmethod
    def _start(patch, xi, eta, zeta):
        return (patch.sample("Points", 0, xi, eta, zeta)
                - patch.sample("displacement", 0, xi, eta, zeta))

    def _outer_edges(self):
        """Edges of the patches that lie on no other edge, as (patch, xi, eta)."""
        edges, middles = [], []
        first = self.results.patches[0]
        if first.elements_left(0) is not None:       # such a sheet has one patch
            return [(first, line, None) for line in first.edge_lines(0)] + self._edges_left(first)
        for patch in self.results.patches:
            n = patch.n_elements
            lines = [np.linspace(0, n[d], N_PER_ELEMENT * n[d] + 1) for d in (0, 1)]
            for xi, eta in (([0], lines[1]), ([n[0]], lines[1]),
                            (lines[0], [0]), (lines[0], [n[1]])):
                line = self._line(patch, xi, eta, None)[:, self.axes]
                edges.append((patch, xi, eta))
                middles.append(np.concatenate([line[len(line) // 2],
                                               0.5 * (line[0] + line[-1])]))
        middles = np.array(middles)
        reach = SAME * np.ptp(middles, axis=0).max()
        n_same = [np.count_nonzero(np.linalg.norm(middles - m, axis=1) <= reach) for m in middles]
        return [edge for edge, n in zip(edges, n_same) if n == 1]

    @staticmethod
    def _edges_left(patch):
        """The parts of the patch's own edges that an outline leaves, as lines of places."""
        n = patch.n_elements
        is_left = np.pad(patch.elements_left(0), 1)
        xi, eta = (np.linspace(0, n[d], N_PER_ELEMENT * n[d] + 1) for d in (0, 1))
        lines = []
        for axis, line in ((0, xi), (1, eta)):
            for end in (0, n[1 - axis]):
                places = np.full((len(line), 2), float(end))
                places[:, axis] = line
                element = np.clip((line - 1e-9).astype(int), 0, n[axis] - 1) + 1
                beside = 1 if end == 0 else n[1 - axis]
                there = is_left[beside, element] if axis == 0 else is_left[element, beside]
                there = there & (patch.inside(0, xi if axis == 0 else [end],
                                              [end] if axis == 0 else eta).ravel() > 0)
                cuts = np.flatnonzero(np.diff(there.astype(int))) + 1
                lines += [(patch, part, None) for part, kept in
                          zip(np.split(places, cuts), np.split(there, cuts))
                          if kept[0] and len(part) > 1]
        return lines

    def _line(self, patch, xi, eta, frame):
        zeta = [0.5 * patch.n_elements[2]]
        if eta is None:                              # an outline
            points = patch.at("Points", frame or 0, xi, zeta[0])
            if frame is None:
                points = points - patch.at("displacement", 0, xi, zeta[0])
        elif frame is None:
            points = self._start(patch, xi, eta, zeta)
        else:
            points = patch.sample("Points", frame, xi, eta, zeta)
        return points.reshape(-1, 3)

    def at(self, frame):
        """Lines (n, 2) at a frame; None: the start."""
        return [line[:, self.axes] for line in self.in_space(frame)]

    def in_space(self, frame):
        """The same with all coordinates, (n, 3)."""
        return [self._line(*edge, frame) for edge in self.edges]

    def radii(self, lines, angles):
        """Distance from the centre to the farthest edge along each direction."""
        return [self._radius(lines, angle) for angle in angles]

    def _radius(self, lines, angle):
        turn = np.radians(angle)
        along = np.array([np.cos(turn), np.sin(turn)])
        far = []
        for line in lines:
            r = (line - self.centre) @ along
            side = (line - self.centre) @ [-along[1], along[0]]
            side[np.abs(side) < 1e-4 * self.size] = 0
            far.extend(r[side == 0])
            i = np.flatnonzero(side[:-1] * side[1:] < 0)
            t = side[i] / (side[i] - side[i + 1])
            far.extend(r[i] + t * (r[i + 1] - r[i]))
        far = [r for r in far if r > 0]
        if not far:
            raise ResultsError(f"no edge of the sheet lies in the direction of {angle:g} degrees "
                               f"from {tuple(float(c) for c in self.centre)}")
        return float(max(far))


def draw(results, outline, frames, angles, unit):
    """The outline at the start and at the frames, with the draw-in of the last along each
    direction."""
    figure, axis = plt.subplots(figsize=(6.5, 6), layout="constrained")
    start = outline.at(None)
    lines = list(start)
    for i, line in enumerate(start):
        axis.plot(*line.T, "--", color="#777777", linewidth=0.9, label=None if i else "start")
    for k, frame in enumerate(frames):
        colour = BLANK if k == len(frames) - 1 else tool_colour(k)
        lines += outline.at(frame)
        for i, line in enumerate(outline.at(frame)):
            label = f"time {results.times[frame]:.4g} {results.unit('VTKHDF/Steps/Values')}"
            axis.plot(*line.T, color=colour, label=None if i else label)
    rays = [np.array([np.cos(turn), np.sin(turn)]) for turn in np.radians(angles)]
    before, now = (outline.radii(edges, angles) for edges in (start, outline.at(frames[-1])))
    for ray, radius in zip(rays, before):
        lines.append(np.array([outline.centre, outline.centre + radius * ray]))
        axis.plot(*lines[-1].T, color="#bbbbbb", linewidth=0.7)
    axis.set_aspect("equal")
    axis.margins(ROOM)
    axis.set(xlabel=f"{outline.names[0]} [{unit}]", ylabel=f"{outline.names[1]} [{unit}]",
             title="Edge of the sheet and draw-in")
    figure.legend(fontsize=8, loc="outside lower center", ncols=4)
    labels = Labels(axis, lines)
    for angle, ray, a, b in zip(angles, rays, before, now):
        labels.put(f"{angle:g}°\n{a - b:.2f} {unit}", outline.centre + a * ray, ray)
    return figure
