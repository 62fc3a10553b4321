"""`python -m post fit DATA.toml`: constants of a material with their uncertainty, deck lines."""
import numpy as np

from post.fit.data import read_material
from post.fit.figures import draw
from post.fit.hardening import CURVES, cyclic_stress
from post.fit.solve import fit
from post.fit.yields import FUNCTIONS, data_line
from post.results import ResultsError
from post.style import save

N_STARTS = 6         # of yield functions, the first one isotropic
SPREAD = 0.3         # of the others about it
EXPONENT = 8.0


def add_arguments(command):
    command.add_argument("file", metavar="DATA.toml",
                         help="the measured data (see docs/materials.md)")
    command.add_argument("-o", "--out", metavar="PNG",
                         help="the picture to write (default: DATA without its ending, -fit.png)")
    command.set_defaults(is_picture=True)


def run(arguments):
    material = read_material(arguments.file)
    curves = fit_hardening(material)
    cyclic = fit_cyclic(material)
    functions = fit_functions(material)
    print(f"** {material.name}")
    for name, result in curves.items():
        show(f"*PLASTIC, HARDENING={name}", CURVES[name].constants, result,
             ", ".join(f"{value:.6g}" for value in result.constants))
    if cyclic:
        show_cyclic(cyclic)
    for name, result in functions.items():
        line = data_line(FUNCTIONS[name], result.constants, exponent_of(material))
        show(f"*POTENTIAL, TYPE={name}", FUNCTIONS[name].constants, result, line)
    save(draw(material, curves, cyclic, functions, exponent_of(material)), arguments.out)
    return 0


def show(keyword, names, result, line):
    """Deck lines and, as comments, the constants with their standard deviations."""
    print(f"** misfit {result.misfit:.3g} of the uncertainties of {len(result.errors)} data")
    for name, value, deviation in zip(names, result.constants, result.deviations):
        text = "not fixed by the data" if np.isnan(deviation) else f"+- {deviation:.2g}"
        print(f"**   {name:>8} {value:12.6g} {text}")
    print(keyword)
    print(line)


def show_cyclic(result):
    n_back = (len(result.constants) - 3) // 2
    back_names = [f"{c}_{k}" for k in range(1, n_back + 1) for c in ("C", "gamma")]
    line = ", ".join(f"{value:.6g}" for value in result.constants[:3])
    back = "\n".join(", ".join(f"{value:.6g}" for value in pair)
                     for pair in result.constants[3:].reshape(-1, 2))
    show("*PLASTIC, HARDENING=VOCE", ["sigma_0", "Q", "b", *back_names], result,
         f"{line}\n*BACK STRESS\n{back}")


def exponent_of(material):
    return float(material.parts.get("yield", {}).get("exponent", EXPONENT))


def fit_hardening(material):
    """Fits of the flow curves by name."""
    if "hardening" not in material.curves:
        return {}
    part = material.parts["hardening"]
    strain, stress = material.curves["hardening"]
    if np.any(strain < 0):
        raise ResultsError("the flow curve begins at a plastic strain below 0; expected rows from "
                           "yield on, and Young's modulus of the test")
    uncertainty = part.get("uncertainty", 0.01 * np.abs(stress).max())
    results = {}
    for name in part.get("laws", list(CURVES)):
        law = CURVES[name]
        results[name] = fit(lambda p, law=law: (law.value(p, strain) - stress) / uncertainty,
                            [law.start(strain, stress)], law.low, law.high, law.constants)
    return results


def fit_cyclic(material):
    """Voce with back stresses along a cyclic curve."""
    if "cyclic" not in material.curves:
        return None
    part = material.parts["cyclic"]
    strain, stress = material.curves["cyclic"]
    uncertainty = part.get("uncertainty", 0.01 * np.abs(stress).max())
    n_back = part.get("back_stresses", 2)
    largest = np.abs(stress).max()
    fast = [30 * 10 ** k for k in range(n_back)]
    starts = [[share * largest, 0.2 * largest, b,
               *[x for g in fast for x in (0.3 * largest * g / n_back, g)]]
              for share in (0.3, 0.6) for b in (2.0, 20.0)]
    return fit(lambda p: (cyclic_stress(p, strain, n_back) - stress) / uncertainty, starts, 0,
               np.inf, ("sigma_0", "Q", "b", "C", "gamma"))


def fit_functions(material):
    """Fits of the yield functions by name."""
    part = material.parts.get("yield")
    if part is None:
        return {}
    kinds = {"stress": 0.01, "r": 0.02, **part.get("uncertainty", {})}
    m = exponent_of(material)
    biaxial = material.parts.get("biaxial", {})
    n_data = sum(key in row for row in material.tension for key in kinds) + len(biaxial)
    results = {}
    for name in part.get("functions", list(FUNCTIONS)):
        function = FUNCTIONS[name]
        if n_data < len(function.constants) and name != "YLD2004":
            raise ResultsError(f"{name} has {len(function.constants)} constants; found {n_data} "
                               "stresses and r-values, expected at least as many")

        def errors(p, function=function):
            found = []
            for row in material.tension:
                own = {**kinds, **row.get("uncertainty", {})}
                if "stress" in row:
                    found.append((function.stress(p, m, row["angle"]) - row["stress"])
                                 / own["stress"])
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
        results[name] = fit(errors, starts, low, high, function.constants)
    return results
