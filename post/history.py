"""Energies, energy error and tool forces against time."""
import numpy as np

from post.results import Results
from post.style import BLANK, plt, save, tool_colour

ENERGIES = (
    ("external_work", "external work", "-"), ("internal_energy", "internal", "-"),
    ("plastic_work", "plastic work", "--"), ("kinetic_energy", "kinetic", "-"),
    ("viscous_energy", "bulk viscosity", ":"), ("damping_energy", "damping", ":"),
    ("contact_energy", "contact", "-."),
    ("friction_energy", "friction", ":"),
)


def add_arguments(command):
    del command   # none beyond those of all commands


def run(arguments):
    with Results(arguments.file) as results:
        figure = draw(results)
    save(figure, arguments.out)
    return 0


def draw(results):
    """Energies above, then their balance, then the tools' forces if there are tools."""
    n = 3 if results.tools else 2
    figure, panels = plt.subplots(n, 1, figsize=(8, 2.6 * n), sharex=True, layout="constrained",
                                  height_ratios=[2, 1, 1.6][:n])
    time = results.history("time")
    for name, label, style in ENERGIES:
        values = results.history(name)
        if np.any(values):
            panels[0].plot(time, values, style, label=label)
    panels[0].set_ylabel(f"energy [{results.unit('history/external_work')}]")
    panels[0].legend(fontsize=8)
    panels[1].plot(time, 100 * results.history("energy_error"), color=BLANK)
    panels[1].set_ylabel("energy error [%]")
    for i, tool in enumerate(results.tools):
        force = results.tool_history(tool, "force")
        axis = main_axis(results, tool)
        panels[2].plot(results.tool_history(tool, "time"), force[:, axis], color=tool_colour(i),
                       label=f"{tool}, {'xyz'[axis]}")
    if results.tools:
        panels[2].set_ylabel(f"tool force [{results.unit(f'tools/{results.tools[0]}/force')}]")
        panels[2].legend(fontsize=8)
    panels[-1].set_xlabel(f"time [{results.unit('history/time')}]")
    return figure


def main_axis(results, tool):
    """The coordinate axis of a tool's largest force."""
    return int(np.argmax(np.abs(results.tool_history(tool, "force")).max(axis=0, initial=0)))
