"""Results of a run as the suites of whole runs read them."""
import h5py
import numpy as np

# Groups of what a run computes.
COMPUTED = ("history", "tools", "points", "frames", "nurbs", "modes", "VTKHDF")


class Run:
    """Results of a run, read as far as the suites need them."""

    def __init__(self, path):
        with h5py.File(path) as file:
            self.history = {name: values[...] for name, values in file["history"].items()
                            if isinstance(values, h5py.Dataset)}
            self.probes = {name: {key: values[...] for key, values in group.items()}
                           for name, group in file.get("history/probes", {}).items()}
            self.tools = {name: {key: values[...] for key, values in group.items()
                                 if isinstance(values, h5py.Dataset)}
                          for name, group in file["tools"].items()}
            self.at_points = fields_at_points(file["points"])
            self.n_points = int(file["VTKHDF/NumberOfPoints"][0])
            self.frames = file["VTKHDF/Points"][...].reshape(-1, self.n_points, 3)
            self.points, self.start = self.frames[-1], self.frames[0]
            # Points of the blank come first, those of the tools behind them.
            of_tools = np.flatnonzero(file["VTKHDF/CellData/part"][:] > 0)
            self.n_blank = self.n_points
            if of_tools.size:
                first = file["VTKHDF/Offsets"][of_tools[0]]
                self.n_blank = file["VTKHDF/Connectivity"][:first].max() + 1
            self.blank, self.blank_start = self.points[:self.n_blank], self.start[:self.n_blank]
            self.net = (file["nurbs/blank/points"][...] if "points" in file["nurbs/blank"]
                        else None)
            self.splines = ([(int(file["nurbs/blank/degrees"][i]),
                              file[f"nurbs/blank/knots_{i + 1}"][...]) for i in range(3)]
                            if self.net is not None else None)
            fields = file["VTKHDF/PointData"]
            self.fields = {name: fields[name][-self.n_points:] for name in fields}

    def time(self):
        return self.history["time"]


def fields_at_points(group):
    """Fields at the integration points; of a blank of several patches those of all, in rows."""
    if any(isinstance(item, h5py.Dataset) for item in group.values()):
        return {name: values[...] for name, values in group.items()}
    patches = [fields_at_points(patch) for patch in group.values()]
    return {name: np.concatenate([p[name].reshape(p["eqps"].size, -1) for p in patches])
            for name in patches[0]}


def numbers(path):
    """All numerical datasets of the groups that a run computes, by name."""
    found = {}
    with h5py.File(path) as file:
        for group in (group for group in COMPUTED if group in file):
            file[group].visititems(lambda name, item, group=group: found.update(
                {f"{group}/{name}": item[()]}) if isinstance(item, h5py.Dataset)
                and not item.dtype.hasobject else None)
    return found


def differing(one, other):
    """Names of the datasets, from `numbers`, that do not have the same bits in both."""
    return sorted(name for name in one.keys() | other.keys()
                  if name not in one or name not in other
                  or not np.array_equal(one[name], other[name], equal_nan=True))
