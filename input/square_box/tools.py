"""Control points of a quarter of the punch and the die of square_box.key: punch.csv and die.csv.

A profile (flat, quarter circle, wall) runs along the outline of a rounded square. A point of the
profile lies the distance d outside of the wall, where the outline is two straight lines and an arc
about the corner's centre; both are exact.
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir))
from profile_tools import ROOT, surface, write   # pylint: disable=wrong-import-position

TOP = -0.78    # of the die: below the sheet, whose upper face is z = 0


def outline(half, corner, d):
    """Control points (x, y, w) along a quarter of the outline at the distance d outside."""
    far, centre = half + d, half - corner
    return [(far, 0, 1), (far, centre / 2, 1), (far, centre, 1), (far, far, ROOT),
            (centre, far, 1), (centre / 2, far, 1), (0, far, 1)]


# die: opening 74, corner 12, edge 5
DIE = [(80, TOP, 1, 1), (42, TOP, 1, 1), (5, TOP, 1, 1), (0, TOP, ROOT, 1), (0, TOP - 5, 1, 1),
       (0, TOP - 30, 1, 1), (0, TOP - 60, 1, 1)]
write(__file__, "die.csv", surface(outline, 37, 12, DIE))
# punch: 70, corner 10, edge 8; its flat part shrinks to a point on the axis
PUNCH = [(0, 60, 1, 1), (0, 34, 1, 1), (0, 8, 1, 1), (0, 0, ROOT, 1), (-8, 0, 1, 1),
         (-8, 0, 1, 0.5), (-8, 0, 1, 0)]
write(__file__, "punch.csv", surface(outline, 35, 10, PUNCH))
