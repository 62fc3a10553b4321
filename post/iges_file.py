"""Surfaces as an IGES file: one rational B-spline surface (entity 128) each, every number with as
many digits as it takes to read it back bit for bit."""
import contextlib
import os
import stat
import time
from dataclasses import dataclass

import numpy as np

from post.results import ResultsError

MARK = "NURBS surfaces as rational B-spline surfaces (entity 128)."
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


def write_iges(path, surfaces, unit, author):
    """Write a file as a whole or not at all; one that is of somebody else is left alone."""
    why = why_left_alone(path)
    if why:
        raise ResultsError(f"cannot write '{path}': {why}; it is left alone; name another with "
                           "--out")
    target = os.path.realpath(path)
    draft = target + ".igaform-new"
    try:
        with open(draft, "w", encoding="latin-1", newline="\n") as file:
            file.writelines(line + "\n" for line in lines_of(path, surfaces, unit, author))
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
            start = file.read(len(MARK))
    except FileNotFoundError:
        return ""
    except OSError as fault:
        return f"the file of this name cannot be opened ({fault.strerror})"
    if start in (b"", MARK.encode()):
        return ""
    return "there is a file of this name that is no IGES file of igaform"


def lines_of(path, surfaces, unit, author):
    """The lines of the sections with their letters and numbers, and the last one."""
    sections = {"S": [MARK], "G": [], "D": [], "P": []}
    text = global_text(os.path.basename(path), surfaces, unit, author)
    sections["G"] = [text[i:i + N_COLUMNS] for i in range(0, len(text), N_COLUMNS)]
    for i, surface in enumerate(surfaces):
        first = len(sections["P"]) + 1
        sections["P"] += [f"{piece:<{N_VALUE_COLUMNS}}{2 * i + 1:8d}"
                          for piece in pieces(surface_text(surface))]
        sections["D"] += directory_lines(first, len(sections["P"]) - first + 1, surface.label)
    for letter, lines in sections.items():
        yield from (f"{line:<{N_COLUMNS}}{letter}{i:7d}" for i, line in enumerate(lines, 1))
    last = "".join(f"{letter}{len(lines):07d}" for letter, lines in sections.items())
    yield f"{last:<{N_COLUMNS}}T{1:7d}"


def global_text(name, surfaces, unit, author):
    """Values of the global section (IGES 5.3, section 2.2.4.3)."""
    farthest = max(float(np.abs(surface.points).max()) for surface in surfaces)
    name, author = hollerith(name), hollerith(author)
    unit_name, date = hollerith("INCH" if unit == "IN" else unit), time.strftime("%Y%m%d.%H%M%S")
    return (f"1H,,1H;,{name},{name},{author},{author},32,38,6,308,15,{name},1.,{UNITS[unit]},"
            f"{unit_name},1,0.,{hollerith(date)},{number_text(1e-12 * farthest)},"
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
    return ",".join([*map(str, heads), *map(number_text, numbers.tolist())]) + ";"


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


def directory_lines(first, n_lines, label):
    """The two lines of an entity in the directory."""
    return ["".join(f"{number:8d}" for number in (128, first, 0, 0, 0, 0, 0, 0)) + "00000000",
            "".join(f"{number:8d}" for number in (128, 0, 0, n_lines, 0)) + " " * 16
            + f"{bytes_of(label)[:8]:>8}{0:8d}"]
