"""Where a section runs: a line of material, as places (xi, eta) of patches of the sheet."""
import argparse
import re

import numpy as np
from contourpy import contour_generator

from post.results import ResultsError

N_PER_ELEMENT = 8    # places along the sheet
END = 1e-9           # of the sheet, from its border to a plane that lies in the border
SAME = 1e-3          # of the sheet, between ends of lines that meet


def add_section_argument(command):
    command.add_argument("--section", type=parse_plane, metavar="AXIS=VALUE",
                         help="plane of the section by a coordinate of the sheet at the start, "
                              "such as y=-30 (default: the middle of the sheet across its axis 2)")


def parse_plane(text):
    """Number of the axis and the coordinate."""
    found = re.fullmatch(r"\s*([xyzXYZ])\s*=\s*(\S+)\s*", text)
    try:
        return "xyz".index(found[1].lower()), float(found[2])
    except (TypeError, ValueError):
        raise argparse.ArgumentTypeError(f"'{text}' is no plane such as y=-30") from None


def middle_line(results):
    """The line in the middle of the first patch across its axis 2."""
    patch = results.patches[0]
    n = patch.n_elements
    xi = np.linspace(0, n[0], N_PER_ELEMENT * n[0] + 1)
    pieces = left_at_end(results, patch, np.column_stack([xi, np.full(len(xi), 0.5 * n[1])]))
    if not pieces:
        raise ResultsError("outlines leave nothing of the sheet in its middle across axis 2: name "
                           "the plane of the section (--section)")
    return [max(pieces, key=lambda piece: len(piece[1]))]


def plane_line(results, axis, value):
    """The longest line in which a plane cuts the mid-surface as it is at the start, through all
    patches; pieces of patches that follow each other."""
    grids = [start_of(patch, *(np.linspace(0, n, N_PER_ELEMENT * n + 1)
                               for n in patch.n_elements[:2])) for patch in results.patches]
    size = max(np.ptp(grid.reshape(-1, 3), axis=0).max() for grid in grids)
    low, high = (function(grid[..., axis]) for grid, function in
                 ((np.concatenate([grid.reshape(-1, 3) for grid in grids]), end)
                  for end in (np.min, np.max)))
    name = f"{'xyz'[axis]} = {value:g}"
    if not low - END * size <= value <= high + END * size or high - low <= SAME * size:
        raise ResultsError(f"the plane {name} cuts no line out of the sheet, which lies between "
                           f"{'xyz'[axis]} = {low:.5g} and {high:.5g} at the start")
    value = np.clip(value, low + END * size, high - END * size)
    pieces = []
    for patch, grid in zip(results.patches, grids):
        xi, eta = (np.arange(length) / N_PER_ELEMENT for length in grid.shape[1::-1])
        for places in contour_generator(xi, eta, grid[..., axis]).lines(value):
            pieces += left_at_end(results, patch, places)
    chains = joined(pieces, SAME * size)
    if not chains:
        raise ResultsError(f"outlines leave nothing of the sheet at the plane {name}")
    return max(chains, key=lambda chain: length_of(np.concatenate(
        [start_at(*piece) for piece in chain])))


def start_of(patch, xi, eta):
    """Positions of the mid-surface at the start at a grid of places (eta, xi)."""
    zeta = [0.5 * patch.n_elements[2]]
    return (patch.sample("Points", 0, xi, eta, zeta)
            - patch.sample("displacement", 0, xi, eta, zeta))[0]


def start_at(patch, places):
    """The same at single places."""
    zeta = 0.5 * patch.n_elements[2]
    return patch.at("Points", 0, places, zeta) - patch.at("displacement", 0, places, zeta)


def left_at_end(results, patch, places):
    """The pieces of a line that outlines leave to the end, each with even steps."""
    last = len(results.times) - 1
    if patch.elements_left(last) is None:
        return [(patch, even_steps(places))]
    distance = patch.inside_at(last, places)
    pieces = []
    for part in np.split(np.arange(len(places)), np.flatnonzero(np.diff(distance > 0)) + 1):
        if distance[part[0]] <= 0 or len(part) < 2:
            continue
        line = np.concatenate([[edge(places, distance, part[0], part[0] - 1)], places[part],
                               [edge(places, distance, part[-1], part[-1] + 1)]])
        pieces.append((patch, even_steps(line)))
    return pieces


def even_steps(places):
    """The same line with even steps, near to those of `N_PER_ELEMENT`."""
    along = np.cumsum(np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=1))
    even = np.linspace(0, along[-1], max(round(N_PER_ELEMENT * along[-1]), 1) + 1)
    return np.column_stack([np.interp(even, along, way) for way in places.T])


def edge(places, distance, inside, outside):
    """Where the distance is zero between two neighbouring places; the first one at an end."""
    if not 0 <= outside < len(places):
        return places[inside]
    share = distance[inside] / (distance[inside] - distance[outside])
    return places[inside] + share * (places[outside] - places[inside])


def joined(pieces, tolerance):
    """Chains of pieces whose ends meet."""
    chains = [[piece] for piece in pieces]
    i = 0
    while i < len(chains):
        for k in range(i + 1, len(chains)):
            chain = meeting(chains[i], chains[k], tolerance)
            if chain:
                chains[i] = chain
                del chains[k]
                break
        else:
            i += 1
    return [[chain[0]] + [(patch, places[1:]) for patch, places in chain[1:]] for chain in chains]


def meeting(one, other, tolerance):
    """Two chains in one where their ends meet, else nothing."""
    for a in (one, reverse(one)):
        for b in (other, reverse(other)):
            gap = start_at(a[-1][0], a[-1][1][-1:]) - start_at(b[0][0], b[0][1][:1])
            if np.linalg.norm(gap) < tolerance:
                return a + b
    return None


def reverse(chain):
    return [(patch, places[::-1]) for patch, places in chain[::-1]]


def length_of(line):
    return np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
