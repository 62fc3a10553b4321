"""Control points of the punch and the die of s_rail.key: punch.csv and die.csv.

The cross-section of a rail (walls, quarter circles, flats) runs along a curve in the shape of an S:
two parallel straight lines, joined by two arcs of equal radius in opposite directions. All arcs are
exact. The rail is open at its ends, beyond the sheet, and symmetric to a half turn about z.

The form is that of the S-rail of NUMISHEET'96. No drawing of it was found, so all dimensions here
are chosen, not traced.
"""
import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir))
from profile_tools import ROOT, surface, write   # pylint: disable=wrong-import-position

TOP = -0.92             # of the die: below the sheet, whose upper face is z = 0
LENGTH = 150            # of the tools along x, half of it
RADIUS = 90             # of the arcs of the middle line
TURN = math.radians(45)     # of each arc
PUNCH = 30              # half of the width of the punch
WALL = PUNCH + 1        # of the opening of the die: the thickness and a tenth of it
EDGE = 9                # radius of the edges of both
FLAT = WALL + EDGE      # offset from which the flats of the die begin


def outline(length, radius, d):
    """Control points (x, y, w) along the S at the distance d to the left of its middle line.

    Beyond FLAT they are shifted along y, since farther offsets of the inner arcs would fold.
    """
    offset = max(-FLAT, min(FLAT, d))
    run, rise = radius * math.sin(TURN), radius * (1 - math.cos(TURN))
    first, second = radius - offset, radius + offset    # the arcs bend to the left, to the right
    half, slope = math.tan(TURN / 2), (math.cos(TURN), math.sin(TURN))
    middle = (-offset * slope[1], offset * slope[0])
    corner = (middle[0] - first * half * slope[0], middle[1] - first * half * slope[1])
    other = (middle[0] + second * half * slope[0], middle[1] + second * half * slope[1])
    left, right = offset - rise, offset + rise
    points = [(-length, left, 1), (-(length + run) / 2, left, 1), (-run, left, 1),
              (*corner, math.cos(TURN / 2)), (*middle, 1), (*other, math.cos(TURN / 2)),
              (run, right, 1), ((length + run) / 2, right, 1), (length, right, 1)]
    return [(x, y + d - offset, w) for x, y, w in points]


def both_sides(half):
    """A profile across the rail from its left half, which ends before the middle line."""
    return half + [(0, *half[-1][1:])] + [(-d, *rest) for d, *rest in reversed(half)]


# die: flats around an opening with a floor far below the punch
DIE = [(FLAT + 100, TOP, 1, 1), (FLAT + 50, TOP, 1, 1), (FLAT, TOP, 1, 1), (WALL, TOP, ROOT, 1),
       (WALL, TOP - EDGE, 1, 1), (WALL, TOP - 30, 1, 1), (WALL, TOP - 60, 1, 1),
       (WALL, TOP - 60 - EDGE, ROOT, 1), (WALL - EDGE, TOP - 60 - EDGE, 1, 1)]
write(__file__, "die.csv", surface(outline, LENGTH, RADIUS, both_sides(DIE)))
PROFILE = [(PUNCH, 60, 1, 1), (PUNCH, 34, 1, 1), (PUNCH, EDGE, 1, 1), (PUNCH, 0, ROOT, 1),
           (PUNCH - EDGE, 0, 1, 1)]
write(__file__, "punch.csv", surface(outline, LENGTH, RADIUS, both_sides(PROFILE)))
