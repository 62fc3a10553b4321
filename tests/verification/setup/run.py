"""Deliberate mistakes in a set-up, each with the finding that `--check` must report.

Usage: run.py PROGRAM. Every mistake changes draw.key, which has none, by parameters or by text.
"""
import pathlib
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field

DECK = (pathlib.Path(__file__).resolve().parent / "draw.key").read_text()


@dataclass
class Mistake:
    name: str
    at: str                                     # text of the line that the finding must name
    words: list                                 # that its line must contain
    set: list = field(default_factory=list)     # parameters
    text: list = field(default_factory=list)    # (old, new)
    level: str = "warning"


DIE, PUNCH, HOLDER = ("*TOOL, NAME=" + name for name in ("die", "punch", "holder"))
MATERIAL, BLANK = "*MATERIAL, NAME=steel", "*BLANK, NAME=sheet"
MOTION, FORCE = "*TOOL MOTION, TOOL=punch", "*TOOL FORCE, TOOL=holder"
STROKE, HOLDING = "*AMPLITUDE, NAME=stroke\n0, 0, <0.1*time>, 1, <0.9*time>, 1, <time>, 0", \
    "*CONTACT PAIR, TOOL=holder"
RELEASE, REMOVAL = "*DYNAMIC, EXPLICIT\n0.01", "*MODEL CHANGE, REMOVE\ndie, punch, holder"
PIECE = """*TOOL, NAME=tail, TYPE=PLANE, COMPONENT OF=die
{x}, 0, 22
20, 0, 0
0, 0, -23
"""
BOTTOM = """*TOOL, NAME=bottom, TYPE=PLANE, SIDE=NEGATIVE, COMPONENT OF=die
-2, {y}, -1
40, 0, 0
0, 0, 23
"""
HILL = "*POTENTIAL, TYPE=HILL48\n1.8, 1.5, 2.3\n*ORIENTATION\n"
OTHER = "*MATERIAL, NAME=other\n*DENSITY\n2.7e-9\n*ELASTIC\n7e4, 0.3\n"
BEAD = "*DRAW BEAD, WIDTH=6, FACE=Y_MAX\n5e4\n60, 1, 0\n60, 1, 20\n"
SHORT_DIE = [("70, 0, 0\n100, 0, 0", "55, 0, 0\n60, 0, 0"), (PUNCH, PIECE.format(x="{x}") + PUNCH)]


def die_in_two(x):
    """The flange of the die ends at 60 and a second surface begins at x."""
    return [(old, new.format(x=x)) for old, new in SHORT_DIE]


AS_SHELL = (BLANK + ",", BLANK + ", ELEMENT=SHELL,")

MISTAKES = [
    Mistake("density in kg/m3", MATERIAL, ["density", "kg/m3", "7.85e-9"], ["density=7850"]),
    Mistake("density in g/mm3", MATERIAL, ["wave speed", "m/s"], ["density=7.85e-3"]),
    Mistake("modulus in GPa", MATERIAL, ["Young's modulus", "GPa", "2.1e5"], ["young=210"]),
    Mistake("modulus in Pa", MATERIAL, ["Young's modulus", "2.1e5"], ["young=2.1e11"]),
    Mistake("two systems of units without a label", MATERIAL, ["m, kg, s, Pa", "mm, t, s, MPa"],
            ["density=7850"], [("*UNITS\nmm, t, s, N, MPa, mJ\n", "")]),
    Mistake("lengths in metres", BLANK, ["thick", "mm"], ["thickness=0.001"]),
    Mistake("lengths in micrometres", BLANK, ["thick", "mm"],
            text=[("mm, t, s, N, MPa, mJ", "m, kg, s"), ("7.85e-9", "7850"),
                  ("young = 210000", "young = 2.1e11")]),
    Mistake("stroke that ends above the sheet", PUNCH, ["punch", "never reaches"],
            ["stroke=5"], [("<punch_x + 15>, <thickness>", "<punch_x + 15>, <thickness + 9>"),
                           ("<punch_x - 2>, <thickness>", "<punch_x - 2>, <thickness + 9>"),
                           ("<punch_x + 32>, <thickness>", "<punch_x + 32>, <thickness + 9>"),
                           ("<punch_x + 38>, <thickness>, 0", "<punch_x + 38>, <thickness + 9>, 0"),
                           ("<punch_x + 38>, <thickness + 6>",
                            "<punch_x + 38>, <thickness + 15>")]),
    Mistake("punch beside the sheet", PUNCH, ["punch", "never reaches"], ["punch_x=200"]),
    Mistake("punch that moves up", PUNCH, ["punch", "moves away"],
            text=[("0, <-speed>, 0", "0, <speed>, 0")]),
    Mistake("nothing that moves", DIE, ["no tool that moves", "*TOOL MOTION"],
            text=[("*TOOL MOTION, TOOL=punch, AMPLITUDE=stroke\n0, <-speed>, 0\n", "")]),
    Mistake("die narrower than the sheet", DIE, ["die", "beyond"], ["die_end=15"]),
    Mistake("sheet wider than the die", DIE, ["die", "beyond"], ["length=120", "holder_end=130"]),
    Mistake("holder shorter than the sheet", HOLDER, ["holder", "beyond"], ["holder_end=80"]),
    Mistake("side of the punch", PUNCH, ["punch", "SIDE"], level="error",
            text=[("*TOOL, NAME=punch, TYPE=EXTRUDED, SIDE=POSITIVE",
                   "*TOOL, NAME=punch, TYPE=EXTRUDED, SIDE=NEGATIVE"),
                  ("<punch_x - 2>, <thickness>, 0", "<punch_x - 2>, <thickness + 9>, 0"),
                  ("<punch_x + 15>, <thickness>, 0", "<punch_x + 15>, <thickness + 9>, 0"),
                  ("<punch_x + 32>, <thickness>, 0", "<punch_x + 32>, <thickness + 9>, 0"),
                  ("<punch_x + 38>, <thickness>, 0", "<punch_x + 38>, <thickness + 9>, 0"),
                  ("<punch_x + 38>, <thickness + 6>", "<punch_x + 38>, <thickness + 15>")]),
    Mistake("side of the die, which touches", "*CONTACT PAIR, TOOL=die", ["die", "SIDE"],
            level="error", text=[("TYPE=EXTRUDED, SIDE=NEGATIVE", "TYPE=EXTRUDED, SIDE=POSITIVE")]),
    Mistake("face that looks away", "*CONTACT PAIR, TOOL=die", ["looks away", "FACE"],
            text=[("TOOL=die, FACE=Y_MIN", "TOOL=die, FACE=Y_MAX")]),
    Mistake("tool folded over itself", DIE, ["die", "folds over itself"],
            text=[("40, -40, 0\n", "40, 10, 0\n"), ("40, -6, 0\n", "40, -70, 0\n")]),
    Mistake("gap in the die", DIE, ["gap", "gap of 0.5 "], text=die_in_two(60.5)),
    Mistake("overlap in the die", DIE, ["overlap", "die"], text=die_in_two(57)),
    Mistake("die too narrow for punch and sheet", PUNCH,
            ["'punch' and 'die'", "clearance of 0.5"], ["punch_x=1.5"]),
    Mistake("stroke that ends in the bottom of the die", MOTION,
            ["'punch' and 'die'", "clearance of 0.5", "stroke is too long by 0.5"],
            text=[(PUNCH, BOTTOM.format(y=-29.5) + PUNCH)]),
    Mistake("stroke that goes through the bottom of the die", MOTION,
            ["'punch' and 'die'", "run into each other", "stroke is too long by 10"],
            text=[(PUNCH, BOTTOM.format(y=-20) + PUNCH)]),
    Mistake("punch that ends before the plane of symmetry", PUNCH,
            ["'punch'", "ends 2 before the plane of symmetry x = 0"],
            text=[("<punch_x - 2>, <thickness>", "<punch_x + 2>, <thickness>")]),
    Mistake("bottom of the die that ends before it", DIE,
            ["'die'", "ends 2 before the plane of symmetry x = 0"],
            text=[(PUNCH, BOTTOM.format(y=-30).replace("-2,", "2,").replace("40", "36") +
                   PUNCH)]),
    Mistake("punch that slopes at the plane of symmetry", PUNCH,
            ["'punch'", "x = 0", "not symmetric"],
            text=[("<punch_x - 2>, <thickness>", "<punch_x - 20>, <thickness + 3>")]),
    Mistake("punch too fast", MOTION, ["punch", "impact", "speed of at most"],
            ["speed=40000"], [("0, 0, <0.1*time>, 1, <0.9*time>, 1, <time>, 0", "0, 1")]),
    Mistake("punch that starts too soon", MOTION, ["punch", "accelerates", "speed of at most"],
            ["speed=100000", "stroke=20"]),
    Mistake("no friction under the holder", "*CONTACT PAIR, TOOL=holder", ["friction", "holder"],
            text=[("TOOL=holder, FACE=Y_MAX, FRICTION=0.1", "TOOL=holder, FACE=Y_MAX")]),
    Mistake("springback without supports", RELEASE,
            ["leave free", "motion in y"],
            text=[("*BOUNDARY\nnear, 2, 3\n", "")]),
    Mistake("springback clamped", "near, 2, 3", ["near", "cannot spring back"],
            text=[("INTERSECTION\nX_MIN\nZ_MIN", "INTERSECTION\nX_MIN\nX_MIN")]),
    Mistake("force that begins after the step", FORCE, ["holder", "reaches no more than 0 of 1"],
            text=[(MATERIAL, "*AMPLITUDE, NAME=late\n<2*time>, 0, <4*time>, 1\n" + MATERIAL),
                  (FORCE, FORCE + ", AMPLITUDE=late")]),
    Mistake("holder drawn away", FORCE, ["holder", "away"], ["holder_force=2000"]),
    Mistake("holder beside the sheet", FORCE, ["holder", "beside"],
            text=[("42, <thickness>, -1\n", "142, <thickness>, -1\n")]),
    Mistake("holder too heavy and too far", FORCE, ["holder", "longer than the step"],
            text=[(FORCE, FORCE + ", MASS=1"),
                  ("42, <thickness>, -1", "42, <thickness + 20>, -1")]),
    Mistake("holder too light to start far away", FORCE, ["holder", "strikes it at"],
            text=[("42, <thickness>, -1", "42, <thickness + 20>, -1")]),
    Mistake("holder force in kN", FORCE, ["holder", "force of 0.02", "pressure"],
            ["holder_force=-0.02"]),
    Mistake("holder force in mN", FORCE, ["holder", "pressure", "yields at 200"],
            ["holder_force=-2e6"]),
    Mistake("friction in percent", HOLDING, ["friction of 10"],
            text=[("TOOL=holder, FACE=Y_MAX, FRICTION=0.1",
                   "TOOL=holder, FACE=Y_MAX, FRICTION=10")]),
    Mistake("mass scaling far beyond the mass", "*DYNAMIC, EXPLICIT\n<time>", ["mass", "adds"],
            text=[("<time>\n*TOOL MOTION", "<time>\n*MASS SCALING, DT=1e-6\n*TOOL MOTION")]),
    Mistake("yield stress in Pa", MATERIAL, ["yield stress", "MPa", "2e8"],
            text=[("200, 200, 8", "2e8, 2e8, 8")]),
    Mistake("yield stress in GPa", MATERIAL, ["yield stress", "0.2", "MPa"],
            text=[("200, 200, 8", "0.2, 0.2, 8")]),
    Mistake("hardening of another unit", MATERIAL, ["after 10 %", "10-fold"],
            text=[("200, 200, 8", "200, 200000, 8")]),
    Mistake("amplitude that is zero", MOTION, ["punch", "zero throughout"],
            text=[(STROKE, "*AMPLITUDE, NAME=stroke\n0, 0, <time>, 0")]),
    Mistake("step shorter than the stroke", MOTION, ["punch", "before its amplitude", "15 of 30"],
            text=[("*DYNAMIC, EXPLICIT\n<time>", "*DYNAMIC, EXPLICIT\n<0.5*time>")]),
    Mistake("stroke that continues", MOTION, ["punch", "continues", "instead of"],
            text=[("0.9*time>, 1, <time>, 0", "0.3*time>, 1")]),
    Mistake("tools left closed", RELEASE, ["still touch"], text=[(REMOVAL + "\n", "")]),
    Mistake("springback that rings", RELEASE, ["vibrates"], text=[("*DYNAMIC RELAXATION\n", "")]),
    Mistake("die removed too early", "*DYNAMIC, EXPLICIT\n<time/2>\n*MODEL",
            ["punch", "still moves into", "'die'"],
            text=[("<time>\n*TOOL MOTION", "<time/2>\n*TOOL MOTION"),
                  ("*STEP, NAME=release\n", "*STEP, NAME=deeper\n*DYNAMIC, EXPLICIT\n<time/2>\n"
                   "*MODEL CHANGE, REMOVE\ndie\n*END STEP\n*STEP, NAME=release\n"),
                  (REMOVAL, "*MODEL CHANGE, REMOVE\npunch, holder"),
                  (STROKE, "*AMPLITUDE, NAME=stroke, TIME=TOTAL TIME\n0, 0, <0.1*time>, 1, "
                   "<0.9*time>, 1, <time>, 0")]),
    Mistake("holder force along the sheet", FORCE, ["holder", "does not press"],
            text=[("0, <holder_force>, 0", "<holder_force>, 0, 0")]),
    Mistake("stroke given as a velocity", MOTION, ["'punch' by 0.45", "DISPLACEMENT"],
            text=[("0, <-speed>, 0", "0, <-stroke>, 0")]),
    Mistake("amplitude in percent", MOTION, ["'punch' by 3000", "blank is 180 long"],
            text=[(STROKE, STROKE.replace(" 1,", " 100,"))]),
    Mistake("symmetry of another axis", "X_MIN, YSYMM", ["YSYMM", "normal x", "XSYMM"],
            text=[("X_MIN, XSYMM", "X_MIN, YSYMM")]),
    Mistake("motion across the plane of symmetry", MOTION, ["along x", "symmetry x = 0"],
            text=[("0, <-speed>, 0", "<0.01*speed>, <-speed>, 0")]),
    Mistake("punch beyond the plane of symmetry", PUNCH, ["beyond the plane", "x = 0"],
            ["punch_x=-60"]),
    Mistake("pair on an edge of the sheet", "*CONTACT PAIR, TOOL=die", ["edge of the sheet"],
            text=[("TOOL=die, FACE=Y_MIN", "TOOL=die, FACE=Z_MIN")]),
    Mistake("holder removed in the first step", HOLDER, ["'holder'", "removed in step 1"],
            text=[("<time>\n*TOOL MOTION", "<time>\n*MODEL CHANGE, REMOVE\nholder\n*TOOL MOTION"),
                  (REMOVAL, "*MODEL CHANGE, REMOVE\ndie, punch")]),
    Mistake("stroke in the step of release", MOTION, ["in step 2", "removed"],
            text=[(MOTION + ", AMPLITUDE=stroke\n0, <-speed>, 0\n", ""),
                  (REMOVAL, MOTION + ", AMPLITUDE=stroke\n0, <-speed>, 0\n" + REMOVAL)]),
    Mistake("die that moves away under a holder", DIE, ["'die'", "moves away"],
            text=[(MOTION, "*TOOL MOTION, TOOL=die")]),
    Mistake("punch wider than the die", PUNCH, ["overlap for most of the stroke"],
            ["punch_x=8"]),
    Mistake("relaxation shorter than an amplitude", RELEASE, ["ends at 0.01", "amplitude", " 1:"],
            text=[(MATERIAL, "*AMPLITUDE, NAME=slow\n0, 0, 1, 1\n" + MATERIAL),
                  ("near, 2, 3\n", "near, 2, 3\n*GRAVITY, AMPLITUDE=slow\n0, -9810, 0\n")]),
    Mistake("holder that is not removed", RELEASE, ["'holder'", "still touch"],
            text=[(REMOVAL, "*MODEL CHANGE, REMOVE\ndie, punch")]),
    Mistake("too few points for the springback", "*CONTACT PAIR, TOOL=die",
            ["1x5 points", "springback", "2x2"],
            text=[(BLANK + ",", BLANK + ', QUADRATURE="2,2,5",')]),
    Mistake("relaxation during the stroke", "*DYNAMIC, EXPLICIT\n<time>", ["moves by 30"],
            text=[("<time>\n*TOOL MOTION", "<time>\n*DYNAMIC RELAXATION\n*TOOL MOTION")]),
    Mistake("parameter with letters exchanged", "widht = 3", ["widht", "nothing in the deck"],
            text=[("die_end = 21\n", "die_end = 21\nwidht = 3\n")]),
    Mistake("axis 3 of the material in the sheet", "*ORIENTATION", ["axis 3", "in the sheet"],
            text=[(BLANK, HILL + "1, 0, 0, 0, 1, 0\n" + BLANK)]),
    Mistake("axes that are parallel", "*ORIENTATION", ["1, 0, 0, 1, 0, 0: ", "parallel"],
            text=[(BLANK, HILL + "1, 0, 0, 1, 0, 0\n" + BLANK)], level="error"),
    Mistake("constants of another hardening", "*PLASTIC", ["200, 200, 8: ", "exponent"],
            text=[("HARDENING=VOCE", "HARDENING=SWIFT")], level="error"),
    Mistake("draw bead in N/m", "*DRAW BEAD", ["50000", "310"],
            text=[(STROKE, BEAD + STROKE)]),
    Mistake("pressure in kPa", "Y_MAX, 8000", ["8000", "310"],
            text=[("near, 2, 3\n", "near, 2, 3\n*PRESSURE\nY_MAX, 8000\n")]),
    Mistake("amplitude that is not named", "*AMPLITUDE, NAME=stroke", ["stroke", "nothing"],
            text=[(MOTION + ", AMPLITUDE=stroke", MOTION)]),
    Mistake("set that is not named", "*SET, NAME=near", ["near", "nothing"],
            text=[("near, 2, 3", "X_MIN, 2, 3")]),
    Mistake("material that is not named", "*MATERIAL, NAME=other", ["other", "nothing"],
            text=[(BLANK, OTHER + BLANK)]),
    Mistake("all of the blank held", "ALL, ENCASTRE", ["nothing can form it"],
            text=[("X_MIN, XSYMM", "ALL, ENCASTRE")]),
    Mistake("decimal comma", "<young>, 0,3", ["3 fields", "decimals follow a point"],
            text=[("<young>, 0.3", "<young>, 0,3")], level="error"),
    Mistake("keyword in a comment", "*AMPLITUDE", ["11 numbers", "`**`"], level="error",
            text=[(MOTION, "**TOOL MOTION, TOOL=punch"),
                  ("*SET, NAME=near, OPERATION=INTERSECTION\nX_MIN\nZ_MIN\n", ""),
                  ("*STEP, NAME=draw\n*DYNAMIC, EXPLICIT\n<time>\n", ""),
                  ("near, 2, 3\n", "X_MIN, 2, 3\n")]),
    Mistake("tool without a pair", HOLDER, ["holder", "*CONTACT PAIR"],
            text=[("*CONTACT PAIR, TOOL=holder, FACE=Y_MAX, FRICTION=0.1\n", ""),
                  (FORCE + "\n0, <holder_force>, 0\n", "")]),
    Mistake("shells around a sharp radius", "*CONTACT PAIR, TOOL=die",
            ["radius 6", "4.6", "ELEMENT=SOLID"], ["thickness=1.3"], [AS_SHELL]),
    Mistake("shells with a layer too few", BLANK, ["3 layers", "at least 4"],
            text=[AS_SHELL, ("TYPE=BOX", 'TYPE=BOX, QUADRATURE="2,2,3"')]),
    Mistake("a shell as a plane of symmetry", "Z_MIN, YSYMM", ["normal z", "ZSYMM"],
            text=[AS_SHELL, ("X_MIN, XSYMM", "X_MIN, XSYMM\nZ_MIN, YSYMM")]),
    Mistake("a bead on the edge of a shell", "*DRAW BEAD", ["FACE=X_MAX"], level="error",
            text=[AS_SHELL, (STROKE, BEAD.replace("Y_MAX", "X_MAX") + STROKE)]),
    Mistake("a pair on the edge of a shell", "*CONTACT PAIR, TOOL=die", ["edge of a shell"],
            text=[AS_SHELL, ("TOOL=die, FACE=Y_MIN", "TOOL=die, FACE=Z_MIN")], level="error"),
    Mistake("an Abaqus mesh: nodes", "*NODE", ["*BLANK"], level="error",
            text=[("*BOUNDARY\nX_MIN", "*NODE\n1, 0, 0, 0\n*BOUNDARY\nX_MIN")]),
    Mistake("an Abaqus mesh: elements", "*ELEMENT", ["*BLANK"], level="error",
            text=[("*BOUNDARY\nX_MIN",
                   "*ELEMENT, TYPE=S4R\n1, 1, 2, 3, 4\n*BOUNDARY\nX_MIN")]),
    Mistake("an Abaqus section", "*SHELL SECTION", ["*BLANK"], level="error",
            text=[("*BOUNDARY\nX_MIN",
                   "*SHELL SECTION, ELSET=all, MATERIAL=steel\n1.0\n*BOUNDARY\nX_MIN")]),
]


def check(program, deck, *options):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "draw.key"
        path.write_text(deck)
        return subprocess.run([program, str(path), "--check", *options], capture_output=True,
                              text=True, timeout=120, cwd=folder, check=False)


def complaint_about(program, mistake):
    """What is wrong with the report of a mistake, or None."""
    deck = DECK
    for old, new in mistake.text:
        if old not in deck:
            return f"the deck has no '{old}'"
        deck = deck.replace(old, new)
    options = [word for setting in mistake.set for word in ("--set", setting)]
    done = check(program, deck, *options)
    line = deck[:deck.index(mistake.at)].count("\n") + 1
    mark = f"draw.key:{line}: {mistake.level}:"
    for report in done.stderr.splitlines():
        if mark in report and all(word in report for word in mistake.words):
            break
    else:
        return f"no line with {mark} and {mistake.words}:\n{done.stderr}"
    if done.returncode != (1 if mistake.level == "error" else 0):
        return f"exit code {done.returncode}"
    return None


def complaint_about_sides(program):
    """All sides reversed in one run are reported in one go; without SIDE all are right."""
    pattern = ("TYPE=EXTRUDED, SIDE=NEGATIVE", "TYPE=EXTRUDED, SIDE=POSITIVE",
               "TYPE=PLANE, SIDE=POSITIVE")
    without = reverse = DECK
    for words in pattern:
        without = without.replace(words, words[:words.index(",")])
    swap = {"NEGATIVE": "POSITIVE", "POSITIVE": "NEGATIVE"}
    reverse = "\n".join(line.rsplit("SIDE=", 1)[0] + "SIDE=" + swap[line.rsplit("SIDE=", 1)[1]]
                        if "SIDE=" in line and line.startswith("*TOOL,") else line
                        for line in DECK.splitlines()) + "\n"
    done = check(program, without)
    if done.returncode != 0 or "warning" in done.stderr:
        return f"without SIDE:\n{done.stderr}"
    done = check(program, reverse)
    missing = [tool for tool in ("die", "punch", "holder")
               if not any(f"'{tool}'" in line and "error" in line and "SIDE" in line
                          for line in done.stderr.splitlines())]
    return f"sides of {missing} not reported:\n{done.stderr}" if missing else None


NOSE = PUNCH + """, TYPE=PLANE, SIDE=POSITIVE
-20, 81, -1
20, -80, 0
0, 0, 23
*TOOL, NAME=right, TYPE=PLANE, COMPONENT OF=punch
0, <thickness>, -1
20, 80, 0
0, 0, 23
"""


def complaint_about_nose(program):
    """A sharp nose with steep flanks in the opening of the holder is a punch like others."""
    nose = DECK[:DECK.index(PUNCH)] + NOSE + DECK[DECK.index(HOLDER):]
    done = check(program, nose.replace("punch_x = 0\n", ""))
    return done.stderr if done.returncode != 0 or "warning" in done.stderr else None


def complaint_about_words(program):
    """Names with blanks on lines of their own, a parameter that nothing uses, increments beyond
    the stable one, and a checkpoint that is missing."""
    lower = re.sub(r"\bdie\b", "lower die", DECK).replace("lower die, punch", "lower die\npunch")
    done = check(program, lower)
    if done.returncode != 0 or done.stderr:
        return f"name with a blank:\n{done.stderr}"
    idle = DECK.replace("stroke = 30\n", "stroke = 30\nidle = 2\n")
    done = check(program, idle, "--set", "idle=3", "--set", "stroke=29")
    if "--set IDLE, a parameter that nothing" not in done.stderr or "STROKE" in done.stderr:
        return f"parameter that nothing uses:\n{done.stderr}"
    done = check(program, DECK.replace("EXPLICIT\n<time>", "EXPLICIT, SCALE FACTOR=2\n<time>"))
    if "above the stable" not in done.stderr or "penalt" in done.stderr:
        return f"scale factor of 2:\n{done.stderr}"
    done = check(program, DECK, "--restart", "none.ckpt.h5")
    if done.returncode == 0 or "none.ckpt.h5" not in done.stderr:
        return f"checkpoint that is missing:\n{done.stderr}"
    done = check(program, DECK, "--restart", "draw.key")
    return None if done.returncode != 0 and "draw.key" in done.stderr else \
        f"checkpoint that is a deck:\n{done.stderr}"


def complaint_about_right(program):
    """The set-up has no mistake, and none if the stroke closes on the bottom of the die; shells
    serve it as well, which the check of solids says."""
    for deck in (DECK, DECK.replace(PUNCH, BOTTOM.format(y=-30) + PUNCH)):
        for is_shell in (False, True):
            done = check(program, deck.replace(*AS_SHELL) if is_shell else deck)
            if done.returncode != 0 or done.stderr:
                return done.stderr
            kernel = "p22_q226_shell" if is_shell else "p222_q226"
            if not re.search(f"kernel {kernel}$", done.stdout, re.MULTILINE):
                return f"not tuned for its rule:\n{done.stdout}"
            if ("shells (ELEMENT=SHELL)" in done.stdout) == is_shell:
                return f"an offer of shells, or none:\n{done.stdout}"
    done = check(program, DECK, "--set", "thickness=1.3")
    return done.stdout if "shells (ELEMENT=SHELL)" in done.stdout else None


def main(program):
    cases = [("without a mistake", complaint_about_right(program))]
    cases += [(mistake.name, complaint_about(program, mistake)) for mistake in MISTAKES]
    cases += [("all sides", complaint_about_sides(program)),
              ("sharp nose", complaint_about_nose(program)),
              ("words", complaint_about_words(program))]
    complaints = [(name, text) for name, text in cases if text]
    for name, text in complaints:
        print(f"{name}: {text}\n")
    print(f"{len(cases)} cases, {len(complaints)} complaints")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
