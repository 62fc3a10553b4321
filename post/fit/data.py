"""The measured data of a material from its TOML file, checked: all faults are told in one go.

    name = "AA6022-T4"
    young = 70000                       # for curves of the whole strain
    [hardening]
    laws = ["VOCE", "SWIFT"]
    curve = "tension.csv"               # strain, stress; or points = [[strain, stress], ...]
    strain = "plastic"                  # or "whole"
    uncertainty = 2                     # of the stress
    [cyclic]
    curve = "cyclic.csv"
    laws = ["VOCE", "YOSHIDA UEMORI"]   # without it VOCE alone
    back_stresses = 2
    strain = "whole"
    uncertainty = 5
    [[tension]]                         # any number of angles from 0 to 90, each once
    angle = 45
    stress = 0.968                      # yield stress over the one at 0 degrees, or
    r = 0.37
    uncertainty = { r = 0.01 }          # of this row; else as below
    [biaxial]
    stress = 1.0
    r = 1.08                            # plastic strain 22 over 11
    [yield]
    functions = ["HILL48", "YLD2000"]
    exponent = 8
    uncertainty = { stress = 0.01, r = 0.02 }
"""
import os
from dataclasses import dataclass, field

import numpy as np

from post.fit.cyclic import LAWS
from post.fit.hardening import CURVES
from post.fit.unloading import plastic_strains, unloading_of
from post.fit.yields import FUNCTIONS
from post.number_table import read_numbers
from post.results import ResultsError, counted
from post.toml_file import NUMBER, TomlReader, hint, read_toml

KEYS = {"name": str, "young": NUMBER, "hardening": dict, "cyclic": dict, "tension": list,
        "biaxial": dict, "yield": dict}
CURVE_KEYS = {"curve": str, "points": list, "strain": str, "uncertainty": NUMBER}
PART_KEYS = {"hardening": {"laws": list, **CURVE_KEYS},
             "cyclic": {"laws": list, "back_stresses": int, **CURVE_KEYS},
             "biaxial": {"stress": NUMBER, "r": NUMBER},
             "yield": {"functions": list, "exponent": NUMBER, "uncertainty": dict}}
TENSION_KEYS = {"angle": NUMBER, "stress": NUMBER, "r": NUMBER, "uncertainty": dict}
PLACES = {"name": "at the top of the file, before the first [table]",
          "young": "at the top of the file, before the first [table]",
          "laws": "in [hardening] or [cyclic]", "back_stresses": "in [cyclic]",
          "functions": "in [yield]", "exponent": "in [yield]", "angle": "in [[tension]]"}
LEAST_ROWS = {"hardening": 3, "cyclic": 8}
LARGEST_STRAIN = 3.0                  # beyond it strains are per cent, or stresses
STRESS_OVER_MODULUS = 1e-4, 0.05      # of metals
RELATIVE_STRESS = 0.3, 3.0            # yield stress over that at 0 degrees
FLOWING = 0.2        # rows whose strain grows plastically by less of it are elastic: left out


@dataclass
class Material:
    name: str
    young: float
    path: str = ""
    parts: dict = field(default_factory=dict)
    curves: dict = field(default_factory=dict)     # of hardening and cyclic: plastic strain, stress
    unloadings: dict = field(default_factory=dict)   # of the same, with whole strains
    tension: list = field(default_factory=list)


def uncertainty_of(part, stress):
    """The scatter of the stresses of a curve."""
    return part.get("uncertainty", 0.01 * np.abs(stress).max())


def read_material(path):
    """The data of a file; `ResultsError` with all its faults."""
    return read_toml(path, "file of data", Reader)


class Reader(TomlReader):
    """Takes the tables of measured data apart and notes what is wrong."""
    places = PLACES

    def take(self, source):
        tension = source.get("tension", [])
        is_list = isinstance(tension, list) and all(isinstance(row, dict) for row in tension)
        if not is_list:
            self.fault("tension", "no list of tables", "[[tension]], one for each angle")
            source = {key: value for key, value in source.items() if key != "tension"}
        source = self.known(source, KEYS, "")
        parts = {name: self.known(source[name], keys, name)
                 for name, keys in PART_KEYS.items() if name in source}
        material = Material(source.get("name", os.path.basename(self.path)),
                            source.get("young", 0.0), self.path, parts)
        if "young" in source and material.young <= 0:
            self.fault("young", material.young, "Young's modulus, a number above 0")
        material.tension = self.tension(source.get("tension", []))
        for name in ("hardening", "cyclic"):
            if name in parts:
                self.curve(parts[name], name, material)
        self.ratios(parts.get("biaxial", {}), "biaxial")
        self.names(parts.get("hardening", {}), "laws", list(CURVES), "hardening")
        self.names(parts.get("cyclic", {}), "laws", list(LAWS), "cyclic")
        self.names(parts.get("yield", {}), "functions", list(FUNCTIONS), "yield")
        if parts.get("cyclic", {}).get("back_stresses", 1) < 1:
            self.fault("cyclic.back_stresses", parts["cyclic"]["back_stresses"], "at least 1")
        if not {"hardening", "cyclic", "yield"} & parts.keys():
            self.fault("the file", "nothing to fit", "[hardening], [cyclic] or [yield]")
        self.exponent(parts.get("yield", {}))
        self.uncertainties(parts.get("yield", {}), "yield")
        if "yield" in parts and is_list and not tension:
            self.fault("yield", "no [[tension]]", "stresses and r-values to fit")
        return material

    def tension(self, source):
        """The tests in tension, each stress and r-value once for an angle."""
        rows, seen = [], {}
        for i, given in enumerate(source, 1):
            row = self.known(given, TENSION_KEYS, f"tension {i}")
            rows.append(row)
            is_missing = "angle" not in given or not {"stress", "r"} & given.keys()
            if is_missing or not 0 <= row.get("angle", 0) <= 90:
                self.fault(f"tension {i}", given,
                           "an angle from 0 to 90 degrees and stress, r or both")
            if is_missing or "angle" not in row:
                continue
            self.ratios(row, f"tension {i}")
            self.uncertainties(row, f"tension {i}")
            for key in ("stress", "r"):
                first = seen.setdefault((key, row["angle"]), i) if key in row else i
                if first != i:
                    self.fault(f"tension {i}.{key}", f"{key} at {row['angle']:g} degrees a second "
                               "time", f"one for each angle, as in tension {first}; give the mean "
                               "of several tests")
        return rows

    def ratios(self, row, where):
        """Relative stress and r-value."""
        low, high = RELATIVE_STRESS
        if "stress" in row and not low <= row["stress"] <= high:
            self.fault(f"{where}.stress", row["stress"], "the yield stress over the one in tension "
                       f"at 0 degrees, from {low:g} to {high:g}, no stress in MPa")
        if "r" in row and row["r"] <= 0:
            self.fault(f"{where}.r", row["r"], "a number above 0")

    def uncertainties(self, table, where):
        for key, value in self.known(table.get("uncertainty", {}),
                                     {"stress": NUMBER, "r": NUMBER},
                                     f"{where}.uncertainty").items():
            if value <= 0:
                self.fault(f"{where}.uncertainty.{key}", value, "a number above 0")

    def exponent(self, part):
        """That of the yield functions, as *POTENTIAL takes it."""
        value = part.get("exponent", 8)
        functions = part.get("functions", list(FUNCTIONS))
        even = [name for name in FUNCTIONS if name in functions and FUNCTIONS[name].is_even]
        if not 2 <= value <= 100:
            self.fault("yield.exponent", value, "a number from 2 to 100")
        elif even and value % 2 != 0:
            self.fault("yield.exponent", value, f"an even whole number, for {', '.join(even)}")

    def names(self, part, key, known, where):
        """A list of names, all of which are known; without it they are all meant."""
        found = part.get(key, known)
        if not found:
            self.fault(f"{where}.{key}", "an empty list", f"one or more of {', '.join(known)}")
        for name in found:
            if name not in known:
                self.fault(f"{where}.{key}", repr(name), f"one of {', '.join(known)}"
                           + hint(str(name).upper(), known))

    def curve(self, part, where, material):
        """Plastic strain and stress, from a file or from points."""
        kind = part.get("strain", "plastic")
        young = material.young
        if kind not in ("plastic", "whole"):
            self.fault(f"{where}.strain", repr(kind), "plastic or whole")
        elif kind == "whole" and young <= 0:
            self.fault("young", "nothing", "Young's modulus at the top of the file, for the whole "
                       f"strain of {where}")
        rows, place = self.rows(part, where)
        if rows is None or not self.is_plausible(rows, part, where, place, young):
            return
        strain, stress = rows.T
        if kind == "whole" and young > 0:
            unloading = unloading_of(strain, stress, young, uncertainty_of(part, stress))
            plastic = plastic_strains(strain, stress, unloading.modulus)
            flows = np.abs(np.diff(plastic, prepend=0.0)) > FLOWING * np.abs(np.diff(strain,
                                                                                     prepend=0.0))
            strain, stress = plastic[flows], stress[flows]
            material.unloadings[where] = unloading
        if len(strain) < LEAST_ROWS[where]:
            self.fault(place, counted(len(strain), "row") + " of plastic strain",
                       f"at least {LEAST_ROWS[where]}")
        elif where == "hardening" and np.any(strain < 0):
            self.fault(place, f"a plastic strain of {strain.min():.4g}", "rows from yield on, "
                       + ("and young of this test" if kind == "whole" else
                          "or strain = \"whole\" with young for strains with elastic parts"))
        else:
            material.curves[where] = strain, stress

    def rows(self, part, where):
        """The table of a curve and where it is from; None with a fault."""
        if ("curve" in part) == ("points" in part):
            self.fault(where, "both curve and points" if "curve" in part else
                       "neither curve nor points", "one of them")
            return None, where
        place = f"{where}.{'curve' if 'curve' in part else 'points'}"
        if "points" in part:
            rows = part["points"]
            if all(isinstance(row, list) and len(row) == 2
                   and all(type(value) in NUMBER for value in row) for row in rows):
                return np.array(rows, float).reshape(-1, 2), place
            self.fault(place, "rows of other than two numbers", "[[strain, stress], ...]")
            return None, place
        try:
            rows = read_numbers(os.path.join(os.path.dirname(self.path), part["curve"]))
            return rows, f"{place}, '{part['curve']}'"
        except ResultsError as fault:
            self.fault(place, fault, "a file of strain, stress")
        return None, place

    def is_plausible(self, rows, part, where, place, young):
        """Whether the columns of a curve and the moduli have sizes that go together."""
        n_before = len(self.faults)
        is_finite = np.isfinite(rows).all(axis=1)
        strain, stress = np.abs(rows[is_finite]).max(axis=0, initial=0.0)
        if len(rows) == 0:
            self.fault(place, "no rows", f"at least {LEAST_ROWS[where]} of strain and stress")
        elif not is_finite.all():
            row = int(np.argmin(is_finite))
            self.fault(place, "{:g}, {:g} in row {}".format(*rows[row], row + 1),
                       "finite numbers")
        elif strain > LARGEST_STRAIN:
            is_swapped = stress <= LARGEST_STRAIN
            self.fault(place, f"strains to {strain:.4g}", "strain in the first column and stress "
                       "in the second" if is_swapped else f"strains to {LARGEST_STRAIN:g} at most, "
                       "as parts and not per cent")
        elif where == "hardening" and np.any(rows[:, 1] <= 0):
            row = int(np.argmax(rows[:, 1] <= 0))
            self.fault(place, f"the stress {rows[row, 1]:g} in row {row + 1}", "stresses above 0 "
                       "in the second column, strains in the first")
        elif stress == 0:
            self.fault(place, "no stress but 0", "strains in the first column and stresses in the "
                       "second")
        elif young > 0 and not (STRESS_OVER_MODULUS[0] * young <= stress
                                <= STRESS_OVER_MODULUS[1] * young):
            low, high = STRESS_OVER_MODULUS
            self.fault(place, f"stresses to {stress:.4g} with young = {young:g}", "both in the "
                       f"same unit, stresses to {low:g} to {high:g} times young")
        if stress > 0 and not 0 < part.get("uncertainty", 0.5 * stress) < stress:
            self.fault(f"{where}.uncertainty", part["uncertainty"], "the scatter of the stress, "
                       f"above 0 and below its largest value {stress:.4g}, in the same unit")
        return len(self.faults) == n_before
