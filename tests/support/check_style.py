"""Check the rules of style that a script can see in the Fortran and Python files of the project.

    check_style.py ROOT    prints the faults as file:line: what, and fails if there are any
"""
import re
import sys
from pathlib import Path

MAX_COLUMNS = 100
MAX_FILE_LINES = 800
MAX_PROCEDURE_LINES = 75
# The modules that must remember something between calls which have no argument to carry it,
# and the assertions' list of failures for the same reason.
MAY_HOLD_VARIABLES = {"interrupt", "out_of_memory", "user_watch", "abaqus_utilities",
                      "funit_failures"}
FORBIDDEN = [
    (re.compile(r"^\s*save\b|,\s*save\b"), "save"),
    (re.compile(r"^\s*common\b"), "common"),
    (re.compile(r"\bgo ?to\b"), "goto"),
    (re.compile(r"^\s*equivalence\b"), "equivalence"),
    (re.compile(r"\bclass\s*\(\s*\*\s*\)"), "class(*)"),
    (re.compile(r"\breal\s*\*\s*\d|\bdouble precision\b"), "a kind other than by name"),
]
STOP = re.compile(r"^\s*(if\s*\(.*\)\s*)?(error\s+)?stop\b")
BEGIN = re.compile(r"^(?!\s*end\b)\s*(?:[\w(),=*: ]*\s)?(subroutine|function)\s+(\w+)\s*(\(|$)")
END = re.compile(r"^\s*end\s+(subroutine|function)\b")
DECLARATION = re.compile(r"^\s*(integer|real|logical|character|complex|type\s*\(|class\s*\()"
                         r".*::")
CONSTANT = re.compile(r"\bparameter\b|\bprotected, bind\(c\b|\bbind\(c\b.*\bprotected\b")


def code_of(line):
    """The line in lower case without its comment and with its texts emptied."""
    out, quote = [], ""
    for char in line:
        if quote:
            if char == quote:
                quote = ""
                out.append(char)
        elif char in "\"'":
            quote = char
            out.append(char)
        elif char == "!":
            break
        else:
            out.append(char)
    return "".join(out).lower()


def layout_faults(lines):
    """Faults that any text file can have."""
    for number, line in enumerate(lines, 1):
        is_assertion = line.lstrip().startswith("@assert")
        if len(line) > MAX_COLUMNS and not is_assertion:
            yield number, f"{len(line)} columns, at most {MAX_COLUMNS}"
        if "\t" in line:
            yield number, "a tab"
        if line != line.rstrip():
            yield number, "blanks at the end of the line"
        if re.search(r"\b(TO" r"DO|FIX" r"ME|XX" r"X)\b", line):
            yield number, "a note of work left to do"
    if len(lines) > MAX_FILE_LINES:
        yield len(lines), f"{len(lines)} lines, at most {MAX_FILE_LINES}"


def procedure_faults(code):
    """Procedures that are too long; those of interface blocks do no harm."""
    open_procedures = []
    for number, line in enumerate(code, 1):
        if match := BEGIN.match(line):
            open_procedures.append((match.group(2), number))
        elif END.match(line) and open_procedures:
            name, first = open_procedures.pop()
            if number - first + 1 > MAX_PROCEDURE_LINES:
                yield first, (f"{name} has {number - first + 1} lines, "
                              f"at most {MAX_PROCEDURE_LINES}")


def module_faults(path, code, is_test):
    """Name, `implicit none`, `private` and variables of a module."""
    text = "\n".join(code)
    modules = re.findall(r"^\s*module\s+(?!procedure\b)(\w+)\s*$", text, re.MULTILINE)
    if not modules and path.stem != "main":
        return
    if path.stem != "main" and modules != [path.stem]:
        yield 1, f"expected one module named {path.stem}, found {', '.join(modules)}"
    if not re.search(r"^\s*implicit none\s*$", text, re.MULTILINE):
        yield 1, "no implicit none"
    if modules and not is_test and not re.search(r"^\s*private\s*$", text, re.MULTILINE):
        yield 1, "not private by default"
    if modules and not is_test and path.stem not in MAY_HOLD_VARIABLES:
        yield from variable_faults(code)


def variable_faults(code):
    """Variables in the part of a module before its procedures."""
    inside = 0
    for number, line in enumerate(code, 1):
        if re.match(r"^\s*contains\b", line) and not inside:
            return
        if re.match(r"^\s*(abstract\s+)?interface\b|^\s*type\s*(,.*)?(::)?\s*\w+\s*$", line):
            inside += 1
        elif re.match(r"^\s*end\s*(interface|type)\b", line):
            inside -= 1
        elif not inside and DECLARATION.match(line) and not CONSTANT.search(line):
            yield number, "a variable of a module"


def fortran_faults(path, lines, is_test):
    code = [code_of(line) for line in lines]
    may_stop = is_test or path.stem == "main"
    for number, line in enumerate(code, 1):
        for pattern, what in FORBIDDEN:
            if pattern.search(line):
                yield number, what
        if STOP.match(line) and not may_stop:
            yield number, "stop outside the main program"
    yield from procedure_faults(code)
    yield from module_faults(path, code, is_test)


def is_built(path, root):
    """Is the file named in the CMakeLists.txt of its folder or of one above it?"""
    for folder in [path.parent, *path.parent.parents]:
        lists = folder / "CMakeLists.txt"
        if lists.is_file() and re.search(rf"(?<![\w.]){re.escape(path.name)}(?![\w.])",
                                         lists.read_text(encoding="utf-8")):
            return True
        if folder == root:
            break
    return False


def faults(root):
    """All faults below the source, test and post-processing folders."""
    files = [path for folder in ("src", "tests", "post") for path in (root / folder).rglob("*")
             if path.suffix in (".f90", ".F90", ".pf", ".inc", ".py")]
    for path in sorted(files):
        lines = path.read_text(encoding="utf-8").splitlines()
        found = list(layout_faults(lines))
        is_compiled = path.suffix in (".f90", ".F90", ".pf") and path.parent.name != "files"
        if is_compiled and not is_built(path, root):
            found.append((1, "in no CMakeLists.txt, so it is not built"))
        if path.suffix != ".py":
            found += fortran_faults(path, lines, "tests" in path.relative_to(root).parts)
        for number, what in found:
            yield f"{path.relative_to(root)}:{number}: {what}"
    if not files:
        yield f"no source files below {root}"


def main(root):
    found = list(faults(Path(root)))
    print("\n".join(found) or "no faults of style")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
