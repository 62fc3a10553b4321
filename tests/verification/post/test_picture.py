"""Pictures of a result: layout, view, colours, images of a half, tools that a step removes.

Usage: test_picture.py IGAFORM PROJECT_FOLDER
"""
import argparse
import os
import resource
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from PIL import Image

IGAFORM, PROJECT = (os.path.abspath(path) for path in sys.argv[1:3])
sys.path.insert(0, PROJECT)

import many_surfaces  # noqa: E402
from post import bands, cells, mirror, picture, scene  # noqa: E402
from post.deck import Deck, number  # noqa: E402
from post.results import Results, ResultsError  # noqa: E402
from post.section import Section  # noqa: E402
from post.section_line import start_at  # noqa: E402
from post.springback import straight_parts  # noqa: E402
from post.style import plt  # noqa: E402
from post.view import View  # noqa: E402


def boxes_of_text(figure):
    """Where all text, the names and the scale are, in pixels of the figure."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    parts = [text for text in figure.texts if text.get_text()] + figure.legends
    parts += [axes for axes in figure.axes if axes.get_label() != "scene"]
    return [part.get_tightbbox(renderer) for part in parts]


def drawn_box(figure):
    """Where the scene has other pixels than white ones."""
    [scene] = [axes for axes in figure.axes if axes.get_label() == "scene"]
    image = scene.images[0].get_array()
    rows, columns = (np.flatnonzero(np.any(image < 250, axis=axes)) for axes in ((1, 2), (0, 2)))
    box = scene.get_window_extent()
    width, height = box.width / image.shape[1], box.height / image.shape[0]
    return (box.x0 + width * columns[0], box.y1 - height * rows[-1],
            box.x0 + width * columns[-1], box.y1 - height * rows[0])


class TestPicture(unittest.TestCase):
    """Half of a sheet between a punch, which a second step removes, and a die of 65 surfaces."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.deck, cls.path = (os.path.join(cls.folder.name, f"many.{end}") for end in ("key", "h5"))
        many_surfaces.main(cls.deck)
        subprocess.run([IGAFORM, cls.deck, "--quiet", "--threads", "1", "--out", cls.path],
                       check=True, capture_output=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def post(self, *arguments):
        return subprocess.run([sys.executable, "-m", "post", *arguments], cwd=PROJECT,
                              capture_output=True, text=True, check=False)

    def figure(self, *options):
        parser = argparse.ArgumentParser()
        picture.add_arguments(parser)
        arguments = parser.parse_args(["--renderer", "matplotlib", *options])
        arguments.file = self.path
        with Results(self.path) as results:
            frame = results.frame(arguments.frame, arguments.time)
            job, contents = picture.new_job(results, [frame], arguments)
            [image] = picture.images_of(results, job, arguments.renderer, self.folder.name)
            return picture.finished(results, job, contents[0], image), contents[0]

    def test_text_is_clear_of_the_part_and_of_other_text(self):
        for options in (["--frame", "2"], ["--frame", "2", "--field", "mises", "--mirror", "X"]):
            figure, _ = self.figure(*options)
            part = drawn_box(figure)
            self.assertGreater((part[2] - part[0]) * (part[3] - part[1]), 1e5)
            boxes = [part, *(box.extents for box in boxes_of_text(figure))]
            self.assertGreaterEqual(len(boxes), 5)
            for i, a in enumerate(boxes):
                self.assertTrue(min(a[:2]) >= 0 and a[2] <= figure.bbox.x1
                                and a[3] <= figure.bbox.y1, a)
                for b in boxes[:i]:
                    self.assertFalse(a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3],
                                     (a, b))
            plt.close(figure)

    def test_tools_that_a_step_has_removed_are_not_drawn(self):
        for frame, names in ((2, ["die", "punch"]), (-1, ["die"])):
            figure, contents = self.figure("--frame", str(frame))
            self.assertEqual([name for name, _ in contents.tools], names)
            plt.close(figure)

    def test_a_half_is_completed(self):
        whole = self.figure("--mirror", "X")[1].box
        half = self.figure()[1].box
        self.assertGreater(np.ptp(whole, axis=0)[0], 1.5 * np.ptp(half, axis=0)[0])
        with Results(self.path) as results:
            self.assertEqual(mirror.planes_of(results, (0,)), [(0, 0.0)])
            self.assertEqual(mirror.planes_of(results, (1,)), [(1, 0.0)])
            results.deck.records = Deck("*BOUNDARY\nX_MAX, XSYMM\n").records
            [(_, place)] = mirror.planes_of(results, (0,))
            self.assertAlmostEqual(place, 60)
        self.assertIn("XY", self.post("picture", self.path, "--mirror", "XX").stderr)

    def test_65_surfaces_take_less_than_ten_seconds(self):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = self.post("picture", self.path, "--frame", "2")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, "")
        self.assertLess(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 10)
        image = plt.imread(self.path.replace(".h5", "-picture.png"))[..., :3]
        colours = len(np.unique((image[::5, ::5] * 31).astype(int).reshape(-1, 3), axis=0))
        self.assertGreater(colours, 20)

    def test_components_and_principal_values(self):
        with Results(self.path) as results:
            [patch] = results.patches
            tensor = patch.field("stress", 2)
            self.assertGreater(np.abs(tensor).max(), 1)
            for place, pair in enumerate(("xx", "yy", "zz", "xy", "yz", "xz")):
                np.testing.assert_array_equal(patch.field(f"stress_{pair}", 2)[..., 0],
                                              tensor[..., place])
            least, middle, largest = (patch.field(f"stress_{name}", 2)[..., 0]
                                      for name in ("min", "mid", "max"))
            np.testing.assert_allclose(least + middle + largest, tensor[..., :3].sum(axis=-1),
                                       atol=1e-9 * np.abs(tensor).max())
            mises = np.sqrt(0.5 * ((least - middle)**2 + (middle - largest)**2
                                   + (largest - least)**2))
            self.assertLess((mises - patch.field("mises", 2)[..., 0]).max(), 1e-6 * mises.max())
            np.testing.assert_array_equal(patch.field("displacement_z", 2)[..., 0],
                                          patch.field("displacement", 2)[..., 2])
            self.assertEqual(picture.label_of(results, "stress_max"),
                             "largest principal stress [MPa]")
        for field, words in (("stress", "stress_xx"), ("thickening", "stress_min"),
                             ("wear", "FIELDS=WEAR")):
            with self.assertRaisesRegex(ResultsError, words):
                self.figure("--field", field)
        plt.close(self.figure("--field", "stress_xz")[0])

    def test_a_film_keeps_view_and_colours(self):
        out = os.path.join(self.folder.name, "film.gif")
        done = self.post("movie", self.path, "--out", out, "--renderer", "matplotlib", "--field",
                         "mises")
        self.assertEqual(done.returncode, 0, done.stderr)
        with Image.open(out) as film:
            self.assertEqual(film.n_frames, 4)
            shots = []
            for frame in range(4):
                film.seek(frame)
                shots.append(np.asarray(film.convert("RGB")).astype(int))
        column = shots[0].shape[1] - 300                # with the numbers of the colour scale
        for shot in shots[1:]:
            self.assertLess(np.abs(shot - shots[0])[300:, column:].max(), 60)
        self.assertGreater(np.abs(shots[2] - shots[0])[:, :column].max(), 100)
        done = self.post("movie", self.path, "--out", out.replace(".gif", ".avi"))
        self.assertEqual(done.returncode, 1)
        self.assertIn(".mp4", done.stderr)


class TestBands(unittest.TestCase):
    def test_steps_are_round_and_8_to_12(self):
        for low, high in ((0, 0.32), (0, 7), (-0.289, 0.13), (200, 1234), (0.77, 0.79), (0, 1e-7),
                          (5, 5), (0, 0), (-3e6, -1e6)):
            levels = bands.round_levels(low, high)
            self.assertTrue(8 <= len(levels) - 1 <= 12)
            step = levels[1] - levels[0]
            self.assertIn(round(step / 10**np.floor(np.log10(step * 1.001)), 6), (1, 2, 2.5, 5))
            self.assertLessEqual(levels[0], low + 1e-5 * step)
            self.assertGreaterEqual(levels[-1], high - 1e-5 * step)
            self.assertEqual(len(set(bands.level_texts(levels))), len(levels))


class TestView(unittest.TestCase):
    def test_up_is_up(self):
        for axis in range(3):
            view = View(axis)
            right, up, towards = view.project(np.eye(3)[axis])
            self.assertAlmostEqual(right, 0)
            self.assertGreater(up, 0.5)
            self.assertGreater(towards, 0)
            np.testing.assert_allclose(np.cross(view.right, view.up), view.to_eye)


class TestClip(unittest.TestCase):
    def test_the_area_on_one_side_stays(self):
        points = np.array([[-1.0, 0, 0], [3, 0, 0], [3, 2, 0], [-1, 2, 0]])
        triangles = cells.triangles_of(np.array([[0, 1, 2, 3]]))
        for place, side, area in ((0, 1, 6), (0, -1, 2), (1.5, 1, 3), (5, 1, 0), (-1, 1, 8)):
            kept, corners = cells.clip(points, triangles, side * (points[:, 0] - place))
            ends = kept[corners]
            normals = np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0])[:, 2]
            self.assertAlmostEqual(0.5 * normals.sum(), area)
            self.assertTrue(np.all(normals >= 0))
            self.assertTrue(np.all(side * (ends[..., 0] - place) > -1e-9))


    def test_what_only_touches_is_left_out(self):
        points = np.array([[0.0, 0, 0], [-1, 0, 0], [0, 1, 0], [-1, 1, 0]])
        triangles = cells.triangles_of(np.array([[0, 2, 3, 1]]))
        self.assertEqual(len(cells.clip(points, triangles, points[:, 0])[1]), 0)


QUARTER = """*UNITS
mm, t, s, N, MPa, mJ
*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
207000, 0.3
*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, ELEMENT=SHELL
x, 0, 55, 2, 14
y, 0, 55, 2, 14
z, 0, 1, 2, 1
*BLANK OUTLINE
START, 0, 0
LINE, 50, 0
ARC, 35.35533906, 35.35533906, 0, 50
CIRCLE, 24, 24, 6.5
*BOUNDARY
X_MIN, XSYMM
Y_MIN, YSYMM
*STEP
*DYNAMIC
1e-5
*END STEP
"""


class TestOutline(unittest.TestCase):
    """A quarter of a disk of radius 50 with a round hole."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = cls.started("disk", QUARTER)

    @classmethod
    def started(cls, name, text):
        """The path of a result file with the start of a deck."""
        deck, path = (os.path.join(cls.folder.name, f"{name}.{end}") for end in ("key", "h5"))
        with open(deck, "w", encoding="utf-8") as file:
            file.write(text)
        subprocess.run([IGAFORM, deck, "--check", "--start", "--out", path], check=True,
                       capture_output=True)
        return path

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def scene(self, planes=()):
        with Results(self.path) as results:
            return picture.scene_of(results, 0, {"field": "thickness", "tool": None,
                                                 "planes": planes})

    @staticmethod
    def off_curves(points):
        """Distance of points from the outline and from the hole."""
        return np.minimum(np.abs(np.linalg.norm(points[:, :2], axis=1) - 50),
                          np.abs(np.linalg.norm(points[:, :2] - 24, axis=1) - 6.5))

    def test_the_border_lies_on_the_curves(self):
        with Results(self.path) as results:
            *_, (points, _) = scene.skin_of(results.patches[0], 0, "thickness", 8)
        self.assertGreater(len(points), 1000)
        self.assertLess(self.off_curves(points).max(), 0.03)

    def test_faces_border_and_images_close(self):
        part = scene.welded(self.scene(((0, 0.0), (1, 0.0))).sheet)
        ends = np.sort(np.concatenate([part.triangles[:, pair] for pair in ([0, 1], [1, 2],
                                                                            [2, 0])]), axis=1)
        _, counts = np.unique(ends, axis=0, return_counts=True)
        self.assertEqual(set(counts), {2})

    def test_lines_between_elements_reach_the_curves(self):
        lines = np.concatenate([part.reshape(-1, 2, 3) for part in self.scene().lines])
        for row in range(13):
            y = 55 / 14 * row
            own = lines[np.all(np.abs(lines[..., 1] - y) < 1e-9, axis=1)
                        & np.all(np.abs(lines[..., 2] - 1) < 1e-9, axis=1), :, 0]
            self.assertAlmostEqual(own.max(), np.sqrt(50**2 - y**2), delta=0.1)
            hole = 2 * np.sqrt(max(6.5**2 - (y - 24)**2, 0))
            self.assertAlmostEqual(np.abs(own[:, 1] - own[:, 0]).sum(), own.max() - hole, delta=0.2)


    def test_integration_points_have_the_moments_of_the_sheet(self):
        with Results(self.path) as results:
            x, y = results.points("reference_position").reshape(-1, 3)[:, :2].T
            volume = results.points("reference_volume").ravel()
        hole = np.pi * 6.5**2
        for weight, moment in (
                (1, np.pi * 50**2 / 4 - hole), (x, 50**3 / 3 - 24 * hole),
                (y, 50**3 / 3 - 24 * hole),
                (x**2, np.pi * 50**4 / 16 - hole * (6.5**2 / 4 + 24**2)),
                (y**2, np.pi * 50**4 / 16 - hole * (6.5**2 / 4 + 24**2)),
                (x * y, 50**4 / 8 - hole * 24**2)):
            np.testing.assert_allclose((weight * volume).sum(), moment, rtol=3e-8)

    def test_sections_end_at_the_curves(self):
        with Results(self.path) as results:
            for axis, name in ((1, "y"), (0, "x")):
                cut = Section(results, (axis, 24.0))
                # of both pieces beside the hole the longer one
                np.testing.assert_allclose(cut.start[[0, -1]], [0, 17.5], atol=0.03)
                self.assertIn(f"section at {name} = 24 mm", cut.place)
            self.assertEqual(Section(results).name, "section at y = 27.5 mm")
            np.testing.assert_allclose(Section(results, (1, 0.0)).start[[0, -1]], [0, 50],
                                       atol=0.03)
            for axis, value in ((1, 70.0), (2, 0.5)):
                self.assertRaisesRegex(ResultsError, "cuts no line", Section, results,
                                       (axis, value))
            self.assertRaisesRegex(ResultsError, "leave nothing of the sheet at the plane y = 52",
                                   Section, results, (1, 52.0))
        self.assertIn("'y:3' is no plane", TestPicture.post(self, "profile", self.path,
                                                           "--section", "y:3").stderr)

    def test_the_default_section_of_nothing_asks_for_a_plane(self):
        path = self.started("small", QUARTER.replace("LINE, 50", "LINE, 25").replace(
            "ARC, 35.35533906, 35.35533906, 0, 50\nCIRCLE, 24, 24, 6.5", "LINE, 0, 25"))
        with Results(path) as results:
            self.assertRaisesRegex(ResultsError, "in its middle .*--section", Section, results)
            np.testing.assert_allclose(Section(results, (1, 5.0)).start[[0, -1]], [0, 20],
                                       atol=0.03)

    def test_a_plane_along_a_line_of_elements_makes_even_steps(self):
        first, last = QUARTER.index("*BLANK OUTLINE"), QUARTER.index("*BOUNDARY")
        with Results(self.started("square", QUARTER[:first] + QUARTER[last:])) as results:
            for axis, row in ((0, 1), (0, 7), (1, 4), (1, 10)):
                cut = Section(results, (axis, 55 / 14 * row))
                np.testing.assert_allclose(cut.start, np.linspace(0, 55, 8 * 14 + 1), atol=1e-9)
                [part] = straight_parts(cut.sheet(0)[1], 30.0, 8.0)
                self.assertEqual(len(part), len(cut.start))


class TestPatches(unittest.TestCase):
    """A quarter of a disk of several patches."""

    def test_a_section_runs_through_all_patches(self):
        deck = os.path.join(PROJECT, "input", "hemisphere.key")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "disk.h5")
            subprocess.run([IGAFORM, deck, "--check", "--start", "--out", path], check=True,
                           capture_output=True)
            with Results(path) as results:
                for axis in (0, 1):
                    cut = Section(results, (axis, 11.0))
                    self.assertGreater(len(cut.pieces), 1)
                    np.testing.assert_allclose(cut.start[[0, -1]],
                                               [0, np.sqrt(59.18**2 - 11**2)], atol=1e-3)
                    self.assertTrue(np.all(np.diff(cut.start) > 0.2))
                    np.testing.assert_allclose(cut.thickness(0), 0.85, rtol=1e-3)
                    places = np.concatenate([start_at(*piece) for piece in cut.pieces])
                    np.testing.assert_allclose(places[:, axis], 11, atol=0.01)


DECK = """*PARAMETER, DEFAULT
*TOOL, NAME=upper die, TYPE=PLANE, SIDE=NEGATIVE
0, 0, 1
*TOOL, NAME=lid, TYPE=OFFSET, OF=upper die
1.05, 0
*STEP, NLGEOM=YES
*TOOL MOTION, TOOL=upper die, TYPE=VELOCITY
0, -18, 1e-3
*END STEP
*STEP, NLGEOM=YES
*MODEL CHANGE, REMOVE
upper die, holder
*STEP, NAME="a, b"
*MODEL CHANGE, ADD
holder
*DYNAMIC, EXPLICIT
, 2
"""


class TestDeck(unittest.TestCase):
    def test_steps_and_empty_fields(self):
        deck = Deck(DECK)
        [motion] = deck.named("TOOL MOTION")
        self.assertEqual(motion.step, 1)
        np.testing.assert_allclose([number(field) for field in motion.data[0]], [0, -18, 1e-3])
        self.assertEqual(deck.named("STEP")[2].options, {"NAME": "a, b"})
        self.assertEqual(deck.named("DYNAMIC")[0].data, [["", "2"]])
        self.assertEqual([deck.is_removed("upper die", step) for step in (1, 2, 3)],
                         [False, True, True])
        self.assertEqual([deck.is_removed("holder", step) for step in (1, 2, 3)],
                         [False, True, False])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
