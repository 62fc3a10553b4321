"""Tables of numbers in CSV files."""
import csv

import numpy as np

from post.results import ResultsError


def read_numbers(path):
    """The first two columns of a CSV file, shape (rows, 2), with a heading of any lines before
    them. Empty lines and those that begin with # are left out."""
    return numbers_of(path, rows_of(path), (0, 1), "two numbers with a comma between them")


def read_columns(path, names):
    """Columns of a CSV file by their names in its first line, as `name [unit]`: their numbers,
    shape (rows, columns), and their units."""
    rows = rows_of(path)
    heads = [head.rstrip("]").partition(" [") for head in (rows[0][1] if rows else [])]
    places = {name: place for place, (name, _, _) in enumerate(heads)}
    missing = [name for name in names if name not in places]
    if missing:
        raise ResultsError(f"'{path}' has no column {', '.join(missing)}, but "
                           f"{', '.join(places) or 'none'}")
    wanted = [places[name] for name in names]
    return (numbers_of(path, rows, wanted, "numbers in all columns"),
            [heads[place][2] for place in wanted])


def rows_of(path):
    """The lines of a CSV file, as their numbers and lists of texts."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            lines = csv.reader(file)
            return [(lines.line_num, row) for row in lines]
    except OSError as fault:
        raise ResultsError(f"cannot read '{path}': {fault.strerror}") from None
    except UnicodeDecodeError:
        raise ResultsError(f"'{path}' is no text (UTF-8)") from None


def numbers_of(path, rows, places, wanted):
    """The numbers at these places of the rows, shape (rows, places)."""
    values, heading = [], []
    for number, row in rows:
        try:
            values.append([float(row[place]) for place in places])
        except (ValueError, IndexError):
            text = ",".join(row)
            if values and text.strip() and not text.startswith("#"):
                raise ResultsError(f"'{path}', line {number}: found `{text}`; expected "
                                   f"{wanted}") from None
            heading.append(text)
    if heading and not values:
        raise ResultsError(f"'{path}' holds no row of numbers, its last line `{heading[-1][:40]}`; "
                           f"expected {wanted} and points before decimals")
    values = np.array(values).reshape(-1, len(places))
    if not np.all(np.isfinite(values)):
        raise ResultsError(f"'{path}' holds a number that is not finite")
    return values
