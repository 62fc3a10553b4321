"""A short run to which the system refuses memory, writes, flushes or renames, one after the other.

Usage: run.py PROGRAM SHIM [all | KIND:N]

The library SHIM (refuse.c) lets one call of a run fail. Whatever it is, the run must end with a
documented exit code; not with 0 unless its result is the whole one; else with a message of its own
as the last line. An earlier result must be the same as before, or else what stands in its place
must be the new run's: to be read, or to be brought back by the checkpoint. Taken up from the
checkpoint, where there is one, or begun anew, the run then comes to the bits of an undisturbed one.
By default a sample of the calls fails; with `all` each of them, alone and with all behind it.
"""
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import h5py

PROGRAM, SHIM = (str(pathlib.Path(word).resolve()) for word in sys.argv[1:3])
KINDS = ("memory", "write", "flush", "rename")
SAMPLE = {"memory": 10, "write": 8, "flush": 4, "rename": 4}
CODES = {0, 1, 2, 3, 4}
UNLIKE = ("provenance", "timings")     # what two runs of the same may differ in
DECK = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*PLASTIC
200, 100, 5
*BLANK, NAME=block, MATERIAL=steel, TYPE=BOX
x, 0, 4, 2, 3
y, 0, 4, 2, 3
z, 0, 2, 2, 1
*TOOL, NAME=plate, TYPE=PLANE
-5, -5, -0.01
20, 0, 0
0, 20, 0
*CONTACT PAIR, TOOL=plate, FACE=Z_MIN, FRICTION=0.1
*CHECKPOINT, STEPS=25
*STEP, NAME=push
*TOOL MOTION, TOOL=plate, TYPE=VELOCITY
0, 0, 5e3
*DYNAMIC, EXPLICIT
1.2e-5
*OUTPUT, FRAMES=3, HISTORY=10
*END STEP
"""


def igaform(folder, *words, refuse=None, count=False, stack=None):
    """Exit code and what was said on standard error; the shim is there where it has to do."""
    environment = dict(os.environ, GOMP_SPINCOUNT="3000")   # so the program starts only once
    if refuse or count:
        environment.update(LD_PRELOAD=SHIM, REFUSE_COUNTS=str(folder / "counts"))
    if refuse:
        environment["REFUSE"] = refuse
    command = [PROGRAM, *words, "--threads", "1", "--quiet"]
    if stack:
        command = ["/bin/sh", "-c", f'ulimit -s {stack}; exec "$@"', "sh", *command]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True,
                          errors="replace", timeout=120, check=False)
    return done.returncode, done.stderr


def datasets(path):
    """Bytes of all datasets that the physics makes, by name."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset) and not name.startswith(UNLIKE):
            found[name] = (item.shape, item[()].tobytes())

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


def is_readable(path):
    try:
        datasets(path)
    except (OSError, KeyError, RuntimeError):
        return False
    return True


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def check_end(code, said):
    """Complaints about how a run ended."""
    if code not in CODES:
        return [f"exit code {code}"]
    last = said.strip().splitlines()[-1:] or [""]
    if code != 0 and not (last[0].startswith("igaform") or "--restart" in last[0]):
        return [f"exit code {code} and no message at the end"]
    return []


def check_files(folder, code, before, reference):
    """Complaints about what a run leaves."""
    result, checkpoint = folder / "a.h5", folder / "a.ckpt.h5"
    complaints = []
    if code == 0:
        if datasets(result) != reference:
            complaints.append("exit code 0 with another result")
        return complaints
    if code == 1 and digest(result) != before:
        complaints.append("exit code 1, and the earlier result is another")
    words = ["deck.key", "--out", "a.h5"]
    if checkpoint.exists():
        words += ["--restart", "a.ckpt.h5"]
    elif not is_readable(result):
        complaints.append("the result cannot be read, and there is no checkpoint")
    again, said = igaform(folder, *words)
    if again != 0:
        complaints.append(f"it does not go on: {again}: {said}")
    elif datasets(result) != reference:
        complaints.append("it goes on to another result")
    return complaints


def check_call(base, refuse, reference):
    """Complaints about a run to which one call is refused, beside an earlier result."""
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        for path in base.iterdir():
            shutil.copy(path, folder)
        before = digest(folder / "a.h5")
        code, said = igaform(folder, "deck.key", "--out", "a.h5", refuse=refuse)
        complaints = check_end(code, said) + check_files(folder, code, before, reference)
        if "out of memory" in said and (code != 4 or " bytes more were asked for" not in said):
            complaints.append(f"exit code {code} without memory")
        return code, [f"{complaint}; it said:\n{said}" for complaint in complaints]


def check_stack(base):
    """Complaints about a run with little stack, which must not begin, and about the least stack."""
    code, said = igaform(base, "deck.key", "--out", "a.h5", stack=256)
    if code != 4 or "the stack is limited to 262144 bytes" not in said:
        yield f"a stack of 256 KiB: exit code {code}; it said:\n{said}"
    code, said = igaform(base, "deck.key", "--out", "a.h5", stack=1024)
    if code != 0:
        yield f"a stack of 1 MiB: exit code {code}; it said:\n{said}"


def calls_to_refuse(kind, n, is_all):
    if is_all:
        return [f"{kind}:{i}{end}" for i in range(1, n + 1) for end in ("", "+")]
    some = sorted({1 + round(i * (n - 1) / max(1, SAMPLE[kind] - 1)) for i in range(SAMPLE[kind])})
    return [f"{kind}:{call}{'+' if i % 2 else ''}" for i, call in enumerate(some)]


def main():
    wish = sys.argv[3] if len(sys.argv) > 3 else ""
    with tempfile.TemporaryDirectory() as place:
        base = pathlib.Path(place)
        (base / "deck.key").write_text(DECK)
        code, said = igaform(base, "deck.key", "--out", "a.h5", count=True)
        assert code == 0, said
        counts = {kind: int(n) for kind, n in
                  (line.split() for line in (base / "counts").read_text().splitlines())}
        (base / "counts").unlink()
        assert all(counts[kind] > 0 for kind in KINDS), counts
        reference = datasets(base / "a.h5")
        complaints = list(check_stack(base))
        codes = {}
        calls = [wish] if ":" in wish else [call for kind in KINDS for call in
                                             calls_to_refuse(kind, counts[kind], wish == "all")]
        for call in calls:
            code, found = check_call(base, call, reference)
            key = (call.split(":")[0], code)
            codes[key] = codes.get(key, 0) + 1
            complaints += [f"{call}: {complaint}" for complaint in found]
            if found:
                print(f"{call}: {found[0]}", flush=True)
    print("calls of an undisturbed run:", counts)
    for (kind, code), n in sorted(codes.items()):
        print(f"{kind}: exit code {code}: {n}")
    print(f"{len(complaints)} complaints")
    for complaint in complaints:
        print(complaint)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
