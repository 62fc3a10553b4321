"""A strip of the channel against the reference runs of an independent plane-strain code.

The reference folder holds NAME_profile.csv and NAME_history.csv (see its README). Which run is the
reference follows from the speed of the dies: S1 for the slow strip, L3 for the nominal one.
"""
import csv
import os

import numpy as np

from post.results import Results, ResultsError, counted
from post.section import Section
from post.style import BLANK, plt, save

MIDDLE = (150.0, 450.0)       # reference x of the mean plastic strain
SHAPE = (100.0, 500.0)        # reference x of the comparison of shapes
SLOW_END = 0.01               # runs that end later than this [s] are the slow ones
LEAST_CLOSING = 149.0         # of a run that has come to its end [mm]
NOMINAL_CLOSING = 112.34      # closing at which the nominal run is judged [mm]
FRAME_REACH = 0.02            # of the run: a frame so near tells what the sheet was like
SEARCH_POINTS = 200           # enough to find the shift along the sheet
REFERENCE = "#b35900"


def add_arguments(command):
    command.add_argument("reference", metavar="REFERENCE_DIR", help="folder of the reference data")


def run(arguments):
    with Results(arguments.file) as results:
        strip = Strip(results)
        name = "S1" if results.times[-1] > SLOW_END else "L3"
        reference = Reference(arguments.reference, name)
        rows = slow_rows(strip, reference) if name == "S1" else nominal_rows(strip)
        rows.append(energy_row(strip))
        all_good = print_table(rows, name, arguments.file)
        save(draw(strip, reference), arguments.out)
    return 0 if all_good else 2


class Reference:
    """One run of the independent code; lengths in mm, forces in N and energies in mJ per mm."""

    def __init__(self, folder, name):
        self.name = name
        profile = read_csv(os.path.join(folder, f"{name}_profile.csv"))
        history = read_csv(os.path.join(folder, f"{name}_history.csv"))
        self.x0, self.thickness, self.eqps = (profile[k] for k in ("X0", "thickness", "EPSavg"))
        self.middle = np.column_stack([profile["xmid"], profile["ymid"]])
        self.closing = history["yl"] - history["yu"]
        self.work = history["Wext"]
        self.force = 0.5 * (np.abs(history["Fl_N_per_mm"]) + np.abs(history["Fu_N_per_mm"]))


class Sheet:
    """A result in the terms of the reference: per width, places by reference x."""

    def __init__(self, results):
        self.results = results
        self.section = Section(results)
        self.last = len(results.times) - 1
        places = results.points("reference_position")
        across = int(np.argmax(np.abs(self.section.normal)))
        start = results.blank_grid("Points", 0) - results.blank_grid("displacement", 0)
        self.width = results.width_ratio * np.ptp(start[..., across])   # of forces and energies
        self.start_thickness = float(np.linalg.norm(start[-1, 0, 0] - start[0, 0, 0]))
        self.x0 = places[..., int(np.argmax(self.section.axes[0]))]
        self.work = results.history("external_work") / self.width

    def middle_points(self, window, frame=-1):
        """Points of the mid-surface (n, 2) with reference x in a window."""
        inside = (self.section.start >= window[0]) & (self.section.start <= window[1])
        return self.section.sheet(frame % (self.last + 1))[1][inside]

    def mean_strain(self, frame, window=MIDDLE):
        """Plastic strain averaged over the thickness and a window of reference x."""
        inside = (self.x0 >= window[0]) & (self.x0 <= window[1])
        eqps, volume = self.results.plastic_strain(frame)
        return float(np.sum((eqps * volume)[inside]) / np.sum(volume[inside]))

    def strain_line(self, frame):
        """Plastic strain averaged over thickness and width, along the sheet; NaN where none of the
        width is left."""
        eqps, volume = self.results.plastic_strain(frame)
        total = volume.sum(axis=(0, 1))
        return (self.x0.mean(axis=(0, 1)),
                np.divide(np.sum(eqps * volume, axis=(0, 1)), total, where=total > 0,
                          out=np.full(total.shape, np.nan)))

    def penetration(self, steps=slice(None)):
        """Largest penetration in the history or a part of it, over the thickness."""
        depth = self.results.history("max_penetration")[steps]
        return float(depth.max(initial=0.0) / self.start_thickness)


class Strip(Sheet):
    """A sheet between two dies, judged against their closing."""

    def __init__(self, results):
        if len(results.tools) != 2:
            raise ResultsError("the comparison needs a result with two dies, this one has "
                               f"{counted(len(results.tools), 'tool')}")
        lower, upper = (results.tool_history(t, "displacement") for t in results.tools)
        self.closing = np.linalg.norm(lower - upper, axis=1)
        if self.closing[-1] < LEAST_CLOSING:
            raise ResultsError(f"the dies have closed by {self.closing[-1]:.4g} mm only, the "
                               f"comparison needs {LEAST_CLOSING:g} mm")
        super().__init__(results)
        self.force = 0.5 / self.width * sum(
            np.linalg.norm(results.tool_history(t, "force"), axis=1) for t in results.tools)

    def at_closing(self, closing, values):
        """A history value at a closing."""
        return float(np.interp(closing, self.closing, values))

    def mean_strain_at(self, closing):
        """`mean_strain` between the two frames around a closing, one of which must be near: plastic
        strain comes in bursts, and nothing is known of it between frames."""
        times = self.results.history("time")
        time = np.interp(closing, self.closing, times)
        away = np.abs(self.results.times - time).min() / self.results.times[-1]
        if away > FRAME_REACH:
            raise ResultsError(
                f"the frame nearest to closing {closing:g} mm is {100 * away:.1f} % of the run "
                f"away, more than {100 * FRAME_REACH:g} %: write more frames (*OUTPUT, FRAMES=)")
        of_frames = np.interp(self.results.times, times, self.closing)
        after = int(np.clip(np.searchsorted(of_frames, closing), 1, len(of_frames) - 1))
        share = (closing - of_frames[after - 1]) / (of_frames[after] - of_frames[after - 1])
        return (1 - share) * self.mean_strain(after - 1) + share * self.mean_strain(after)

    def mean_force(self, first, last):
        """Mean die force per width while closing: the work of the dies over their way."""
        return ((self.at_closing(last, self.work) - self.at_closing(first, self.work))
                / (last - first))


def shape_distance(points, line, can_shift=True):
    """Shift along the first axis that brings points nearest to a line, rms and greatest distance
    after it."""
    some = points[::max(1, len(points) // SEARCH_POINTS)]

    def rms(shift):
        return np.sqrt(np.mean(distance_to_line(some + [shift, 0], line)**2))

    centre, reach = 0.0, 32.0
    while can_shift and reach > 1e-4:
        candidates = centre + reach * np.linspace(-1, 1, 9)
        centre = min(candidates, key=rms)
        reach *= 0.35
    distances = distance_to_line(points + [centre, 0], line)
    return centre, float(np.sqrt(np.mean(distances**2))), float(distances.max())


def distance_to_line(points, line):
    """Distance of points from a polyline."""
    start, step = line[:-1], np.diff(line, axis=0)
    t = np.einsum("psd,sd->ps", points[:, None] - start, step) / np.sum(step**2, axis=1)
    nearest = start + np.clip(t, 0, 1)[..., None] * step
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


def slow_rows(strip, reference):
    """The tests of the slow strip: (what, value, reference, lower limit, upper limit)."""
    last = len(strip.results.times) - 1
    x0 = strip.section.start
    thickness = strip.section.thickness(last)[(x0 > x0[0] + 5) & (x0 < x0[-1] - 5)]
    _, rms, greatest = shape_distance(strip.middle_points(SHAPE), reference.middle)
    rows = [within("mean plastic strain, x0 150..450", strip.mean_strain(last), 0.01588, 0.05),
            ("least thickness [mm]", thickness.min(), reference.thickness.min(), 2.97, None),
            ("mid-surface, rms distance [mm]", rms, 0.0, None, 0.3),
            ("mid-surface, greatest distance [mm]", greatest, 0.0, None, 1.0),
            within("external work [mJ/mm]", strip.work[-1], 5550, 0.06)]
    for first, last, force in ((20, 60, 25.1), (60, 100, 36.8), (100, 140, 46.9)):
        rows.append(within(f"mean die force, closing {first}..{last} mm [N/mm]",
                           strip.mean_force(first, last), force, 0.1))
    return rows + [("penetration over thickness [%]", 100 * strip.penetration(), 0, None, 1)]


def nominal_rows(strip):
    """The tests of the strip at the seed's speed, as `slow_rows`."""
    last = len(strip.results.times) - 1
    at = f"closing {NOMINAL_CLOSING} mm"
    return [within(f"mean plastic strain, x0 150..450, {at}",
                   strip.mean_strain_at(NOMINAL_CLOSING), 0.0143, 0.05),
            (f"external work, {at} [mJ/mm]", strip.at_closing(NOMINAL_CLOSING, strip.work), 19400,
             None, 1.15 * 19400),
            ("mean plastic strain, x0 150..450, at the end", strip.mean_strain(last), 0.0273,
             0.023, 0.033),
            ("penetration over thickness [%], closing to 112 mm",
             100 * strip.penetration(strip.closing <= 112), 0, None, 3)]


def energy_row(strip):
    error = np.abs(strip.results.balance_error()).max()
    return "greatest energy error over the largest energy [%]", 100 * error, 0, None, 0.2


def within(what, value, expected, share):
    return what, value, expected, expected * (1 - share), expected * (1 + share)


def print_table(rows, name, path):
    """The table in Markdown; whether all limits hold."""
    print(f"{path} against {name}\n")
    print(f"| {'quantity':52} | {'result':>9} | {'reference':>9} | {'limits':>17} | holds |")
    print(f"|{'-' * 54}|{'-' * 10}:|{'-' * 10}:|{'-' * 18}:|-------|")
    all_good = True
    for what, value, expected, lower, upper in rows:
        good = (lower is None or value >= lower) and (upper is None or value <= upper)
        all_good &= bool(good)
        limits = (f"{'' if lower is None else f'{lower:.4g}'}.."
                  f"{'' if upper is None else f'{upper:.4g}'}")
        print(f"| {what:52} | {value:9.4g} | {expected:9.4g} | {limits:>17} | "
              f"{'yes' if good else 'NO':5} |")
    print()
    return all_good


def draw(strip, reference):
    """Shape, plastic strain, thickness along the sheet; work and force against closing."""
    figure = plt.figure(figsize=(10, 9), layout="constrained")
    grid = figure.add_gridspec(3, 2, height_ratios=[1.1, 1, 1])
    last = len(strip.results.times) - 1
    shift, rms, _ = shape_distance(strip.middle_points(SHAPE), reference.middle)
    panel = figure.add_subplot(grid[0, :])
    middle = strip.section.sheet(last)[1]
    panel.plot(*reference.middle.T, color=REFERENCE, label=f"reference {reference.name}")
    panel.plot(middle[:, 0] + shift, middle[:, 1], "--", color=BLANK,
               label=f"igaform, shifted by {shift:.2f} mm (rms distance {rms:.2f} mm)")
    panel.set(xlabel="x [mm]", ylabel="y [mm]", title="mid-surface at the end", aspect="equal")
    panel.legend(fontsize=8)
    curves = (((1, 0), "plastic strain, mean over the thickness", "x0 [mm]",
               (reference.x0, reference.eqps), strip.strain_line(last)),
              ((1, 1), "thickness [mm]", "x0 [mm]", (reference.x0, reference.thickness),
               (strip.section.start, strip.section.thickness(last))),
              ((2, 0), "external work [mJ/mm]", "closing [mm]",
               (reference.closing, reference.work), (strip.closing, strip.work)),
              ((2, 1), "die force [N/mm]", "closing [mm]",
               (reference.closing, reference.force), (strip.closing, strip.force)))
    for place, label, along, known, found in curves:
        panel = figure.add_subplot(grid[place])
        panel.plot(*known, color=REFERENCE, label=reference.name)
        panel.plot(*found, color=BLANK, label="igaform", linewidth=0.9)
        panel.set(xlabel=along, ylabel=label)
        if place[0] == 1:   # the ends are hit by the dies and do not converge
            inner = (known[0] > known[0][0] + 5) & (known[0] < known[0][-1] - 5)
            low, high = known[1][inner].min(), known[1][inner].max()
            panel.set_ylim(low - 0.3 * (high - low), high + 0.3 * (high - low))
        panel.legend(fontsize=8)
    return figure


def read_csv(path):
    """Columns of a table whose first line, after a #, names them."""
    if not os.path.isfile(path):
        raise ResultsError(f"there is no reference file '{path}'")
    with open(path, newline="", encoding="utf-8") as file:
        names = [name.strip() for name in next(file).lstrip("#").split(",")]
        rows = np.array([[float(value) for value in row] for row in csv.reader(file) if row])
    return dict(zip(names, rows.T))
