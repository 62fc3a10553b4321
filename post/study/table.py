"""The table of a study: a row for each run, as CSV and as HDF5."""
import csv
import os

import h5py
import numpy as np

from post.results import ResultsError

# Columns that every table can hold: unit and meaning; those of shares and parameters are added.
COLUMNS = {
    "run": ("", "name of the result file"), "status": ("", "as igaform batch reports it"),
    "control_points": ("", "control points of the blank"), "elements": ("", "elements"),
    "steps": ("", "time steps"), "cpu_seconds": ("s", "processor time of the whole run"),
    "stepping_seconds": ("s", "wall-clock time of all steps"),
    "forecast_seconds": ("s", "forecast of --check"),
    "energy_error": ("%", "largest error of the balance"),
    "shape_error": ("mm", "rms distance of the mid-surface"),
    "greatest_distance": ("mm", "greatest distance of the mid-surface"),
    "shift": ("mm", "shift along the sheet that was taken out"),
    "mean_plastic_strain": ("", "mean plastic strain"),
    "mean_plastic_strain_error": ("%", "error of the mean plastic strain"),
    "external_work": ("mJ/mm", "external work per width"),
    "external_work_error": ("%", "error of the external work"),
    "penetration_error": ("%", "deepest penetration over the thickness"),
    "least_thickness": ("mm", "least thickness"), "thickness_error": ("mm", "rms error of it"),
}


def make_row(run, judge):
    """Cost, errors and parameters of a run that is finished."""
    row = {"run": run.identity, "status": run.status}
    row |= run.cost()
    row |= {f"set_{name}": value for name, value in run.parameters.items()}
    row["deck"] = os.path.basename(run.deck)
    if run.status == "completed":
        row |= judge.errors(run.result)
    return row


def column_names(rows):
    """All columns in the order: run, parameters, known columns, shares."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    sets = [name for name in names if name.startswith("set_")]
    shares = [name for name in names if name.startswith("share_")]
    known = [name for name in COLUMNS if name in names and name not in ("run", "status")]
    return ["run", "deck", "status", *sets, *known, *shares]


def write_csv(rows, path):
    names = column_names(rows)
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(names)
        table.writerows([text_of_cell(row.get(name, "")) for name in names] for row in rows)


def text_of_cell(value):
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def read_csv(path):
    """The rows of a table, numbers as numbers; cells that are empty are left out."""
    if not os.path.isfile(path):
        raise ResultsError(f"there is no table '{path}': `python -m post study STUDY --store` "
                           "writes it")
    with open(path, newline="", encoding="utf-8") as file:
        return [{name: cell_of_text(text) for name, text in row.items() if text != ""}
                for row in csv.DictReader(file)]


def cell_of_text(text):
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text


def write_hdf5(rows, study, program, path):
    """The same table, a dataset for each column; what is missing is NaN or an empty text."""
    with h5py.File(path, "w") as file:
        file.attrs["title"] = study.title
        file.attrs["generator"] = program
        for name in column_names(rows):
            values = [row.get(name) for row in rows]
            if all(value is None or isinstance(value, (int, float)) for value in values):
                data = np.array([np.nan if value is None else value for value in values])
            else:
                data = ["" if value is None else str(value) for value in values]
            unit, text = described(name)
            dataset = file.create_dataset(name, data=data)
            dataset.attrs["unit"] = unit
            dataset.attrs["description"] = text


def described(name):
    """Unit and meaning of a column."""
    if name.startswith("share_"):
        return "%", f"share of the time of all steps: {name.removeprefix('share_')}"
    if name.startswith("set_"):
        return "", f"parameter {name.removeprefix('set_')} of the deck"
    return COLUMNS.get(name, ("", "name of the deck"))
