"""Blanks of several patches: exit code 0 if all that they must keep is kept.

usage: run.py IGAFORM DECKS CASE INPUT
"""
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np

GROUPS = ("history", "tools", "points", "nurbs", "VTKHDF")


def run(igaform, deck, folder, name, threads=1, **values):
    """The results of a deck as a dictionary of arrays."""
    path = os.path.join(folder, name + ".h5")
    sets = [word for item in values.items() for word in ("--set", "{}={}".format(*item))]
    subprocess.run([igaform, deck, "--out", path, "--threads", str(threads), "--quiet", *sets],
                   check=True, env=dict(os.environ, OMP_WAIT_POLICY="passive"))
    found = {}
    with h5py.File(path) as file:
        for group in GROUPS:
            file[group].visititems(lambda key, item, group=group: found.update(
                {f"{group}/{key}": item[()]}) if isinstance(item, h5py.Dataset)
                and not item.dtype.hasobject else None)
    return found


def modes(igaform, deck, n, **values):
    sets = [word for item in values.items() for word in ("--set", "{}={}".format(*item))]
    out = subprocess.run([igaform, "--modes", str(n), deck, *sets], check=True, text=True,
                         capture_output=True).stdout
    return np.array([float(line.split()[1]) for line in out.splitlines()[1:]])


def two_boxes(igaform, decks, folder, _):
    """Two patches are one patch that is only continuous in its values where they meet, with its
    columns scaled and damped as well; as solids and as shells."""
    steps = []
    for settings in ({"mass_factor": 4, "alpha": 1e4}, {"element": "SHELL", "alpha": 1e4}, {}):
        one = run(igaform, os.path.join(decks, "one_box.key"), folder, "one", **settings)
        two = run(igaform, os.path.join(decks, "two_boxes.key"), folder, "two", **settings)
        for name in ("kinetic_energy", "internal_energy", "external_work", "momentum",
                     "added_mass", "damping_energy", "probes/tip/displacement"):
            a, b = one[f"history/{name}"], two[f"history/{name}"]
            error = np.abs(a - b).max() / max(np.abs(a).max(), 1e-12)
            print(f"{settings} {name}: {error:.1e}")
            assert error < (1e-11 if "element" in settings else 1e-12), name
        steps.append(one["history/dt"][1])
    assert steps[0] > 1.2 * steps[2], "the scaling lengthens no step"
    assert np.abs(one["history/probes/tip/displacement"]).max() > 0.1, "the plate hardly bends"
    left, right = two["nurbs/blank/left/points"], two["nurbs/blank/right/points"]
    assert np.array_equal(left[:, :, -1], right[:, :, 0]), "the seam has opened"


def ring(igaform, decks, _, inputs):
    """The closed ring has the modes of its quarter, and those in pairs; slit, it has others."""
    closed = modes(igaform, os.path.join(decks, "ring.key"), 8, around=12)
    quarter = modes(igaform, os.path.join(inputs, "verification", "ring_modes.key"), 1,
                    n_t=12)[0]
    exact = 12575.3   # Hz, two waves in plane strain: see ring_modes.py of the verification suite
    print("rigid", closed[:3], "then", closed[3:5], "quarter", quarter)
    assert closed[2] < 1e-3 * closed[3], "three rigid motions"
    assert abs(closed[3] / quarter - 1) < 1e-6, "the mode of the quarter"
    assert abs(closed[3] / exact - 1) < 0.01, "the mode of the theory"
    slit = modes(igaform, os.path.join(decks, "ring.key"), 8, around=12, merge="NO")
    assert slit[3] < 0.5 * closed[3], "a slit ring is softer"


def cup(igaform, decks, folder, _):
    """Under pressure the wall of a cup carries the resultant on its bottom, with Lame's hoop.
    A free one keeps its momentum, with its columns scaled too, and the same for 1 to 4 threads."""
    rest = run(igaform, os.path.join(decks, "cup_pressure.key"), folder, "rest", along=16,
               mass_factor=20)
    inner, outer = 19.0, 20.0
    stress, place, volume = (np.concatenate([rest[f"points/WALL{k}/{name}"].reshape(-1, n)
                                             for k in (1, 2)])
                             for name, n in (("stress", 6), ("reference_position", 3),
                                             ("reference_volume", 1)))
    is_middle = np.abs(place[:, 2] - 25) < 5
    share = volume[is_middle, 0] / volume[is_middle, 0].sum()
    stress, radius = stress[is_middle], np.hypot(*place[is_middle, :2].T)
    x, y = place[is_middle, :2].T / radius
    hoop = share @ (stress[:, 0] * y * y + stress[:, 1] * x * x - 2 * stress[:, 3] * x * y)
    axial = share @ stress[:, 2]
    exact = inner**2 / (outer**2 - inner**2)
    exact_hoop = share @ (exact * (1 + outer**2 / radius**2))
    print(f"axial stress {axial:.4f} of {exact:.4f}, hoop {hoop:.4f} of {exact_hoop:.4f}")
    assert abs(axial / exact - 1) < 1e-3, "the resultant on the bottom"
    assert abs(hoop / exact_hoop - 1) < 5e-3, "Lame's hoop stress"

    deck, steps = os.path.join(decks, "cup_free.key"), []
    coarse = {"angle": 360, "around": 1, "along": 4}
    for mass_factor in (1, 4):
        free = run(igaform, deck, folder, "free", mass_factor=mass_factor, **coarse)
        momentum, energy = free["history/momentum"], free["history/energy_error"]
        drift = np.abs(momentum - momentum[0]).max() / np.abs(momentum[0]).max()
        print(f"factor {mass_factor}: dt {free['history/dt'][1]:.3e}, momentum {drift:.1e}, "
              f"energy {np.abs(energy).max():.1e}")
        assert drift < 1e-11 and np.abs(energy).max() < 5e-4
        steps.append(free["history/dt"][1])
    assert steps[1] > 1.3 * steps[0], "the scaling lengthens no step"
    other = run(igaform, deck, folder, "threads", 3, mass_factor=4, **coarse)
    for name, values in free.items():
        if "wall" not in name:
            assert np.array_equal(values, other[name], equal_nan=True), name


def disk(igaform, _, folder, inputs):
    """A pressed disk stays symmetric, the same for 1 to 4 threads, its quarter does alike; as a
    shell too, whose seams pass moments."""
    for element in ("SOLID", "SHELL"):
        check_disk(igaform, os.path.join(inputs, "disk_punch.key"), folder,
                   {"depth": 2, "n": 3, "element": element})


def check_disk(igaform, deck, folder, short):
    first = run(igaform, deck, folder, "one", 1, **short)
    for threads in (2, 3, 4):
        other = run(igaform, deck, folder, f"threads_{threads}", threads, **short)
        assert first.keys() == other.keys()
        for name, values in first.items():
            if "wall" not in name:
                assert np.array_equal(values, other[name], equal_nan=True), (threads, name)
    assert first["points/CORE/eqps"].max() > 0.01, "the ball does not press"
    middle = first["history/probes/middle/displacement"]
    assert np.abs(middle[:, :2]).max() < 1e-8 * np.abs(middle[:, 2]).max(), "the middle leaves"
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    for k in (1, 2, 3):
        a = first[f"nurbs/blank/RIM{k}/points"] @ turn.T
        error = np.abs(a - first[f"nurbs/blank/RIM{k + 1}/points"]).max()
        print(f"turned by a quarter: {error:.1e} mm")
        assert error < 1e-6, "the quarters differ"
    assert np.abs(first["history/energy_error"][-1]) < 1e-2


def main(igaform, decks, case, inputs):
    with tempfile.TemporaryDirectory() as folder:
        {"two_boxes": two_boxes, "ring": ring, "disk": disk, "cup": cup}[case](
            igaform, decks, folder, inputs)


if __name__ == "__main__":
    main(*sys.argv[1:])
