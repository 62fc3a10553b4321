"""Contact: impact, borders, kinks, ironing, penalties, symmetry."""
import numpy as np
from criteria import energy_error, finite, impulse, lack, penetration, stopped, volume_change
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
    """The sheet is as thick as the gap, keeps its volume, and stays between both tools, which push
    it as hard from either side, at all times."""
    middle = np.abs(run.blank_start[:, 0]) < 6
    height = np.ptp(run.blank[middle, 2])
    sheet, tools = run.frames[:, :run.n_blank, 2], run.frames[:, run.n_blank:, 2]
    beyond = np.maximum(tools.min(axis=1) - sheet.min(axis=1),
                        sheet.max(axis=1) - tools.max(axis=1)).max()
    forces = [run.tools[name]["force"][:, 2] for name in ("upper", "lower")]
    return [Mark("thickness against the gap", abs(height / 0.8 - 1), 0.01),
            volume_change(run, 5e-3),
            Mark("depth of any point behind a tool over thickness", max(beyond, 0.0), 0.01),
            Mark("force of one tool against the other",
                 np.abs(forces[0] + forces[1]).max() / forces[0].max(), 1e-9),
            energy_error(run, 1e-4), penetration(run, 1, 0.01), finite(run)]


def closing(run):
    """Each step is a row: what the tools give is what the strip gets. Elastic strain alone changes
    its volume: 0.2 % at a mean stress of 1000 MPa."""
    return [*impulse(run, 1e-12), volume_change(run, 2e-3),
            Mark("depth of any point behind a die over thickness", behind_dies(run) / 3, 0.3),
            energy_error(run, 1e-3), penetration(run, 3, 0.1), finite(run)]


def behind_dies(run):
    """Depth of the deepest point of the strip behind either die in any frame, the dies taken as
    polygons through their points, whose chords are up to 0.4 mm off the fillets."""
    deepest = 0.0
    for frame in run.frames:
        points, dies = frame[:run.n_blank, :2], frame[run.n_blank:]
        line = dies[dies[:, 2] == dies[0, 2], :2]
        break_at = np.argmax(np.linalg.norm(np.diff(line, axis=0), axis=1)) + 1
        for die, far in zip(np.split(line, [break_at]), (-1e3, 1e3)):
            polygon = np.vstack([[die[0, 0], far], die, [die[-1, 0], far]])
            inside = points[is_within(points, polygon)]
            if len(inside):
                deepest = max(deepest, distance(inside, die).max())
    return deepest


def is_within(points, polygon):
    """Whether a ray from each point along x crosses the polygon an odd number of times."""
    x, y = points[:, :1], points[:, 1:]
    begin, end = polygon, np.roll(polygon, -1, axis=0)
    is_passed = (begin[:, 1] > y) != (end[:, 1] > y)
    rise = np.where(begin[:, 1] == end[:, 1], 1, end[:, 1] - begin[:, 1])
    at = begin[:, 0] + (y - begin[:, 1]) * (end[:, 0] - begin[:, 0]) / rise
    return (is_passed & (x < at)).sum(axis=1) % 2 == 1


def distance(points, line):
    """Of each point from a line of straight parts."""
    begin, part = line[:-1], np.diff(line, axis=0)
    to = points[:, None] - begin
    share = np.clip((to * part).sum(axis=2) / (part**2).sum(axis=1), 0, 1)
    return np.linalg.norm(to - share[..., None] * part, axis=2).min(axis=1)


def shaken(run):
    """No step can resolve a kink. Of the work of each crossing half the slope times the way times
    the change of the force is missed; that adds up to what belongs to the force of the moment,
    however many crossings there are. The motion may not grow either, and the mean force is the
    load's."""
    h, n, load = run.history, 50, 20 * 16
    late, early = slice(-n, None), slice(n, 2 * n)
    force = run.tools["ridges"]["force"][n:].mean(axis=0)
    missed, motion = lack(run), h["kinetic_energy"]
    return [Mark("steps of a crossing less 1", h["step"][-1] / (8 * n) - 1, 1e-12),
            Mark("energy missed against half the slope, way and load",
                 np.abs(missed[n:].mean()) / (0.5 * 0.02 * 0.004 * load), 1.1),
            Mark("drift of the energy missed over the largest energy",
                 abs(missed[late].mean() - missed[early].mean()) / h["external_work"].max(), 0.05),
            Mark("late kinetic energy over early", motion[late].mean() / motion[early].mean(), 1.2),
            Mark("mean force against the load", abs(force[2] / load + 1), 0.02),
            Mark("mean force along the ridges", np.abs(force[:2]).max() / load, 1e-3),
            penetration(run, 4, 0.001), finite(run)]


def bent(run):
    return [energy_error(run, 1e-3), penetration(run, 1, 0.05), finite(run)]


def symmetric(run):
    """Every control point at the end, every point in every frame, and momentum and forces in every
    row of the history are as their mirror images."""
    mirror = run.net[:, :, ::-1] * [-1, 1, 1]
    flip, way = np.array([-1, 1, 1]), np.ptp(run.tools["punch"]["displacement"][:, 2])
    order = [np.lexsort(np.round(run.blank_start * side, 9).T) for side in ([1, 1, 1], flip)]
    one, other = (run.frames[:, :run.n_blank][:, rows] for rows in order)
    force = {name: run.tools[name]["force"] for name in ("left", "right")}
    momentum = run.history["momentum"]
    return [Mark("asymmetry over the way", np.abs(run.net - mirror).max() / way, 1e-10),
            Mark("asymmetry in any frame", np.abs(one - other * flip).max() / way, 1e-10),
            Mark("momentum to one side",
                 np.abs(momentum[:, 0]).max() / np.abs(momentum).max(), 1e-8),
            Mark("force of one support against the other",
                 np.abs(force["left"] - force["right"] * flip).max()
                 / np.abs(force["left"]).max(), 1e-6),
            *bent(run)]


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
    """Work of the punch, plastic work, and place of the strip's end on each mesh against those of
    the finest; none of them gains energy."""
    names = ("40 elements", "20 elements", "80 elements", "degree 3")
    runs = (run, *others)
    marks = []
    for kind in ("external_work", "plastic_work"):
        value = [r.history[kind][-1] for r in runs]
        marks += [Mark(f"{kind.replace('_', ' ')}, {name} against 80", abs(v / value[2] - 1), limit)
                  for name, v, limit in zip(names, value, (0.02, 0.05, 1, 0.02))
                  if not name.startswith("80")]
    end = [r.probes["end"]["displacement"][-1] for r in runs]
    way = np.ptp(run.tools["punch"]["displacement"][:, 2])
    marks += [Mark(f"place of the end over the way, {name} against 80",
                   np.linalg.norm(place - end[2]) / way, 0.05)
              for name, place in zip(names, end) if not name.startswith("80")]
    return marks + [Mark("largest energy error", max(energy_error(r, 1).value for r in runs), 1e-3)]


FAST = {"speed": 8000, "rows": 40}
SCENES = [
    Scene("fall_on_floor", "floor", "a flat impact at 5 m/s, all points in one increment", bounce),
    Scene("exactly_touching", "floor", "a gap of zero is round-off away from contact", touching,
          {"gap": 0, "down": 0}),
    Scene("two_tools_one_point", "two_floors", "two tools push the same points", bounce),
    Scene("tiny_penalty", "floor", "a floor so soft that the block sinks in: controlled end",
          stopped, {"penalty": "PENALTY=1e-6", "end_time": 1e-3},
          ends=(2, "of its thickness", "contact point (", "  2. a penalty")),
    Scene("huge_penalty", "floor", "a spring too stiff for the increment: reported at the "
          "start, stopped",
          stopped, {"penalty": "STIFFNESS=1e9"},
          ends=(2, "safety factor 0.8", "igaform: error")),
    Scene("penalty_1.4", "floor", "just below the limit 1.44 of the penalty", bounce,
          {"penalty": "PENALTY=1.4"}),
    Scene("sliding_off", "floor", "points leave the edge of the tool one by one", sliding,
          {"x_end": 14, "along": 5e4, "gap": 0, "down": 0, "g": 1e7, "end_time": 3.2e-4}),
    Scene("standing", "floor", "weight on a floor, damped by nothing but contact and viscosity",
          standing, {"gap": 0, "down": 0, "g": 1e8, "b1": 0.3, "end_time": 4e-4,
                     "penalty": '"PENALTY=0.5, DAMPING=0.1"'}),
    Scene("border_lands", "edge", "the edge of a tool comes down on the sheet", border,
          {"n": 6, "depth": 0.6}),
    Scene("corner_lands", "edge", "the corner of a tool comes down on the sheet", corner,
          {"depth": 0.6, "y_start": 8.7, "slope_y": 0.5}),
    Scene("corner_between_points", "edge", "the corner comes down between contact points", beside,
          {"depth": 0.6, "y_start": 8.7, "slope_y": 0.5, "n": 12}),
    Scene("border_between_points", "edge", "the edge of a tool does", beside, {"n": 9}),
    Scene("ironing", "ironing", "two tools squeeze a sheet to 80 % of its thickness", ironed),
    Scene("ironing_to_nothing", "ironing", "two tools move through each other: controlled end",
          stopped, {"left": -0.5},
          ends=(2, "of its thickness", "at time")),
    Scene("ten_times_the_speed", "fast_channel", "dies at 187.5 m/s", closing,
          {"closing": 20, "history": 400}),
    Scene("over_crests", "ridges", "points cross convex C0 knot lines in each increment",
          shaken),
    Scene("over_valleys", "ridges", "the same where the lines are valleys", shaken,
          {"height": 0.0005}),
    Scene("symmetric_bending", "bend", "round-off must not grow to one side", symmetric,
          {"speed": 2000, "depth": 1, "frames": 20}, bits={"depth": 0.2}),
    Scene("bending_with_friction", "bend", "sticking and sliding on three tools", bent,
          FAST | {"friction": 0.2}),
    Scene("units_of_length", "bend", "units of 1e-6 mm and 1e6 mm: absolute limits would show",
          same(1e-12), FAST | {"depth": 0.6, "n_x": 10},
          others=[{"unit": 2.0**-20}, {"unit": 2.0**20}]),
    Scene("meshes", "bend", "mesh halved, doubled, degree raised: the same answer to 5, 2, 2 %",
          meshes, FAST | {"n_x": 40}, bits={"depth": 0.2},
          others=[{"n_x": 20}, {"n_x": 80},
                  {"p": 3, "rule": "3,2,2x3", "touch": "4,3"}]),
    Scene("symmetric_bending_long", "bend", "the same at the deck's depth, slowly", symmetric,
          {"speed": 1000, "depth": 2, "frames": 40}, bits={"depth": 0.2}, is_long=True),
]
