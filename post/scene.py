"""What a picture of a frame shows: the skin of the sheet, lines between its elements, the tools."""
from dataclasses import dataclass

import numpy as np

from post.cells import clip, clip_with_border, triangles_of
from post.style import tool_colour

MOST_FACETS = 40000     # quadrilaterals of a face of the sheet
MOST_OF_TOOLS = 20000   # of all tools
SHEET_PARTS = 4         # cuts of an element along and across the sheet, at most
CUT_PARTS = 8           # of one with an outline
TOOL_PARTS = 12         # cuts of a tool's cell, at most
MOST_ELEMENTS = 5000    # along and across the sheet, for lines between them to be seen
SAMPLES = 2000          # points of the sheet that are compared with
TRIANGLES = 1000        # so many of a tool
SAME = 1e-6             # of the size of the sheet: what is so near to a plane lies in it


@dataclass
class Part:
    """A surface of triangles, with a value at each point or one colour."""
    name: str
    points: np.ndarray
    triangles: np.ndarray
    values: np.ndarray = None
    colour: str = ""


class Scene:
    """Sheet, lines and tools of a frame; or a tool alone with a field on it."""

    def __init__(self, results, frame, field, tool=None):
        self.lines, self.tools = [], []
        if tool:
            self.sheet = Part(tool, *results.tool_field(tool, field, frame, TOOL_PARTS))
            return
        self.sheet = sheet_skin(results, frame, field)
        self.middle = np.concatenate([middle_points(patch, frame) for patch in results.patches])
        if sum(np.prod(patch.n_elements[:2]) for patch in results.patches) <= MOST_ELEMENTS:
            n_parts = sheet_parts(results)
            self.lines = [lines for patch in results.patches
                          for lines in element_lines(patch, frame, n_parts)]
        self.tools = tool_parts(results, frame)

    def mirror(self, axis, place):
        """Add the image of everything behind a plane; tools end at the plane, and what lies in it
        is inside of the whole."""
        side = 1.0 if self.middle[:, axis].mean() > place else -1.0
        for part in self.tools:
            part.points, part.triangles = clip(part.points, part.triangles,
                                               side * (part.points[:, axis] - place))
        in_plane = SAME * np.ptp(self.middle)
        is_off = np.abs(self.sheet.points[:, axis] - place) > in_plane
        self.sheet.triangles = self.sheet.triangles[is_off[self.sheet.triangles].any(axis=1)]
        for part in [self.sheet, *self.tools]:
            n = len(part.points)
            part.triangles = np.concatenate([part.triangles, n + part.triangles[:, ::-1]])
            part.points = np.concatenate([part.points, reflected(part.points, axis, place)])
        self.sheet.values = np.tile(self.sheet.values, 2)
        for lines in list(self.lines):
            is_off = np.abs(lines[..., axis] - place).max(axis=1) > in_plane
            self.lines.append(reflected(lines[is_off], axis, place))
        self.middle = np.concatenate([self.middle, reflected(self.middle, axis, place)])

    def box(self, view):
        """Lower left and upper right corner on the screen."""
        places = view.project(
            np.concatenate([part.points for part in [self.sheet, *self.tools]]))[:, :2]
        return np.array([places.min(axis=0), places.max(axis=0)])

    def shown(self, part, view):
        """Which triangles of a tool are drawn: of a tool below the sheet those whose side on which
        the sheet lies can be seen."""
        is_below, side, normals = self.place_of(part, view.up_axis)
        return is_below & (side * (normals @ view.to_eye) > 0)

    def place_of(self, part, up_axis):
        """Whether a tool lies below the sheet, on which side of it the sheet lies (positive: where
        the normals point), and the normals."""
        corners = part.points[part.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        some = slice(None, None, -(-len(corners) // TRIANGLES))
        to_sheet = self.way_to_sheet(corners[some].mean(axis=1))
        near = np.argsort(np.linalg.norm(to_sheet, axis=1))[:len(to_sheet) // 3 + 1]
        is_below = to_sheet[near, up_axis].mean() > 0
        return is_below, np.sum(to_sheet[near] * normals[some][near]), normals

    def way_to_sheet(self, points):
        """From points to the nearest ones of the mid-surface."""
        samples = self.middle[::-(-len(self.middle) // SAMPLES)]
        origin = samples.mean(axis=0)
        samples, points = samples - origin, points - origin
        nearest = (np.sum(samples**2, axis=1) - 2 * points @ samples.T).argmin(axis=1)
        return samples[nearest] - points


def welded(part):
    """A part whose neighbouring triangles share their corners, without triangles of no area. (The
    filter of VTK takes minutes for flat surfaces.)"""
    grain = 1e-6 * max(np.ptp(part.points, axis=0).max(), 1e-300)
    places = np.floor((part.points - part.points.min(axis=0)) / grain + 0.3).astype(np.int64)
    _, first, number = np.unique(places @ [1, 1 << 21, 1 << 42], return_index=True,
                                 return_inverse=True)
    triangles = number[part.triangles]
    is_plain = np.all(triangles != np.roll(triangles, 1, axis=1), axis=1)
    values = None if part.values is None else part.values[first]
    return Part(part.name, part.points[first], triangles[is_plain], values, part.colour)


def reflected(points, axis, place):
    image = points.copy()
    image[..., axis] = 2 * place - image[..., axis]
    return image


def sheet_parts(results, most=None):
    """Cuts of an element of the sheet along and across it."""
    if most is None:
        is_cut = any(patch.elements_left(0) is not None for patch in results.patches)
        most = CUT_PARTS if is_cut else SHEET_PARTS
    n_elements = sum(np.prod(patch.n_elements[:2]) for patch in results.patches)
    return int(np.clip(np.sqrt(MOST_FACETS / n_elements), 1, most))


def sheet_skin(results, frame, field, most_parts=None):
    """The faces and edges of each patch with the field on them."""
    n_parts = sheet_parts(results, most_parts)
    points, triangles, n = [], [], 0
    for patch in results.patches:
        for part, facets in skin_of(patch, frame, field, n_parts):
            points.append(part)
            triangles.append(n + facets)
            n += len(part)
    points = np.concatenate(points)
    return Part("sheet", points[:, :3], np.concatenate(triangles), points[:, 3])


def skin_of(patch, frame, field, n_parts):
    """Points with values (n, 4) and triangles of the edges of a patch, of both faces, and of the
    border along which an outline cuts these."""
    n = patch.n_elements
    lines = [np.linspace(0, n[d], k * n[d] + 1) for d, k in enumerate((n_parts, n_parts, 2))]
    for axis in (0, 1):
        for end in (0, n[axis]):
            places = [[end] if d == axis else line for d, line in enumerate(lines)]
            part = sampled(patch, frame, field, places).reshape(-1, 4)
            yield inside_outline(patch, frame, places, part)[:2]
    both = sampled(patch, frame, field, [*lines[:2], [0, n[2]]])
    part, facets, border = inside_outline(patch, frame, [*lines[:2], [0]],
                                          np.concatenate(both, axis=-1).reshape(-1, 8))
    for side in (slice(0, 4), slice(4, 8)):
        yield part[:, side], facets
    yield (part[border].reshape(-1, 4, 4)[:, [0, 1, 3, 2]].reshape(-1, 4),
           triangles_of(np.arange(4 * len(border)).reshape(-1, 4)))


def sampled(patch, frame, field, places):
    """Positions and the values of a field in the last axis."""
    return np.concatenate([patch.sample("Points", frame, *places),
                           magnitude(patch.sample(field, frame, *places))[..., None]], axis=-1)


def inside_outline(patch, frame, places, points):
    """Points and triangles of a grid of places, one of whose axes has a single one, as far as the
    outline leaves them, and the edges along which it cuts triangles."""
    rows, columns = [len(line) for line in places[::-1] if len(line) > 1]
    number = np.arange(rows * columns).reshape(rows, columns)
    triangles = triangles_of(np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:],
                                       number[1:, :-1]], axis=-1).reshape(-1, 4))
    is_left = patch.elements_left(frame)
    if is_left is None:
        return points, triangles, np.empty((0, 2), dtype=int)
    distance = patch.inside(frame, *places[:2])
    distance = np.broadcast_to(distance, (len(places[2]), *distance.shape)).ravel()
    _, eta, xi = np.meshgrid(*places[::-1], indexing="ij")
    element = [np.clip(place.ravel()[triangles].mean(axis=1).astype(int), 0, size - 1)
               for place, size in zip((xi, eta), patch.n_elements)]
    points, triangles, border = clip_with_border(
        points, triangles[is_left[element[1], element[0]]], distance)
    used = np.unique(triangles)
    numbers = np.zeros(len(points), dtype=int)
    numbers[used] = np.arange(len(used))
    return points[used], numbers[triangles], numbers[border]


def middle_points(patch, frame):
    """Points of the mid-surface, two in each element along and across."""
    n = patch.n_elements
    xi, eta = (np.arange(2 * n[d] + 1) / 2 for d in range(2))
    return patch.sample("Points", frame, xi, eta, [0.5 * n[2]]).reshape(-1, 3)


def element_lines(patch, frame, n_parts):
    """The boundaries of the elements on both faces, along edges of the facets: arrays of lines
    (lines, points, 3)."""
    n, is_left = patch.n_elements, patch.elements_left(frame)
    fine = [np.linspace(0, n[d], n_parts * n[d] + 1) for d in range(2)]
    for zeta in (0, n[2]):
        for along in (0, 1):
            places = [fine[0], np.arange(n[1] + 1)] if along == 0 else \
                [np.arange(n[0] + 1), fine[1]]
            lines = patch.sample("Points", frame, *places, [zeta])[0].swapaxes(0, along)
            if is_left is not None:
                distance = patch.inside(frame, *places)
                beside = np.pad(is_left.swapaxes(0, along), ((1, 1), (0, 0)))
                is_there = np.repeat(beside[1:] | beside[:-1], n_parts, axis=1)
                lines = pieces(lines, distance.swapaxes(0, along), is_there)
            yield lines


def pieces(lines, distance, is_there):
    """The pieces of lines from place to place, each a line, as far as the distance is positive."""
    ends = np.stack([lines[:, :-1], lines[:, 1:]], axis=2)[is_there]
    near = np.stack([distance[:, :-1], distance[:, 1:]], axis=2)[is_there]
    is_in = (near > 0).any(axis=1)
    ends, near = ends[is_in], near[is_in]
    share = np.where(near < 0, near / np.where(near < 0, near - near[:, ::-1], 1), 0)
    return ends + share[..., None] * (ends[:, ::-1] - ends)


def tool_parts(results, frame):
    """The tools that act on the sheet in a frame."""
    present = results.tools_present(frame)
    n_parts = int(np.clip(np.sqrt(MOST_OF_TOOLS / max(results.n_tool_cells, 1)), 1, TOOL_PARTS))
    return [Part(name, points, triangles, colour=tool_colour(i))
            for i, (name, (points, triangles)) in
            enumerate(zip(results.tools, results.tool_surfaces(frame, n_parts)))
            if name in present and len(points)]


def magnitude(values):
    """The values of a scalar field, the lengths of a vector field."""
    return values[..., 0] if values.shape[-1] == 1 else np.linalg.norm(values, axis=-1)
