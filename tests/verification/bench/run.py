"""The benchmark program: options, records, comparison, pictures.

Usage: run.py IGAFORM_BENCH PROJECT_FOLDER
"""
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest

PROGRAM, PROJECT = (os.path.abspath(path) for path in sys.argv[1:3])
CHOSEN = ("p2/2x2x3/voce/plain/def", "p2/2x2x3/elastic", "elements/8000", "contact/closest_point",
          "contact/step", "update", "scatter", "history", "frame")
NUMBERS = {"ns", "median", "spread", "repetitions", "threads"}
OPTIONAL = {"ns_per_point", "flops", "bytes", "working_set", "share_of_bound", "target",
            "memory_ratio"}


class Bench(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        arguments = [word for name in CHOSEN for word in ("--only", name)]
        cls.first = cls.bench("--quick", "--threads", "2", "--json", "a.json", *arguments)
        with open(os.path.join(cls.folder.name, "a.json"), encoding="utf-8") as file:
            cls.records = json.load(file)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def bench(cls, *arguments):
        return subprocess.run([PROGRAM, *arguments], cwd=cls.folder.name, capture_output=True,
                              text=True, check=False)

    def test_run_succeeds(self):
        self.assertEqual(self.first.returncode, 0, self.first.stderr)
        self.assertEqual(self.first.stderr, "")

    def test_records_are_well_formed(self):
        for record in self.records:
            with self.subTest(record["name"], threads=record["threads"]):
                for key in NUMBERS:
                    self.assertTrue(math.isfinite(record[key]))
                for key in OPTIONAL:
                    self.assertTrue(record[key] is None or record[key] > 0)
                self.assertGreater(record["ns"], 0)
                self.assertGreaterEqual(record["median"], record["ns"])
                self.assertGreaterEqual(record["repetitions"], 3)
                self.assertTrue(record["per"])
                if record["target"] is not None:
                    self.assertEqual(record["is_met"], record["ns"] <= record["target"])

    def test_names_and_threads(self):
        found = {(record["name"], record["threads"]) for record in self.records}
        self.assertEqual(len(found), len(self.records))
        for name in ("machine/multiply_add", "machine/triad/3200", "contact/closest_point",
                     "force/p2/2x2x3/voce/plain/default", "elements/8000", "update"):
            self.assertIn((name, 1), found)
            self.assertIn((name, 2), found)
        self.assertIn(("history", 1), found)
        self.assertNotIn(("history", 2), found)

    def test_time_per_point_and_bound(self):
        for record in self.records:
            if record["name"] == "force/p2/2x2x3/voce/plain/default":
                self.assertAlmostEqual(record["ns_per_point"], record["ns"] / 12, places=3)
                self.assertGreater(record["share_of_bound"], 0)
                self.assertIsNotNone(record["target"])
                self.assertTrue(1 < record["memory_ratio"] < 2, record["memory_ratio"])

    def test_comparison_with_itself(self):
        result = self.bench("--quick", "--threads", "1", "--only", "contact/closest_point",
                            "--compare", "a.json")
        self.assertEqual(result.returncode, 0, result.stderr)
        line = next(line for line in result.stdout.splitlines()
                    if line.startswith("contact/closest_point") and "+-" in line)
        self.assertGreater(float(line.split()[2]), 0)

    def test_faults(self):
        for arguments, message in (
                (("--qiuck",), "unknown option '--qiuck'; nearest is --quick"),
                (("--only",), "option --only needs a value"),
                (("--threads", "0"), "needs a whole number of at least 1"),
                (("--only", "histroy"), "the options choose no record"),
                (("--only", "history", "--json", "none/a.json"), "cannot write 'none/a.json'"),
                (("--compare", "none.json"), "cannot read 'none.json'"),
                (("--compare", __file__), "expected '['")):
            result = self.bench(*arguments)
            self.assertEqual(result.returncode, 1)
            self.assertIn(message, result.stderr)

    def test_list_names_what_runs(self):
        names = self.bench("--list").stdout.split()
        self.assertEqual(len(set(names)), len(names))
        self.assertIn("contact/refined/1000000", names)
        self.assertNotIn("contact/refined/1000000", self.bench("--list", "--quick").stdout)

    def test_targets_choose_what_has_one(self):
        names = self.bench("--list", "--targets").stdout.split()
        self.assertIn("step/channel", names)
        self.assertIn("force/p2/3x3x3/voce/plain/bbar_smooth", names)
        self.assertNotIn("force/p2/2x2x3/swift/plain/default", names)
        some = self.bench("--list", "--targets", "--only", "step/", "--only", "history")
        self.assertEqual(some.stdout.split(), ["step/channel"])

    def test_nothing_is_left_behind(self):
        left = os.path.join(self.folder.name, "igaform_cache")
        self.assertEqual([name for name in os.listdir(left) if name.endswith((".h5", ".txt"))], [])

    def test_picture(self):
        try:
            import matplotlib  # noqa: F401  pylint: disable=unused-import,import-outside-toplevel
        except ImportError:
            self.skipTest("no matplotlib")
        picture = os.path.join(self.folder.name, "bench.png")
        result = subprocess.run([sys.executable, "-m", "post", "bench",
                                 os.path.join(self.folder.name, "a.json"), "--out", picture],
                                cwd=PROJECT, capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertGreater(os.path.getsize(picture), 10000)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
