"""The manual's page on what accuracy costs, written from the stored tables of the studies."""
import os
import statistics

from post.results import ResultsError
from post.study import figures, table
from post.study.choice import (COST, errors_text, front, has_settings, recommended, score,
                               setting_text)
from post.study.spec import MEASURES, read_study
from post.style import FLAT, save

UNITS = {True: "mm", False: "%"}
HEAD = """# What accuracy costs

**The first table names a setting for each purpose.** Each section after it gives one study: what
was varied, the recommended setting, and the Pareto front.

- Costs are processor time of one thread, as multiples of the deck's default setting in the same
  study.
- The dotted line of the pictures is the largest error that is allowed.
- The Pareto front joins the runs that no other run beats in both cost and error.
- The recommended setting is the cheapest one whose errors are all allowed.
- References are the independent runs of [the forming example](channel.md), or a finer run that is
  not shown.

This page is generated: `python -m post study-page` writes it from the studies in `input/studies`
and their tables in `input/studies/results`. `python -m post study STUDY.toml --store` makes such a
table; see [studies](studies.md).
"""
FORECAST = """
## How accurate the forecast is
`igaform DECK --check` forecasts the run time. For the {n} finished runs of these studies the median
is {median:.2f} times the processor time; {within:.0f} % of the forecasts are within 20 % of it.
"""


def add_arguments(command):
    command.add_argument("file", metavar="DIR", nargs="?", default="input/studies",
                         help="folder of studies, their tables in DIR/results "
                              "(default: input/studies)")
    command.add_argument("-o", "--out", metavar="PAGE", default="docs/accuracy.md",
                         help="the page to write, pictures in pictures/ beside it "
                              "(default: docs/accuracy.md)")


def run(arguments):
    try:
        names = sorted(name for name in os.listdir(arguments.file) if name.endswith(".toml"))
    except OSError as fault:
        raise ResultsError(f"there is no folder '{arguments.file}': {fault.strerror}") from None
    if not names:
        raise ResultsError(f"there are no studies in '{arguments.file}'")
    pictures = os.path.join(os.path.dirname(arguments.out), "pictures")
    os.makedirs(pictures, exist_ok=True)
    studies = [read_study(os.path.join(arguments.file, name)) for name in names]
    tables = [table.read_csv(os.path.join(arguments.file, "results", f"{study.name}.csv"))
              for study in studies]
    parts = [HEAD, choice_section(zip(studies, tables))]
    for study, rows in zip(studies, tables):
        save(figures.draw(study, rows), os.path.join(pictures, f"accuracy_{study.name}.png"),
             n_colours=FLAT)
        parts.append(section(study, rows))
    parts.append(budget_section(zip(studies, tables)))
    parts.append(forecast_section([row for rows in tables for row in rows]))
    with open(arguments.out, "w", encoding="utf-8") as file:
        file.write("".join(parts))
    print(f"page written: {arguments.out}")
    return 0


def section(study, rows):
    """A picture, what it shows in words, and the Pareto front as a table."""
    best = recommended(rows, study.limits)
    if best is None:
        raise ResultsError(f"no run in the stored table of {study.path} came to its end")
    usual = default_row(study, rows)
    unit = usual[COST] if usual else best[COST]
    lines = ["", f"## {study.title}", study.about.strip(), "",
             f"![{study.title}](pictures/accuracy_{study.name}.png)", "",
             sentences(study, rows, best, usual), "",
             "| Pareto front | cost | error / allowed error | errors |",
             "|---|---:|---:|---|"]
    for row in front(rows, study.limits):
        name = setting_text(row, study.parameters)
        name = f"**{name}**" if row is best else name
        lines.append(f"| {name} | {row[COST] / unit:.2f} | {score(row, study.limits):.2f} | "
                     f"{errors_text(row, study.limits)} |")
    return "\n".join(lines) + "\n"


def sentences(study, rows, best, usual):
    """Cost and errors of the recommended and the default setting, from the table."""
    allowed = score(best, study.limits) <= 1
    text = (f"Recommended of {len(rows)} runs: `{setting_text(best, study.parameters)}`, "
            f"{'the cheapest within the allowed errors' if allowed else 'the nearest to them'} "
            f"({errors_text(best, study.limits)}).")
    if usual is best:
        text += " It is the deck's default."
    elif usual:
        is_best = any(row is usual for row in front(rows, study.limits))
        text += (f" The deck's default, `{setting_text(usual, study.parameters)}`, "
                 f"{'is on the Pareto front' if is_best else 'is dominated'}: "
                 f"{usual[COST] / best[COST]:.2f} times the cost, "
                 f"{errors_text(usual, study.limits)}.")
        if study.kept_because and not is_best:
            text += f" It is kept because {study.kept_because.strip()}."
    lost = [row for row in rows if row["status"] != "completed"]
    if lost:
        text += (" Failed: "
                 + "; ".join(f"`{setting_text(row, study.parameters)}`" for row in lost) + ".")
    return text


def default_row(study, rows):
    """The finished run with the deck's own setting, if it was among those of the study."""
    found = [row for row in rows if row["status"] == "completed"
             and study.default and has_settings(row, study.default)]
    return found[0] if found else None


def budget_section(studies):
    """Time to an accuracy: what was asked for, what it took, and what other programs took."""
    lines = ["", "## Time to equal accuracy",
             "Processor time of one thread to reach the required errors: the cheapest run that "
             "reaches them, else the nearest one. Other programs: their own runs of the scene.",
             "", "| scene | program | setting | s | errors | |", "|---|---|---|---:|---|---|"]
    for study, rows in studies:
        best = recommended(rows, study.limits)
        if not study.budget or best is None:
            continue
        asked = ", ".join(f"{name.replace('_', ' ')} {limit:g} {UNITS[MEASURES[name][1]]}"
                          for name, limit in study.limits.items())
        lines.append(f"| {study.title} | required | | {study.budget:g} | {asked} | |")
        is_met = score(best, study.limits) <= 1 and best[COST] <= study.budget
        lines.append(f"| | igaform | `{setting_text(best, study.parameters)}` | {best[COST]:.2f} "
                     f"| {errors_text(best, study.limits)} | {'met' if is_met else 'missed'} |")
        for name, seconds, errors in study.peers:
            said = ", ".join(f"{key.replace('_', ' ')} {value:g} {UNITS[MEASURES[key][1]]}"
                             for key, value in errors.items())
            lines.append(f"| | {name} | | {seconds:g} | {said} | |")
    return "\n".join(lines) + "\n"


def forecast_section(rows):
    ratios = [row["forecast_seconds"] / row[COST] for row in rows
              if row["status"] == "completed" and "forecast_seconds" in row]
    if not ratios:
        return ""
    within = sum(0.8 <= ratio <= 1.2 for ratio in ratios)
    return FORECAST.format(n=len(ratios), median=statistics.median(ratios),
                           within=100 * within / len(ratios))


def choice_section(studies):
    """The table of what to choose when, from the purposes that the studies name."""
    lines = ["", "## Choose this when", "", "| when | required errors | choose | cost | errors |",
             "|---|---|---|---:|---|"]
    for study, rows in studies:
        usual = default_row(study, rows)
        for wish in study.choose:
            asked = ", ".join(f"{name.replace('_', ' ')} {limit:g}"
                              for name, limit in wish["limits"].items())
            best = recommended(rows, wish["limits"])
            if score(best, wish["limits"]) > 1:
                lines.append(f"| {wish['when']} | {asked} | none of the runs | | |")
                continue
            cost = f"{best[COST] / usual[COST]:.2f}" if usual else ""
            lines.append(f"| {wish['when']} | {asked} | "
                         f"`{setting_text(best, study.parameters)}` | {cost} | "
                         f"{errors_text(best, wish['limits'])} |")
    return "\n".join(lines) + "\n"
