"""Control points of the punch and the die of panel.key: punch.csv and die.csv.

A profile (flat, quarter circle, wall) runs around the outline of a rounded rectangle. A point of the
profile lies the distance d outside of the wall, where the outline is four straight lines and four
arcs; all are exact.
"""
import csv
import math
import os

ROOT = math.sqrt(0.5)
TOP = -0.8      # of the die: below the sheet, whose upper face is z = 0


def outline(half, corner, d):
    """Control points (x, y, w) around the outline at the distance d outside, closed."""
    (far_x, far_y), (x, y) = [[value + step for value in half] for step in (d, -corner)]
    points = [(far_x, -y, 1)]
    for a, b, w in ((far_x, 0, 1), (far_x, y, 1), (far_x, far_y, ROOT), (x, far_y, 1),
                    (0, far_y, 1), (-x, far_y, 1), (-far_x, far_y, ROOT), (-far_x, y, 1),
                    (-far_x, 0, 1), (-far_x, -y, 1), (-far_x, -far_y, ROOT), (-x, -far_y, 1),
                    (0, -far_y, 1), (x, -far_y, 1), (far_x, -far_y, ROOT), (far_x, -y, 1)):
        points.append((a, b, w))
    return points


def surface(half, corner, profile):
    """Rows of x, y, z, w; the profile is axis 1 and runs fastest. The last number of its
    points shrinks the outline towards the axis."""
    paths = []
    for d, z, w, shrink in profile:
        paths.append([(shrink*x, shrink*y, z, w*v) for x, y, v in outline(half, corner, d)])
    return [path[j] for j in range(17) for path in paths]


def write(name, rows):
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), name)
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["x", "y", "z", "w"])
        writer.writerows([[f"{value:.15g}" for value in row] for row in rows])


# die: opening 602 x 402, corner 81, edge 15
write("die.csv", surface((301, 201), 81, [(330, TOP, 1, 1), (170, TOP, 1, 1), (15, TOP, 1, 1),
                                          (0, TOP, ROOT, 1), (0, TOP - 15, 1, 1),
                                          (0, TOP - 80, 1, 1), (0, TOP - 150, 1, 1)]))
# punch: 600 x 400, corner 80, edge 15; its flat part shrinks to a point on the axis
write("punch.csv", surface((300, 200), 80, [(0, 150, 1, 1), (0, 80, 1, 1), (0, 15, 1, 1),
                                            (0, 0, ROOT, 1), (-15, 0, 1, 1), (-15, 0, 1, 0.5),
                                            (-15, 0, 1, 0)]))
