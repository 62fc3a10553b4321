"""What a test can see of a figure: whether anything is drawn, and what texts cover."""
import numpy as np

SPACING = 2.0   # pixels between the points that stand for a line


def is_blank(figure):
    """Whether nearly all pixels are white."""
    figure.canvas.draw()
    return inked(np.asarray(figure.canvas.buffer_rgba())) < 0.01


def inked(pixels):
    """Part of the pixels of a picture that are not white; 8 bits or parts of 1."""
    colours = np.asarray(pixels, dtype=float)[..., :3]
    return float(np.mean(np.any(colours < (250 if colours.max() > 1 else 0.98), axis=-1)))


def covering(figure):
    """Texts and legends whose boxes cover a drawn line, a picture or another text."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    pictures = [axis.get_window_extent(renderer) for axis in figure.axes if axis.images]
    bad = [item for item in [*figure.legends, *figure.texts] for picture in pictures
           if item.get_window_extent(renderer).overlaps(picture)]
    for axis in figure.axes:
        boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in axis.texts
                 if text.get_text()]
        if axis.get_legend():
            boxes.append(("legend", axis.get_legend().get_window_extent(renderer)))
        points = [pixels_of(line) for line in axis.lines if len(line.get_xdata()) > 2]
        bad += [name for name, box in boxes if any(inside(line, box) for line in points)]
        bad += [a for i, (a, box) in enumerate(boxes) for _, other in boxes[:i]
                if box.overlaps(other)]
    return bad


def pixels_of(line):
    """Points of a curve in pixels, close to each other where it is a line."""
    corners = line.get_transform().transform(np.column_stack(line.get_data()))
    corners = corners[np.all(np.isfinite(corners), axis=1)]
    if line.get_linestyle() == "None":
        return corners
    pieces = [corners[:1]]
    for a, b in zip(corners, corners[1:]):
        n = max(int(np.ceil(np.linalg.norm(b - a) / SPACING)), 1)
        pieces.append(a + (b - a) * np.linspace(0, 1, n + 1)[1:, None])
    return np.concatenate(pieces)


def inside(points, box):
    return bool(np.any((points[:, 0] > box.x0) & (points[:, 0] < box.x1)
                       & (points[:, 1] > box.y0) & (points[:, 1] < box.y1)))
