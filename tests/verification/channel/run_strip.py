"""Run a strip of the channel and hold it against the reference: exit code 0 if all limits hold.

usage: run_strip.py IGAFORM DECK REFERENCE_DIR PROJECT_DIR [NAME=VALUE ...]
"""
import os
import subprocess
import sys
import tempfile


def main(igaform, deck, reference, project, *settings):
    sets = [word for setting in settings for word in ("--set", setting)]
    with tempfile.TemporaryDirectory() as folder:
        result = os.path.join(folder, "strip.h5")
        subprocess.run([igaform, deck, "--out", result, "--threads", "1", "--quiet", *sets],
                       check=True)
        return subprocess.run([sys.executable, "-m", "post", "compare", result, reference,
                               "-o", os.path.join(folder, "strip.png")], cwd=project).returncode


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
