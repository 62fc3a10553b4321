"""Planes in which the images of a half or a quarter of a part lie."""
import argparse

import numpy as np

from post.results import ResultsError


def parse_axes(text):
    """X, Y, Z or several of them, as numbers of axes."""
    axes = ["XYZ".find(letter) for letter in text.upper()]
    if not axes or -1 in axes or len(set(axes)) < len(axes):
        raise argparse.ArgumentTypeError(f"'{text}' is none of X, Y, Z, XY and so on")
    return tuple(axes)


def planes_of(results, axes):
    """Axis and coordinate of each plane; the sheet must lie on one side of it at the start."""
    planes = []
    for axis in axes:
        ends = start_ends(results, axis)
        place = symmetry_place(results, axis, ends)
        slack = 1e-6 * np.ptp(ends)
        if ends[0] < place - slack and ends[1] > place + slack:
            raise ResultsError(f"the sheet lies on both sides of {'xyz'[axis]} = {place:g}: it is "
                               "no half that could be mirrored there")
        planes.append((axis, place))
    return planes


def start_ends(results, axis):
    """Least and largest coordinate of the sheet at the start."""
    values = np.concatenate([(patch.field("Points", 0) - patch.field("displacement", 0))[..., axis]
                             .ravel() for patch in results.patches])
    return float(np.nanmin(values)), float(np.nanmax(values))


def symmetry_place(results, axis, ends):
    """The end of the sheet that the deck makes a plane of symmetry, else 0."""
    letter = "XYZ"[axis]
    for name, end in ((f"{letter}_MIN", ends[0]), (f"{letter}_MAX", ends[1])):
        if name in results.deck.symmetric_faces(letter):
            return end
    return 0.0
