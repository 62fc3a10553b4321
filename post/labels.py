"""Labels of places in a picture, put where they cover neither lines nor each other."""
import numpy as np

GAP = 4          # pixels around a label that stay free
CLOSE = 60       # pixels from the place, where a label is on the wanted side of it if possible
FARTHEST = 260   # pixels from the place
TURNS = (0, 15, -15, 30, -30, 50, -50, 75, -75, 105, -105, 140, -140, 180)   # degrees
SPACING = 3      # pixels between the points that stand for a line


class Labels:
    """Labels of an axis whose limits are final; `lines`: polylines (n, 2) that stay visible;
    `points`: pixels (n, 2) that do."""

    def __init__(self, axis, lines, points=()):
        self.axis = axis
        self.figure = axis.get_figure()
        axis.autoscale_view()
        axis.set_autoscale_on(False)
        self.figure.canvas.draw()
        self.renderer = self.figure.canvas.get_renderer()
        self.taken = np.concatenate([np.reshape(points, (-1, 2)),
                                     *[self._pixels(line) for line in lines]])
        self.boxes = []

    def _pixels(self, line):
        """Points of a polyline in pixels, close to each other."""
        corners = self.axis.transData.transform(line)
        pieces = [corners[:1]]
        for a, b in zip(corners, corners[1:]):
            n = max(int(np.ceil(np.linalg.norm(b - a) / SPACING)), 1)
            pieces.append(a + (b - a) * np.linspace(0, 1, n + 1)[1:, None])
        return np.concatenate(pieces)

    def put(self, text, place, along, colour="black"):
        """A label next to a place, if possible in the direction `along` from it; with a line to it
        if it is far away."""
        label = self.axis.annotate(text, place, xytext=(0, 0), textcoords="offset points",
                                   ha="center", va="center", fontsize=9, color=colour)
        label.set_in_layout(False)
        size = label.get_window_extent(self.renderer)
        half = 0.5 * np.array([size.width, size.height])
        origin = self.axis.transData.transform(place)
        offset = self._free_offset(origin, half, np.asarray(along, dtype=float))
        label.set_position(offset * 72 / self.figure.dpi)
        self.boxes.append((origin + offset, half))
        if not np.any(offset):
            label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 1, "alpha": 0.8})
        if np.linalg.norm(offset) > np.linalg.norm(half) + 25:
            self._lead(origin, offset, half, colour)
        return label

    def _free_offset(self, origin, half, along):
        """The nearest offset whose box is free, directions close to `along` first."""
        start = np.arctan2(along[1], along[0])
        for turns, farthest in ((TURNS[:7], CLOSE), (TURNS, FARTHEST)):
            for distance in np.arange(8, farthest, 6):
                for turn in np.radians(turns):
                    ray = np.array([np.cos(start + turn), np.sin(start + turn)])
                    offset = ray * (distance + np.min(half / np.maximum(np.abs(ray), 1e-9)))
                    if self._is_free(origin + offset, half + GAP):
                        return offset
        return np.zeros(2)

    def _is_free(self, centre, half):
        if np.any(np.all(np.abs(self.taken - centre) <= half, axis=1)):
            return False
        if any(np.all(np.abs(other - centre) <= half + other_half)
               for other, other_half in self.boxes):
            return False
        frame = self.axis.get_window_extent(self.renderer)
        return bool(np.all(centre - half >= (frame.x0, frame.y0))
                    and np.all(centre + half <= (frame.x1, frame.y1)))

    def _lead(self, origin, offset, half, colour):
        """A thin line from the place to the edge of its label."""
        reach = 1 - 1 / np.max(np.abs(offset) / (half + GAP))
        ends = self.axis.transData.inverted().transform([origin, origin + reach * offset])
        self.axis.plot(*ends.T, color=colour, linewidth=0.5)
