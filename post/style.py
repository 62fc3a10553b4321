"""The look of all pictures."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend must be chosen first)

BLANK = "#1f4e79"
TOOLS = ("#b35900", "#5a7d2a", "#7a4b94", "#a33b4a")
COLOUR_MAP = "viridis"

plt.rcParams.update({
    "font.size": 9, "axes.grid": True, "grid.color": "#dddddd", "grid.linewidth": 0.6,
    "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False,
    "savefig.dpi": 150, "lines.linewidth": 1.3,
})


def tool_colour(i):
    return TOOLS[i % len(TOOLS)]


def save(figure, path):
    figure.savefig(path)
    plt.close(figure)
    print(f"picture written: {path}")
