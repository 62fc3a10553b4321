"""A channel with 1, 2, 3 and 4 threads: every number of the results must have the same bits.

The strip has one row of elements, which is cut into tiles along it. The wide one has tiles that own
rows of control points, and is large enough that threads share contact, motion and sums as well.

usage: same_bits.py IGAFORM STRIP WIDE [NAME=VALUE ...]
"""
import os
import subprocess
import sys
import tempfile

from run_results import differing, numbers

CLOSING = 8   # mm: enough for both dies to hit the sheet and yield it


def run(igaform, deck, folder, threads, settings):
    path = os.path.join(folder, f"{threads}.h5")
    # Threads may outnumber the cores here: they must sleep while they wait.
    subprocess.run([igaform, deck, "--out", path, "--threads", str(threads), "--quiet",
                    *[word for setting in (f"closing={CLOSING}", *settings)
                      for word in ("--set", setting)]], check=True,
                   env=dict(os.environ, OMP_WAIT_POLICY="passive"))
    return numbers(path)


def check(igaform, deck, least, settings):
    with tempfile.TemporaryDirectory() as folder:
        one = run(igaform, deck, folder, 1, settings)
        assert max(one["history/contact_energy"]) > 0, "the dies do not touch the sheet"
        assert one["points/eqps"].max() > 0, "the sheet does not yield"
        size = one["nurbs/blank/points"][..., 0].size
        assert size > least, f"{size} control points: too few for threads to share their work"
        for threads in (2, 3, 4):
            other = run(igaform, deck, folder, threads, settings)
            changed = differing(one, other)
            assert not changed, f"{deck}: {threads} threads change {changed}"
    print(f"{len(one)} datasets have the same bits with 1, 2, 3 and 4 threads")


def main(igaform, strip, wide, *settings):
    check(igaform, strip, 0, settings)
    check(igaform, wide, 500 if "element=SHELL" in settings else 2000, settings)


if __name__ == "__main__":
    main(*sys.argv[1:])
