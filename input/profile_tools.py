"""Tools whose profile runs along an outline: what the scripts of the decks share."""
import csv
import os

ROOT = 0.5**0.5     # weight of the middle of a quarter circle


def surface(outline, half, corner, profile):
    """Rows of x, y, z, w; the profile is axis 1 and runs fastest.

    `outline(half, corner, d)` gives the control points (x, y, w) at the distance d outside of the
    wall, or of the middle line of a rail. The last number of the profile's points shrinks the outline towards the axis.
    """
    paths = []
    for d, z, w, shrink in profile:
        paths.append([(shrink * x, shrink * y, z, w * v) for x, y, v in outline(half, corner, d)])
    return [path[j] for j in range(len(paths[0])) for path in paths]


def write(script, name, rows):
    """The table of control points next to a script."""
    path = os.path.join(os.path.dirname(os.path.abspath(script)), name)
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["x", "y", "z", "w"])
        writer.writerows([[f"{value:.15g}" for value in row] for row in rows])
