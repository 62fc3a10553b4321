"""The look of all pictures, and where they go."""
import io
import os

import matplotlib
from PIL import Image     # comes with matplotlib, which writes PNG with it

from post.results import ResultsError

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend must be chosen first)

BLANK = "#1f4e79"
TOOLS = ("#b35900", "#5a7d2a", "#7a4b94", "#a33b4a")
SIDES = {"blank": "#7f9fc6", "sheet side": "#8fc7b2", "back": "#c9c3ba"}   # of a set-up
COLOUR_MAP = "viridis"
FLAT, SHADED = 96, 256     # colours of a small picture of plain areas and lines, of one in 3-D

plt.rcParams.update({
    "font.size": 9, "axes.grid": True, "grid.color": "#dddddd", "grid.linewidth": 0.6,
    "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False,
    "savefig.dpi": 150, "lines.linewidth": 1.3,
})


def tool_colour(i):
    return TOOLS[i % len(TOOLS)]


def paler(colour, share=0.35):
    """A colour mixed with white."""
    return tuple(1 - share * (1 - part) for part in matplotlib.colors.to_rgb(colour))


def check_format(path):
    """Refuse the name of a picture whose ending is no picture format."""
    formats = sorted(plt.figure().canvas.get_supported_filetypes())
    plt.close()
    ending = os.path.splitext(path)[1]
    if ending[1:].lower() not in formats:
        raise ResultsError(f"'{path}' ends in '{ending}', which is no picture format; it may be "
                           f"one of {', '.join(formats)}")


def with_palette(image, n_colours):
    """An image in so many colours, rare ones among them."""
    return image.quantize(n_colours, Image.Quantize.MAXCOVERAGE, kmeans=5)


def titled(text):
    """A text with a capital at its begin."""
    return text[:1].upper() + text[1:]


def save(figure, path, n_colours=None):
    """Write the picture; as PNG with a palette of so many colours, a third to a fifth as large."""
    try:
        if n_colours:
            raw = io.BytesIO()
            figure.savefig(raw, format="png")
            with_palette(Image.open(raw).convert("RGB"), n_colours).save(path, "PNG", optimize=True)
        else:
            figure.savefig(path)
    except OSError as fault:
        raise ResultsError(f"cannot write '{path}': {fault.strerror}") from None
    finally:
        plt.close(figure)
    print(f"picture written: {path}")
