"""Tests of one material point: stress-strain, hardening, r-values, yield locus, limit strains."""
import numpy as np

from post.results import ResultsError, open_results, text_of
from post.style import plt, save

# What a test is plotted by: component of strain and of stress, sign of both, name of the axes.
CURVES = {
    "UNIAXIAL": (0, 0, 1), "CYCLIC": (0, 0, 1), "PLANE STRAIN": (0, 0, 1),
    "COMPRESSION": (2, 2, -1), "SIMPLE SHEAR": (3, 3, 1),
}
TABLES = ("R VALUES", "YIELD LOCUS", "FORMING LIMIT", "LIMIT STRESS")

COLOURS = plt.get_cmap("tab10").colors


def add_arguments(command):
    command.add_argument("--tests", nargs="+", metavar="NAME",
                         help="names of the tests to show (default: all)")


def run(arguments):
    with open_results(arguments.file) as file:
        figure = draw(chosen_tests(file, arguments.tests))
    save(figure, arguments.out)
    return 0


def chosen_tests(file, names=None):
    """The groups of the tests that were asked for, by name."""
    if "tests" not in file:
        raise ResultsError(f"'{file.filename}' holds no material tests: they are what "
                           "`igaform material DECK` writes")
    groups = file["tests"]
    for name in names or ():
        if name not in groups:
            raise ResultsError(f"there is no test '{name}'; the tests are {', '.join(groups)}")
    in_order = sorted(groups, key=lambda name: int(groups[name].attrs["number"]))
    return {name: groups[name] for name in names or in_order}


def draw(tests):
    """A panel for each kind of result that is there."""
    curves = {name: test for name, test in tests.items() if kind(test) not in TABLES}
    drawings = [(draw_curves, curves), (draw_hardening, curves)]
    for name, drawing in zip(TABLES, (draw_r_values, draw_locus, draw_limits,
                                     draw_limit_stresses)):
        drawings.append((drawing, {n: t for n, t in tests.items() if kind(t) == name}))
    drawings = [(drawing, group) for drawing, group in drawings if group]
    n_columns = min(2, len(drawings))
    n_rows = -(-len(drawings) // n_columns)
    figure, panels = plt.subplots(n_rows, n_columns, figsize=(5.2 * n_columns, 4 * n_rows),
                                  squeeze=False, layout="constrained")
    for panel, (drawing, group) in zip(panels.flat, drawings):
        drawing(panel, group)
        panel.legend(fontsize=8)
    for panel in panels.flat[len(drawings):]:
        panel.set_axis_off()
    return figure


def colour(i):
    return COLOURS[i % len(COLOURS)]


def kind(test):
    return text_of(test.attrs["type"])


def unit(test, dataset):
    return text_of(test[dataset].attrs["unit"])


def stress_strain(test):
    """Strain and stress by which a test is drawn."""
    strain, stress = test["strain"][:], test["stress"][:]
    if kind(test) == "EQUIBIAXIAL":
        return -strain[:, 2], stress[:, 0]
    if kind(test) in CURVES:
        i, j, sign = CURVES[kind(test)]
        return sign * strain[:, i], sign * stress[:, j]
    return path_length(strain), mises(stress)


def path_length(strain):
    """Sum of the von Mises strain increments; shears are engineering ones."""
    d = np.diff(strain, axis=0)
    d[:, :3] -= d[:, :3].mean(axis=1, keepdims=True)
    steps = np.sqrt(2 / 3 * (d[:, :3]**2).sum(axis=1) + (d[:, 3:]**2).sum(axis=1) / 3)
    return np.concatenate([[0], np.cumsum(steps)])


def mises(stress):
    """Von Mises stress of rows of 11, 22, 33, 12, 13, 23."""
    normal, shear = stress[:, :3], stress[:, 3:]
    differences = normal - np.roll(normal, 1, axis=1)
    return np.sqrt(0.5 * (differences**2).sum(axis=1) + 3 * (shear**2).sum(axis=1))


def draw_curves(panel, tests):
    labels = {"COMPRESSION": "-33", "SIMPLE SHEAR": "12", "EQUIBIAXIAL": "11 over -33",
              "PATH": "von Mises"}
    for i, (name, test) in enumerate(tests.items()):
        panel.plot(*stress_strain(test), color=colour(i),
                   label=f"{name} ({labels.get(kind(test), '11')})")
        panel.set_ylabel(f"stress [{unit(test, 'stress')}]")
    panel.set_xlabel("strain (logarithmic; simple shear: gamma)")


def draw_hardening(panel, tests):
    for i, (name, test) in enumerate(tests.items()):
        eqps = test["eqps"][:]
        if eqps[-1] > 0:
            flows = np.diff(eqps, prepend=0) > 0
            panel.plot(eqps[flows], mises(test["stress"][:])[flows], color=colour(i),
                       label=name, linewidth=1 + 0.4 * (len(tests) - i))
        panel.set_ylabel(f"von Mises stress in plastic flow [{unit(test, 'stress')}]")
    panel.set_xlabel("equivalent plastic strain")


def draw_r_values(panel, tests):
    beside = panel.twinx()
    beside.grid(False)
    for i, (name, test) in enumerate(tests.items()):
        angle = test["angle"][:]
        panel.plot(angle, test["r_value"][:], "o-", color=colour(i), label=f"{name}: r")
        beside.plot(angle, test["stress"][:], "s--", color=colour(i), alpha=0.5, markersize=4)
        panel.plot([], [], "s--", color=colour(i), alpha=0.5, label=f"{name}: stress")
        beside.set_ylabel(f"stress [{unit(test, 'stress')}]")
    panel.set_ylim(0, 1.35 * panel.dataLim.y1)
    beside.set_ylim(0, 1.7 * beside.dataLim.y1)
    panel.set_xticks(range(0, 91, 15))
    panel.set(xlabel="angle to the rolling direction [degrees]", ylabel="r-value")


def draw_locus(panel, tests):
    for i, (name, test) in enumerate(tests.items()):
        stress = test["stress"][:]
        closed = np.vstack([stress, stress[:1]])
        panel.plot(closed[:, 0], closed[:, 1], ".-", color=colour(i), label=name)
        panel.set(xlabel=f"stress 11 [{unit(test, 'stress')}]",
                  ylabel=f"stress 22 [{unit(test, 'stress')}]")
    panel.set_aspect("equal")


def draw_limits(panel, tests):
    for i, (name, test) in enumerate(tests.items()):
        panel.plot(test["minor"][:], test["major"][:], ".-", color=colour(i), label=name)
    panel.set_ylim(0, None)
    panel.set(xlabel="minor strain", ylabel="major strain at the limit")


def draw_limit_stresses(panel, tests):
    for i, (name, test) in enumerate(tests.items()):
        panel.plot(*test["stress"][:].T, ".-", color=colour(i), label=name)
        panel.set(xlabel=f"minor principal stress [{unit(test, 'stress')}]",
                  ylabel=f"major principal stress at the limit [{unit(test, 'stress')}]")
    panel.set_ylim(0, None)
