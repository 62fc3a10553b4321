"""Pictures of a fit: flow curve, cyclic curve, yield locus, stress and r-value by the angle."""
import numpy as np

from post.fit.cyclic import LAWS
from post.fit.hardening import CURVES
from post.fit.yields import FUNCTIONS
from post.style import plt

ANGLES = np.linspace(0, 90, 91)


def draw(material, curves, cyclic, functions, exponent):
    """A panel for each kind of data."""
    panels = []
    if curves:
        panels.append(lambda axis: draw_curves(axis, *material.curves["hardening"], curves))
    if cyclic:
        panels.append(lambda axis: draw_cyclic(axis, *material.curves["cyclic"], cyclic))
    if functions:
        panels += [lambda axis, kind=kind: draw_angles(axis, material, functions, exponent, kind)
                   for kind in ("stress", "r")]
        panels.append(lambda axis: draw_locus(axis, material, functions, exponent))
    n_columns = min(2, len(panels))
    n_rows = -(-len(panels) // n_columns)
    figure, axes = plt.subplots(n_rows, n_columns, figsize=(5.2 * n_columns, 4 * n_rows),
                                squeeze=False, layout="constrained")
    for axis, panel in zip(axes.flat, panels):
        panel(axis)
        axis.legend(fontsize=8)
        axis.grid(True, linewidth=0.3)
    for axis in axes.flat[len(panels):]:
        axis.set_axis_off()
    figure.suptitle(material.name)
    return figure


def draw_curves(axis, strain, stress, curves):
    axis.plot(strain, stress, "o", color="black", markersize=3, label="measured")
    fine = np.linspace(0, strain[-1] * 1.5, 200)
    for name, result in curves.items():
        axis.plot(fine, CURVES[name].value(result.constants, fine), label=name)
    axis.set(xlabel="plastic strain", ylabel="flow stress", title="Hardening")


def draw_cyclic(axis, strain, stress, results):
    axis.plot(strain, stress, ".", color="black", markersize=3, label="measured")
    for name, result in results.items():
        axis.plot(strain, LAWS[name].stress(result.constants, strain),
                  label="back stresses" if name == "VOCE" else name)
    axis.set(xlabel="plastic strain", ylabel="stress", title="Cyclic test")
    axis.locator_params(axis="x", nbins=5)     # small strains of both signs have long labels


def draw_angles(axis, material, functions, exponent, kind):
    rows = [(row["angle"], row[kind]) for row in material.tension if kind in row]
    if rows:
        axis.plot(*np.transpose(rows), "o", color="black", label="measured")
    for name, result in functions.items():
        value = FUNCTIONS[name].stress if kind == "stress" else FUNCTIONS[name].r_value
        axis.plot(ANGLES, [value(result.constants, exponent, angle) for angle in ANGLES],
                  label=name)
    title = "Yield stress" if kind == "stress" else "r-value"
    axis.set(xlabel="angle from the rolling direction [degrees]", ylabel=title, title=title,
             xlim=(0, 90), xticks=range(0, 91, 15))


def draw_locus(axis, material, functions, exponent):
    """Yield locus without shear, with the points of tension at 0 and 90 degrees and of the biaxial
    test."""
    turns = np.radians(np.linspace(0, 360, 361))
    for name, result in functions.items():
        points = [np.array([np.cos(t), np.sin(t), 0.0]) for t in turns]
        radius = [1 / FUNCTIONS[name].value(result.constants, p, exponent) for p in points]
        axis.plot(*np.array([r * p[:2] for r, p in zip(radius, points)]).T, label=name)
    rows = [row for row in material.tension if "stress" in row]
    known = [(row["stress"], 0) for row in rows if row["angle"] == 0]
    known += [(0, row["stress"]) for row in rows if row["angle"] == 90]
    biaxial = material.parts.get("biaxial", {})
    if "stress" in biaxial:
        known.append((biaxial["stress"],) * 2)
    if known:
        axis.plot(*np.transpose(known), "o", color="black", label="measured")
    axis.set_aspect("equal")
    axis.set(xlabel="stress along", ylabel="stress across", title="Yield locus")
