"""Subroutines beside a UMAT or VUMAT: USDFLD, VUSDFLD and UVARM."""
import h5py
import numpy as np

from common import FILES, INPUT, same

SOURCE = INPUT / "umat_saturation.f"
DECK = (INPUT / "umat_saturation.key").read_text()
VUMAT = DECK.replace("CONSTANTS=2", "CONSTANTS=2, TYPE=VUMAT").replace(
    "*DEPVAR\n1\n", "*DEPVAR\n4\n")


def changed(old, new):
    """The example's source with one statement replaced, as text."""
    text = SOURCE.read_text()
    assert text.count(old) == 1, old
    return text.replace(old, new)


def fields_follow_the_stress(bench):
    """Tension against its closed form; the stress at the start decides, so errors fall with dt."""
    path = bench.run(DECK, SOURCE, command=["material"])
    assert "warning" not in bench.said, bench.said
    with h5py.File(path) as file:
        group = file["tests/tension"]
        strain, stress = group["strain"][:, 0], group["stress"][:, 0]
        state, names = group["state"][...], group["state"].attrs["names"]
    assert names in ("limit, UVARM1, UVARM2", b"limit, UVARM1, UVARM2"), names
    exact = 400 * (1 - np.exp(-210000 * strain / 400))
    assert 300 < exact.max() and abs(stress - exact).max() < 5e-4 * 400
    assert abs(state[1:, 1] - stress[1:]).max() < 1e-6 * 400
    assert abs(state[1:, 2] - 1 / 3).max() < 1e-6


def blocks_give_the_same_as_points(bench):
    """The sheet; VUMAT and UMAT differ by their rates alone. UVARM keeps its own values."""
    points, stress, state = bench.values(DECK, SOURCE)
    assert 0.5 < state[..., 1].max() / 400 < 1
    block = bench.values(VUMAT, FILES / "vusdfld.for")
    with h5py.File(bench.folder / "a.h5") as file:
        names = file["points/statev"].attrs["names"]
    assert str(names).count("UVARM") == 2, names
    same(block, (points, stress), 1e-6)
    limit, element, direction, field, calls, last = np.moveaxis(block[2], -1, 0)
    assert (limit == 400).all() and set(np.unique(element)) == set(range(1, 7))
    assert abs(direction - 1).max() < 1e-3
    assert np.array_equal(last, field)      # GETVRM('SDV') after the increment
    assert abs(field - state[..., 1] / 400).max() < 0.01
    assert np.unique(calls).size == 1 and calls.max() > 50
    for text, source, result in ((DECK, SOURCE, (points, stress, state)),
                                 (VUMAT, FILES / "vusdfld.for", block)):
        one = bench.values(text, source, threads=1)
        assert all(np.array_equal(a, b) for a, b in zip(one, result)), "threads change the result"


def decks_and_files_must_agree(bench):
    """What the deck names must be there, what it does not name is not called."""
    bench.run(DECK, INPUT / "umat_voce.f", code=1)
    bench.says("deck.key:7: error: *MATERIAL", "SUBROUTINE USDFLD", "*USER DEFINED FIELD")
    bench.run(DECK.replace("*USER DEFINED FIELD\n", ""), INPUT / "umat_voce.f", code=1,
              options=["--check"])
    bench.says("SUBROUTINE UVARM", "*USER OUTPUT VARIABLES")
    bench.run(VUMAT, INPUT / "vumat_voce.f", code=1)
    bench.says("SUBROUTINE VUSDFLD")
    plain = DECK.replace("*USER DEFINED FIELD\n", "").replace("*USER OUTPUT VARIABLES\n2\n", "")
    _, _, state = bench.values(plain, SOURCE)
    bench.says("warning", "USDFLD, UVARM", "nothing here calls")
    assert state.shape[-1] == 1
    # that of a VUMAT may lack what it calls
    both = bench.folder / "both.f"
    both.write_text(SOURCE.read_text() + "      SUBROUTINE VUSDFLD(NBLOCK)\n"
                    "      CALL NOWHERE(NBLOCK)\n      END\n")
    bench.run(DECK, both)
    bench.says("warning", "SUBROUTINE VUSDFLD", "nothing here calls")


def failures_name_the_routine(bench):
    for old, new, words in (
            ("FIELD(1) = SINV2/STATEV(1)", "FIELD(1) = SQRT(-1.0D0 - SINV2)",
             ["USDFLD", "no finite number", "FIELD(1)"]),
            ("FIELD(1) = SINV2/STATEV(1)", "FIELD(3) = SINV2/STATEV(1)",
             ["USDFLD", "writes FIELD(3), but the deck gives 1"]),
            ("FIELD(1) = SINV2/STATEV(1)", "PNEWDT = 0.5D0", ["USDFLD", "PNEWDT"]),
            ("UVAR(2) = 0.0D0", "UVAR(5) = 1.0D0", ["UVARM", "UVAR(5), but the deck gives 2"]),
            ("UVAR(2) = 0.0D0", "CALL XIT", ["UVARM ended the run (XIT)"])):
        path = bench.folder / "fails.f"
        path.write_text(changed(old, new))
        bench.run(DECK, path, code=2, threads=1)
        bench.says("the user's subroutine ", " in element ", ", point 1", *words)
    path.write_text(SOURCE.read_text().replace("GETVRM('S'", "GETVRM('PE'"))
    bench.run(DECK, path, code=2)
    bench.says("GETVRM is called for PE", "USDFLD ended the run (GETVRM)")
