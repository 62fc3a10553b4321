"""Check that the preprocessor refuses what pFUnit would not take.

    check_refusals.py PFPROC.py
"""
import subprocess
import sys
import tempfile
from pathlib import Path

TEST = """module test_it
  use funit
  implicit none
contains
{mark}
  subroutine {name}()
    {line}
  end subroutine {name}
end module test_it
"""
GOOD = {"mark": "@test", "name": "it_works", "line": "@assertTrue(.true.)"}
REFUSED = [   # what is other than in GOOD, line of the fault, part of the message
    ({"line": "@assertTru(.true.)"}, 7, "unknown assertion"),
    ({"line": "@assertEqual(1)"}, 7, "needs more arguments"),
    ({"line": "@assertEqual(1, &"}, 7, "one line"),
    ({"line": "@assertTrue(.true.) ! why"}, 7, "one line"),
    ({"name": "a" * 45}, 6, "at most 44"),
    ({"mark": ""}, 1, "no @test"),
]


def preprocess(program, folder, changes, module="test_it"):
    source = Path(folder) / f"{module}.pf"
    source.write_text(TEST.format(**{**GOOD, **changes}))
    return subprocess.run([sys.executable, program, "suite", source, f"{folder}/out.f90"],
                          capture_output=True, text=True)


def main(program):
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        if preprocess(program, folder, {}).returncode != 0:
            faults.append("a good file is refused")
        for changes, line, message in REFUSED:
            result = preprocess(program, folder, changes)
            if result.returncode == 0 or f"test_it.pf:{line}: error:" not in result.stderr \
                    or message not in result.stderr:
                faults.append(f"{changes}: expected a refusal at line {line} with {message!r}, "
                              f"found {result.stderr!r}")
        if "must be named" not in preprocess(program, folder, {}, "test_other").stderr:
            faults.append("a module that is not named as its file is taken")
    print("\n".join(faults) or "all refusals are as they should be")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
