"""Makes the wheel of `pip install` (PEP 517, PEP 660) with Python's own library alone, so that
nothing is fetched to build with."""
import base64
import hashlib
import pathlib
import tomllib
import zipfile

PACKAGE = pathlib.Path(__file__).resolve().parents[1]
WHEEL = "Wheel-Version: 1.0\nGenerator: igaform\nRoot-Is-Purelib: true\nTag: py3-none-any\n"


class UnsupportedOperation(Exception):
    """The name that pip looks for."""


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """The modules of the package; this folder is none of them."""
    del config_settings, metadata_directory
    modules = sorted(path for folder in (".", "cad", "fit", "study")
                     for path in PACKAGE.glob(f"{folder}/*.py"))
    return write_wheel(wheel_directory, {
        f"post/{path.relative_to(PACKAGE).as_posix()}": path.read_bytes() for path in modules})


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """A file that leads to the sources."""
    del config_settings, metadata_directory
    return write_wheel(wheel_directory, {"igaform_post.pth": f"{PACKAGE.parent}\n".encode()})


def build_sdist(sdist_directory, config_settings=None):
    """The repository is the source distribution."""
    del sdist_directory, config_settings
    raise UnsupportedOperation("there is no source distribution of post alone")


def dependencies():
    lines = (PACKAGE / "requirements.txt").read_text(encoding="utf-8").splitlines()
    return [line.strip() for line in lines if line.strip() and not line.startswith("#")]


def metadata(project):
    lines = ["Metadata-Version: 2.1", f"Name: {project['name']}", f"Version: {project['version']}",
             f"Summary: {project['description']}", f"License: {project['license']['text']}",
             f"Requires-Python: {project['requires-python']}"]
    return "\n".join(lines + [f"Requires-Dist: {one}" for one in dependencies()]) + "\n"


def write_wheel(folder, files):
    """Write the wheel with these files, told by name; returns its own name."""
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    stem = f"{project['name'].replace('-', '_')}-{project['version']}"
    scripts = "".join(f"{name} = {where}\n" for name, where in project["scripts"].items())
    info = f"{stem}.dist-info"
    files = files | {f"{info}/METADATA": metadata(project).encode(),
                     f"{info}/WHEEL": WHEEL.encode(),
                     f"{info}/entry_points.txt": f"[console_scripts]\n{scripts}".encode()}
    record = "".join(f"{name},{digest(content)},{len(content)}\n"
                     for name, content in files.items())
    files[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    name = f"{stem}-py3-none-any.whl"
    with zipfile.ZipFile(pathlib.Path(folder) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in files.items():
            wheel.writestr(path, content)
    return name


def digest(content):
    sha = hashlib.sha256(content).digest()
    return "sha256=" + base64.urlsafe_b64encode(sha).decode().rstrip("=")
