"""Writes past the end of arguments: routine, argument, element and point are named."""
import h5py

from common import BODY, FILES, deck, user

PULL = "*MATERIAL TEST, NAME=pull, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=10\n0.001\n"


def writes_past_arguments_end_the_run(bench):
    """What is lost behind an argument is never passed over, be it one value or thousands, and
    whether it is looked at after one call or, with eight elements side by side, after eight."""
    for kind, elements, words in ((25, 3, "STATEV(11)"), (25, 8, "STATEV(11)"),
                                  (26, 3, " STRESS"), (26, 8, " STRESS"),
                                  (27, 3, " DDSDDE"), (28, 3, " STATEV"), (28, 8, " STATEV")):
        body = BODY.replace("x, 0, 10, 2, 3", f"x, 0, 10, 2, {elements}")
        path = bench.run(deck(user(f"210000, 0, 5, 20, {kind}", 2), body), FILES / "misbehaves.F",
                         code=2)
        bench.says("UMAT", words, "in element 5, point 2")
        if kind == 25:      # nothing was written over: the state reached is there
            with h5py.File(path) as file:
                assert file["frames/is_failed"][-1] == 1, "no frame marked failed"


def missing_depvar_is_an_error(bench):
    """The last value that is not zero tells how many there must be at least."""
    text = deck(user("210000, 0, 1, 4, 25, 1"), body="") + PULL
    path = bench.run(text, FILES / "misbehaves.F", command=["material"], code=2)
    bench.says("UMAT in element 1, point 1", "STATEV(9)", "no *DEPVAR;", "at least 9")
    with h5py.File(path) as file:
        assert len(file["tests/pull/time"]) == 4, "rows before the fault are lost"
    bench.run(deck(user("210000, 0, 1, 4, 25, 1", 2), body="") + PULL, FILES / "misbehaves.F",
              command=["material"], code=2)
    bench.says("STATEV(11)", "*DEPVAR of its material gives 2 state variables", "at least 11")


def vumat_failures_name_the_block(bench):
    """All elements stand in a call, so no single one is to blame."""
    for kind, words in ((1, "(XPLB_EXIT)"),
                        (2, "stateNew(:,5)"),
                        (3, " stressNew"),
                        (4, " stateNew"),
                        (5, "(STOP")):
        bench.run(deck(user(f"210000, 0.3, 5, {kind}", 3)), FILES / "vumat_misbehaves.for",
                  code=2)
        bench.says("VUMAT", words, "in elements 1 to 6, point 2")
