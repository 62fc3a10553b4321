"""Earing: height of the rim of a drawn cup against the angle, beside measured heights."""
import numpy as np

from post.draw_in import Outline
from post.number_table import read_numbers
from post.results import Results, ResultsError, name_of
from post.style import plt, save, tool_colour

MOST_GAP = 20.0      # degrees between places of a profile
STEP = 1.0           # degrees between the places of a profile
LEAST = 0.05         # an ear stands out of its valleys by this part of the earing


def add_arguments(command):
    command.add_argument("--with", dest="others", nargs="+", default=[], metavar="FILE",
                         help="more result files to draw beside the first")
    command.add_argument("--measured", nargs="+", default=[], metavar="CSV",
                         help="tables of angle [degrees] and height, lines of # and text ignored")
    command.add_argument("--labels", nargs="+", default=[], metavar="TEXT",
                         help="names of the profiles in the legend (default: those of the files)")
    command.add_argument("--every", type=float, default=15.0, metavar="DEGREES",
                         help="angles of the table (default: 15)")


def run(arguments):
    profiles, unit = [], ""
    for path in [arguments.file, *arguments.others]:
        with Results(path) as results:
            unit = results.unit("VTKHDF/Points")
            profiles.append(Profile(name_of(path), *rim_of(results)))
    for path in arguments.measured:
        profiles.append(Profile(name_of(path), *table_of(path), is_measured=True))
    if len(arguments.labels) > len(profiles):
        raise ResultsError(f"found {len(arguments.labels)} labels for {len(profiles)} profiles")
    for profile, label in zip(profiles, arguments.labels):
        profile.name = label
    print(f"heights [{unit}] of a quarter, the mean of all there are")
    angles = np.arange(0.0, 90.0 + 0.5 * arguments.every, arguments.every)
    print(" ".join([f"{'angle':>24}", *(f"{a:7.4g}" for a in angles), "   mean  earing  ears"]))
    for profile in profiles:
        print(profile.line(angles))
    save(draw(profiles, unit), arguments.out)
    return 0


class Profile:
    """Heights over a quarter of a cup from 0 to 90 degrees, the mean of the quarters there are."""

    def __init__(self, name, angles, heights, is_measured=False):
        self.name, self.is_measured = name, is_measured
        self.angles = np.arange(0.0, 90.0 + 0.5 * STEP, STEP)
        order = np.argsort(angles)
        a, h = np.asarray(angles)[order], np.asarray(heights)[order]
        slack = 2.0
        quarters = [side for side in (self.angles, 180 - self.angles, 180 + self.angles,
                                      360 - self.angles)
                    if side.min() >= a[0] - slack and side.max() <= a[-1] + slack
                    and widest_gap(a, side.min(), side.max()) <= MOST_GAP]
        if not quarters:
            raise ResultsError(f"'{name}' holds angles from {a[0]:g} to {a[-1]:g} degrees; "
                               "expected at least one whole quarter")
        self.heights = np.mean([np.interp(side, a, h) for side in quarters], axis=0)

    def at(self, angles):
        return np.interp(angles, self.angles, self.heights)

    @property
    def mean(self):
        return self.heights.mean()

    @property
    def earing(self):
        """Highest less lowest place."""
        return float(np.ptp(self.heights))

    def ears(self):
        """Number of ears of the whole cup: maxima that stand out of the valleys at both sides."""
        full = np.concatenate([self.heights[:-1], self.heights[:0:-1]])
        full = np.concatenate([full, full])
        full = np.roll(full, -int(np.argmin(full)))
        least = LEAST * self.earing
        n, valley, top, is_rising = 0, full[0], full[0], True
        for height in full[1:]:
            if is_rising:
                top = max(top, height)
                if top - valley > least and top - height > least:
                    n, is_rising, valley = n + 1, False, height
                elif height < valley:
                    valley = top = height
            else:
                valley = min(valley, height)
                if height - valley > least:
                    is_rising, top = True, height
        return n

    def line(self, angles):
        return " ".join([f"{self.name[:24]:>24}", *(f"{h:7.2f}" for h in self.at(angles)),
                         f"{self.mean:7.2f} {self.earing:7.2f} {self.ears():5d}"])


def widest_gap(angles, low, high):
    """Between rising angles from `low` to `high`, these included."""
    inside = angles[(angles > low) & (angles < high)]
    return np.diff(np.concatenate([[low], inside, [high]])).max()


def rim_of(results):
    """Angles [degrees] and heights of the rim of the last frame, above the lowest place of the
    sheet along its normal."""
    frame = len(results.times) - 1
    outline = Outline(results)
    up = next(axis for axis in range(3) if axis not in outline.axes)
    sheet = np.concatenate([corners_of(patch, frame)[..., up].ravel()
                            for patch in results.patches])
    before, now = (np.concatenate(outline.in_space(when)) for when in (None, frame))
    radii = np.linalg.norm(before[:, outline.axes] - outline.centre, axis=1)
    on_rim = radii > radii.max() * (1 - 1e-3)
    if np.count_nonzero(on_rim) < 3:
        raise ResultsError("the sheet has no round edge; earing is that of a round blank")
    rim = now[on_rim]
    # A punch draws the bottom to one side: the rim stays at the other.
    height = (rim[:, up] - sheet.min() if rim[:, up].mean() > sheet.mean()
              else sheet.max() - rim[:, up])
    across = rim[:, outline.axes] - outline.centre
    angles = np.degrees(np.arctan2(across[:, 1], across[:, 0]))
    if angles.min() < -1.0:
        angles = angles % 360.0
    return angles, height


def corners_of(patch, frame):
    """Places of the corners of the elements; display points may lie off a rational sheet."""
    n = patch.n_elements
    return patch.sample("Points", frame, *[np.arange(n[d] + 1) for d in range(3)])


def table_of(path):
    """Angles and heights of a CSV file."""
    rows = read_numbers(path)
    if len(rows) < 3:
        raise ResultsError(f"'{path}' holds {len(rows)} lines of numbers; expected at least three "
                           "of angle and height, with a comma between")
    return rows.T


def draw(profiles, unit):
    figure, axis = plt.subplots(figsize=(7, 4.4), layout="constrained")
    for k, profile in enumerate(profiles):
        style = {"color": "black", "linestyle": "--"} if profile.is_measured \
            else {"color": tool_colour(k)}
        axis.plot(profile.angles, profile.heights, label=profile.name, **style)
    axis.set(xlabel="angle from axis 1 of the sheet [degrees]", xlim=(0, 90),
             xticks=range(0, 91, 15), ylabel=f"height of the rim [{unit}]", title="Earing")
    axis.grid(True, linewidth=0.3)
    figure.legend(fontsize=8, loc="outside lower center", ncols=3)
    return figure
