"""Tables of numbers in CSV files."""
import csv

import numpy as np

from post.results import ResultsError


def read_numbers(path):
    """The first two columns of a CSV file, shape (rows, 2), with a heading of any lines before
    them. Empty lines and those that begin with # are left out."""
    rows, heading = [], []
    try:
        with open(path, newline="", encoding="utf-8") as file:
            lines = csv.reader(file)
            for row in lines:
                try:
                    rows.append((float(row[0]), float(row[1])))
                except (ValueError, IndexError):
                    text = ",".join(row)
                    if rows and text.strip() and not text.startswith("#"):
                        raise ResultsError(f"'{path}', line {lines.line_num}: found `{text}`; "
                                           "expected two numbers with a comma between them") \
                            from None
                    heading.append(text)
    except OSError as fault:
        raise ResultsError(f"cannot read '{path}': {fault.strerror}") from None
    except UnicodeDecodeError:
        raise ResultsError(f"'{path}' is no text (UTF-8)") from None
    if heading and not rows:
        raise ResultsError(f"'{path}' holds no row of numbers, its last line `{heading[-1][:40]}`; "
                           "expected two numbers with a comma between them and points before "
                           "decimals")
    rows = np.array(rows).reshape(-1, 2)
    if not np.all(np.isfinite(rows)):
        raise ResultsError(f"'{path}' holds a number that is not finite")
    return rows
