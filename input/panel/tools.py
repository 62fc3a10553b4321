"""Control points of the punch and the die of panel.key: punch.csv and die.csv.

A profile (flat, quarter circle, wall) runs around the outline of a rounded rectangle. A point of
the profile lies the distance d outside of the wall, where the outline is four straight lines and
four arcs; all are exact.
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir))
from profile_tools import ROOT, surface, write   # pylint: disable=wrong-import-position

TOP = -0.8      # of the die: below the sheet, whose upper face is z = 0


def outline(half, corner, d):
    """Control points (x, y, w) around the outline at the distance d outside, closed."""
    (far_x, far_y), (x, y) = [[value + step for value in half] for step in (d, -corner)]
    return [(far_x, -y, 1), (far_x, 0, 1), (far_x, y, 1), (far_x, far_y, ROOT), (x, far_y, 1),
            (0, far_y, 1), (-x, far_y, 1), (-far_x, far_y, ROOT), (-far_x, y, 1), (-far_x, 0, 1),
            (-far_x, -y, 1), (-far_x, -far_y, ROOT), (-x, -far_y, 1), (0, -far_y, 1),
            (x, -far_y, 1), (far_x, -far_y, ROOT), (far_x, -y, 1)]


# die: opening 602 x 402, corner 81, edge 15
DIE = [(330, TOP, 1, 1), (170, TOP, 1, 1), (15, TOP, 1, 1), (0, TOP, ROOT, 1),
       (0, TOP - 15, 1, 1), (0, TOP - 80, 1, 1), (0, TOP - 150, 1, 1)]
write(__file__, "die.csv", surface(outline, (301, 201), 81, DIE))
# punch: 600 x 400, corner 80, edge 15; its flat part shrinks to a point on the axis
PUNCH = [(0, 150, 1, 1), (0, 80, 1, 1), (0, 15, 1, 1), (0, 0, ROOT, 1), (-15, 0, 1, 1),
         (-15, 0, 1, 0.5), (-15, 0, 1, 0)]
write(__file__, "punch.csv", surface(outline, (300, 200), 80, PUNCH))
