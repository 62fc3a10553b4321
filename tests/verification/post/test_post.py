"""The package `post` on a file with known contents.

Usage: test_post.py WRITER PROJECT_FOLDER
"""
import json
import os
import subprocess
import sys
import tempfile
import unittest
from types import SimpleNamespace

import h5py
import numpy as np

WRITER, PROJECT = (os.path.abspath(path) for path in sys.argv[1:3])
sys.path.insert(0, PROJECT)

from post import cells, compare, picture, processes  # noqa: E402
from post.results import Results, ResultsError  # noqa: E402
from post.section import Section  # noqa: E402


class Known(unittest.TestCase):
    """Tests on both kinds of cells."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.paths = {}
        for kind in ("LAGRANGE", "BEZIER"):
            cls.paths[kind] = os.path.join(cls.folder.name, f"{kind}.h5")
            subprocess.run([WRITER, cls.paths[kind], kind], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def each(self):
        for kind, path in self.paths.items():
            with self.subTest(kind), Results(path) as results:
                yield results


class TestBalance(unittest.TestCase):
    def test_errors_are_parts_of_the_largest_energy(self):
        """Half of next to nothing at first, a tenth of the energy in between; at the end the sheet
        has given most of it back."""
        columns = {"kinetic_energy": [0.0, 1e-9, 10.0, 1.0], "internal_energy": [0, 1e-9, 30, 9],
                   "external_work": [0.0, 3e-9, -50.0, 5.0], "energy_error": [0, 0.5, 0.1, -0.2]}
        run = SimpleNamespace(history=lambda name: np.array(columns[name], float))
        np.testing.assert_allclose(Results.balance_error(run), [0, 3e-11, 0.1, -0.04], rtol=1e-12)
        columns["kinetic_energy"][0] = 100.0        # thrown onto the tool
        np.testing.assert_allclose(Results.balance_error(run), [0, 0.5, 0.1, -0.2], rtol=1e-12)


class TestProcesses(unittest.TestCase):
    LOG = """
processes  2 with 1 thread each, on node
rows       of 62 rows of control points each process moves 32 to 34
exchange   up to 40 kB received by a process in each increment, 1 to 2 s of 10 s in the processes
effect                                seconds   share %         calls
blank                                   6.000      60.0           100
boundary X_MIN                          1.000      10.0           100
exchange                                1.000      10.0           201
output                                  1.500      15.0            10
other                                   0.500       5.0
all steps                              10.000     100.0           100
3600 elements, 100 steps, 1 thread: 27777.8 ns per element and step
"""

    def facts(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "run.log")
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
            return processes.Facts(path)

    def test_work_is_shared_and_output_is_not(self):
        facts = self.facts(self.LOG)
        self.assertAlmostEqual(0.16, facts.seconds(1, 1.0, 1e99))
        self.assertAlmostEqual(0.10, facts.seconds(2, 0.0, 1e99))
        self.assertAlmostEqual(0.07/2 + 0.03, facts.seconds(4, 0.0, 1e99))

    def test_messages_take_their_latency_and_their_bytes(self):
        facts = self.facts(self.LOG)
        self.assertAlmostEqual(3e-3, facts.passing(2, 1e-3, 1e99))
        self.assertAlmostEqual(13e-3, facts.passing(64, 1e-3, 1e99))
        shell = self.facts(self.LOG.replace(" 201\n", " 302\n"))
        self.assertAlmostEqual(14e-3, shell.passing(64, 1e-3, 1e99))
        self.assertAlmostEqual(40e-3, facts.passing(2, 0.0, 1e6))
        self.assertAlmostEqual(80e-3, facts.passing(3, 0.0, 1e6))
        self.assertAlmostEqual(400e-3, facts.passing(2, 0.0, 1e6, size=100.0))

    def test_other_runs_are_refused(self):
        whole = self.LOG.replace("of 62 rows of control points each process moves 32 to 34",
                                 "each process moves all control points")
        for text in (whole, self.LOG.replace("processes  2", "threads  2")):
            with self.assertRaises(ResultsError):
                self.facts(text)


class TestResults(Known):
    def test_points_lie_on_the_parabola(self):
        for results in self.each():
            points = results.sample_blank("Points", 3, [0.0, 1.3, 5.0], [0.4], [0.0, 1.0])
            x = 20 * np.array([0.0, 1.3, 5.0])
            np.testing.assert_allclose(points[0, 0, :, 0], x, atol=1e-12)
            np.testing.assert_allclose(points[0, 0, :, 1], 0.003 * x**2, atol=1e-12)
            np.testing.assert_allclose(points[1, 0, :, 1], 0.003 * x**2 + 2, atol=1e-12)
            np.testing.assert_allclose(points[0, 0, :, 2], -4, atol=1e-12)

    def test_scalars_stay_in_their_range(self):
        for results in self.each():
            line = np.linspace(0, 5, 101)
            eqps = results.sample_blank("eqps", 3, line, [0.4], [0.3])
            self.assertGreaterEqual(eqps.min(), 0.03)
            self.assertLessEqual(eqps.max(), 0.15)

    def test_tools_keep_the_decks_order(self):
        for results in self.each():
            self.assertEqual(results.tools, ["plate", "cylinder"])
            plate, cylinder = results.tool_surfaces(2, 4)
            np.testing.assert_allclose(plate[0][:, 1], 16)
            np.testing.assert_allclose(np.hypot(cylinder[0][:, 0], cylinder[0][:, 1]), 30,
                                       rtol=1e-4)

    def test_frames_by_number_and_time(self):
        for results in self.each():
            self.assertEqual(results.frame(), 3)
            self.assertEqual(results.frame(number=-2), 2)
            self.assertEqual(results.frame(time=1.2), 1)
            self.assertRaises(ResultsError, results.frame, 4)
            self.assertRaises(ResultsError, results.frame, None, 3.5)


class TestCells(unittest.TestCase):
    def test_cut_of_a_square(self):
        points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]])
        lines = cells.cut(points, np.array([[0, 1, 2, 3]]), np.array([0, 0.5, 0]),
                          np.array([0.0, 1, 0]))
        np.testing.assert_allclose(lines[..., 1], 0.5)
        self.assertAlmostEqual(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum(), 1)

    def test_a_plane_through_corners_cuts_once(self):
        points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]])
        two = np.array([[0, 1, 2, 3], [3, 2, 5, 4]])
        points = np.vstack([points, [[0, 4, 0], [1, 4, 0]]])
        lines = cells.cut(points, two, np.array([0, 2.0, 0]), np.array([0.0, 1, 0]))
        self.assertAlmostEqual(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum(), 1)


class TestSection(Known):
    def test_faces_and_thickness(self):
        for results in self.each():
            section = Section(results)
            self.assertEqual(section.axis_names, ["x", "y"])
            lower, middle, upper = section.sheet(3)
            np.testing.assert_allclose(lower[:, 1], 0.003 * lower[:, 0]**2, atol=1e-12)
            np.testing.assert_allclose(middle[:, 1], 0.003 * lower[:, 0]**2 + 1, atol=1e-12)
            np.testing.assert_allclose(section.thickness(3), 2)
            self.assertEqual(len(upper), 41)

    def test_tools_are_cut(self):
        for results in self.each():
            plate, cylinder = Section(results).tools(1)
            np.testing.assert_allclose(plate[..., 1], 18)
            self.assertAlmostEqual(np.ptp(plate[..., 0]), 100)
            np.testing.assert_allclose(np.linalg.norm(cylinder, axis=-1), 30, rtol=1e-3)


class TestCompare(unittest.TestCase):
    folder = os.path.join(PROJECT, "tests", "verification", "channel", "reference")

    def test_distance_to_a_corner(self):
        line = np.array([[0.0, 0], [2, 0], [2, 2]])
        points = np.array([[1.0, 0.5], [3, -1], [2.5, 1], [-1, 0]])
        np.testing.assert_allclose(compare.distance_to_line(points, line),
                                   [0.5, np.sqrt(2), 0.5, 1])

    def test_reference_runs_hold_their_figures(self):
        for name, strain, thickness in (("S1", 0.01588, 2.989), ("L3", 0.0273, 2.96)):
            run = compare.Reference(self.folder, name)
            inside = (run.x0 > 150) & (run.x0 < 450)
            self.assertAlmostEqual(run.eqps[inside].mean(), strain, delta=1e-4)
            self.assertAlmostEqual(run.thickness[inside].min(), thickness, delta=2e-3)

    def test_shift_along_the_sheet_is_found(self):
        run = compare.Reference(self.folder, "S1")
        shift, rms, greatest = compare.shape_distance(run.middle + [7.3, 0.0], run.middle)
        self.assertAlmostEqual(shift, -7.3, delta=1e-3)
        self.assertLess(rms, 1e-3)
        self.assertLess(greatest, 1e-3)

    def test_a_value_out_of_its_limits_fails(self):
        rows = [compare.within("good", 1.04, 1.0, 0.05)]
        self.assertTrue(compare.print_table(rows, "S1", "file"))
        rows.append(compare.within("bad", 1.06, 1.0, 0.05))
        self.assertFalse(compare.print_table(rows, "S1", "file"))


class SteadyRun:
    """A stand-in for a result: frames at shares of a run of 2 s."""

    def __init__(self, shares):
        self.times = 2.0 * np.array(shares)

    def history(self, name):
        assert name == "time"
        return np.linspace(0, 2, 11)


class TestStrainAtClosing(unittest.TestCase):
    """Dies that close by 150 mm evenly, and a strain that is the number of the frame."""

    @staticmethod
    def strain(shares):
        strip = compare.Strip.__new__(compare.Strip)
        strip.results = SteadyRun(shares)
        strip.closing = np.linspace(0, 150, 11)
        strip.mean_strain = float
        return strip.mean_strain_at(112.5)

    def test_it_lies_between_near_frames(self):
        self.assertAlmostEqual(self.strain([0, 0.74, 0.76, 1]), 1.5)
        self.assertAlmostEqual(self.strain([0, 0.75, 1]), 1)

    def test_sparse_frames_are_refused(self):
        with self.assertRaisesRegex(ResultsError, "112.5 mm .*25.0 %"):
            self.strain([0, 0.5, 1])
        with self.assertRaisesRegex(ResultsError, "frames"):
            self.strain([0, 0.725, 0.775, 1])


class TestCommands(Known):
    def run_post(self, *arguments):
        return subprocess.run([sys.executable, "-m", "post", *arguments], cwd=PROJECT,
                              capture_output=True, text=True, check=False)

    def assert_picture(self, arguments, least_width):
        out = os.path.join(self.folder.name, "picture.png")
        done = self.run_post(*arguments, "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(out, "rb") as file:
            data = file.read()
        os.remove(out)
        self.assertEqual(data[1:4], b"PNG")
        self.assertGreaterEqual(int.from_bytes(data[16:20], "big"), least_width)
        return done

    def test_the_package_works_from_any_folder(self):
        environment = dict(os.environ, PYTHONPATH=PROJECT)
        with tempfile.TemporaryDirectory() as folder:
            for command in (["history", self.paths["LAGRANGE"]],
                            ["picture", self.paths["BEZIER"], "--frame", "1"]):
                done = subprocess.run(
                    [sys.executable, "-m", "post", *command, "-o", f"{command[0]}.png"], cwd=folder,
                    env=environment, capture_output=True, text=True, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertTrue(os.path.isfile(os.path.join(folder, f"{command[0]}.png")))

    def test_pictures_are_drawn(self):
        path = self.paths["LAGRANGE"]
        self.assert_picture(["profile", path, "--times", "1", "3"], 1000)
        self.assert_picture(["history", path], 1000)
        self.assert_picture(["picture", path, "--renderer", "matplotlib", "--time", "2"], 1000)

    def test_the_sheet_is_drawn_in_any_case(self):
        self.assert_picture(["picture", self.paths["BEZIER"], "--field", "mises"], 1000)

    def test_records_of_the_suite_become_pictures_and_a_table(self):
        record = {"title": "A case", "source": "closed form", "rows": [
            {"quantity": "length", "measured": "2", "reference": "1", "error": "1", "limit": "3"}],
            "panels": [{"x": "h", "y": "error", "scale": "log", "lines": [
                {"label": "p = 1", "style": "o-", "x": [1, 2], "y": [0.1, 0.4]}]}]}
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "case.json"), "w", encoding="utf-8") as file:
                json.dump(record, file)
            done = self.run_post("verification", folder)
            self.assertIn("| case | length | 2 | 1 | 1 | 3 |", done.stdout)
            self.assertTrue(os.path.isfile(os.path.join(folder, "case.png")))
            os.remove(os.path.join(folder, "case.json"))
            self.assertIn("records", self.run_post("verification", folder).stderr)

    def test_faults_are_said_in_a_line(self):
        other = os.path.join(self.folder.name, "other.h5")
        with h5py.File(other, "w") as file:
            file["x"] = 1
        text = os.path.join(self.folder.name, "text.h5")
        with open(text, "w", encoding="utf-8") as file:
            file.write("no HDF5")
        good = self.paths["LAGRANGE"]
        blocked = os.path.join(self.folder.name, "folder.png")
        os.mkdir(blocked)
        for arguments, words in ((["picture", "missing.h5"], "'missing.h5'"),
                                 (["history", other], "other.h5"),
                                 (["profile", text], "text.h5"),
                                 (["picture", good, "--frame", "9"], "frame 9 "),
                                 (["profile", good, "--times", "99"], "99"),
                                 (["compare", good, "missing"], "closed"),
                                 (["history", good, "--out", "nowhere/x.png"], "nowhere"),
                                 (["picture", good, "-o", "sheet.xyz"],
                                  "'.xyz'"),
                                 (["history", good, "-o", "history"], "'history'"),
                                 (["profile", good, "-o", blocked], f"'{blocked}'"),
                                 (["compare", good], "REFERENCE_DIR")):
            done = self.run_post(*arguments)
            self.assertIn(done.returncode, (1, 2), arguments)
            self.assertIn(words, done.stderr)
            self.assertNotIn("Traceback", done.stderr)


class TestColours(Known):
    def test_limits_leave_out_a_few_high_values(self):
        for results in self.each():
            low, high = picture.colour_limits(results, 3, "eqps")
            self.assertEqual(low, 0)
            self.assertAlmostEqual(high, 0.15)
            low, high = picture.colour_limits(results, 3, "thickness")
            self.assertAlmostEqual(low, 2)
            self.assertGreater(high, low)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
