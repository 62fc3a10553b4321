"""Forming-limit diagram: strains in the sheet's plane against a limit curve.

The curve is that of Keeler and Brazier (1977) from the thickness in mm and the hardening exponent
n: (23.3 + 14.13 t) n/0.21 per cent of engineering strain where the minor strain is zero, with n up
to 0.21 and t up to 3.1 mm; towards negative minor strains at constant thinning, towards positive
ones with slope 1/2, both in logarithmic strains. Or a user's, a CSV file of minor and major strain.
"""
import csv

import numpy as np

from post.results import Results, ResultsError
from post.style import BLANK, plt, save

LAYERS = {"middle": "mid-surface", "top": "upper face (zeta_max)",
          "bottom": "lower face (zeta_min)"}
BEYOND, LIMIT = "#a33b4a", "#b35900"
NEAR = 0.9                   # share of the limit from which a point counts as close to it
MOST_N, MOST_THICKNESS = 0.21, 3.1


def add_arguments(command):
    which = command.add_mutually_exclusive_group()
    which.add_argument("--frame", type=int, metavar="N",
                       help="frame from 0, negative from the end (default: the last)")
    which.add_argument("--time", type=float, metavar="T", help="the frame nearest to this time")
    command.add_argument("--layer", choices=LAYERS, default="middle",
                         help="layer of the sheet (default: middle)")
    limit = command.add_mutually_exclusive_group()
    limit.add_argument("-n", "--exponent", type=float, metavar="N",
                       help="hardening exponent, for the curve of Keeler and Brazier")
    limit.add_argument("--curve", metavar="CSV", help="limit curve: minor and major strain in each "
                                                      "line, logarithmic")
    command.add_argument("--thickness", type=float, metavar="MM",
                         help="thickness in mm for that curve (default: that of the sheet)")
    command.add_argument("--engineering", action="store_true",
                         help="strains of picture and --curve are engineering strains")


def run(arguments):
    with Results(arguments.file) as results:
        frame = results.frame(arguments.frame, arguments.time)
        minor, major, area = strains(results, frame, arguments.layer)
        curve = limit_curve(arguments, results)
    if curve is not None:
        share = major / curve(minor)
        tell(share, area)
    else:
        share = np.zeros_like(major)
        print("no limit curve: give -n and, if lengths are not in mm, --thickness, or --curve")
    print(f"largest major strain {major.max():.4f} at minor {minor[np.argmax(major)]:.4f}; "
          f"minor strains {minor.min():.4f} to {minor.max():.4f}")
    save(draw(minor, major, share, curve, arguments), arguments.out)
    return 0


def tell(share, area):
    """How many points are beyond the curve, and how near the others come."""
    beyond = share > 1
    print(f"{np.count_nonzero(beyond)} of {len(share)} points beyond the limit, "
          f"{100 * area[beyond].sum() / area.sum():.3g} % of the sheet; "
          f"largest strain is {share.max():.3f} of its limit")


def strains(results, frame, layer):
    """Minor and major strain in a layer at a frame, and the area each point stands for. At the last
    frame the points are columns of integration points, else display points."""
    minor, major, area = [], [], []
    for patch in results.patches:
        if frame == len(results.times) - 1:
            values, volume = patch.points("principal_strain"), patch.points("reference_volume")
            values, volume = layer_of(values, layer), layer_of(volume, layer)
        else:
            grid = [patch.field(name, frame)[..., 0] for name in ("major_strain", "minor_strain")]
            values = layer_of(np.stack(grid, axis=-1), layer)
            volume = np.ones(values.shape[:-1])
        major.append(values[..., 0].ravel())
        minor.append(values[..., 1].ravel())
        area.append(volume.ravel())
    return np.concatenate(minor), np.concatenate(major), np.concatenate(area)


def layer_of(values, layer):
    """The first or last layer, or the mean of the two around the middle."""
    n = len(values)
    if layer == "middle":
        return 0.5 * (values[(n - 1) // 2] + values[n // 2])
    return values[-1 if layer == "top" else 0]


def limit_curve(arguments, results):
    """The limit of the major strain as a function of the minor one, logarithmic, or None."""
    if arguments.curve:
        return listed_curve(*read_curve(arguments.curve, arguments.engineering))
    if arguments.exponent is None:
        return None
    thickness = arguments.thickness
    if thickness is None:
        thickness = float(np.median(results.patches[0].field("thickness", 0)))
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
    """Minor and major logarithmic strains of a CSV file; lines that are no numbers are skipped."""
    rows = []
    try:
        with open(path, newline="", encoding="utf-8") as file:
            for row in csv.reader(file):
                try:
                    rows.append((float(row[0]), float(row[1])))
                except (ValueError, IndexError):
                    continue
    except OSError as fault:
        raise ResultsError(f"cannot read '{path}': {fault.strerror}") from None
    values = np.array(sorted(rows)).reshape(-1, 2)
    if len(values) < 2 or np.any(np.diff(values[:, 0]) <= 0):
        raise ResultsError(f"'{path}' holds no curve: at least two lines of minor and major strain "
                           "with different minor strains are needed")
    return (np.log1p(values) if is_engineering else values).T


def draw(minor, major, share, curve, arguments):
    """The points, those beyond the curve apart, and lines of the usual strain paths."""
    shown = np.expm1 if arguments.engineering else np.asarray
    figure, axis = plt.subplots(figsize=(7, 5.5), layout="constrained")
    reach = max(0.1, 1.1 * major.max(), 1.1 * np.abs(minor).max())
    lowest = min(-0.05, 1.15 * minor.min())
    highest = max(0.05, 1.15 * minor.max())
    if curve is not None:
        x = np.linspace(lowest, highest, 200)
        axis.plot(shown(x), shown(curve(x)), color=LIMIT, label="forming limit")
        reach = max(reach, 1.15 * float(curve(np.array([0.0]))[0]))
    for mask, colour, label in ((share < NEAR, BLANK, "sheet"),
                                ((share >= NEAR) & (share <= 1), "#c9a227",
                                 f"above {NEAR:.0%} of the limit"),
                                (share > 1, BEYOND, "beyond the limit")):
        if mask.any():
            axis.plot(shown(minor[mask]), shown(major[mask]), ".", color=colour, markersize=3,
                      label=label)
    for slope, label in ((-2, "uniaxial"), (1, "equibiaxial")):
        end = min(reach / abs(slope), -lowest if slope < 0 else highest)
        x = np.linspace(0, end * np.sign(slope), 40)
        axis.plot(shown(x), shown(slope * x), color="#999999", linewidth=0.7, linestyle="--")
        if abs(slope) * end < 0.2 * reach:
            continue   # too short to carry its name
        axis.annotate(label, (shown(x[-4]), shown(slope * x[-4])), xytext=(-4, 0),
                      textcoords="offset points", ha="right", va="top" if slope < 0 else "bottom",
                      fontsize=7, color="#777777")
    axis.axvline(0, color="#999999", linewidth=0.7, linestyle="--")
    kind = "engineering" if arguments.engineering else "logarithmic"
    axis.set(xlabel=f"minor strain, {kind}", ylabel=f"major strain, {kind}",
             xlim=(shown(lowest), shown(highest)),
             ylim=(min(0.0, float(shown(major.min()))), float(shown(reach))),
             title=f"Forming-limit diagram, {LAYERS[arguments.layer]}")
    axis.legend(fontsize=8)
    return figure
