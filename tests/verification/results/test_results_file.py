"""A results file as VTK's own reader and h5py see it.

Usage: test_results_file.py WRITER      the file with known contents that write_example makes
       test_results_file.py --file F    the general rules, on the results of any run
"""
import argparse
import os
import signal
import subprocess
import sys
import tempfile
import unittest

import h5py
import numpy as np
import pyvista
import vtk

LAGRANGE_QUAD, LAGRANGE_HEX, BEZIER_QUAD, BEZIER_HEX = 70, 72, 77, 79
FIELDS = ("displacement", "velocity", "eqps", "mises", "thickness", "thinning", "major_strain",
          "minor_strain")


def read_step(path, step):
    """The grid that vtkHDFReader makes of one step, and the times of all steps."""
    reader = vtk.vtkHDFReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    n_steps = reader.GetNumberOfSteps()
    times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    reader.SetStep(step % n_steps)
    reader.Update()
    return pyvista.wrap(reader.GetOutput()), np.array(times)


def blank_of(grid):
    return grid.extract_cells(np.flatnonzero(grid.cell_data["part"] == 0))


def volume(grid, level):
    """Volume of curved cells, cut into linear ones `level` times."""
    surface = vtk.vtkGeometryFilter()
    surface.SetInputData(grid)
    surface.SetNonlinearSubdivisionLevel(level)
    surface.Update()
    triangles = pyvista.wrap(surface.GetOutput()).triangulate().clean()
    return abs(triangles.volume)


class GeneralRules(unittest.TestCase):
    """What holds for the results of every run."""

    path = None

    def test_steps_are_those_of_the_file(self):
        _, times = read_step(self.path, 0)
        with h5py.File(self.path) as file:
            np.testing.assert_array_equal(times, file["VTKHDF/Steps/Values"][:])
            self.assertEqual(len(times), file["VTKHDF/Steps"].attrs["NSteps"])
            self.assertEqual(len(times), len(file["frames/is_failed"]))
        self.assertTrue(np.all(np.diff(times) > 0))

    def test_points_and_fields_are_those_of_each_step(self):
        with h5py.File(self.path) as file:
            for step in (0, -1):
                grid, times = read_step(self.path, step)
                n = grid.n_points
                rows = slice((step % len(times)) * n, (step % len(times) + 1) * n)
                np.testing.assert_array_equal(grid.points, file["VTKHDF/Points"][rows])
                for name in FIELDS:
                    np.testing.assert_array_equal(grid.point_data[name],
                                                  file["VTKHDF/PointData"][name][rows])

    def test_displacement_is_the_motion_of_the_points(self):
        first, _ = read_step(self.path, 0)
        last, _ = read_step(self.path, -1)
        motion = last.points - first.points
        change = last.point_data["displacement"] - first.point_data["displacement"]
        np.testing.assert_allclose(motion, change, atol=1e-9 * np.abs(last.points).max())

    def test_plastic_strain_stays_in_the_range_of_the_points(self):
        grid = blank_of(read_step(self.path, -1)[0])
        with h5py.File(self.path) as file:
            eqps = file["points/eqps"][:]
        self.assertGreaterEqual(grid.point_data["eqps"].min(), eqps.min() - 1e-15)
        self.assertLessEqual(grid.point_data["eqps"].max(), eqps.max() + 1e-15)

    def test_volume_of_the_cells_is_that_of_the_points(self):
        grid = blank_of(read_step(self.path, 0)[0])
        with h5py.File(self.path) as file:
            expected = file["points/reference_volume"][:].sum()
        self.assertAlmostEqual(volume(grid, 4) / expected, 1, delta=1e-3)

    def test_parts_have_names_in_each_step(self):
        with h5py.File(self.path) as file:
            tools = sorted(file["tools"], key=lambda name: file["tools"][name].attrs["part"])
        for step in (0, -1):
            data = read_step(self.path, step)[0].GetFieldData()
            names = [data.GetAbstractArray(f"part_{i}") for i in range(1 + len(tools))]
            self.assertEqual([1] * len(names), [name.GetNumberOfTuples() for name in names])
            self.assertEqual(["blank", *tools], [name.GetValue(0) for name in names])

    def test_every_dataset_is_described(self):
        def check(name, item):
            if isinstance(item, h5py.Dataset):
                self.assertNotEqual(item.attrs.get("description", b""), b"", name)
                if item.dtype.kind in "fiu":
                    self.assertNotEqual(item.attrs.get("unit", b""), b"", name)
                else:
                    self.assertNotIn("unit", item.attrs, name)

        with h5py.File(self.path) as file:
            file.visititems(check)


class KnownContents(GeneralRules):
    """The file of write_example: Lagrange cells."""

    writer = None
    cells = "LAGRANGE"
    types = {LAGRANGE_HEX, LAGRANGE_QUAD}

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = os.path.join(cls.folder.name, "example.h5")
        subprocess.run([cls.writer, cls.path, cls.cells], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_steps(self):
        np.testing.assert_array_equal(read_step(self.path, 0)[1], [0, 1, 2, 3])

    def test_cell_types_and_parts(self):
        grid, _ = read_step(self.path, 0)
        self.assertEqual(set(grid.celltypes), self.types)
        self.assertEqual(np.count_nonzero(grid.cell_data["part"] == 0), 5 * 2 * 1)
        self.assertEqual(np.count_nonzero(grid.cell_data["part"] == 1), 2)

    def test_node_order(self):
        """Each cell's corners turn the same way and its nodes are where VTK expects them."""
        grid, _ = read_step(self.path, 0)
        for i in range(10):
            cell = grid.GetCell(i)
            self.assertGreater(vtk.vtkMeshQuality.HexVolume(corner_hexahedron(cell)), 0)
            place, weights, x = [0.0] * 3, [0.0] * cell.GetNumberOfPoints(), [0.0] * 3
            sub = vtk.reference(0)
            for n in range(cell.GetNumberOfPoints()):
                parametric = [cell.GetParametricCoords()[3 * n + d] for d in range(3)]
                cell.EvaluateLocation(sub, parametric, x, weights)
                place = grid.points[cell.GetPointId(n)]
                np.testing.assert_allclose(x, self.expected_place(i, parametric, place), atol=1e-9)

    def expected_place(self, i, parametric, place):
        element = np.array([i % 5, i // 5, 0])
        x, depth, height = (element + parametric) * [20, 10, 2]
        np.testing.assert_allclose(place, [x, height, -depth], atol=1e-9)
        return [x, height, -depth]

    def test_bowed_surface(self):
        """The lower face is y = 0.003 x^2 at the last step, also between the nodes."""
        grid, _ = read_step(self.path, -1)
        for i in range(10):
            cell, x, sub = grid.GetCell(i), [0.0] * 3, vtk.reference(0)
            weights = [0.0] * cell.GetNumberOfPoints()
            for parametric in ([0.3, 0.6, 0.0], [0.9, 0.1, 0.0]):
                cell.EvaluateLocation(sub, parametric, x, weights)
                self.assertAlmostEqual(x[1], 0.003 * x[0] ** 2, delta=1e-9)

    def test_volume_of_the_bowed_sheet(self):
        grid = blank_of(read_step(self.path, -1)[0])
        self.assertAlmostEqual(volume(grid, 5), 4000, delta=4)

    def test_fields(self):
        grid, _ = read_step(self.path, -1)
        blank = blank_of(grid)
        eqps = blank.point_data["eqps"]
        inside = np.isclose(blank.points[:, 0], 50)
        np.testing.assert_allclose(eqps[inside], 0.03 * 3, atol=1e-15)
        shared = np.isclose(blank.points[:, 0], 40)
        np.testing.assert_allclose(eqps[shared], 0.5 * (0.06 + 0.09), atol=1e-15)
        np.testing.assert_allclose(blank.point_data["mises"], 300, rtol=1e-14)
        np.testing.assert_allclose(blank.point_data["stress"],
                                   np.tile([300, 0, 0, 0, 0, 0], (blank.n_points, 1)), rtol=1e-14)
        np.testing.assert_allclose(blank.point_data["thickness"], 2, rtol=1e-12)
        np.testing.assert_allclose(blank.point_data["thinning"], 0, atol=1e-12)
        self.check_plane_strains(blank)
        self.assertEqual(np.count_nonzero(np.isnan(grid.point_data["eqps"])),
                         grid.n_points - blank.n_points)

    def check_plane_strains(self, blank):
        """Those of the integration points, 0.5 log(1 + (0.006 x)^2), at the outermost display
        points and in the middle of the elements."""
        major = blank.point_data["major_strain"]
        np.testing.assert_allclose(blank.point_data["minor_strain"], 0, atol=1e-12)
        half = 10 / np.sqrt(3)
        for x, points in ((0, [10 - half]), (30, [30 - half, 30 + half]), (100, [90 + half])):
            expected = np.mean(0.5 * np.log1p((0.006 * np.array(points))**2))
            at = np.isclose(blank.points[:, 0], x)
            self.assertTrue(at.any())
            np.testing.assert_allclose(major[at], expected, atol=1e-12)

    def test_tools_move(self):
        first, _ = read_step(self.path, 0)
        last, _ = read_step(self.path, -1)
        plate = first.extract_cells(np.flatnonzero(first.cell_data["part"] == 1))
        moved = last.extract_cells(np.flatnonzero(last.cell_data["part"] == 1))
        np.testing.assert_allclose(moved.points - plate.points, np.tile([0, -6, 0],
                                                                       (plate.n_points, 1)))

    def test_cylinder_is_round(self):
        grid, _ = read_step(self.path, 0)
        for i in np.flatnonzero(grid.cell_data["part"] == 2):
            cell, x, sub = grid.GetCell(i), [0.0] * 3, vtk.reference(0)
            weights = [0.0] * cell.GetNumberOfPoints()
            for place in np.linspace(0, 1, 7):
                cell.EvaluateLocation(sub, [place, 0.4, 0], x, weights)
                self.assertAlmostEqual(np.hypot(x[0], x[1]) / 30, 1, delta=1e-4)

    def test_history_and_tools(self):
        with h5py.File(self.path) as file:
            time = file["history/time"][:]
            np.testing.assert_array_equal(time, np.arange(8) * 0.5)
            np.testing.assert_allclose(file["history/external_work"][:], 3 * time)
            self.assertEqual(file["history/step"].dtype, np.int64)
            np.testing.assert_array_equal(file["tools/plate/time"][:], time)
            np.testing.assert_allclose(file["tools/plate/force"][:, 1], 7 * time)
            np.testing.assert_allclose(file["tools/plate/displacement"][:, 1], -2 * time)
            np.testing.assert_allclose(file["history/probes/middle/displacement"][:, 2], 3 * time)
            self.assertEqual(file["history/external_work"].attrs["unit"], b"t*mm/s^2*mm")

    def test_points_of_integration(self):
        with h5py.File(self.path) as file:
            volumes = file["points/reference_volume"]
            positions = file["points/reference_position"]
            self.assertEqual(volumes.shape, (6, 4, 10))
            self.assertAlmostEqual(volumes[:].sum(), 4000, delta=1e-9)
            self.assertAlmostEqual(positions[0, 0, 0, 0], 10 * (1 - 1 / np.sqrt(3)), delta=1e-12)
            np.testing.assert_allclose(file["points/eqps"][0, 0, ::2], 0.03 * np.arange(1, 6))
            np.testing.assert_allclose(file["frames/eqps"][:, 0, 0, 8], 0.05 * np.arange(4))
            slope = 2 * 0.003 * positions[:, :, :, 0]
            np.testing.assert_allclose(file["points/principal_strain"][..., 0],
                                       0.5 * np.log1p(slope ** 2), atol=1e-14)

    def test_texts_are_ascii_where_they_can_be(self):
        with h5py.File(self.path) as file:
            kind = h5py.h5a.open(file["VTKHDF"].id, b"Type").get_type()
            self.assertEqual(kind.get_cset(), h5py.h5t.CSET_ASCII)
            text = file["provenance/deck_text"]
            self.assertEqual(text.id.get_type().get_cset(), h5py.h5t.CSET_UTF8)
            self.assertTrue(text[()].decode("utf-8").endswith("bows, \u00b5"))

    def test_exact_geometry(self):
        with h5py.File(self.path) as file:
            points = file["nurbs/tools/plate/surface_1/points"][:]
            np.testing.assert_allclose(points[..., 1], 14)
            np.testing.assert_array_equal(file["nurbs/blank/degrees"][:], [2, 2, 2])
            self.assertEqual(file["nurbs/blank/points"].shape, (3, 4, 7, 3))
            self.assertEqual(file["provenance"].attrs["status"], b"completed")
            self.assertIn(b"a sheet that bows", file["provenance/deck_text"][()])


class KnownContentsBezier(KnownContents):
    """The file of write_example: Bezier cells."""

    cells = "BEZIER"
    types = {BEZIER_HEX, BEZIER_QUAD}

    @unittest.skipIf(vtk.vtkVersion().GetVTKMajorVersion() * 100
                     + vtk.vtkVersion().GetVTKMinorVersion() < 907,
                     "VTK before 9.7 drops the weights of Bezier cells")
    def test_cylinder_is_round(self):
        super().test_cylinder_is_round()


class RunningWriter(unittest.TestCase):
    """A file that is being written, or whose writer was killed."""

    writer = None

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = os.path.join(self.folder.name, "running.h5")
        self.process = subprocess.Popen([self.writer, self.path, "LAGRANGE", "FOREVER"],
                                        stdout=subprocess.PIPE, text=True)

    def tearDown(self):
        self.process.kill()
        self.process.communicate()
        self.folder.cleanup()

    def wait_for_frames(self, n):
        for line in self.process.stdout:
            if int(line) >= n:
                return

    def test_second_writer_is_refused(self):
        self.wait_for_frames(2)
        second = subprocess.run([self.writer, self.path, "LAGRANGE"], capture_output=True,
                                text=True)
        self.assertNotEqual(second.returncode, 0)
        self.assertIn("another program is using it", second.stdout)
        with h5py.File(self.path) as file:
            self.assertGreaterEqual(file["VTKHDF/Steps"].attrs["NSteps"], 2)

    def test_killed_writer_leaves_a_file_that_opens(self):
        self.wait_for_frames(5)
        self.process.send_signal(signal.SIGSTOP)
        self.process.kill()
        self.process.wait()
        grid, times = read_step(self.path, -1)
        self.assertGreaterEqual(len(times), 5)
        self.assertEqual(blank_of(grid).n_cells, 10)


def corner_hexahedron(cell):
    hexahedron = vtk.vtkHexahedron()
    for n in range(8):
        hexahedron.GetPoints().SetPoint(n, cell.GetPoints().GetPoint(n))
    return hexahedron


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("writer", nargs="?")
    parser.add_argument("--file")
    arguments, rest = parser.parse_known_args()
    suite = unittest.TestSuite()
    load = unittest.defaultTestLoader.loadTestsFromTestCase
    if arguments.file:
        GeneralRules.path = arguments.file
        suite.addTest(load(GeneralRules))
    else:
        for case in (KnownContents, RunningWriter):
            case.writer = os.path.abspath(arguments.writer)
        for case in (KnownContents, KnownContentsBezier, RunningWriter):
            suite.addTest(load(case))
    result = unittest.TextTestRunner(verbosity=2 if "-v" in rest else 1).run(suite)
    sys.exit(not result.wasSuccessful())


if __name__ == "__main__":
    main()
