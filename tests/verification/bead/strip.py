"""A strip drawn through a bead against closed forms: work of the restraint, sticking, sliding.

Usage: strip.py IGAFORM FOLDER_OF_DECK
"""
import os
import re
import subprocess
import sys
import tempfile

import h5py
import numpy as np

F, WIDTH, WAY, SLIP, TIME = 50.0, 10.0, 12.0, 0.09, 2e-3
MASS = 7.85e-9 * 80 * WIDTH
MUMPS = os.path.join(os.path.dirname(sys.argv[1]), "..", "lib", "libigaform_mumps.so")
DECK = os.path.join(sys.argv[2], "strip.key")


def run(folder, **parameters):
    """Histories of the deck with these parameters."""
    path = os.path.join(folder, "strip.h5")
    sets = [part for key, value in parameters.items() for part in ("--set", f"{key}={value}")]
    subprocess.run([sys.argv[1], DECK, "--quiet", "--threads", "1", "--out", path, *sets],
                   check=True)
    return histories(path)


def run_steps(folder, bead, steps, **parameters):
    """Histories of the deck with its bead before the first of these steps, or where they put it."""
    text = open(DECK).read()
    model, bead_lines = text[:text.index("*DAMPING")], text[text.index("*DRAW BEAD"):]
    bead_lines = bead_lines[:bead_lines.index("*AMPLITUDE")]
    if not bead:
        model = model.replace(bead_lines, "")
    deck, path = os.path.join(folder, "steps.key"), os.path.join(folder, "steps.h5")
    with open(deck, "w") as file:
        file.write(model)
        for share, change in steps:
            file.write(f"*STEP\n*DYNAMIC, EXPLICIT\n<{share}*time>\n{change}*OUTPUT, FRAMES=1\n"
                       "*END STEP\n".replace("BEAD\n", bead_lines))
    sets = [part for key, value in parameters.items() for part in ("--set", f"{key}={value}")]
    subprocess.run([sys.argv[1], deck, "--quiet", "--threads", "1", "--out", path, *sets],
                   check=True)
    return histories(path)


def histories(path):
    with h5py.File(path) as file:
        history = {name: file["history"][name][:] for name in
                   ("time", "friction_energy", "external_work", "energy_error", "momentum")}
        end = file["history/probes/end"]
        history.update(way=end["displacement"][:, 0], speed=end["velocity"][:, 0])
    return history


def close(what, value, expected, tolerance):
    print(f"{what}: {value:.6g}, closed form {expected:.6g}")
    assert abs(value - expected) <= tolerance * abs(expected), what


def drawn(folder):
    """The whole strip moves by a known way: the springs give in after their slip."""
    for name, factor, lean, options in (
            ("straight across", 1, 0, {}), ("slanted line", 1, 0.6, {"slant": 0.6}),
            ("half the force", 0.5, 0, {"curve": 0.5}),
            ("lower face", 1, 0, {"face": '"ZETA_MIN"'}),
            ("pressed down", 1, 0, {"hold": 20}), ("corner ahead", 1, 0.6, {"corner": 0.48}),
            ("corner behind", 1, 0.6, {"corner": -0.48})):
        history = run(folder, **options)
        lost = factor * F * WIDTH * (WAY - 0.5 * SLIP * np.hypot(1, lean))
        close(f"work of the bead, {name}", history["friction_energy"][-1], lost, 1e-3)
        assert np.abs(history["energy_error"]).max() < 0.01
    # the springs are in full stretch while the strip moves: the force is the slope of the work
    slope = np.polyfit(history["way"][50:150], history["friction_energy"][50:150], 1)[0]
    close("restraining force", slope, F * WIDTH, 2e-3)


def held_down(folder):
    """A strip that nothing holds below takes the push of the bead as momentum, on either face."""
    for face, sense in (("ZETA_MAX", -1), ("ZETA_MIN", 1)):
        history = run(folder, hold=20, way=0, held='"YSYMM"', face=f'"{face}"', time=2e-4)
        momentum = history["momentum"][:, 2]
        close(f"momentum by hold-down on {face}", momentum[-1],
              sense * 20 * WIDTH * history["time"][-1], 5e-3)


def closing_tool(folder):
    """The force rises with the way of a tool that touches nothing and is not warned of."""
    text = open(DECK).read()
    text = text.replace("AMPLITUDE=force\n", "AMPLITUDE=closing, CLOSING=holder\n")
    text = text.replace("*DRAW BEAD,", "*TOOL, NAME=holder, TYPE=PLANE\n0, 0, 30\n80, 0, 0\n"
                        "0, 10, 0\n*DRAW BEAD,")
    text = re.sub(r"NAME=force\n.*\n", "NAME=closing\n0, 0, 3, 1\n", text)
    text = re.sub(r"\ncurve = .*", "", text)
    text = text.replace("*DAMPING", "*TOOL MOTION, TOOL=holder, TYPE=VELOCITY\n0, 0, <-6/time>\n"
                        "*DAMPING")
    deck, path = os.path.join(folder, "closing.key"), os.path.join(folder, "closing.h5")
    with open(deck, "w") as file:
        file.write(text)
    done = subprocess.run([sys.argv[1], deck, "--quiet", "--threads", "1", "--out", path],
                          check=True, capture_output=True, text=True)
    assert "warning" not in done.stderr + done.stdout, done.stderr
    history = histories(path)
    # full from half of the time on; by then half of the way is done
    share = np.clip(history["time"] / TIME * 2, 0, 1)
    way = history["way"]
    lost = F * WIDTH * np.sum(0.5 * (share[1:] + share[:-1]) * np.diff(way))
    early = F * WIDTH * 0.5 * SLIP * np.interp(0.5 * SLIP, way, share)
    close("work of a bead that closes", history["friction_energy"][-1], lost - early, 2e-3)
    assert np.abs(history["energy_error"]).max() < 0.01


def pulled_by_the_end(folder):
    """An elastic strip of which one end is drawn: behind the bead it follows without stress."""
    history = run(folder, driven='"X_MAX"')
    stretch = F * 30 / 21000
    close("work of the bead, drawn by the end", history["friction_energy"][-1],
          F * WIDTH * (WAY - stretch - 0.5 * SLIP), 2e-3)
    assert np.abs(history["energy_error"]).max() < 1e-3


def pulled_by_a_force(folder):
    """Below the restraint the strip stays where the springs hold it; above it the rest is left."""
    free = {"component": 2, "way": 0}
    stuck = run(folder, load=0.8 * F, damping=20000, **free)
    stretch = 0.8 * F * 30 / 21000
    close("way of the end while the bead holds", stuck["way"][-1], 0.8 * SLIP + stretch, 0.03)
    assert np.ptp(stuck["way"][-50:]) < 0.05 * SLIP
    slides = run(folder, load=1.2 * F, **free)
    # the load rises within 0.3 of the time and passes the restraint at 0.25
    speed = WIDTH * F * (0.2 * 0.7 + 0.5 * 0.2 * 0.05) * TIME / MASS
    close("speed of a strip that slides", slides["speed"][-10:].mean(), speed, 0.04)
    assert np.abs(slides["energy_error"]).max() < 1e-2


def opens_and_closes_with_steps(folder):
    """A bead that a step opens, closes again or brings holds nothing back while it is away."""
    remove, add = "*MODEL CHANGE, REMOVE\nmiddle\n", "*MODEL CHANGE, ADD\nmiddle\n"
    for name, bead, steps, closed, times in (
            ("opened", True, ((0.5, ""), (0.5, remove)), 0.45, 1),
            ("opened and closed again", True, ((0.3, ""), (0.4, remove), (0.3, add)), 0.5, 2),
            ("first in the second step", False, ((0.5, ""), (0.5, "BEAD\n")), 0.45, 1)):
        history = run_steps(folder, bead, steps)
        lost = F * WIDTH * (closed / 0.9 * WAY - times * 0.5 * SLIP)
        close(f"work of the bead, {name}", history["friction_energy"][-1], lost, 2e-3)
        assert np.abs(history["energy_error"]).max() < 0.01


def run_static(folder, **parameters):
    """Histories of the deck as a static step of 20 increments."""
    text = open(DECK).read()
    text = text[:text.index("*DAMPING")].replace("damping = 1\n", "") + (
        "*STATIC\n<time/20>, <time>,, <time/20>\n*OUTPUT, FRAMES=1, HISTORY=20\n")
    deck, path = os.path.join(folder, "static.key"), os.path.join(folder, "static.h5")
    with open(deck, "w") as file:
        file.write(text.replace('RULE="2,2,2"', parameters.pop("rule", 'RULE="2,2,2"')))
    sets = [part for key, value in parameters.items() for part in ("--set", f"{key}={value}")]
    subprocess.run([sys.argv[1], deck, "--quiet", "--threads", "1", "--out", path, *sets],
                   check=True)
    return histories(path)


def in_a_static_step(folder):
    """As in the explicit one: the force on an end that is drawn, and where a load is held."""
    for name, options in (("solid", {}), ("shell", {"rule": "ELEMENT=SHELL", "held": '"3, 3"'})):
        history = run_static(folder, driven='"X_MAX"', **options)
        way, work = history["way"][5:15], history["external_work"][5:15]
        close(f"restraining force in a static step, {name}", np.polyfit(way, work, 1)[0],
              F * WIDTH, 1e-4)
        explicit = run(folder, driven='"X_MAX"') if name == "solid" else explicit
        slope = np.polyfit(explicit["way"][50:150], explicit["external_work"][50:150], 1)[0]
        close(f"the same in an explicit step, {name}", slope, F * WIDTH, 0.01)
        assert np.abs(history["energy_error"]).max() < 1e-5
        stuck = run_static(folder, load=0.8 * F, component=2, way=0, **options)
        close(f"way of a load that the bead holds, {name}", stuck["way"][-1],
              0.8 * SLIP + 0.8 * F * 30 / 21000, 0.015)


def main():
    with tempfile.TemporaryDirectory() as folder:
        drawn(folder)
        held_down(folder)
        closing_tool(folder)
        pulled_by_the_end(folder)
        pulled_by_a_force(folder)
        opens_and_closes_with_steps(folder)
        if os.path.exists(MUMPS):
            in_a_static_step(folder)


main()
