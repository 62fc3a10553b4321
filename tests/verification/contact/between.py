"""Penetration between contact points, and tools that never touch: history, log and --check.

Usage: between.py IGAFORM FOLDER_OF_DECK
"""
import pathlib
import re
import subprocess
import sys
import tempfile

import h5py

DECK = pathlib.Path(sys.argv[2]) / "between.key"


def run(folder, *options, **parameters):
    sets = [part for key, value in parameters.items() for part in ("--set", f"{key}={value}")]
    return subprocess.run([sys.argv[1], DECK, "--out", folder / "between.h5", *options, *sets],
                          capture_output=True, text=True, timeout=60)


def depths(folder):
    with h5py.File(folder / "between.h5") as file:
        history = file["history"]
        return history["max_penetration"][:], history["true_penetration"][:]


def warnings_of(folder, tool):
    lines = (folder / "between.log").read_text().splitlines()
    return [line for line in lines if re.match(rf"warning: .*\b{tool}\b", line)]


def main():
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        done = run(folder)
        assert done.returncode == 0, done
        seen, true = depths(folder)
        # 8000 mm/s for 40 us, from 0.02 above a sheet that stays where it is
        assert seen.max() == 0 and abs(true[-1] - 0.3) < 0.005, (seen, true)
        for tool, cause, depth in (
                ("roll", "the smallest radius of the tool is 5", "0.3"),
                ("ridge", "the tool has a sharp edge", "0.21")):
            warned = [line for line in warnings_of(folder, tool) if "between its contact" in line]
            assert len(warned) == 1, done.stdout
            assert f"with 3 x 3 contact points, {cause}: use elements of " in warned[0], warned
            idle = [line for line in warnings_of(folder, tool) if "never touched" in line]
            assert len(idle) == 1 and f"up to {depth}" in idle[0], idle
        far = warnings_of(folder, "far")
        assert len(far) == 1 and "never touched" in far[0], far
        assert "it is 39 mm away" in far[0], far
        assert re.search(r"^contact    deepest penetration 0\S* mm at contact points, between them "
                         r"0.3 mm \(\S+ % of the thickness\): contact roll ZETA_MAX at "
                         r"time 4e-5", done.stdout, re.M), done.stdout
        for line in warnings_of(folder, "roll") + far:
            assert line in done.stderr, done.stderr

        done = run(folder, n_x=40)       # elements that see the roll
        seen, true = depths(folder)
        assert done.returncode == 0 and seen.max() > 0 and 0 < true.max() < 0.15, (seen, true)
        assert not warnings_of(folder, "roll"), done.stdout
        assert not [line for line in warnings_of(folder, "ridge") if "never touched" in line]

        for punch, kind in ((4.95, "warning"), (4.7, "error")):   # inside at the start
            done = run(folder, "--check", punch=punch)
            assert done.returncode == (kind == "error"), done
            depth = f"{5 - punch:.1g}"
            assert re.search(rf"{kind}: \*CONTACT PAIR: found a blank .* inside tool 'roll', at "
                             rf"\(.*\) by {depth}", done.stderr), done.stderr


main()
