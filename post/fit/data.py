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
    back_stresses = 2
    strain = "whole"
    uncertainty = 5
    [[tension]]                         # any number of angles from 0 to 90
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

from post.fit.hardening import CURVES
from post.fit.yields import FUNCTIONS
from post.number_table import read_numbers
from post.results import ResultsError
from post.toml_file import NUMBER, TomlReader, hint, read_toml

KEYS = {"name": str, "young": NUMBER, "hardening": dict, "cyclic": dict, "tension": list,
        "biaxial": dict, "yield": dict}
CURVE_KEYS = {"curve": str, "points": list, "strain": str, "uncertainty": NUMBER}
PART_KEYS = {"hardening": {"laws": list, **CURVE_KEYS},
             "cyclic": {"back_stresses": int, **CURVE_KEYS},
             "biaxial": {"stress": NUMBER, "r": NUMBER},
             "yield": {"functions": list, "exponent": NUMBER, "uncertainty": dict}}
TENSION_KEYS = {"angle": NUMBER, "stress": NUMBER, "r": NUMBER, "uncertainty": dict}
FLOWING = 0.2        # rows whose strain grows plastically by less of it are elastic: left out


@dataclass
class Material:
    name: str
    young: float
    parts: dict = field(default_factory=dict)
    curves: dict = field(default_factory=dict)     # of hardening and cyclic: plastic strain, stress
    tension: list = field(default_factory=list)


def read_material(path):
    """The data of a file; `ResultsError` with all its faults."""
    return read_toml(path, "file of data", Reader)


class Reader(TomlReader):
    """Takes the tables of measured data apart and notes what is wrong."""

    def take(self, source):
        source = self.known(source, KEYS, "")
        parts = {name: self.known(source[name], keys, name)
                 for name, keys in PART_KEYS.items() if name in source}
        tension = [self.known(row, TENSION_KEYS, f"tension {i}")
                   for i, row in enumerate(source.get("tension", []), 1) if isinstance(row, dict)]
        for i, row in enumerate(tension, 1):
            if not 0 <= row.get("angle", -1) <= 90 or not {"stress", "r"} & row.keys():
                self.fault(f"tension {i}", row,
                           "an angle from 0 to 90 degrees and stress, r or both")
            if row.get("stress", 1) <= 0 or row.get("r", 1) <= 0:
                self.fault(f"tension {i}", row, "stress and r above 0")
        material = Material(source.get("name", os.path.basename(self.path)),
                            source.get("young", 0.0), parts, {}, tension)
        for name in ("hardening", "cyclic"):
            if name in parts:
                curve = self.curve(parts[name], name, material.young)
                if curve is not None:
                    material.curves[name] = curve
        self.names(parts.get("hardening", {}).get("laws", []), CURVES, "hardening.laws")
        self.names(parts.get("yield", {}).get("functions", []), FUNCTIONS, "yield.functions")
        if parts.get("cyclic", {}).get("back_stresses", 1) < 1:
            self.fault("cyclic.back_stresses", parts["cyclic"]["back_stresses"], "at least 1")
        if not {"hardening", "cyclic", "yield"} & parts.keys():
            self.fault("the file", "nothing to fit", "[hardening], [cyclic] or [yield]")
        for name in ("hardening", "cyclic"):
            if parts.get(name, {}).get("uncertainty", 1) <= 0:
                self.fault(f"{name}.uncertainty", parts[name]["uncertainty"], "a number above 0")
        self.exponent(parts.get("yield", {}))
        for where, table in [("yield", parts.get("yield", {})),
                             *((f"tension {i}", row) for i, row in enumerate(tension, 1))]:
            for key, value in self.known(table.get("uncertainty", {}),
                                         {"stress": NUMBER, "r": NUMBER},
                                         f"{where}.uncertainty").items():
                if value <= 0:
                    self.fault(f"{where}.uncertainty.{key}", value, "a number above 0")
        if "yield" in parts and not tension:
            self.fault("yield", "no [[tension]]", "stresses and r-values to fit")
        return material

    def exponent(self, part):
        """That of the yield functions, as *POTENTIAL takes it."""
        value = part.get("exponent", 8)
        even = [name for name in part.get("functions", list(FUNCTIONS))
                if name in FUNCTIONS and FUNCTIONS[name].is_even]
        if not 2 <= value <= 100:
            self.fault("yield.exponent", value, "a number from 2 to 100")
        elif even and value % 2 != 0:
            self.fault("yield.exponent", value, f"an even whole number, for {', '.join(even)}")

    def names(self, found, known, where):
        for name in found:
            if name not in known:
                self.fault(where, repr(name), f"one of {', '.join(known)}"
                           + hint(str(name).upper(), known))

    def curve(self, part, where, young):
        """Plastic strain and stress, from a file or from points."""
        if ("curve" in part) == ("points" in part):
            self.fault(where, "both curve and points" if "curve" in part else
                       "neither curve nor points", "one of them")
            return None
        rows = part.get("points")
        if rows is None:
            try:
                rows = read_numbers(os.path.join(os.path.dirname(self.path), part["curve"]))
            except ResultsError as fault:
                self.fault(f"{where}.curve", fault, "a file of strain, stress")
                return None
        try:
            strain, stress = np.array(rows, float).T
        except ValueError:
            self.fault(where, "rows of other than two numbers", "strain, stress")
            return None
        least = 3 if where == "hardening" else 8
        if len(strain) < least:
            self.fault(where, f"{len(strain)} rows", f"at least {least}")
            return None
        if part.get("strain", "plastic") not in ("plastic", "whole"):
            self.fault(f"{where}.strain", repr(part["strain"]), "plastic or whole")
        elif part.get("strain") == "whole":
            if young <= 0:
                self.fault("young", "nothing", f"Young's modulus, for the whole strain of {where}")
                return None
            plastic = strain - stress / young
            flows = np.abs(np.diff(plastic, prepend=0.0)) > FLOWING * np.abs(np.diff(strain,
                                                                                     prepend=0.0))
            strain, stress = plastic[flows], stress[flows]
        return strain, stress
