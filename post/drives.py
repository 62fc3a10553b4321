"""How a deck moves its tools, and when and where they first touch the sheet."""
from dataclasses import dataclass

import numpy as np

from post.cells import triangles_of
from post.deck import number, same
from post.scene import Part, sheet_skin

SAMPLES = 1200        # points that are compared with triangles
TIMES = 2001          # at which a path is evaluated
SLACK = 0.25          # of the thickness, by which flat facets of round tools may lie in the sheet


@dataclass
class Drive:
    """A motion or force of a tool from a step on."""
    tool: str
    kind: str               # VELOCITY, DISPLACEMENT, ROTATION, ANGULAR VELOCITY or FORCE
    vector: np.ndarray      # or the axis of a rotation
    value: float            # size of the vector, or the angle
    step: int
    amplitude: str


def drives_of(deck):
    """All motions and forces in the order of the deck."""
    drives = []
    for record in deck.named("TOOL MOTION", "TOOL FORCE"):
        kind = "FORCE" if record.keyword == "TOOL FORCE" else \
            record.options.get("TYPE", "VELOCITY").upper()
        rows = [[number(field) for field in row] for row in record.data]
        is_turn = kind in ("ROTATION", "ANGULAR VELOCITY")
        vector = np.array(rows[0][3:6] if is_turn else rows[0][:3])
        value = rows[1][0] if is_turn else float(np.linalg.norm(vector))
        drives.append(Drive(record.options["TOOL"], kind, vector, value, record.step,
                            record.options.get("AMPLITUDE", "")))
    return drives


def first_drive(drives, tool):
    """What moves a tool first; translations of one step and amplitude add up."""
    own = [drive for drive in drives if same(drive.tool) == same(tool)]
    if not own:
        return None
    first = own[0]
    alike = [drive.vector for drive in own if (drive.kind, drive.step, drive.amplitude)
             == (first.kind, first.step, first.amplitude)]
    if len(alike) > 1 and first.kind in ("VELOCITY", "DISPLACEMENT"):
        first.vector = np.sum(alike, axis=0)
        first.value = float(np.linalg.norm(first.vector))
    return first


def duration_of(deck, step):
    """Time period of a step."""
    for record in deck.named("DYNAMIC"):
        if record.step == step:
            return number(next(field for field in record.data[0] if field))
    return 0.0


def factors_of(deck, name, times):
    """An amplitude at times; 1 without a name."""
    if not name:
        return np.ones_like(times)
    [record] = [record for record in deck.named("AMPLITUDE")
                if same(record.options["NAME"]) == same(name)]
    at, values = np.array([number(field) for row in record.data for field in row
                           if field]).reshape(-1, 2).T
    if same(record.options.get("DEFINITION", "")) != "SMOOTH STEP":
        return np.interp(times, at, values)
    row = np.clip(np.searchsorted(at, times, "right") - 1, 0, len(at) - 2)
    share = np.clip((times - at[row]) / (at[row + 1] - at[row]), 0, 1)
    return values[row] + (values[row + 1] - values[row]) * share**3 \
        * (10 - share * (15 - 6 * share))


def time_of(deck, drive, way):
    """When a tool has moved by a way, from the start of its step; None if it does not, or by a
    force."""
    if drive is None or drive.kind not in ("VELOCITY", "DISPLACEMENT"):
        return None
    times = np.linspace(0, duration_of(deck, drive.step), TIMES)
    moved = drive.value * factors_of(deck, drive.amplitude, times)
    if drive.kind == "VELOCITY":
        moved = np.concatenate([[0], np.cumsum(0.5 * (moved[1:] + moved[:-1]) * np.diff(times))])
    reached = np.flatnonzero(moved >= way)
    if not len(reached):
        return None
    last = reached[0]
    if last == 0:
        return 0.0
    return float(np.interp(way, moved[last - 1:last + 1], times[last - 1:last + 1]))


def coarse_sheet(results):
    """The sheet at the start with few triangles."""
    return sheet_skin(results, 0, "thickness", 1)


def coarse_tool(results, name):
    return Part(name, *results.tool_surfaces(0, 2)[results.tools.index(name)])


def way_to_contact(tool, sheet, direction, thickness):
    """How far a tool can move before it meets the sheet, and where; None if it passes it."""
    along = direction / np.linalg.norm(direction)
    aside = np.eye(3)[np.abs(along).argmin()]
    across = np.cross(along, aside)
    axes = np.array([np.cross(across, along), across, along]).T / np.linalg.norm(across)
    axes[:, 2] = along
    lost = -SLACK * thickness
    hits = [*crossings(sheet.points @ axes, tool, axes, -1, lost),
            *crossings(tool.points @ axes, sheet, axes, 1, lost)]
    if not hits:
        return None
    way, place = min(hits, key=lambda hit: hit[0])
    return max(way, 0.0), axes @ place


def crossings(points, part, axes, sign, lost):
    """The least way from points along the third axis to a surface, and where a sheet is met: the
    surface if it is that of the sheet (sign 1), else the points (-1)."""
    points = points[::-(-len(points) // SAMPLES)]
    triangles = (part.points @ axes)[part.triangles]
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    ends = triangles[..., :2]
    area = cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0])
    is_near = np.all((ends.max(axis=1) >= low) & (ends.min(axis=1) <= high), axis=1)
    size = max(np.ptp(points[:, :2]), 1e-300)
    triangles, area = (values[is_near & (np.abs(area) > 1e-12 * size**2)]
                       for values in (triangles, area))
    hits = []
    for point in points if len(triangles) else ():
        to_ends = triangles[..., :2] - point[:2]
        shares = np.stack([cross(to_ends[:, (k + 1) % 3], to_ends[:, (k + 2) % 3]) / area
                           for k in range(3)], axis=1)
        inside = np.all(shares > -1e-9, axis=1)
        ways = sign * (np.sum(shares[inside] * triangles[inside][..., 2], axis=1) - point[2])
        ways = ways[ways > lost]
        if len(ways):
            way = ways.min()
            hits.append((way, point + [0, 0, way] if sign == 1 else point))
    return hits


def cross(a, b):
    """Of vectors in a plane."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
