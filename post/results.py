"""Reading a results file: frames, curved cells, history."""
import functools
import os

import h5py
import numpy as np
from contourpy import contour_generator

from post import cells, fields
from post.deck import Deck


class ResultsError(Exception):
    """Something the user can put right: said without a traceback."""


def open_results(path):
    """Any file that igaform has written, open for reading."""
    if not os.path.isfile(path):
        raise ResultsError(f"there is no file '{path}'")
    try:
        file = h5py.File(path)
    except OSError as fault:
        raise ResultsError(f"'{path}' cannot be opened as an HDF5 file: {fault}") from None
    if text_of(file.attrs.get("generator", b"")) != "igaform":
        raise ResultsError(f"'{path}' is not a results file of igaform")
    return file


LAYERS = "bottom", "middle", "top"     # of a shell that is written as its mid-surface
OUTSIDE = -1e30                        # distance from an edge where nothing is left


class Results:
    """An open results file. Arrays are in C order: indices (zeta, eta, xi)."""

    def __init__(self, path):
        self.file = open_results(path)
        if "VTKHDF" not in self.file:
            raise ResultsError(f"'{path}' holds no frames; if it holds material tests, "
                               "`python -m post material` draws them")
        self.path = path
        n_frames = int(self.file["VTKHDF/Steps"].attrs["NSteps"])
        self.times = self.file["VTKHDF/Steps/Values"][:n_frames]
        if n_frames == 0:
            raise ResultsError(f"'{path}' holds no frame yet")
        self.n_points = int(self.file["VTKHDF/NumberOfPoints"][0])
        self.is_bezier = "RationalWeights" in self.file["VTKHDF/PointData"]
        self.is_surface = "normal" in self.file["VTKHDF/PointData"]
        self.patches = []
        for folder in self._patch_folders():
            first = sum(patch.n_points for patch in self.patches)
            self.patches.append(Patch(self, folder, first))
        self.degrees = self.patches[0].degrees
        self.n_elements = self.patches[0].n_elements

    def _patch_folders(self):
        """Names of the patches in the order of their display points; empty for a single one."""
        blank = self.file["nurbs/blank"]
        if "degrees" in blank:
            return [""]
        return sorted(blank, key=lambda name: int(blank[name].attrs["patch"]))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()

    @property
    def tools(self):
        """Names of the tools in the deck's order."""
        tools = self.file["tools"]
        return sorted(tools, key=lambda name: int(tools[name].attrs["part"]))

    @functools.cached_property
    def deck(self):
        """The deck of the run; empty in results of versions that do not write it."""
        text = self.file["provenance"].get("deck_resolved")
        return Deck("" if text is None else text_of(text[()]))

    def tools_present(self, frame):
        """Names of the tools that no *MODEL CHANGE has removed by the step of a frame."""
        step = int(self.file["frames/process_step"][frame])
        return [tool for tool in self.tools if not self.deck.is_removed(tool, step)]

    def side(self, tool):
        """1 where the sheet lies on the side of a tool's normals, else -1."""
        return int(self.file["tools"][tool].attrs.get("side", 1))

    @property
    def n_tool_cells(self):
        return int(np.count_nonzero(self.file["VTKHDF/CellData/part"][:]))

    @property
    def width_ratio(self):
        """Full width, of which forces and energies are, over that of the blank in the file."""
        ratio = self.file.get("provenance/width_ratio")
        return 1.0 if ratio is None else float(ratio[()])

    def unit(self, dataset):
        return text_of(self.file[dataset].attrs.get("unit", b""))

    def unit_of_field(self, name):
        folder = self.file["VTKHDF/PointData"]
        return self.unit(f"VTKHDF/PointData/{name if name in folder else name + '_top'}")

    def frame(self, number=None, time=None):
        """Index of a frame by number (from 0, negative from the end) or by the nearest time."""
        if time is not None:
            span = self.times[-1] - self.times[0]
            if not self.times[0] - 0.01 * span <= time <= self.times[-1] + 0.01 * span:
                raise ResultsError(f"time {time:g} is outside the frames, "
                                   f"{self.times[0]:g} to {self.times[-1]:g}")
            return int(np.argmin(np.abs(self.times - time)))
        number = -1 if number is None else number
        if not -len(self.times) <= number < len(self.times):
            raise ResultsError(f"frame {number} does not exist: there are {len(self.times)}, "
                               f"0 to {len(self.times) - 1}")
        return number % len(self.times)

    def point_data(self, name, frame):
        """A field (or `Points`) at all display points of a frame."""
        folder = "VTKHDF" if name == "Points" else "VTKHDF/PointData"
        if name == "RationalWeights":
            frame = 0
        if name not in self.file[folder]:
            raise ResultsError(f"there is no field {name} in '{self.path}': the deck must ask for "
                               "it (*OUTPUT, FIELDS=)")
        return self.file[folder][name][frame * self.n_points:(frame + 1) * self.n_points]

    def blank_grid(self, name, frame):
        """A field of the blank's first patch on its grid of display points."""
        return self.patches[0].field(name, frame)

    def sample_blank(self, name, frame, xi, eta, zeta):
        """A field of the blank's first patch at a tensor grid of places, see `Patch.sample`."""
        return self.patches[0].sample(name, frame, xi, eta, zeta)

    def tool_surfaces(self, frame, n_parts, fields=None):
        """For each tool a facetted surface (points, triangles): each cell makes n_parts x n_parts
        quadrilaterals of two triangles, and trimmed tools end at their trims. Fields at the display
        points become more columns of the points."""
        group = self.file["VTKHDF"]
        parts, offsets = group["CellData/part"][:], group["Offsets"][:]
        connectivity = group["Connectivity"][:]
        points = self.point_data("Points", frame)
        if fields is not None:
            points = np.column_stack([points, fields])
        has_edges = "edge_distance" in group["PointData"]
        if has_edges:
            points = np.column_stack([points, self.point_data("edge_distance", frame)])
        weights = self.point_data("RationalWeights", frame) if self.is_bezier else None
        surfaces = []
        for tool in range(1, len(self.tools) + 1):
            nodes = [connectivity[offsets[i]:offsets[i + 1]]
                     for i in np.flatnonzero(parts == tool)]
            found, corners = cells.facets(points, weights, nodes, n_parts)
            triangles = cells.triangles_of(corners)
            if has_edges:
                distance = np.nan_to_num(found[:, -1], nan=1.0)   # older files have NaN on tools
                found, triangles = cells.clip(found[:, :-1], triangles, distance)
            surfaces.append((found, triangles))
        return surfaces

    def tool_field(self, tool, name, frame, n_parts):
        """Facets of a tool as in `tool_surfaces`, and a field at their points."""
        if tool not in self.tools:
            raise ResultsError(f"there is no tool '{tool}', but {', '.join(self.tools)}")
        values = self.point_data(name, frame).reshape(self.n_points, -1)
        place = self.tools.index(tool)
        points, triangles = self.tool_surfaces(frame, n_parts, values)[place]
        shown = points[:, 3:] if values.shape[1] == 1 else \
            np.linalg.norm(points[:, 3:], axis=1, keepdims=True)
        return points[:, :3], triangles, np.maximum(shown[:, 0], 0.0)

    def history(self, name):
        return self.file["history"][name][:]

    def balance_error(self):
        """Energy that the balance lacks at each sample, over the largest energy of the run.
        The column energy_error is relative to the energies of its time, next to nothing at first.
        """
        kinetic, internal, work = map(self.history, ("kinetic_energy", "internal_energy",
                                                     "external_work"))
        scale = np.maximum(np.maximum(np.abs(work), kinetic + internal), kinetic[:1])
        return self.history("energy_error") * scale / max(scale.max(initial=0.0), 1e-300)

    def tool_history(self, tool, name):
        return self.file["tools"][tool][name][:]

    def points(self, name):
        """A dataset of /points: the integration points on their grid; those of several patches
        one after the other."""
        return self._of_patches("points", lambda group: group[name][:],
                                name == "reference_position")

    def plastic_strain(self, frame):
        """Plastic strain at the integration points of a frame, as `points` orders them, and the
        volumes at the start; both are 0 at points of elements of which nothing is left."""
        strain = self._of_patches("frames", lambda group: group["eqps"][frame], False)
        is_there = np.isfinite(strain)
        return (np.where(is_there, strain, 0.0),
                np.where(is_there, self.points("reference_volume"), 0.0))

    def _of_patches(self, folder, read, is_vector):
        groups = [self.file[folder][patch.name] if patch.name else self.file[folder]
                  for patch in self.patches]
        values = [read(group) for group in groups]
        if len(values) == 1:
            return values[0]
        return np.concatenate([v.reshape(-1, 3) if is_vector else v.ravel() for v in values])


class Patch:
    """One patch of the blank with its display points. A shell that is written as its mid-surface is
    a sheet of three layers of points here, of which the outer ones lie on its faces."""

    def __init__(self, results, name, first):
        self.results, self.name, self.first = results, name, first
        group = results.file["nurbs/blank"]
        group = group[name] if name else group
        self.degrees = group["degrees"][:]
        self.n_elements = np.array([len(np.unique(group[f"knots_{d}"][:])) - 1 for d in (1, 2, 3)])
        self.degree = int(self.degrees.max())
        self.cell_degrees = np.array([self.degree] * 3)     # along zeta, eta, xi
        if results.is_surface:
            self.cell_degrees[0] = len(LAYERS) - 1
        self.grid = tuple(self.cell_degrees * self.n_elements[::-1] + 1)
        self.n_points = int(np.prod(self.grid)) // (len(LAYERS) if results.is_surface else 1)

    def field(self, name, frame):
        """A field on the grid of display points."""
        source = fields.source_of(name)
        values = self._layers(source, frame) if self.results.is_surface else \
            self._values(source, frame)
        return fields.derived(name, values.reshape(*self.grid, -1))

    def field_inside(self, name, frame):
        """The same, NaN at points beyond the edges of outlines, whose values are continued."""
        values = self.field(name, frame)
        if self.elements_left(frame) is None:
            return values
        return np.where(self.field("edge_distance", frame) >= 0, values, np.nan)

    def _values(self, name, frame):
        """A dataset at the display points."""
        return self.results.point_data(name, frame)[self.first:self.first + self.n_points]

    def _layers(self, name, frame):
        """A field at the three layers of a shell, from the datasets of its mid-surface."""
        if f"{name}_top" in self.results.file["VTKHDF/PointData"]:
            there = [layer for layer in LAYERS
                     if f"{name}_{layer}" in self.results.file["VTKHDF/PointData"]]
            values = {layer: self._values(f"{name}_{layer}", frame) for layer in there}
            return np.stack([values.get(layer, np.zeros(self.n_points)) for layer in LAYERS])
        values = np.stack([self._values(name, frame)] * len(LAYERS))
        if name in ("Points", "displacement"):
            to_top = self._to_top(frame)
            if name == "displacement":
                to_top = to_top - self._to_top(0)
            values += np.multiply.outer([-1, 0, 1], to_top)
        return values

    def _to_top(self, frame):
        """From the mid-surface to the top face."""
        return 0.5 * self._values("thickness", frame)[:, None] * self._values("normal", frame)

    def edge_lines(self, frame):
        """The edges of an outline as lines of places (xi, eta), which count elements from 0."""
        distance = np.nan_to_num(self.field("edge_distance", frame)[0, :, :, 0], nan=-1e30)
        xi, eta = (np.arange(size) / self.degree for size in distance.shape[::-1])
        return contour_generator(xi, eta, distance).lines(0.0)

    def at(self, name, frame, places, zeta):
        """A vector field at single places (xi, eta), as the cells have it."""
        zeta_values, weights = np.nan_to_num(self.field(name, frame)), None
        if self.results.is_bezier:
            weights = self.field("RationalWeights", frame)
            zeta_values = np.concatenate([zeta_values * weights, weights], axis=-1)
        rows = [cells.line_matrix(self.cell_degrees[axis], self.grid[axis], line,
                                  self.results.is_bezier)
                for axis, line in enumerate([[zeta], places[:, 1], places[:, 0]])]
        values = np.einsum("z,ne,nx,zexc->nc", rows[0][0], rows[1], rows[2], zeta_values,
                           optimize=True)
        return values if weights is None else values[:, :-1] / values[:, -1:]

    def elements_left(self, frame):
        """Which elements (eta, xi) an outline leaves, whole or cut; None: there is none. Nodes
        inside of an element are its own, others are there for a neighbour as well."""
        if "edge_distance" not in self.results.file["VTKHDF/PointData"]:
            return None
        is_there = np.isfinite(self.field("edge_distance", frame)[0, :, :, 0])
        d = self.degree
        return np.all([is_there[i:is_there.shape[0] - d + i:d, j:is_there.shape[1] - d + j:d]
                       for i in range(d + 1) for j in range(d + 1)], axis=0)

    def inside(self, frame, xi, eta):
        """How far places (eta, xi) lie inside of an outline: unlike a sampled field as smooth as
        the cells, so that its zeros follow a curve."""
        return within_cells(cells.evaluate_grid(self._distance(frame), None, (eta, xi),
                                                self.cell_degrees[1:])[..., 0])

    def inside_at(self, frame, places):
        """The same at single places (xi, eta)."""
        eta, xi = (cells.line_matrix(self.cell_degrees[axis], self.grid[axis], line, False)
                   for axis, line in ((1, places[:, 1]), (2, places[:, 0])))
        return within_cells(np.einsum("ne,nx,ex->n", eta, xi, self._distance(frame)[..., 0],
                                      optimize=True))

    def _distance(self, frame):
        """From the edge at the display points of a layer; where nothing is left far outside."""
        return np.nan_to_num(self.field("edge_distance", frame)[0], nan=OUTSIDE)

    def points(self, name):
        """A dataset of /points of this patch, on the grid of the integration points."""
        group = self.results.file["points"]
        return (group[self.name] if self.name else group)[name][:]

    def sample(self, name, frame, xi, eta, zeta):
        """A field at a tensor grid of places; places count elements from 0. Vectors are evaluated
        as the cells have them, scalars stay in the range of their nodes."""
        values = self.field(name, frame)
        if self.elements_left(frame) is not None:
            # Nodes that no element has left.
            values = np.nan_to_num(values)
        if values.shape[-1] == 1:
            return cells.interpolate_grid(values, (zeta, eta, xi), self.cell_degrees)
        weights = self.field("RationalWeights", frame) if self.results.is_bezier else None
        return cells.evaluate_grid(values, weights, (zeta, eta, xi), self.cell_degrees)


def within_cells(distance):
    """A distance whose polynomials have lost nodes outside."""
    return np.where(np.abs(distance) > 1e-12 * abs(OUTSIDE), OUTSIDE, distance)


def counted(n, noun, nouns=None):
    """A count with its noun, such as `1 frame` or `2 frames`."""
    return f"{n} {noun if n == 1 else nouns or noun + 's'}"


def name_of(path):
    """The name of a file without folder and ending."""
    return os.path.splitext(os.path.basename(path))[0]


def text_of(value):
    return value.decode() if isinstance(value, bytes) else str(value)
