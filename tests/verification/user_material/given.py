"""What user subroutines are given: the state of the first call, times, steps, temperature and field
variables, with a restart in between; and how NaN or infinite values are named.

usage: given.py IGAFORM
"""
import pathlib
import re
import sys

import h5py
import numpy as np

from common import BODY, FILES, STEEL, deck, user
from run import run_checks


def step_of(said):
    """The stable step that --check tells."""
    return float(re.search(r"stable increment\D*([0-9.Ee+-]+)", said)[1])


def steps(first, second, output="*OUTPUT, FRAMES=4, HISTORY=8\n", more=""):
    """The body with two steps of the deck."""
    start, _ = BODY.split("*DYNAMIC")
    return start + "".join(f"*STEP\n*DYNAMIC, EXPLICIT\n{time}\n{output}{extra}*END STEP\n"
                           for time, extra in ((first, ""), (second, more)))


def first_call_sees_the_state(bench):
    """The call that asks for the stiffness comes once for each state and temperature of the deck,
    with the state and the place that its element has; with *ELASTIC it does not come at all."""
    conditions = ("*INITIAL CONDITIONS, TYPE=SOLUTION\nALL, 2\nright, 3\n"
                  "*SET, NAME=right\nXI, 0.6, 1\n")
    text = deck(user("1000", 5)) + conditions
    bench.run(text, FILES / "first_state.f", options=["--check"])
    assert bench.said.count("ASKED") == 2, bench.said
    bench.says("ASKED     1    2.0", "ASKED     3    3.0")
    stiff = step_of(bench.said)
    hot = "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nright, 100\n"   # least in the first elements
    bench.run(text + hot, FILES / "first_state.f", options=["--check"])
    assert bench.said.count("ASKED") == 3 and 0.7 < step_of(bench.said) / stiff < 0.9, bench.said
    bench.run(deck("*ELASTIC\n6000, 0\n" + user("1000", 5)) + conditions,
              FILES / "first_state.f", options=["--check"])
    assert "ASKED" not in bench.said, bench.said
    assert abs(step_of(bench.said) / stiff - 1) < 1e-3
    test = "*MATERIAL TEST, NAME=pull, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=4\n0.001\n"
    bench.run(deck(user("1000", 5), body="") + test + conditions.split("right")[0],
              FILES / "first_state.f", command=["material"])
    bench.says("ASKED     1    2.0")
    bench.run(deck(user("1000", 5)), FILES / "first_state.f", options=["--check"], code=1)
    bench.says("ASKED     1    0.0", "DDSDDE")


def times_know_the_steps_of_the_deck(bench):
    body = "*CHECKPOINT, STEPS=21\n" + steps(1e-5, 6e-5)
    _, stress, last = bench.values(deck(user("10000", 10), body), FILES / "given.f")
    total, step, dt, number, increment = (last[..., k].ravel() for k in (1, 0, 2, 3, 4))
    assert abs(total + dt - 7e-5).max() < 1e-15 and abs(total - step - 1e-5).max() < 1e-15
    assert (number == 2).all() and abs(increment * dt / 6e-5 - 1).max() < 0.1, (increment, dt)
    _, _, v = bench.values(deck(user("10000", 10, ", TYPE=VUMAT"), body), FILES / "given.f")
    assert abs(v[..., 1] - 7e-5).max() < 1e-15 and abs(v[..., 0] - 6e-5).max() < 1e-15
    (bench.folder / "stop_here").touch()
    bench.run(deck(user("10000", 10), body), FILES / "given.f", result="cut.h5", code=2)
    bench.says("XIT")
    (bench.folder / "stop_here").unlink()
    path = bench.folder / "cut.h5"
    bench.run(deck(user("10000", 10), body), FILES / "given.f", result="cut.h5",
              options=["--restart", "cut.ckpt.h5"])
    with h5py.File(path) as file:
        assert np.array_equal(file["points/statev"][...], last)
        assert np.array_equal(file["points/stress"][...], stress)


def temperatures_reach_the_routine(bench):
    start = ("*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 50\nALL, 20, 2\n"
             "*INITIAL CONDITIONS, TYPE=FIELD, VARIABLE=2\nALL, 0.5\nX_MAX, 1\n"
             "*AMPLITUDE, NAME=heat\n0, 1, 6e-5, 3\n")
    heat = "*TEMPERATURE, AMPLITUDE=heat\nALL, 100\n*FIELD, VARIABLE=2\nALL, 4\n"

    def fields(kind, *more, **options):
        """Times and the six values at the end, and the coordinate along the strip."""
        text = start + deck(user("10000", 10, f", TYPE={kind}"), steps(1e-5, 6e-5, more=more[-1]))
        if len(more) > 1:
            text = text.replace("1e-5\n", "1e-5\n" + more[0], 1)
        state = bench.values(text, FILES / "given.f", **options)[2].reshape(-1, 10).T
        with h5py.File(bench.folder / "a.h5") as file:
            x = file["points/reference_position"][...].reshape(-1, 3)[:, 0]
        return state, x

    for kind in ("UMAT", "VUMAT"):
        (*_, temp, change, total, field, field_change), x = fields(kind, "")
        assert abs(temp - 20 - 2 * x).max() < 1e-12 and not change.any() and not total.any()
        left = x < 5   # the elements away from X_MAX have none of its control points
        assert abs(field[left] - 0.5).max() < 1e-14 and field.max() > 0.85
        assert field.max() < 1 and not field_change.any()
        for name, given in (("step 2", [heat]), ("both", ["*TEMPERATURE\nALL, 7\n", heat])):
            (*_, dt, _, _, temp, change, total, field, field_change), x = fields(kind, *given)
            assert abs(temp + change - 300).max() < 1e-9, name
            assert abs(change - 200 * dt / 6e-5).max() < 1e-9, name
            assert abs(total - 300 + 20 + 2 * x).max() < 1e-9, name
            assert abs(field - 4).max() < 1e-12 and abs(field_change[x < 5] - 3.5).max() < 1e-12
        (*_, temp, change, total, _, _), x = fields(kind, heat, "*TEMPERATURE, OP=NEW\n")
        assert abs(temp - 20 - 2 * x).max() < 1e-12 and abs(total).max() < 1e-12
        assert not change.any()
    for projection in ("BBAR", "ANS", "BBAR, SPACE=SMOOTH"):
        text = deck(user("10000", 10)).replace("RULE=FULL", f"RULE=FULL, PROJECTION={projection}")
        state = bench.values(start + text + heat, FILES / "given.f")[2]
        with h5py.File(bench.folder / "a.h5") as file:
            x = file["points/reference_position"][..., 0]
        assert abs(state[..., 5] + state[..., 6] - 100 - 200 / 1.5).max() < 1e-9, projection
        assert abs(state[..., 7] + 20 + 2 * x - 100 - 200 / 1.5).max() < 1e-9, projection
    body = "*CHECKPOINT, STEPS=21\n" + start + steps(1e-5, 6e-5, more=heat)
    text = deck(user("10000", 10), body)
    _, stress, last = bench.values(text, FILES / "given.f", threads=1)
    (bench.folder / "stop_here").touch()
    bench.run(text, FILES / "given.f", result="cut.h5", code=2)
    (bench.folder / "stop_here").unlink()
    bench.run(text, FILES / "given.f", result="cut.h5", options=["--restart", "cut.ckpt.h5"])
    with h5py.File(bench.folder / "cut.h5") as file:
        assert np.array_equal(file["points/statev"][...], last)
        assert np.array_equal(file["points/stress"][...], stress)
    bench.run(text.replace("*DEPVAR", "*EXPANSION\n1e-5\n*DEPVAR"), FILES / "given.f", code=1)
    bench.says("*EXPANSION")
    bench.run(deck(f"*ELASTIC\n{STEEL}") + start)
    bench.says("warning: *INITIAL CONDITIONS")


def fields_may_begin_after_a_restart(bench):
    """Of steps that the deck had not when the state was saved, with fields before and without: the
    bits of the whole run."""
    heat = "*TEMPERATURE\nALL, 700\n*FIELD, VARIABLE=2\nALL, 4\n"
    lasting = "*CHECKPOINT, NUMBER=1\n"
    for start in ("", "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 20, 2\n"):
        long = start + deck(user("10000", 10), lasting + steps(1e-5, 3e-5, more=heat))
        short = long[:long.index("*END STEP\n") + len("*END STEP\n")]
        whole = bench.values(long, FILES / "given.f", result="whole.h5")
        assert abs(whole[2][..., 5] + whole[2][..., 6] - 700).max() < 1e-9
        bench.run(short, FILES / "given.f", result="cut.h5")
        on = bench.values(long, FILES / "given.f", result="cut.h5",
                          options=["--restart", "cut.ckpt.h5"])
        assert all(np.array_equal(a, b) for a, b in zip(whole, on)), start


def material_tests_have_the_fields_of_the_start(bench):
    """One value of each field; what differs by place or time is refused with its line."""
    start = ("*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 50\nALL, 20\nright, 7\n"
             "*INITIAL CONDITIONS, TYPE=FIELD, VARIABLE=2\nALL, 0.5\n")
    test = "*MATERIAL TEST, NAME=pull, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=4\n0.001\n"
    for kind in ("UMAT", "VUMAT"):
        text = deck(user("10000", 10, f", TYPE={kind}"), body="") + test
        path = bench.run(start + text, FILES / "given.f", command=["material"])
        bench.says("set right")
        with h5py.File(path) as file:
            state = file["tests/pull/state"][1:]
        assert (state[:, 5] == 20).all() and (state[:, 8] == 0.5).all(), (kind, state)
        assert not state[:, [6, 7, 9]].any(), (kind, state)
    change = "*TEMPERATURE\nALL, 9\n*FIELD, VARIABLE=2\nALL, 4\n"
    bench.run(start.replace("20", "20, 1") + text + change, FILES / "given.f",
              command=["material"], code=1)
    bench.says("deck.key:3: error: *INITIAL CONDITIONS: ",
               "error: *TEMPERATURE: ",
               "error: *FIELD: ")
    text = deck("*ELASTIC\n210000, 0.3\n", body="") + test
    bench.run(start + text, command=["material"])
    bench.says("warning: *INITIAL CONDITIONS")


def work_heats_the_points(bench):
    """Nine tenths of the reported inelastic work, by density and specific heat."""
    heating = "\n*ADIABATIC HEATING\n0.9, 4.6e8, 20"
    for kind, rate, density in (("UMAT", 1e6, 7.85e-9), ("VUMAT", 1e14, 1)):
        for start, given in ((20, ""), (30, "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 30\n")):
            material = user(f"10000, {rate}", 10, f", TYPE={kind}") + heating
            state = bench.values(given + deck(material, steps(1e-5, 6e-5)), FILES / "given.f")[2]
            spent = 7e-5 - state[..., 2]
            rise = 0.9 * rate * spent / (density * 4.6e8)
            assert rise.min() > 10 and abs(state[..., 5] - start - rise).max() < 1e-9, kind
    bench.run(deck(material, steps(1e-5, 6e-5, more="*TEMPERATURE\nALL, 5\n")), FILES / "given.f",
              code=1)
    bench.says("*ADIABATIC HEATING with *TEMPERATURE")


def temperatures_change_in_static_steps(bench):
    """A body that is heated in an explicit step or a static one, rests, and is cooled between two
    planes: what the rest starts with is no change of it."""
    if not (pathlib.Path(bench.igaform).parents[1] / "lib" / "libigaform_mumps.so").exists():
        return
    young, expansion, hot = 210000, 1e-5, 100
    start = BODY.split("*AMPLITUDE")[0] + ("*BOUNDARY\nX_MIN, XSYMM\nY_MIN, YSYMM\n"
                                           "Z_MIN, ZSYMM\n*ENERGY LIMIT\n0\n")
    heat = "*AMPLITUDE, NAME=heat\n0, 0, {0}, 1\n*AMPLITUDE, NAME=cool\n0, 1, 1, 0\n"
    for kind, time in (("*DYNAMIC, EXPLICIT\n5e-5\n*DAMPING, ALPHA=1e5\n", 5e-5),
                       ("*STATIC\n0.3, 1\n", 1)):
        rest = (f"*STEP\n{kind}*TEMPERATURE, AMPLITUDE=heat\nALL, {hot}\n*END STEP\n"
                "*STEP\n*STATIC\n0.5, 1\n*END STEP\n")
        text = deck(user(f"{young}, {expansion}"), heat.format(time) + start + rest)
        points, stress, _ = bench.values(text, FILES / "expanding.f")
        assert abs(points[..., 0].max() / (10 * np.exp(expansion * hot)) - 1) < 1e-7, kind
        assert abs(stress).max() < 1e-4 * young * expansion * hot, (kind, abs(stress).max())
        with h5py.File(bench.folder / "a.h5") as file:
            frames = file["VTKHDF/Points"][...].reshape(-1, file["VTKHDF/NumberOfPoints"][0], 3)
            middle = frames[file["frames/process_step"][...] == 2][0]
        assert kind.startswith("*DYNAMIC") or abs(middle - frames[-1]).max() < 1e-6, kind
        for field in ("*TEMPERATURE, AMPLITUDE=cool, OP=NEW\nALL, 100\n",
                      "*TEMPERATURE, OP=NEW\n"):
            cooled = text + f"*STEP\n*STATIC\n0.5, 1\n*BOUNDARY\nX_MAX, 1, 1\n{field}*END STEP\n"
            _, stress, _ = bench.values(cooled, FILES / "expanding.f")
            pull = young * expansion * hot
            assert abs(stress[..., 0] / pull - 1).max() < 1e-4, (kind, field, stress[..., 0])
            assert abs(stress[..., 1:]).max() < 1e-4 * pull, (kind, field)


def values_that_are_no_numbers_are_named(bench):
    test = "*MATERIAL TEST, NAME=pull, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=4\n0.001\n"
    for kind, words in ((3, "stress 22"),
                        (4, "PNEWDT"),
                        (8, "state variable 1"), (9, "energy")):
        text = deck(user(f"210000, 0, 1, 3, {kind}, 1", 1), body="") + test
        bench.run(text, FILES / "misbehaves.F", command=["material"], code=2)
        bench.says("test pull: ", words, "increment 3 of 4")
    for kind in (10, 11):
        bench.run(deck(user(f"210000, 0, 1, 0, {kind}", 1)), FILES / "misbehaves.F", code=1)
        bench.says("first call", "infinite")
    source = bench.folder / "sdvini_nan.f"      # its values are looked at before the UMAT has them
    law = (FILES / "sdvini.f").read_text()
    assert "+COORDS(1)" in law
    source.write_text(law.replace("+COORDS(1)", "+SQRT(COORDS(1)-1.D9)"))
    for text, command in ((deck(user(STEEL, 5)), []), (deck(user(STEEL, 5), body="") + test,
                                                       ["material"])):
        bench.run(text, source, command=command, code=2)
        bench.says("SDVINI in element 1, point 1", "STATEV(1)")
        assert "first call" not in bench.said, bench.said


if __name__ == "__main__":
    sys.exit(run_checks(sys.argv[1], (first_call_sees_the_state, times_know_the_steps_of_the_deck,
                                      temperatures_reach_the_routine,
                                      fields_may_begin_after_a_restart,
                                      material_tests_have_the_fields_of_the_start,
                                      work_heats_the_points,
                                      temperatures_change_in_static_steps,
                                      values_that_are_no_numbers_are_named)))
