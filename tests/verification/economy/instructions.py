"""An effect that is compiled in but not asked for must cost no instruction: a deck without loads
and contact runs in the program as it is and in one without them, and callgrind counts all
instructions of the steps. They agree but for the ways of the allocator, which depend on addresses.

usage: instructions.py IGAFORM LEAN DECK; ends with 77 where there is no valgrind
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

# From the first step to the last, output left out.
STEPS = ("__forming_run_MOD_update_velocities*", "__forming_run_MOD_finish_step*")


def count(program, deck, folder):
    """Instructions of the steps, and how many steps there were."""
    done = subprocess.run(
        ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/callgrind.out",
         *(f"--toggle-collect={name}" for name in STEPS), program, deck, "--threads", "1",
         "--out", f"{folder}/run.h5"],
        capture_output=True, text=True, timeout=900,
        # The program starts itself again where the first is not set, which valgrind does not
        # follow; the second has the loader look names up before the first step.
        env=dict(os.environ, GOMP_SPINCOUNT="1000", LD_BIND_NOW="1"))
    assert done.returncode == 0, done.stdout + done.stderr
    total = int(re.search(r"Collected\s*:\s*(\d+)", done.stderr).group(1))
    steps = int(re.search(r"elements, (\d+) steps", done.stdout).group(1))
    return total, steps


def main(igaform, lean, deck):
    if shutil.which("valgrind") is None:
        print("skipped: there is no valgrind")
        return 77
    refused = subprocess.run([lean, os.path.join(os.path.dirname(deck),
                                                 "../../../input/channel_strip.key"), "--check"],
                             capture_output=True, text=True, timeout=300)
    assert "a program without contact" in refused.stderr, "the lean program has contact"
    with tempfile.TemporaryDirectory() as folder:
        whole, steps = count(igaform, deck, folder)
        bare, _ = count(lean, deck, folder)
    print(f"{steps} steps: {whole} instructions, {bare} without loads and contact compiled in")
    assert steps > 50 and whole > 1e6, "too little was counted"
    # A call and a branch a step would be more; the allocator's way differs by less.
    assert abs(whole - bare) < 5*steps, "effects that are not asked for cost instructions"
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
