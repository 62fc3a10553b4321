"""Writes past the end of arguments: routine, argument, element and point are named."""
import h5py

from common import FILES, deck, user

PULL = "*MATERIAL TEST, NAME=pull, MATERIAL=steel, TYPE=UNIAXIAL, INCREMENTS=10\n0.001\n"


def writes_past_arguments_end_the_run(bench):
    """What is lost behind an argument is never passed over, be it one value or thousands."""
    for kind, words in ((25, "writes STATEV(11), but *DEPVAR gives 2 state variables"),
                        (26, "wrote past the end of STRESS"),
                        (27, "wrote past the end of DDSDDE"),
                        (28, "wrote past the end of STATEV")):
        path = bench.run(deck(user(f"210000, 0, 5, 20, {kind}", 2)), FILES / "misbehaves.F",
                         code=2)
        bench.says("UMAT", words, "in element 5, point 2")
        if kind == 25:      # nothing was written over: the state reached is there
            with h5py.File(path) as file:
                assert file["frames/is_failed"][-1] == 1, "no frame marked failed"


def missing_depvar_is_an_error(bench):
    """The last value that is not zero tells how many there must be at least."""
    text = deck(user("210000, 0, 1, 4, 25, 1"), body="") + PULL
    path = bench.run(text, FILES / "misbehaves.F", command=["material"], code=2)
    bench.says("UMAT in element 1, point 1 writes STATEV(9), but without *DEPVAR, which gives 0 "
               "state variables: it must give as many as the subroutine writes, 9 or more")
    with h5py.File(path) as file:
        assert len(file["tests/pull/time"]) == 4, "rows before the fault are lost"


def vumat_failures_name_the_block(bench):
    """Three elements along x stand in a call, so no single one is to blame."""
    for kind, words in ((1, "ended the run (XPLB_EXIT)"),
                        (2, "writes stateNew(:,5), but *DEPVAR gives 3 state variables"),
                        (3, "wrote past the end of stressNew"),
                        (4, "wrote past the end of stateNew"),
                        (5, "ended the run (STOP")):
        bench.run(deck(user(f"210000, 0.3, 5, {kind}", 3)), FILES / "vumat_misbehaves.for",
                  code=2)
        bench.says("VUMAT", words, "in elements 4 to 6, point 2")
