"""Decks with a user's law, and a bench that runs them."""
import os
import pathlib
import resource
import subprocess

import h5py

FILES = pathlib.Path(__file__).resolve().parent / "files"
INPUT = pathlib.Path(__file__).resolve().parents[3] / "input"

BODY = """*BLANK, NAME=strip, MATERIAL=steel, TYPE=BOX, RULE=FULL
x, 0, 10, 2, 3
y, 0, 4, 2, 2
z, 0, 1, 2, 1
*AMPLITUDE, NAME=soft start
0, 0, 2e-5, 1
*BOUNDARY
X_MIN, XSYMM
Y_MIN, YSYMM
Z_MIN, ZSYMM
*BOUNDARY, TYPE=VELOCITY, AMPLITUDE=soft start
X_MAX, 1, 1, {speed}
*DYNAMIC, EXPLICIT
4e-5
*OUTPUT, FRAMES=4, HISTORY=8
"""
TURNING = BODY.replace("Y_MIN, YSYMM\n", "").replace(
    "X_MAX, 1, 1, {speed}", "X_MAX, 2, 2, {speed}").replace("X_MIN, XSYMM", "X_MIN, ENCASTRE")
STEEL = "210000, 0.3"
VOCE = "210000, 0.3, 250, 250, 6"


def deck(material, body=BODY, speed=20000):
    return f"*MATERIAL, NAME=steel\n*DENSITY\n7.85e-9\n{material}\n" + body.format(speed=speed)


def user(constants, n_state=0, options="", names=""):
    count = len(constants.split(","))
    lines = f"*USER MATERIAL, CONSTANTS={count}{options}\n{constants}"
    return lines + (f"\n*DEPVAR\n{n_state}{names}" if n_state else "")


def limit_stack():
    """The usual size, for laws that shall run out of it."""
    resource.setrlimit(resource.RLIMIT_STACK, (8 << 20, resource.getrlimit(
        resource.RLIMIT_STACK)[1]))


class Bench:
    """A folder in which the program runs, and what it said last."""

    def __init__(self, igaform, folder):
        self.igaform, self.folder = igaform, pathlib.Path(folder)
        self.cache = os.environ["XDG_CACHE_HOME"]

    def run(self, text, *files, code=0, result="a.h5", threads=2, env=None, options=(),
            command=()):
        path = self.folder / "deck.key"
        path.write_text(text)
        names = [word for name in files for word in ("--user", str(name))]
        done = subprocess.run([self.igaform, *command, str(path),
                               "--out", str(self.folder / result),
                               "--threads", str(threads), "--quiet", *names, *options],
                              cwd=self.folder, capture_output=True, text=True, timeout=90,
                              preexec_fn=limit_stack,
                              env=dict(os.environ, OMP_WAIT_POLICY="passive",
                                       XDG_CACHE_HOME=str(self.cache), **(env or {})))
        self.said = done.stdout + done.stderr
        assert done.returncode == code, f"exit code {done.returncode}, not {code}:\n{self.said}"
        return self.folder / result

    def values(self, *arguments, **options):
        """Points, stress and state variables of a run at its end."""
        with h5py.File(self.run(*arguments, **options)) as file:
            group = file["points"]
            state = group["statev"][...] if "statev" in group else None
            return file["nurbs/blank/points"][...], group["stress"][...], state

    def says(self, *words):
        for word in words:
            assert word in self.said, f"no '{word}' in:\n{self.said}"


def same(one, other, limit=1e-9):
    for a, b in zip(one[:2], other[:2]):
        worst = abs(a - b).max() / abs(b).max()
        assert worst < limit, f"relative difference {worst:.3g}"
