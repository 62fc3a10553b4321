"""Tables of numbers in CSV files."""
import csv

import numpy as np

from post.results import ResultsError


def read_numbers(path):
    """The first two columns of a CSV file, shape (rows, 2); lines that are no numbers are left
    out."""
    rows = []
    try:
        with open(path, newline="", encoding="utf-8") as file:
            for row in csv.reader(file):
                try:
                    rows.append((float(row[0]), float(row[1])))
                except (ValueError, IndexError):
                    continue
    except OSError as fault:
        raise ResultsError(f"cannot read '{path}': {fault.strerror}") from None
    return np.array(rows).reshape(-1, 2)
