"""A process that is slow enough: the ratio of energies that the trial run shows against the closed
form, and what comes of the factor on the masses that it advises. One that is too fast gets no
such advice.

usage: run.py IGAFORM SOURCE
"""
import csv
import os
import re
import subprocess
import sys
import tempfile

import h5py
import numpy as np

RELEASE = """*BOUNDARY, TYPE=VELOCITY
X_MAX, 1, 1, <speed>
*END STEP
*STEP, NAME=release
*DYNAMIC, EXPLICIT
0.1
*BOUNDARY, OP=NEW
*DYNAMIC RELAXATION, ENERGY=1e-6
*END STEP
"""
ALLOWED = 0.05                                    # kinetic over internal energy, of the advice
DENSITY, LENGTH, SECTION, SPEED = 7.85e-9, 40.0, 20.0, 4000.0


def run(igaform, deck, *options):
    done = subprocess.run([igaform, deck, "--threads", "1", *options], capture_output=True,
                          text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def found(pattern, text):
    match = re.search(pattern, text)
    assert match, f"'{pattern}' is not in:\n{text}"
    return [float(number) for number in match.groups()]


def expected_ratio():
    """Sums of the energies of a uniform tension: linear velocities, Voce's stress over strain."""
    stretch = np.linspace(0, 4, 4001)
    strain = np.log(1 + stretch/LENGTH)
    flow = 500 - 250*np.exp(-6*strain)
    steps = 0.5*(flow[1:] + flow[:-1])*np.diff(strain)*LENGTH*SECTION
    return DENSITY*LENGTH*SECTION*SPEED**2/6/np.mean(np.cumsum(steps))


def energies(path):
    with h5py.File(path) as file:
        steps = int(file["timings/steps"][()])
        history = file["history"]
        return (np.sum(history["kinetic_energy"])/np.sum(history["internal_energy"]),
                float(history["external_work"][-1]), steps)


def told_of_the_study(said, source):
    """Cost and errors that the advice on the thickness names are those of the stored table."""
    told = found(r"THICKNESS=4: (\S+) times the cost.* from (\S+) to (\S+) mm of .* from (\S+) to "
                 r"(\S+) %", said)
    table = os.path.join(source, "input/studies/results/time_step.csv")
    with open(table, encoding="utf-8") as file:
        runs = {float(row["set_mass_factor"]): row for row in csv.DictReader(file)
                if row["set_safety"] == "0.8"}
    stored = [float(runs[4]["cpu_seconds"])/float(runs[1]["cpu_seconds"])]
    for name in ("shape_error", "mean_plastic_strain_error"):
        stored += [float(runs[factor][name]) for factor in (1, 4)]
    assert np.abs(np.subtract(told, stored)).max() <= 0.0051, (told, stored)


def relaxation_is_foreseen(igaform, deck):
    """The trial run shows when a relaxation converges, long before its time limit."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "released.key")
        with open(deck, encoding="utf-8") as file:
            pull = file.read().replace("X_MAX, 1, 1, <speed>\n", "")
        pull = pull.replace("*DYNAMIC, EXPLICIT", "*STEP, NAME=pull\n*DYNAMIC, EXPLICIT")
        with open(path, "w", encoding="utf-8") as file:
            file.write(pull + RELEASE)
        said = run(igaform, path, "--check", "--probe")
        limit, = found(r"\nsteps +about (\S+)\n", said)
        expected, = found(r"\nsteps +about (\S+)\b.*fewer elements", said)
        result = os.path.join(folder, "released.h5")
        run(igaform, path, "--quiet", "--out", result)
        steps = energies(result)[2]
    assert abs(expected/steps - 1) < 0.2 and limit > 2*steps, (expected, steps, limit)


def main(igaform, source):
    deck = os.path.join(source, "tests/verification/probe/pulled.key")
    said = run(igaform, deck, "--check", "--trial-run")
    mean, = found(r"kinetic over internal energy (\S+) % in the mean", said)
    expected = 100*expected_ratio()
    assert abs(mean/expected - 1) < 0.1, f"ratio {mean} %, closed form {expected:.4g} %"
    step, factor, share = found(
        r"\*MASS SCALING, DT=(\S+) : (\S+) times the mass, (\S+) % of the steps", said)
    assert abs(factor*mean/100 - ALLOWED) < 0.01*ALLOWED, (factor, mean)
    with tempfile.TemporaryDirectory() as folder:
        paths = [os.path.join(folder, name) for name in ("real.h5", "scaled.h5")]
        run(igaform, deck, "--quiet", "--out", paths[0])
        run(igaform, deck, "--quiet", "--out", paths[1], "--set", f"step={step}")
        (_, work, steps), (ratio, scaled_work, scaled_steps) = map(energies, paths)
    assert abs(100*scaled_steps/steps/share - 1) < 0.03, (steps, scaled_steps, share)
    assert abs(ratio/ALLOWED - 1) < 0.2, f"kinetic over internal energy {ratio:.4g}"
    assert abs(scaled_work/work - 1) < ALLOWED, (work, scaled_work)
    print(f"ratio {mean} %, expected {expected:.4g} %; {factor} times the mass: ratio "
          f"{100*ratio:.3g} %, {scaled_steps} steps instead of {steps}, work "
          f"{100*(scaled_work/work - 1):+.2g} %")
    told_of_the_study(said, source)
    relaxation_is_foreseen(igaform, deck)
    fast = run(igaform, deck, "--check", "--trial-run", "--set", "speed=400000")
    assert "no mass scaling" in fast, fast


if __name__ == "__main__":
    main(*sys.argv[1:])
