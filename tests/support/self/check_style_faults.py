"""Check that the style check finds each kind of fault, and none in a good file.

    check_style_faults.py CHECK_STYLE.py
"""
import subprocess
import sys
import tempfile
from pathlib import Path

GOOD = """!> A module that is as it should be; common words, stop and save in comments do no harm.
module good
  implicit none
  private

  public :: point_t, doubled

  integer, parameter :: n_axes = 3

  type :: point_t
    real :: x(n_axes) = 0.0
  end type point_t

contains

  !> Twice the number.
  pure integer function doubled(number)
    integer, intent(in) :: number
    character(4), parameter :: words(2) = ["goto", "save"]

    doubled = number*len(words)/2
  end function doubled

end module good
"""
DECLARED, EXECUTED = "  integer, parameter :: n_axes = 3", "    doubled = number*len(words)/2"
FAULTS = [   # text of the good file, what stands there instead, the message
    ("module good", "module other", "expected one module named good"),
    ("  implicit none\n", "", "no implicit none"),
    ("  private\n", "", "not private by default"),
    (DECLARED, "  integer :: n_axes = 3", "a variable of a module"),
    (DECLARED, "  save\n" + DECLARED, "save"),
    (DECLARED, DECLARED + "\n  common /block/ x", "common"),
    (EXECUTED, EXECUTED + "\n    go to 10", "goto"),
    (EXECUTED, EXECUTED + "\n    if (number < 0) error stop 'no'", "stop outside"),
    (EXECUTED, EXECUTED + "\n    stop 1", "stop outside"),
    (EXECUTED, "\t" + EXECUTED, "a tab"),
    (EXECUTED, EXECUTED + " ", "blanks at the end"),
    (EXECUTED, EXECUTED + " ! " + 80*"x", "columns, at most"),
    (EXECUTED, 75*(EXECUTED + "\n"), "doubled has"),
    (EXECUTED, EXECUTED + "\n" + 800*"\n", "lines, at most 800"),
    ("integer, intent(in)", "class(*), intent(in)", "class(*)"),
]


def check(program, folder, text):
    (Path(folder) / "src").mkdir(exist_ok=True)
    (Path(folder) / "src" / "good.f90").write_text(text)
    (Path(folder) / "src" / "CMakeLists.txt").write_text("add_library(good good.f90)\n")
    return subprocess.run([sys.executable, program, folder], capture_output=True, text=True)


def main(program):
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        result = check(program, folder, GOOD)
        if result.returncode != 0:
            faults.append(f"faults in the good file: {result.stdout}")
        for old, new, message in FAULTS:
            result = check(program, folder, GOOD.replace(old, new))
            if result.returncode == 0 or message not in result.stdout:
                faults.append(f"expected {message!r}, found {result.stdout!r} {result.stderr!r}")
        (Path(folder) / "src" / "stray.f90").write_text(GOOD.replace("good", "stray"))
        result = check(program, folder, GOOD)
        if "stray.f90:1: in no CMakeLists.txt" not in result.stdout:
            faults.append("a file that is not built passes")
    with tempfile.TemporaryDirectory() as folder:
        if subprocess.run([sys.executable, program, folder], capture_output=True).returncode == 0:
            faults.append("a folder without source files passes")
    print("\n".join(faults) or f"all {len(FAULTS)} faults were found")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
