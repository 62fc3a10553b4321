"""The table of the manual's page on quadrature rules: the modes that rules leave without energy, as
the reader of decks counts them.

usage: rules_page.py IGAFORM PAGE [--write]    compares the page with it, or puts it into the page
"""
import itertools
import os
import pathlib
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

DEGREES = ((1, 1, 1), (2, 1, 2), (2, 2, 1), (2, 2, 2), (3, 2, 2), (3, 3, 2), (3, 3, 3), (4, 4, 2),
           (4, 4, 3))
SIZES = ((1, 1, 1), (2, 1, 1), (2, 2, 1), (2, 2, 2))
# Points of a direction as the degree plus a number, and equal parts through the thickness.
RULES = (((0, 0, 0), 1), ((0, 0, 1), 1), ((0, 0, 0), 2), ((0, 1, 0), 1), ((-1, 0, 1), 1),
         ((1, 1, 1), 1))
DECK = """*MATERIAL, NAME=steel
*DENSITY
7.85e-9
*ELASTIC
210000, 0.3
*BLANK, NAME=block, MATERIAL=steel, TYPE=BOX, QUADRATURE="{},{},{}x{}"
x, 0, 1, {}, {}
y, 0, 1, {}, {}
z, 0, 1, {}, {}
*DYNAMIC, EXPLICIT
1e-6
"""
COUNT = re.compile(r"(\d+) or more")


def cell(igaform, folder, degrees, size, rule):
    """Modes that a rule leaves on a patch; empty where a direction would have no point."""
    more, n_parts = rule
    points = [degree + one for degree, one in zip(degrees, more)]
    if min(points) < 1:
        return ""
    deck = folder / f"{degrees}{size}{rule}.key"
    deck.write_text(DECK.format(*points[:2], n_parts, points[2],
                                *itertools.chain(*zip(degrees, size))))
    done = subprocess.run([igaform, deck, "--check", "--threads", "1"], capture_output=True,
                          text=True, check=False)
    found = COUNT.search(done.stderr)
    assert done.returncode == (1 if found else 0), done.stderr
    return found.group(1) if found else "0"


def table(igaform):
    """The rows in Markdown; `n` stands for two elements."""
    cases = list(itertools.product(DEGREES, SIZES, RULES))
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(os.cpu_count()) as pool:
        cells = iter(pool.map(lambda case: cell(igaform, pathlib.Path(name), *case), cases))
        return [f"| {', '.join(map(str, degrees))} | {' x '.join('1n'[n - 1] for n in size)} |"
                + "".join(f" {next(cells)} |".replace("  ", " ") for _ in RULES)
                for degrees, size in itertools.product(DEGREES, SIZES)]


def main(igaform, page, *options):
    path = pathlib.Path(page)
    lines = path.read_text(encoding="utf-8").splitlines()
    is_row = [re.match(r"\| \d", line) is not None for line in lines]
    rows, first = table(igaform), is_row.index(True)
    others = [line for line, row in zip(lines, is_row) if not row]
    text = "\n".join(others[:first] + rows + others[first:]) + "\n"
    if "--write" in options:
        path.write_text(text, encoding="utf-8")
    elif text != path.read_text(encoding="utf-8"):
        sys.exit(f"{page} is not what the reader of decks counts now; --write puts that into it")


if __name__ == "__main__":
    main(*sys.argv[1:])
