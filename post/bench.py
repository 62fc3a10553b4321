"""Measurements of igaform_bench: share of the machine's bound, targets, comparison of two runs;
pictures of the roofline and of scaling with elements and contact points."""
import numpy as np

from post.bench_records import chosen, find, last_number, read, triads_of
from post.bench_report import comparison_table, record_table
from post.bench_targets import verdicts
from post.results import ResultsError
from post.style import check_format, plt, save, tool_colour, BLANK

MARKS = {1: "o", 2: "s"}


def add_arguments(command):
    command.add_argument("file", metavar="NOW", help="records of igaform_bench --json")
    command.add_argument("--compare", metavar="BEFORE",
                         help="ratios to the records of an earlier run")
    command.add_argument("--targets", action="store_true",
                         help="what has a target, met or missed; ends with code 1 where one is "
                              "missed or none is there")
    command.add_argument("-o", "--out", metavar="PNG", default="",
                         help="the picture to write (default: NOW without its ending, -bench.png; "
                              "none with --compare or --targets)")


def run(arguments):
    """Without --compare and --targets the table of all records, and their picture."""
    if arguments.out:
        check_format(arguments.out)
    now = read(arguments.file)
    code = 0
    if arguments.compare is not None:
        print(comparison_table(now, read(arguments.compare)))
    if arguments.targets:
        code = print_verdicts(arguments.file, now)
    out = arguments.out
    if arguments.compare is None and not arguments.targets:
        print(record_table(now))
        if not out and panels_of(now):
            out = arguments.file.removesuffix(".json") + "-bench.png"
    if out:
        save(draw(now), out)
    return code


def print_verdicts(path, records):
    """Print what has a target; 1 if one is missed."""
    found = verdicts(records)
    if not found:
        raise ResultsError(f"'{path}' holds no record that has a target")
    print("\n".join(str(verdict) for verdict in found))
    return 0 if all(verdict.is_met for verdict in found) else 1


def panels_of(records):
    """What draws the panels for which there are records."""
    return [panel for panel, stems in (
        (draw_roofline, ("force/",)), (draw_elements, ("elements/",)),
        (draw_points, ("contact/points/",)),
        (draw_faces, ("contact/faces/", "contact/refined/")),
        (draw_searches, ("search/",)))
        if any(chosen(records, stem) for stem in stems)]


def draw(records):
    """Roofline, elements, and contact; panels without records are left out."""
    panels = panels_of(records)
    if not panels:
        raise ResultsError("nothing to draw: no record of forces, elements or contact")
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


def thread_counts(records, stem):
    return sorted({record["threads"] for record in chosen(records, stem)})


def draw_roofline(axis, records):
    """Operations a second against operations a byte, below what the machine can do."""
    for threads in thread_counts(records, "force/"):
        colour = (BLANK, tool_colour(0))[(threads - 1) % 2]
        peak = 1 / find(records, "machine/multiply_add", threads)["ns"]
        triads = triads_of(records, threads)
        x = np.geomspace(0.5, 50, 100)
        for triad, style in ((triads[1], "--"), (triads[-1], "-")):
            axis.loglog(x, np.minimum(x / triad["ns"], peak), style, color=colour, linewidth=1)
        counted = [record for record in chosen(records, "force/", threads)
                   if record["flops"] and record["bytes"]]
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
        pairs = sorted((last_number(record), record["ns"], record["spread"])
                       for record in chosen(records, stem, threads))
        n, ns, spread = np.array(pairs).T
        colour = (BLANK, tool_colour(0))[(threads - 1) % 2]
        axis.semilogx(n, ns, style, marker=MARKS.get(threads, "^"), markersize=4, color=colour,
                    label=prefix + label_of(threads))
        axis.fill_between(n, ns, ns * (1 + spread), color=colour, alpha=0.12, linewidth=0)
    axis.legend(fontsize=8)


def label_of(threads):
    return "one thread" if threads == 1 else f"{threads} threads"
