"""The forming-limit diagram: zones as areas, the whole limit curve, a cloud of points per layer."""
import numpy as np

from post.style import BLANK, plt
from post.zones import ZONES

LIMIT = "#5c1a22"
MARKERS = (("v", "#2b2b2b"), ("^", BLANK), ("o", "#7a4b94"))   # of the layers in their order
PATHS = ((-2, "uniaxial tension (r = 1)"), (-1, "pure shear"),
         (-0.5, "uniaxial compression (r = 1)"), (1, "equibiaxial"))
LEAST_REACH = 0.1    # strains that are shown at least


def draw(clouds, borders, is_engineering, time):
    """`clouds`: minor and major strains by the name of their layer; `time`: for the title."""
    shown = np.expm1 if is_engineering else np.asarray
    figure, axis, (left, right, high) = draw_zones(clouds, borders, LEAST_REACH, shown)
    draw_paths(axis, shown, left, right, high)
    kind = "engineering" if is_engineering else "logarithmic"
    axis.set(xlabel=f"minor strain, {kind}", ylabel=f"major strain, {kind}",
             title=f"Forming-limit diagram, {time}")
    axis.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1, 1), markerscale=2)
    return figure


def draw_stresses(clouds, borders, unit, time):
    """The same of principal stresses in the sheet's plane."""
    least = LEAST_REACH * float(borders.curve(0.0))
    figure, axis, _ = draw_zones(clouds, borders, least, np.asarray)
    axis.axline((0, 0), slope=1, color="#555555", linewidth=0.8, linestyle=(0, (3, 1, 1, 1, 1, 1)),
                label="equibiaxial")
    axis.axvline(0, color="#555555", linewidth=0.8, linestyle="--", label="uniaxial tension")
    axis.set(xlabel=f"minor principal stress [{unit}]", ylabel=f"major principal stress [{unit}]",
             title=f"Forming limit of stresses, {time}")
    axis.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1, 1), markerscale=2)
    return figure


def draw_zones(clouds, borders, least, shown):
    """Zones, limit curve and clouds of an axis that reaches as far as they do, `least` at least;
    with its bounds left, right and above."""
    figure, axis = plt.subplots(figsize=(9, 5.5), layout="constrained")
    minor, major = (np.concatenate([cloud[i] for cloud in clouds.values()]) for i in (0, 1))
    left, right = (function(least * sign, 1.1 * extreme) for function, sign, extreme
                   in ((min, -1, minor.min()), (max, 1, minor.max())))
    x = np.linspace(left, right, 400)
    high = max(least, 1.1 * float(major.max()))
    if borders.curve is not None:
        high = max(high, 1.05 * float(borders.curve(x).max()))
    low = min(-0.03 * high, 1.1 * float(major.min()))
    for zone, below, above in borders.lines(x, low, high):
        if np.any(above > below):
            axis.fill_between(shown(x), shown(below), shown(above), color=ZONES[zone].colour,
                              alpha=0.45, linewidth=0, label=ZONES[zone].name)
    if borders.curve is not None:
        axis.plot(shown(x), shown(borders.curve(x)), color=LIMIT, linewidth=2,
                  label="forming limit")
    for (name, (a, b)), (marker, colour) in zip(clouds.items(), MARKERS):
        axis.plot(shown(a), shown(b), linestyle="None", marker=marker, color=colour, markersize=3,
                  markeredgewidth=0, alpha=0.7, label=name)
    axis.set(xlim=shown(np.array([left, right])), ylim=shown(np.array([low, high])))
    return figure, axis, (left, right, high)


def draw_paths(axis, shown, left, right, high):
    """Thin lines of the usual strain paths; their names stand outside."""
    axis.axvline(0, color="#555555", linewidth=0.7, linestyle=":", label="plane strain")
    for (slope, label), style in zip(PATHS, ("--", "-.", (0, (9, 2)), (0, (3, 1, 1, 1, 1, 1)))):
        end = left if slope < 0 else right
        end = np.sign(end) * min(abs(end), high / abs(slope))
        x = np.linspace(0, end, 60)
        axis.plot(shown(x), shown(slope * x), color="#555555", linewidth=0.8, linestyle=style,
                  label=label)
