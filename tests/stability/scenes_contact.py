"""Contact: impact, borders, kinks, ironing, penalties, symmetry."""
import numpy as np
from criteria import energy_error, finite, momentum_drift, penetration
from stability import Mark, Scene


def bounce(run):
    """The block leaves again with what it brought."""
    return [energy_error(run, 5e-3), contact_left(run), still_along(run),
            Mark("upward momentum too small", 0.4 * abs(run.history["momentum"][0, 2])
                 / run.history["momentum"][-1, 2], 1)]


def contact_left(run):
    return Mark("contact energy left", abs(run.history["contact_energy"][-1])
                / run.history["kinetic_energy"][0], 1e-12)


def still_along(run):
    """A plane without friction gives no momentum along it."""
    change = run.history["momentum"][:, :2] - run.history["momentum"][0, :2]
    return Mark("momentum along the floor", np.abs(change).max()
                / np.abs(run.history["momentum"]).max(), 1e-12)


def touching(run):
    return [Mark("movement over the length", np.abs(run.blank - run.blank_start).max() / 10, 1e-12),
            Mark("kinetic energy [mJ]", run.history["kinetic_energy"].max(), 1e-12)]


def sliding(run):
    way = run.blank[:, 0].mean() - run.blank_start[:, 0].mean()
    return [Mark("way too short to be off", 15 / way, 1), energy_error(run, 5e-3),
            still_along(run), penetration(run, 5, 0.01), finite(run)]


def standing(run):
    """Pressed by its weight, the block comes to rest on what the floor gives back."""
    return [Mark("force of the floor over the weight", abs(abs(
        run.tools["floor"]["force"][-10:, 2].mean()) / (3.925e-6 * 1e8) - 1), 0.05),
        energy_error(run, 5e-3), penetration(run, 5, 0.1)]


def no_marks(_):
    return [Mark("stopped as it should, exit code 2", 0.0, 0.5)]


def border(run):
    """Symmetric about the middle of the sheet along y; energy; the tool stays outside."""
    mirror = run.net[:, ::-1] * [1, -1, 1] + [0, 20, 0]
    return [Mark("asymmetry", np.abs(run.net - mirror).max(), 1e-9), *corner(run)]


def corner(run):
    return [energy_error(run, 5e-3), penetration(run, 1, 0.15), finite(run)]


def beside(run):
    """Points that come in beside the border are not shot out."""
    return [energy_error(run, 5e-3), penetration(run, 1, 0.5), finite(run),
            Mark("kinetic over internal energy", run.history["kinetic_energy"][-1]
                 / run.history["internal_energy"][-1], 0.1)]


def ironed(run):
    """The sheet is as thick as the gap, and keeps its volume."""
    middle = np.abs(run.blank_start[:, 0]) < 6
    height = np.ptp(run.blank[middle, 2])
    return [Mark("thickness against the gap", abs(height / 0.8 - 1), 0.03),
            energy_error(run, 1e-3), penetration(run, 1, 0.05), finite(run)]


def closing(run):
    return [energy_error(run, 5e-3), penetration(run, 3, 0.2), finite(run)]


def shaken(run):
    """A step leads across a kink, which no step can resolve: the motion must stay small."""
    h = run.history
    late = slice(len(h["time"]) // 2, None)
    return [Mark("kinetic over internal energy", h["kinetic_energy"][late].mean()
                 / h["internal_energy"][late].mean(), 0.3),
            energy_error(run, 0.3), penetration(run, 4, 0.001), finite(run)]


def bent(run):
    return [energy_error(run, 1e-3), penetration(run, 1, 0.05), finite(run)]


def symmetric(run):
    """Every control point and its mirror image, over the way of the punch."""
    mirror = run.net[:, :, ::-1] * [-1, 1, 1]
    return [Mark("asymmetry over the way", np.abs(run.net - mirror).max() / 2, 1e-10), *bent(run)]


def same(tolerance):
    """The end of a run in other units of length against that in mm."""
    def check(run, *others):
        marks = bent(run)
        for other, unit in zip(others, (2.0**-20, 2.0**20)):
            shape = np.abs(other.net * unit - run.net).max()
            strain = np.abs(other.at_points["eqps"] - run.at_points["eqps"]).max()
            marks += [Mark(f"shape with a unit of {unit:.2g} mm [mm]", shape, tolerance),
                      Mark(f"plastic strain with a unit of {unit:.2g} mm", strain, tolerance)]
        return marks
    return check


def meshes(run, *others):
    """Work of the punch on other meshes against that of the finest."""
    work = [r.history["external_work"][-1] for r in (run, *others)]
    names = ("20 elements", "10 elements", "40 elements", "degree 3")
    marks = [Mark(f"work, {name} against 40", abs(w / work[2] - 1), limit)
             for name, w, limit in zip(names, work, (0.05, 0.5, 1, 0.05)) if name[:2] != "40"]
    return marks + [energy_error(r, 1e-3) for r in others[1:2]]


FAST = {"speed": 8000, "rows": 40}
SCENES = [
    Scene("fall_on_floor", "floor", "an impact at 5 m/s, flat, all points in one step", bounce),
    Scene("exactly_touching", "floor", "a gap of zero is round-off away from contact", touching,
          {"gap": 0, "down": 0}),
    Scene("two_tools_one_point", "two_floors", "two tools push the same points", bounce),
    Scene("tiny_penalty", "floor", "a floor so soft that the block sinks in: controlled end",
          no_marks, {"penalty": "PENALTY=1e-6", "end_time": 1e-3},
          ends=(2, "of its thickness deep in the tool", "contact point (", "  2. a penalty")),
    Scene("huge_penalty", "floor", "a spring that no step bears: said at the start, stopped",
          no_marks, {"penalty": "STIFFNESS=1e9"},
          ends=(2, "all that the safety factor 0.8 leaves", "igaform: error")),
    Scene("penalty_1.4", "floor", "just below the limit 1.44 of the penalty", bounce,
          {"penalty": "PENALTY=1.4"}),
    Scene("sliding_off", "floor", "points leave the border of the tool one by one", sliding,
          {"x_end": 14, "along": 5e4, "gap": 0, "down": 0, "g": 1e7, "end_time": 3.2e-4}),
    Scene("standing", "floor", "weight on a floor, damped by nothing but contact and viscosity",
          standing, {"gap": 0, "down": 0, "g": 1e8, "b1": 0.3, "end_time": 4e-4,
                     "penalty": '"PENALTY=0.5, DAMPING=0.1"'}),
    Scene("border_lands", "edge", "the border of a tool comes down on the sheet", border,
          {"n": 6, "depth": 0.6}),
    Scene("corner_lands", "edge", "the corner of a tool comes down on the sheet", corner,
          {"depth": 0.6, "y_start": 8.7, "slope_y": 0.5}),
    Scene("corner_between_points", "edge", "the corner comes down between contact points", beside,
          {"depth": 0.6, "y_start": 8.7, "slope_y": 0.5, "n": 12}),
    Scene("border_between_points", "edge", "the border of a tool does", beside, {"n": 9}),
    Scene("ironing", "ironing", "two tools squeeze a sheet to 80 % of its thickness", ironed),
    Scene("ironing_to_nothing", "ironing", "two tools want to pass through each other: controlled "
          "end", no_marks, {"left": -0.5},
          ends=(2, "of its thickness deep in the tool", "at time")),
    Scene("ten_times_the_speed", "fast_channel", "dies at 187.5 m/s", closing,
          {"closing": 20}),
    Scene("over_crests", "ridges", "points cross convex C0 knot lines to and fro every step",
          shaken),
    Scene("over_valleys", "ridges", "the same where the lines are valleys", shaken,
          {"height": 0.0005}),
    Scene("symmetric_bending", "bend", "round-off must not grow to one side", symmetric,
          {"speed": 2000, "depth": 1}, bits={"depth": 0.2}),
    Scene("bending_with_friction", "bend", "sticking and sliding on three tools", bent,
          FAST | {"friction": 0.2}),
    Scene("units_of_length", "bend", "units of 1e-6 mm and 1e6 mm: absolute limits would show",
          same(1e-12), FAST | {"depth": 0.6, "n_x": 10},
          others=[{"unit": 2.0**-20}, {"unit": 2.0**20}]),
    Scene("meshes", "bend", "mesh halved, doubled, degree raised: the same answer", meshes, FAST,
          others=[{"n_x": 10}, {"n_x": 40}, {"p": 3, "rule": "3,2,2x3"}], bits={"depth": 0.2}),
    Scene("symmetric_bending_long", "bend", "the same at the deck's depth, slowly", symmetric,
          {"speed": 1000, "depth": 2}, bits={"depth": 0.2}, is_long=True),
]
