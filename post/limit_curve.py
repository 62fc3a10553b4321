"""Limit curves of the forming-limit diagram: the major strain as a function of the minor one.

The curve of Keeler and Brazier (1977) follows from the thickness in mm and the hardening exponent
n: (23.3 + 14.13 t) n/0.21 per cent of engineering strain where the minor strain is zero, with n up
to 0.21 and t up to 3.1 mm; towards negative minor strains at constant thinning, towards positive
ones with slope 1/2, both in logarithmic strains. Or a user's, a CSV file of minor and major strain.
"""
import numpy as np

from post.number_table import read_columns, read_numbers
from post.results import ResultsError

MOST_N, MOST_THICKNESS = 0.21, 3.1


def add_arguments(command):
    """Options that choose the curve; those that exclude each other are returned as a group."""
    limit = command.add_mutually_exclusive_group()
    limit.add_argument("-n", "--exponent", type=float, metavar="N",
                       help="hardening exponent, for the curve of Keeler and Brazier")
    limit.add_argument("--curve", metavar="CSV", help="limit curve: minor and major strain in each "
                                                      "line, logarithmic")
    command.add_argument("--thickness", type=float, metavar="MM",
                         help="thickness in mm for that curve (default: that of the sheet)")
    return limit


def limit_curve(arguments, results):
    """The limit of the major strain as a function of the minor one, logarithmic, or None."""
    if arguments.curve:
        return listed_curve(*read_curve(arguments.curve, arguments.engineering))
    if arguments.exponent is None:
        return None
    thickness = arguments.thickness
    if thickness is None:
        thickness = float(np.nanmedian(results.patches[0].field("thickness", 0)))
        if results.unit("VTKHDF/PointData/thickness") not in ("mm", "length"):
            raise ResultsError("the lengths are not in mm: give --thickness in mm")
    return keeler_brazier(arguments.exponent, thickness)


def keeler_brazier(exponent, thickness):
    """The curve of Keeler and Brazier for steels; thickness in mm."""
    if exponent <= 0 or thickness <= 0:
        raise ResultsError("exponent and thickness must be positive")
    lowest = np.log1p(0.01 * (23.3 + 14.13 * min(thickness, MOST_THICKNESS))
                      * min(exponent, MOST_N) / 0.21)

    def curve(minor):
        return lowest + np.where(minor < 0, -minor, 0.5 * minor)
    return curve


def listed_curve(minor, major):
    """A curve through points, going on with its slope beyond both ends."""
    def curve(at):
        inner = np.interp(at, minor, major)
        left = major[0] + (at - minor[0]) * (major[1] - major[0]) / (minor[1] - minor[0])
        right = major[-1] + (at - minor[-1]) * (major[-1] - major[-2]) / (minor[-1] - minor[-2])
        return np.where(at < minor[0], left, np.where(at > minor[-1], right, inner))
    return curve


def read_curve(path, is_engineering):
    """Minor and major logarithmic strains of a CSV file, which may have a heading."""
    values = in_order(read_numbers(path), path, "strain")
    return (np.log1p(values) if is_engineering else values).T


def in_order(values, path, quantity):
    """Points of a curve by rising minor values."""
    values = values[np.lexsort(values.T[::-1])]
    if len(values) < 2 or np.any(np.diff(values[:, 0]) <= 0):
        raise ResultsError(f"'{path}' holds no curve: at least two lines of minor and major "
                           f"{quantity} with different minor values are needed")
    return values


def stress_curve(path, unit):
    """The limit of the major principal stress as a function of the minor one, from the table of a
    *MATERIAL TEST, TYPE=FORMING LIMIT or LIMIT STRESS."""
    values, units = read_columns(path, ("stress_minor", "stress_major"))
    if units[0] != unit:
        raise ResultsError(f"the stresses of '{path}' are in {units[0]}, those of the result in "
                           f"{unit}: give both decks the same *UNITS")
    return listed_curve(*in_order(values, path, "stress").T)
