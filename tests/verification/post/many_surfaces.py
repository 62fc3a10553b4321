"""A deck whose die has many surfaces: a channel of planes and quarter circles in rows side by side.

Usage: many_surfaces.py DECK [ROWS]     writes DECK; 13 rows make a die of 65 surfaces
"""
import sys

ROW = 5.0       # width of a row, along y
PARTS = 8       # knot spans of a surface along each axis
HEAD = """*UNITS
mm, t, s, N, MPa, mJ
*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, QUADRATURE="2,2,2"
x, 0, 60, 2, 12
y, 0, 60, 2, 12
z, 0, 1, 2, 1
*BOUNDARY
X_MIN, XSYMM
"""
TAIL = """*CONTACT PAIR, TOOL=die, FACE=Z_MIN
*TOOL, NAME=punch, TYPE=PLANE, SIDE=NEGATIVE
-5, -5, 1
24, 0, 0
0, 70, 0
*TOOL MOTION, TOOL=punch
0, 0, -10000
*CONTACT PAIR, TOOL=punch, FACE=Z_MAX
*STEP, NAME=draw
*DYNAMIC, EXPLICIT
1e-4
*OUTPUT, FRAMES=2, HISTORY=4, FIELDS=STRESS
*END STEP
*STEP, NAME=lift
*MODEL CHANGE, REMOVE
punch
*DYNAMIC, EXPLICIT
1e-5
*OUTPUT, FRAMES=1, HISTORY=1
*END STEP
"""
# Corners and centre of each piece of the section in x and z, from the bottom to the flange; an arc
# is one over the corner of its tangents.
PIECES = (((-5, -30), (20, -30)), ((20, -30), (25, -30), (25, -25)), ((25, -25), (25, -5)),
          ((25, -5), (25, 0), (30, 0)), ((30, 0), (75, 0)))


def surface(number, piece, low, high):
    """One piece of the section, drawn along y from `low` to `high`."""
    owner = "NAME=die, SIDE=POSITIVE" if number == 1 else f"NAME=die {number}, COMPONENT OF=die"
    name = "die" if number == 1 else f"die {number}"
    lines = [f"*TOOL, {owner}, TYPE=EXTRUDED", f"0, {high - low:g}, 0"]
    degree = len(piece) - 1
    knots = ", ".join(["0"] * (degree + 1) + ["1"] * (degree + 1))
    lines += [f"*KNOTS, PATCH={name}, AXIS=1, DEGREE={degree}", knots,
              f"*CONTROL POINTS, PATCH={name}"]
    for place, (x, z) in enumerate(piece):
        weight = 0.5**0.5 if degree == 2 and place == 1 else 1
        lines.append(f"{x}, {low:g}, {z}, {weight:.17g}")
    return lines + [f"*REFINE, PATCH={name}, AXIS={axis}, SUBDIVIDE={PARTS}" for axis in (1, 2)]


def deck(rows):
    """The text of the deck."""
    edges = [ROW * (row - 0.5) for row in range(rows + 1)]
    lines, number = [], 0
    for low, high in zip(edges, edges[1:]):
        for piece in PIECES:
            number += 1
            lines += surface(number, piece, low, high)
    return HEAD + "\n".join(lines) + "\n" + TAIL


def main(path, rows="13"):
    with open(path, "w", encoding="utf-8") as file:
        file.write(deck(int(rows)))


if __name__ == "__main__":
    main(*sys.argv[1:])
