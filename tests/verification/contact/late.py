"""A tool that acts from a later step on and is in the sheet by then brings no energy. The log tells
the largest energy error of the history, also where hardly any energy is there yet.

Usage: late.py IGAFORM FOLDER_OF_DECK
"""
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np

DECK = os.path.join(sys.argv[2], "late.key")
MASS = 7.85e-9 * 4 * 4 * 2


def run(folder, **parameters):
    """Energies and force of the deck with these parameters."""
    path = os.path.join(folder, "late.h5")
    sets = [part for key, value in parameters.items() for part in ("--set", f"{key}={value}")]
    subprocess.run([sys.argv[1], DECK, "--quiet", "--threads", "1", "--out", path, *sets],
                   check=True)
    with h5py.File(path) as file:
        history = {name: file["history"][name][:] for name in
                   ("time", "kinetic_energy", "internal_energy", "contact_energy",
                    "external_work", "energy_error", "max_penetration")}
        assert "torque" not in file["tools/plate"]   # it does not turn
        history["force"] = file["tools/plate/force"][:, 2]
        check_log(path.replace(".h5", ".log"), file["history"])
    return history


def check_log(log, history):
    """The log names the largest error of the history over the largest energy, its step and time."""
    scale = np.maximum(np.abs(history["external_work"][:]),
                       history["kinetic_energy"][:] + history["internal_energy"][:])
    errors = history["energy_error"][:] * scale / max(scale.max(), 1e-300)
    worst = np.abs(errors).argmax()
    with open(log) as file:
        line = next(line for line in file if "of the largest energy of the run" in line)
    said, step, time = (float(line.split(word)[1].split()[0].rstrip(","))
                        for word in ("error", ", step", ", time"))
    if scale.max() > 1e-9:
        assert abs(said / 100 - errors[worst]) <= 1e-3 * abs(errors[worst]), (line, errors[worst])
        assert step == history["step"][worst], line
        assert abs(time / history["time"][worst] - 1) < 1e-3, line


def main():
    with tempfile.TemporaryDirectory() as folder:
        for depth in (0.1, 0.01):   # more and less than a first touch may be deep
            rest = run(folder, depth=depth)
            assert abs(rest["max_penetration"][-1] - depth) < 1e-9
            for name in ("kinetic_energy", "internal_energy", "contact_energy", "external_work",
                         "force"):
                assert np.abs(rest[name]).max() < 1e-12, name
        for friction in (0, 0.2):
            # the block feels what it would feel of a plate that just touches it
            touching, lifted = (run(folder, depth=depth, lift=0.2, friction=friction)
                                for depth in (0, 0.1))
            for name in ("kinetic_energy", "contact_energy", "external_work", "force"):
                off = np.abs(lifted[name] - touching[name]).max() / np.abs(touching[name]).max()
                print(f"friction {friction}, {name}: off by {off:.2g}")
                assert off < 1e-6, name
            assert np.abs(lifted["energy_error"]).max() < 5e-3
            assert lifted["kinetic_energy"].max() > MASS * (0.2 / 1e-4) ** 2 / 2


main()
