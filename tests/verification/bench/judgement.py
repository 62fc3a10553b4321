"""What `python -m post bench` makes of records: share of the machine's bound, targets, comparison
of two runs; and what it says of files that are none of the benchmark's.

Usage: judgement.py PROJECT_FOLDER
"""
import json
import os
import subprocess
import sys
import tempfile
import unittest

PROJECT = os.path.abspath(sys.argv[1])
sys.path.insert(0, PROJECT)

from post.bench_records import find, read, share_of_bound  # noqa: E402
from post.bench_report import comparison_table, record_table  # noqa: E402
from post.bench_targets import verdicts  # noqa: E402
from post.results import ResultsError  # noqa: E402

SIZES = (200, 800, 3200, 12800, 51200, 204800)     # of the triads [kB]


def record(name, threads, ns, **others):
    """One record, with what is not known left out, as files of old may do."""
    return {"name": name, "threads": threads, "ns": ns, "spread": 0.1, "per": "point"} | others


def machine(threads=(1, 2, 3), triad=1.0):
    """A machine of 1 Gflop/s and, where the working set is small, 1 GB/s."""
    return [each for t in threads for each in (
        record("machine/multiply_add", t, 1.0),
        *(record(f"machine/triad/{size}", t, triad + i) for i, size in enumerate(SIZES)))]


class Files(unittest.TestCase):
    """A folder for files of records."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name="now.json"):
        return os.path.join(self.folder.name, name)

    def write(self, content, name="now.json"):
        """The path of a file with this text, or with records as JSON."""
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(content if isinstance(content, str) else json.dumps(content))
        return self.path(name)

    def records(self, *added):
        """What is read from a file with a machine and these."""
        return read(self.write([*machine(), *added]))

    def lines(self, *added):
        """The verdicts on these as text."""
        return [str(verdict) for verdict in verdicts(self.records(*added))]

    def post(self, *arguments):
        return subprocess.run([sys.executable, "-m", "post", "bench", *arguments], cwd=PROJECT,
                              capture_output=True, text=True, check=False)


class Reading(Files):
    def fault_of(self, content):
        with self.assertRaises(ResultsError) as caught:
            read(self.write(content))
        return str(caught.exception)

    def test_files_that_cannot_be_read(self):
        with self.assertRaisesRegex(ResultsError, "cannot read .*none.json': No such file"):
            read(self.path("none.json"))
        with self.assertRaisesRegex(ResultsError, "cannot read .*': Is a directory"):
            read(self.folder.name)

    def test_texts_that_are_no_json_name_the_line(self):
        self.assertIn("is not JSON: Expecting value: line 1", self.fault_of(""))
        self.assertIn("is not JSON: Expecting ':' delimiter: line 2",
                      self.fault_of('[\n{"name" "a"}]'))
        self.assertIn("is not JSON: Extra data", self.fault_of("[] x"))
        self.assertIn("is not JSON", self.fault_of("[" * 100000))

    def test_json_of_another_kind(self):
        self.assertIn("holds no list of records of igaform_bench", self.fault_of("{}"))
        self.assertIn("holds no records of igaform_bench: number 1 is no object",
                      self.fault_of("[1]"))
        self.assertIn("holds no record", self.fault_of("[ ]"))

    def test_records_without_name_threads_time_or_spread(self):
        for changed, message in (
                ({"name": ""}, "has no name"), ({"name": 1}, "has a name or unit that is no text"),
                ({"threads": 0}, "has no number of threads"),
                ({"threads": 1.5}, "has no number of threads"),
                ({"threads": True}, "has no number of threads"),
                ({"ns": None}, "has no time 'ns' above 0"), ({"ns": 0}, "has no time 'ns' above 0"),
                ({"ns": "2"}, "has no time 'ns' above 0"),
                ({"ns": True}, "has no time 'ns' above 0"),
                ({"ns": float("nan")}, "has no time 'ns' above 0"),
                ({"ns": 10**400}, "has no time 'ns' above 0"),
                ({"spread": -1}, "has no 'spread' of at least 0"),
                ({"flops": "many"}, "has 'flops' that is neither null nor a number")):
            with self.subTest(changed):
                fault = self.fault_of([*machine((1,)), record("a", 1, 2.0) | changed])
                self.assertIn(f"number {len(machine((1,))) + 1} {message}", fault)

    def test_each_number_of_threads_needs_its_machine(self):
        self.assertIn("holds no measurement of the machine with 2 threads",
                      self.fault_of([*machine((1,)), record("update", 2, 3.0)]))
        for some in (machine((1,))[:1], machine((1,))[1:]):
            self.assertIn("holds no measurement of the machine with 1 thread",
                          self.fault_of(some))

    def test_unknown_keys_are_passed_over_and_missing_ones_not_known(self):
        found = find(self.records(record("a", 1, 2.0, new=[])), "a", 1)
        self.assertIsNone(found["memory_ratio"])
        self.assertEqual(found["ns"], 2.0)


class Bound(Files):
    def share(self, **others):
        records = self.records(record("a", 1, 100.0, **others))
        return share_of_bound(records, records[-1])

    def test_the_slower_of_both_bounds_counts(self):
        self.assertAlmostEqual(self.share(flops=50, bytes=20), 0.5)
        self.assertAlmostEqual(self.share(flops=50, bytes=80), 0.8)
        self.assertAlmostEqual(self.share(flops=50), 0.5)

    def test_without_operations_there_is_no_bound(self):
        self.assertIsNone(self.share(bytes=20))

    def test_the_bandwidth_is_that_of_the_working_set(self):
        self.assertAlmostEqual(self.share(flops=1, bytes=10, working_set=2e5), 0.1)
        self.assertAlmostEqual(self.share(flops=1, bytes=10, working_set=2.001e5), 0.2)
        self.assertAlmostEqual(self.share(flops=1, bytes=10, working_set=5e7), 0.5)
        self.assertAlmostEqual(self.share(flops=1, bytes=10, working_set=1e12), 0.6)

    def test_table(self):
        table = record_table(self.records(
            record("a", 2, 12345.0, spread=0.25, ns_per_point=0.5, flops=2469))).splitlines()
        self.assertEqual(table[-1].split(), ["a", "2", "1.23E+04", "25.0", "0.5000", "20.0",
                                             "point"])
        self.assertEqual(table[-2].split()[:5], ["machine/triad/204800", "3", "6.0", "10.0", "-"])


class Targets(Files):
    def test_parts_of_the_bound_depend_on_rule_and_weights(self):
        found = self.lines(record("force/p2/2x2x3/voce/plain/default", 1, 100.0, flops=71.0),
                           record("force/p2/3x3x3/voce/plain/default", 1, 100.0, flops=71.0),
                           record("force/p2/2x2x2/voce/rational/default", 1, 100.0, flops=56.0),
                           record("force/p2/2x2x2/voce/plain/no_viscosity", 1, 100.0, flops=9.0))
        self.assertEqual([line.split()[0] for line in found], ["missed", "met", "met"])
        self.assertIn("met     force/p2/2x2x3/voce/plain/default, part of the bound"
                      "                0.71  target    0.70", found)

    def test_without_operations_no_part_of_the_bound_is_judged(self):
        self.assertEqual(self.lines(record("force/p2/2x2x3/voce/plain/default", 1, 100.0)), [])

    def test_laws_are_judged_by_ratios_to_voce(self):
        found = self.lines(record("force/p2/2x2x3/voce/plain/default", 1, 100.0),
                           record("force/p2/2x2x3/hill48/plain/default", 1, 170.0),
                           record("force/p2/2x2x3/chaboche/plain/default", 1, 201.0),
                           record("force/p2/2x2x3/elastic/plain/default", 1, 300.0))
        self.assertEqual([line.split()[0] for line in found], ["met", "missed"])
        self.assertIn("missed  force/p2/2x2x3/chaboche/plain/default, over Voce"
                      "                    2.01  target    2.00", found)

    def test_weights_are_judged_by_ratios(self):
        found = self.lines(record("force/p2/2x2x3/voce/plain/default", 1, 240.0),
                           record("force/p2/2x2x3/voce/rational/default", 1, 400.0),
                           record("force/p2/2x2x2/voce/plain/default", 1, 100.0),
                           record("force/p2/2x2x2/voce/rational/default", 1, 160.0))
        self.assertIn("missed  force/p2/2x2x3/voce/rational/default, 1 thread, over plain"
                      "          1.67  target    1.60", found)
        self.assertIn("met     force/p2/2x2x2/voce/rational/default, 1 thread, over plain"
                      "          1.60  target    1.60", found)

    def test_the_whole_step_is_measured_by_its_elements(self):
        found = self.lines(record("step/channel", 1, 310.0),
                           record("step/channel/blank", 1, 200.0),
                           record("step/channel/contact_lower_die", 1, 150.0),
                           record("step/channel/contact_upper_die", 1, 60.0))
        self.assertEqual([" ".join(line.split()) for line in found],
                         ["missed step/channel, 1 thread, over elements 1.55 target 1.50",
                          "missed step/channel, contact over elements 1.05 target 1.00"])

    def test_memory_and_projections(self):
        found = self.lines(
            record("force/p2/2x2x6/voce/plain/default", 1, 300.0, memory_ratio=2.1),
            record("force/p1/2x2x2/voce/plain/default", 1, 300.0, memory_ratio=1.9),
            record("force/p2/3x3x4/voce/plain/default", 1, 36.0, ns_per_point=1.0),
            record("force/p2/3x3x3/voce/plain/bbar_smooth", 1, 54.0, ns_per_point=2.0),
            record("force/p2/4x4x4/voce/plain/bbar_smooth", 1, 108.0, ns_per_point=4.0))
        self.assertEqual([" ".join(line.split()[:4]) for line in found],
                         ["missed force/p2/2x2x6/voce/plain/default, memory over",
                          "met force/p1/2x2x2/voce/plain/default, memory over",
                          "met force/p2/3x3x3/voce/plain/bbar_smooth, over plain",
                          "missed force/p2/4x4x4/voce/plain/bbar_smooth, over plain"])

    def test_the_general_routine_is_judged_by_points(self):
        found = self.lines(
            record("force/p2/3x3x3/voce/plain/default", 1, 270.0, ns_per_point=10.0),
            record("force/p3/4x4x4/voce/plain/default", 1, 1900.0, ns_per_point=29.0),
            record("force/p4/4x4x4/voce/plain/default", 1, 1900.0),
            record("force/p5/5x5x5/voce/plain/default", 1, 4000.0, ns_per_point=32.0))
        self.assertEqual([" ".join(line.split()[:2]) for line in found],
                         ["met force/p3/4x4x4/voce/plain/default,",
                          "missed force/p5/5x5x5/voce/plain/default,"])

    def test_two_threads_are_held_to_their_share(self):
        for name, two, word in (("elements/8000", 111.0, "met"), ("elements/8000", 112.0, "missed"),
                                ("force/p2/2x2x3/voce/plain/default", 105.0, "met"),
                                ("force/p2/2x2x3/voce/plain/default", 106.0, "missed")):
            *_, line = self.lines(record(name, 1, 200.0), record(name, 2, two))
            self.assertEqual(line.split()[:3], [word, f"{name},", "efficiency"])

    def test_cost_may_grow_as_the_logarithm(self):
        found = self.lines(record("search/faces/100", 1, 200.0),
                           record("search/faces/100000", 1, 490.0),
                           record("search/faces/1000000", 1, 610.0))
        self.assertEqual([" ".join(line.split()) for line in found],
                         ["met search/faces/100000 over 100 2.45 target 2.50",
                          "missed search/faces/1000000 over 100 3.05 target 3.00"])

    def test_without_targets_there_is_no_verdict(self):
        self.assertEqual(self.lines(record("history", 1, 200.0)), [])


class Comparison(Files):
    def test_slower_and_faster_only_beyond_the_spread(self):
        now = self.records(record("a", 1, 120.0, spread=0.06), record("a", 2, 120.0),
                           record("b", 1, 80.0, spread=0.08), record("c", 1, 1.0))
        before = read(self.write([*machine(), record("a", 1, 100.0, spread=0.08),
                                  record("a", 2, 100.0, spread=0.2),
                                  record("b", 1, 100.0, spread=0.06)]))
        lines = [line.split() for line in comparison_table(now, before).splitlines()]
        self.assertEqual(lines[-4:], [["a", "1", "1.200", "+-", "0.120", "slower"],
                                      ["a", "2", "1.200", "+-", "0.268"],
                                      ["b", "1", "0.800", "+-", "0.080", "faster"],
                                      ["1", "record", "is", "new"]])


class Command(Files):
    """The exit code, what is printed, and when there is a picture."""

    def test_targets_give_the_exit_code(self):
        for ns, code, word in ((200.0, 0, "met"), (600.0, 1, "missed")):
            path = self.write([*machine(), record("force/p2/2x2x3/voce/plain/default", 1, ns,
                                                  flops=180.0)])
            result = self.post(path, "--targets")
            self.assertEqual((result.returncode, result.stdout.split()[0]), (code, word),
                             result.stderr)
        self.assertEqual(os.listdir(self.folder.name), ["now.json"])

    def test_faults_are_one_line(self):
        path = self.write([*machine(), record("update", 1, 200.0)])
        for arguments, message in (
                ((path, "--targets"), "holds no record that has a target"),
                ((path, "--compare", self.path("none.json")), "cannot read"),
                ((path, "--compare", __file__), "is not JSON"),
                ((path, "--out", self.path("a.xyz")), "is no picture format"),
                ((path, "--out", self.path("a.png")), "nothing to draw")):
            result = self.post(*arguments)
            self.assertEqual(result.returncode, 1)
            self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
            self.assertIn(message, result.stderr)

    def test_without_options_there_are_table_and_picture(self):
        path = self.write([*machine(), record("update", 1, 200.0)])
        result = self.post(path)
        self.assertEqual((result.returncode, result.stdout.split()[-5]), (0, "200.0"))
        self.assertEqual(os.listdir(self.folder.name), ["now.json"])
        self.write([*machine(), record("elements/100", 1, 200.0),
                    record("force/p2/2x2x3/voce/plain/default", 1, 600.0, flops=9, bytes=3)])
        self.assertEqual(self.post(path).returncode, 0)
        self.assertIn("now-bench.png", os.listdir(self.folder.name))

    def test_all_at_once(self):
        path = self.write([*machine(), record("elements/8000", 1, 200.0),
                           record("elements/8000", 2, 200.0)])
        result = self.post(path, "--compare", path, "--targets", "--out", self.path("all.png"))
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("1.000 +-", result.stdout)
        self.assertIn("missed  elements/8000", result.stdout)
        self.assertIn("all.png", os.listdir(self.folder.name))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
