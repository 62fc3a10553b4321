"""NURBS as an IGES file: rational B-spline surfaces (entity 128), or other entities made of
numbers, each with as many digits as it takes to read it back bit for bit."""
import contextlib
import os
import stat
import time
from dataclasses import dataclass

import numpy as np

from post.results import ResultsError

MARK = "NURBS surfaces as rational B-spline surfaces (entity 128)."
TRIMMED_MARK = "Trimmed NURBS surfaces (entity 144) in space and in parameters."
OUTLINE_MARK = "Curves of an outline: lines, arcs and splines (entities 110, 100, 126)."
# How files begin that may be replaced; the last one is that of tables of corners.
MARKS = (MARK, TRIMMED_MARK, OUTLINE_MARK, "# Outline of igaform")
N_COLUMNS, N_VALUE_COLUMNS = 72, 64
# Units by their flag (IGES 5.3, section 2.2.4.3.14).
UNITS = {"IN": 1, "INCH": 1, "MM": 2, "FT": 4, "MI": 5, "M": 6, "KM": 7, "MIL": 8, "UM": 9,
         "CM": 10, "UIN": 11}


@dataclass
class Surface:
    """Arrays are in C order: indices (eta, xi), coordinates last."""
    label: str               # eight bytes count
    degrees: tuple           # of xi and eta
    knots: tuple
    points: np.ndarray       # not multiplied by their weights
    weights: np.ndarray


@dataclass
class Entity:
    """A directory entry with its parameters."""
    type: int
    text: str                # values with commas between them, a semicolon at the end
    label: str = ""
    status: str = "00000000"


def write_iges(path, surfaces, unit, author):
    """Write surfaces as a whole or not at all; a file that is of somebody else is left alone."""
    farthest = max(float(np.abs(surface.points).max()) for surface in surfaces)
    entities = [Entity(128, surface_text(surface), surface.label) for surface in surfaces]
    write_entities(path, entities, MARK, (farthest, 0.0), unit, author)


def write_entities(path, entities, mark, sizes, unit, author):
    """Write entities under a mark; `sizes`: the largest coordinate and the smallest distance that
    counts, which is no less than round-off."""
    why = why_left_alone(path)
    if why:
        raise ResultsError(f"cannot write '{path}': {why}; it is left alone; name another with "
                           "--out")
    target = os.path.realpath(path)
    draft = target + ".igaform-new"
    try:
        with open(draft, "w", encoding="latin-1", newline="\n") as file:
            text = global_text(os.path.basename(path), sizes, unit, author)
            file.writelines(line + "\n" for line in lines_of(entities, mark, text))
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, target)
    except OSError as fault:
        with contextlib.suppress(OSError):
            os.remove(draft)
        raise ResultsError(f"cannot write '{path}': {fault.strerror}") from None


def why_left_alone(path):
    """Why what has this name may not be replaced; empty if it may: no file, an empty one, or one
    that was written here. A link counts as what it leads to, and only plain files are opened."""
    try:
        mode = os.stat(path).st_mode
        if not stat.S_ISREG(mode):
            kind = {stat.S_IFDIR: "folder", stat.S_IFIFO: "pipe"}.get(stat.S_IFMT(mode), "device")
            return f"there is a {kind} of this name"
        with open(path, "r+b") as file:
            start = file.read(max(map(len, MARKS)))
    except FileNotFoundError:
        return ""
    except OSError as fault:
        return f"the file of this name cannot be opened ({fault.strerror})"
    if not start or start.startswith(tuple(mark.encode() for mark in MARKS)):
        return ""
    return "there is a file of this name that is no IGES file of igaform"


def lines_of(entities, mark, text):
    """The lines of the sections with their letters and numbers, and the last one; `text`: of the
    global section."""
    sections = {"S": [mark], "D": [], "P": []}
    sections["G"] = [text[i:i + N_COLUMNS] for i in range(0, len(text), N_COLUMNS)]
    for i, entity in enumerate(entities):
        first = len(sections["P"]) + 1
        sections["P"] += [f"{piece:<{N_VALUE_COLUMNS}}{2 * i + 1:8d}"
                          for piece in pieces(entity.text)]
        sections["D"] += directory_lines(entity, first, len(sections["P"]) - first + 1)
    for letter in "SGDP":
        yield from (f"{line:<{N_COLUMNS}}{letter}{i:7d}"
                    for i, line in enumerate(sections[letter], 1))
    last = "".join(f"{letter}{len(sections[letter]):07d}" for letter in "SGDP")
    yield f"{last:<{N_COLUMNS}}T{1:7d}"


def global_text(name, sizes, unit, author):
    """Values of the global section (IGES 5.3, section 2.2.4.3)."""
    farthest, resolution = sizes
    name, author = hollerith(name), hollerith(author)
    unit_name, date = hollerith("INCH" if unit == "IN" else unit), time.strftime("%Y%m%d.%H%M%S")
    return (f"1H,,1H;,{name},{name},{author},{author},32,38,6,308,15,{name},1.,{UNITS[unit]},"
            f"{unit_name},1,0.,{hollerith(date)},{number_text(max(1e-12 * farthest, resolution))},"
            f"{number_text(farthest)},,,11,0,{hollerith(date)};")


def hollerith(text):
    text = bytes_of(text)
    return f"{len(text)}H{text}"


def bytes_of(text):
    """The bytes of a text in UTF-8, each as one character."""
    return os.fsencode(text).decode("latin-1")


def surface_text(surface):
    """Values of an entity 128."""
    n_eta, n_xi = surface.weights.shape
    is_polynomial = int(np.ptp(surface.weights) == 0)
    ends = [end for knots in surface.knots for end in (knots[0], knots[-1])]
    heads = [128, n_xi - 1, n_eta - 1, *surface.degrees, 0, 0, is_polynomial, 0, 0]
    numbers = np.concatenate([*surface.knots, surface.weights.ravel(), surface.points.ravel(),
                              ends])
    return values_text(heads, numbers)


def values_text(heads, numbers=None):
    """Whole numbers and then others, as an entity has them."""
    numbers = [] if numbers is None else numbers.tolist()
    return ",".join([*map(str, heads), *map(number_text, numbers)]) + ";"


def number_text(number):
    """A number as the shortest text that reads back as the same number, always with a point."""
    mantissa, letter, exponent = repr(number).partition("e")
    point = "" if "." in mantissa else "."
    return mantissa.removesuffix("0" if mantissa.endswith(".0") else "") + point \
        + letter.replace("e", "D") + exponent


def pieces(text):
    """The text in pieces for a line each, in which numbers stay whole."""
    first = 0
    while len(text) - first > N_VALUE_COLUMNS:
        last = text.rindex(",", first, first + N_VALUE_COLUMNS) + 1
        yield text[first:last]
        first = last
    yield text[first:]


def directory_lines(entity, first, n_lines):
    """The two lines of an entity in the directory."""
    return ["".join(f"{number:8d}" for number in (entity.type, first, 0, 0, 0, 0, 0, 0))
            + entity.status,
            "".join(f"{number:8d}" for number in (entity.type, 0, 0, n_lines, 0)) + " " * 16
            + f"{bytes_of(entity.label)[:8]:>8}{0:8d}"]
