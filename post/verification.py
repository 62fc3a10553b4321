"""Pictures and the table of the verification suite, from the records that its tests leave."""
import glob
import json
import os

from post.results import ResultsError
from post.style import plt, save

COLOURS = ("#1f4e79", "#b35900", "#5a7d2a", "#7a4b94", "#a33b4a", "#3d8f8f")

FEW = 4      # places that get a tick each


def add_arguments(command):
    command.add_argument("file", metavar="FOLDER", help="records that the tests have left")
    command.add_argument("-o", "--out", metavar="FOLDER",
                         help="folder of the pictures (default: that of the records)")


def run(arguments):
    """A picture for each record of a folder, then all measured errors as a Markdown table."""
    paths = sorted(glob.glob(os.path.join(arguments.file, "*.json")))
    if not paths:
        raise ResultsError(f"'{arguments.file}' holds no records; "
                           "`ctest -L verification` leaves them in build/.../verification")
    table = ["| case | quantity | measured | reference | error | limit |",
             "|---|---|---|---|---|---|"]
    for path in paths:
        with open(path, encoding="utf-8") as file:
            record = json.load(file)
        name = os.path.basename(path).removesuffix(".json")
        if record["panels"]:
            save(draw(record), os.path.join(arguments.out, name + ".png"))
        table += ["| " + " | ".join([name, *row.values()]) + " |" for row in record["rows"]]
    print("\n".join(table))
    return 0


def draw(record):
    """The panels of one case side by side."""
    n = len(record["panels"])
    figure, axes = plt.subplots(1, n, figsize=(4.2 * n, 3.2), squeeze=False, layout="constrained")
    for axis, panel in zip(axes[0], record["panels"]):
        draw_panel(axis, panel)
    figure.suptitle(record["title"], fontsize=9)
    return figure


def draw_panel(axis, panel):
    """Lines in the order of the record; those without a label stay out of the legend, and black
    ones are references."""
    n_coloured = 0
    for line in panel["lines"]:
        if line["style"].startswith("k"):
            axis.plot(line["x"], line["y"], line["style"], linewidth=0.8, zorder=1,
                      label=line["label"] or None)
        else:
            axis.plot(line["x"], line["y"], line["style"], color=COLOURS[n_coloured % len(COLOURS)],
                      markersize=4 if "o" in line["style"] else 2, label=line["label"] or None)
            n_coloured += 1
    places = sorted({x for line in panel["lines"] for x in line["x"]})
    if panel["scale"] != "log" and len(places) <= FEW and all(x == int(x) for x in places):
        axis.set_xticks(places)     # counts: nothing lies between them
    if panel["scale"] == "log":
        axis.set(xscale="log", yscale="log")
        axis.set_xticks(places, [f"{x:.3g}" if x < 1000 else f"{x:.0f}" for x in places])
        axis.set_xticks([], minor=True)
        axis.grid(True, which="minor", linewidth=0.3)
    axis.set(xlabel=panel["x"], ylabel=panel["y"])
    axis.legend(fontsize=7, frameon=True, framealpha=0.85, edgecolor="none")
