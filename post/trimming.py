"""What outlines and trims leave of a patch, as closed loops in its parameters."""
import numpy as np

from post.results import ResultsError

THIN = 2e-6         # how far loops may lie off the polygons, of the range of the parameters
SAME = 1e-9         # places that are one, likewise
OFFSET = 1e-7       # from an edge to both of its sides, likewise
CHUNK = 2_000_000   # pairs looked at in one go


def loops_of(regions, low, high):
    """Loops (n, 2) around what all regions leave of a rectangle, with what is left on their left.

    regions: pairs of a list of polygons (n, 2) and whether what lies outside of them is left, else
    what lies within an odd number of them."""
    low, size = np.asarray(low), np.asarray(high) - low
    scaled = [([thinned((corners - low) / size) for corners in polygons], is_outside)
              for polygons, is_outside in regions]
    scaled.append(([np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])], False))
    polygons = [polygon for region, _ in scaled for polygon in region]
    starts, ends = split(polygons)
    middle, way = (starts + ends) / 2, ends - starts
    across = np.column_stack([-way[:, 1], way[:, 0]])
    offset = OFFSET * across / np.linalg.norm(way, axis=1)[:, None]
    left, right = (is_left(scaled, middle + sign * offset) for sign in (1, -1))
    turned = right & ~left
    starts, ends = (np.where(turned[:, None], b, a) for a, b in ((starts, ends), (ends, starts)))
    is_edge = left != right
    return [loop * size + low for loop in chained(starts[is_edge], ends[is_edge])]


def thinned(corners):
    """A closed polygon without corners that its other corners make up for (D. H. Douglas and T. K.
    Peucker, Cartographica 10 (1973) 112-122)."""
    far = int(np.linalg.norm(corners - corners[0], axis=1).argmax())
    line = np.concatenate([corners, corners[:1]])
    kept, parts = {0, far}, [(0, far), (far, len(line) - 1)]
    while parts:
        a, b = parts.pop()
        if b - a < 2:
            continue
        way, inner = line[b] - line[a], line[a + 1:b] - line[a]
        share = np.clip(inner @ way / max(way @ way, 1e-300), 0, 1)
        off = np.linalg.norm(inner - share[:, None] * way, axis=1)
        worst = int(off.argmax())
        if off[worst] > THIN:
            kept.add(a + 1 + worst)
            parts += [(a, a + 1 + worst), (a + 1 + worst, b)]
    return line[sorted(kept)]


def split(polygons):
    """All edges, cut where those of different polygons meet: starts and ends, each edge once."""
    edges = [(polygon, np.roll(polygon, -1, axis=0)) for polygon in polygons]
    cuts = [[] for _ in edges]
    for p, one in enumerate(edges):
        for q, other in enumerate(edges[:p]):
            mine, theirs = meetings(one, other)
            cuts[p].append(mine)
            cuts[q].append(theirs)
    starts, ends = [], []
    for (a, b), found in zip(edges, cuts):
        rows = np.concatenate([*found, np.column_stack([np.arange(len(a)), np.zeros(len(a))]),
                               np.column_stack([np.arange(len(a)), np.ones(len(a))])])
        rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
        number, share = rows[:, 0].astype(int), np.clip(rows[:, 1], 0, 1)[:, None]
        places = a[number] + share * (b[number] - a[number])
        follow = (number[1:] == number[:-1]) & (np.linalg.norm(np.diff(places, axis=0), axis=1)
                                                > SAME)
        starts.append(places[:-1][follow])
        ends.append(places[1:][follow])
    return np.concatenate(starts), np.concatenate(ends)


def meetings(one, other):
    """Where edges of two polygons cross, or an end of one lies on another: rows of the number of
    the edge and the share of it, of both."""
    (a, b), (c, d) = one, other
    mine, theirs = [np.zeros((0, 2))], [np.zeros((0, 2))]
    step = max(1, CHUNK // len(c))
    for first in range(0, len(a), step):
        p, r = a[first:first + step, None], (b - a)[first:first + step, None]
        q, s = c[None], (d - c)[None]
        det = cross(r, s)
        is_along = np.abs(det) <= 1e-12 * np.linalg.norm(r, axis=2) * np.linalg.norm(s, axis=2)
        det = np.where(is_along, 1.0, det)
        t, u = cross(q - p, s) / det, cross(q - p, r) / det
        slack = [SAME / np.maximum(np.linalg.norm(way, axis=2), SAME) for way in (r, s)]
        hit = ~is_along & (t >= -slack[0]) & (t <= 1 + slack[0]) & (u >= -slack[1]) \
            & (u <= 1 + slack[1])
        i, j = np.nonzero(hit)
        mine.append(np.column_stack([i + first, t[i, j]]))
        theirs.append(np.column_stack([j, u[i, j]]))
        for i, j in zip(*np.nonzero(is_along)):
            mine.append(on_edge(a[i + first], b[i + first], (c[j], d[j]), i + first))
            theirs.append(on_edge(c[j], d[j], (a[i + first], b[i + first]), j))
    return np.concatenate(mine), np.concatenate(theirs)


def on_edge(start, end, places, number):
    """Places that lie on an edge."""
    way, rows = end - start, []
    for place in places:
        share = (place - start) @ way / (way @ way)
        if 0 < share < 1 and np.linalg.norm(start + share * way - place) <= SAME:
            rows.append([number, share])
    return np.array(rows).reshape(-1, 2)


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def is_left(regions, places):
    """Do all regions leave these places?"""
    left = np.ones(len(places), dtype=bool)
    for polygons, is_outside in regions:
        is_odd = np.zeros(len(places), dtype=bool)
        for polygon in polygons:
            is_odd ^= is_within(polygon, places)
        left &= is_odd != is_outside
    return left


def is_within(polygon, places):
    """By the crossings of a ray along the first axis."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    inside = np.zeros(len(places), dtype=bool)
    step = max(1, CHUNK // len(a))
    for first in range(0, len(places), step):
        x, y = places[first:first + step].T[:, :, None]
        passes = (a[:, 1] > y) != (b[:, 1] > y)
        rise = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
        at = a[:, 0] + (y - a[:, 1]) / rise * (b[:, 0] - a[:, 0])
        inside[first:first + step] = np.sum(passes & (x < at), axis=1) % 2 == 1
    return inside


def chained(starts, ends):
    """Closed loops of edges, those that are there twice once."""
    keys = [tuple(map(tuple, np.round(places / (10 * SAME)).astype(np.int64)))
            for places in (starts, ends)]
    following, seen = {}, set()
    for i, pair in enumerate(zip(*keys)):
        if pair not in seen and pair[0] != pair[1]:
            seen.add(pair)
            following.setdefault(pair[0], []).append(i)
    loops = []
    while following:
        key, loop = next(iter(following)), []
        while key in following:
            i = following[key].pop()
            if not following[key]:
                del following[key]
            loop.append(starts[i])
            key = keys[1][i]
        if key != keys[0][int(np.flatnonzero((starts == loop[0]).all(axis=1))[0])]:
            raise ResultsError("curves of outlines that meet at a point cannot be written")
        loops.append(np.array(loop))
    return loops


def area_of(loop):
    return 0.5 * float(np.sum(cross(loop, np.roll(loop, -1, axis=0))))


def pieces_of(loops):
    """Loops by the piece that they bound: its outer loop first, then its holes."""
    outer = sorted((loop for loop in loops if area_of(loop) > 0), key=area_of)
    pieces = [[loop] for loop in outer]
    for hole in (loop for loop in loops if area_of(loop) < 0):
        piece = next(piece for piece in pieces if is_within(piece[0], hole[:1])[0])
        piece.append(hole)
    return pieces[::-1]
