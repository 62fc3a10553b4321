"""Wide strips and a fold released by static increments.

The strips are those of springback.py, whose sums over the layers are the reference: as solid and as
shell they must meet these at least as well as their relaxed twins do. Two sheets that meet at an
angle release the moment that their joint passes on; turned as a whole they release it alike, and
its shape does not depend on where rigid motions are held.
"""
import os
import shutil
import subprocess
import tempfile
import time

import h5py
import numpy as np
from run_results import Run
from springback import curvatures, curvatures_of_shell, sprung_by_rule
from static_runs import iterations, n_increments, same_bits
from suite import Case

LENGTH = 50.0      # of the fold, from end to end along the sheet
STRAIGHT = 1e-6    # of the length, what elastic bending leaves
FINE = 0.01        # increments of the static step that is interrupted


def cost(case, deck):
    """Increments of the release, and seconds of the whole run."""
    with h5py.File(os.path.join(case.out, f"{case.name}_{deck}.h5")) as file:
        steps, all_steps = file["history/step"][...], file["timings/steps"][()]
        is_bent = file["history/process_step"][...] == 1
        return all_steps - steps[is_bent].max(), file["timings/wall_seconds"][()]


def strips(case):
    """The same strips, relaxed and by static increments."""
    for deck, name, measure, radii in (("springback", "solid", curvatures, (200, 80, 20)),
                                       ("wide_plate", "shell", curvatures_of_shell, (200, 20))):
        for radius in radii:
            errors, costs = {}, {}
            for release in ("relaxed", "static"):
                run = case.run(deck, R=radius, release=release)
                bent, released = measure(run)
                errors[release] = (1 - released / bent) / sprung_by_rule(bent, 2, 3) - 1
                costs[release] = cost(case, deck)
            at = f"springback of the {name}, R = {radius} t, against the sum over 2x3 points"
            # the size of the error of relaxation, which is that of the mesh, and round-off
            case.deviation(at, errors["static"], abs(errors["relaxed"]) + 1e-4)
            case.deviation(f"energy balance, {name}, R = {radius} t",
                           run.history["energy_error"][-1], 1e-4)
            print("      " + ", ".join(f"{release}: error {errors[release]:.2e}, {n} increments, "
                                       f"{seconds:.2f} s with bending"
                                       for release, (n, seconds) in costs.items()))
        run = case.run(deck, release="static", **{"yield": 1e6})
        length = np.ptp(run.start[:, 0])
        case.deviation(f"elastic, {name}: way from straight over the length",
                       np.abs(run.points - run.start).max() / length, STRAIGHT)


def apart(points, others):
    """How far two shapes lie apart when a rigid motion lays one over the other."""
    points, others = points - points.mean(axis=0), others - others.mean(axis=0)
    left, _, right = np.linalg.svd(points.T @ others)
    left[:, -1] *= np.sign(np.linalg.det(left @ right))
    return np.abs(points @ left @ right - others).max()


def fold(case):
    """Two sheets at an angle: relaxed, at once and in increments, turned, without a clamp."""
    deck, limit = "released_fold", 1e-7 * LENGTH
    relaxed = case.run(deck, release="relaxed")
    n, seconds = cost(case, deck)
    static = case.run(deck)
    print(f"      fold, relaxed: {n} increments, {seconds:.2f} s with bending; "
          "static: {}, {:.2f} s".format(*cost(case, deck)))
    way = np.abs(static.points - static.frames[1]).max()
    case.between("fold: way of the top as it springs back [mm]", way, 0.5, 1)
    # relaxation swings past the equilibrium and yields once more
    case.deviation("fold: from the relaxed shape, over that way",
                   np.abs(static.points - relaxed.points).max() / way, 0.05)
    case.between("fold: iterations of the one increment", iterations(case, deck).max(), 1, 8)
    steps = case.run(deck, first=0.05)
    case.deviation("fold: energy balance of 20 increments", steps.history["energy_error"][-1], 5e-4)
    case.deviation("fold: 20 increments and one, over the way",
                   np.abs(static.points - steps.points).max() / way, 1e-3)
    case.between("fold: iterations, 20 increments", iterations(case, deck).max(), 1, 6)
    turned = case.run(deck, turn=35)
    cosine, sine = np.cos(np.radians(35)), np.sin(np.radians(35))
    back = turned.points @ np.array([[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]])
    case.deviation("fold turned by 35 degrees [mm]", np.abs(back - static.points).max(), limit)
    # a clamp holds two rows of control points, and with them the strain between them; a line does
    # not, and the one motion that it leaves is held elsewhere
    free = [case.run(deck, held=held, hold="PINNED") for held in ("clamp", "tip")]
    case.between("fold on either of two lines: place [mm]",
                 np.abs(free[0].points - free[1].points).max(), 0.1, 2)
    case.deviation("fold on either of two lines: shape [mm]",
                   apart(free[0].points, free[1].points), limit)
    loose = case.run(deck, hold="YSYMM")
    change = np.abs(loose.points - loose.frames[1])[:, [0, 2]]
    case.between("fold on nothing: components that stay", np.count_nonzero(change < 1e-12), 3, 12)
    case.deviation("fold on nothing: shape [mm]", apart(loose.points, free[1].points), limit)
    elastic = case.run(deck, way=2, **{"yield": 1e6})
    case.deviation("fold, elastic: way from the start over the length",
                   np.abs(elastic.points - elastic.start).max() / LENGTH, STRAIGHT)


def steps_after(case):
    """A sheet that has sprung back stays as it is, in static steps and in explicit ones; there the
    energies stay in balance."""
    deck, result = (os.path.join(case.out, f"{case.name}_after{end}") for end in (".key", ".h5"))
    fold_deck = os.path.abspath(os.path.join(case.decks, "released_fold.key"))
    with open(deck, "w", encoding="utf-8") as file:
        file.write(f'*INCLUDE, INPUT="{fold_deck}"\n' + "".join(
            f"*STEP, NAME={name}\n{lines}\n*OUTPUT, FRAMES=1, HISTORY=20\n*END STEP\n"
            for name, lines in (("again", "*STATIC\n0.5, 1"),
                                ("rest", "*DYNAMIC, EXPLICIT\n1e-4"),
                                ("last", "*STATIC\n0.5, 1"))))
    subprocess.run([case.igaform, deck, "--threads", "1", "--quiet", "--out", result], check=True)
    run = Run(result)
    for number, name in ((3, "static"), (4, "explicit"), (5, "static")):
        case.deviation(f"at rest, step {number}, {name}: way over the length",
                       np.abs(run.frames[number] - run.frames[2]).max() / LENGTH, 1e-7)
    history, number = run.history, run.history["process_step"]
    case.deviation("at rest: kinetic over internal energy",
                   (history["kinetic_energy"] / history["internal_energy"])[number > 2].max(),
                   1e-12)
    case.deviation("at rest: change of the error of energy",
                   np.ptp(history["energy_error"][number > 2]), 1e-9)


def what_goes_wrong(case):
    """Increments too long for the balance of energy, and a program whose file is gone when MUMPS is
    due."""
    deck, result = (os.path.join(case.out, f"{case.name}_fails{end}") for end in (".key", ".h5"))
    fold_deck = os.path.abspath(os.path.join(case.decks, "released_fold.key"))
    with open(deck, "w", encoding="utf-8") as file:
        file.write(f'*ENERGY LIMIT\n0.03\n*INCLUDE, INPUT="{fold_deck}"\n')
    done = subprocess.run([case.igaform, deck, "--set", "yield=1e6", "--threads", "1", "--quiet",
                           "--out", result], capture_output=True, text=True, check=False)
    case.between("balance lost: exit code", done.returncode, 2, 2)
    case.between("balance lost: the message names *STATIC", int("in *STATIC" in done.stderr), 1, 1)
    with tempfile.TemporaryDirectory() as folder:
        above = os.path.dirname(os.path.dirname(case.igaform))
        for name in ("bin/igaform", "lib/libigaform_mumps.so"):
            os.makedirs(os.path.dirname(os.path.join(folder, name)))
            shutil.copy(os.path.join(above, name), os.path.join(folder, name))
        program, log = os.path.join(folder, "bin/igaform"), os.path.join(folder, "gone.log")
        run = subprocess.Popen([program, *case.command("released_fold", {})[1:], "--quiet",
                                "--out", os.path.join(folder, "gone.h5")])
        while run.poll() is None and not (os.path.exists(log) and has_begun(log)):
            time.sleep(0.002)
        case.between("bending when the program goes", int(n_increments(log) == 0), 1, 1)
        os.unlink(program)
        case.between("program is gone: exit code", run.wait(60), 0, 0)


def has_begun(log):
    with open(log, encoding="utf-8") as file:
        return any(line.startswith("step ") for line in file)


def main():
    case = Case("Springback by static increments", "sum over the layers; the relaxed piece")
    strips(case)
    fold(case)
    same_bits(case, "released_fold", 40, 1 / FINE, first=FINE, rise=5e-4)
    steps_after(case)
    what_goes_wrong(case)
    case.finish()


main()
