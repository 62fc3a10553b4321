"""`python -m post cad` with OpenCASCADE: faces before and after, choices, units, refusals.

usage: test_cad_files.py PROJECT
"""
import importlib.util
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from PIL import Image

PROJECT = pathlib.Path(sys.argv[1]).resolve()
sys.path.insert(0, str(PROJECT))

from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse  # noqa: E402
from OCP.BRep import BRep_Builder, BRep_Tool  # noqa: E402
from OCP.BRepBuilderAPI import (BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace,  # noqa: E402
                                BRepBuilderAPI_MakeWire)
from OCP.BRepGProp import BRepGProp  # noqa: E402
from OCP.BRepPrimAPI import (BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder,  # noqa: E402
                             BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus)
from OCP.BRepTools import BRepTools  # noqa: E402
from OCP.collections import (Array1_double, Array1_int, Array2_double, Array2_gp_Pnt)  # noqa: E402
from OCP.Geom import (Geom_BSplineSurface, Geom_ConicalSurface,  # noqa: E402
                      Geom_CylindricalSurface, Geom_ToroidalSurface)
from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf  # noqa: E402
from OCP.gp import gp_Ax2, gp_Ax3, gp_Circ, gp_Dir, gp_Pnt  # noqa: E402
from OCP.GProp import GProp_GProps  # noqa: E402
from OCP.Interface import Interface_Static  # noqa: E402
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer  # noqa: E402
from OCP.TopoDS import TopoDS_Face  # noqa: E402

from post.cad import occ  # noqa: E402
from post.cad.convert import convert  # noqa: E402
from post.cad.nets import surface_points  # noqa: E402
from post.cad.reading import Face, Traits, read_model  # noqa: E402

INPUT = PROJECT / "input" / "cad"
DIES = ("s_rail_die", "cross_die")
FORMATS = (".step", "_144.igs", "_186.igs")
ENTITIES = {102, 126, 128, 142, 144}


def cad(*words, expect=0):
    done = subprocess.run([sys.executable, "-m", "post", "cad", *map(str, words)], cwd=PROJECT,
                          capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == expect, done.stdout + done.stderr
    return done.stdout + done.stderr


def measured(path):
    """Area and centre of each face of a file."""
    rows = []
    for face in read_model(str(path)).faces:
        properties = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face.shape, properties)
        rows.append([abs(properties.Mass()), *occ.xyz(properties.CentreOfMass())])
    return np.array(rows)


def matched(one, other):
    """Largest relative difference of areas and largest distance of centres of the same faces."""
    assert len(one) == len(other)
    apart = np.linalg.norm(one[:, None, 1:] - other[None, :, 1:], axis=2)
    partner = apart.argmin(axis=1)
    assert len(set(partner)) == len(one)
    return np.abs(one[:, 0] / other[partner, 0] - 1).max(), apart.min(axis=1).max()


def entities_of(path):
    """Type and values of each entity of a file that post wrote."""
    lines = pathlib.Path(path).read_text(encoding="latin-1").splitlines()
    text = "".join(line[:64].strip() for line in lines if line[72] == "P")
    return [[float(value.replace("D", "e")) for value in one.split(",")]
            for one in text.split(";")[:-1]]


def spline(entity):
    """Degree, number of control points and ends in space of an entity 126."""
    n, degree = int(entity[1]) + 1, int(entity[2])
    first = 7 + n + degree + 1 + n
    points = np.reshape(entity[first:first + 3 * n], (n, 3))
    return degree, points[0], points[-1]


class InFolder(unittest.TestCase):
    def setUp(self):
        occ.silence()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def brep(self, shape, name="a.brep"):
        path = self.folder / name
        BRepTools.Write_s(shape, str(path))
        return path

    def check_file(self, path):
        """Only entities that the solver reads, degrees to 5, loops closed to the last bit."""
        entities = entities_of(path)
        self.assertLessEqual({int(one[0]) for one in entities}, ENTITIES)
        for one in entities:
            if one[0] == 128:
                self.assertLessEqual(max(one[3:5]), 5)
            if one[0] == 126:
                self.assertLessEqual(one[2], 5)
            if one[0] == 142:
                chain = entities[(int(one[3]) - 1) // 2]
                self.assertEqual(chain[0], 102)
                ends = [spline(entities[(int(pointer) - 1) // 2])[1:] for pointer in chain[2:]]
                for (_, last), (first, _) in zip(ends, ends[1:] + ends[:1]):
                    np.testing.assert_array_equal(last, first)


class TestDies(InFolder):
    def test_three_formats_give_the_same_faces(self):
        for die in DIES:
            original = measured(INPUT / f"{die}.step")
            for ending in FORMATS:
                out = self.folder / f"{die}{ending}.igs"
                told = cad(INPUT / f"{die}{ending}", "--out", out)
                self.assertIn(f"{len(original)} trimmed surfaces in MM", told)
                area, place = matched(measured(out), original)
                self.assertLess(area, 1e-9)
                self.assertLess(place, 1e-7)
                self.check_file(out)

    def test_stored_tools_are_the_active_faces(self):
        for die, endings in zip(DIES, (FORMATS, FORMATS[:1])):
            for ending in endings:
                source = INPUT / f"{die}{ending}"
                stored = INPUT / f"{source.stem}_tool.igs"
                self.check_file(stored)
                red = [face.number for face in read_model(str(source)).faces
                       if face.traits.colour == "#cc3333"]
                area, place = matched(measured(stored), measured(source)[np.array(red) - 1])
                self.assertLess(area, 1e-9)
                self.assertLess(place, 1e-7)
                self.assertLess(os.path.getsize(stored), 300_000)

    def test_the_script_makes_the_stored_files(self):
        spec = importlib.util.spec_from_file_location("tools", INPUT / "tools.py")
        tools = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(tools)
        for die, make in zip(DIES, (tools.s_rail, tools.cross)):
            again = measured(self.brep(make()))
            area, place = matched(again, measured(INPUT / f"{die}.step"))
            self.assertLess(max(area, place), 1e-9)

    def test_radii_and_corners_of_the_table(self):
        lines = cad(INPUT / "s_rail_die.step", "--list").splitlines()
        self.assertEqual(len(lines), 33)
        rows = [re.split(r" {2,}", line.strip()) for line in lines[1:]]
        self.assertEqual([int(row[0]) for row in rows], list(range(1, 33)))
        self.assertEqual({row[3] for row in rows}, {"-", "9", "59", "121"})
        self.assertEqual({row[6] for row in rows}, {"#999999", "#cc3333"})
        self.assertEqual({row[8] for row in rows}, {"s rail die"})
        wall = 2 * 60.0 * (150 - 90 * np.sqrt(0.5)) / 2
        shown = {float(row[2]) for row in rows if row[1] == "plane"}
        self.assertTrue(any(abs(area / (wall - 9 * (150 - 90 * np.sqrt(0.5))) - 1) < 1e-5
                            for area in shown), shown)

    def test_choices(self):
        die = INPUT / "cross_die.step"
        count = (lambda *words: len(cad(die, "--list", *words).splitlines()) - 1)
        self.assertEqual(count(), 55)
        self.assertEqual(count("--color", "red"), 50)
        self.assertEqual(count("--layer", "active"), 50)
        self.assertEqual(count("--name", "cross*"), 55)
        # From above all but the bottom, from below the bottom: each with the sides of the block.
        self.assertEqual(count("--seen-from", "+z"), 54)
        self.assertEqual(count("--seen-from=-z"), 5)
        self.assertEqual(count("--seen-from", "+z", "--color", "red"), 50)
        told = cad(die, "--seen-from", "+z", "--color", "red", "--without", "55", "--out",
                   self.folder / "a.igs")
        self.assertIn("walls along the view from +z among them: 22-37", told)
        self.assertIn("49 trimmed surfaces", told)


class TestShapes(InFolder):
    def test_normals_point_outwards(self):
        """The volume by the faces of the file, which know no inside."""
        shape = BRepAlgoAPI_Fuse(BRepPrimAPI_MakeBox(10, 20, 30).Shape(), BRepPrimAPI_MakeCylinder(
            gp_Ax2(gp_Pnt(5, 10, 25), gp_Dir(0, 0, 1)), 4, 15).Shape()).Shape()
        whole = GProp_GProps()
        BRepGProp.VolumeProperties_s(occ.compound_of([face.shape for face in read_model(
            str(INPUT / "cross_die.step")).faces]), whole, 1e-12)
        out = self.folder / "a.igs"
        for path, volume in ((self.brep(shape), 6000 + 160 * np.pi),
                             (INPUT / "cross_die.step", whole.Mass()),
                             (self.brep(BRepPrimAPI_MakeSphere(5).Shape(), "b"), 500 * np.pi / 3),
                             (self.brep(BRepPrimAPI_MakeTorus(10, 3).Shape(), "c"),
                              180 * np.pi**2)):
            cad(path, "--out", out)
            self.check_file(out)
            compound = occ.compound_of([face.shape for face in read_model(str(out)).faces])
            properties = GProp_GProps()
            BRepGProp.VolumeProperties_s(compound, properties, 1e-12)
            self.assertAlmostEqual(properties.Mass() / volume, 1, 8)

    def test_shared_edges_have_the_same_curve(self):
        """To the last bit, and in opposite directions."""
        fused = BRepAlgoAPI_Fuse(BRepPrimAPI_MakeBox(10, 20, 30).Shape(), BRepPrimAPI_MakeCylinder(
            gp_Ax2(gp_Pnt(5, 10, 25), gp_Dir(0, 0, 1), gp_Dir(1, 1, 0)), 4, 15).Shape()).Shape()
        for path in (self.brep(fused), INPUT / "s_rail_die.step", INPUT / "cross_die.step"):
            done = convert(read_model(str(path)).faces, 1e-3, 0.1)
            self.assertEqual(done.refused, [])
            ways = {}
            for curve in (pair[1] for face in done.faces for loop in face.loops for pair in loop):
                one, other = curve.points.tobytes(), curve.reversed().points.tobytes()
                ways.setdefault(min(one, other), []).append(one < other)
            for both in ways.values():
                self.assertEqual(sorted(both), [False, True])

    def test_what_hides_what(self):
        """A table over a box: its plate hides the box but for the part that sticks out."""
        plate = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 50), gp_Pnt(100, 100, 60)).Shape()
        hidden = BRepPrimAPI_MakeBox(gp_Pnt(10, 10, 0), gp_Pnt(60, 60, 20)).Shape()
        half = BRepPrimAPI_MakeBox(gp_Pnt(70, 70, 0), gp_Pnt(101, 90, 20)).Shape()
        path = self.brep(occ.compound_of([plate, hidden, half]))
        seen = [int(line.split()[0]) for line in
                cad(path, "--list", "--seen-from", "+z").splitlines()[1:]]
        model = read_model(str(path))
        centres = [measured(path)[face.number - 1, 1:] for face in model.faces]
        expected = [face.number for face, centre in zip(model.faces, centres)
                    if centre[2] == 60 or centre[2] == 55        # the plate and its sides
                    or (centre[2] == 20 and centre[0] > 80)      # the top that sticks out
                    or centre[0] == 101]                         # and its end
        top = [face.number for face, centre in zip(model.faces, centres)
               if centre[2] == 10 and centre[0] > 80 and centre[1] in (70, 90)]
        self.assertEqual(sorted(set(seen) | set(top)), sorted(expected + top))

    def test_missing_parameter_curves_are_made(self):
        frames = [gp_Ax2(gp_Pnt(0, 0, z), gp_Dir(0, 0, 1)) for z in (0, 5)]
        arcs = [BRepBuilderAPI_MakeEdge(gp_Circ(frame, 10), 0.2, 2.0).Edge() for frame in frames]
        ends = [[gp_Pnt(10 * np.cos(angle), 10 * np.sin(angle), z) for z in (0, 5)]
                for angle in (0.2, 2.0)]
        wire = BRepBuilderAPI_MakeWire()
        for edge in (arcs[0], BRepBuilderAPI_MakeEdge(*ends[1]).Edge(), arcs[1],
                     BRepBuilderAPI_MakeEdge(*ends[0]).Edge()):
            wire.Add(edge)
        face = TopoDS_Face()
        BRep_Builder().MakeFace(face, Geom_CylindricalSurface(gp_Ax3(frames[0]), 10), 1e-7)
        BRep_Builder().Add(face, wire.Wire())
        done = convert([Face(1, face, Traits(), True)], 1e-3, 0.1)
        self.assertEqual((done.refused, done.n_made), ([], 4))
        [trimmed] = done.faces
        flat = np.concatenate([curve.points for curve, _ in trimmed.loops[0]])
        corners = np.concatenate([surface_points(trimmed.surface, ([u], [v]))[0]
                                  for u, v in np.unique(flat, axis=0)])
        for angle in (0.2, 2.0):
            for z in (0, 5):
                place = [10 * np.cos(angle), 10 * np.sin(angle), z]
                self.assertLess(np.linalg.norm(corners - place, axis=1).min(), 1e-9)

    def test_seams_anywhere(self):
        """Whole and part turns of cylinder, cone and torus that begin at odd angles."""
        frame = gp_Ax3(gp_Pnt(1, 2, 3), gp_Dir(1, 2, 2), gp_Dir(2, 1, -2))
        mirrored = gp_Ax3(frame.Ax2())
        mirrored.YReverse()
        for place in (frame, mirrored):
            for surface in (Geom_CylindricalSurface(place, 7), Geom_ConicalSurface(place, 0.3, 7),
                            Geom_ToroidalSurface(place, 9, 4)):
                for first, last in ((4.7, 4.7 + 2 * np.pi), (-2.0, 1.0), (6.0, 8.0)):
                    shape = BRepBuilderAPI_MakeFace(surface, first, last, 0.5, 2.5, 1e-7).Face()
                    done = convert([Face(1, shape, Traits(), False)], 1e-3, 0.1)
                    self.assertEqual(done.refused, [])
                    net = done.faces[0].surface
                    for share in (0.0, 0.21, 0.5, 0.77, 1.0):
                        flat = [knots[0] + (knots[-1] - knots[0]) * part
                                for knots, part in zip(net.knots, (share, share**2))]
                        point = gp_Pnt(*surface_points(net, ([flat[0]], [flat[1]]))[0, 0])
                        foot = GeomAPI_ProjectPointOnSurf(point, surface)
                        self.assertLess(foot.LowerDistance(), 1e-12 * 20)
                    corners = surface_points(net, [knots[[0, -1]] for knots in net.knots])
                    wanted = [[occ.xyz(surface.Value(u, v)) for u in (first, last)]
                              for v in (0.5, 2.5)]
                    np.testing.assert_allclose(corners, wanted, atol=1e-9)

    def test_degrees_are_reduced_within_the_tolerance(self):
        n = 9
        poles = Array2_gp_Pnt(1, n, 1, 3)
        weights = Array2_double(1, n, 1, 3)
        for i in range(n):
            for j in range(3):
                poles.SetValue(i + 1, j + 1, gp_Pnt(10 * i, 10 * j, 8 * (-1)**i * (i % 3) + j))
                weights.SetValue(i + 1, j + 1, 1 + 0.2 * (i % 2))
        ends, counts, across = Array1_double(1, 2), Array1_int(1, 2), Array1_int(1, 2)
        for i in (0, 1):
            ends.SetValue(i + 1, float(i))
            counts.SetValue(i + 1, n)
            across.SetValue(i + 1, 3)
        surface = Geom_BSplineSurface(poles, weights, ends, ends, counts, across, n - 1, 2)
        path = self.brep(BRepBuilderAPI_MakeFace(surface, 1e-7).Face())
        sizes = []
        for tolerance in (1e-1, 1e-4):
            out = self.folder / "a.igs"
            told = cad(path, "--out", out, "--tolerance", tolerance)
            off = float(re.search(r"degrees to 5 x 2; reduced in 1 face, off by at most (\S+) mm",
                                  told)[1])
            self.assertLessEqual(off, tolerance)
            self.check_file(out)
            sizes.append(os.path.getsize(out))
            [face] = read_model(str(out)).faces
            other = occ.xyz(BRep_Tool.Surface_s(face.shape).Value(0.37, 0.6))
            self.assertLess(np.linalg.norm(occ.xyz(surface.Value(0.37, 0.6)) - other), tolerance)
        self.assertLess(sizes[0], sizes[1])
        told = cad(path, "--out", out, "--tolerance", 1e-13, expect=1)
        self.assertRegex(told, "face 1 cannot be written: a degree of 8; .* more than --tolerance")

    def test_units(self):
        Interface_Static.SetCVal_s("write.step.unit", "INCH")
        writer = STEPControl_Writer()
        Interface_Static.SetCVal_s("write.step.unit", "INCH")
        writer.Transfer(BRepPrimAPI_MakeBox(25.4, 50.8, 76.2).Shape(), STEPControl_AsIs)
        path = self.folder / "inch.step"
        writer.Write(str(path))
        Interface_Static.SetCVal_s("write.step.unit", "MM")
        self.assertIn("lengths in inch", cad(path, "--out", self.folder / "a.igs").lower())
        self.assertIn("to (25.4, 50.8, 76.2) mm", cad(path, "--out", self.folder / "a.igs"))
        told = cad(path, "--out", self.folder / "b.igs", "--unit", "in")
        self.assertIn("to (1, 2, 3) in", told)
        points = [one for one in entities_of(self.folder / "b.igs") if one[0] == 126]
        self.assertAlmostEqual(max(np.abs(spline(one)[1:]).max() for one in points[4:8]), 3)
        sizes = measured(self.folder / "b.igs")[:, 0]
        self.assertAlmostEqual(sizes.max(), 50.8 * 76.2, 6)

    def test_gaps_are_told_with_their_place(self):
        plates = [BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), gp_Pnt(10, 10, 1)).Shape(),
                  BRepPrimAPI_MakeBox(gp_Pnt(10.004, 0, 0), gp_Pnt(20, 10, 1)).Shape()]
        faces = [face for plate in plates for face in occ.faces_in(plate)
                 if abs(measured_face(face)[2] - 1) < 1e-9]
        path = self.brep(occ.compound_of(faces))
        told = cad(path, "--out", self.folder / "a.igs")
        self.assertIn("1 edge between faces, 6 of one face alone", told)
        gap = re.search(r"largest gap (\S+) mm between faces 1 and 2 at \((\S+), ", told)
        self.assertAlmostEqual(float(gap[1]), 0.004, 6)
        self.assertAlmostEqual(float(gap[2]), 10, 1)
        told = cad(path, "--out", self.folder / "a.igs", "--gap", "0.001")
        self.assertIn("0 edges between faces, 8 of one face alone", told)


def measured_face(face):
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties)
    return occ.xyz(properties.CentreOfMass())


class TestRefusals(InFolder):
    def test_nothing_is_written(self):
        out = self.folder / "a.igs"
        damaged = self.folder / "damaged.step"
        text = (INPUT / "s_rail_die.step").read_text()
        damaged.write_text(text[:len(text) // 2])
        empty = self.folder / "empty.step"
        empty.write_text("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n")
        for path, words in ((damaged, "damaged"), (empty, "no geometry"),
                            (self.folder / "none.step", "No such file")):
            self.assertIn(words, cad(path, "--out", out, expect=1))
            self.assertFalse(out.exists())
        told = cad(INPUT / "s_rail_die.step", "--color", "green", "--faces", "99", "--out", out,
                   expect=1)
        self.assertIn("beyond the faces 1 to 32", told)
        self.assertIn("no face fits 'green'", told)
        self.assertEqual(sorted(os.listdir(self.folder)), ["damaged.step", "empty.step"])

    def test_blanked_surfaces_are_left_out(self):
        text = (INPUT / "s_rail_die_144.igs").read_text().splitlines()
        heads = [i for i, line in enumerate(text)
                 if line[72] == "D" and line[:8].strip() == "144"][::2]
        for i in heads[:3]:
            text[i] = text[i][:64] + "01" + text[i][66:]
        path = self.folder / "blanked.igs"
        path.write_text("\n".join(text) + "\n")
        told = cad(path, "--out", self.folder / "a.igs")
        self.assertIn("3 blanked surfaces left out", told)
        self.assertIn("29 trimmed surfaces", told)


class TestPicture(InFolder):
    def test_picture(self):
        png = self.folder / "a.png"
        told = cad(INPUT / "cross_die.step", "--color", "red", "--picture", png)
        self.assertIn("picture written", told)
        image = np.asarray(Image.open(png).convert("RGB"))
        self.assertGreater(len(np.unique(image.reshape(-1, 3)[::7], axis=0)), 50)
        self.assertFalse((PROJECT / "cross_die-tool.igs").exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
