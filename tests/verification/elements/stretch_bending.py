"""A strip stretched over a cylinder: shells against solids on the same deck.

The force, the strain between the faces and the thinning must agree. The pressure of the cylinder
makes the sheet thin more there: without it a shell would thin by 0.14 t/R less.
"""
import numpy as np
from suite import Case

LIMIT = 0.03     # of the difference in thinning, over thickness/radius


def at_top(run):
    """Force, strain between the faces and thinning above the cylinder."""
    force = -run.tools["cylinder"]["force"][-20:, 1].mean()
    x, y = run.blank_start[:, 0], run.blank_start[:, 1]
    strain, thinning = (run.fields[name][:run.n_blank] for name in ("major_strain", "thinning"))
    near = (x > 1.0) & (x < 3.0)
    inside, outside = near & (y < 1e-6), near & (y > 1 - 1e-6)
    return force, strain[outside].mean() - strain[inside].mean(), thinning[near].mean()


def main():
    case = Case("Strip stretched over a cylinder, as shell and solid", "the solid")
    lines = []
    for radius, n_x in ((10, 60), (25, 40)) if case.is_long else ((25, 40),):
        found = {}
        for element in ("SOLID", "SHELL"):
            run = case.run("stretch_bending", element=element, radius=radius, n_x=n_x)
            found[element] = at_top(run)
            top = np.isclose(run.blank_start[:, 1], 1) & np.isclose(run.blank_start[:, 2], 0)
            order = np.argsort(run.blank_start[top, 0])
            lines.append((f"R = {radius} t, {element}", "-" if element == "SOLID" else "--",
                          run.blank_start[top, 0][order],
                          run.fields["major_strain"][:run.n_blank][top][order]))
        solid, shell = found["SOLID"], found["SHELL"]
        case.error(f"force on the cylinder [N], R = {radius} t", shell[0], solid[0], 0.005)
        case.error(f"strain between the faces, R = {radius} t", shell[1], solid[1], 0.08)
        case.between(f"thinning of the solid less that of the shell, R = {radius} t",
                     solid[2] - shell[2], -LIMIT / radius, LIMIT / radius)
    case.panel("x at the start [mm]", "major strain of the outer face", lines)
    case.finish()


main()
