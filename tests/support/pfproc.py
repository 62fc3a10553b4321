"""Turn a pFUnit test file (.pf) into Fortran, and write the program that runs the tests.

    pfproc.py suite TEST.pf TEST.f90      the tests of one file, as module TEST and TEST_suite
    pfproc.py driver NAME OUT.f90 TEST... the program NAME that runs these suites

It knows the part of pFUnit's language that the tests of this project use: @test, @disable, @before,
@after and the assertions listed below, each alone on its line. Every line keeps its number, so that
the compiler's messages fit the .pf file.
"""
import re
import sys
from pathlib import Path

ASSERTIONS = {   # name in lower case: arguments at least
    "true": 1, "false": 1, "all": 1, "any": 1, "none": 1, "notall": 1,
    "equal": 2, "notequal": 2, "lessthan": 2, "lessthanorequal": 2,
    "greaterthan": 2, "greaterthanorequal": 2,
    "sameshape": 2, "isnan": 1, "isfinite": 1, "fail": 1,
}
ASSERT = re.compile(r"^(\s*)@assert(\w+)\s*\((.*)\)\s*$", re.IGNORECASE)
MARK = re.compile(r"^\s*@(test|disable|before|after)\s*$", re.IGNORECASE)
SUBROUTINE = re.compile(r"^\s*subroutine\s+(\w+)\s*(\(\s*\))?\s*(!.*)?$", re.IGNORECASE)
MODULE = re.compile(r"^\s*module\s+(\w+)\s*$", re.IGNORECASE)
LONGEST_NAME = 44   # pFUnit puts a module name before it, and Fortran allows 63 in all


class Fault(Exception):
    """The test file is not as it should be."""


def n_arguments(text):
    """Number of arguments in an argument list, commas within brackets and quotes apart."""
    depth, quote, count = 0, "", 1 if text.strip() else 0
    for char in text:
        if quote:
            quote = "" if char == quote else quote
        elif char in "\"'":
            quote = char
        elif char in "([":
            depth += 1
        elif char in ")]":
            depth -= 1
        elif char == "," and depth == 0:
            count += 1
    return count


def assertion(file, number, line):
    """The Fortran for a line with an assertion, which leaves the procedure when it fails."""
    match = ASSERT.match(line)
    if not match:
        raise Fault("an assertion must stand on one line, as @assert...(...)")
    indent, name, arguments = match.groups()
    if name.lower() not in ASSERTIONS:
        raise Fault(f"unknown assertion @assert{name}")
    if n_arguments(arguments) < ASSERTIONS[name.lower()]:
        raise Fault(f"@assert{name} needs more arguments")
    return (f'{indent}call assert{name}({arguments}, location=SourceLocation("{file}", {number}));'
            " if (anyExceptions()) return")


class Suite:
    """The tests of one file."""

    def __init__(self, path):
        self.path = path
        self.module = ""
        self.tests = []       # (name, whether it is disabled)
        self.fixture = {}     # before, after: name
        self.lines = []
        marks = set()         # what the next subroutine is
        for number, line in enumerate(path.read_text().splitlines(), 1):
            try:
                self.lines.append(self.translated(number, line, marks))
            except Fault as fault:
                sys.exit(f"{path}:{number}: error: {fault}")
        if self.module != path.stem:
            sys.exit(f"{path}:1: error: the module must be named {path.stem}")
        if marks:
            sys.exit(f"{path}:{number}: error: @{sorted(marks)[0]} without a subroutine")
        if not self.tests:
            sys.exit(f"{path}:1: error: no @test in this file")

    def translated(self, number, line, marks):
        if match := MODULE.match(line):
            self.module = self.module or match.group(1)
        elif match := MARK.match(line):
            marks.add(match.group(1).lower())
            return ""
        elif line.lstrip().startswith("@"):
            return assertion(self.path.name, number, line)
        elif marks and line.strip() and not line.lstrip().startswith("!"):
            self.note_procedure(line, marks)
        return line

    def note_procedure(self, line, marks):
        """Take a subroutine as what the lines before it say it is."""
        match = SUBROUTINE.match(line)
        if not match:
            raise Fault("expected a subroutine without arguments after @" + sorted(marks)[0])
        name = match.group(1)
        if len(name) > LONGEST_NAME:
            raise Fault(f"the name of a test has at most {LONGEST_NAME} characters: {name}")
        if "test" in marks:
            self.tests.append((name, "disable" in marks))
        else:
            for role in marks - {"disable"}:
                self.fixture[role] = name
        marks.clear()

    def fortran(self):
        """The test module, and a module with the procedure that runs its tests."""
        used = sorted({name for name, _ in self.tests} | set(self.fixture.values()))
        extra = "".join(f", {role}={name}" for role, name in sorted(self.fixture.items()))
        out = self.lines + ["", f"module {self.module}_suite",
                            "  use funit_runner, only: runner_t, run_test, skip_test"]
        out += [f"  use {self.module}, only: {name}" for name in used]
        out += ["  implicit none", "  private", "  public :: run_suite", "contains",
                "  subroutine run_suite(runner)", "    type(runner_t), intent(inout) :: runner"]
        for name, is_disabled in self.tests:
            if is_disabled:
                out += [f'    call skip_test(runner, "{self.module}", "{name}")']
            else:
                out += [f'    call run_test(runner, "{self.module}", "{name}", {name}{extra})']
        out += ["  end subroutine run_suite", f"end module {self.module}_suite", ""]
        return "\n".join(out)


def driver(name, modules):
    """The program that runs the suites of these modules."""
    out = [f"program {name}_driver", "  use funit_runner, only: runner_t, new_runner, finish"]
    out += [f"  use {module}_suite, only: run_{module} => run_suite" for module in modules]
    out += ["  implicit none", "  type(runner_t) :: runner", "  call new_runner(runner)"]
    out += [f"  call run_{module}(runner)" for module in modules]
    out += ["  call finish(runner)", f"end program {name}_driver", ""]
    return "\n".join(out)


def main(arguments):
    if len(arguments) == 3 and arguments[0] == "suite":
        Path(arguments[2]).write_text(Suite(Path(arguments[1])).fortran())
    elif len(arguments) > 3 and arguments[0] == "driver":
        Path(arguments[2]).write_text(driver(arguments[1], arguments[3:]))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])
