"""Run the test program that must fail, and check that it says so.

    check_failures.py PROGRAM TEST.pf

Every test of TEST.pf has one assertion that does not hold. Each must be reported once, at its line
and by its name; some messages are compared in full, but for how a compiler writes reals.
"""
import re
import subprocess
import sys
from pathlib import Path

MESSAGES = {
    "real_scalar": "how far: expected 1.0 but found 1.1, difference 0.10000000000000009 "
                   "(tolerance 0.05)",
    "real_array": "expected 3.0 but found 3.5, difference 0.5 (tolerance 0.1) at element [1, 2]",
    "other_shape": "expected shape [2] but found shape [3]",
    "integer_array": "expected 3 but found 4, difference 1 at element [3]",
    "real_less": "expected 1.0 < 1.0, which is not so",
    "text": 'expected "one, two" but found "one, three"',
    "failed_on_purpose": "on purpose",
}


def expected_lines(path):
    """Line of the first assertion of each test that is not disabled, by the test's name."""
    lines, name, is_disabled = {}, "", False
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if line.strip() == "@disable":
            is_disabled = True
        elif match := re.match(r"\s*subroutine (\w+)\(\)", line):
            name, is_disabled = ("" if is_disabled else match.group(1)), False
        elif name and "@assert" in line:
            lines.setdefault(name, number)
    return lines


def with_short_reals(message):
    """Reals with as few digits as tell them apart: 1., 1.0000000000000000 and 1.0 are one."""
    return re.sub(r"\d*\.\d*(E[+-]?\d+)?", lambda real: repr(float(real.group())), message)


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


def main(program, source):
    faults = []
    lines = expected_lines(Path(source))
    result = run(program)
    found = re.findall(r"^(\S+):(\d+): failed: (\w+)\.(\w+): (.*)$", result.stdout, re.MULTILINE)
    by_name = {}
    for file, line, _, name, message in found:
        by_name.setdefault(name, []).append((file, int(line), message))
    for name, line in lines.items():
        reports = by_name.pop(name, [])
        if [report[:2] for report in reports] != [(Path(source).name, line)]:
            faults.append(f"{name}: expected one failure at line {line}, found {reports}")
        elif name in MESSAGES and with_short_reals(reports[0][2]) != MESSAGES[name]:
            faults.append(f"{name}: expected {MESSAGES[name]!r}, found {reports[0][2]!r}")
    faults += [f"unexpected failure of {name}" for name in by_name]
    summary = f"0 passed, {len(lines)} failed, 1 disabled"
    if summary not in result.stdout.splitlines():
        faults.append(f"expected the summary {summary!r}, found: {result.stdout[-200:]!r}")
    if result.returncode == 0:
        faults.append("the program with failing tests ended without an error")
    if run(program, "-f", "no such test").returncode == 0:
        faults.append("the program that ran no test ended without an error")
    one = run(program, "-f", "integer_scalar").stdout
    if "0 passed, 1 failed, 0 disabled" not in one:
        faults.append(f"the filter for one test gave: {one!r}")
    print("\n".join(faults) or f"all {len(lines)} failures were reported")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
