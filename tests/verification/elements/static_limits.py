"""Where static steps find more than one equilibrium, or none: a strut that buckles, parts that
nothing holds, tools that stay beside a part that springs back, a draw that ends fast."""
import os
import subprocess

import numpy as np
from run_results import Run
from suite import Case

HEAD = """*UNITS
mm, t, s, N, MPa, mJ
*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0
"""
STRUT = HEAD + """*BLANK, NAME=strip, MATERIAL=steel, ELEMENT={element}
x, 0, 100, 2, 20
y, 0, 5, 2, 1
z, -0.5, 0.5, 2, 1
*BOUNDARY
X_MIN, ENCASTRE
X_MAX, 2, 3
*BOUNDARY, TYPE=VELOCITY
X_MAX, 1, 1, -0.2
*PRESSURE
Z_MAX, 1e-3
*STATIC
0.25, 1
*OUTPUT, FRAMES=1, HISTORY=4
"""
PLATES = HEAD + """*BLANK, NAME=two, MATERIAL=steel, TYPE=PATCHES, MERGE=NO
*PATCH, NAME=a, TYPE=BOX
x, 0, 10, 2, 2
y, 0, 5, 2, 1
z, 0, 1, 2, 1
*PATCH, NAME=b, TYPE=BOX
x, 20, 30, 2, 2
y, 0, 5, 2, 1
z, 0, 1, 2, 1
*GRAVITY
0, 0, -9810
{more}*STATIC
0.25, 1
*OUTPUT, FRAMES=1, HISTORY=4
"""
FREED = HEAD + """*PLASTIC, HARDENING=VOCE
250, 250, 6
*BLANK, NAME=plate, MATERIAL=steel
x, 0, 60, 2, 12
y, 0, 30, 2, 3
z, 0, 1, 2, 1
*AMPLITUDE, NAME=rise
0, 0, 1, 1
*STEP, NAME=load
*BOUNDARY
X_MIN, ENCASTRE
X_MAX, ENCASTRE
*PRESSURE, AMPLITUDE=rise
Z_MAX, 3
*STATIC
0.1, 1
*OUTPUT, FRAMES=1, HISTORY=1
*END STEP
*STEP, NAME=free
*BOUNDARY, OP=NEW
*PRESSURE, OP=NEW
*STATIC
{first}, 1, , {first}
*OUTPUT, FRAMES=10, HISTORY=10
*END STEP
"""
TABLE = """*TOOL, NAME=table, TYPE=PLANE, SIDE=POSITIVE
-20, -20, -30
120, 0, 0
0, 40, 0
*CONTACT PAIR, TOOL=table, FACE=Z_MIN
"""


def run(case, name, text, expect=0, options=()):
    """Run a deck; its result, what it told, and its log."""
    deck, result = (os.path.join(case.out, f"{case.name}_{name}{end}") for end in (".key", ".h5"))
    with open(deck, "w", encoding="utf-8") as file:
        file.write(text)
    done = subprocess.run([case.igaform, deck, "--threads", "1", "--quiet", "--out", result,
                           *options], capture_output=True, text=True, check=False)
    case.between(f"{name}: exit code", done.returncode, expect, expect)
    with open(result[:-3] + ".log", encoding="utf-8") as file:
        return result, done.stderr, file.read()


def says(case, name, text, *words):
    for word in words:
        case.between(f"{name}: the message says '{word}'", int(word in text), 1, 1)


def strut_buckles(case):
    """A clamped strut shortened to five times its buckling strain bends the way that a small
    pressure pushes it: w = a/2 (1 - cos(2 pi x/L)) with a^2 pi^2/(4 L) = shortening less that of
    Euler's load, but for terms of a^4."""
    length, thickness, shortening = 100, 1, 0.2
    bent = shortening - np.pi**2 / 3 * thickness**2 / length
    for element in ("SOLID", "SHELL"):
        result = Run(run(case, f"strut_{element}", STRUT.format(element=element))[0])
        deflection = (result.points - result.start)[:, 2]
        case.error(f"strut, {element}: largest deflection [mm]",
                   deflection[np.abs(deflection).argmax()], -2 / np.pi * np.sqrt(bent * length),
                   0.03)


def unheld_parts(case):
    """Loads on rigid motions end the step at once; parts without a common seam are held each."""
    told = run(case, "falling", PLATES.format(more=""), 2)[1]
    says(case, "falling", told, "motion in z", "borne by no support")
    log = run(case, "two", PLATES.format(more="").replace("*GRAVITY\n0, 0, -9810\n", ""))[2]
    says(case, "two", log, "12 components")
    held = "*BOUNDARY\nX_MIN, PINNED\n"
    told = run(case, "one_held", PLATES.format(more=held), 2)[1]
    says(case, "one_held", told, "motion in z")


def places_stay(case):
    """The components that hold a free part are the same in each increment and bear nothing; a table
    far below it changes nothing."""
    ends = []
    for first in (0.1, 0.25):
        result = Run(run(case, f"freed_{first}", FREED.format(first=first))[0])
        moved = np.abs(np.array(result.frames[1:]) - result.frames[1])
        case.between(f"freed, increments of {first}: components that never move",
                     np.count_nonzero(moved.max(axis=0) < 1e-12), 6, 12)
        ends.append(result.points)
    case.deviation("freed: place by 10 and by 4 increments [mm]", np.abs(ends[0] - ends[1]).max(),
                   5e-3)
    text = FREED.format(first=0.25)
    rise = "*AMPLITUDE, NAME=rise"
    result = Run(run(case, "tabled", text.replace(rise, TABLE + rise))[0])
    case.deviation("freed above a table: place [mm]", np.abs(result.blank - ends[1]).max(), 1e-2)


def fast_draw(case):
    """U-bends whose flange still slows down as it is let go, at short strokes. At 5 mm springs
    become stiffer on the way: what the ones before bore is ramped down then."""
    deck = os.path.join(os.path.dirname(os.path.abspath(case.decks)), "u_bend.key")
    for stroke in 5, 10:
        result = os.path.join(case.out, f"{case.name}_u_bend_{stroke}.h5")
        values = f"stroke={stroke}", "element=SHELL", "added=1"
        sets = [word for value in values for word in ("--set", value)]
        done = subprocess.run([case.igaform, deck, "--threads", "1", "--quiet", "--out", result,
                               *sets], check=False)
        case.between(f"U-bend, stroke of {stroke} mm: exit code", done.returncode, 0, 0)


def release_under_gravity(case):
    """A tenth of its weight does not keep a part from springing back; a cantilever as long as the
    strip sags by 0.08 mm under it."""
    inputs = os.path.dirname(os.path.abspath(case.decks))
    with open(os.path.join(inputs, "u_bend.key"), encoding="utf-8") as file:
        text = file.read()
    text = text.replace("springback/<release>", os.path.join(inputs, "springback", "static"))
    values = ("--set", "stroke=8", "--set", "element=SHELL", "--set", "added=1", "--set",
              "release=none")
    ends = []
    for name, load in ("weightless", ""), ("heavy", "*GRAVITY\n0, -981, 0\n"):
        changed = text.replace("*MODEL CHANGE, REMOVE", load + "*MODEL CHANGE, REMOVE")
        ends.append(Run(run(case, name, changed, options=values)[0]).blank)
    case.deviation("U-bend released under its weight [mm]", np.abs(ends[0] - ends[1]).max(), 0.1)


def sags_on_die(case):
    """A flat blank sags into its die, row by row of elements, without shorter increments."""
    inputs = os.path.dirname(os.path.abspath(case.decks))
    with open(os.path.join(inputs, "s_rail.key"), encoding="utf-8") as file:
        text = file.read()
    text = text[:text.index("*STEP")].replace("s_rail/", os.path.join(inputs, "s_rail", ""))
    text += ("*STEP, NAME=gravity\n*STATIC\n0.5, 1\n*GRAVITY\n0, 0, -9810\n"
             "*MODEL CHANGE, REMOVE\npunch, holder\n*OUTPUT, FRAMES=1, HISTORY=1\n*END STEP\n")
    log = run(case, "sagging", text, options=("--set", "size=4"))[2]
    case.between("sagging blank: increments", log.count("static     time"), 2, 2)
    case.between("sagging blank: increments cut", log.count(" cut to "), 0, 0)


def main():
    case = Case("Static steps at their limits", "E. Winkler's inextensible strut; statics")
    strut_buckles(case)
    unheld_parts(case)
    places_stay(case)
    fast_draw(case)
    release_under_gravity(case)
    sags_on_die(case)
    case.finish()


main()
