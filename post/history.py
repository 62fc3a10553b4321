"""Energies, energy error and tool forces against time, a column of panels for each step."""
import numpy as np

from post.results import Results
from post.steps import steps_of
from post.style import BLANK, plt, save, tool_colour

ENERGIES = (
    ("external_work", "external work", "-"), ("internal_energy", "internal", "-"),
    ("plastic_work", "plastic work", "--"), ("kinetic_energy", "kinetic", "-"),
    ("viscous_energy", "bulk viscosity", ":"), ("damping_energy", "damping", ":"),
    ("contact_energy", "contact", "-."),
    ("friction_energy", "friction", ":"),
)
NARROWEST = 0.6     # of the width of the longest step: steps are shown as wide at least


def add_arguments(command):
    del command   # none beyond those of all commands


def run(arguments):
    with Results(arguments.file) as results:
        figure = draw(results)
    save(figure, arguments.out)
    return 0


def draw(results):
    """Energies above, then their balance, then the tools' forces if there are tools. A relaxation
    takes many times as long as forming, so steps have time axes of their own."""
    n = 3 if results.tools else 2
    steps = steps_of(results)
    time = results.history("time")
    widths = [np.ptp(time[step.samples]) for step in steps]
    widths = [max(width, NARROWEST * max(widths), 1e-30) for width in widths]
    figure, columns = plt.subplots(
        n, len(steps), figsize=(8 + 1.5 * (len(steps) - 1), 2.6 * n), sharex="col", sharey="row",
        squeeze=False, layout="constrained", height_ratios=[2, 1, 1.6][:n], width_ratios=widths)
    for step, panels in zip(steps, columns.T):
        draw_step(results, time[step.samples], step.samples, panels)
        panels[-1].set_xlabel(f"time [{results.unit('history/time')}]")
        panels[-1].locator_params(axis="x", nbins=4 if len(steps) > 1 else 8)
        if len(steps) > 1:
            panels[0].set_title(step.title, fontsize=9)
    first = columns[:, 0]
    first[0].set_ylabel(f"energy [{results.unit('history/external_work')}]")
    first[1].set_ylabel("energy error\n[% of the largest]")
    if results.tools:
        first[2].set_ylabel(f"tool force [{results.unit(f'tools/{results.tools[0]}/force')}]")
    for panel in columns[::2, -1]:
        panel.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1, 1))
    return figure


def draw_step(results, time, samples, panels):
    """The curves of one step. A tool may have been added or removed where it begins."""
    own = slice(samples.start + min(samples.start, 1), samples.stop)
    for name, label, style in ENERGIES:
        values = results.history(name)
        if np.any(values):
            panels[0].plot(time, values[samples], style, label=label)
    panels[1].plot(time, 100 * results.balance_error()[samples], color=BLANK)
    for i, tool in enumerate(results.tools):
        axis = main_axis(results, tool)
        panels[2].plot(results.tool_history(tool, "time")[own],
                       results.tool_history(tool, "force")[own, axis], color=tool_colour(i),
                       label=f"{tool}, {'xyz'[axis]}")


def main_axis(results, tool):
    """The coordinate axis of a tool's largest force."""
    return int(np.argmax(np.abs(results.tool_history(tool, "force")).max(axis=0, initial=0)))
