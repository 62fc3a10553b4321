"""`python -m post fit DATA.toml`: constants of a material with their uncertainty, deck lines."""
import sys

import numpy as np

from post.fit.cyclic import LAWS
from post.fit.data import read_material, uncertainty_of
from post.fit.figures import draw
from post.fit.hardening import CURVES
from post.fit.solve import fit
from post.fit.unloading import LEAST_ROWS
from post.fit.yields import FUNCTIONS, data_line
from post.results import ResultsError
from post.style import save

N_STARTS = 6         # of yield functions, the first one isotropic
SPREAD = 0.3         # of the others about it
EXPONENT = 8.0
LEAST_YIELD = 1e-3   # of cyclic laws over the largest stress: *PLASTIC takes none of 0
LARGE_MISFIT = 2.0   # of cyclic laws: something is wrong with the strains


def add_arguments(command):
    command.add_argument("file", metavar="DATA.toml",
                         help="the measured data (see docs/materials.md)")
    command.add_argument("-o", "--out", metavar="PNG",
                         help="the picture to write (default: DATA without its ending, -fit.png)")
    command.set_defaults(is_picture=True)


def run(arguments):
    material = read_material(arguments.file)
    missed = Missed(material.path)
    curves = fit_hardening(material, missed)
    cyclic = fit_cyclic(material, missed)
    functions = fit_functions(material, missed)
    if not curves and not cyclic and not functions:
        raise ResultsError("\n".join(missed.texts))
    print(f"** {material.name}")
    for part, results in (("hardening", curves), ("cyclic", cyclic)):
        tell_unloading(material, part, results, missed)
    for name, result in curves.items():
        show(f"*PLASTIC, HARDENING={name}", CURVES[name].constants, result,
             ", ".join(f"{value:.6g}" for value in result.constants))
    for name, result in cyclic.items():
        keyword, line = LAWS[name].lines(result.constants).split("\n", 1)
        show(keyword, LAWS[name].constants((len(result.constants) - 3) // 2), result, line)
        unloading = material.unloadings.get("cyclic")
        if name == "YOSHIDA UEMORI" and unloading and unloading.falls:
            print(f"*UNLOADING MODULUS\n{unloading.e_a:.6g}, {unloading.xi:.6g}")
    for name, result in functions.items():
        line = data_line(FUNCTIONS[name], result.constants, exponent_of(material))
        show(f"*POTENTIAL, TYPE={name}", FUNCTIONS[name].constants, result, line)
    save(draw(material, curves, cyclic, functions, exponent_of(material)), arguments.out)
    for text in missed.texts:
        print(f"post: {text}", file=sys.stderr)
    return 1 if missed.is_asked_for else 0


def tell_unloading(material, part, results, missed):
    """What the test shows of the modulus, or why it shows nothing."""
    unloading = material.unloadings.get(part)
    if not results or not unloading:
        return
    if unloading.falls:
        seen = ", ".join(f"{slope:.6g} after a plastic strain of {strain:.3g}"
                         for slope, strain in zip(unloading.slopes, unloading.strains))
        print(f"** the modulus falls from young = {unloading.young:g}; slopes of unloading: "
              f"{seen}\n** plastic strains with {unloading.e_a:.6g}, {unloading.xi:.6g} of "
              "*UNLOADING MODULUS, which goes with YOSHIDA UEMORI"
              + ("; one slope does not fix both" if len(unloading.slopes) == 1 else ""))
        return
    misfit, n_seen = min(result.misfit for result in results.values()), len(unloading.slopes)
    if n_seen < unloading.n_reversals and misfit > LARGE_MISFIT:
        missed.texts.append(
            f"{material.path}: {part}: the misfit is {misfit:.2g}, and {n_seen} of "
            f"{unloading.n_reversals} unloadings show whether the modulus falls; expected "
            f"{LEAST_ROWS} rows between each reversal and half of its stress, or plastic strains")


class Missed:
    """Fits that the data do not allow; the others are made."""

    def __init__(self, path):
        self.path = path
        self.texts = []
        self.is_asked_for = False    # some of them by name

    def add(self, key, name, found, expected, is_asked_for):
        self.texts.append(f"{self.path}: {key}: {name} is not fitted: found {found}; expected "
                          f"{expected}")
        self.is_asked_for |= is_asked_for


def show(keyword, names, result, line):
    """Deck lines and, as comments, the constants with their standard deviations."""
    print(f"** misfit {result.misfit:.3g} of the uncertainties of {len(result.errors)} data")
    for name, value, deviation, at_bound in zip(names, result.constants, result.deviations,
                                                result.at_bound):
        text = ("at its bound" if at_bound else "not fixed by the data" if np.isnan(deviation)
                else f"+- {deviation:.2g}")
        print(f"**   {name:>8} {value:12.6g} {text}")
    print(keyword)
    print(line)


def exponent_of(material):
    return float(material.parts.get("yield", {}).get("exponent", EXPONENT))


def attempt(missed, key, name, is_asked_for, n_data, n_constants, make):
    """A fit, or nothing and why."""
    if n_data < n_constants:
        missed.add(key, name, f"{n_data} data", f"at least as many as constants, {n_constants}",
                   is_asked_for)
        return None
    try:
        return make()
    except ResultsError as fault:
        missed.add(key, name, fault, "data that it can follow", is_asked_for)
        return None


def fit_hardening(material, missed):
    """Fits of the flow curves by name."""
    if "hardening" not in material.curves:
        return {}
    part = material.parts["hardening"]
    strain, stress = material.curves["hardening"]
    uncertainty = uncertainty_of(part, stress)
    results = {}
    for name in part.get("laws", list(CURVES)):
        law = CURVES[name]
        results[name] = attempt(
            missed, "hardening.laws", name, "laws" in part, len(strain), len(law.constants),
            lambda law=law: fit(lambda p: (law.value(p, strain) - stress) / uncertainty,
                                [law.start(strain, stress)], law.low, law.high, law.constants))
    return {name: result for name, result in results.items() if result}


def fit_cyclic(material, missed):
    """Fits of the laws for a cyclic curve by name."""
    if "cyclic" not in material.curves:
        return {}
    part = material.parts["cyclic"]
    strain, stress = material.curves["cyclic"]
    largest = np.abs(stress).max()
    uncertainty = uncertainty_of(part, stress)
    n_back = part.get("back_stresses", 2)
    results = {}
    for name in part.get("laws", ["VOCE"]):
        law = LAWS[name]
        starts, names = law.starts(largest, n_back), law.constants(n_back)
        low = [LEAST_YIELD * largest] + [0] * (len(names) - 1)
        results[name] = attempt(
            missed, "cyclic.laws", name, True, len(strain), len(names),
            lambda law=law, starts=starts, names=names, low=low: fit(
                lambda p: (law.stress(p, strain) - stress) / uncertainty, starts, low, law.high,
                names))
    return {name: result for name, result in results.items() if result}


def fit_functions(material, missed):
    """Fits of the yield functions by name."""
    part = material.parts.get("yield")
    if part is None:
        return {}
    n_data = sum(key in row for row in [*material.tension, material.parts.get("biaxial", {})]
                 for key in ("stress", "r"))
    results = {}
    for name in part.get("functions", list(FUNCTIONS)):
        function = FUNCTIONS[name]
        # Tests in the sheet never fix all constants of YLD2004.
        n_constants = 1 if name == "YLD2004" else len(function.constants)
        results[name] = attempt(missed, "yield.functions", name, "functions" in part, n_data,
                                n_constants, lambda f=function: fit_function(material, f))
    return {name: result for name, result in results.items() if result}


def fit_function(material, function):
    """The fit of one yield function."""
    kinds = {"stress": 0.01, "r": 0.02, **material.parts["yield"].get("uncertainty", {})}
    m = exponent_of(material)
    biaxial = material.parts.get("biaxial", {})

    def errors(p):
        found = []
        for row in material.tension:
            own = {**kinds, **row.get("uncertainty", {})}
            if "stress" in row:
                found.append((function.stress(p, m, row["angle"]) - row["stress"]) / own["stress"])
            if "r" in row:
                found.append((function.r_value(p, m, row["angle"]) - row["r"]) / own["r"])
        if biaxial:
            stress, ratio = function.biaxial(p, m)
            found += [(value - biaxial[key]) / kinds[key]
                      for key, value in (("stress", stress), ("r", ratio)) if key in biaxial]
        return np.array(found)

    start = np.array(function.start, float)
    noise = np.random.default_rng(1).normal(0, SPREAD, (N_STARTS - 1, len(start)))
    low, high = (np.array([bound[end] for bound in function.bounds]) for end in (0, 1))
    starts = np.clip([start, *(start + noise)], low, high)
    return fit(errors, starts, low, high, function.constants)
