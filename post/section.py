"""The mid-section of the sheet: across its width in the middle, along its length."""
import numpy as np

from post import cells

N_PER_ELEMENT = 8    # places along the sheet
N_TOOL_PARTS = 8     # cuts of a tool's cell


class Section:
    """A plane through the sheet's middle with axes along the sheet and across its thickness. Of a
    sheet with an outline it shows what is left at the end, of several pieces the longest.

    The axes are those of the undeformed sheet, rounded to the nearest coordinate axes, so that
    pictures show the deck's coordinates."""

    def __init__(self, results):
        self.results = results
        n = results.n_elements
        self.xi = np.linspace(0, n[0], N_PER_ELEMENT * n[0] + 1)
        self.eta = [0.5 * n[1]]
        self.xi = self._left()
        start = self._lines(0, "Points") - self._lines(0, "displacement")
        along = start[1, -1] - start[1, 0]
        across = start[2, len(self.xi) // 2] - start[0, len(self.xi) // 2]
        self.axes = np.eye(3)[[np.argmax(np.abs(along)), np.argmax(np.abs(across))]]
        self.axis_names = ["xyz"[np.argmax(axis)] for axis in self.axes]
        self.normal = np.cross(*self.axes)
        self.start = start[1] @ self.axes[0]

    def _left(self):
        """Places along the longest piece of the line that an outline leaves to the end."""
        last = len(self.results.times) - 1
        if self.results.patches[0].elements_left(last) is None:
            return self.xi
        distance = self.results.patches[0].inside(last, self.xi, self.eta)[0]
        pieces = np.split(np.arange(len(self.xi)), np.flatnonzero(np.diff(distance > 0)) + 1)
        piece = max((piece for piece in pieces if distance[piece[0]] > 0), key=len,
                    default=np.arange(len(self.xi)))
        ends = [self._edge(distance, inside, inside + way)
                for inside, way in ((piece[0], -1), (piece[-1], 1))]
        return np.linspace(*ends, len(piece) + 1)

    def _edge(self, distance, inside, outside):
        """Where the distance is zero between two neighbouring places."""
        if not 0 <= outside < len(self.xi):
            return self.xi[inside]
        share = distance[inside] / (distance[inside] - distance[outside])
        return self.xi[inside] + share * (self.xi[outside] - self.xi[inside])

    def _lines(self, frame, name):
        zeta = np.array([0, 0.5, 1]) * self.results.n_elements[2]
        return self.results.sample_blank(name, frame, self.xi, self.eta, zeta)[:, 0]

    def sheet(self, frame):
        """Lower face, mid-surface and upper face (3, n, 2) in the section's axes."""
        return self._lines(frame, "Points") @ self.axes.T

    def thickness(self, frame):
        """Distance of both faces at equal places along the sheet."""
        lines = self._lines(frame, "Points")
        return np.linalg.norm(lines[2] - lines[0], axis=1)

    def tools(self, frame):
        """For each tool the segments (m, 2, 2) of its section."""
        origin = self._lines(frame, "Points")[1].mean(axis=0)
        return [cells.cut_triangles(points, triangles, origin, self.normal)[0] @ self.axes.T
                for points, triangles in self.results.tool_surfaces(frame, N_TOOL_PARTS)]
