"""The benchmark program: options, records, and what `python -m post bench` makes of them.

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
OPTIONAL = {"ns_per_point", "flops", "bytes", "working_set", "memory_ratio"}
# The words of docs/speed.md that choose what has a target.
WITH_TARGETS = ("/voce/", "p2/2x2x3/", "elements/8000", "/faces/", "/refined/", "step/channel",
                "shell/p2/2x2/6/", "contact/die/")


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
                self.assertEqual(set(record), NUMBERS | OPTIONAL | {"name", "per"})

    def test_names_and_threads(self):
        found = {(record["name"], record["threads"]) for record in self.records}
        self.assertEqual(len(found), len(self.records))
        for name in ("machine/multiply_add", "machine/triad/3200", "contact/closest_point",
                     "force/p2/2x2x3/voce/plain/default", "elements/8000", "update"):
            self.assertIn((name, 1), found)
            self.assertIn((name, 2), found)
        self.assertIn(("history", 1), found)
        self.assertNotIn(("history", 2), found)

    def test_time_per_point_and_memory(self):
        for record in self.records:
            if record["name"] == "force/p2/2x2x3/voce/plain/default":
                self.assertAlmostEqual(record["ns_per_point"], record["ns"] / 12, places=3)
                self.assertGreater(record["flops"], 0)
                self.assertTrue(1 < record["memory_ratio"] < 2, record["memory_ratio"])

    def test_faults(self):
        for arguments, message in (
                (("--qiuck",), "'--qiuck'; nearest is --quick"),
                (("--only",), "--only"),
                (("--threads", "0"), "at least 1"),
                (("--only", "histroy"), "no record"),
                (("--only", "history", "--json", "none/a.json"), "'none/a.json'")):
            result = self.bench(*arguments)
            self.assertEqual(result.returncode, 1)
            self.assertIn(message, result.stderr)

    def test_what_judges_is_refused_in_one_line(self):
        for arguments in (("--targets",), ("--compare", "a.json")):
            result = self.bench(*arguments)
            self.assertEqual((result.returncode, result.stdout), (1, ""))
            self.assertEqual(result.stderr.count("\n"), 1)
            for word in (arguments[0], "python -m post bench FILE"):
                self.assertIn(word, result.stderr)

    def test_list_names_what_runs(self):
        names = self.bench("--list").stdout.split()
        self.assertEqual(len(set(names)), len(names))
        self.assertIn("contact/refined/1000000", names)
        self.assertNotIn("contact/refined/1000000", self.bench("--list", "--quick").stdout)

    def test_words_choose_all_that_has_a_target(self):
        post = self.post_modules()
        arguments = [word for name in WITH_TARGETS for word in ("--only", name)]
        all_names, names = (self.bench("--list", *words).stdout.split()
                            for words in ((), arguments))
        self.assertLess(len(names), len(all_names))
        of_all, of_some = (post.verdicts([self.measured(name, threads) for name in some
                                          for threads in (1, 2)]) for some in (all_names, names))
        self.assertEqual(of_some, of_all)
        for name in ("step/channel", *post.GENERAL, *post.EFFICIENCY, post.TUNED,
                     post.PLAIN_GENERAL,
                     *(stem + size for stem in post.GROWING for size in ("100", "1000000")),
                     *(f"force/p2/2x2x3/{law}/plain/default" for law in post.OVER_VOCE),
                     *(f"force/p2/{rule}/voce/{weights}/default" for rule in post.SHARES
                       for weights in ("plain", "rational"))):
            self.assertIn(name, names)

    @staticmethod
    def post_modules():
        """The targets, where Python has what the package needs."""
        sys.path.insert(0, PROJECT)
        try:
            from post import bench_targets  # pylint: disable=import-outside-toplevel
        except ImportError as fault:
            raise unittest.SkipTest(f"no {fault.name}") from fault
        return bench_targets

    @staticmethod
    def measured(name, threads):
        """A record as if it had been measured."""
        return {"name": name, "threads": threads, "ns": 1.0, "ns_per_point": 1.0,
                "memory_ratio": 1.0, "flops": None}

    def test_nothing_is_left_behind(self):
        left = os.path.join(self.folder.name, "igaform_cache")
        self.assertEqual([name for name in os.listdir(left) if name.endswith((".h5", ".txt"))], [])

    def test_judgement_and_picture(self):
        self.post_modules()
        try:
            import matplotlib  # noqa: F401  pylint: disable=unused-import,import-outside-toplevel
        except ImportError:
            self.skipTest("no matplotlib")
        path, picture = (os.path.join(self.folder.name, name) for name in ("a.json", "bench.png"))
        result = subprocess.run([sys.executable, "-m", "post", "bench", path, "--compare", path,
                                 "--targets", "--out", picture],
                                cwd=PROJECT, capture_output=True, text=True, check=False)
        self.assertIn(result.returncode, (0, 1), result.stderr)   # no time is asserted
        self.assertEqual(result.stderr, "")
        self.assertRegex(result.stdout, r"contact/closest_point +1 +1\.000 \+-")
        self.assertIn("  force/p2/2x2x3/voce/plain/default, memory over state", result.stdout)
        self.assertGreater(os.path.getsize(picture), 10000)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
