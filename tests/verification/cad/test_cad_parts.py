"""Parts of `python -m post cad` that work without OpenCASCADE: kinds of files, choices, degrees,
the file written, numbers in the picture.

usage: test_cad_parts.py PROJECT
"""
import argparse
import copy
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np

PROJECT = pathlib.Path(sys.argv[1]).resolve()
sys.path.insert(0, str(PROJECT))

from post.cad import choice, command, degrees, kinds, nets, occ, picture  # noqa: E402
from post.cad.reading import Face, Model, Traits  # noqa: E402
from post.cad.writing import write_faces  # noqa: E402
from post.iges_file import Surface  # noqa: E402
from post.results import ResultsError  # noqa: E402


def arguments_of(*words):
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return parser.parse_args(list(words))


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def file(self, name, content):
        path = self.folder / name
        path.write_bytes(content)
        return str(path)


class TestKinds(InFolder):
    def test_told_by_content(self):
        step = b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA (('AP242_MANAGED_MODEL { 1 0 }'));\n"
        self.assertEqual(kinds.kind_of(self.file("a.txt", step)), "STEP")
        self.assertEqual(kinds.schema_of(str(self.folder / "a.txt")), "AP242")
        for schema, name in ((b"CONFIG_CONTROL_DESIGN", "AP203"), (b"AUTOMOTIVE_DESIGN", "AP214"),
                             (b"AP203_CONFIGURATION", "AP203"), (b"OTHER_THING", "OTHER_THING")):
            path = self.file("b.stp", b"ISO-10303-21;FILE_SCHEMA(('" + schema + b"'));")
            self.assertEqual(kinds.schema_of(path), name)
        iges = b" " * 72 + b"S      1\n"
        self.assertEqual(kinds.kind_of(self.file("b.txt", iges)), "IGES")
        brep = b"\nCASCADE Topology V1, (c) Matra-Datavision\n"
        self.assertEqual(kinds.kind_of(self.file("c.txt", brep)), "BREP")

    def test_meshes_and_others_are_refused_with_the_reason(self):
        binary = b"\0" * 80 + (2).to_bytes(4, "little") + b"\0" * 100
        for name, content, words in (
                ("a.stl", b"solid x\nfacet normal 0 0 1\n", "mesh (STL)"),
                ("b.bin", binary, "mesh (STL)"),
                ("c.obj", b"v 0 0 0\n", "mesh (OBJ)"),
                ("d.k", b"*KEYWORD\n*NODE\n", "mesh (LS-DYNA)"),
                ("e.CATPart", b"V5_CFV2\0", "file of CATIA alone"),
                ("f.x_t", b"**ABCDEFGHIJKLMNOPQRSTUVWXYZ*", "file of Parasolid alone"),
                ("g.dxf", b"  0\nSECTION\n", "DXF drawing, which has no surfaces"),
                ("h.igs", b" " * 72 + b"C      1\n", "IGES in its compressed format"),
                ("i.step.gz", b"\x1f\x8b\x08", "compressed (gzip)"),
                ("j.dat", b"hello", "no STEP, IGES or BREP file: its content starts with 'hello'"),
                ("k.step", b"", "is empty")):
            path = self.file(name, content)
            with self.assertRaises(ResultsError, msg=name) as caught:
                kinds.kind_of(path)
            self.assertIn(words, str(caught.exception))
            self.assertNotIn("\n", str(caught.exception))
            self.assertIn(name, str(caught.exception))


class TestCommand(InFolder):
    STEP = b"ISO-10303-21;\n"

    def test_faults_of_the_arguments_are_told_together(self):
        step = self.file("die.step", self.STEP)
        foreign = self.file("mine.igs", b"not written here")
        with self.assertRaises(ResultsError) as caught:
            command.run(arguments_of(step, "--out", foreign, "--unit", "ELL", "--gap", "-1",
                                     "--picture", str(self.folder / "none" / "a.xyz")))
        for words in ("--unit", "--gap", "left alone", "no folder", "no picture format"):
            self.assertIn(words, str(caught.exception))
        self.assertEqual(pathlib.Path(foreign).read_bytes(), b"not written here")

    def test_without_the_wheel_one_line_names_the_command(self):
        step = self.file("die.step", self.STEP)
        with mock.patch.object(occ.importlib.util, "find_spec", return_value=None), \
                self.assertRaises(ResultsError) as caught:
            command.run(arguments_of(step, "--out", str(self.folder / "x.igs")))
        self.assertIn("`./bootstrap cad` installs it", str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))
        self.assertEqual(os.listdir(self.folder), ["die.step"])

    def test_a_mesh_ends_the_command_with_code_1(self):
        done = subprocess.run(
            [sys.executable, "-m", "post", "cad", self.file("a.stl", b"solid\nfacet normal 0 0 1")],
            cwd=PROJECT, capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertEqual(done.stderr.count("\n"), 1)
        self.assertIn("facets have no curvature", done.stderr)


def model_of(*traits):
    faces = [Face(i, None, one, True) for i, one in enumerate(traits, 1)]
    return Model("a.step", "STEP", "mm", faces, 1)


class TestChoice(unittest.TestCase):
    MODEL = model_of(Traits(("press", "die"), "#cc3333", "ACTIVE"),
                     Traits(("press", "die", "wall")),
                     Traits(("press", "punch"), "#3333cc", "0"), Traits(("press",), "#999999", "0"))

    def numbers(self, *words):
        found = choice.chosen(self.MODEL, arguments_of("a.step", *words))
        return [face.number for face in found]

    def test_choices(self):
        self.assertEqual(self.numbers(), [1, 2, 3, 4])
        self.assertEqual(self.numbers("--faces", "F2-3, 1"), [1, 2, 3])
        self.assertEqual(self.numbers("--faces", "1-3", "--without", "2"), [1, 3])
        self.assertEqual(self.numbers("--color", "red"), [1])
        self.assertEqual(self.numbers("--color", "CD3333,none"), [1, 2])
        self.assertEqual(self.numbers("--color", "gray,blue"), [3, 4])
        self.assertEqual(self.numbers("--layer", "active,0"), [1, 3, 4])
        self.assertEqual(self.numbers("--name", "die"), [1, 2])
        self.assertEqual(self.numbers("--name", "W*l,pun*"), [2, 3])
        self.assertEqual(self.numbers("--layer", "0", "--color", "blue"), [3])

    def test_faults_are_told_together(self):
        with self.assertRaises(ResultsError) as caught:
            self.numbers("--faces", "1,x,7-9,3-2", "--color", "green", "--name", "dei",
                         "--seen-from", "up")
        for words in ("'x' is no number", "'7-9' is beyond the faces 1 to 4",
                      "'3-2' runs backwards", "no face fits 'green'; there are #cc3333",
                      "did you mean die?", "'up' is no direction"):
            self.assertIn(words, str(caught.exception))
        with self.assertRaisesRegex(ResultsError, "no face fits all options together"):
            self.numbers("--faces", "1", "--color", "blue")

    def test_colours_by_name(self):
        for values, name in (((255, 0, 0), "red"), ((255, 128, 0), "orange"),
                             ((250, 250, 0), "yellow"), ((0, 120, 30), "green"),
                             ((0, 255, 255), "cyan"), ((10, 10, 200), "blue"),
                             ((120, 0, 200), "purple"), ((255, 0, 255), "magenta"),
                             ((0, 0, 0), "black"), ((128, 128, 130), "grey"),
                             ((255, 255, 255), "white")):
            self.assertEqual(choice.colour_name(values), name)

    def test_directions(self):
        self.assertEqual(choice.direction("-Y"), (0, -1, 0))
        np.testing.assert_allclose(choice.direction("0,3,4"), (0, 0.6, 0.8))


def de_boor(degree, knots, points, at):
    """A point of a spline by the recursion on its points, independent of the basis functions."""
    span = min(np.searchsorted(knots, at, side="right") - 1, len(points) - 1)
    rows = [points[i] for i in range(span - degree, span + 1)]
    for r in range(1, degree + 1):
        for j in range(degree, r - 1, -1):
            low, high = knots[span - degree + j], knots[span + j - r + 1]
            share = (at - low) / (high - low)
            rows[j] = (1 - share) * rows[j - 1] + share * rows[j]
    return rows[degree]


class TestDegrees(unittest.TestCase):
    """A rational curve of degree 8 with a kink, a smooth knot and a span between."""
    KNOTS = np.array([0.0] * 9 + [1.0] * 8 + [2.5] + [4.0] * 9)
    RANDOM = np.random.default_rng(7)
    N = len(KNOTS) - 9
    POINTS = np.column_stack([np.linspace(0, 10, N), RANDOM.random((N, 2))])
    NET = degrees.homogeneous(POINTS, 1 + RANDOM.random(N))

    def test_lowered_is_as_near_as_told(self):
        sizes = []
        for tolerance in (1e-2, 1e-5, 1e-8):
            knots, net, error, _ = degrees.lowered(8, self.KNOTS, self.NET,
                                                   degrees.largest_distance, tolerance)
            self.assertEqual(len(net), len(knots) - degrees.MOST_DEGREE - 1)
            sizes.append(len(net))
            far = 0.0
            for at in np.linspace(0, 4, 301)[:-1]:
                one, other = de_boor(8, self.KNOTS, self.NET, at), de_boor(5, knots, net, at)
                far = max(far, np.linalg.norm(one[:3] / one[3] - other[:3] / other[3]))
            self.assertLessEqual(error, tolerance)
            self.assertLess(far, tolerance)
            self.assertGreater(far, 0)
            np.testing.assert_allclose(net[[0, -1]], self.NET[[0, -1]], rtol=1e-14)
        self.assertLess(sizes[0], sizes[1])
        self.assertLess(sizes[1], sizes[2])

    def test_error_falls_with_the_sixth_power(self):
        errors = []
        for halvings in (4, 5):
            with mock.patch.object(degrees, "MOST_HALVINGS", halvings):
                errors.append(degrees.lowered(8, self.KNOTS, self.NET, degrees.largest_distance,
                                              0.0)[2])
        self.assertGreater(errors[0] / errors[1], 2**5.5)
        self.assertLess(errors[0] / errors[1], 2**6.5)

    def test_surface_of_high_degree(self):
        surface = Surface("F1", (1, 8), (np.array([0.0, 0.0, 1.0, 1.0]), self.KNOTS),
                          np.stack([self.POINTS, self.POINTS + [0, 0, 5]], axis=1),
                          np.ones((self.N, 2)))
        reduced, off, place = nets.lowered_surface(surface, 1e-4)
        self.assertEqual(reduced.degrees, (1, 5))
        self.assertLessEqual(off, 1e-4)
        self.assertGreater(off, 0)
        self.assertEqual(len(place), 3)
        same, off, place = nets.lowered_surface(reduced, 1e-4)
        self.assertIs(same, reduced)
        self.assertIsNone(place)
        with mock.patch.object(degrees, "MOST_HALVINGS", 0), \
                self.assertRaisesRegex(nets.FaceError, "more than --tolerance"):
            nets.lowered_surface(surface, 1e-9)


class TestCurves(unittest.TestCase):
    def test_what_is_straight_becomes_a_line(self):
        knots = np.array([0.0] * 4 + [1.0] * 4)
        points = np.array([[0, 2], [1, 2 + 1e-9], [1.5, 2 - 1e-9], [4, 2.0]])
        curve = nets.Curve(3, knots, points, np.ones(4))
        line = nets.straight(curve, np.ones(2), 1e-8)
        self.assertEqual(line.degree, 1)
        np.testing.assert_array_equal(line.points, [[0, 2], [4, 2]])
        self.assertIsNone(nets.straight(curve, np.array([1, 100.0]), 1e-8))
        curve.points[1] = [5, 2]      # beyond its end and back
        self.assertIsNone(nets.straight(curve, np.ones(2), 1e-8))

    def test_turned_face_has_its_normal_reversed_and_loops_on_the_left(self):
        surface = Surface("F1", (1, 1), (np.array([0.0, 0, 2, 2]), np.array([0.0, 0, 1, 1])),
                          np.array([[[0.0, 0, 0], [2, 0, 0]], [[0, 1, 0], [2, 1, 0]]]),
                          np.ones((2, 2)))
        corners = np.array([[0.0, 0], [2, 0], [0, 1]])
        loop = [(nets.Curve(1, np.array([0.0, 0, 1, 1]), np.array([a, b]), np.ones(2)), None)
                for a, b in zip(corners, np.roll(corners, -1, axis=0))]
        face = nets.turned(nets.TrimmedFace(1, surface, [loop]))
        normal = np.cross(*(nets.surface_points(face.surface, at)[0, 0]
                            - nets.surface_points(face.surface, ([0.0], [0.0]))[0, 0]
                            for at in (([1.0], [0.0]), ([0.0], [1.0]))))
        self.assertLess(normal[2], 0)
        points = [flat.points[0] for flat, _ in face.loops[0]]
        ends = [flat.points[-1] for flat, _ in face.loops[0]]
        np.testing.assert_array_equal(ends, np.roll(points, -1, axis=0))
        x, y = np.transpose(points)
        self.assertGreater(x @ np.roll(y, -1) - y @ np.roll(x, -1), 0)


class TestWriting(InFolder):
    def test_entities_and_every_digit(self):
        third = 1 / 3
        surface = Surface("F7", (1, 1), (np.array([0.0, 0, 1, 1]),) * 2,
                          np.array([[[0.0, 0, third], [1, 0, 0]], [[0, 1, 0], [1, 1, 0]]]),
                          np.ones((2, 2)))
        line = nets.Curve(1, np.array([0.0, 0, 1, 1]), np.array([[0, 0], [third, 1]]), np.ones(2))
        space = nets.Curve(1, line.knots, np.array([[0, 0, third], [third, 1, 0]]), np.ones(2))
        path = str(self.folder / "a.igs")
        given = copy.deepcopy(surface.points)
        face = nets.TrimmedFace(7, surface, [[(line, space), (line.reversed(), None)]])
        write_faces(path, [face], 2.0, "MM", 1e-3, "test")
        lines = pathlib.Path(path).read_text().splitlines()
        self.assertTrue(all(len(row) == 80 for row in lines))
        heads = [row for row in lines if row[72] == "D"][::2]
        self.assertEqual([int(row[:8]) for row in heads], [128, 126, 126, 102, 126, 102, 142, 144])
        self.assertTrue(all(row[66:68] == "01" for row in heads[:-1]))    # parts of others
        self.assertEqual(heads[-1][64:72], "00000000")
        text = "".join(row[:64].strip() for row in lines if row[72] == "P")
        values = [entity.split(",") for entity in text.split(";")[:-1]]
        self.assertEqual(values[-1], ["144", "1", "1", "0", "13"])
        self.assertEqual(values[-2], ["142", "0", "1", "7", "11", "1"])
        self.assertEqual(values[3], ["102", "2", "3", "5"])
        numbers = [[float(value.replace("D", "e")) for value in one] for one in values]
        np.testing.assert_array_equal(numbers[0][22:34], 2 * given.ravel())
        np.testing.assert_array_equal(np.reshape(numbers[1][13:19], (2, 3))[:, :2], line.points)
        np.testing.assert_array_equal(np.reshape(numbers[4][13:19], (2, 3)), space.points)
        np.testing.assert_array_equal(space.points, [[0, 0, 2 * third], [2 * third, 2, 0]])
        head = "".join(row[:72] for row in lines if row[72] == "G").split(",")
        self.assertEqual(float(head[-7].replace("D", "e")), 1e-3)      # resolution


class TestPicture(unittest.TestCase):
    def test_a_number_lies_in_its_face(self):
        for mask in (np.ones((5, 7), bool), np.eye(9, dtype=bool),
                     np.hypot(*np.mgrid[-30:31, -30:31]) // 10 == 2):
            row, column = picture.inner_pixel(mask)
            self.assertTrue(mask[row, column])
        wide = np.zeros((40, 40), bool)
        wide[5:36, 5:10] = wide[20:36, 5:36] = True
        row, column = picture.inner_pixel(wide)
        self.assertTrue(wide[row - 6:row + 7, column - 6:column + 7].all())


class TestNumbers(unittest.TestCase):
    def test_numbers_do_not_cover_each_other(self):
        owners = np.full((100, 300), -1)
        owners[:, :200] = 0                     # large
        owners[45:56, 80:90] = 1                # where the number of the large one would be
        owners[20:60, 220:260] = 2
        owners[:5, 290:] = 3                    # too small
        axes = mock.Mock()
        model = model_of(*[Traits()] * 4)
        self.assertEqual(picture.numbers_on(axes, owners, model, {1, 3, 4}), 2)
        places = {call.args[2]: call.args[1::-1] for call in axes.text.call_args_list}
        self.assertEqual(set(places), {"1", "3"})
        for text, place in places.items():
            self.assertEqual(owners[place], int(text) - 1)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
