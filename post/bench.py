"""Measurements of igaform_bench: roofline, and scaling with elements and contact points."""
import json

import numpy as np

from post.results import ResultsError
from post.style import plt, save, tool_colour, BLANK

MARKS = {1: "o", 2: "s"}


def add_arguments(command):
    del command   # none beyond those of all commands


def run(arguments):
    save(draw(read(arguments.file)), arguments.out)
    return 0


def read(path):
    """The records of a file that igaform_bench has written."""
    try:
        with open(path, encoding="utf-8") as file:
            records = json.load(file)
    except OSError as fault:
        raise ResultsError(f"cannot read '{path}': {fault.strerror}") from fault
    except ValueError as fault:
        raise ResultsError(f"'{path}' is not JSON: {fault}") from fault
    keys = {"name", "threads", "ns", "flops", "bytes"}
    if not isinstance(records, list) or not all(
            isinstance(record, dict) and keys <= record.keys() for record in records):
        raise ResultsError(f"'{path}' holds no records of igaform_bench")
    if not chosen(records, "machine/"):
        raise ResultsError(f"'{path}' holds no measurement of the machine")
    return records


def draw(records):
    """Roofline, elements, and contact; panels without records are left out."""
    panels = [panel for panel, stems in (
        (draw_roofline, ("force/",)), (draw_elements, ("elements/",)),
        (draw_points, ("contact/points/",)),
        (draw_faces, ("contact/faces/", "contact/refined/")),
        (draw_searches, ("search/",)))
        if any(chosen(records, stem) for stem in stems)]
    if not panels:
        raise ResultsError("the records are of the machine alone: nothing to draw")
    n_columns = len(panels) if len(panels) <= 3 else 2
    n_rows = -(-len(panels) // n_columns)
    figure, axes = plt.subplots(n_rows, n_columns, figsize=(5.4 * n_columns, 4 * n_rows),
                                squeeze=False, layout="constrained")
    for axis, panel in zip(axes.flat, panels):
        panel(axis, records)
        if axis.get_yscale() == "linear":   # at last: from then on new lines move no limit
            axis.set_ylim(bottom=0)
    for axis in axes.flat[len(panels):]:
        axis.set_axis_off()
    return figure


def chosen(records, stem, threads=None):
    return [record for record in records if record["name"].startswith(stem)
            and threads in (None, record["threads"])]


def thread_counts(records, stem):
    return sorted({record["threads"] for record in chosen(records, stem)})


def draw_roofline(axis, records):
    """Operations a second against operations a byte, below what the machine can do."""
    for threads in thread_counts(records, "force/"):
        colour = (BLANK, tool_colour(0))[(threads - 1) % 2]
        peak = 1 / chosen(records, "machine/multiply_add", threads)[0]["ns"]
        triads = sorted(chosen(records, "machine/triad/", threads),
                        key=lambda record: int(record["name"].rsplit("/", 1)[1]))
        x = np.geomspace(0.5, 50, 100)
        for triad, style in ((triads[1], "--"), (triads[-1], "-")):
            axis.loglog(x, np.minimum(x / triad["ns"], peak), style, color=colour, linewidth=1)
        counted = [record for record in chosen(records, "force/", threads) if record["flops"]]
        axis.loglog([record["flops"] / record["bytes"] for record in counted],
                    [record["flops"] / record["ns"] for record in counted],
                    MARKS.get(threads, "^"), color=colour, markersize=4, label=label_of(threads))
    axis.plot([], [], "k-", linewidth=1, label="bound, data in memory")
    axis.plot([], [], "k--", linewidth=1, label="bound, data in the second cache")
    axis.set(xlabel="operations a byte of state and fields", ylabel="Gflop/s",
             title="Roofline of the force routine")
    axis.legend(fontsize=8, loc="lower left")


def draw_elements(axis, records):
    draw_series(axis, records, "elements/", "-")
    axis.set(xlabel="elements", ylabel="ns an element and step",
             title="Force routine, 2x2x3 points")


def draw_points(axis, records):
    draw_series(axis, records, "contact/points/", "-")
    axis.set(xlabel="slave points", ylabel="ns a point and step", title="Contact, all touching")


def draw_faces(axis, records):
    draw_kinds(axis, records, "contact/")
    axis.set(xlabel="faces of the tool", ylabel="ns a point and step",
             title="Contact by number of faces")


def draw_searches(axis, records):
    draw_kinds(axis, records, "search/")
    axis.set(xlabel="faces of the tool", ylabel="ns a point", title="Search from nothing")


def draw_kinds(axis, records, stem):
    """Tools that grow by faces of one size, and one tool cut finer; a line that grows as log n."""
    draw_series(axis, records, stem + "faces/", "-", "faces of 10 mm, ")
    draw_series(axis, records, stem + "refined/", ":", "tool of 1 m, ")
    first = chosen(records, stem + "faces/100") + chosen(records, stem + "refined/100")
    if first:
        n = np.geomspace(1e2, 1e6, 20)
        axis.plot(n, first[0]["ns"] * np.log(n) / np.log(1e2), color="#999999", linewidth=0.8,
                  label="growth as log n")
        axis.legend(fontsize=8)


def draw_series(axis, records, stem, style, prefix=""):
    """Time against the number at the end of the names, for each number of threads."""
    for threads in thread_counts(records, stem):
        pairs = sorted((int(record["name"].rsplit("/", 1)[1]), record["ns"], record["spread"])
                       for record in chosen(records, stem, threads))
        n, ns, spread = np.array(pairs).T
        colour = (BLANK, tool_colour(0))[(threads - 1) % 2]
        axis.semilogx(n, ns, style, marker=MARKS.get(threads, "^"), markersize=4, color=colour,
                    label=prefix + label_of(threads))
        axis.fill_between(n, ns, ns * (1 + spread), color=colour, alpha=0.12, linewidth=0)
    axis.legend(fontsize=8)


def label_of(threads):
    return "one thread" if threads == 1 else f"{threads} threads"
