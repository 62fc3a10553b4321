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
    figure, axis = plt.subplots(figsize=(9, 5.5), layout="constrained")
    minor, major = (np.concatenate([cloud[i] for cloud in clouds.values()]) for i in (0, 1))
    left, right = (function(LEAST_REACH * sign, 1.1 * extreme) for function, sign, extreme
                   in ((min, -1, minor.min()), (max, 1, minor.max())))
    x = np.linspace(left, right, 400)
    high = max(LEAST_REACH, 1.1 * float(major.max()))
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
    draw_paths(axis, shown, left, right, high)
    kind = "engineering" if is_engineering else "logarithmic"
    axis.set(xlabel=f"minor strain, {kind}", ylabel=f"major strain, {kind}",
             xlim=shown(np.array([left, right])), ylim=shown(np.array([low, high])),
             title=f"Forming-limit diagram, {time}")
    axis.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1, 1), markerscale=2)
    return figure


def draw_paths(axis, shown, left, right, high):
    """Thin lines of the usual strain paths; their names stand outside."""
    axis.axvline(0, color="#555555", linewidth=0.7, linestyle=":", label="plane strain")
    for (slope, label), style in zip(PATHS, ("--", "-.", (0, (9, 2)), (0, (3, 1, 1, 1, 1, 1)))):
        end = left if slope < 0 else right
        end = np.sign(end) * min(abs(end), high / abs(slope))
        x = np.linspace(0, end, 60)
        axis.plot(shown(x), shown(slope * x), color="#555555", linewidth=0.8, linestyle=style,
                  label=label)
