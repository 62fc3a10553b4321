"""Run the program on faulty decks: exit code 1, all faults told, no result file, no crash.

Usage: run.py PROGRAM. The decks and what their reports must hold are listed in cases.txt; decks
that are better made than kept (binary, CRLF line ends, very long) are made here.
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import time
from collections import defaultdict

HERE = pathlib.Path(__file__).resolve().parent
LONG_DECK_SECONDS = 5.0   # about 1 on an idle machine
BOMB_SECONDS = 10.0       # about 0.5 on an idle machine
LONGEST_REPORT = 200_000  # characters


def read_cases():
    """Level and expected fragments of one report line, by deck."""
    cases = defaultdict(list)
    for line in (HERE / "cases.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            level, deck, *fragments = (entry.strip() for entry in line.split("|"))
            cases[deck].append((level, fragments))
    return cases


def run(program, deck, *options):
    """Run the program on a deck in an empty folder; its result and the files it left there."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([program, str(deck), *options], cwd=folder, capture_output=True,
                              text=True, errors="replace", timeout=120)
        return done, sorted(path.name for path in pathlib.Path(folder).iterdir())


def is_told(report, fragments):
    """Does one line of the report hold all fragments?"""
    return any(all(fragment in line for fragment in fragments) for line in report.splitlines())


def check_refusal(program, deck, expected, *options):
    """Complaints about how the program refuses a deck; none if it does it well."""
    done, left = run(program, deck, *options)
    complaints = [f"no line with {fragments}" for fragments in expected
                  if not is_told(done.stderr, fragments)]
    if done.returncode != 1:
        complaints.append(f"exit code {done.returncode} instead of 1")
    if left:
        complaints.append(f"it left {', '.join(left)}")
    if "Fortran runtime error" in done.stderr or "Backtrace" in done.stderr:
        complaints.append("it crashed")
    if len(done.stderr) > LONGEST_REPORT:
        return [f"a report of {len(done.stderr)} characters"]
    return [f"{complaint}; stderr was:\n{done.stderr}" for complaint in complaints]


def check_acceptance(program, deck, expected=()):
    """Complaints about how the program checks a deck that can run."""
    done, left = run(program, deck, "--check")
    complaints = [f"no line with {fragments}" for fragments in expected
                  if not is_told(done.stderr, fragments)]
    if done.returncode != 0:
        complaints.append(f"exit code {done.returncode} instead of 0")
    if "error:" in done.stderr:
        complaints.append("it found errors")
    if not expected and "warning:" in done.stderr:
        complaints.append("it warned")
    if left:
        complaints.append(f"it left {', '.join(left)}")
    return [f"{complaint}; stderr was:\n{done.stderr}" for complaint in complaints]


def check_log(program, deck, folder, has_contact):
    """Complaints about a log that tells of contact where there is none, or does not tell."""
    subprocess.run([program, str(HERE / deck), "--quiet", "--out", str(folder / "log.h5")],
                   capture_output=True, check=False, timeout=120)
    log = (folder / "log.log").read_text()
    complaints = []
    if ("deepest penetration" in log) != has_contact:
        complaints.append("wrong about the deepest penetration")
    if bool(re.search(r": \d+ of \d+ points tested,", log)) != has_contact:
        complaints.append("wrong about the points tested")
    return [f"{complaint}; the log is:\n{log}" for complaint in complaints]


def check_trims(program, folder, parts):
    """Complaints about the log of a trim at the very start, with mass and area of its hole, and of
    a slit in the next step."""
    deck = folder / "trim.key"
    deck.write_text(parts[0] + "*BLANK, NAME=sheet, MATERIAL=steel, TYPE=BOX, ELEMENT=SHELL\n"
                    "x, 0, 100, 2, 10\ny, 0, 60, 2, 6\nz, 0, 2, 2, 1\n"
                    "*STEP, NAME=first\n*DYNAMIC, EXPLICIT\n1e-6\n*TRIM, NAME=hole, KEEP=OUTSIDE\n"
                    "START, 10, 10\nLINE, 25, 10\nLINE, 25, 20\nLINE, 10, 20\n*END STEP\n"
                    "*STEP, NAME=next\n*DYNAMIC, EXPLICIT\n1e-6\n*TRIM, NAME=slit, KEEP=OUTSIDE\n"
                    "START, 42, -1\nLINE, 43, -1\nLINE, 43, 50\nLINE, 42, 50\n*END STEP\n")
    subprocess.run([program, str(deck), "--quiet", "--out", str(folder / "trim.h5")],
                   capture_output=True, check=False, timeout=120)
    log = (folder / "trim.log").read_text()
    lines = ("trim       hole, mass cut away 2.355e-6, area 150",     # 300 times 7.85e-9
             "trim       slit, mass cut away 7.85e-7, area 50",
             f"warning: {deck}:24: *TRIM, NAME=slit: a gap of 1, 0.1 elements, at (42.5, ")
    return [f"no `{words}`; the log is:\n{log}" for words in lines if log.count(words) != 1]


def check_listed(program):
    """Decks of cases.txt."""
    for deck, expectations in read_cases().items():
        fragments = [entry for _, entry in expectations]
        if all(level in ("warning", "advice") for level, _ in expectations):
            yield deck, check_acceptance(program, HERE / deck, fragments)
        else:
            yield deck, check_refusal(program, HERE / deck, fragments)


def check_made(program, folder):
    """Decks that are made here."""
    binary = folder / "binary.key"
    binary.write_bytes(bytes(range(256)) * 8)
    yield "binary file", check_refusal(program, binary, [["binary", "binary.key"]])
    yield "file without end", check_refusal(program, pathlib.Path("/dev/zero"),
                                            [["binary", "/dev/zero"]])

    yield "missing deck", check_refusal(program, folder / "nowhere.key", [["nowhere.key"]])
    yield "unknown setting", check_refusal(program, HERE / "unknown_parameter.key",
                                           [["--set THICKNES", " THICKNESS?"]],
                                           "--set", "thicknes=2")

    parts = [(HERE / name).read_text() for name in ("steel.inc", "sheet.inc", "step.inc")]
    crlf = folder / "crlf.key"
    crlf.write_bytes("".join(parts).replace("\n", "\r\n").encode())
    yield "CRLF line ends", check_acceptance(program, crlf)

    endless = folder / "endless.key"
    endless.write_text("".join(parts).replace("1.0e-6", "1.0e30"))
    yield "endless process", check_acceptance(program, endless,
                                              [["warning: *DYNAMIC:", "e36 increments"]])

    pressing = folder / "pressing.key"
    pressing.write_text((HERE / "holder_away.key").read_text()
                        .replace("INPUT=", f"INPUT={HERE}/").replace("0, 0, 500", "0, 0, -500"))
    yield "force on the sheet", check_acceptance(program, pressing)

    for name, content in (("words.igs", b"no surfaces\n" * 30), ("plan.igs", b"\x89PNG\r\n\x1a\0")):
        (folder / name).write_bytes(content)
        no_iges = folder / "no_iges.key"
        no_iges.write_text("".join(parts) + f"*BLANK OUTLINE, INPUT={name}\n"
                           f"*TOOL, NAME=die, TYPE=IGES, INPUT={name}\n")
        complaints = check_refusal(program, no_iges, [[f"{name}:1: error: IGES", "no IGES file",
                                                       "begins with", "80 columns"]])
        if len(run(program, no_iges)[0].stderr.splitlines()) > 3:
            complaints.append("more than a line for each of its keywords")
        yield f"no IGES file, {name}", complaints

    yield "log of trims", check_trims(program, folder, parts)
    yield "log without contact", check_log(program, "good.key", folder, False)
    yield "log with contact", check_log(program, "idle_tool.key", folder, True)

    long_deck = folder / "long.key"
    probes = "".join(f"*PROBE, NAME=p{i}\n0.5, 0.5, 0.5\n" for i in range(50000))
    long_deck.write_text("".join(parts) + probes + "*SET, NAME=last\n")
    start = time.monotonic()
    complaints = check_refusal(program, long_deck, [["long.key:100015: error: *SET:"]])
    seconds = time.monotonic() - start
    if seconds > LONG_DECK_SECONDS:
        complaints.append(f"{seconds:.1f} s for 100,000 lines")
    yield "100,000 lines", complaints


def check_bombs(program, folder):
    """Decks that would fill memory, time or report: refused with an error, soon and in short."""
    parts = "".join((HERE / name).read_text() for name in ("steel.inc", "sheet.inc", "step.inc"))
    for i in range(15):
        (folder / f"level{i}.inc").write_text(f"** {i}\n"
                                              + 2*f"*INCLUDE, INPUT=level{i + 1}.inc\n")
    (folder / "level15.inc").write_text("** the end\n")
    nested = "*PARAMETER\np0 = " + '"' + 100*"x" + '"\n'
    nested += "".join(f'p{i} = "{4*f"<p{i - 1}>"}"\n' for i in range(1, 13))
    heading = "*HEADING\n"
    repeated = "*PARAMETER\nlong = " + '"' + 400_000*"x" + '"\n' + heading + 340*"<long>\n"
    density, bad_set = "*DENSITY\n", "*SET, NAME=s, OPERATION=INTERSECTION\n" + 5000*"nonsense\n"
    bombs = {
        "levels": ("*INCLUDE, INPUT=level0.inc\n", "1000 files"),
        "nested parameters": (nested, "500000 characters"),
        "repeated parameter": (repeated, "134217728 characters"),
        "lines": (heading + 10_000_001*"\n", "10000000 lines"),
        "name": ("*SET, NAME=" + 9_000_000*"n" + "\nXI_MIN\n", "500000"),
        "long name": ("*SET, NAME=" + 300*"n" + "\nXI_MIN\n", "300 characters"),
        "keyword": ("*" + 450_000*"K" + "\n", "keyword"),
        "parameter": ("*PARAMETER\n" + 300*"p" + " = 1\n", "255"),
        "continuation": ("*SET, NAME=s,\n" + 110_000*"A=1,\n", "500000"),
        "options": ("*SET, NAME=s" + 90_000*", A=1" + "\nXI_MIN\n", "90001 options"),
        "word": (density + 450_000*"w" + "\n", "density"),
        "number": (density + "7" + 450_000*"9" + "\n", "density"),
        "expression": ("*PARAMETER\np = " + 220_000*"1+" + "\n", "nothing"),
        "faults": (bad_set, "4000 more"),
    }
    for name, (text, words) in bombs.items():
        deck = folder / "bomb.key"
        deck.write_text(text + parts if "*PARAMETER" in text else parts + text)
        start = time.monotonic()
        complaints = check_refusal(program, deck, [[words]], "--check")
        seconds = time.monotonic() - start
        if seconds > BOMB_SECONDS:
            complaints.append(f"{seconds:.1f} s")
        yield f"bomb: {name}, {seconds:.1f} s", complaints


def main(program):
    """Run all checks; the exit code says whether all went well."""
    program = str(pathlib.Path(program).resolve())
    n_bad = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for checks in (check_listed(program), check_made(program, folder),
                       check_bombs(program, folder)):
            for name, complaints in checks:
                print("ok  " if not complaints else "FAIL", name)
                for complaint in complaints:
                    print("    " + complaint)
                n_bad += bool(complaints)
    print(f"{n_bad} decks failed")
    return 1 if n_bad else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
