"""Colour scales in bands between round numbers."""
import numpy as np

from post.style import COLOUR_MAP, plt

LEAST, MOST = 8, 12              # bands of a scale
ROUND = (1.0, 2.0, 2.5, 5.0)     # steps, times a power of ten


def round_levels(low, high):
    """The edges of 8 to 12 equal bands that cover a range; their step is round, and its multiples
    are the edges."""
    span = high - low
    if not span > 1e-9 * max(abs(low), abs(high)):
        span = max(0.01 * abs(low), 1e-3)
    power = 10.0 ** np.floor(np.log10(span / MOST))
    for step in (factor * scale for scale in (power, 10 * power) for factor in ROUND):
        first, last = np.floor(low / step + 1e-6), np.ceil((low + span) / step - 1e-6)
        if last - first <= MOST:
            break
    return step * np.arange(first, max(last, first + LEAST) + 1)


def level_texts(levels):
    """The edges of the bands, all with the digits that their step needs."""
    step = levels[1] - levels[0]
    power = int(np.floor(np.log10(step) + 1e-9))
    is_quarter = abs(step / 10.0**power - 2.5) < 0.1
    if not -5 < power < 5:
        return [f"{level:.4g}" for level in levels]
    digits = max(0, is_quarter - power)
    return [f"{level:.{digits}f}" for level in np.round(levels, digits) + 0.0]


def colours_of(levels):
    """The colours of the bands, the same in all pictures."""
    return plt.get_cmap(COLOUR_MAP)(np.linspace(0, 1, len(levels) - 1))
