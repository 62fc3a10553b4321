"""Run user subroutines in the styles met in the wild, through the whole program.

usage: run.py IGAFORM

Each file of files/ is dropped in unchanged. Laws that exist built in must give the same result,
the neo-Hooke of a UMAT that of a VUMAT; what fails must say where and why.
"""
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import h5py
import numpy as np

import fields
import foreign
import keeping
import outlines
import overruns
import sheets
from common import BODY, Bench, FILES, INPUT, STEEL, TURNING, VOCE, deck, same, user


def styles_agree_with_built_in_laws(bench):
    for body in (BODY, TURNING):
        elastic = bench.values(deck(f"*ELASTIC\n{STEEL}", body))
        plastic = bench.values(deck(f"*ELASTIC\n{STEEL}\n*PLASTIC\n250, 250, 6", body))
        same(bench.values(deck(user(STEEL), body), FILES / "linear_fixed.for"), elastic)
        same(bench.values(deck(user(STEEL, 2), body), FILES / "jstep_hypo.f"), elastic)
        same(bench.values(deck(user(VOCE, 7), body), FILES / "voce_free.f90"), plastic, 1e-7)
        same(bench.values(deck(f"*ELASTIC\n{STEEL}\n" + user(STEEL, 5), body),
                          FILES / "past_props.f"), elastic)
        assert abs(elastic[1] - plastic[1]).max() > 100, "the strip does not yield"


def messages_go_to_units_6_and_7(bench):
    bench.run(deck(user(STEEL, 2)), FILES / "jstep_hypo.f", result="units.h5")
    bench.says("unit 6: element")
    assert "increment 3 of element" in (bench.folder / "units.msg").read_text()
    bench.run(deck(user(STEEL)), FILES / "linear_fixed.for", result="silent.h5")
    assert not (bench.folder / "silent.msg").exists()


def vumats_of_both_signatures(bench):
    plastic = bench.values(deck(f"*ELASTIC\n{STEEL}\n*PLASTIC\n250, 250, 6"))
    names = "\n1, PEEQ"
    same(bench.values(deck(user(VOCE, 1, ", TYPE=VUMAT", names)), INPUT / "vumat_voce.f"), plastic,
         1e-4)   # Green-Naghdi against Jaumann: waves turn the strip a little
    with h5py.File(bench.folder / "a.h5") as file:
        assert np.array_equal(file["points/statev"][..., 0], file["points/eqps"][...])
        assert file["points/statev"].attrs["names"] in ("PEEQ", b"PEEQ")
    # A hyperelastic law knows no rate: the frames of UMAT and VUMAT must not be seen.
    for body in (BODY, TURNING):
        umat = bench.values(deck(user(STEEL), body), FILES / "neo_hooke.f")
        vumat = bench.values(deck(user(STEEL, 3), body), FILES / "vumat_new.for")
        same(vumat, umat, 1e-9)
    elements, points = vumat[2][..., 0], vumat[2][..., 1]
    assert set(np.unique(elements)) == {1, 2, 3, 4, 5, 6}
    assert set(np.unique(points)) == set(range(1, 28))
    assert abs(vumat[2][..., 2] - 4e-5).max() < 1e-12


def small_kinematics_leave_gradients_out(bench):
    """DFGRD0 and DFGRD1 are NaN: who uses them is told before the run, and in it."""
    small = ", KINEMATICS=SMALL"
    full = bench.values(deck(user(VOCE, 7), TURNING), FILES / "voce_free.f90")
    same(bench.values(deck(user(VOCE, 7, small), TURNING), FILES / "voce_free.f90"), full, 1e-12)
    assert "KINEMATICS" not in bench.said
    law = user(STEEL, 0, small)
    bench.run(deck(law), FILES / "neo_hooke.f", code=2)
    bench.says("warning", "KINEMATICS=SMALL", "DFGRD1", "no finite number", "element 1, point 1")
    bench.run(deck(user(VOCE, 1, small)), INPUT / "vumat_voce.f", code=1)
    bench.says("KINEMATICS=SMALL", "VUMAT")


def shared_data_run_in_order(bench):
    one = bench.values(deck(user(STEEL, 1)), FILES / "common_count.f", threads=1)
    bench.says("KCALLS", "one thread")
    two = bench.values(deck(user(STEEL, 1)), FILES / "common_count.f", threads=2)
    assert all(np.array_equal(a, b) for a, b in zip(one, two)), "threads change the result"
    last = np.sort(two[2].ravel())
    assert np.array_equal(np.diff(last), np.ones(last.size - 1)), "calls are missing or twice"
    same(two, bench.values(deck(f"*ELASTIC\n{STEEL}")))
    bench.run(deck(user(STEEL, 1, ", THREADSAFE=NO")), FILES / "common_count.f")
    assert "warning" not in bench.said


def states_start_as_told(bench):
    conditions = ("*INITIAL CONDITIONS, TYPE=SOLUTION\nALL, 5, 6, 7, 8\n"
                  "right, 100\n*SET, NAME=right\nXI, 0.6, 1\n")
    points, _, state = bench.values(deck(user(STEEL, 5), speed=0.0) + conditions,
                                    FILES / "sdvini.f")
    with h5py.File(bench.folder / "a.h5") as file:
        place = file["points/reference_position"][...]
    state, x = state.reshape(-1, 5), place.reshape(-1, 3)[:, 0]
    right = x > 20 / 3
    assert abs(state[~right, 0] - 5 - x[~right]).max() < 1e-9
    assert abs(state[right, 0] - 100 - x[right]).max() < 1e-9
    assert np.array_equal(state[~right, 2:], np.tile([7.0, 8.0, 0.0], ((~right).sum(), 1)))
    assert np.array_equal(np.unique(np.floor(state[:, 1])), np.arange(1, 7))
    assert points.shape[-1] == 3
    long = conditions.replace("7, 8", "7\n8")   # filled up to the seventh: the eighth of five
    bench.run(deck(user(STEEL, 5), speed=0.0) + long, FILES / "sdvini.f", code=1)
    bench.says("8 state variables", "5")


def failures_name_element_and_point(bench):
    first = "error: the user's subroutine "
    for kind, words in ((1, ["XIT"]), (2, ["STOP"]),
                        (3, [first, "finite"]),
                        (4, [first + "UMAT", "PNEWDT", "64",
                             "1. the user's subroutine"]),
                        (12, ["PNEWDT"]),
                        (13, ["UMAT stops in 5", "(STDB_ABQERR with LOP = -3)"]),
                        (14, ["GETVRM is called", "(GETVRM)"]),
                        (5, ["UMAT", "segmentation fault"]),
                        (6, ["stack", "ulimit -s", "OMP_STACKSIZE"]),
                        (7, ["stack"]),
                        (20, ["table.dat", "UMAT", "run time"]),
                        (21, ["Expected INTEGER", "UMAT"]),
                        (22, ["UMAT", "ABORT"]), (23, ["UMAT", "PROPS"])):
        constants = f"210000, 0, 5, 120, {kind}"   # a frame lies some 30 steps back
        path = bench.run(deck(user(constants)), FILES / "misbehaves.F", code=2,
                         result=f"fails{kind}.h5")
        bench.says("element 5, point 2" if kind != 23 else "in element", *words)
        with h5py.File(path) as file:
            failed = file["frames/is_failed"][...]
            assert len(failed) >= 2 and not failed[0], "the frames before the failure are gone"
            assert kind in (5, 6, 7, 22, 23) or failed[-1] == 1, "no frame marked failed"
            assert np.isfinite(file["nurbs/blank/points"][...]).all()
        log = path.with_suffix(".log").read_text()
        assert log.count("error: the user's subroutine") == 1, log


def all_threads_may_fail_at_once(bench):
    """An error of input or output holds its unit: every thread waits for it, or ends the run."""
    source = (FILES / "misbehaves.F").read_text()
    place = bench.folder / "at_once.F"
    for condition in (".OR. NPT.NE.3-KPOINT", "NOEL.NE.NINT(PROPS(3)) .OR."):
        assert condition in source
        source = source.replace(condition, "")
    place.write_text(source)
    for kind, words in ((20, "UMAT"), (22, "ABORT"),
                        (23, "PROPS"), (24, "UMAT")):
        path = bench.run(deck(user(f"210000, 0, 5, 120, {kind}", 1)), place, code=2, threads=4,
                         result=f"all{kind}.h5")
        bench.says("in element", words)
        assert bench.said.count("igaform: error: the user") == 1, bench.said
        with h5py.File(path) as file:
            assert kind != 20 or file["frames/is_failed"][-1] == 1, "no frame marked failed"


def material_tests_outlive_user_code(bench):
    """A test that ends inside the user's subroutine keeps its rows, and the next ones still run."""
    kinds = {"stop": 2, "missing": 20, "unit7": 21, "abort": 22, "crash": 5, "stack": 7}
    text = ""
    for name, kind in kinds.items():
        constants = user(f"210000, 0, 1, 4, {kind}, 1")
        text += f"*MATERIAL, NAME={name}\n*DENSITY\n7.85e-9\n{constants}\n"
        text += (f"*MATERIAL TEST, NAME={name}, MATERIAL={name}, TYPE=UNIAXIAL, INCREMENTS=10\n"
                 "0.001\n")
    text += f"*MATERIAL, NAME=sound\n*DENSITY\n7.85e-9\n{user(STEEL)}\n"
    text += "*MATERIAL TEST, NAME=sound, MATERIAL=sound, TYPE=UNIAXIAL, INCREMENTS=10\n0.001\n"
    source = bench.folder / "ends.F"
    law = (FILES / "misbehaves.F").read_text().replace("WRITE(6", "WRITE(7")
    assert "WRITE(7" in law
    source.write_text(law.replace("      SELECT CASE", "      WRITE(7,*) 'reached',PROPS(5)\n"
                                  "      SELECT CASE", 1))
    path = bench.run(text, source, command=["material"], code=2)
    with h5py.File(path) as file:
        for name in kinds:
            bench.says(f"test {name}: ")
            group = file["tests"][name]
            assert len(group["time"]) == 4, (name, len(group["time"]))   # the start and three
            assert group.attrs["status"] in ("failed", b"failed")
            assert len((bench.folder / f"a-{name}.csv").read_text().splitlines()) == 5
        assert len(file["tests/sound/time"]) == 11
        assert abs(file["tests/sound/stress"][-1, 0] / 210 - 1) < 1e-3
    bench.says("UMAT ended the run", "UMAT crashed", "segmentation fault", "stack",
               "element 1, point 1", "table.dat")
    messages = (bench.folder / "a.msg").read_text()
    for kind in (2, 20, 21):     # what a crash leaves in the units is lost
        assert f"{kind}." in messages, messages
    assert not (bench.folder / "fort.7").exists()


def first_calls_end_only_their_tests(bench):
    """A law that ends in its first call fails the tests of its material, and no other ones."""
    text = ""
    for name, constants in (("stops", "-1"), ("crashes", "-2"), ("sound", "210000")):
        text += f"*MATERIAL, NAME={name}\n*DENSITY\n7.85e-9\n{user(constants)}\n"
    for name in ("stops", "sound", "crashes", "stops"):
        text += (f"*MATERIAL TEST, NAME={name} {text.count('TEST')}, MATERIAL={name}, "
                 "TYPE=UNIAXIAL, INCREMENTS=10\n0.001\n")
    source = bench.folder / "first.F"
    law = (FILES / "misbehaves.F").read_text()
    source.write_text(law.replace("#define", "      IF (PROPS(1).EQ.-1.D0) CALL XIT\n"
                                  "      NOWHERE=8\n      IF (PROPS(1).EQ.-2.D0) WALL=1.D0\n"
                                  "#define", 1))
    path = bench.run(text, source, command=["material"], code=2)
    bench.says("XIT", "segmentation fault", "element 1, point 1")
    with h5py.File(path) as file:
        for name in ("stops 0", "crashes 2", "stops 3"):
            bench.says(f"error: test {name}: ")
            assert len(file["tests"][name]["time"]) == 0, name
            assert file["tests"][name].attrs["status"] in ("failed", b"failed"), name
        assert len(file["tests/sound 1/time"]) == 11
        assert file["tests/sound 1"].attrs["status"] in ("completed", b"completed")
    path.unlink()
    bench.run(text, source, command=["material"], options=["--check"], code=2)
    bench.says("error: test stops 0: ")
    assert "error: test sound" not in bench.said and not path.exists(), bench.said


def end_by_two_signals(bench, *commands):
    """What programs say at a signal and a second one that hang in a subroutine, and their codes."""
    runs = [subprocess.Popen([bench.igaform, *command, "--user", FILES / "misbehaves.F",
                              "--threads", "2", "--quiet"], cwd=bench.folder, text=True,
                             stderr=subprocess.PIPE) for command in commands]
    try:
        for name in ("run.msg", "tests.msg"):     # written in the loop
            while not (bench.folder / name).exists() \
                    or "for ever" not in (bench.folder / name).read_text():
                assert all(run.poll() is None for run in runs), "it has ended"
                time.sleep(0.01)
        for run in runs:
            run.send_signal(signal.SIGTERM)
        first = [run.stderr.readline() for run in runs]
        assert all(run.poll() is None for run in runs), first
        time.sleep(1.5)     # the line came after a second
        for run in runs:
            run.send_signal(signal.SIGTERM)
        rest = [run.communicate(timeout=20)[1] for run in runs]
        return [(a, b, run.returncode) for a, b, run in zip(first, rest, runs)]
    finally:
        for run in runs:
            run.kill()


def endless_loops_end_at_a_second_signal(bench):
    """A run and material tests name the call; the rows of the tests up to there are kept."""
    loop = deck(user("210000, 0, 5, 120, 15"))
    bench.run(deck(user(STEEL + ", 0, 0, 0")), FILES / "misbehaves.F")   # which compiles it
    (bench.folder / "run.key").write_text(loop)
    text = ""
    for name, kind in (("sound", 0), ("hangs", 15), ("late", 0)):
        constants = user(f"210000, 0, 1, 4, {kind}, 1")
        text += f"*MATERIAL, NAME={name}\n*DENSITY\n7.85e-9\n{constants}\n"
        text += (f"*MATERIAL TEST, NAME={name}, MATERIAL={name}, TYPE=UNIAXIAL, INCREMENTS=10\n"
                 "0.001\n")
    (bench.folder / "tests.key").write_text(text)
    run, tests = end_by_two_signals(bench, ["run.key"], ["material", "tests.key"])
    for (first, rest, code), place in ((run, "element 5, point 2"), (tests, "element 1, point 1")):
        assert f"UMAT returns in {place}" in first, first
        assert "UMAT" in rest and place in rest and code == 3, (code, rest)
    assert "error: ended by a second signal" in (bench.folder / "run.log").read_text()
    assert "stopped by SIGTERM; tests not begun: late" in tests[1], tests
    assert "test hangs: " in tests[1], tests
    with h5py.File(bench.folder / "tests.h5") as file:
        assert set(file["tests"]) == {"sound", "hangs"}
        assert len(file["tests/sound/time"]) == 11 and len(file["tests/hangs/time"]) == 4
        assert file["tests/hangs"].attrs["status"] in ("interrupted", b"interrupted")


def signals_stop_material_tests(bench):
    """What is finished is written, by laws of users and by built-in ones."""
    plastic = f"*ELASTIC\n{STEEL}\n*PLASTIC\n250, 250, 6"
    for law, files, kind, number in (
            (user(STEEL), [FILES / "linear_fixed.for"], "UNIAXIAL", signal.SIGHUP),
            (plastic, [], "R VALUES", signal.SIGTERM)):
        text = "".join(f"*MATERIAL TEST, NAME={name}, MATERIAL=steel, TYPE={kind}, "
                       f"INCREMENTS={n}\n0.1\n" for name, n in (("a", 9), ("b", 10**6), ("c", 9)))
        bench.run(deck(law, body="") + text, *files, command=["material"], options=["--check"])
        words = [word for name in files for word in ("--user", name)]
        run = subprocess.Popen([bench.igaform, "material", "deck.key", "--quiet", *words],
                               cwd=bench.folder, stderr=subprocess.PIPE, text=True)
        try:
            while files and not (bench.folder / "deck.msg").exists():
                assert run.poll() is None, "it has ended"
                time.sleep(0.01)
            time.sleep(0.1 if files else 1.0)    # fewer rows to be written than in a second
            run.send_signal(number)
            bench.said = run.communicate(timeout=20)[1]
        finally:
            run.kill()
        assert run.returncode == 3, (run.returncode, bench.said)
        bench.says(f"stopped by {number.name}; tests not begun: c",
                   "test b: ", "increment")
        with h5py.File(bench.folder / "deck.h5") as file:
            assert set(file["tests"]) == {"a", "b"}
            for group, status in (("tests/a", "completed"), ("tests/b", "interrupted"),
                                  ("provenance", "interrupted")):
                assert file[group].attrs["status"] in (status, status.encode()), group
        assert not (bench.folder / "deck.msg").exists()


def faults_are_told(bench):
    material = deck(user(STEEL))
    bench.run(material, FILES / "syntax_error.f", code=1)
    bench.says("syntax_error.f:2:", "Error")
    bench.run(material, FILES / "missing_routine.f", code=1)
    bench.says("MYHELPER", "--user OTHER_FILE")
    bench.run(material, FILES / "missing_routine.f", FILES / "helper.f90", options=["--check"],
              code=1)
    assert "MYHELPER" not in bench.said, "a second file does not help"
    bench.run(material, FILES / "no_umat.f", code=1)
    bench.says("UMAT or VUMAT", "no_umat")
    bench.run(deck(user(STEEL)), FILES / "plane_stress.f", code=1)
    bench.says("11 but not for 22", "NTENS = 6")
    given = f"*ELASTIC\n{STEEL}\n" + user(STEEL)     # then there is no call before the run
    bench.run(deck(given), FILES / "plane_stress.f", options=["--check"])
    bench.run(deck(given), FILES / "plane_stress.f", code=2)
    bench.says("UMAT in element", "DDSDDE", "11", "22", "NTENS = 6")
    for text in (material, deck(f"*ELASTIC\n{STEEL}")):
        bench.run(text, FILES / "nowhere.f", code=1)
        bench.says("error:", "nowhere.f")
    bench.run(material, code=1)
    bench.says("--user FILE")
    bench.run(deck(user(STEEL, 0, ", TYPE=VUMAT")), FILES / "linear_fixed.for", code=1)
    bench.says("no SUBROUTINE VUMAT")
    bench.run(material, FILES / "linear_fixed.for", code=1, env={"IGAFORM_FC": "no-such-compiler"})
    bench.says("no compiler", "no-such-compiler", "compiles and links Fortran source;")
    (bench.folder / "law.cpp").touch()
    bench.run(material, bench.folder / "law.cpp", code=1, env={"IGAFORM_FC": "no-such-compiler"})
    bench.says("no compiler", "compiles and links C++ source;")
    bench.run(deck(user(STEEL)), FILES / "past_props.f")
    bench.run(deck(f"*ELASTIC\n{STEEL}"), FILES / "linear_fixed.for")
    bench.says("no *USER MATERIAL in the deck")


def files_read_are_never_written(bench):
    """Neither result, log, messages nor tables may take the place of deck or subroutine."""
    law = (FILES / "jstep_hypo.f").read_text()
    test = "*MATERIAL TEST, NAME=pull, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=4\n0.001\n"
    text = "*INCLUDE, INPUT=sheet.msg\n*INCLUDE, INPUT=sheet-pull.csv\n"
    part = deck(user(STEEL, 2))

    def run(command, code):
        files = {"sheet.log": text, "sheet.msg": part, "sheet-pull.csv": test, "sheet.f": law}
        for name, content in files.items():
            (bench.folder / name).write_text(content)
        (bench.folder / "sheet.h5").unlink(missing_ok=True)    # be it of a run or of tests
        (bench.folder / "link.h5").unlink(missing_ok=True)
        (bench.folder / "link.h5").symlink_to("sheet.f")
        done = subprocess.run([bench.igaform, *command, "--quiet"], cwd=bench.folder, timeout=300,
                              capture_output=True, text=True)
        bench.said = done.stdout + done.stderr
        assert done.returncode == code, f"exit code {done.returncode}, not {code}:\n{bench.said}"
        for name, content in files.items():
            assert (bench.folder / name).read_text() == content, f"{name} is gone by {command}"

    for path in ("sheet.log", "./sheet.log", str(bench.folder / "sheet.log")):
        run([path, "--user", "./sheet.f"], 0)
        run(["material", path, "--user", "sheet.f"], 0)
    assert "all steps" in (bench.folder / "sheet.log.log").read_text()
    assert "increment 3 of element" in (bench.folder / "sheet.msg.msg").read_text()
    for taken in ("link", "./link.h5"):
        for start in ([], ["material"]):
            run([*start, "sheet.log", "--user", "sheet.f", "--out", taken], 1)
            bench.says("the run reads this file")


def files_from_elsewhere(bench):
    """Windows letters and line ends, free form named .for, routines that nothing calls."""
    folder = bench.folder / "from_windows"
    shutil.copytree(FILES / "parts", folder / "parts")
    text = (FILES / "windows_style.FOR").read_text()
    (folder / "LAW.FOR").write_bytes(text.replace("\n", "\r\n").encode())
    for body in (BODY, TURNING):
        elastic = bench.values(deck(f"*ELASTIC\n{STEEL}", body))
        same(bench.values(deck(user(STEEL), body), folder / "LAW.FOR", result="windows.h5"),
             elastic)
        bench.says("USDFLD", "nothing here calls", "KELAST")
        assert "column 72" not in bench.said
        same(bench.values(deck(user(STEEL), body), FILES / "free_form.for"), elastic)
        bench.says("free form")
        _, stress, state = bench.values(deck(user(STEEL, 3), body), FILES / "vumat_principal.f")
        assert abs(stress).max() > 100
        assert abs(state[..., :2]).max() < 1e-12 * abs(stress).max()
        assert abs(state[..., 2] - (10 / 3 * 2 * 1) ** (1 / 3)).max() < 1e-12
    assert "windows" in (bench.folder / "windows_law.txt").read_text()
    (folder / "STOPS.FOR").write_text(text.replace("NSTART = NSTART + 1", "STOP 'no table'"))
    bench.run(deck(user(STEEL)), folder / "STOPS.FOR", code=2)
    bench.says("no table", "STOP", "before the first increment")
    part = folder / "parts" / "elastic_common.h"
    part.write_text(part.read_text().replace("KELAST", "KOTHER"))
    bench.run(deck(user(STEEL)), folder / "LAW.FOR")
    bench.says("KOTHER")


def material_tests_know_names_and_starts(bench):
    test = "*MATERIAL TEST, NAME=pull, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=4\n0.001\n"
    text = deck(user(STEEL, 3, "", "\n1, damage\n3, EQPS"), body="") + test
    text += "*INITIAL CONDITIONS, TYPE=SOLUTION\nALL, 0.25, 7, 0.125\nleft, 3\n"
    path = bench.run(text, FILES / "linear_fixed.for", command=["material"])
    bench.says("left", "ALL for a start")
    with h5py.File(path) as file:
        group = file["tests/pull"]
        state = group["state"][...]
        names = group["state"].attrs["names"]
        assert names in ("damage, SDV2, EQPS", b"damage, SDV2, EQPS"), names
        assert (group["eqps"][...] == 0.125).all()
    header = (bench.folder / "a-pull.csv").read_text().splitlines()[0]
    assert "state_damage" in header and "state_EQPS" in header, header
    text += test.replace("pull", "again")    # another test of the material: told once all the same
    bench.run(text.replace("0.125", "0.125, 1"), FILES / "linear_fixed.for", command=["material"],
              code=1)
    bench.says("4 state variables", "steel")
    line = 1 + (text[:text.index("ALL")].count("\n"))
    assert bench.said.count(f"deck.key:{line}: error: *INITIAL CONDITIONS") == 1, bench.said


def laws_that_never_yield_have_no_r_values(bench):
    text = deck(user(STEEL, 1, "", "\n1, EQPS"), body="")
    text += "*MATERIAL TEST, NAME=r, MATERIAL=steel, TYPE=R VALUES, INCREMENTS=4\n"
    bench.run(text, FILES / "linear_fixed.for", command=["material"], code=2)
    bench.says("test r: ", "0 degrees")


CHECKS = (styles_agree_with_built_in_laws, messages_go_to_units_6_and_7,
          vumats_of_both_signatures, small_kinematics_leave_gradients_out,
          shared_data_run_in_order, states_start_as_told,
          failures_name_element_and_point, all_threads_may_fail_at_once,
          endless_loops_end_at_a_second_signal, signals_stop_material_tests,
          material_tests_outlive_user_code, first_calls_end_only_their_tests,
          faults_are_told, files_from_elsewhere,
          files_read_are_never_written, material_tests_know_names_and_starts,
          laws_that_never_yield_have_no_r_values, keeping.libraries_are_kept_and_renewed,
          keeping.planted_libraries_are_not_loaded, keeping.checks_call_nothing,
          overruns.writes_past_arguments_end_the_run, overruns.missing_depvar_is_an_error,
          overruns.vumat_failures_name_the_block, fields.fields_follow_the_stress,
          fields.blocks_give_the_same_as_points, fields.decks_and_files_must_agree,
          fields.failures_name_the_routine,
          foreign.sources_for_ifort_are_accepted, foreign.causes_are_named,
          foreign.languages_and_libraries,
          outlines.cut_solids_agree_with_built_in_laws,
          outlines.cut_solids_store_the_work_that_they_do,
          sheets.both_forms_agree_with_built_in_laws, sheets.material_tests_know_both_forms,
          sheets.restarts_continue_with_the_same_bits,
          sheets.sheets_are_described_to_the_law,
          sheets.gradients_store_the_work_that_strains_do,
          sheets.axes_of_the_material_begin_along_x,
          sheets.laws_of_solids_are_told_of_the_option)


def run_checks(igaform, checks):
    n_failed = 0
    cache = tempfile.TemporaryDirectory()
    os.environ["XDG_CACHE_HOME"] = cache.name
    for check in checks:
        with tempfile.TemporaryDirectory() as folder:
            try:
                check(Bench(os.path.abspath(igaform), folder))
                print("ok  ", check.__name__)
            except AssertionError as fault:
                n_failed += 1
                print("FAIL", check.__name__, fault)
    return 1 if n_failed else 0


if __name__ == "__main__":
    sys.exit(run_checks(sys.argv[1], CHECKS))
