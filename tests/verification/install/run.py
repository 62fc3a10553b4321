"""Install into a temporary folder, move it, and use what is there: programs, decks, the compilation
of user subroutines, the manual.

usage: run.py CMAKE BUILD_FOLDER
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

STRIP = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*USER MATERIAL, CONSTANTS=5, TYPE={kind}
210000, 0.3, 250, 250, 6
*DEPVAR
1
*BLANK, MATERIAL=steel, TYPE=BOX
x, 0, 40, 2, 4
y, 0, 10, 2, 1
z, 0, 1, 2, 1
*BOUNDARY, TYPE=VELOCITY
X_MIN, XSYMM
X_MAX, 1, 1, 4000
*DYNAMIC, EXPLICIT
1e-6
"""
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


def run(folder, *words, code=0):
    """What a program prints, run in an empty folder."""
    done = subprocess.run(list(map(str, words)), cwd=folder, capture_output=True, text=True,
                          timeout=100, check=False)
    assert done.returncode == code, f"{words}: exit code {done.returncode}, not {code}\n" \
                                    f"{done.stdout}\n{done.stderr}"
    return done.stdout + done.stderr


def programs_start(prefix, work):
    said = run(work, prefix / "bin/igaform", "--version")
    assert re.match(r"igaform \d+\.\d+\.\d+ \([^)]+\)\nsources +\w+\ncompiler +\w+", said), said
    assert "force/p2" in run(work, prefix / "bin/igaform_bench", "--list")
    loaded = run(work, "ldd", prefix / "bin/igaform")
    path, = re.findall(r"libigaform_user.so => (.*) \(", loaded)
    assert os.path.samefile(path, prefix / "lib/libigaform_user.so"), loaded


def decks_are_checked(prefix, work):
    decks = prefix / "share/igaform/input"
    for name in ("tension_strip.key", "channel_quick.key"):
        said = run(work, prefix / "bin/igaform", decks / name, "--check")
        assert re.search(r"^elements +\d+", said, re.M), said


def user_subroutines_are_compiled(prefix, work):
    """Both example laws: checked, and run for a few increments."""
    for kind in ("UMAT", "VUMAT"):
        deck = work / f"{kind.lower()}.key"
        deck.write_text(STRIP.format(kind=kind))
        law = prefix / f"share/igaform/input/{kind.lower()}_voce.f"
        run(work, prefix / "bin/igaform", deck, "--user", law, "--check")
        run(work, prefix / "bin/igaform", deck, "--user", law, "--threads", 1, "--quiet")
        assert deck.with_suffix(".h5").is_file()


def benchmark_reads_the_installed_deck(prefix, work):
    deck = prefix / "share/igaform/input/channel_forming.key"
    deck.write_text("*NO KEYWORD\n")
    said = run(work, prefix / "bin/igaform_bench", "--quick", "--threads", 1, "--only",
               "contact/closest_point")
    assert "input/channel_forming.key cannot be read" in said, said


def links_of_the_manual_lead_somewhere(prefix, _):
    manual = prefix / "share/doc/igaform"
    assert (manual / "LICENSE").is_file()
    pages = sorted(manual.rglob("*.md"))
    assert len(pages) > 10, pages
    for page in pages:
        text = re.sub(r"^    .*$|`[^`]*`", "", page.read_text(encoding="utf-8"), flags=re.M)
        for link in LINK.findall(text):
            assert "://" in link or (page.parent / link).exists(), f"{page.name}: {link}"


def main(cmake, build):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(os.path.realpath(name))
        run(folder, cmake, "--install", build, "--prefix", folder / "first")
        prefix, work = folder / "moved here", folder / "work"
        (folder / "first").rename(prefix)
        work.mkdir()
        for test in (programs_start, decks_are_checked, user_subroutines_are_compiled,
                     links_of_the_manual_lead_somewhere, benchmark_reads_the_installed_deck):
            test(prefix, work)
            print("passed:", test.__name__.replace("_", " "))


if __name__ == "__main__":
    main(*sys.argv[1:])
