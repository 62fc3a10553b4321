"""Frequencies of a blank under stress and in contact: a stretched strip as a string, a strut below
its buckling load, and a strip on two supports under a punch.

String: n/2 sqrt(F/(M L)), F the force, M the mass, L the length now. Strut between pins: those of
the beam times sqrt(1 - F/F_crit). A strip in plane strain, held by the punch at its plane of
symmetry and by a support, free behind it: the solutions of Euler's beam in both parts, which agree
in slope and moment at the support.
"""
import os
import subprocess

import h5py
import numpy as np
from run_results import differing, numbers
from suite import Case

E, DENSITY, LENGTH = 210000.0, 7.85e-9, 100.0


def frequencies(case, deck, step, **settings):
    """Of a step of the deck, and the motion of the control points in the first mode."""
    case.run(deck, **settings)
    with h5py.File(os.path.join(case.out, f"{case.name}_{deck}.h5")) as file:
        modes = file[f"modes/step_{step}"]
        return modes["frequency"][...], modes["mode_1"][...]


def string(strain):
    length = LENGTH * (1 + strain)
    return np.sqrt(E * np.log(1 + strain) / (DENSITY * LENGTH * length)) / 2


def beam_on_support(thickness, place, length):
    """First frequency of a beam in plane strain: held at 0, a support at `place`, then free."""
    def determinant(k):
        x, y = k * place, k * (length - place)
        a, b = np.cosh(x) - np.cos(x), np.sinh(x) - np.sin(x)
        c, d = np.cosh(y) + np.cos(y), np.sinh(y) + np.sin(y)
        return np.linalg.det([
            [a, b, 0, 0], [0, 0, c, d],
            [np.sinh(x) + np.sin(x), a, np.sinh(y) - np.sin(y), c],
            [np.cosh(x) + np.cos(x), np.sinh(x) + np.sin(x),
             np.cos(y) - np.cosh(y), np.sin(y) - np.sinh(y)]])
    low, high = 0.5 / length, 0.6 / length
    while determinant(low) * determinant(high) > 0:
        low, high = high, high + 0.1 / length
    for _ in range(60):
        middle = (low + high) / 2
        low, high = ((low, middle) if determinant(low) * determinant(middle) <= 0
                     else (middle, high))
    return low**2 * np.sqrt(E / (1 - 0.3**2) * thickness**2 / 12 / DENSITY) / (2 * np.pi)


def continued(case):
    """A run that goes on from its last checkpoint, at the start of the frequencies, with another
    number of threads."""
    path = os.path.join(case.out, f"{case.name}_touched_strip")
    subprocess.run([*case.command("touched_strip", {}), "--quiet", "--out", path], check=True)
    whole = numbers(path + ".h5")
    subprocess.run([case.igaform, os.path.join(case.decks, "touched_strip.key"), "--quiet",
                    "--threads", "2", "--restart", path + ".ckpt.h5"], check=True)
    case.between("taken up again: datasets of modes", sum(name.startswith("modes/") for name in
                                                          numbers(path + ".h5")), 8, 8)
    case.between("taken up again: datasets with other bits",
                 len(differing(whole, numbers(path + ".h5"))), 0, 0)


def main():
    case = Case("Frequencies under stress and in contact", "string; Euler's beam")
    # Held ends of solids do not turn, and fine elements alone show how short a piece bends there.
    for element, thickness, n in (("SOLID", 0.02, 160), ("SHELL", 0.1, 20)):
        found, mode = frequencies(case, "tensioned_strip", 2, element=element, thickness=thickness,
                                  n=n)
        case.error(f"string of {element.lower()}s", found[0], string(1e-3), 0.01)
    case.between("largest component of the mode", mode.max(), 1, 1)
    case.error("motion of its faces along it", abs(mode[..., 0]).max(),
               np.pi * thickness / (2 * LENGTH), 0.01)
    # Pins that hold the mid-surface of shells alone let the ends turn.
    critical = np.pi**2 / (12 * LENGTH**2)
    free, _ = frequencies(case, "tensioned_strip", 2, thickness=1, strain=0)
    of_start = case.modes("tensioned_strip", len(free), thickness=1, strain=0)
    case.deviation("without stress, against --modes", abs(free / of_start - 1).max(), 1e-8)
    pressed, _ = frequencies(case, "tensioned_strip", 2, thickness=1, strain=-0.5 * critical)
    case.error("strut at half its buckling load", pressed[0], free[0] * np.sqrt(0.5), 0.003)
    buckled, _ = frequencies(case, "tensioned_strip", 2, thickness=1, strain=-1.5 * critical)
    case.between("strut above it", buckled[0], 0, 0)
    case.error("its second frequency", buckled[1], free[1] * np.sqrt(1 - 1.5 / 4), 0.03)
    with open(os.path.join(case.out, f"{case.name}_tensioned_strip.log"), encoding="utf-8") as log:
        case.between("warnings of it", sum("1 unstable mode" in line for line in log), 1, 1)
    for element in ("SOLID", "SHELL"):
        touching, _ = frequencies(case, "touched_strip", 2, element=element)
        case.error(f"strip under a punch, {element.lower()}s", touching[0],
                   beam_on_support(1.0, 30.0, 60.0), 0.02)
        alone, _ = frequencies(case, "touched_strip", 3, element=element)
        case.between("the same without tools: rigid over first frequency", alone[0] / alone[1], 0,
                     1e-3)
    continued(case)
    case.finish()


if __name__ == "__main__":
    main()
