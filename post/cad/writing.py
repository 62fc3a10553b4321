"""Trimmed faces as entities of an IGES file: 144, 142, 102, 126 and 128 (IGES 5.3, chapter 4)."""
import numpy as np

from post.iges_file import TRIMMED_MARK, Entity, surface_text, values_text, write_entities

PART, FLAT_PART = "00010000", "00010500"     # in another entity; and in the parameters of a surface


def write_faces(path, faces, scale, unit, resolution, author):
    """Write faces as a whole or not at all; lengths are multiplied by a scale. `resolution`: how
    far apart edges that meet are, in the unit of the file."""
    entities = []
    for face in faces:
        scale_face(face, scale)
        add_face(entities, face)
    farthest = max(float(np.abs(face.surface.points).max()) for face in faces)
    write_entities(path, entities, TRIMMED_MARK, (farthest, resolution), unit, author)


def scale_face(face, scale):
    face.surface.points *= scale
    for loop in face.loops:
        for _, space in loop:
            if space:
                space.points *= scale


def pointer(entities):
    """Directory number of the last entity."""
    return 2 * len(entities) - 1


def add_face(entities, face):
    """Add the entities of a face, the trimmed surface last."""
    label = face.surface.label
    entities.append(Entity(128, surface_text(face.surface), label, PART))
    surface = pointer(entities)
    loops = [add_loop(entities, surface, loop) for loop in face.loops]
    heads = [1, len(loops) - 1, *loops] if loops else [0, 0, 0]
    entities.append(Entity(144, values_text([144, surface, *heads]), label))


def add_loop(entities, surface, loop):
    """A closed curve on a surface, given in the parameters (preferred) and in space."""
    flat = add_chain(entities, [pair[0] for pair in loop], FLAT_PART)
    space = add_chain(entities, [pair[1] for pair in loop if pair[1]], PART)
    entities.append(Entity(142, values_text([142, 0, surface, flat, space, 1]),
                           "", PART))
    return pointer(entities)


def add_chain(entities, curves, status):
    """A chain of curves; 0 without any."""
    if not curves:
        return 0
    numbers = []
    for curve in curves:
        entities.append(Entity(126, curve_text(curve), "", status))
        numbers.append(pointer(entities))
    entities.append(Entity(102, values_text([102, len(numbers), *numbers]), "", status))
    return pointer(entities)


def curve_text(curve):
    """Values of an entity 126."""
    n, n_axes = curve.points.shape
    points = np.zeros((n, 3))
    points[:, :n_axes] = curve.points
    is_flat = int(n_axes == 2)
    is_closed = int(np.array_equal(points[0], points[-1]))
    is_polynomial = int(np.ptp(curve.weights) == 0)
    heads = [126, n - 1, curve.degree, is_flat, is_closed, is_polynomial, 0]
    normal = [0.0, 0.0, float(is_flat)]
    ends = curve.knots[[curve.degree, -curve.degree - 1]]
    return values_text(heads, np.concatenate([curve.knots, curve.weights, points.ravel(), ends,
                                              normal]))
