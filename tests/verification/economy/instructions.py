"""An effect that is compiled in but not asked for must cost no instruction: a deck without loads,
contact, draw beads and tools driven by forces runs in the program as it is and in one without them,
and callgrind counts the instructions of the steps, procedure by procedure. All counts must be
equal. Left out is the allocator of the C library, whose ways depend on addresses; its callers are
counted, and so is how often they call.

usage: instructions.py IGAFORM LEAN DECK; ends with 77 where there is no valgrind
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

# From the first step to the last, output left out.
ALLOCATOR = re.compile(r"(malloc|arena)\.c:|malloc|free|memalign|unlink_chunk|alloc_perturb")
LINE = re.compile(r"^ *([0-9,]+) (?:\([0-9. ]+%\))? *(.*?)(?: \[(.*)\])?$")
STEPS = ("__forming_run_MOD_update_velocities*", "__forming_run_MOD_finish_step*")


def count(program, deck, folder):
    """Instructions of each procedure in the steps, and how many steps there were."""
    counts = f"{folder}/callgrind.out"
    done = subprocess.run(
        ["valgrind", "--tool=callgrind", f"--callgrind-out-file={counts}",
         *(f"--toggle-collect={name}" for name in STEPS), program, deck, "--threads", "1",
         "--out", f"{folder}/run.h5"],
        capture_output=True, text=True, timeout=900, check=False,
        # The program starts itself again where the first is not set, which valgrind does not
        # follow; the second has the loader look names up before the first step.
        env=dict(os.environ, GOMP_SPINCOUNT="1000", LD_BIND_NOW="1"))
    assert done.returncode == 0, done.stdout + done.stderr
    table = subprocess.run(["callgrind_annotate", "--threshold=100", counts], capture_output=True,
                           text=True, timeout=300, check=True).stdout
    steps = int(re.search(r"elements, (\d+) steps", done.stdout).group(1))
    return dict(procedures(table)), steps


def procedures(table):
    """Name and instructions of each procedure that is no part of the allocator."""
    for line in table.splitlines():
        found = LINE.match(line)
        if not found or "PROGRAM TOTALS" in line:
            continue
        number, name, library = found.groups()
        is_nameless = "0x" in name and "libc" in (library or "")    # a C library without symbols
        if not ALLOCATOR.search(name) and not is_nameless:
            yield name, int(number.replace(",", ""))


def main(igaform, lean, deck):
    if shutil.which("valgrind") is None:
        print("skipped: there is no valgrind")
        return 77
    refused = subprocess.run([lean, os.path.join(os.path.dirname(deck),
                                                 "../../../input/channel_strip.key"), "--check"],
                             capture_output=True, text=True, timeout=300)
    assert "a contact in a program without any" in refused.stderr, "the lean program has contact"
    with tempfile.TemporaryDirectory() as folder:
        whole, steps = count(igaform, deck, folder)
        bare, _ = count(lean, deck, folder)
    total = sum(whole.values())
    print(f"{steps} steps: {total} instructions, {sum(bare.values())} without loads, contact, "
          "beads and driven tools compiled in")
    assert steps > 50 and total > 1e6 and len(whole) > 20, "too little was counted"
    wrong = [f"{name}: {whole.get(name)}, without {bare.get(name)}"
             for name in sorted(whole.keys() | bare.keys()) if whole.get(name) != bare.get(name)]
    assert not wrong, "effects that are not asked for cost instructions:\n" + "\n".join(wrong)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
