"""Pictures of a study: error against time and control points, the front, shares of the time."""
import textwrap

import matplotlib.lines
import matplotlib.ticker
import numpy as np

from post.study.choice import COST, front, has_settings, recommended, score, setting_text
from post.study.spec import MEASURES
from post.style import BLANK, plt

COLOURS = plt.get_cmap("tab10").colors
MARKERS = "osD^vPX*<>ph"
MOST_BARS = 14
LABEL = 40   # letters in a line of a bar's name
DECADES = 300    # greatest over least number, up to which an axis has numbers within decades
WIDE = 8     # greatest over least number from which an axis is logarithmic
FRONT = "#888888"
CHOSEN = "#c00000"


def draw(study, rows):
    """One panel for each measure against time (two at most), the front, errors against control
    points (against steps if all runs have the same points), and shares of the time."""
    good = [row for row in rows if row["status"] == "completed"]
    measures = list(study.limits)[:2]
    last = len(measures)
    figure, panels = plt.subplots(2, last + 1, figsize=(5 + 4.5*last, 8.4), layout="constrained",
                                  gridspec_kw={"width_ratios": [1]*last + [1.1]})
    best = recommended(good, study.limits)
    style = Style(study, good)
    for panel, name in zip(panels[0], measures):
        scatter(panel, study, good, COST, f"{name}_error", style, best)
        panel.set(xlabel="processor time [s]", ylabel=axis_label(name))
        panel.axhline(study.limits[name], color=FRONT, linestyle=":")
    draw_front(panels[0][last], study, good, style, best)
    size = "control_points" if len({row["control_points"] for row in good}) > 1 else "steps"
    for panel, name in zip(panels[1], measures):
        scatter(panel, study, good, size, f"{name}_error", style, best)
        panel.set(xlabel=size.replace("_", " "), ylabel=axis_label(name))
    draw_shares(panels[1][last], study, good)
    figure.suptitle(study.title)
    figure.legend(handles=style.legend() + marks(study, best), loc="outside lower center",
                  ncols=8, fontsize=8)
    return figure


class Style:
    """Colour and marker of a run by two of its parameters."""

    def __init__(self, study, rows):
        self.of_colour, self.of_marker = study.plot.get("colour"), study.plot.get("marker")
        self.colours = values(rows, self.of_colour)
        self.palette = palette(len(self.colours))
        self.markers = values(rows, self.of_marker)
        self.labels = study.plot.get("label", [])

    def colour(self, row):
        value = row.get(f"set_{self.of_colour}")
        return self.palette[self.colours.index(value)] if value in self.colours else BLANK

    def marker(self, row):
        value = row.get(f"set_{self.of_marker}")
        return MARKERS[self.markers.index(value) % len(MARKERS)] if value in self.markers else "o"

    def legend(self):
        line = matplotlib.lines.Line2D
        return ([line([], [], color=self.palette[i], marker="o", linestyle="",
                      label=f"{self.of_colour}={value}") for i, value in enumerate(self.colours)]
                + [line([], [], color="#444444", marker=MARKERS[i % len(MARKERS)], linestyle="",
                        label=f"{self.of_marker}={value}")
                   for i, value in enumerate(self.markers)])


def palette(n):
    """As many colours: those of the pages, or shades of one scale where these are too few."""
    return COLOURS[:n] if n <= len(COLOURS) else [matplotlib.colormaps["turbo"](i / (n - 1))
                                                  for i in range(n)]


def values(rows, name):
    """The values of a parameter: numbers by size, others in the order of the runs."""
    found = list(dict.fromkeys(row[f"set_{name}"] for row in rows if f"set_{name}" in row))
    return sorted(found, key=float) if all(map(is_number, found)) else found


def is_number(value):
    try:
        float(value)
    except ValueError:
        return False
    return True


def axis_label(name):
    text, is_length = MEASURES[name]
    return f"{text} [{'mm' if is_length else '%'}]"


def marks(study, best):
    """Legend of the rings."""
    line = matplotlib.lines.Line2D
    found = [line([], [], color=CHOSEN, marker="o", markersize=11, fillstyle="none", linestyle="",
                  label="recommended")] if best else []
    if study.default:
        found.append(line([], [], color="black", marker="s", markersize=11, fillstyle="none",
                          linestyle="", label="default of the deck"))
    return found


def scatter(panel, study, rows, x, y, style, best):
    """The runs as points, with rings about the recommended and the default one."""
    for row in rows:
        if y not in row or x not in row:
            continue
        panel.plot(row[x], row[y], style.marker(row), color=style.colour(row), markersize=5,
                   alpha=0.85)
        if row is best:
            panel.plot(row[x], row[y], "o", color=CHOSEN, markersize=11, fillstyle="none")
        if study.default and has_settings(row, study.default):
            panel.plot(row[x], row[y], "s", color="black", markersize=11, fillstyle="none")
        if style.labels:
            text = ", ".join(str(row[f"set_{name}"]) for name in style.labels
                             if f"set_{name}" in row)
            panel.annotate(text, (row[x], row[y]), xytext=(5, 3), textcoords="offset points",
                           fontsize=6.5)
    others = draw_peers(panel, study, y.removesuffix("_error")) if x == COST else []
    scale(panel.xaxis, panel.set_xscale, [row[x] for row in rows if x in row]
          + [seconds for seconds, _ in others])
    scale(panel.yaxis, panel.set_yscale, [row[y] for row in rows if y in row]
          + [error for _, error in others])


def draw_peers(panel, study, measure):
    """Other programs as crosses with their names, and the budget; time and error of each cross."""
    if study.budget:
        panel.axvline(study.budget, color=FRONT, linestyle=":")
    drawn = []
    for name, seconds, errors in study.peers:
        if measure in errors:
            panel.plot(seconds, errors[measure], "x", color="black", markersize=7)
            panel.annotate(name, (seconds, errors[measure]), xytext=(0, 6), ha="center",
                           textcoords="offset points", fontsize=7,
                           bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5,
                                 "alpha": 0.7})
            drawn.append((seconds, errors[measure]))
    return drawn


def scale(axis, set_scale, numbers):
    """A logarithmic axis for numbers that span a wide range, else one that begins at zero."""
    if numbers and min(numbers) > 0 and max(numbers) > WIDE * min(numbers):
        set_scale("log")
        axis.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
        if max(numbers) < DECADES * min(numbers):
            axis.set_minor_locator(matplotlib.ticker.LogLocator(subs=(2, 5)))
            axis.set_minor_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
        else:
            axis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    elif numbers:
        axis.set_major_locator(matplotlib.ticker.MaxNLocator(5))
        axis.axes.set(**{f"{axis.axis_name}lim": (0, 1.1 * max(numbers) or 1)})


def draw_front(panel, study, rows, style, best):
    """The largest error as a share of what is allowed, and the Pareto front."""
    judged = [row | {"score": score(row, study.limits)} for row in rows]
    again = judged[rows.index(best)] if best else None
    scatter(panel, study, judged, COST, "score", style, again)
    line = [(row[COST], score(row, study.limits)) for row in front(rows, study.limits)]
    if line:
        panel.step(*zip(*line), where="post", color=FRONT, zorder=0)
    panel.axhline(1, color=FRONT, linestyle=":")
    panel.set(xlabel="processor time [s]", title="Pareto front",
              ylabel="largest error over what is allowed")


def draw_shares(panel, study, rows):
    """Shares of the time as bars: all runs if they are few, else those of the front."""
    shown = rows if len(rows) <= MOST_BARS else front(rows, study.limits)[:MOST_BARS]
    names = list(dict.fromkeys(name for row in shown for name in row if name.startswith("share_")))
    left = np.zeros(len(shown))
    for i, name in enumerate(names):
        share = np.array([row.get(name, 0.0) for row in shown])
        panel.barh(range(len(shown)), share, left=left, color=COLOURS[i % 10],
                   label=name.removeprefix("share_"))
        left += share
    # What all bars have in common would only fill their names.
    differing = [name for name in study.parameters
                 if len({row.get(f"set_{name}") for row in shown}) > 1]
    labels = [textwrap.fill(setting_text(row, differing).replace(", ", " "), LABEL)
              for row in shown]
    n_lines = len(shown) * max((label.count("\n") + 1 for label in labels), default=1)
    panel.set_yticks(range(len(shown)), labels, fontsize=min(6, 144 / max(n_lines, 1)))
    panel.invert_yaxis()
    panel.grid(False, axis="y")
    panel.set(xlabel="share of the time of all steps [%]", xlim=(0, 100),
              title="where the time goes" + ("" if shown is rows else ", runs of the Pareto front"))
    if names:
        panel.legend(fontsize=6, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3)
