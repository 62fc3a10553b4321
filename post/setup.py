"""The set-up of a deck as a picture and as a page with a view that can be turned: blank, tools with
the side on which the sheet lies, motions, forces, gaps and first contact. No run is needed."""
import os
import re
import sys
import tempfile
from dataclasses import dataclass

import numpy as np

from post.deck import same
from post.drives import (coarse_sheet, coarse_tool, drives_of, first_drive, time_of,
                         way_to_contact)
from post.picture import add_size_argument
from post.results import Results, ResultsError, counted, text_of
from post.scene import Scene
from post.setup_page import page
from post.setup_picture import draw
from post.start import add_deck_arguments, checked_start
from post.style import check_format, save, tool_colour
from post.view import view_of

TOUCHES = 1e-3      # gap, in thicknesses, that counts as none


def add_arguments(command):
    command.add_argument("file", metavar="DECK", help="deck of igaform")
    command.add_argument("-o", "--out", metavar="PNG",
                         help="the picture to write (default: DECK without its ending, "
                              "-setup.png); the page is written beside it as .html")
    add_size_argument(command)
    add_deck_arguments(command)


def run(arguments):
    out = arguments.out
    check_format(out)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "start.h5")
        report, messages = checked_start(arguments, path)
        with Results(path) as results:
            facts = Facts(results, report, messages)
            save(draw(results, facts, folder), out, arguments.small)
            write_page(os.path.splitext(out)[0] + ".html", page(results, facts))
    if facts.errors:
        print(f"post: igaform rejects '{arguments.file}'; the set-up is drawn as the deck has it:\n"
              + "\n".join(facts.errors), file=sys.stderr)
    return 1 if facts.errors else 0     # as --check, for scripts


def write_page(path, text):
    try:
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
    except OSError as fault:
        raise ResultsError(f"cannot write '{path}': {fault.strerror}") from None
    print(f"page written: {path}")


@dataclass
class ToolFact:
    """What is known of a tool; ways and times count from the start of the step of its drive."""
    name: str
    colour: str
    is_present: bool     # at the start
    drive: object        # what moves it first, or None
    way: float           # to the blank along its motion, or None
    place: np.ndarray    # where they meet
    words: list          # lines of text
    has_gap: bool = False


class Facts:
    """What the texts of picture and page say."""

    def __init__(self, results, report, messages):
        self.heading = text_of(results.file["provenance/heading"][()])
        self.report = report
        self.findings = findings_of(messages)
        self.errors = [text for kind, text in self.findings if kind == "error"]
        self.view = view_of(results)
        self.scene = Scene(results, 0, "thickness")
        self.length = results.unit("VTKHDF/Points")
        self.time = results.unit("VTKHDF/Steps/Values")
        self.sheet = coarse_sheet(results)
        self.thickness = float(self.sheet.values.max())
        self.run = run_words(report, len(self.findings) - len(self.errors))
        self.blank = blank_words(results, self.sheet.points, self.length)
        self.tools = [self.tool_fact(results, i, name) for i, name in enumerate(results.tools)]

    def tool_fact(self, results, i, name):
        part = coarse_tool(results, name)
        drive = first_drive(drives_of(results.deck), name)
        is_present = name in results.tools_present(0)
        if drive is None or drive.kind in ("ROTATION", "ANGULAR VELOCITY"):
            is_below = self.scene.place_of(part, self.view.up_axis)[0]
            direction = np.eye(3)[self.view.up_axis] * (1 if is_below else -1)
        else:
            direction = drive.vector
        way, place = way_to_contact(part, self.sheet, direction, self.thickness) or (None, None)
        fact = ToolFact(name, tool_colour(i), is_present, drive, way, place, [])
        fact.has_gap = way is not None and way > TOUCHES * self.thickness
        fact.words = [size_text(part.points, self.length), *self.drive_words(results, drive),
                      self.contact_words(results, fact), *friction_words(results.deck, name)]
        if not is_present:
            fact.words.append("removed in the first step")
        return fact

    def drive_words(self, results, drive):
        """How a tool moves."""
        if drive is None:
            return ["does not move"]
        length, time = self.length, self.time
        verb, unit = {"VELOCITY": ("moves at", f"{length}/{time}"),
                      "DISPLACEMENT": ("moves by", length),
                      "ROTATION": ("turns by", "degrees"),
                      "ANGULAR VELOCITY": ("turns at", f"degrees/{time}"),
                      "FORCE": ("pressed by", results.unit(f"tools/{results.tools[0]}/force")),
                      }[drive.kind]
        words = f"{verb} {drive.value:.5g} {unit} along {vector_text(unit_vector(drive.vector))}"
        if drive.kind in ("ROTATION", "ANGULAR VELOCITY"):
            words = words.replace("along", "about")
        if drive.amplitude:
            words += f", amplitude {drive.amplitude}"
        return [words + (f", from step {drive.step}" if drive.step > 1 else "")]

    def contact_words(self, results, fact):
        """Gap and first contact."""
        if fact.way is None:
            return "passes the blank"
        if not fact.has_gap:
            return "touches the blank at the start"
        words = f"gap to the blank {fact.way:.4g} {self.length}"
        time = time_of(results.deck, fact.drive, fact.way)
        if time is not None:
            words += f", first contact at {time:.4g} {self.time}"
        return f"{words} at {vector_text(fact.place)}"


def size_text(points, length):
    """Extents along x, y and z."""
    sizes = np.round(np.ptp(points, axis=0), 9)
    return " x ".join(f"{size:.4g}" for size in sizes) + f" {length}"


def unit_vector(vector):
    return vector / max(np.linalg.norm(vector), 1e-300)


def vector_text(vector):
    return "(" + ", ".join(f"{value:.4g}" for value in np.round(vector, 9) + 0.0) + ")"


def friction_words(deck, tool):
    """Friction of the contact pairs of a tool."""
    values = [record.options.get("FRICTION", "0") for record in deck.named("CONTACT PAIR")
              if same(record.options["TOOL"]) == same(tool)]
    return [f"friction {', '.join(dict.fromkeys(values))}"] if values else ["no contact pair"]


def findings_of(messages):
    """Errors and warnings of --check: kind, and file, line and message; errors first."""
    found = re.findall(r"^.*?: (error|warning): .*$", messages, re.MULTILINE)
    texts = re.findall(r"^.*?: (?:error|warning): .*$", messages, re.MULTILINE)
    return sorted(zip(found, texts), key=lambda item: item[0])


def run_words(report, n):
    """Mass, steps and time from the report of --check, and how many warnings it has."""
    found = re.findall(r"^(mass|stable increment|steps|run time) {2,}(.*)$", report, re.MULTILINE)
    return [f"{name} {value}" for name, value in found] + [f"warnings of --check: {n}"] * (n > 0)


def blank_words(results, points, length):
    """Size and mesh of the blank."""
    n = sum(int(np.prod(patch.n_elements)) for patch in results.patches)
    mesh = f"{counted(n, 'element')} of degree {results.patches[0].degree}"
    if len(results.patches) > 1:
        mesh += f", {len(results.patches)} patches"
    return [size_text(points, length), mesh]
