"""Studies: a small one from TOML to table and page, resumed without repeating what is finished.

Usage: test_study.py IGAFORM PROJECT_FOLDER
"""
import glob
import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import h5py

IGAFORM, PROJECT = (os.path.abspath(path) for path in sys.argv[1:3])
sys.path.insert(0, PROJECT)

from post.results import ResultsError  # noqa: E402
from post.study import choice, figures, page, spec, table  # noqa: E402

STUDY = """
title = "Mesh of the pulled strip"
about = "Elements along and across."
deck = "strip.key"
budget = 60
[[peers]]
name = "bricks"
seconds = 3
mean_plastic_strain = 1.5
[set]
frames = 1
[[runs]]
n_x = [2, 4]
n_y = [1, 2]
[default]
n_x = 4
n_y = 2
[limits]
mean_plastic_strain = 2
[plot]
colour = "n_x"
[[choose]]
when = "anything will do"
mean_plastic_strain = 50
"""
# Plastic strain p of ln 1.1 = p + (500 - 250 exp(-6 p))/210000, the curve of the deck.
CLOSED_FORM = "[reference]\nvalues = { mean_plastic_strain = 0.09361 }\n"


def write(folder, name, text):
    path = os.path.join(folder, name)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return path


class TestStudy(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = self.temporary.name
        shutil.copy(os.path.join(PROJECT, "input", "tension_strip.key"), self.folder)
        write(self.folder, "strip.key", "*PARAMETER, DEFAULT\nframes = 2\n"
                                        "*INCLUDE, INPUT=tension_strip.key\n")
        self.work = os.path.join(self.folder, "work")

    def post(self, *arguments):
        done = subprocess.run([sys.executable, "-m", "post", *arguments], cwd=PROJECT,
                              capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, done.stderr

    def study(self, text, *more):
        path = write(self.folder, "mesh.toml", text)
        return self.post("study", path, "--igaform", IGAFORM, "--work", self.work, "--jobs", "2",
                         *more)

    def results(self):
        """Time of writing of each result file."""
        return {name: os.stat(os.path.join(self.work, name)).st_mtime_ns
                for name in os.listdir(self.work) if name.endswith(".h5") and name != "mesh.h5"}

    def test_finished_runs_are_not_repeated(self):
        code, said, fault = self.study(STUDY + CLOSED_FORM, "--store")
        self.assertEqual(code, 0, fault)
        self.assertIn("4 runs, 0 of them finished before", said)
        first = self.results()
        self.assertEqual(len(first), 4)
        rows = table.read_csv(os.path.join(self.work, "mesh.csv"))
        for row in rows:
            self.assertEqual(row["status"], "completed")
            self.assertLess(row["mean_plastic_strain_error"], 2)
            self.assertGreater(row["cpu_seconds"], 0.01)
            self.assertLess(abs(row["forecast_seconds"] / row["cpu_seconds"] - 1), 0.8)
        with h5py.File(os.path.join(self.work, "mesh.h5")) as file:
            self.assertEqual(list(file["set_n_x"][:]), [row["set_n_x"] for row in rows])

        self.assertIn("4 of them finished before", self.study(STUDY + CLOSED_FORM)[1])
        self.assertEqual(self.results(), first)

        # A file that says it is still running was left by an interruption.
        cut, gone, *_ = first
        with h5py.File(os.path.join(self.work, cut), "r+") as file:
            file["provenance"].attrs["status"] = "running"
        os.remove(os.path.join(self.work, gone))
        self.assertIn("2 of them finished before", self.study(STUDY + CLOSED_FORM)[1])
        again = self.results()
        self.assertEqual({name for name in first if again[name] == first[name]},
                         set(first) - {cut, gone})

        page = os.path.join(self.folder, "page.md")
        code, _, fault = self.post("study-page", self.folder, "-o", page)
        self.assertEqual(code, 0, fault)
        with open(page, encoding="utf-8") as file:
            text = file.read()
        self.assertIn("| | bricks | | 3 | mean plastic strain 1.5 % | |", text)
        self.assertRegex(text, r"\| \| igaform \| `n_x=.* \| met \|")
        self.assertIn("| anything will do | mean plastic strain 50 | `n_x=", text)
        self.assertTrue(os.path.isfile(os.path.join(self.folder, "pictures", "accuracy_mesh.png")))

    def test_a_study_that_is_stopped_leaves_no_run_behind(self):
        path = write(self.folder, "mesh.toml", STUDY.replace("n_x = [2, 4]", "n_x = [64, 4]")
                     + CLOSED_FORM)
        process = subprocess.Popen([sys.executable, "-m", "post", "study", path, "--igaform",
                                    IGAFORM, "--work", self.work, "--jobs", "1"], cwd=PROJECT,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while process.poll() is None and not (os.path.isdir(self.work) and self.results()):
            time.sleep(0.05)
        process.terminate()
        _, fault = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1)
        self.assertIn("0 of 4 runs finished", fault)
        name, = (name for name in self.results() if not name.endswith(".ckpt.h5"))
        with h5py.File(os.path.join(self.work, name)) as file:
            self.assertEqual(file["provenance"].attrs["status"].decode(), "interrupted")

    def test_a_change_of_an_included_file_is_another_run(self):
        self.assertIn("4 runs, 0 of them finished before", self.study(STUDY + CLOSED_FORM)[1])
        with open(os.path.join(self.folder, "tension_strip.key"), "a", encoding="utf-8") as file:
            file.write("*HISTORY POINT, NAME=middle\n0.5, 0.5, 0.5\n")
        self.assertIn("4 runs, 0 of them finished before", self.study(STUDY + CLOSED_FORM)[1])

    def test_runs_may_have_parameters_that_others_lack(self):
        """As where a deck includes one file or another, each with parameters of its own."""
        for how, name in (("even", "count"), ("long", "cells")):
            write(self.folder, f"{how}.inc", f"*PARAMETER, DEFAULT\n{name} = 2\nn_x = {name}\n")
        write(self.folder, "strip.key", '*PARAMETER, DEFAULT\nframes = 2\nhow = "even"\n'
                                        "*INCLUDE, INPUT=<how>.inc\n"
                                        "*INCLUDE, INPUT=tension_strip.key\n")
        text = (STUDY + CLOSED_FORM).replace(
            "n_x = [2, 4]\nn_y = [1, 2]\n[default]\nn_x = 4\nn_y = 2\n",
            'how = "even"\ncount = [1, 2]\n[[runs]]\nhow = "long"\ncells = 3\n').replace(
            'colour = "n_x"', 'colour = "how"\nmarker = "count"\nlabel = ["count", "cells"]')
        code, said, fault = self.study(text)
        self.assertEqual(code, 0, said + fault)
        rows = table.read_csv(os.path.join(self.work, "mesh.csv"))
        self.assertEqual([(row.get("set_count"), row.get("set_cells")) for row in rows],
                         [(1, None), (2, None), (None, 3)])
        self.assertEqual([row["elements"] for row in rows], sorted(row["elements"] for row in rows))
        panel = figures.draw(spec.read_study(os.path.join(self.folder, "mesh.toml")), rows).axes[0]
        self.assertEqual([one.get_text() for one in panel.texts][:3], ["1", "2", "3"])

    def test_all_faults_of_a_study_are_told_at_once(self):
        path = write(self.folder, "bad.toml",
                     STUDY.replace("title", "titel").replace("strip.key", "none.key")
                     .replace("mean_plastic_strain = 2", "shap = 1\nthickness = -1")
                     .replace("n_x = 4", "n_z = 4") + "[reference]\nrun = {}\nvalues = {}\n")
        code, _, fault = self.post("study", path, "--igaform", IGAFORM)
        self.assertEqual(code, 1)
        for part in ("titel: ", "did you mean title?", "title: found nothing",
                     "deck: found 'none.key'", "limits.shap", "did you mean shape?",
                     "limits.thickness: found -1", "reference: found run and values"):
            self.assertIn(part, fault)

    def test_a_parameter_that_no_deck_has_is_told(self):
        code, _, fault = self.study(STUDY.replace("n_y = [1, 2]", "n_q = [1, 2]")
                                    .replace("n_y = 2\n", "") + CLOSED_FORM)
        self.assertEqual(code, 1)
        self.assertIn("N_Q", fault)
        self.assertIn("in 4 of the runs", fault)

    def test_the_reference_may_not_be_a_run_that_is_judged(self):
        code, _, fault = self.study(STUDY + "[reference]\nrun = { n_x = 4, n_y = 1 }\n")
        self.assertEqual(code, 1)
        self.assertIn("found a run that is one of those drawn", fault)

    def test_a_broken_file_is_told_with_its_line(self):
        with self.assertRaisesRegex(ResultsError, "not TOML: .*line 2"):
            spec.read_study(write(self.folder, "broken.toml", "title = 1\n= 2\n"))


class TestChoice(unittest.TestCase):
    rows = [{"status": "completed", "cpu_seconds": cost, "shape_error": error}
            for cost, error in ((1, 0.9), (2, 0.4), (3, 0.5), (4, 0.1))]
    rows.append({"status": "failed", "cpu_seconds": 0.1})

    def test_the_front_leaves_out_what_is_beaten(self):
        best = choice.front(self.rows, {"shape": 0.5})
        self.assertEqual([row["cpu_seconds"] for row in best], [1, 2, 4])

    def test_the_cheapest_within_the_allowance_is_recommended(self):
        self.assertEqual(choice.recommended(self.rows, {"shape": 0.5})["cpu_seconds"], 2)

    def test_the_nearest_is_recommended_if_none_is_allowed(self):
        self.assertEqual(choice.recommended(self.rows, {"shape": 0.01})["cpu_seconds"], 4)

    def test_the_best_default_or_a_reason_in_each_shipped_study(self):
        files = sorted(glob.glob(os.path.join(PROJECT, "input", "studies", "*.toml")))
        self.assertGreater(len(files), 10)
        for file in files:
            study = spec.read_study(file)
            rows = table.read_csv(os.path.join(os.path.dirname(file), "results",
                                               f"{study.name}.csv"))
            usual = page.default_row(study, rows)
            is_best = any(row is usual for row in choice.front(rows, study.limits))
            with self.subTest(study=study.name):
                self.assertIsNotNone(usual)
                self.assertNotEqual(is_best, bool(study.kept_because))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
