"""The set-up of a deck as a picture and a page: gaps, first contact, sides, layout, script.

Usage: test_setup.py IGAFORM PROJECT_FOLDER
"""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

IGAFORM, PROJECT = (os.path.abspath(path) for path in sys.argv[1:3])
sys.path.insert(0, PROJECT)

import many_surfaces  # noqa: E402
from drawn import inside  # noqa: E402
from post import setup_picture  # noqa: E402
from post.cells import triangles_of  # noqa: E402
from post.deck import Deck  # noqa: E402
from post.drives import drives_of, first_drive, time_of, way_to_contact  # noqa: E402
from post.results import Results  # noqa: E402
from post.scene import Part  # noqa: E402
from post.setup import Facts  # noqa: E402
from post.style import plt  # noqa: E402

# A browser's part, as far as the script calls it without being asked for an answer.
BROWSER = """
const any = new Proxy(function () {}, {
  get: (_, name) => name === Symbol.toPrimitive ? () => 1 : any, set: () => true,
  apply: () => any});
const canvas = () => ({parentElement: {clientWidth: 800, clientHeight: 600}, getContext: () => any,
                       addEventListener: () => {}, append: () => {}, style: {}, width: 0});
globalThis.window = {};
globalThis.document = {getElementById: canvas, createElement: canvas};
"""
PLACES = "console.log(JSON.stringify(data.parts[0].points.slice(0, 3)), JSON.stringify(" \
         "axesOf(start)));"


class TestSetup(unittest.TestCase):
    """The punch of the deck of many surfaces, with a gap of 0.5 mm."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.deck = os.path.join(cls.folder.name, "many.key")
        with open(cls.deck, "w", encoding="utf-8") as file:
            file.write(many_surfaces.deck(12).replace("\n-5, -5, 1\n", "\n-5, -5, 1.5\n"))
        cls.png, cls.start = (os.path.join(cls.folder.name, name) for name in ("many-setup.png",
                                                                               "s.h5"))
        cls.done = subprocess.run([sys.executable, "-m", "post", "setup", cls.deck, "--igaform",
                                   IGAFORM], cwd=PROJECT, capture_output=True, text=True,
                                  check=False)
        subprocess.run([IGAFORM, cls.deck, "--check", "--start", "--out", cls.start],
                       check=True, capture_output=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_gap_first_contact_and_sides(self):
        with Results(self.start) as results:
            facts = Facts(results, "mass             1.0\n", "a:1: warning: b\nc:2: error: d\n"
                          "1 error, 1 warning\n")
            self.assertEqual(facts.findings, [("error", "c:2: error: d"),
                                              ("warning", "a:1: warning: b")])
            die, punch = facts.tools
            self.assertEqual((results.side("die"), results.side("punch")), (1, -1))
            self.assertEqual(facts.run, ["mass 1.0", "warnings of --check: 1"])
            self.assertIn("60 x 60 x 1 mm", facts.blank[0])
            self.assertIn("touches the blank at the start", die.words)
            self.assertAlmostEqual(punch.way, 0.5)
            self.assertAlmostEqual(punch.place[2], 1)
            self.assertIn("5e-05 s", " ".join(punch.words))
            figure = setup_picture.draw(results, facts, self.folder.name)
        self.check_layout(figure)

    def check_layout(self, figure):
        """Texts are clear of the drawn parts and of each other."""
        figure.canvas.draw()
        renderer = figure.canvas.get_renderer()
        boxes = [text.get_window_extent(renderer).extents for text in figure.texts]
        boxes.append(figure.legends[0].get_window_extent(renderer).extents)
        for axes in figure.axes:
            if axes.get_label() != "scene":
                continue
            image = axes.images[0].get_array()
            self.assertGreater(np.mean(image < 250), 0.1)
            rows, columns = (np.flatnonzero(np.any(image < 250, axis=across))
                             for across in ((1, 2), (0, 2)))
            box = axes.get_window_extent()
            width, height = box.width / image.shape[1], box.height / image.shape[0]
            boxes.append((box.x0 + width * columns[0], box.y1 - height * rows[-1],
                          box.x0 + width * columns[-1], box.y1 - height * rows[0]))
            self.check_names(axes, renderer, lambda name, box=box, width=width, height=height,
                             image=image: image[
                round((box.y1 - name.y1) / height):round((box.y1 - name.y0) / height),
                round((name.x0 - box.x0) / width):round((name.x1 - box.x0) / width)].min() > 250)
        [section] = [axes for axes in figure.axes if axes.get_title(loc="left")]
        ends = np.concatenate([lines.get_transform().transform(segment)
                               for lines in section.collections
                               for segment in lines.get_segments()])
        self.check_names(section, renderer, lambda name: not inside(ends, name))
        for i, a in enumerate(boxes):
            self.assertTrue(min(a[:2]) >= 0 and a[2] <= figure.bbox.x1 and a[3] <= figure.bbox.y1)
            for b in boxes[:i]:
                self.assertFalse(a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3],
                                 (a, b))
        plt.close(figure)

    def check_names(self, axes, renderer, is_clear):
        """The names of arrows lie on nothing that is drawn."""
        names = [text.get_window_extent(renderer) for text in axes.texts if text.get_text()]
        self.assertEqual(len(names), 1)
        for name in names:
            self.assertTrue(is_clear(name), name)

    def test_a_set_up_with_errors_is_drawn(self):
        deck = os.path.join(PROJECT, "tests/verification/bad_decks/wrong_side.key")
        png = os.path.join(self.folder.name, "wrong.png")
        done = subprocess.run([sys.executable, "-m", "post", "setup", deck, "--igaform", IGAFORM,
                               "--out", png], cwd=PROJECT, capture_output=True, text=True,
                              check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("wrong_side.key:8: error: *CONTACT PAIR", done.stderr)
        self.assertTrue(os.path.exists(png))
        with open(png.replace(".png", ".html"), encoding="utf-8") as file:
            self.assertRegex(file.read(), '<p class="finding error">.*wrong_side.key:8: error:')

    def test_picture_and_page_are_written(self):
        self.assertEqual(self.done.returncode, 0, self.done.stderr)
        self.assertGreater(len(np.unique(plt.imread(self.png)[::7, ::7, :3].reshape(-1, 3),
                                         axis=0)), 20)
        with open(self.png.replace(".png", ".html"), encoding="utf-8") as file:
            text = file.read()
        for word in ("http:", "https:", "src=", "@"):
            self.assertNotIn(word, text)
        data = json.loads(re.search(r"^const data = (.*);$", text, re.MULTILINE)[1])
        self.assertEqual([part["name"] for part in data["parts"]], ["blank", "die", "punch"])
        self.assertEqual([arrow["name"] for arrow in data["arrows"]], ["punch"])
        for part in data["parts"]:
            self.assertLess(max(part["triangles"]), len(part["points"]) / 3)
        punch = np.reshape(data["parts"][2]["points"], (-1, 3))[data["parts"][2]["triangles"][:3]]
        self.assertLess(np.cross(punch[1] - punch[0], punch[2] - punch[0])[2], 0)

    @unittest.skipIf(shutil.which("node") is None, "node is not installed")
    def test_the_script_runs(self):
        with open(self.png.replace(".png", ".html"), encoding="utf-8") as file:
            script = re.search(r"<script>(.*)</script>", file.read(), re.DOTALL)[1]
        path = os.path.join(self.folder.name, "page.js")
        with open(path, "w", encoding="utf-8") as file:
            file.write(BROWSER + script + PLACES)
        done = subprocess.run(["node", path], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        with Results(self.start) as results:
            view = setup_picture.view_of(results)
        np.testing.assert_allclose(json.loads(done.stdout.split(" ")[1]),
                                   [view.right, view.up, view.to_eye], atol=1e-12)

    def test_errors_of_a_deck_are_passed_on(self):
        done = subprocess.run([sys.executable, "-m", "post", "setup", "missing.key", "--igaform",
                               IGAFORM], cwd=PROJECT, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("missing.key", done.stderr)
        self.assertFalse(os.path.exists(os.path.join(PROJECT, "missing-setup.png")))
        self.assertNotIn("Traceback", done.stderr)


def square(size, height):
    """A square of two triangles."""
    points = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * size
    return Part("square", points + [0, 0, height], triangles_of(np.array([[0, 1, 2, 3]])))


class TestFirstContact(unittest.TestCase):
    def test_ways(self):
        sheet, tool = square(2.0, 0.0), square(1.0, 3.0)
        way, place = way_to_contact(tool, sheet, np.array([0.0, 0, -5]), 0.1)
        self.assertAlmostEqual(way, 3)
        self.assertAlmostEqual(place[2], 0)
        way, place = way_to_contact(tool, sheet, np.array([3.0, 0, -3]), 0.1)
        self.assertAlmostEqual(way, 3 * np.sqrt(2))
        self.assertAlmostEqual(place[0], 2)
        self.assertIsNone(way_to_contact(tool, sheet, np.array([1.0, 0, 0]), 0.1))
        self.assertIsNone(way_to_contact(tool, sheet, np.array([0.0, 0, 1]), 0.1))

    def test_times_along_amplitudes(self):
        for words, time in (("", 0.3), (", AMPLITUDE=ramp", 0.8), (", AMPLITUDE=smooth", 0.8)):
            deck = Deck("*AMPLITUDE, NAME=ramp\n0, 0, 1, 1\n*AMPLITUDE, NAME=smooth, "
                        "DEFINITION=SMOOTH STEP\n0, 0, 1, 1\n*TOOL MOTION, TOOL=t" + words
                        + "\n0, 0, -10\n*DYNAMIC, EXPLICIT\n, 2\n")
            drive = first_drive(drives_of(deck), "T")
            way = {"": 3, ", AMPLITUDE=ramp": 3.2}.get(words, 10 * (2.5 * 0.8**4 - 3 * 0.8**5
                                                                      + 0.8**6))
            self.assertAlmostEqual(time_of(deck, drive, way), time, delta=1e-3)
        self.assertIsNone(time_of(deck, drive, 100))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
