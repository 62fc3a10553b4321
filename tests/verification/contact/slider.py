"""Contact pressure and wear of a block under a known pressure that is dragged by a known way.

Usage: slider.py IGAFORM FOLDER_OF_DECK
"""
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np

PROJECT = os.path.abspath(os.path.join(os.path.dirname(__file__), *[os.pardir] * 3))
sys.path.insert(0, PROJECT)

from post.results import Results  # noqa: E402

PRESSURE, WAY, AREA = 40.0, 5.0, 72.0
DECK = os.path.join(sys.argv[2], "slider.key")


def run(folder, name, **parameters):
    """Results of the deck with these parameters."""
    path = os.path.join(folder, name)
    sets = [part for key, value in parameters.items() for part in ("--set", f"{key}={value}")]
    subprocess.run([sys.argv[1], DECK, "--quiet", "--threads", "1", "--out", path, *sets],
                   check=True)
    return h5py.File(path)


def last_frame(file):
    grid = file["VTKHDF"]
    n = int(grid["NumberOfPoints"][0])
    return {name: grid[name][-n:] for name in ("Points", "PointData/contact_pressure",
                                               "PointData/wear")}


def integral(points, values):
    """Of a field on the nodes of a plane grid, linear between them."""
    x, y = (np.unique(np.round(points[:, d], 6)) for d in (0, 1))
    i, j = (np.argmin(np.abs(points[:, [d]] - line), axis=1) for d, line in ((0, x), (1, y)))
    grid = np.zeros((len(x), len(y)))
    grid[i, j] = values
    return np.trapezoid(np.trapezoid(grid, y, axis=1), x)


def check(frame, slip, tolerance):
    """Pressure on both sides, wear where the block was all the time, and the sums of both."""
    points, pressure, wear = frame.values()
    is_tool = ~np.isnan(wear)
    face = ~is_tool & (np.abs(points[:, 2]) < 0.1)
    x, y = points[:, 0], points[:, 1]
    always = is_tool & (x > 6.5) & (x < 11) & (y > 2) & (y < 4)
    assert np.count_nonzero(always) >= 2
    np.testing.assert_allclose(pressure[face], PRESSURE, rtol=tolerance)
    np.testing.assert_allclose(pressure[always], PRESSURE, rtol=tolerance)
    np.testing.assert_allclose(wear[always], PRESSURE * slip, rtol=tolerance)
    np.testing.assert_allclose(integral(points[is_tool], pressure[is_tool]), PRESSURE * AREA,
                               rtol=tolerance)
    np.testing.assert_allclose(integral(points[is_tool], wear[is_tool]), PRESSURE * AREA * slip,
                               rtol=tolerance)
    assert np.all(pressure[~is_tool & ~face] == 0)


def check_picture(path):
    """The tool's field on triangles, as `post picture --tool plane` takes it; it draws or says why
    not."""
    with Results(path) as results:
        points, corners, values = results.tool_field("plane", "wear", len(results.times) - 1, 3)
    sides = (points[corners[:, k]] - points[corners[:, 0]] for k in (1, 2))
    areas = np.linalg.norm(np.cross(*sides), axis=1) / 2
    np.testing.assert_allclose(np.sum(areas * values[corners].mean(axis=1)),
                               PRESSURE * AREA * WAY, rtol=1e-3)
    drawn = ["--tool", "plane", "--field", "wear", "--renderer", "matplotlib"]
    for words, answer in ((drawn, None),
                          (["--field", "wear"], "wear"),
                          (["--tool", "plane", "--field", "eqps"], "eqps"),
                          (["--tool", "plan"], "'plan'")):
        out = path + ".png"
        done = subprocess.run([sys.executable, "-m", "post", "picture", path, "-o", out, *words],
                              cwd=PROJECT, capture_output=True, text=True, check=False)
        assert (answer or "") in done.stderr and (done.returncode == 0) == (answer is None), done
    assert os.path.getsize(out) > 10000


def main():
    with tempfile.TemporaryDirectory() as folder:
        with run(folder, "smooth.h5") as file:
            check(last_frame(file), WAY, 1e-6)
        check_picture(os.path.join(folder, "smooth.h5"))
        with run(folder, "rough.h5", friction=0.2) as file:
            # what is worn is the work of friction over its coefficient
            slip = file["history/friction_energy"][-1] / (0.2 * PRESSURE * AREA)
            assert 0.99 * WAY < slip < WAY
            check(last_frame(file), slip, 2e-3)
        with run(folder, "none.h5", fields='"NONE"') as file:
            assert "wear" not in file["VTKHDF/PointData"]
            assert "contact_pressure" not in file["VTKHDF/PointData"]
        with run(folder, "pressure.h5", fields='"CONTACT"') as file:
            assert "wear" not in file["VTKHDF/PointData"]
            assert "contact_pressure" in file["VTKHDF/PointData"]


main()
