"""Forming outputs against closed forms: strains of a stretched sheet, limit curves, angles.

Usage: test_forming.py IGAFORM PROJECT_FOLDER
"""
import argparse
import contextlib
import io
import os
import subprocess
import sys
import tempfile
import unittest
from types import SimpleNamespace

import numpy as np

IGAFORM, PROJECT = (os.path.abspath(path) for path in sys.argv[1:3])
sys.path.insert(0, PROJECT)

from post import (compare, draw_in, earing, fld, force, limit_curve, picture,  # noqa: E402
                  springback)
from post.deck import Deck  # noqa: E402
from post.results import Results, ResultsError  # noqa: E402

DECK = os.path.join(PROJECT, "tests", "verification", "post", "stretched_sheet.key")
MAJOR, MINOR = np.log(26 / 20), np.log(11 / 10)


class TestStretchedSheet(unittest.TestCase):
    """A sheet of 20 x 10 mm, of which two edges are symmetry planes, pulled to 26 x 11 mm."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = os.path.join(cls.folder.name, "sheet.h5")
        subprocess.run([IGAFORM, DECK, "--quiet", "--threads", "1", "--out", cls.path], check=True,
                       capture_output=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_strains_at_points_and_in_the_pictures(self):
        with Results(self.path) as results:
            for layer in fld.LAYERS:
                for frame, share in ((2, 1), (1, None)):
                    minor, major, _ = fld.strains(results, frame, layer)
                    if share:
                        np.testing.assert_allclose(major, MAJOR, atol=2e-3)
                        np.testing.assert_allclose(minor, MINOR, atol=2e-3)
                    else:
                        self.assertTrue(np.all((major > 0.3 * MAJOR) & (major < 0.7 * MAJOR)))
            thinning = results.blank_grid("thinning", 2)
            # plastic flow keeps the volume, stress and elasticity change it by less than 0.2 %
            np.testing.assert_allclose(thinning, 1 - np.exp(-MAJOR - MINOR), atol=3e-3)
            np.testing.assert_allclose(results.blank_grid("major_strain", 2), MAJOR, atol=2e-3)

    def test_draw_in_is_the_motion_of_the_edges(self):
        with Results(self.path) as results:
            outline = draw_in.Outline(results)
            np.testing.assert_array_equal(outline.centre, [0, 0])
            corner = float(np.degrees(np.arctan2(10, 20)))
            angles = [0.0, 90.0, corner]
            np.testing.assert_allclose(outline.radii(outline.at(None), angles),
                                       [20, 10, np.hypot(20, 10)], rtol=1e-9)
            np.testing.assert_allclose(outline.radii(outline.at(2), angles[:2]), [26, 11],
                                       rtol=1e-9)
            self.assertRaises(ResultsError, outline.radii, outline.at(2), [200.0])

    def test_directions_start_in_the_middle_or_on_planes_of_symmetry(self):
        outline = object.__new__(draw_in.Outline)
        outline.size, outline.axes = 100.0, [0, 1]
        for boundary, low, high, centre in (
                ("", (-50, 0), (50, 40), (0, 20)), ("Y_MIN, YSYMM", (-50, 0), (50, 40), (0, 0)),
                ("", (-50, -40), (60, 40), (0, 0)), ("", (10, 0), (50, 40), (30, 20))):
            outline.results = SimpleNamespace(deck=Deck(f"*BOUNDARY\n{boundary}\n"))
            np.testing.assert_allclose(
                outline._default_centre(np.array(low, float), np.array(high, float)), centre)

    def test_the_command_counts_points_beyond_a_curve(self):
        curve = os.path.join(self.folder.name, "curve.csv")
        for level, n in ((MAJOR - 0.01, 48), (MAJOR + 0.01, 0)):
            with open(curve, "w", encoding="utf-8") as file:
                file.write(f"minor,major\n-0.2,{level}\n0.4,{level}\n")
            done = subprocess.run(
                [sys.executable, "-m", "post", "fld", self.path, "--curve", curve], cwd=PROJECT,
                capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn(f"{n} of 48 points beyond the limit", done.stdout)
            self.assertTrue(os.path.isfile(self.path.removesuffix(".h5") + "-fld.png"))

    def test_stresses_in_the_plane_are_the_other_two(self):
        with Results(self.path) as results:
            for layer in fld.LAYERS:
                minor, major = fld.plane_stresses(results, 2, layer)
                mises = np.mean(results.blank_grid("mises", 2))
                np.testing.assert_allclose(np.hypot(major - minor / 2, 0.75**0.5 * minor), mises,
                                           rtol=5e-3)
                # Von Mises flow along the strain path, which is curved a little.
                ratio = MINOR / MAJOR
                np.testing.assert_allclose(minor / major, (1 + 2 * ratio) / (2 + ratio), rtol=3e-2)

    def test_the_command_compares_stresses_with_a_table(self):
        table = os.path.join(self.folder.name, "limit.csv")
        command = [sys.executable, "-m", "post", "fld", self.path, "--stress", table]
        with Results(self.path) as results:
            _, major = fld.plane_stresses(results, 2, "middle")
        for unit, level, options, code, words in (
                ("MPa", 0.9 * major.min(), [], 0, "63 of 63 points beyond the limit"),
                ("MPa", 1.1 * major.max(), [], 0, "0 of 63 points beyond the limit"),
                ("Pa", 1e8, [], 1, "are in Pa, those of the result in MPa"),
                ("MPa", 1e8, ["--map"], 1, "--stress goes with neither --map")):
            with open(table, "w", encoding="utf-8") as file:
                file.write(f"major [1],stress_minor [{unit}],stress_major [{unit}]\n"
                           f"0.1,-100,{level}\n0.2,600,{level}\n")
            done = subprocess.run([*command, *options], cwd=PROJECT, capture_output=True, text=True,
                                  check=False)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(words, done.stdout + done.stderr)

    def test_the_mass_of_the_blank_is_in_the_file(self):
        with Results(self.path) as results:
            self.assertAlmostEqual(results.file["provenance/blank_mass"][()], 7.85e-9 * 200,
                                   delta=1e-20)

    def test_no_tools_no_forces(self):
        with Results(self.path) as results:
            self.assertRaises(ResultsError, force.chosen, results, argparse.Namespace(tool=None))


class TestTrimmedSheet(unittest.TestCase):
    """Half a sheet of which an outline leaves out one side is stretched evenly; a hole is cut."""

    DECK = """*UNITS
mm, t, s, N, MPa, mJ
*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*PLASTIC, HARDENING=SWIFT
565, 0.007, 0.26
*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, ELEMENT=SHELL
x, 0, 20, 2, 10
y, 0, 12, 2, 6
z, 0, 1, 2, 1
*BLANK OUTLINE
START, 0, 0
LINE, 20, 0
LINE, 20, 7
LINE, 0, 7
*AMPLITUDE, NAME=soft, DEFINITION=SMOOTH STEP
0, 0, 2e-4, 1
*BOUNDARY
X_MIN, XSYMM
Y_MIN, YSYMM
*STEP, NAME=stretch
*DYNAMIC, EXPLICIT
4e-4
*BOUNDARY, TYPE=VELOCITY, AMPLITUDE=soft
X_MAX, 1, 1, 5000
*OUTPUT, FRAMES=2
*END STEP
*STEP, NAME=cut
*DYNAMIC, EXPLICIT
1e-6
*TRIM, NAME=hole, KEEP=OUTSIDE
START, 9.5, 0.5
LINE, 14.5, 0.5
LINE, 14.5, 6.5
LINE, 9.5, 6.5
*OUTPUT, FRAMES=1
*END STEP
"""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        deck = os.path.join(cls.folder.name, "trimmed.key")
        with open(deck, "w", encoding="utf-8") as file:
            file.write(cls.DECK)
        cls.path = os.path.join(cls.folder.name, "trimmed.h5")
        subprocess.run([IGAFORM, deck, "--quiet", "--threads", "1", "--out", cls.path], check=True,
                       capture_output=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_means_are_of_what_is_left(self):
        with Results(self.path) as results:
            sheet = compare.Sheet(results)
            for frame in (1, 2, 3):
                strain = results.file["frames/eqps"][frame]
                low, high = np.nanmin(strain), np.nanmax(strain)
                self.assertLess(high - low, 0.05 * high)
                self.assertTrue(low <= sheet.mean_strain(frame, (0, 20)) <= high)
                line = sheet.strain_line(frame)[1]
                self.assertTrue(np.all((low <= line) & (line <= high)))
            _, volume = results.plastic_strain(sheet.last)
            self.assertAlmostEqual(results.points("reference_volume").sum(), volume.sum(), 6)

    def test_elements_in_a_small_hole_are_gone(self):
        """All corners of the hole's two elements belong to others as well."""
        with Results(self.path) as results:
            left = results.patches[0].elements_left(3)
            self.assertEqual(np.argwhere(~left[:4]).tolist(), [[1, 5], [2, 5]])
            self.assertFalse(left[4:].any())


class TestHole(unittest.TestCase):
    """The stretched sheet with a round hole, in which one element lies with its corners."""
    centre, radius = (7.5, 5.0), 3.01

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        deck, cls.path = (os.path.join(cls.folder.name, f"hole.{end}") for end in ("key", "h5"))
        with open(DECK, encoding="utf-8") as file:
            head, rest = file.read().split("*BOUNDARY\n", 1)
        with open(deck, "w", encoding="utf-8") as file:
            file.write(f"{head}*BLANK OUTLINE, KEEP=OUTSIDE\nCIRCLE, 7.5, 5, {cls.radius}\n"
                       f"*BOUNDARY\n{rest}")
        subprocess.run([IGAFORM, deck, "--quiet", "--threads", "1", "--out", cls.path], check=True,
                       capture_output=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def is_there(self, results):
        """Which display points of a layer lie beside the hole at the start."""
        start = (results.blank_grid("Points", 0) - results.blank_grid("displacement", 0))[0]
        return np.linalg.norm(start[..., :2] - self.centre, axis=-1) >= self.radius

    def test_points_beyond_the_edge_are_not_counted(self):
        with Results(self.path) as results:
            n = np.count_nonzero(self.is_there(results))
            self.assertLess(n, 60)
            for layer in fld.LAYERS:
                self.assertEqual([len(a) for a in fld.strains(results, 1, layer)], [n] * 3)
                minor, major = fld.plane_stresses(results, 2, layer)
                self.assertEqual((len(minor), len(major)), (n, n))
                self.assertTrue(np.all(np.isfinite([minor, major])))

    def test_the_diagram_has_no_points_in_the_hole(self):
        with Results(self.path) as results:
            strains, place, volume = (results.points(name) for name in (
                "principal_strain", "reference_position", "reference_volume"))
            is_left = np.isfinite(strains[..., 0])
            self.assertGreater(np.linalg.norm(place[is_left][:, :2] - self.centre, axis=1).min(),
                               self.radius)
            self.assertAlmostEqual(volume.sum(), 200 - np.pi * self.radius**2, delta=1e-5)
            for layer in fld.LAYERS:
                self.assertEqual(len(fld.strains(results, 2, layer)[0]),
                                 np.count_nonzero(is_left[0]))

    def test_principal_stresses_are_none_where_nothing_is_left(self):
        with Results(self.path) as results:
            tensor, largest = (results.blank_grid(name, 2)[0] for name in ("stress", "stress_max"))
            is_lost = np.any(np.isnan(tensor), axis=-1)
            self.assertGreater(np.count_nonzero(is_lost), 0)
            np.testing.assert_array_equal(np.isnan(largest[..., 0]), is_lost)

    def test_colours_are_of_what_is_there(self):
        with Results(self.path) as results:
            values = results.blank_grid("thickness", 2)[:, self.is_there(results), 0]
            self.assertEqual(picture.colour_limits(results, 2, "thickness")[0], values.min())


class TestLimitCurves(unittest.TestCase):
    def test_keeler_and_brazier(self):
        curve = limit_curve.keeler_brazier(0.21, 1.0)
        self.assertAlmostEqual(float(curve(np.array(0.0))), np.log(1.3743))
        np.testing.assert_allclose(curve(np.array([-0.1, 0.2])) - np.log(1.3743), [0.1, 0.1])
        # a steel of twice the exponent is no better than 0.21, half of it gives half
        self.assertEqual(float(limit_curve.keeler_brazier(0.42, 1.0)(np.array(0.0))),
                         float(curve(np.array(0.0))))
        self.assertAlmostEqual(float(limit_curve.keeler_brazier(0.105, 1.0)(np.array(0.0))),
                               np.log(1.18715))

    def test_a_listed_curve_goes_on_beyond_its_ends(self):
        curve = limit_curve.listed_curve(np.array([-0.1, 0.0, 0.2]), np.array([0.4, 0.3, 0.4]))
        np.testing.assert_allclose(curve(np.array([-0.2, -0.05, 0.1, 0.4])), [0.5, 0.35, 0.35, 0.5])

    def test_curves_that_are_none_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "curve.csv")
            for text in ("", "0.1,0.2\n", "0.1,0.2\n0.1,0.3\n"):
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
                self.assertRaises(ResultsError, limit_curve.read_curve, path, False)
            with open(path, "w", encoding="utf-8") as file:
                file.write("# minor, major\n0.1,0.5\n-0.1,0.6\n")
            minor, major = limit_curve.read_curve(path, True)
            np.testing.assert_allclose(minor, np.log1p([-0.1, 0.1]))
            np.testing.assert_allclose(major, np.log1p([0.6, 0.5]))
        self.assertRaises(ResultsError, limit_curve.read_curve, path, False)

    def test_columns_are_found_by_their_names(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "table.csv")
            with open(path, "w", encoding="utf-8") as file:
                file.write("major [1],stress_major [MPa],stress_minor [MPa]\n1,2,3\n4,5,1\n")
            curve = limit_curve.stress_curve(path, "MPa")
            np.testing.assert_allclose(curve(np.array([1, 2, 3])), [5, 3.5, 2])
            with open(path, "w", encoding="utf-8") as file:
                file.write("minor [1],major [1]\n1,2\n")
            with self.assertRaises(ResultsError) as caught:
                limit_curve.stress_curve(path, "MPa")
            self.assertIn("no column stress_minor, stress_major, but minor, major",
                          str(caught.exception))

    def test_layers(self):
        values = np.arange(6.0)[:, None]
        self.assertEqual([fld.layer_of(values, layer)[0] for layer in fld.LAYERS], [2.5, 5, 0])
        self.assertEqual(fld.layer_of(values[:5], "middle")[0], 2)


def u_section(theta_1, theta_2, radius=5.0, wall_radius=np.inf):
    """Half a U-section: bottom of 25, wall of 60 and flange of 40 mm with corners in between."""
    pieces, at, direction = [], np.zeros(2), 0.0
    parts = ((25.0, 0.0), (None, np.radians(180 - theta_1)), (60.0, 60.0 / wall_radius),
             (None, -np.radians(180 - theta_2)), (40.0, 0.0))
    for length, turn in parts:
        length = abs(turn) * radius if length is None else length
        s = np.linspace(0, length, 200)[1:]
        angle = direction + turn * s / length
        steps = np.diff(np.concatenate([[0], s]))
        middle = angle - 0.5 * turn * steps / length
        points = at + np.cumsum(np.column_stack([np.cos(middle), np.sin(middle)])
                                * steps[:, None], axis=0)
        pieces.append(points)
        at, direction = points[-1], direction + turn
    return np.concatenate(pieces)


class TestSpringback(unittest.TestCase):
    def angles(self, line):
        parts = springback.straight_parts(line, 30.0, 8.0)
        self.assertEqual(len(parts), 3)
        fits = [springback.fitted(line[part]) for part in parts]
        return [180 - abs(springback.turn_between(a, b)) for a, b in zip(fits, fits[1:])], fits

    def test_angles_of_a_u_section(self):
        for theta in ((90.0, 90.0), (101.3, 77.2), (85.0, 95.0)):
            for turn in (0.0, 2.0):
                line = u_section(*theta)
                line = line @ np.array([[np.cos(turn), np.sin(turn)],
                                        [-np.sin(turn), np.cos(turn)]])
                np.testing.assert_allclose(self.angles(line)[0], theta, atol=0.02)

    def test_curl_of_the_wall(self):
        angles, fits = self.angles(u_section(95.0, 85.0, wall_radius=200.0))
        self.assertAlmostEqual(fits[1]["radius"], 200, delta=0.5)
        self.assertGreater(fits[0]["radius"], 1e5)
        # the chord of the wall goes half its turn beyond its beginning
        half = np.degrees(0.5 * 60 / 200)
        np.testing.assert_allclose(angles, [95 - half, 85 + half], atol=0.05)

    def test_an_angle_that_opens_beyond_a_straight_line(self):
        for formed, released, angles in (([9.0], [-4.0], [184.0]), ([-9.0], [4.0], [184.0]),
                                         ([9.0], [4.0], [176.0]), ([179.0], [-179.0], [-1.0])):
            states = [SimpleNamespace(turns=turns) for turns in (formed, released)]
            np.testing.assert_allclose(springback.angles_of(states[1], states[0]), angles)

    def test_stretches_by_coordinates(self):
        start = np.linspace(0, 10, 11)
        np.testing.assert_array_equal(springback.by_start(start, 4.0, 2.0), [2, 3, 4])
        self.assertRaises(ResultsError, springback.by_start, start, 20.0, 30.0)


class TestForce(unittest.TestCase):
    class Histories:
        tools = ["punch"]

        def tool_history(self, tool, name):
            t = np.linspace(0, 1, 11)[:, None]
            if name == "displacement":
                return t * [0, -3, 4]
            return t * [50, 6, -8]

    def test_force_against_the_stroke(self):
        stroke, load = force.stroke_and_force(self.Histories(), "punch")
        self.assertAlmostEqual(stroke[-1], 5)
        self.assertAlmostEqual(load[-1], 10)

    def test_unknown_tools_are_refused(self):
        with contextlib.redirect_stdout(io.StringIO()):
            self.assertRaises(ResultsError, force.chosen, self.Histories(),
                              argparse.Namespace(tool=["die"]))


class TestEaring(unittest.TestCase):
    @staticmethod
    def wave(n, angles, least=0.0):
        """A rim of `n` ears, the first of them at `least` degrees."""
        return 30 + np.cos(np.radians(n * (angles - least)))

    def test_ears_are_counted(self):
        quarter, whole = np.arange(0, 90.1), np.arange(0, 360.0)
        for angles in (quarter, whole, whole - 180):
            for n, least in ((4, 0.0), (4, 45.0), (8, 0.0)):
                profile = earing.Profile("cup", angles, self.wave(n, angles, least))
                self.assertEqual(profile.ears(), n)
                self.assertAlmostEqual(profile.earing, 2, delta=0.02)
                self.assertAlmostEqual(profile.at(least), 31, delta=0.02)
        # Ears at 0, 50, 130, 180, 230, 310 degrees; a bump of 4 % of the earing is none.
        heights = np.interp(quarter, [0, 15, 50, 84, 90], [41, 40, 46, 40, 40.24])
        self.assertEqual(earing.Profile("cup", quarter, heights).ears(), 6)
        self.assertRaises(ResultsError, earing.Profile, "cup", quarter[:60], heights[:60])

    def test_a_half_cup_has_two_quarters(self):
        angles = np.arange(-90, 90.1) % 360
        profile = earing.Profile("cup", angles, self.wave(4, angles))
        np.testing.assert_allclose(profile.at([0, 45, 90]), [31, 29, 31], atol=0.01)

    def test_the_mean_of_the_quarters_counts(self):
        angles = np.arange(0, 360, 1.0)
        tilted = self.wave(4, angles) + 0.3 * np.cos(np.radians(angles - 20))
        np.testing.assert_allclose(earing.Profile("cup", angles, tilted).at([0, 45, 90]),
                                   [31, 29, 31], atol=0.01)

    def test_the_rim_above_the_lowest_place(self):
        deck = os.path.join(PROJECT, "input", "disk_punch.key")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "disk.h5")
            subprocess.run([IGAFORM, deck, "--quiet", "--threads", "1", "--out", path, "--set",
                            "n=2", "--set", "element=SHELL"], check=True, capture_output=True)
            with Results(path) as results:
                angles, heights = earing.rim_of(results)
        self.assertGreater(np.ptp(angles), 350)
        # The clamped edge stays; the ball has pushed the middle of the lower face down by 10 mm.
        np.testing.assert_allclose(heights, heights.mean(), atol=1e-9)
        self.assertAlmostEqual(heights.mean(), 10.5, delta=0.5)

    def test_tables_that_hold_no_heights_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "rim.csv")
            self.assertRaises(ResultsError, earing.table_of, path)
            for text in ("angle, height\n0, 1\n", "0\n45\n90\n"):
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
                self.assertRaises(ResultsError, earing.table_of, path)
            with open(path, "w", encoding="utf-8") as file:
                file.write("# source\nangle [degrees], height [mm]\n0, 1\n45, 2\n90, 1\n")
            np.testing.assert_array_equal(earing.table_of(path)[1], [1, 2, 1])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
