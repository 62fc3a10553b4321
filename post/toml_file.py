"""TOML files that describe work, read and checked: all faults are reported in one go."""
import difflib
import sys
import tomllib

from post.results import ResultsError

NUMBER = (int, float)
KINDS = {str: "a text", int: "a whole number", dict: "a table", list: "a list",
         bool: "true or false", NUMBER: "a number"}


def read_toml(path, what, make_reader):
    """What the reader's `take` makes of a file; `ResultsError` with all its faults."""
    try:
        with open(path, "rb") as file:
            source = tomllib.load(file)
    except OSError as fault:
        raise ResultsError(f"there is no {what} '{path}': {fault.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as fault:
        raise ResultsError(f"{path}: not TOML: {fault}") from None
    reader = make_reader(path)
    taken = reader.take(source)
    if reader.faults:
        raise ResultsError("\n".join(reader.faults))
    return taken


def hint(name, known):
    """The nearest of the known names, as the end of a message."""
    near = difflib.get_close_matches(str(name), known, 1, 0.5)
    return f"; did you mean {near[0]}?" if near else ""


class TomlReader:
    """Takes the tables of a file apart and notes what is wrong. Others add `take`."""
    places = {}     # where a key belongs, for a key that stands elsewhere

    def __init__(self, path):
        self.path = path
        self.faults = []

    def fault(self, key, found, expected):
        self.faults.append(f"{self.path}: {key}: found {found}; expected {expected}")

    def known(self, table, keys, where):
        """The entries that are known and of the right kind; the others are faults."""
        good = {}
        for key, value in table.items():
            place = f"{where}.{key}" if where else key
            if key not in keys and key in self.places:
                self.fault(place, "a key that does not belong there", f"{key} {self.places[key]}")
            elif key not in keys:
                self.fault(place, "an unknown key", f"one of {', '.join(keys)}{hint(key, keys)}")
            elif not isinstance(value, keys[key]) or (isinstance(value, bool)
                                                      and keys[key] is not bool):
                self.fault(place, repr(value), KINDS[keys[key]])
            elif keys[key] == NUMBER and not abs(value) <= sys.float_info.max:
                self.fault(place, value, "a finite number")
            else:
                good[key] = value
        return good
