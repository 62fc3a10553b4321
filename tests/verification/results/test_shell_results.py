"""A shell as its mid-surface: the same values as its sheet has, read by VTK and by `post`; forces
and moments per length against a strip on two supports under a pressure.

Usage: test_shell_results.py IGAFORM ROOT
"""
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import pyvista

IGAFORM, ROOT = sys.argv[1:3]
sys.path.insert(0, ROOT)
from post.results import Results                                  # noqa: E402
from test_results_file import LAGRANGE_QUAD, blank_of, read_step  # noqa: E402

DECK = os.path.join(ROOT, "input", "verification", "joined_strip.key")
HALF, PRESSURE = 20.0, 0.1       # of the strip, elastic
FIELDS = ', FIELDS="STRESS, RESULTANTS"'
STACKED = ("Points", "displacement", "thickness", "thinning", "eqps", "mises", "major_strain",
           "minor_strain", "stress_xx", "M11", "N22")


class MidSurface(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        with open(DECK) as file:
            cls.text = file.read()
        for cells in ("LAGRANGE", "SURFACE"):
            done = cls.run_deck(cells, f", CELLS={cells}{FIELDS}")
            assert done.returncode == 0, done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def run_deck(cls, name, options, *words):
        path = cls.path(name, "key")
        with open(path, "w") as file:
            file.write(cls.text.replace("HISTORY=100", "HISTORY=100" + options)
                       + "*CHECKPOINT, NUMBER=1\n")
        return subprocess.run(
            [IGAFORM, path, "--threads", "1", "--set", "knot=0.3", "--set", f"load={PRESSURE}",
             "--set", "n=16", "--out", cls.path(name, "h5"), *words],
            capture_output=True, text=True, check=False)

    @classmethod
    def path(cls, name, extension):
        return os.path.join(cls.folder.name, f"{name}.{extension}")

    def test_post_reads_the_layers_of_the_sheet(self):
        with Results(self.path("LAGRANGE", "h5")) as sheet, \
                Results(self.path("SURFACE", "h5")) as surface:
            self.assertTrue(surface.is_surface)
            for name in STACKED:
                for frame in (0, 1):
                    there = sheet.blank_grid(name, frame)[[0, sheet.degrees.max() // 2, -1]]
                    here = surface.blank_grid(name, frame)
                    np.testing.assert_allclose(here, there, rtol=0, err_msg=name,
                                               atol=1e-12 * max(np.abs(there).max(), 1e-3))

    def test_vtk_reads_flat_cells(self):
        blank = blank_of(read_step(self.path("SURFACE", "h5"), -1)[0])
        self.assertEqual(set(blank.celltypes), {LAGRANGE_QUAD})
        normal = blank.point_data["normal"]
        np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-12)
        self.assertGreater(normal[:, 2].min(), 0.99)
        # a face made by ParaView's Warp By Vector
        top = blank.points + 0.5 * blank.point_data["thickness"][:, None] * normal
        whole = blank_of(read_step(self.path("LAGRANGE", "h5"), -1)[0])
        faces = pyvista.PolyData(whole.points)
        for place in top[::7]:
            nearest = faces.points[faces.find_closest_point(place)]
            self.assertLess(np.linalg.norm(nearest - place), 1e-6)

    def test_moment_of_a_strip_on_two_supports(self):
        with Results(self.path("SURFACE", "h5")) as surface:
            patch = surface.patches[0]
            x = patch.field("Points", 0)[1, :, :, 0]
            m11, m22 = (patch.field(name, 1)[1, ..., 0] for name in ("M11", "M22"))
            most = PRESSURE * HALF**2 / 2
            inner = np.abs(x) < 0.9 * HALF      # fields are constant outside the outermost points
            np.testing.assert_allclose(m11[inner], (most * (1 - (x / HALF)**2))[inner],
                                       rtol=0, atol=0.02 * most)
            middle = np.abs(x) < 1e-9
            np.testing.assert_allclose(m11[middle], most, rtol=0.01)
            np.testing.assert_allclose(m22[middle] / m11[middle], 0.3, rtol=0.01)
            force = np.abs(patch.field("N11", 1)).max()
            self.assertLess(force, 0.01 * most)
            self.assertEqual(surface.unit_of_field("N11"), "N/mm")
            # 6 M/h^2 at the faces; the outer layers of points are a little below them
            stress = patch.field("stress_xx", 1)[:, middle, 0]
            share = surface.file["points/stress"].shape[0]
            self.assertEqual(share, 6)
            layer = 0.5 * (1 + np.sqrt(0.6))
            np.testing.assert_allclose(stress[2], 6 * most * layer, rtol=0.02)
            np.testing.assert_allclose(stress[0], -6 * most * layer, rtol=0.02)
            self.assertLess(np.abs(stress[1]).max(), 0.01 * stress[2].max())

    def test_frames_of_other_cells_are_refused(self):
        done = self.run_deck("LAGRANGE", f", CELLS=SURFACE{FIELDS}", "--restart",
                             self.path("LAGRANGE", "ckpt.h5"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("CELLS=LAGRANGE", done.stderr)
        self.assertIn("CELLS=SURFACE", done.stderr)
        done = self.run_deck("SURFACE", ", CELLS=SURFACE", "--restart",
                             self.path("SURFACE", "ckpt.h5"))
        self.assertEqual(done.returncode, 1)
        self.assertIn('FIELDS="STRESS, RESULTANTS"', done.stderr)

    def test_picture_of_a_moment(self):
        out = self.path("picture", "png")
        for field in ("M11", "mises"):
            done = subprocess.run(
                [sys.executable, "-m", "post", "picture", self.path("SURFACE", "h5"), "--field",
                 field, "--renderer", "matplotlib", "-o", out],
                cwd=ROOT, capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(os.path.exists(out))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
