"""The fields that a picture can show: those of the file, components of vectors and of the stress,
and its principal values."""
import numpy as np

MEANINGS = {"eqps": "equivalent plastic strain", "mises": "von Mises stress",
            "thickness": "thickness", "thinning": "thinning",
            "major_strain": "major strain", "minor_strain": "minor strain",
            "contact_pressure": "contact pressure", "wear": "wear",
            "displacement": "displacement", "velocity": "velocity",
            "damage": "damage indicator", "edge_distance": "distance from the edge",
            "N11": "membrane force 11", "N22": "membrane force 22", "N12": "membrane shear 12",
            "M11": "bending moment 11", "M22": "bending moment 22", "M12": "torsional moment 12"}
OF_TOOLS = "contact_pressure", "wear"
RESULTANTS = "N11", "N22", "N12", "M11", "M22", "M12"    # of shells
TENSOR = "xx", "yy", "zz", "xy", "yz", "xz"       # order of the components in the file
AXES = {"stress": TENSOR, "displacement": "xyz", "velocity": "xyz"}
PRINCIPAL = {"stress_max": (2, "largest principal stress"),
             "stress_mid": (1, "middle principal stress"),
             "stress_min": (0, "least principal stress")}


def source_of(name):
    """The field of the file that a field is computed from."""
    head, _, component = name.rpartition("_")
    return "stress" if name in PRINCIPAL else head if component in AXES.get(head, ()) else name


def derived(name, values):
    """A field from the values of its source, whose last axis counts components."""
    source = source_of(name)
    if source == name:
        return values
    if name in PRINCIPAL:
        numbers = [TENSOR.index(pair) for pair in ("xx", "xy", "xz", "xy", "yy", "yz", "xz", "yz",
                                                   "zz")]
        matrices = values[..., numbers].reshape(*values.shape[:-1], 3, 3)
        found = np.full((*values.shape[:-1], 1), np.nan)
        is_there = np.all(np.isfinite(values), axis=-1)     # not outside an outline
        found[is_there, 0] = np.linalg.eigvalsh(matrices[is_there])[:, PRINCIPAL[name][0]]
        return found
    place = AXES[source].index(name.removeprefix(f"{source}_"))
    return values[..., place:place + 1]


def available(results):
    """Names of all fields of a file."""
    there = results.file["VTKHDF/PointData"]
    names = [name for name in [*MEANINGS, "stress"] if name in there or f"{name}_top" in there]
    return [name for name in names if name != "stress"] + [
        f"{source}_{part}" for source in names for part in AXES.get(source, ())] + [
        name for name in PRINCIPAL if "stress" in names]
