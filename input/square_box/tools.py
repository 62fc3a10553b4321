"""Control points of a quarter of the punch and the die of square_box.key: punch.csv and die.csv.

A profile (flat, quarter circle, wall) runs along the outline of a rounded square. A point of the
profile lies the distance d outside of the wall, where the outline is two straight lines and an arc
about the corner's centre; both are exact.
"""
import csv
import math
import os

ROOT = math.sqrt(0.5)
TOP = -0.78    # of the die: below the sheet, whose upper face is z = 0


def outline(half, corner, d):
    """Control points (x, y, w) along a quarter of the outline at the distance d outside."""
    far, centre = half + d, half - corner
    return [(far, 0, 1), (far, centre / 2, 1), (far, centre, 1), (far, far, ROOT),
            (centre, far, 1), (centre / 2, far, 1), (0, far, 1)]


def surface(half, corner, profile):
    """Rows of x, y, z, w; the profile is axis 1 and runs fastest. The last number of its
    points shrinks the outline towards the axis."""
    paths = []
    for d, z, w, shrink in profile:
        paths.append([(shrink * x, shrink * y, z, w * v) for x, y, v in outline(half, corner, d)])
    return [path[j] for j in range(7) for path in paths]


def write(name, rows):
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), name)
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["x", "y", "z", "w"])
        writer.writerows([[f"{value:.15g}" for value in row] for row in rows])


# die: opening 74, corner 12, edge 5
write("die.csv", surface(37, 12, [(80, TOP, 1, 1), (42, TOP, 1, 1), (5, TOP, 1, 1),
                                  (0, TOP, ROOT, 1), (0, TOP - 5, 1, 1), (0, TOP - 30, 1, 1),
                                  (0, TOP - 60, 1, 1)]))
# punch: 70, corner 10, edge 8; its flat part shrinks to a point on the axis
write("punch.csv", surface(35, 10, [(0, 60, 1, 1), (0, 34, 1, 1), (0, 8, 1, 1), (0, 0, ROOT, 1),
                                    (-8, 0, 1, 1), (-8, 0, 1, 0.5), (-8, 0, 1, 0)]))
