"""Pictures of forming that one may show: drawn, readable, and what they say.

Usage: test_forming_pictures.py IGAFORM PROJECT_FOLDER
"""
import argparse
import base64
import contextlib
import html.parser
import io
import os
import re
import subprocess
import sys
import tempfile
import unittest
from types import SimpleNamespace

import numpy as np

IGAFORM, PROJECT = (os.path.abspath(path) for path in sys.argv[1:3])
sys.path[:0] = [PROJECT, os.path.dirname(os.path.abspath(__file__))]

import drawn  # noqa: E402
from post import draw_in, fld, force, history, limit_curve, model  # noqa: E402
from post import profile, springback, steps, zones  # noqa: E402
from post.deck import Deck  # noqa: E402
from post.labels import Labels  # noqa: E402
from post.results import Results  # noqa: E402
from post.section import Section  # noqa: E402
from post.springback_picture import draw_corner  # noqa: E402
from post.style import plt  # noqa: E402

# Deck and settings of the two short runs that all tests share.
RUNS = {"bend": ("u_bend", {"stroke": 16, "speed": 20000, "release": "relaxed", "rest_energy": 0.5,
                            "rest_force": 0.5}),
        "box": ("square_box", {"elements": 8, "depth": 8, "speed": 40000, "frames": 3})}
FOLDER = tempfile.TemporaryDirectory()


def setUpModule():
    for name, (deck, settings) in RUNS.items():
        sets = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
        subprocess.run([IGAFORM, os.path.join(PROJECT, "input", deck + ".key"), "--threads", "1",
                        "--quiet", "--out", path_of(name), *sets], check=True, capture_output=True)


def tearDownModule():
    FOLDER.cleanup()


def path_of(name, ending=".h5"):
    return os.path.join(FOLDER.name, name + ending)


def post(*words):
    return subprocess.run([sys.executable, "-m", "post", *words], cwd=PROJECT, capture_output=True,
                          text=True, check=False)


class Pictures(unittest.TestCase):
    def assert_readable(self, figure):
        self.assertFalse(drawn.is_blank(figure))
        self.assertEqual(drawn.covering(figure), [])
        plt.close(figure)


class TestDeck(unittest.TestCase):
    """What the deck in the result says."""

    def test_steps_have_their_names_frames_and_samples(self):
        with Results(path_of("bend")) as results:
            draw, release = steps.steps_of(results)
            self.assertEqual((draw.title, release.title), ("step 1 draw", "step 2 release"))
            np.testing.assert_array_equal(draw.frames, np.arange(11))
            self.assertEqual(release.frames[0], 11)
            self.assertEqual(release.samples.start, draw.samples.stop - 1)
            last = len(results.times) - 1
            self.assertEqual(steps.frame_before_release(results, last), 10)
            self.assertIsNone(steps.frame_before_release(results, 10))

    def test_planes_of_symmetry_and_tools_by_force(self):
        for name, planes in (("bend", {"X": "X_MIN"}), ("box", {"X": "X_MIN", "Y": "Y_MIN"})):
            with Results(path_of(name)) as results:
                self.assertEqual(model.symmetry_planes(results), planes)
                self.assertEqual(model.tools_by_force(results), {"holder"})


class TestHistory(Pictures):
    def test_a_column_for_each_step(self):
        for name, titles in (("bend", ["step 1 draw", "step 2 release"]), ("box", [""])):
            with Results(path_of(name)) as results:
                figure = history.draw(results)
            self.assertEqual([axis.get_title() for axis in figure.axes[:len(titles)]], titles)
            self.assert_readable(figure)


class TestProfile(Pictures):
    def test_the_sheet_fills_the_panels_and_removed_tools_are_away(self):
        with Results(path_of("bend")) as results:
            figure = profile.draw(Section(results), [5, 10, 11])
        formed, released = figure.axes[1:3]
        self.assertEqual([len(axis.collections) for axis in (formed, released)], [3, 0])
        self.assertLess(np.ptp(formed.get_xlim()), 1.2 * 175)
        self.assert_readable(figure)


class TestSpringback(Pictures):
    def measured(self, **options):
        words = argparse.Namespace(**{"frame": None, "time": None, "stretch": None, "radius": None,
                                      "shortest": None, "section": None} | options)
        said = io.StringIO()
        with Results(path_of("bend")) as results, contextlib.redirect_stdout(said):
            return springback.measured(results, words), said.getvalue()

    def test_formed_and_released_in_one_picture(self):
        figure, said = self.measured(stretch=[(2, 18), (32, 36), (60, 170)])
        self.assertRegex(said, r"stretches 1 and 2: \S+ degrees formed, \S+ degrees released, "
                               r"springback [+-]")
        place = re.search(r"section at z = (\S+) mm of the sheet at the start, point \((.*)\), "
                          r"normal \(0, 0, 1\)", said)
        self.assertEqual(place[1], place[2].split(", ")[2])
        self.assertIn(f"section at z = {place[1]} mm", figure.axes[0].get_title())
        names = [text.get_text() for text in figure.axes[0].texts]
        self.assertTrue(names[0].startswith("angle 1: ") and "→" in names[0], names)
        self.assert_readable(figure)

    def test_nearly_straight_and_beyond(self):
        a, b = ({"middle": np.array(middle), "along": np.array(along), "length": 20.0,
                 "radius": np.inf, "direction": 0.0} for middle, along in
                (((0.0, 0.0), (1.0, 0.0)), ((90.0, 4.5), (np.cos(0.15), np.sin(0.15)))))
        figure, axis = plt.subplots()
        state = SimpleNamespace(fits=[a, b], angles=[178.0])
        self.assertEqual(len(draw_corner(axis, state, 0, 5.0)[2]), 2)
        state.angles = [180 + np.degrees(0.15)]
        place, _, drawn = draw_corner(axis, state, 0, 5.0)
        self.assertEqual(len(drawn), 3)
        self.assertLess(place[1], 0)          # the arc is on the side of the larger angle
        plt.close(figure)

    def test_a_frame_within_the_tools_stands_alone(self):
        figure, said = self.measured(frame=10)
        self.assertNotIn("springback", said)
        self.assert_readable(figure)


class TestZones(unittest.TestCase):
    """A limit of 0.4 everywhere, its margin 0.1, strong thickening above 0.1."""

    def setUp(self):
        self.borders = zones.Borders(lambda minor: np.full_like(minor, 0.4),
                                     argparse.Namespace(margin=0.1, thickening=0.1))

    def test_each_zone(self):
        for minor, major, zone in ((0.0, 0.41, "crack"), (0.1, 0.37, "marginal"),
                                   (0.1, 0.35, "safe"), (-0.3, 0.31, "safe"),
                                   (-0.3, 0.27, "wrinkle tendency"), (0.0, 0.0, "safe"),
                                   (-0.3, 0.2, "strong thickening"), (-0.7, 0.41, "crack")):
            found = self.borders.zone(np.array([minor]), np.array([major]))[0]
            self.assertEqual(zones.ZONES[found].name, zone, (minor, major))

    def test_without_a_limit_nothing_cracks(self):
        borders = zones.Borders(None, argparse.Namespace(margin=0.1, thickening=0.1))
        found = borders.zone(np.array([0.0, -0.1]), np.array([2.0, 0.02]))
        np.testing.assert_array_equal(found, [zones.NOT_JUDGED, zones.WRINKLE])

    def test_the_areas_of_the_diagram_are_those_of_the_points(self):
        x = np.linspace(-0.35, 0.3, 66)
        for zone, below, above in self.borders.lines(x, -0.1, 0.6):
            open_ = above - below > 1e-6
            middle = 0.5 * (below + above)
            np.testing.assert_array_equal(self.borders.zone(x, middle)[open_], zone)
        np.testing.assert_allclose(above, 0.6)


class TestFormingLimits(Pictures):
    def options(self, **changes):
        return argparse.Namespace(**{"layer": None, "curve": None, "exponent": 0.12,
                                     "thickness": None, "engineering": False, "margin": 0.1,
                                     "thickening": 0.05,
                                     "mirror": (0, 1)} | changes)

    def drawn(self, draw, **changes):
        options = self.options(**changes)
        with Results(path_of("box")) as results:
            frame = len(results.times) - 1
            borders = zones.Borders(limit_curve.limit_curve(options, results), options)
            return draw(results, frame, borders, options)

    def test_the_diagram_has_zones_both_faces_and_the_whole_limit(self):
        for changes in ({}, {"engineering": True}, {"exponent": None}, {"layer": ["middle"]}):
            figure = self.drawn(fld.draw, **changes)
            axis = figure.axes[0]
            names = axis.get_legend_handles_labels()[1]
            self.assertEqual("crack" in names, changes != {"exponent": None})
            faces = ["mid-surface"] if "layer" in changes else list(fld.LAYERS.values())[:0:-1]
            self.assertEqual([name for name in names if "face" in name], faces)
            for line in axis.lines:
                if line.get_label() == "forming limit":
                    x, y = line.get_data()
                    self.assertLess(y.max(), axis.get_ylim()[1])
                    np.testing.assert_allclose(x[[0, -1]], axis.get_xlim())
            self.assert_readable(figure)

    def test_the_map_shows_the_zones_that_occur(self):
        figure = self.drawn(fld.draw_map, exponent=0.02)
        part = figure.axes[0].images[0].get_array().astype(float) / 255
        self.assertGreater(drawn.inked(part), 0.2)
        names = [text.get_text() for text in figure.legends[0].get_texts()]
        self.assertIn("safe", names)
        self.assertIn("crack", names)
        reddish = np.mean((part[..., 0] > 1.6 * part[..., 1]) & (part[..., 0] > 0.3))
        self.assertGreater(reddish, 0.01)
        self.assert_readable(figure)


class TestForce(Pictures):
    def shown(self, name, **options):
        words = argparse.Namespace(**{"tool": None, "parts": None, "csv": None, "others": [],
                                      "measured": []} | options)
        said = io.StringIO()
        with Results(path_of(name)) as results, contextlib.redirect_stdout(said):
            return force.shown(results, words), said.getvalue()

    def test_full_and_modelled_part_are_named(self):
        for name, options, times in (("box", {}, 4), ("bend", {}, 2), ("bend", {"parts": 70}, 70)):
            figure, said = self.shown(name, **options)
            self.assertIn(f"full part: {times} x the modelled part", said)
            full, modelled = figure.axes[0], figure.axes[0].child_axes[0]
            figure.canvas.draw()
            self.assertIn("full part", full.get_ylabel())
            self.assertIn("modelled part", modelled.get_ylabel())
            np.testing.assert_allclose(full.get_ylim(), times * np.array(modelled.get_ylim()))
            self.assert_readable(figure)

    def test_a_tool_by_force_has_its_mean_and_band(self):
        figure, said = self.shown("box")
        mean = float(said.split("second half: mean ")[1].split()[0])
        self.assertAlmostEqual(mean, 19600, delta=1000)
        self.assertRegex(said, r"5 to 95 % \S+ N \(modelled \S+\) to ")
        self.assertEqual(len(figure.axes[0].collections), 1)
        self.assert_readable(figure)

    def test_other_results_and_measured_forces_lie_beside(self):
        table = path_of("measured", ".csv")
        with open(table, "w", encoding="utf-8") as file:
            file.write("# stroke, force\n0, 0\n10, 20000\n20, 45000\n")
        options = {"tool": ["punch"], "measured": [table]}
        figure, _ = self.shown("box", **options, others=[path_of("box")])
        own, other, points = figure.axes[0].lines
        np.testing.assert_array_equal(own.get_xydata(), other.get_xydata())
        np.testing.assert_array_equal(points.get_xydata(), [[0, 0], [10, 20000], [20, 45000]])
        self.assertEqual([text.get_text() for text in figure.legends[0].get_texts()],
                         ["box: punch", "box: punch", "measured"])
        self.assert_readable(figure)

    def test_forces_end_with_the_use_of_the_tools(self):
        with Results(path_of("bend")) as results:
            curves = [force.curve(results, name) for name in results.tools]
            samples = np.count_nonzero(results.history("process_step") == 1)
        for one in curves:
            self.assertEqual((one.along, len(one.load)), ("punch", samples))

    def test_the_width_that_a_reduction_left_out_counts(self):
        class Reduced:
            width_ratio = 5.0
            deck = Deck("** file strip.key\n*BOUNDARY\nX_MIN, XSYMM\n")
        part = force.Part(Reduced())
        self.assertEqual((part.times, part.of_file), (10, 2))
        part = force.Part(Reduced(), 20)
        self.assertEqual((part.times, part.of_file), (20, 4))

    def test_a_table_of_the_modelled_part(self):
        table = path_of("box", ".csv")
        figure, _ = self.shown("box", csv=table)
        plt.close(figure)
        with open(table, encoding="utf-8") as file:
            names, *rows = (line.rstrip().split(",") for line in file)
        self.assertEqual(names, ["punch stroke", "punch force", "holder stroke", "holder force"])
        self.assertAlmostEqual(float(rows[-1][0]), 8, delta=0.01)


class TestDrawIn(Pictures):
    def test_the_draw_in_stands_in_the_picture(self):
        with Results(path_of("box")) as results:
            outline = draw_in.Outline(results)
            figure = draw_in.draw(results, outline, [1, len(results.times) - 1], [0, 45, 90], "mm")
            moved = 75 - outline.radii(outline.at(len(results.times) - 1), [0])[0]
        texts = [text.get_text() for text in figure.axes[0].texts]
        self.assertEqual(texts[0], f"0°\n{moved:.2f} mm")
        self.assertEqual(len(texts), 3)
        self.assert_readable(figure)


class Page(html.parser.HTMLParser):
    """Headings, pictures and words of a page; its elements must be closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.headings, self.pictures, self.links, self.words = [], [], [], [], ""
        self.feed(text)
        assert not self.open, self.open

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag == "img":
            self.pictures.append(attributes["src"])
        elif tag != "meta":
            self.open.append(tag)
        self.links += [value for name, value in attributes.items()
                       if name in ("href", "src") and not value.startswith("data:")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag

    def handle_data(self, data):
        self.words += data
        if self.open and self.open[-1] in ("h1", "h2"):
            self.headings.append(data)


class TestReport(unittest.TestCase):
    """The page of the bent strip; the box is a quarter of a part, drawn by the slower VTK."""

    @classmethod
    def setUpClass(cls):
        out = path_of("bend", ".html")
        done = post("report", path_of("bend"), "-n", "0.25", "--parts", "70", "--section", "z=0",
                    "-o", out)
        assert done.returncode == 0, done.stderr
        with open(out, encoding="utf-8") as file:
            cls.page = Page(file.read())

    def test_it_is_whole_in_itself(self):
        self.assertEqual(self.page.links, [])
        self.assertEqual(len(self.page.pictures), 5)
        for picture in self.page.pictures:
            data = base64.b64decode(picture.removeprefix("data:image/png;base64,"))
            self.assertGreater(drawn.inked(plt.imread(io.BytesIO(data))), 0.01)

    def test_it_tells_set_up_steps_warnings_and_results(self):
        for heading in ("Set-up", "Quality", "Warnings of the run", "Section", "Forming limits",
                        "Forces of the tools", "Energies", "Springback", "Deck"):
            self.assertIn(heading, self.page.headings)
        for words in ("u_bend.key", "115 elements", "step 1 draw", "step 2 release", "by force",
                      "warning: with masses scaled", "% of the largest energy, at",
                      "70 x the modelled part", "degrees released",
                      "post profile --section=z=0.0", "section at z = 0 mm",
                      "*BLANK, NAME=sheet"):
            self.assertIn(words, self.page.words)
        self.assertNotIn("not drawn", self.page.words)

    def test_a_place_that_cannot_be_written(self):
        done = post("report", path_of("bend"), "-o", os.path.join(FOLDER.name, "no", "x.html"))
        self.assertEqual(done.returncode, 1)
        self.assertNotIn("Traceback", done.stderr)


class TestLabels(Pictures):
    def test_labels_leave_lines_and_each_other_free(self):
        figure, axis = plt.subplots(figsize=(5, 4))
        x = np.linspace(0, 10, 400)
        line = np.column_stack([x, np.sin(4 * x)])
        axis.plot(*line.T)
        axis.set(ylim=(-3, 3))
        labels = Labels(axis, [line])
        for place in line[::80]:
            labels.put("a long label", place, (1.0, 0.2))
        self.assert_readable(figure)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
