"""`pip install ./post` without a network: the command that it makes, and the version, which
pyproject.toml and CITATION.cff must share with the program.

usage: package.py PROJECT VERSION
"""
import pathlib
import re
import subprocess
import sys
import tempfile


def run(folder, *words, **environment):
    done = subprocess.run(list(map(str, words)), cwd=folder, capture_output=True, text=True,
                          timeout=100, check=False, env=environment or None)
    assert done.returncode == 0, f"{words}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def main(project, version):
    project = pathlib.Path(project)
    requirements = [line for line in (project / "post/requirements.txt").read_text().splitlines()
                    if line and not line.startswith("#")]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run(folder, sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps",
            "--disable-pip-version-check", "--target", folder / "site", project / "post")
        said = run(folder, folder / "site/bin/igaform-post", "--help", PYTHONPATH=folder / "site")
        assert said.startswith("usage: igaform-post") and "springback" in said, said
        info, = (folder / "site").glob("igaform_post-*.dist-info")
        metadata = (info / "METADATA").read_text()
        assert f"\nVersion: {version}\n" in metadata, metadata
        assert re.findall(r"^Requires-Dist: (.*)$", metadata, re.M) == requirements, metadata
        left_out = {path.name for path in (project / "post").rglob("*.py")} - {
            path.name for path in (folder / "site/post").rglob("*.py")}
        assert left_out == {"wheel_backend.py"}, left_out
    assert run(project, sys.executable, "-m", "post", "--help").startswith("usage: python -m post")
    citation = (project / "docs/CITATION.cff").read_text()
    assert f"\nversion: {version}\n" in citation, "docs/CITATION.cff tells another version"


if __name__ == "__main__":
    main(*sys.argv[1:])
