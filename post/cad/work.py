"""What `post cad` does, in a process of its own: read, choose, list, draw, convert, write, tell."""
import sys
from collections import Counter

import numpy as np

from post.cad import occ
from post.cad.choice import chosen, direction
from post.cad.convert import convert
from post.cad.facts import facts_of, table_lines
from post.cad.joints import find_joints
from post.cad.reading import read_model
from post.cad.writing import write_faces
from post.results import ResultsError, counted

TOLERANCE, GAP = 1e-3, 0.1              # mm
OF_DIAGONAL = 1e-5, 1e-3                # of the diagonal, at most
ZERO_AREA = 1e-12                       # of the square of the diagonal
MOST_TOLD = 20                          # refused faces


def work(arguments, millimetres):
    """`millimetres`: of the unit of the options and of what is written."""
    occ.silence()
    scale = 1 / millimetres
    model = read_model(arguments.file)
    faces = chosen(model, arguments)
    facts = {face.number: facts_of(face) for face in faces}
    diagonal = diagonal_of(facts)
    notes = []
    if arguments.seen_from:
        faces = seen_faces(model, faces, arguments, notes)
        facts = {face.number: facts[face.number] for face in faces}
    say = (lambda text: None) if arguments.quiet else print
    if arguments.list:
        print("\n".join(table_lines(faces, facts, scale, arguments.unit.lower())))
    else:
        tell_model(say, model, faces, facts, notes, scale, arguments.unit.lower())
    if arguments.picture:
        from post.cad.picture import draw_picture
        draw_picture(model, faces, facts, arguments)
    if arguments.out:
        faces = with_area(faces, facts, diagonal)
        tolerance, gap = limits(arguments, diagonal, millimetres)
        done = convert(faces, tolerance, gap)
        refuse(done, faces)
        joints = find_joints(done.shapes, gap)
        tell_conversion(say, done, joints, scale, arguments.unit.lower())
        write_faces(arguments.out, done.faces, scale, arguments.unit,
                    max(joints.gap * scale, 0.0), "igaform post cad")
        say(f"{arguments.out}: {counted(len(done.faces), 'trimmed surface')} in {arguments.unit}")


def diagonal_of(facts):
    low, high = box_of(facts)
    return float(np.linalg.norm(high - low))


def box_of(facts):
    return (np.min([one.low for one in facts.values()], axis=0),
            np.max([one.high for one in facts.values()], axis=0))


def limits(arguments, diagonal, millimetres):
    """Tolerance and gap in mm."""
    return [usual if given is None else given * millimetres for given, usual in (
        (arguments.tolerance, min(TOLERANCE, OF_DIAGONAL[0] * diagonal)),
        (arguments.gap, min(GAP, OF_DIAGONAL[1] * diagonal)))]


def seen_faces(model, faces, arguments, notes):
    """The faces among them that are seen; all of the file may hide them."""
    from post.cad.sight import seen
    facts = {face.number: facts_of(face) for face in model.faces}
    found, walls = seen(faces, model.faces, direction(arguments.seen_from), diagonal_of(facts))
    if not found:
        raise ResultsError(f"none of the faces is seen from {arguments.seen_from}")
    if walls:
        numbers = ranges(faces[i].number for i in walls)
        notes.append(f"walls along the view from {arguments.seen_from} among them: "
                     f"{numbers}; leave sides of a block out with --without")
    return [faces[i] for i in found]


def ranges(numbers):
    """Numbers as text such as 3, 5-9."""
    words, numbers = [], sorted(numbers)
    for number in numbers:
        if words and number == words[-1][1] + 1:
            words[-1][1] = number
        else:
            words.append([number, number])
    return ", ".join(f"{a}" if a == b else f"{a}-{b}" for a, b in words)


def with_area(faces, facts, diagonal):
    """Faces without area are left out with a warning."""
    kept = [face for face in faces if facts[face.number].area > ZERO_AREA * diagonal**2]
    for face in faces:
        if face not in kept:
            print(f"post: warning: face {face.number} at {occ.place_text(facts[face.number].low)} "
                  "has no area: left out", file=sys.stderr)
    if not kept:
        raise ResultsError("no face has an area")
    return kept


def refuse(done, faces):
    """Stop if a face cannot be written."""
    if not done.refused:
        return
    lines = [f"face {number} cannot be written: {reason}" for number, reason in done.refused]
    if len(lines) > MOST_TOLD:
        lines[MOST_TOLD:] = [f"and {len(lines) - MOST_TOLD} more"]
    bad = {number for number, _ in done.refused}
    if len(bad) < len(faces):
        lines.append(f"--without {ranges(bad).replace(' ', '')} leaves out what cannot be written")
    raise ResultsError("\npost: ".join(lines))


def tell_model(say, model, faces, facts, notes, scale, unit):
    read = counted(len(model.faces), "face")
    if model.n_solids:
        read += f" of {counted(model.n_solids, 'solid')}"
    say(f"{model.path}: {model.kind}" + f", lengths in {model.unit.lower()}" * bool(model.unit)
        + f": {read}")
    for note in [*model.notes, *notes]:
        say(f"  {note}")
    kinds = Counter(one.kind for one in facts.values())
    say(f"  taken: {counted(len(faces), 'face')}: "
        + ", ".join(f"{n} {kind}" for kind, n in kinds.most_common()))
    low, high = box_of(facts)
    say(f"  box {occ.place_text(low, scale)} to {occ.place_text(high, scale)} {unit}")
    number, one = min(facts.items(), key=lambda item: item[1].radius)
    if np.isfinite(one.radius):
        say(f"  smallest radius {one.radius * scale:.4g} {unit} in face {number}")


def tell_conversion(say, done, joints, scale, unit):
    u, v = done.degrees
    text = f"  degrees to {u} x {v}"
    if done.n_reduced:
        deviation, number, place = done.deviation
        text += (f"; reduced in {counted(done.n_reduced, 'face')}, off by at most "
                 f"{deviation * scale:.3g} {unit} in face {number} at "
                 f"{occ.place_text(place, scale)}")
    say(text)
    say(f"  {counted(done.n_curves, 'parameter curve')}, {done.n_made} of them made here")
    text = (f"  {counted(joints.n_shared, 'edge')} between faces, {joints.n_free} of one face "
            "alone")
    if joints.gap_place is not None:
        text += (f"; largest gap {joints.gap * scale:.3g} {unit} between faces "
                 f"{joints.gap_faces[0]} and {joints.gap_faces[1]} at "
                 f"{occ.place_text(joints.gap_place, scale)}")
    say(text)
    if joints.tolerance_place is not None:
        say(f"  largest edge tolerance {joints.tolerance * scale:.3g} {unit} in face "
            f"{joints.tolerance_face} at {occ.place_text(joints.tolerance_place, scale)}")
