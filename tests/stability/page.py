"""The manual's page of the stability suite: its table and its picture.

usage: page.py OUT PAGE PICTURE

Puts a table of all scenes, from their modules and margins.csv, between the marks of PAGE, and draws
some scenes from the results that the suite left in OUT/GROUP into PICTURE.
"""
import csv
import os
import re
import sys

import matplotlib
import numpy as np
from run_results import Run
from stability import GROUPS, MARGINS, scenes_of

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

MARKS = ("<!-- table of the scenes, made by tests/stability/page.py -->", "<!-- end -->")
ROUND_OFF = 1e-8
# Scene, group, title and the two axes that are seen.
PANELS = (("symmetric_bending", "contact", "symmetric bending", 0, 2),
          ("ironing", "contact", "ironing to 80 %", 0, 2),
          ("border_lands", "contact", "border of a blade lands", 0, 2),
          ("ten_times_the_speed", "contact", "dies at 187.5 m/s", 0, 1),
          ("turning_while_plastic", "plastic", "bar after ten turns at the yield stress", 0, 1),
          ("hard_ringing", "elastic", "", None, None))


def table():
    """One row a scene, with the criterion that uses most of its limit."""
    with open(MARGINS, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    lines = ["| scene | why it is hard | criteria: measured, limit |", "|---|---|---|"]
    n_scenes = 0
    for group in GROUPS:
        for scene in scenes_of(group):
            own = [row for row in rows if row["scene"] == scene.name]
            if not own:
                continue
            n_scenes += 1
            marks = "; ".join(mark_text(row) for row in own)
            if scene.ends:
                marks = f"exit code {scene.ends[0]}: " + ", ".join(f'"{t}"' for t in scene.ends[1:])
            lines.append(f"| `{scene.name}` | {scene.why} | {marks} |")
    return [f"{n_scenes} scenes, {len(rows)} criteria.", "", *lines]


def mark_text(row):
    quantity, value, limit = row["quantity"], row["value"], row["limit"]
    if quantity == "NaN or infinite values":
        return "all finite"
    if float(value) < ROUND_OFF and float(limit) < ROUND_OFF:
        return f"{quantity} < {limit}"
    return f"{quantity} {value}, {limit}"


def write_table(page):
    with open(page, encoding="utf-8") as file:
        text = file.read()
    inside = "\n".join([MARKS[0], *table(), MARKS[1]])
    pattern = re.escape(MARKS[0]) + ".*?" + re.escape(MARKS[1])
    text = re.sub(pattern, lambda _: inside, text, flags=re.S)
    with open(page, "w", encoding="utf-8") as file:
        file.write(text)


def draw(out, picture):
    figure, axes = pyplot.subplots(2, 3, figsize=(11, 5.6), constrained_layout=True)
    for axis, (name, group, title, first, second) in zip(axes.flat, PANELS):
        run = Run(os.path.join(out, group, name + ".h5"))
        axis.set_title(title, fontsize=9)
        axis.tick_params(labelsize=7)
        if first is None:
            energies(axis, run)
        else:
            shape(figure, axis, run, first, second)
    figure.savefig(picture, dpi=95)


def shape(figure, axis, run, first, second):
    """Blank by plastic strain (else by speed), tools as grey points, near the blank."""
    tools = run.points[run.n_blank:]
    axis.plot(tools[:, first], tools[:, second], ".", color="0.75", ms=1.5, zorder=0)
    values = run.fields["eqps"][:run.n_blank]
    label = "plastic strain"
    if values.max() <= 0:
        values = np.linalg.norm(run.fields["velocity"][:run.n_blank], axis=1) / 1000
        label = "speed [m/s]"
    order = np.argsort(values)
    dots = axis.scatter(run.blank[order, first], run.blank[order, second], c=values[order], s=3,
                        cmap="viridis")
    low, high = run.blank.min(axis=0), run.blank.max(axis=0)
    wide = high[first] - low[first]
    middle = (low[second] + high[second]) / 2
    tall = max(high[second] - low[second], 0.35 * wide)
    axis.set_xlim(low[first] - 0.05 * wide, high[first] + 0.05 * wide)
    axis.set_ylim(middle - 0.6 * tall, middle + 0.6 * tall)
    axis.set_aspect("equal")
    bar = figure.colorbar(dots, cax=axis.inset_axes([1.03, 0, 0.03, 1]))
    bar.set_label(label, fontsize=7)
    bar.ax.tick_params(labelsize=7)


def energies(axis, run):
    h = run.history
    total = h["kinetic_energy"] + h["internal_energy"] - h["plastic_work"]
    axis.plot(1e3 * run.time(), 100 * (total / total[0] - 1), lw=0.8)
    axis.set_title("ringing at a strain of 1e-3, undamped", fontsize=9)
    axis.set_xlabel("time [ms]", fontsize=8)
    axis.set_ylabel("change of kinetic and elastic energy [%]", fontsize=8)
    axis.grid(alpha=0.3)


if __name__ == "__main__":
    write_table(sys.argv[2])
    draw(sys.argv[1], sys.argv[3])
