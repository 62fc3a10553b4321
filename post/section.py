"""A section of the sheet along a line of material, from its lower to its upper face."""
import numpy as np

from post import cells
from post.section_line import middle_line, plane_line, start_at

N_TOOL_PARTS = 8     # cuts of a tool's cell
FLAT = 1e-6          # of the line, from the plane of a section
NOTHING = 1e-8       # of the line, a coordinate that is 0


class Section:
    """A plane through a line of material with axes along the sheet and across its thickness: the
    middle of the first patch, or where a plane (axis, coordinate) cuts the sheet at the start. Of a
    sheet with an outline it shows what is left at the end, of several pieces the longest.

    The axes are those of the undeformed sheet, rounded to the nearest coordinate axes, so that
    pictures show the deck's coordinates."""

    def __init__(self, results, plane=None):
        self.results = results
        self.pieces = middle_line(results) if plane is None else plane_line(results, *plane)
        start = np.concatenate([start_at(*piece) for piece in self.pieces])
        along = np.abs(start[-1] - start[0])
        lower, _, upper = self._lines(0)[:, len(start) // 2]
        across = np.abs(upper - lower)
        if plane is not None:
            along[plane[0]] = across[plane[0]] = -1.0
            across[np.argmax(along)] = -0.5
        self.axes = np.eye(3)[[np.argmax(along), np.argmax(across)]]
        self.axis_names = ["xyz"[np.argmax(axis)] for axis in self.axes]
        self.normal = np.cross(*self.axes)
        if plane is not None and (start[-1] - start[0]) @ self.axes[0] < 0:
            self.pieces = [(patch, places[::-1]) for patch, places in self.pieces[::-1]]
            start = start[::-1]
        self.start = start @ self.axes[0]
        self.name, self.place = self._told(start)

    def _told(self, start):
        """What titles call the section, and a line that says where it is."""
        unit = self.results.unit("VTKHDF/Points")
        axis = "xyz"[np.argmax(np.abs(self.normal))]
        off = start @ np.abs(self.normal)
        middle = start[len(start) // 2]
        name = f"section at {axis} = {clean(off.mean(), np.ptp(self.start)):.5g} {unit}"
        point = ", ".join(f"{clean(value, np.ptp(self.start)):.5g}" for value in middle)
        normal = ", ".join(f"{abs(value):g}" for value in self.normal)
        place = f"{name} of the sheet at the start, point ({point}), normal ({normal})"
        if np.ptp(off) > FLAT * np.ptp(self.start):
            place += f", along a line of material off the plane by up to {np.ptp(off):.3g} {unit}"
        return name, place

    def _lines(self, frame):
        """Lower face, mid-surface and upper face (3, n, 3)."""
        return np.array([np.concatenate([patch.at("Points", frame, places,
                                                  level * patch.n_elements[2])
                                         for patch, places in self.pieces])
                         for level in (0, 0.5, 1)])

    def sheet(self, frame):
        """Lower face, mid-surface and upper face (3, n, 2) in the section's axes."""
        return self._lines(frame) @ self.axes.T

    def thickness(self, frame):
        """Distance of both faces at equal places along the sheet."""
        lines = self._lines(frame)
        return np.linalg.norm(lines[2] - lines[0], axis=1)

    def tools(self, frame):
        """For each tool the segments (m, 2, 2) of its section."""
        origin = self._lines(frame)[1].mean(axis=0)
        return [cells.cut_triangles(points, triangles, origin, self.normal)[0] @ self.axes.T
                for points, triangles in self.results.tool_surfaces(frame, N_TOOL_PARTS)]


def clean(value, size):
    """A coordinate without round-off."""
    return 0.0 if abs(value) < NOTHING * size else value
