"""`igaform material` as a user meets it: results, files, exit codes, pictures.

Usage: test_material.py PROGRAM PROJECT_FOLDER. The stresses are those of an independent solution
of the rate equations (relative tolerance 1e-10) for the flow stress 500 - 250 exp(-6 eqps).
"""
import csv
import os
import subprocess
import sys
import tempfile
import unittest

import h5py
import numpy as np

PROGRAM, PROJECT = (os.path.abspath(path) for path in sys.argv[1:3])
EXAMPLE = os.path.join(PROJECT, "input", "material_tests.key")
CYCLIC = os.path.join(PROJECT, "input", "material_cyclic.key")
sys.path.insert(0, PROJECT)

from post import material  # noqa: E402

STEEL = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*PLASTIC, HARDENING=VOCE
250, {hardening}, 6
"""
# By the kind of element: its history point along axis 3, and what it needs to lie still.
PLACES = {"SHELL": {"zeta": 0.5, "support": "ALL, 3, 3"},
          "SOLID": {"zeta": 1, "support": "Z_MIN, ZSYMM"}}
# A strip of 20 x 10 x 1 of the sheet 2090-T3 of Barlat et al. (2003), pulled by 1 in a static step.
STRIP = """*MATERIAL, NAME=2090-T3
*DENSITY
2.6e-9
*ELASTIC
70000, 0.33
*PLASTIC, HARDENING=LINEAR
280, 3000
*POTENTIAL, TYPE=YLD2000
0.4865, 1.3783, 0.7536, 1.0246, 1.0363, 0.9036, 1.2321, 1.4858, 8
*ORIENTATION
{a}, {b}, 0, -{b}, {a}, 0
*BLANK, NAME=strip, MATERIAL=2090-T3, TYPE=BOX, ELEMENT={element}
x, 0, 20, 2, 4
y, 0, 10, 2, 2
z, 0, 1, 2, 1
*HISTORY POINT, NAME=corner
1, 1, {zeta}
*STEP
*BOUNDARY
X_MIN, XSYMM
Y_MIN, YSYMM
{support}
*BOUNDARY, TYPE=VELOCITY
X_MAX, 1, 1, 1
*STATIC
0.1, 1
*OUTPUT, FRAMES=1, HISTORY=10
*END STEP
"""
RELEASE = """*STEP
*BOUNDARY, OP=NEW
X_MIN, XSYMM
Y_MIN, YSYMM
ALL, 3, 3
*STATIC
0.5, 1
*OUTPUT, FRAMES=1, HISTORY=2
*END STEP
"""
TENSION = "*MATERIAL TEST, NAME={name}, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=20\n{strain}\n"


VUMAT = """      subroutine vumat(nblock, ndir, nshr, nstatev, nfieldv, nprops,
     1 lanneal, steptime, totaltime, dt, cmname, coordmp, charlength,
     2 props, density, straininc, relspininc, tempold, stretchold,
     3 defgradold, fieldold, stressold, stateold, enerinternold,
     4 enerinelasold, tempnew, stretchnew, defgradnew, fieldnew,
     5 stressnew, statenew, enerinternnew, enerinelasnew)
      include 'vaba_param.inc'
      dimension props(nprops), straininc(nblock,ndir+nshr),
     1 stressold(nblock,ndir+nshr), stressnew(nblock,ndir+nshr)
      character*80 cmname
      twog = props(1)/(1.d0 + props(2))
      alam = twog*props(2)/(1.d0 - 2.d0*props(2))
      do k = 1, nblock
        trace = straininc(k,1) + straininc(k,2) + straininc(k,3)
        do i = 1, ndir + nshr
          stressnew(k,i) = stressold(k,i) + twog*straininc(k,i)
          if (i .le. 3) stressnew(k,i) = stressnew(k,i) + alam*trace
        end do
      end do
      end
"""


def columns(path):
    """A CSV file as arrays by the names in its first line."""
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    return dict(zip(rows[0], np.array(rows[1:], dtype=float).T))


class Folder(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def run_program(self, *arguments, code=0):
        done = subprocess.run([PROGRAM, *arguments], cwd=self.folder.name, capture_output=True,
                              text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def write(self, text, name="deck.key"):
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)
        return self.path(name)


class TestExample(Folder):
    def setUp(self):
        super().setUp()
        self.run_program("material", EXAMPLE, "--quiet")
        self.file = h5py.File(self.path("material_tests.h5"))
        self.addCleanup(self.file.close)

    def test_curves_match_the_reference(self):
        tension = self.file["tests/tension"]
        for strain, stress in ((0.02, 276.5112140079883), (0.1, 361.37313977264375),
                               (0.3, 458.13080434077483)):
            row = int(np.argmin(abs(tension["strain"][:, 0] - strain)))
            np.testing.assert_allclose(tension["stress"][row, 0], stress, atol=1e-7)
            np.testing.assert_allclose(tension["stress"][row, 1:], 0, atol=2.5e-8)
        compression = self.file["tests/compression/stress"][-1]
        np.testing.assert_allclose(compression[2], -458.13080434077483, atol=1e-7)
        shear = self.file["tests/shear"]
        np.testing.assert_allclose(shear["stress"][-1, [0, 3]], [0.99912, 284.101], atol=1.1e-3)
        np.testing.assert_allclose(shear["eqps"][-1], 0.575317, atol=2e-6)

    def test_bulge_lies_on_compression(self):
        strain, stress = material.stress_strain(self.file["tests/bulge"])
        other, pressed = material.stress_strain(self.file["tests/compression"])
        elastic = stress * 2 * (1 - 2 * 0.3) / 2.1e5 / 2   # of the pressure between the two
        np.testing.assert_allclose(np.interp(strain[20:90] + elastic[20:90], other, pressed),
                                   stress[20:90], rtol=2e-4)

    def test_csv_holds_the_same_rows(self):
        for name, test in self.file["tests"].items():
            table = columns(self.path(f"material_tests-{name.replace(' ', '_')}.csv"))
            for dataset in test.values():
                values = np.atleast_2d(dataset[:].T)
                found = [column for title, column in table.items()
                         if title.rsplit(" [", 1)[0].startswith(dataset.name.split("/")[-1])]
                np.testing.assert_allclose(found, values, rtol=1e-14, atol=0)
        self.assertIn("stress_11 [MPa]", table)

    def test_datasets_are_described(self):
        tension = self.file["tests/tension"]
        self.assertEqual(tension["stress"].attrs["unit"], b"MPa")
        self.assertEqual(tension["time"].attrs["unit"], b"s")
        self.assertEqual(tension.attrs["type"], b"UNIAXIAL")
        self.assertEqual(tension.attrs["material"], b"steel")
        for dataset in tension.values():
            self.assertTrue(dataset.attrs["description"])
        self.assertEqual(self.file["provenance"].attrs["status"], b"completed")
        self.assertIn(b"*MATERIAL TEST", self.file["provenance/deck_text"][()])

    def test_hills_function_shows(self):
        test = self.file["tests/r-values"]
        angle, r, stress = (test[name][:] for name in ("angle", "r_value", "stress"))
        r_0, r_45, r_90 = 1.8, 1.5, 2.2
        # Hill 1948 with G + H = 1, by r-values.
        h, g = r_0 / (1 + r_0), 1 / (1 + r_0)
        f = h / r_90
        n = (r_45 + 0.5) * (f + g)
        s, c = np.sin(np.radians(angle)), np.cos(np.radians(angle))
        expected = (h + (2 * n - f - g - 4 * h) * s**2 * c**2) / (f * s**2 + g * c**2)
        np.testing.assert_allclose(r, expected, rtol=1e-7)
        np.testing.assert_allclose(r[[0, 6, 12]], [r_0, r_45, r_90], rtol=1e-7)
        ratio = f * s**4 + g * c**4 + h * (c**2 - s**2)**2 + 2 * n * s**2 * c**2
        self.assertAlmostEqual(stress[0], 361.3731397726, delta=1e-6)
        self.assertTrue(np.all((stress[1:] - stress[0]) * (1 - ratio[1:]) > 0))
        s11, s22 = self.file["tests/yield locus/stress"][:].T
        hill = f * s22**2 + g * s11**2 + h * (s11 - s22)**2
        np.testing.assert_allclose(np.sqrt(hill), 250.0015, atol=1e-3)
        s11, s22 = self.file["tests/isotropic locus/stress"][:].T
        np.testing.assert_allclose(np.sqrt(s11**2 - s11 * s22 + s22**2), 250.0015, atol=1e-4)

    def test_materials_are_tried_in_their_own_axes(self):
        with open(EXAMPLE, encoding="utf-8") as file:
            deck = file.read()
        turned = self.write(deck.replace("1, 0, 0, 0, 1, 0", "0, 0, 1, 1, 0, 0"), "turned.key")
        self.run_program("material", turned, "--quiet")
        with h5py.File(self.path("turned.h5")) as other:
            for name in ("r-values/r_value", "yield locus/stress"):
                np.testing.assert_array_equal(other["tests"][name], self.file["tests"][name])


class TestPlaneStress(Folder):
    def test_a_sheet_of_hills_steel_is_pulled_and_sheared(self):
        test = ("*MATERIAL TEST, NAME={name}, MATERIAL=steel, TYPE={kind}, INCREMENTS=20, "
                "ANGLE=20{state}\n0.1\n")
        deck = (STEEL.format(hardening=250) + "*POTENTIAL, TYPE=HILL48\n1.8, 1.5, 2.2\n"
                "*ORIENTATION, SYSTEM=RECTANGULAR\n0, 1, 0, -1, 0, 0\n")
        for kind in ("UNIAXIAL", "EQUIBIAXIAL", "PLANE STRAIN", "SIMPLE SHEAR"):
            deck += test.format(name=kind, kind=kind, state="")
            deck += test.format(name=kind + " 2", kind=kind, state=", STRESS STATE=PLANE STRESS")
        self.run_program("material", self.write(deck), "--quiet")
        with h5py.File(self.path("deck.h5")) as file:
            for kind in ("UNIAXIAL", "EQUIBIAXIAL", "PLANE STRAIN"):
                solid, sheet = file["tests"][kind], file["tests"][kind + " 2"]
                self.assertEqual(sheet.attrs["stress_state"], b"PLANE STRESS")
                np.testing.assert_allclose(sheet["stress"], solid["stress"], atol=2e-6)
                np.testing.assert_allclose(sheet["strain"], solid["strain"], atol=1e-10)
            solid, sheet = file["tests/SIMPLE SHEAR"], file["tests/SIMPLE SHEAR 2"]
            self.assertGreater(abs(solid["stress"][-1, 2]), 1)
            self.assertGreater(abs(sheet["strain"][-1, 2]), 1e-5)
            self.assertEqual(sheet["stress"][-1, 2], 0)

    def test_published_sheets_have_their_measured_values(self):
        deck = os.path.join(PROJECT, "input", "sheet_potentials.key")
        self.run_program("material", deck, "--quiet", "--out", self.path("sheets.h5"))
        # Barlat et al. (2003), table 2; Banabic et al. (2005), table 1: r-values at 0, 45 and 90
        # degrees, yield stresses over that at 0 degrees at 90 degrees and in equibiaxial tension.
        measured = {"2090-T3": ([0.21, 1.58, 0.69], [0.910, 1.035]),
                    "6181-T4": ([0.672, 0.606, 0.821], [137 / 142, 134 / 142]),
                    "steel": ([1.8, 1.5, 2.2], None)}
        with h5py.File(self.path("sheets.h5")) as file:
            for name, (r_values, ratios) in measured.items():
                test = file["tests"]["r-values of " + name]
                np.testing.assert_allclose(test["r_value"][[0, 3, 6]], r_values, atol=3e-3)
                locus = file["tests"]["locus of " + name]
                s11, s22 = locus["stress"][:].T
                np.testing.assert_allclose(locus["stress"][36:], -locus["stress"][:36], atol=1e-2)
                if ratios:
                    np.testing.assert_allclose([s22[18] / s11[0], s11[9] / s11[0]], ratios,
                                               atol=1e-3)

    def test_a_strip_pulled_in_a_static_step_has_the_r_values(self):
        for element, a, b, r, strength in (("SHELL", 1, 0, 0.21, 1), ("SHELL", 0, 1, 0.69, 0.910),
                                           ("SOLID", 0, 1, 0.69, 0.910)):
            deck = self.write(STRIP.format(a=a, b=b, element=element, **PLACES[element]),
                              "strip.key")
            self.run_program(deck, "--quiet")
            with h5py.File(self.path("strip.h5")) as file:
                _, across, growth = file["history/probes/corner/displacement"][-1]
                thickness = 1 + growth
                if element == "SHELL":
                    thickness = file["VTKHDF/PointData/thickness"][-1]
            # Yield stress by plastic work, whose equivalent strain is that along the pull.
            along = np.log(21 / 20)
            stress = strength * 280
            for _ in range(50):
                stress = strength * (280 + 3000 * strength * (along - stress / 70000))
            elastic = 0.33 * stress / 70000
            width, through = np.log(1 + across / 10) + elastic, np.log(thickness) + elastic
            self.assertAlmostEqual(width / through, r, delta=2e-3)
            self.assertAlmostEqual(width + through, stress / 70000 - along, delta=2e-5)

    def test_laws_of_sheets_are_released_in_static_steps(self):
        """No stress is left, and the strip is shorter by the elastic strain; Young's modulus of the
        last law has fallen. Tangents lead there in a few iterations."""
        strip = STRIP.format(a=1, b=0, element="SHELL", **PLACES["SHELL"]) + RELEASE
        start, axes, blank = (strip.index(word) for word in ("*POTENTIAL", "*ORIENTATION",
                                                             "*BLANK"))
        function = (strip[:start] + "*POTENTIAL, TYPE={name}\n{constants}\n"
                    + strip[axes:])
        for name, constants in (
                ("BARLAT89", "0.21, 1.58, 0.69, 8"), ("BBC2003", "0.6, 1.1, 0.9, 1, 1, 1, 1, 1, 4"),
                ("BBC2005", "0.6, 0.45, 0.48, 0.53, 0.52, 0.49, 0.51, 0.5, 4"),
                ("YLD2000", "0.4865, 1.3783, 0.7536, 1.0246, 1.0363, 0.9036, 1.2321, 1.4858, 8"),
                ("YOSHIDA UEMORI", "250, 260, 200, 12, 9, 0.5, 60")):
            deck = function.format(name=name, constants=constants)
            is_falling = name == "YOSHIDA UEMORI"
            if is_falling:
                deck = (strip[:strip.index("*PLASTIC")] + f"*PLASTIC, HARDENING={name}\n"
                        f"{constants}\n*UNLOADING MODULUS\n60000, 30\n" + strip[blank:])
            self.run_program(self.write(deck, "strip.key"), "--quiet")
            with h5py.File(self.path("strip.h5")) as file:
                stress = file["VTKHDF/PointData/mises"][:].reshape(3, -1)
                moved = file["history/probes/corner/displacement"][:, 0]
                plastic = file["frames/eqps"][-1].mean()
            self.assertGreater(stress[1].min(), 270, name)
            self.assertLess(np.ptp(stress[1]) / stress[1].max(), 1e-9, name)
            self.assertLess(stress[2].max(), 1e-4, name)
            young = 60000 + 10000 * np.exp(-30 * plastic) if is_falling else 70000
            elastic = np.log((20 + moved[-3]) / (20 + moved[-1]))
            self.assertAlmostEqual(elastic * young / stress[1].max(), 1, delta=3e-5)
            with open(self.path("strip.log"), encoding="utf-8") as log:
                rows = [line.split(",")[1] for line in log if line.startswith("static     time")]
            self.assertLess(max(int(row.split()[0]) for row in rows), 8, name)

    def test_functions_of_sheets_are_refused_on_solids(self):
        deck = (STEEL.format(hardening=250) + "*POTENTIAL, TYPE=BARLAT89\n1.8, 1.5, 2.2, 6\n"
                "*ORIENTATION\n1, 0, 0, 0, 1, 0\n")
        path = self.write(deck + TENSION.format(name="a", strain=0.1))
        done = self.run_program("material", path, code=1)
        self.assertIn("deck.key:8: error: *POTENTIAL: found TYPE=BARLAT89, a yield function of "
                      "plane stress, for solids; expected HILL48, YLD91, YLD2000 or YLD2004",
                      done.stderr)


class TestRuns(Folder):
    def test_faults_leave_nothing_behind(self):
        for deck, words in ((STEEL.format(hardening=250), "*MATERIAL TEST"),
                            (TENSION.format(name="a", strain=0.1), "name steel"),
                            (STEEL.format(hardening=-1) + TENSION.format(name="a", strain=0.1),
                             "deck.key:6: error: *PLASTIC: ")):
            path = self.write(deck)
            done = self.run_program("material", path, code=1)
            self.assertIn(words, done.stderr)
            self.assertEqual(os.listdir(self.folder.name), ["deck.key"])

    def test_starts_without_a_test_are_told_as_any_deck_without(self):
        start = "*INITIAL CONDITIONS, TYPE={kind}\nALL, 20\n"
        own = STEEL.split("*PLASTIC", maxsplit=1)[0] + "*USER MATERIAL, CONSTANTS=1\n1\n"
        for law in (STEEL.format(hardening=250), own):
            for kind in ("TEMPERATURE", "FIELD, VARIABLE=2"):
                path = self.write(law + start.format(kind=kind))
                done = self.run_program("material", path, code=1)
                self.assertIn("*MATERIAL TEST", done.stderr)
                self.assertIn("1 error, 0 warnings", done.stderr)

    def test_a_result_of_another_kind_is_left_alone(self):
        path = self.write(BACK + SHEARED.format(end=1e-6) + TENSION.format(name="a", strain=0.1))
        for first, second, told in (([], ["material"], "the result of a forming run"),
                                    (["material"], [], "the result of material tests")):
            for _ in range(2):      # one of its own kind is replaced
                self.run_program(*first, path, "--quiet")
            with open(self.path("deck.h5"), "rb") as file:
                kept = file.read()
            for out in ([], ["--out", "./deck.h5"]):
                done = self.run_program(*second, path, *out, "--quiet", code=1)
                self.assertIn(told, done.stderr)
                self.assertIn("--out", done.stderr)
            with open(self.path("deck.h5"), "rb") as file:
                self.assertEqual(file.read(), kept)
            self.run_program(*second, path, "--quiet", "--out", "deck-other.h5")
            for name in ("deck.h5", "deck-other.h5"):
                os.remove(self.path(name))

    def test_tables_of_other_columns_are_replaced(self):
        elastic = STEEL.split("*PLASTIC", maxsplit=1)[0]
        locus = "*MATERIAL TEST, NAME=a, MATERIAL=steel, TYPE=YIELD LOCUS\n12\n"
        ratios = "*MATERIAL TEST, NAME=a, MATERIAL=steel, TYPE=R VALUES, INCREMENTS=20\n0.1, 3\n"
        steel = STEEL.format(hardening=250)
        tension = TENSION.format(name="a", strain=0.1)
        for deck, n_columns in ((elastic + tension, 14), (steel + tension, 15),
                                (elastic + tension, 14), (steel + locus, 4), (steel + ratios, 3),
                                ("*UNITS\nmm, t, s, MPa\n" + steel + tension, 15)):
            self.run_program("material", self.write(deck), "--quiet")
            self.assertEqual(len(columns(self.path("deck-a.csv"))), n_columns)
        self.write("time,strain\n0,0\n", "deck-a.csv")
        done = self.run_program("material", self.write(steel + tension), code=4)
        self.assertIn("left alone", done.stderr)
        with open(self.path("deck-a.csv"), encoding="utf-8") as file:
            self.assertEqual(file.read(), "time,strain\n0,0\n")

    def test_laws_without_plastic_strain_have_no_locus(self):
        elastic = STEEL.split("*PLASTIC", maxsplit=1)[0]
        path = self.write(elastic + "*MATERIAL TEST, NAME=a, MATERIAL=steel, TYPE=YIELD LOCUS\n"
                          "36\n")
        done = self.run_program("material", path, code=1)
        self.assertIn("reports no plastic strain", done.stderr)
        self.assertEqual(os.listdir(self.folder.name), ["deck.key"])

    def test_a_test_that_fails_is_told_and_kept(self):
        path = self.write(STEEL.format(hardening=0) + "*MATERIAL TEST, NAME=high, MATERIAL=steel, "
                          'TYPE=PATH, INCREMENTS=10, STRESS="11, 22, 33, 12, 13, 23"\n1, 500\n'
                          + TENSION.format(name="low", strain=0.1))
        done = self.run_program("material", path, code=2)
        self.assertIn("error: test high: ", done.stderr)
        self.assertIn("of 10", done.stderr)
        with h5py.File(self.path("deck.h5")) as file:
            self.assertEqual(file["provenance"].attrs["status"], b"failed")
            self.assertEqual(file["tests/high"].attrs["status"], b"failed")
            self.assertLess(file["tests/high/stress"][-1, 0], 251)
            self.assertEqual(file["tests/low"].attrs["status"], b"completed")
            np.testing.assert_allclose(file["tests/low/stress"][-1, 0], 250, atol=1e-7)

    def test_results_may_go_elsewhere(self):
        path = self.write(STEEL.format(hardening=250) + TENSION.format(name="a b", strain=0.1))
        done = self.run_program("material", path, "--out", "other.h5")
        self.assertIn("test a b: UNIAXIAL, 21 rows in other-a_b.csv", done.stdout)
        self.assertEqual(sorted(os.listdir(self.folder.name)),
                         ["deck.key", "other-a_b.csv", "other.h5"])
        self.run_program("material", path, "--out", "nowhere/other.h5", code=1)

    def test_check_writes_nothing(self):
        path = self.write(STEEL.format(hardening=250) + TENSION.format(name="a", strain=0.1))
        done = self.run_program("material", path, "--check")
        self.assertIn("test a: UNIAXIAL of steel", done.stdout)
        self.assertEqual(os.listdir(self.folder.name), ["deck.key"])

    def test_a_path_comes_from_a_file(self):
        self.write("time,11\n1,0.02\n2,0.1\n", "path.csv")
        path = self.write(STEEL.format(hardening=250) + "*MATERIAL TEST, NAME=a, MATERIAL=steel, "
                          'TYPE=PATH, INPUT=path.csv, STRESS="22, 33, 12, 13, 23"\n')
        self.run_program("material", path)
        table = columns(self.path("deck-a.csv"))
        stress = table["stress_11 [stress]"]
        np.testing.assert_allclose(stress[[100, 200]], [276.5112140079883, 361.37313977264375],
                                   atol=1e-7)


class TestCycles(Folder):
    """The model of Yoshida and Uemori in one dimension, integrated in small steps by Heun's method
    in plastic strain."""
    Y, B, C, M, SHIFT, H, R_SAT = 124, 168, 500, 12, 9, 0.5, 190
    MODULUS, LEAST, XI = 206000, 152000, 30.8

    def modulus(self, eqps):
        return self.MODULUS - (self.MODULUS - self.LEAST) * (1 - np.exp(-self.XI * eqps))

    def rates(self, way, state):
        theta, beta, q, size, radius = state
        a = self.B + size - self.Y
        theta_rate = self.C * (way * a - np.copysign(np.sqrt(a * abs(theta)), theta))
        beta_rate = self.M * (way * self.SHIFT - beta)
        if abs(beta - q) < radius - 1e-9 or (beta - q) * beta_rate < 0:
            return np.array([theta_rate, beta_rate, 0, 0, 0])
        return np.array([theta_rate, beta_rate, (1 - self.H) * beta_rate,
                         self.M * (self.R_SAT - size), self.H * abs(beta_rate)])

    def corners(self, strains, step=2e-6):
        """Stresses at the turns of a strain."""
        state, eqps, strain, stress = np.zeros(5), 0.0, 0.0, 0.0
        for target in strains:
            way = np.sign(target - strain)
            strain += (state[0] + state[1] + way * self.Y - stress) / self.modulus(eqps)
            stress = state[0] + state[1] + way * self.Y
            while way * (target - strain) > 0:
                first = self.rates(way, state)
                slope = self.modulus(eqps) + way * (first[0] + first[1])
                part = min(step, way * (target - strain) * self.modulus(eqps) / slope)
                second = self.rates(way, state + part * first)
                state = state + part * (first + second) / 2
                change = state[0] + state[1] + way * self.Y - stress
                strain += way * part + change / self.modulus(eqps + part / 2)
                stress, eqps = stress + change, eqps + part
                if part < step / 1e6:
                    break
            strain = target
            yield stress

    def test_cycles_follow_the_model(self):
        self.run_program("material", CYCLIC, "--quiet")
        expected = list(self.corners([0.01, -0.01, 0.01, -0.01]))
        for name in ("cycles", "sheet"):
            table = columns(self.path(f"material_cyclic-{name}.csv"))
            strain, stress = table["strain_11 [1]"], table["stress_11 [MPa]"]
            turns = np.flatnonzero(np.abs(np.abs(strain) - 0.01) < 1e-12)[:4]
            np.testing.assert_allclose(stress[turns], expected, atol=0.12)
            np.testing.assert_allclose(stress, columns(self.path("material_cyclic-cycles.csv"))
                                       ["stress_11 [MPa]"], atol=1e-6)
        tension = columns(self.path("material_cyclic-tension.csv"))["stress_11 [MPa]"]
        np.testing.assert_allclose(tension[-1], list(self.corners([0.2]))[0], atol=0.12)


BACK = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*PLASTIC, HARDENING=PERFECT
250
*BACK STRESS
300, 0
"""
SHEARED = """*BLANK, MATERIAL=steel, TYPE=BOX
x, 0, 1, 2, 1
y, 0, 1, 2, 1
z, 0, 1, 2, 1
*BOUNDARY
ALL, 2, 3
ETA_MIN, 1
*BOUNDARY, TYPE=VELOCITY
ETA_MAX, 1, 1, 1e4
*DYNAMIC, EXPLICIT
{end}
*OUTPUT, HISTORY=20
"""


class TestLargeShear(Folder):
    """Under the Jaumann rate s12 = 250/sqrt(3) + 100 sin(gamma) but for the elastic strain."""

    def test_a_test_tells_that_its_stress_falls(self):
        path = self.write(BACK + "".join(
            f"*MATERIAL TEST, NAME={name}, MATERIAL=steel, TYPE={kind}, INCREMENTS=400\n{strain}\n"
            for name, kind, strain in (("a", "SIMPLE SHEAR", 4.5), ("b", "SIMPLE SHEAR", 0.99),
                                       ("c", "UNIAXIAL", 1.5))))
        done = self.run_program("material", path)
        self.assertEqual(done.stderr.count("warning"), 1, done.stderr)
        self.assertIn("test a: the point sheared by 4.5:", done.stderr)
        self.assertIn("gamma 0 continued simple shear leaves 0 %", done.stderr)
        stress = columns(self.path("deck-a.csv"))["stress_12 [stress]"]
        gamma = np.array([1.5, 4.5])
        np.testing.assert_allclose(stress[[133, 400]], 250/3**0.5 + 100*np.sin(gamma), atol=1.5)

    def test_a_run_tells_it_once(self):
        for end, times in ((0.95e-4, 0), (1.5e-4, 1)):
            path = self.write(BACK + SHEARED.format(end=end))
            done = self.run_program(path, "--threads", "1")
            self.assertEqual(done.stderr.count("the blank has sheared by"), times, done.stderr)
        with open(self.path("deck.log"), encoding="utf-8") as log:
            self.assertIn("in element (1, 1, 1)", log.read())


class TestLimitStresses(Folder):
    def test_strains_of_a_curve_become_the_stresses_of_the_law(self):
        path = self.write(STEEL.format(hardening=250) + "*MATERIAL TEST, NAME=a, MATERIAL=steel, "
                          "TYPE=FORMING LIMIT\n0.98, 4\n")
        self.run_program("material", path)
        found = columns(self.path("deck-a.csv"))
        self.write("minor,major\n" + "".join(f"{minor},{major}\n" for minor, major in zip(
            found["minor [1]"], found["major [1]"])), "curve.csv")
        test = "*MATERIAL TEST, NAME=a, MATERIAL=steel, TYPE=LIMIT STRESS"
        path = self.write(STEEL.format(hardening=250) + test + ", INPUT=curve.csv\n")
        self.run_program("material", path)                 # over the table of before
        given = columns(self.path("deck-a.csv"))
        self.assertEqual(list(given), ["minor [1]", "major [1]", "stress_minor [stress]",
                                       "stress_major [stress]"])
        for name, values in given.items():
            np.testing.assert_allclose(values, found[name], rtol=1e-3, atol=0.5)
        # Plane strain: s1 = 2 s2 = 2/sqrt(3) of the flow stress after 2/sqrt(3) e1.
        path = self.write(STEEL.format(hardening=250) + test + ", INCREMENTS=1000\n0, 0.3\n")
        self.run_program("material", path)
        table = columns(self.path("deck-a.csv"))
        major = 2 / 3**0.5 * (500 - 250 * np.exp(-6 * 2 / 3**0.5 * (0.3 - 0.0022)))
        np.testing.assert_allclose(table["stress_major [stress]"], major, rtol=1e-3)
        np.testing.assert_allclose(table["stress_minor [stress]"], major / 2, rtol=2e-3)

    def test_strains_that_are_no_limits_are_refused(self):
        path = self.write(STEEL.format(hardening=250) + "*MATERIAL TEST, NAME=a, MATERIAL=steel, "
                          "TYPE=LIMIT STRESS\n0.1, 0.3\n0.4, 0.3\n")
        done = self.run_program("material", path, code=1)
        self.assertIn("deck.key:10: error: *MATERIAL TEST: found the minor strain 0.4 with the "
                      "major strain 0.3", done.stderr)


class TestDamage(Folder):
    """In uniaxial and equibiaxial tension the indicator is the plastic strain over b."""

    STEEL = STEEL.format(hardening=250) + "*DAMAGE INITIATION, CRITERION=HC\n1.3, {b}, 0.05\n"

    def test_a_table_has_the_indicator(self):
        path = self.write(self.STEEL.format(b=0.25) + "".join(
            f"*MATERIAL TEST, NAME={name}, MATERIAL=steel, TYPE={kind}, STRESS STATE=PLANE STRESS\n"
            "0.2\n" for name, kind in (("a", "UNIAXIAL"), ("b", "EQUIBIAXIAL"),
                                       ("c", "PLANE STRAIN"))))
        self.run_program("material", path)
        for name in "ab":
            table = columns(self.path(f"deck-{name}.csv"))
            np.testing.assert_allclose(table["state_damage [1]"], table["eqps [1]"] / 0.25,
                                       rtol=1e-9)
        table = columns(self.path("deck-c.csv"))
        growth = np.diff(table["state_damage [1]"])[-20:] / np.diff(table["eqps [1]"])[-20:]
        a, c, difference = 1.3, 0.05, 1 / 3**0.5      # of principal stresses over that of von Mises
        h = (difference**a + 0.5 * (2 * difference)**a)**(1 / a) + 2 * c * difference
        np.testing.assert_allclose(growth, (h / (1 + c))**10 / 0.25, rtol=1e-3)

    def test_a_run_shows_it_and_warns_once(self):
        for element, places in PLACES.items():
            strip = STRIP.split("*BLANK", maxsplit=1)[1].format(element=element, **places)
            path = self.write(self.STEEL.format(b=0.04) + "*BLANK"
                              + strip.replace("2090-T3", "steel"))
            done = self.run_program(path, "--quiet")
            self.assertEqual(done.stderr.count("fracture is expected"), 1, done.stderr)
            with h5py.File(self.path("deck.h5")) as file:
                fields = file["VTKHDF/PointData"]
                top = "_top" if element == "SHELL" and "eqps_top" in fields else ""
                strain, damage = fields["eqps" + top][:], fields["damage" + top][:]
                state = file["points/statev"][..., -1]
            np.testing.assert_allclose(damage, strain / 0.04, atol=1e-6)
            self.assertGreater(damage.max(), 1.1)
            self.assertAlmostEqual(state.max(), damage.max(), delta=1e-6)


class TestUserRoutine(Folder):
    def test_a_umat_is_led_as_the_built_in_law(self):
        tests = (TENSION.format(name="a", strain=0.3) + "*MATERIAL TEST, NAME=b, MATERIAL=steel, "
                 "TYPE=SIMPLE SHEAR\n1\n*MATERIAL TEST, NAME=c, MATERIAL=steel, TYPE=YIELD LOCUS\n"
                 "12\n")
        own = STEEL.split("*PLASTIC", maxsplit=1)[0] + ("*USER MATERIAL, CONSTANTS=5\n210000, 0.3, "
                                                        "250, 250, 6\n*DEPVAR\n1\n1, EQPS\n")
        self.run_program("material", self.write(STEEL.format(hardening=250) + tests, "law.key"))
        path = self.write(own + tests, "own.key")
        self.run_program("material", path, "--user", os.path.join(PROJECT, "input", "umat_voce.f"))
        with h5py.File(self.path("law.h5")) as law, h5py.File(self.path("own.h5")) as umat:
            for name in "abc":
                np.testing.assert_allclose(umat["tests"][name]["stress"],
                                           law["tests"][name]["stress"], rtol=1e-9, atol=5e-8)
                np.testing.assert_allclose(umat["tests"][name]["eqps"],
                                           law["tests"][name]["eqps"], rtol=1e-9, atol=1e-12)

    def test_a_vumat_has_its_own_rate(self):
        elastic = STEEL.split("*PLASTIC", maxsplit=1)[0]
        path = self.write(elastic + "*USER MATERIAL, CONSTANTS=2, TYPE=VUMAT\n210000, 0.3\n"
                          "*MATERIAL TEST, NAME=a, MATERIAL=steel, TYPE=SIMPLE SHEAR, "
                          "INCREMENTS=1000\n1\n")
        self.run_program("material", path, "--user", self.write(VUMAT, "elastic.f"))
        with h5py.File(self.path("deck.h5")) as file:
            # Green-Naghdi rate; the Jaumann rate gives other stresses.
            np.testing.assert_allclose(file["tests/a/stress"][-1, [0, 1, 3]],
                                       [33591.930122, -33591.930122, 70251.780068], rtol=1e-6)

    def test_a_umat_needs_its_file(self):
        path = self.write(STEEL.split("*PLASTIC", maxsplit=1)[0] + "*USER MATERIAL, CONSTANTS=0\n"
                          + TENSION.format(name="a", strain=0.3))
        done = self.run_program("material", path, code=1)
        self.assertIn("--user FILE", done.stderr)


def turning_paths(count=24):
    """Strain directions at the starts and ends of the paths of the study of returns."""
    seed = 1
    ways = np.empty((2, count, 6))
    for way in ways.reshape(-1, 6):
        for k in range(6):
            seed = 16807 * seed % 2147483647
            way[k] = 2 * seed / 2147483647 - 1
        way[:3] -= way[:3].mean()
        way /= np.sqrt(2 / 3 * (np.sum(way[:3]**2) + 0.5 * np.sum(way[3:]**2)))
    return ways


def returned(increment, newton_steps):
    """Deviators at the ends of the paths by radial return for 500 - 250 exp(-6 eqps), worked out
    anew, with so many Newton steps to residuals that fall evenly to zero."""
    first, last = turning_paths()
    count = round(0.2 / increment)
    shear = 210000 / 2.6
    stress = np.zeros_like(first)
    eqps = np.zeros(len(first))
    for i in range(count):
        way = (i + 0.5) / count
        strain = ((1 - way) * first + way * last) * 0.2 / count
        stress += shear * strain * [2, 2, 2, 1, 1, 1]
        q = material.mises(stress)
        over = np.maximum(q - (500 - 250 * np.exp(-6 * eqps)), 0)
        grown = np.zeros_like(eqps)
        for stage in range(1, newton_steps + 1):
            left = 250 * np.exp(-6 * (eqps + grown))
            level = over * (newton_steps - stage) / newton_steps
            step = (q - 3 * shear * grown - 500 + left - level) / (3 * shear + 6 * left)
            grown += np.where(over > 0, step, 0)
        stress *= (1 - 3 * shear * grown / q)[:, None]
        eqps += grown
    return stress


class TestReturnStudy(Folder):
    def study(self, *potential):
        text = STEEL.format(hardening=250) + "\n".join([*potential, ""])
        done = self.run_program("material", self.write(text), "--return-study")
        self.assertIn("backward Euler", done.stdout)
        table = columns(self.path("deck-returns-steel.csv"))
        return {(int(n), increment): error
                for n, increment, error in zip(*list(table.values())[:3])}

    def test_errors_are_those_of_another_program(self):
        errors = self.study()
        self.assertEqual(len(errors), 28)
        limit = 2 * returned(1e-4, 30) - returned(2e-4, 30)
        for stages in (1, 10):
            for increment in (1e-3, 1e-2, 1e-1):
                off = returned(increment, stages) - limit
                expected = np.mean(material.mises(off) / material.mises(limit))
                np.testing.assert_allclose(errors[stages, increment], expected, rtol=2e-3)
        # Backward Euler: all that Newton's method can do, and of first order.
        off = returned(1e-2, 30) - limit
        np.testing.assert_allclose(errors[0, 1e-2], np.mean(material.mises(off)
                                                            / material.mises(limit)), rtol=2e-3)
        np.testing.assert_allclose(errors[0, 1e-3] / errors[0, 1e-4], 10, rtol=0.02)

    def test_barlats_function_has_von_mises_as_a_limit(self):
        mises = self.study()
        barlat = self.study("*POTENTIAL, TYPE=YLD91", "1, 1, 1, 1, 1, 1, 2", "*ORIENTATION",
                            "0, 0, 1, 1, 0, 0")
        for case, error in mises.items():
            self.assertAlmostEqual(barlat[case] / error, 1, delta=1e-5)

    def test_stages_cost_accuracy_where_the_normal_turns(self):
        deck = os.path.join(PROJECT, "input", "material_returns.key")
        self.run_program("material", deck, "--return-study")
        table = columns(self.path("material_returns-returns-yld91.csv"))
        errors = {(int(n), increment): error
                  for n, increment, error in zip(*list(table.values())[:3])}
        for increment in (1e-4, 1e-3, 1e-2, 1e-1):
            row = [errors[n, increment] for n in (1, 2, 5, 10, 20, 50, 0)]
            self.assertEqual(row, sorted(row, reverse=True))

    def test_a_law_without_a_return_is_refused(self):
        path = self.write(STEEL.split("*PLASTIC", maxsplit=1)[0])
        done = self.run_program("material", path, "--return-study", code=1)
        self.assertIn("no material with *PLASTIC", done.stderr)


class TestPicture(Folder):
    def run_post(self, *arguments):
        return subprocess.run([sys.executable, "-m", "post", *arguments], cwd=PROJECT,
                              capture_output=True, text=True, check=False)

    def test_pictures_are_drawn(self):
        self.run_program("material", EXAMPLE, "--quiet")
        results = self.path("material_tests.h5")
        for chosen in ([], ["--tests", "tension"], ["--tests", "yield locus", "r-values"]):
            out = self.path("picture.png")
            done = self.run_post("material", results, "-o", out, *chosen)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertGreater(os.path.getsize(out), 10000)
            os.remove(out)
        done = self.run_post("material", results, "--tests", "tensoin")
        self.assertIn("there is no test 'tensoin'; the tests are", done.stderr)
        self.assertEqual(done.returncode, 1)
        done = self.run_post("history", results)
        self.assertIn("holds no frames", done.stderr)
        self.assertEqual(done.returncode, 1)

    def test_measures_are_those_of_von_mises(self):
        stress = np.array([[100.0, 0, 0, 0, 0, 0], [0, 0, 0, 100, 0, 0], [50, 50, 50, 0, 0, 0]])
        np.testing.assert_allclose(material.mises(stress), [100, 173.20508, 0], atol=1e-5)
        strain = np.array([[0.0] * 6, [0.2, -0.1, -0.1, 0, 0, 0], [0.2, -0.1, -0.1, 0.3, 0, 0]])
        np.testing.assert_allclose(material.path_length(strain), [0, 0.2, 0.2 + 0.3 / 3**0.5])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
