"""What the tests of restarts share: running the program, comparing results bit by bit."""
import pathlib
import subprocess
import sys
import tempfile
import time

import h5py

PROGRAM, PROJECT = sys.argv[1], pathlib.Path(sys.argv[2])
STRIP = PROJECT / "input" / "tension_strip.key"
UNLIKE = ("provenance", "timings")     # what two runs of the same may differ in


def igaform(folder, *words, code=0, limit=300, program=(PROGRAM,), **options):
    """What a run says; its exit code must be as expected."""
    done = subprocess.run([*program, *map(str, words), "--quiet"], cwd=folder, text=True,
                          capture_output=True, timeout=limit, **options)
    assert done.returncode == code, f"{words}: exit code {done.returncode}, not {code}\n" \
                                    f"{done.stdout}{done.stderr}"
    assert "Backtrace" not in done.stderr, done.stderr
    return done.stdout + done.stderr


def begin(folder, *words, program=(PROGRAM,), **options):
    """A run that goes on while we look."""
    options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL} | options
    return subprocess.Popen([*program, *map(str, words), "--quiet"], cwd=folder, **options)


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def deck(folder, source, *lines, name="deck.key"):
    """A deck that includes another and adds lines to it."""
    path = folder / name
    path.write_text(f"*INCLUDE, INPUT=\"{source}\"\n" + "\n".join(lines) + "\n")
    return path


def datasets(path):
    """Bytes of all datasets that the physics makes, by name."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset) and not name.startswith(UNLIKE):
            values = item[()]
            found[name] = (item.shape, values.tolist() if item.dtype.hasobject else
                           values.tobytes())

    with h5py.File(path, "r") as file:
        file.visititems(take)
        found["steps"] = int(file["VTKHDF/Steps"].attrs["NSteps"])
    return found


def check_same(path, reference):
    """All datasets have the same bits."""
    now = datasets(path)
    assert set(now) == set(reference), set(now) ^ set(reference)
    unlike = [name for name in reference if now[name] != reference[name]]
    assert not unlike, f"{path}: other bits in {unlike}"


def opens(path):
    """Can every dataset of the file be read?"""
    try:
        datasets(path)
    except (OSError, KeyError, RuntimeError):
        return False
    return True


def n_rows(log):
    """Progress lines in a log."""
    try:
        return sum(line.startswith("step ") for line in log.read_text().splitlines())
    except OSError:
        return 0


def run_all(*tests):
    """Each test in a folder of its own."""
    for test in tests:
        with tempfile.TemporaryDirectory() as place:
            test(pathlib.Path(place))
        print("passed:", test.__name__.replace("_", " "), flush=True)
