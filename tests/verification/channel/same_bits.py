"""One strip with 1, 2, 3 and 4 threads: every number of the results must have the same bits.

usage: same_bits.py IGAFORM DECK
"""
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np

GROUPS = ("history", "tools", "points", "nurbs", "VTKHDF")
CLOSING = 8   # mm: enough for both dies to hit the sheet and yield it


def numbers(path):
    """All datasets of the groups that a run computes, by name."""
    found = {}
    with h5py.File(path) as file:
        for group in GROUPS:
            file[group].visititems(lambda name, item, group=group: found.update(
                {f"{group}/{name}": item[()]}) if isinstance(item, h5py.Dataset) else None)
    return found


def run(igaform, deck, folder, threads):
    path = os.path.join(folder, f"{threads}.h5")
    # Threads may outnumber the cores here: they must sleep while they wait.
    subprocess.run([igaform, deck, "--out", path, "--threads", str(threads), "--quiet",
                    "--set", f"closing={CLOSING}"], check=True,
                   env=dict(os.environ, OMP_WAIT_POLICY="passive"))
    return numbers(path)


def main(igaform, deck):
    with tempfile.TemporaryDirectory() as folder:
        one = run(igaform, deck, folder, 1)
        assert max(one["history/contact_energy"]) > 0, "the dies do not touch the sheet"
        assert one["points/eqps"].max() > 0, "the sheet does not yield"
        for threads in (2, 3, 4):
            other = run(igaform, deck, folder, threads)
            assert one.keys() == other.keys()
            differing = [name for name in one
                         if not np.array_equal(one[name], other[name], equal_nan=True)]
            assert not differing, f"{threads} threads change {differing}"
    print(f"{len(one)} datasets have the same bits with 1, 2, 3 and 4 threads")


if __name__ == "__main__":
    main(*sys.argv[1:])
