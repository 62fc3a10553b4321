"""Short runs to which the system refuses memory, writes, flushes or renames, one after the other.

Usage: run.py PROGRAM SHIM [all | SCENE:KIND:N]

The library SHIM (refuse.c) lets one call of a run fail, or that one and all behind it. Whatever it
is, the run must end with a documented exit code; not with 0 unless its result is the whole one, and
its checkpoint and log are or a warning says otherwise; else with a message of its own as the last
line. An earlier result must be the same as before, or else what stands in its place must be the new
run's: to be read, or to be brought back by the checkpoint. Taken up from the checkpoint, where
there is one, or begun anew, the run then comes to the bits of an undisturbed one.
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
# Scenes by name: the words of the command, and how many calls of each kind fail in the short test.
SCENES = {
    "run": ("deck.key --out a.h5", {"memory": 6, "write": 6, "flush": 3, "rename": 3}),
    "restart": ("deck.key --restart a.ckpt.h5",
                {"memory": 3, "write": 3, "flush": 2, "rename": 2}),
    "material": ("material deck.key --out a.h5",
                 {"memory": 3, "write": 3, "flush": 2, "rename": 2, "share": 1}),
}
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
*MATERIAL TEST, NAME=pull, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=20
0.05
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
            values = item[()]
            found[name] = (item.shape, values.tolist() if item.dtype.hasobject else
                           values.tobytes())

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


def state(folder):
    """Datasets of the result and tables of a scene; None where the result is unreadable."""
    try:
        found = datasets(folder / "a.h5") if (folder / "a.h5").exists() else {}
    except (OSError, KeyError, RuntimeError):
        return None
    found.update({path.name: path.read_bytes() for path in folder.glob("*.csv")})
    return found


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else "no file"


def check_end(code, said):
    """Complaints about how a run ended."""
    if code not in CODES:
        return [f"exit code {code}"]
    last = said.strip().splitlines()[-1:] or [""]
    if code != 0 and not (last[0].startswith("igaform") or "--restart" in last[0]):
        return [f"exit code {code} and no message at the end"]
    if "out of memory" in said and (code != 4 or " bytes more were asked for" not in said):
        return [f"exit code {code} without memory"]
    return []


def check_success(folder, scene, said, reference):
    """Complaints about a run that ended with exit code 0 though something was refused."""
    complaints = []
    if state(folder) != reference:
        complaints.append("exit code 0 with another result")
    log, checkpoint = folder / "a.log", folder / "a.ckpt.h5"
    words = said + (log.read_text(errors="replace") if log.exists() else "")
    if scene == "material":
        return complaints
    if "nanoseconds" not in words and "per element and step" not in words \
       and "log file" not in said:
        complaints.append("exit code 0, and the log is cut short without a word")
    if "warning: checkpoint" not in words:
        code, said = igaform(folder, "deck.key", "--restart", checkpoint.name)
        if code != 0 or state(folder) != reference:
            complaints.append(f"exit code 0, and its checkpoint is no good: {code}: {said}")
    return complaints


def check_failure(result, scene, code, before, reference):
    """Complaints about what a run that failed leaves."""
    folder, complaints = result.parent, []
    if code == 1 and digest(result) != before:
        complaints.append("exit code 1, and the earlier result is another")
    words = SCENES[scene][0].split()
    if (folder / "a.ckpt.h5").exists():
        words = SCENES["restart"][0].split()
    elif state(folder) is None:
        complaints.append("the result cannot be read, and there is no checkpoint")
    again, said = igaform(folder, *words)
    if again != 0:
        complaints.append(f"it does not go on: {again}: {said}")
    elif state(folder) != reference:
        complaints.append("it goes on to another result")
    return complaints


def check_call(base, scene, refuse, reference):
    """Complaints about a run to which one call is refused, beside what was there before."""
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        for path in base.iterdir():
            shutil.copy(path, folder)
        result = folder / SCENES[scene][0].split()[-1].replace(".ckpt", "")
        before = digest(result)
        code, said = igaform(folder, *SCENES[scene][0].split(), refuse=refuse)
        complaints = check_end(code, said)
        if code == 0:
            complaints += check_success(folder, scene, said, reference)
        else:
            complaints += check_failure(result, scene, code, before, reference)
        return code, [f"{scene}:{refuse}: {complaint}; it said:\n{said}"
                      for complaint in complaints]


def check_stack(base):
    """Complaints about a run with little stack, which must not begin, and about the least stack."""
    words = SCENES["run"][0].split()
    code, said = igaform(base, *words, stack=256)
    if code != 4 or "the stack is limited to 262144 bytes" not in said:
        yield f"a stack of 256 KiB: exit code {code}; it said:\n{said}"
    code, said = igaform(base, *words, stack=1024)
    if code != 0:
        yield f"a stack of 1 MiB: exit code {code}; it said:\n{said}"


def calls_to_refuse(kind, n, n_sample):
    """Numbers of calls; n_sample 0: all, alone and with all behind them."""
    if n_sample == 0:
        return [f"{kind}:{i}{end}" for i in range(1, n + 1) for end in ("", "+")]
    some = sorted({1 + round(i * (n - 1) / max(1, n_sample - 1)) for i in range(n_sample)})
    return [f"{kind}:{call}{'+' if i % 2 else ''}" for i, call in enumerate(some)]


def prepare(scene, base, n_memory):
    """Make what a scene finds: an earlier result, or what a run leaves that was stopped half way.
    Returns what it comes to and the numbers of calls of each kind."""
    (base / "deck.key").write_text(DECK)
    words = SCENES[scene][0].split()
    if scene == "restart":
        # The last tenth of the memory that a run asks for is asked for by its frames and
        # checkpoints.
        code, said = igaform(base, *SCENES["run"][0].split(),
                             refuse=f"memory:{19 * n_memory // 20}+")
        assert code == 4 and (base / "a.ckpt.h5").exists(), (code, said)
    with tempfile.TemporaryDirectory() as place:
        trial = pathlib.Path(place)
        for path in base.iterdir():
            shutil.copy(path, trial)
        code, said = igaform(trial, *words, count=True)
        assert code == 0, said
        counts = {kind: int(n) for kind, n in
                  (line.split() for line in (trial / "counts").read_text().splitlines())}
        (trial / "counts").unlink()
        if scene != "restart":
            for path in trial.iterdir():
                shutil.copy(path, base)
        return state(trial), counts


def check_scene(scene, wish, n_memory):
    """Complaints about a scene, and the memory calls of an undisturbed run."""
    with tempfile.TemporaryDirectory() as place:
        base = pathlib.Path(place)
        reference, counts = prepare(scene, base, n_memory)
        assert reference and all(counts[kind] > 0 for kind in SCENES[scene][1]), counts
        complaints = list(check_stack(base)) if scene == "run" else []
        codes = {}
        calls = [call for kind, n_sample in SCENES[scene][1].items() for call in calls_to_refuse(
            kind, counts[kind], 0 if wish == "all" else n_sample)]
        if ":" in wish:
            calls = [wish.split(":", 1)[1]] if wish.startswith(scene + ":") else []
        for call in calls:
            code, found = check_call(base, scene, call, reference)
            key = (call.split(":")[0], code)
            codes[key] = codes.get(key, 0) + 1
            complaints += found
            for complaint in found:
                print(complaint, flush=True)
    print(f"{scene}: calls of an undisturbed run: {counts}")
    for (kind, code), n in sorted(codes.items()):
        print(f"    {kind} refused: {n} runs with exit code {code}")
    return complaints, counts["memory"]


def main():
    wish = sys.argv[3] if len(sys.argv) > 3 else ""
    complaints, n_memory = [], 0
    for scene in SCENES:
        found, n = check_scene(scene, wish, n_memory)
        n_memory = n_memory or n
        complaints += found
    print(f"{len(complaints)} complaints")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
