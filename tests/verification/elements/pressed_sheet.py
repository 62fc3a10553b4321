"""A sheet squeezed between two plates: shells against solids on the same deck.

A shell takes the pressure on its faces as stress through the thickness. Without it the force of the
plates would be that of their penalty springs alone, four times too large.
"""
import numpy as np
from suite import Case


def squeeze(run):
    """Force on the upper plate by time, and thinning of the sheet."""
    return run.tools["upper"]["force"][:, 2], run.fields["thinning"][:run.n_blank].mean()


def main():
    case = Case("Sheet squeezed between two plates, as shell and solid", "the solid")
    found = {}
    lines = []
    for element in ("SOLID", "SHELL"):
        run = case.run("pressed_sheet", element=element)
        found[element] = squeeze(run)
        lines.append((element, "-" if element == "SOLID" else "--",
                      np.linspace(0, 1, len(found[element][0])), found[element][0] / 1000))
    solid, shell = found["SOLID"], found["SHELL"]
    case.error("force in the later half [N]", shell[0][100:].mean(), solid[0][100:].mean(), 0.015)
    case.between("thinning of the solid less that of the shell", solid[1] - shell[1], 0, 0.004)
    case.panel("time over the stroke's", "force of the upper plate [kN]", lines)
    case.finish()


main()
