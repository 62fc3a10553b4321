"""The strip that *REDUCE makes of the channel, linear across with one point there, against the deck
that spells it out with the degree of the sheet, and what is refused.

usage: run.py IGAFORM SOURCE
"""
import os
import re
import subprocess
import sys
import tempfile

import h5py
import numpy as np

# The stiffness given: that of PENALTY hangs on the mass a point sees, so on how many there are.
SETTINGS = {"n_x": 40, "closing": 12, "frames": 1, "history": 100,
            "touch": "POINTS=GAUSS, STIFFNESS=2000"}
RATIO = 40.0     # 400 mm over the 10 mm of the strip
WIDE = ("kinetic_energy", "internal_energy", "plastic_work", "contact_energy", "external_work",
        "viscous_energy", "momentum")


def run(igaform, deck, *options):
    return subprocess.run([igaform, deck, *options], capture_output=True, text=True, timeout=300)


def strip(igaform, deck, path, **changes):
    settings = [word for name, value in {**SETTINGS, **changes}.items()
                for word in ("--set", f"{name}={value}")]
    done = run(igaform, deck, *settings, "--out", path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    return h5py.File(path)


def compare(igaform, source, folder):
    reduced = strip(igaform, os.path.join(source, "input/channel_reduced.key"),
                    os.path.join(folder, "reduced.h5"))
    spelt = strip(igaform, os.path.join(source, "input/channel_strip.key"),
                  os.path.join(folder, "strip.h5"))
    names = [f"history/{name}" for name in WIDE] + ["tools/lower die/force",
                                                    "tools/upper die/force"]
    for name in names:
        one, two = reduced[name][()], RATIO*spelt[name][()]
        scale = np.abs(two).max()
        assert scale > 0, f"{name} says nothing"
        assert np.abs(one - two).max() <= 1e-9*scale, f"{name} differs"
    for name in ("history/dt", "history/max_penetration"):
        assert np.allclose(reduced[name][()], spelt[name][()], rtol=1e-9, atol=1e-9), name
    sides = [result["nurbs/blank/points"][:, [0, -1]] for result in (reduced, spelt)]
    assert np.abs(sides[0] - sides[1]).max() < 1e-9, "shapes differ"
    mass = reduced["provenance/blank_mass"][()], spelt["provenance/blank_mass"][()]
    assert abs(mass[0] - RATIO*mass[1]) <= 1e-12*mass[0], mass
    assert abs(reduced["provenance/width_ratio"][()] - RATIO) < 1e-12, "width of the whole"
    assert "width_ratio" not in spelt["provenance"], "a whole width"
    stress = reduced["points/stress"][()]
    assert np.abs(stress[..., :4]).max() > 100, "no stress"
    assert np.abs(stress[..., 4:]).max() < 1e-9, "shear across the strip"
    sides_move_alike(reduced)


def sides_move_alike(result, across=2):
    """Control points of the last state that lie behind each other, across the strip."""
    points = result["nurbs/blank/points"][()]
    assert points.shape[1] == 2 and np.ptp(points[..., 3 - across]) > 10, "nothing to compare"
    apart = np.abs(np.delete(points[:, 1] - points[:, 0], across, axis=-1))
    assert apart.max() < 1e-9, "the sides of the strip move apart"


def any_points_do(igaform, source, folder):
    """Sides that touch by points of their own are parted by round-off once they bounce: 0.06 mm."""
    deck = os.path.join(source, "input/channel_reduced.key")
    for points in ("KNOT", "GREVILLE"):
        sides_move_alike(strip(igaform, deck, os.path.join(folder, f"{points}.h5"),
                               touch=f"POINTS={points}", closing=40))


BULGE = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*PLASTIC, HARDENING=VOCE
250, 250, 6
*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, RULE="2,2,2x2"
x, 0.1, 100.3, 2, 30
y, 0.1, 40.7, 2, 6
z, 0, 1, 2, 1
*REDUCE, TYPE=PLANE STRAIN, WIDTH=3.3
*BOUNDARY
X_MIN, ENCASTRE
X_MAX, ENCASTRE
*AMPLITUDE, NAME=ramp
0, 0, 1e-3, 1
*PRESSURE, AMPLITUDE=ramp
Z_MIN, 5
*DYNAMIC, EXPLICIT
3.5e-3
*OUTPUT, FRAMES=1, HISTORY=50
"""


def pressure_does_not_part_sides(igaform, folder):
    """A pressure on each side by where it is itself tears them apart in some thousand steps."""
    deck, path = (os.path.join(folder, name) for name in ("bulge.key", "bulge.h5"))
    with open(deck, "w") as file:
        file.write(BULGE)
    done = run(igaform, deck, "--out", path, "--quiet", "--threads", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    sides_move_alike(h5py.File(path), across=1)


HELD = """*PARAMETER
width = 20
n_y = 4
share = 1
*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, RULE="2,2,2x2"
x, 0, 40, 2, 8
y, 0, <width>, 2, <n_y>
z, 0, 1, 2, 1
*TOOL, NAME=die, TYPE=PLANE, SIDE=POSITIVE
-10, -10, 0
80, 0, 0
0, 40, 0
*TOOL, NAME=holder, TYPE=PLANE, SIDE=NEGATIVE
-10, -10, 1
80, 0, 0
0, 40, 0
*AMPLITUDE, NAME=ramp
0, 0, 2e-4, 1
*CONTACT PAIR, TOOL=die, STIFFNESS=2000, FRICTION=0.1
*CONTACT PAIR, TOOL=holder, STIFFNESS=2000, FRICTION=0.1
*TOOL FORCE, TOOL=holder, AMPLITUDE=ramp, MASS=<4e-6*share>, DAMPING=0.1
0, 0, <-4000*share>
*BOUNDARY, TYPE=VELOCITY, AMPLITUDE=ramp
X_MAX, 1, 1, 2000
"""
HELD_END = "*DYNAMIC, EXPLICIT\n2e-4\n*OUTPUT, FRAMES=1, HISTORY=20\n"


def forces_on_tools_are_shared(igaform, folder):
    """A holder presses a strip with the share of its force and of its mass that is the strip's."""
    results = []
    for name, lines, settings in (
            ("strip", "*REDUCE, TYPE=PLANE STRAIN\n", ()),
            ("spelt", "*BOUNDARY\nALL, 2, 2, 0\n", ("width=5", "n_y=1", "share=0.25"))):
        deck, path = (os.path.join(folder, f"{name}.{end}") for end in ("key", "h5"))
        with open(deck, "w") as file:
            file.write(HELD + lines + HELD_END)
        done = run(igaform, deck, "--out", path, "--quiet", "--threads", "1",
                   *(word for setting in settings for word in ("--set", setting)))
        assert done.returncode == 0, done.stdout + done.stderr
        results.append(h5py.File(path))
    assert abs(results[0]["provenance/width_ratio"][()] - 4) < 1e-12, "width of the whole"
    for name, ratio in (("history/external_work", 4), ("history/friction_energy", 4),
                        ("tools/holder/force", 4), ("tools/holder/displacement", 1)):
        one, two = results[0][name][()], ratio*results[1][name][()]
        assert np.abs(two).max() > 1e-4, f"{name} says nothing"
        assert np.abs(one - two).max() <= 1e-8*np.abs(two).max(), f"{name} differs"
    turn = [np.abs(result["history/angular_momentum"][()][:, 1]) for result in results]
    assert np.abs(turn[0] - 4*turn[1]).max() <= 1e-8*turn[0].max() > 0, "angular momentum"


TUBE = """*MATERIAL, NAME=steel
*DENSITY
7e-9
*ELASTIC
210000, 0.3
*BLANK, NAME=tube, MATERIAL=steel, TYPE=TUBE
0, 0, 0, 10, 12, 5
0, 360, 2, {}, 2, 2, {}
{}
*DYNAMIC, EXPLICIT
1e-7
"""


def closed_tubes_stay_closed(igaform, folder):
    """A tube of 360 degrees keeps its seams on the grid that a reduction or the trial run with
    fewer elements gives it. Its mass is that of the closed form, its step that of one element."""
    path = os.path.join(folder, "tube.key")

    def told(n_around, n_radial, lines, *options):
        with open(path, "w", encoding="ascii") as deck:
            deck.write(TUBE.format(n_around, n_radial, lines))
        done = run(igaform, path, "--check", *options)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "thinnest, 0.0" not in done.stderr, done.stderr   # an axis that closes has a length
        return dict(line.split(maxsplit=1) for line in done.stdout.splitlines())

    for n_around, n_radial in ((2, 1), (2, 3), (4, 2)):
        facts = told(n_around, n_radial, "*REDUCE, TYPE=PLANE STRAIN")
        n_places = 2*(n_radial + 2)
        assert facts["seams"] == f"{2*n_places} control points at {n_places} locations", facts
        assert abs(float(facts["mass"])/(np.pi*(12**2 - 10**2)*5*7e-9) - 1) < 1e-3, facts
        assert 0 < float(facts["stable"].split()[1]) < 1e-6, facts
    facts = told(24, 1, "", "--probe")
    assert facts["trial"].split()[:3] == ["run", "64", "elements,"], facts
    assert facts["advice"] == "none: nothing deforms", facts


def variant(folder, source, lines):
    """The channel with *REDUCE and some more lines."""
    path = os.path.join(folder, "variant.key")
    with open(path, "w", encoding="ascii") as deck:
        deck.write(f'*INCLUDE, INPUT="{source}/input/channel_forming.key"\n{lines}\n')
    return path


def work_in_the_plane(igaform, source):
    """The strip that *REDUCE makes has a kernel of its own, one that a deck spells out has not."""
    deck = os.path.join(source, "input/channel_reduced.key")
    done = run(igaform, deck, "--check", "--set", "rule=2,2,2x2")
    assert "kernel p212_q214_plane_strain" in done.stdout, done.stdout
    whole = run(igaform, os.path.join(source, "input/channel_forming.key"), "--check")
    masses = [re.search(r"mass +(\S+)", text).group(1) for text in (done.stdout, whole.stdout)]
    assert masses[0] == masses[1], masses
    done = run(igaform, os.path.join(source, "input/channel_strip.key"), "--check")
    assert "plane_strain" not in done.stdout, done.stdout


def refuse(igaform, source, folder):
    cases = {"*REDUCE, TYPE=PLANE STRAIN, AXIS=X": "along x",
             "*REDUCE, TYPE=PLANE STRAIN, WIDTH=401": "401",
             "*REDUCE, TYPE=PLANE STRAIN\n*GRAVITY\n0, 0, 9810": " load ",
             "*REDUCE, TYPE=PLANE STRAIN\n*BOUNDARY\nZ_MIN, 1": " boundary "}
    for lines, words in cases.items():
        done = run(igaform, variant(folder, source, lines), "--check")
        assert done.returncode == 1 and words in done.stderr, (lines, done.stdout, done.stderr)


def steps_do_not_reduce(igaform, source, folder):
    """*REDUCE is for all steps: wherever it stands in or behind one, the place before is named."""
    path = os.path.join(folder, "steps.key")
    with open(os.path.join(source, "input/u_bend.key"), encoding="ascii") as deck:
        text = deck.read()
    reduce = "*REDUCE, TYPE=PLANE STRAIN\n"
    for changed in (text + reduce, text.replace("*END STEP", reduce + "*END STEP", 1)):
        with open(path, "w", encoding="ascii") as deck:
            deck.write(changed)
        done = run(igaform, path, "--check")
        assert done.returncode == 1, done.stdout
        assert "before the first *STEP" in done.stderr, done.stderr
    manual = run(igaform, "--keywords").stdout.split("## *REDUCE")[1].split("##")[0]
    assert "Once in a deck.\n" in manual and "in a step of it" not in manual, manual


def advise(igaform, source, folder):
    done = run(igaform, variant(folder, source, ""), "--check", "--set", "n_x=40")
    assert "*REDUCE, TYPE=PLANE STRAIN, AXIS=z" in done.stdout, done.stdout
    assert "1 of 8 elements, saves 88 %" in done.stdout, done.stdout
    assert "narrows" in done.stdout, done.stdout
    assert "*BOUNDARY ZSYMM" in done.stdout and "XSYMM" not in done.stdout, done.stdout
    held = variant(folder, source, "*BOUNDARY\nZ_MIN, 1")
    done = run(igaform, held, "--check", "--set", "n_x=40")
    assert "(*REDUCE" not in done.stdout, done.stdout
    done = run(igaform, os.path.join(source, "input/disk_punch.key"), "--check")
    assert "*REDUCE" not in done.stdout, done.stdout


def main(igaform, source):
    with tempfile.TemporaryDirectory() as folder:
        compare(igaform, source, folder)
        any_points_do(igaform, source, folder)
        pressure_does_not_part_sides(igaform, folder)
        forces_on_tools_are_shared(igaform, folder)
        work_in_the_plane(igaform, source)
        closed_tubes_stay_closed(igaform, folder)
        refuse(igaform, source, folder)
        steps_do_not_reduce(igaform, source, folder)
        advise(igaform, source, folder)
    print("the strip that *REDUCE makes is that of the deck that spells it out")


if __name__ == "__main__":
    main(*sys.argv[1:])
