"""Which faces of a file become the tool: by number, colour, layer, name or what is seen."""
import difflib
import re

from post.results import ResultsError

# Colours by name, each with the hues it covers (degrees), for colours that are bright enough.
HUES = {"red": (345, 15), "orange": (15, 45), "yellow": (45, 70), "green": (70, 165),
        "cyan": (165, 195), "blue": (195, 260), "purple": (260, 290), "magenta": (290, 345)}
GREYS = {"black": (0.0, 0.15), "grey": (0.15, 0.9), "gray": (0.15, 0.9), "white": (0.9, 1.01)}
LEAST_COLOUR = 0.15       # of saturation times value: less is grey
DIRECTIONS = {f"{sign}{axis}": tuple((1.0 if sign == "+" else -1.0) * (axis == other)
                                     for other in "xyz")
              for sign in "+-" for axis in "xyz"}


def add_choice_arguments(command):
    choice = command.add_argument_group("which faces", "all of them if none of these is given; "
                                        "faces must fit every option given")
    choice.add_argument("--faces", metavar="LIST", help="numbers of --list, such as 3,5-9")
    choice.add_argument("--without", metavar="LIST", help="numbers of faces to leave out")
    choice.add_argument("--color", "--colour", dest="colour", metavar="LIST",
                        help="colours such as #ff0000, or red, green, grey, none, ...")
    choice.add_argument("--layer", metavar="LIST", help="layers; of IGES files, levels")
    choice.add_argument("--name", metavar="LIST",
                        help="names of faces or of parts around them; * stands for any text")
    choice.add_argument("--seen-from", dest="seen_from", metavar="DIRECTION",
                        help="faces that are seen from +x, -x, +y, -y, +z, -z or X,Y,Z, walls "
                             "along the view among them")


def chosen(model, arguments):
    """The faces that fit, but for what is seen. All that is wrong is told together."""
    faults, faces = [], model.faces
    known = {face.number for face in faces}
    for option in ("faces", "without"):
        text = getattr(arguments, option)
        if text:
            numbers = numbers_of(text, known, f"--{option}", faults)
            faces = [face for face in faces if (face.number in numbers) == (option == "faces")]
    for option, fits, words_of in (("colour", is_colour, colours_of),
                                   ("layer", is_layer, layers_of), ("name", is_name, names_of)):
        text = getattr(arguments, option)
        if text:
            faces = matching(faces, model.faces, text, "color" if option == "colour" else option,
                             fits, words_of, faults)
    if arguments.seen_from:
        try:
            direction(arguments.seen_from)
        except ResultsError as fault:
            faults.append(str(fault))
    if not faces and not faults:
        faults.append("no face fits all options together")
    if faults:
        raise ResultsError("; ".join(faults))
    return faces


def numbers_of(text, known, option, faults):
    numbers = set()
    for word in text.split(","):
        found = re.fullmatch(r"\s*[Ff]?(\d+)\s*(?:-\s*[Ff]?(\d+)\s*)?", word)
        if not found:
            faults.append(f"{option}: '{word.strip()}' is no number or range such as 5-9")
            continue
        first, last = int(found[1]), int(found[2] or found[1])
        one = range(first, last + 1)
        missing = [n for n in (first, last) if n not in known] or not one
        if missing:
            faults.append(f"{option}: '{word.strip()}' is beyond the faces 1 to {max(known)}"
                          if one else f"{option}: '{word.strip()}' runs backwards")
            continue
        numbers.update(one)
    return numbers


def matching(faces, everything, text, option, fits, words_of, faults):
    """Faces that fit one of the words; each word must fit some face of the file."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    for word in words:
        if any(fits(face, word) for face in everything):
            continue
        there = list(dict.fromkeys(name for face in everything for name in words_of(face)))
        near = difflib.get_close_matches(word, there, 1, 0.6)
        listed = ", ".join(there[:10]) + (f" and {len(there) - 10} more" if there[10:] else "")
        faults.append(f"--{option}: no face fits '{word}'"
                      + (f"; did you mean {near[0]}?" if near else "")
                      + (f"; there are {listed}" if there else f"; faces have no {option} here"))
    return [face for face in faces if any(fits(face, word) for word in words)]


def is_colour(face, word):
    """The same colour to a few steps of 255, or one that the word names."""
    word, colour = word.lower(), face.traits.colour
    if word == "none" or not colour:
        return (word == "none") == (not colour)
    wanted = re.fullmatch(r"#?([0-9a-f]{6})", word)
    values = [int(colour[i:i + 2], 16) for i in (1, 3, 5)]
    if wanted:
        others = [int(wanted[1][i:i + 2], 16) for i in (0, 2, 4)]
        return max(abs(a - b) for a, b in zip(values, others)) <= 3
    return word.replace("gray", "grey") == colour_name(values).replace("gray", "grey")


def colour_name(values):
    """The name of red, green and blue from 0 to 255."""
    red, green, blue = (value / 255 for value in values)
    high, low = max(red, green, blue), min(red, green, blue)
    if high - low < LEAST_COLOUR:
        return next(name for name, (a, b) in GREYS.items() if a <= high < b)
    if high == red:
        hue = 60 * (green - blue) / (high - low) % 360
    elif high == green:
        hue = 60 * (blue - red) / (high - low) + 120
    else:
        hue = 60 * (red - green) / (high - low) + 240
    return next(name for name, (a, b) in HUES.items()
                if (a <= hue < b if a < b else hue >= a or hue < b))


def colours_of(face):
    return [face.traits.colour] if face.traits.colour else []


def is_layer(face, word):
    return face.traits.layer.lower() == word.lower()


def layers_of(face):
    return [face.traits.layer] if face.traits.layer else []


def is_name(face, word):
    pattern = ".*".join(re.escape(part) for part in word.lower().split("*"))
    return any(re.fullmatch(pattern, name.lower()) for name in face.traits.names)


def names_of(face):
    return face.traits.names[::-1]


def direction(text):
    """The unit vector towards the eye."""
    if text.lower() in DIRECTIONS:
        return DIRECTIONS[text.lower()]
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    length = sum(value**2 for value in values)**0.5
    if len(values) != 3 or not 0 < length < float("inf"):
        raise ResultsError(f"--seen-from: '{text}' is no direction such as +z or 0,0,1")
    return tuple(value / length for value in values)
