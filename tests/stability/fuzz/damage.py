"""Ways to damage a file: of any kind, and such that know what the file should hold."""
import dataclasses
import io
import random
import re
import struct
import typing

try:
    import h5py
    import numpy
except ImportError:
    h5py = numpy = None

LARGEST = 200_000           # bytes of a damaged file

NUMBERS = ["0", "-1", "1", "2", "3", "5", "7", "99999999", "2147483647", "2147483648",
           "-2147483648", "1.D308", "1.E400", "1.D-320", "-0.", "NaN", "Inf", "1e", ".", "1.2.3",
           "", "+", "1000000"]


def any_bytes(data, rng, _):
    """Change, insert, remove or repeat a few bytes."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 5, 20))):
        at = rng.randrange(len(data) + 1)
        size = rng.choice((1, 1, 2, 8, 72, 80, 400))
        kind = rng.randrange(5)
        if kind == 0 and at < len(data):
            data[at] = rng.randrange(256)
        elif kind == 1:
            data[at:at] = bytes(rng.choice(b"0123456789.,;-+DEHT \n\r") for _ in range(size))
        elif kind == 2:
            del data[at:at + size]
        elif kind == 3:
            data[at:at] = data[at:at + size] * rng.choice((1, 1, 2, 20))
        else:
            del data[at:]
    return bytes(data[:LARGEST])


def any_number(data, rng, _):
    """Put strange numbers in the place of some."""
    places = [match.span() for match in re.finditer(rb"[-+.0-9DE]+", data)]
    for first, last in sorted(rng.sample(places, min(len(places), rng.choice((1, 1, 2, 4)))),
                              reverse=True):
        data = data[:first] + rng.choice(NUMBERS).encode() + data[last:]
    return data


def any_lines(data, rng, other):
    """Move, repeat, drop lines or take some of another file."""
    lines, more = data.split(b"\n"), other.split(b"\n")
    for _ in range(rng.choice((1, 1, 3))):
        at, to = rng.randrange(len(lines) + 1), rng.randrange(len(lines) + 1)
        piece = lines[at:at + rng.choice((1, 1, 2, 10))]
        kind = rng.randrange(4)
        if kind == 0:
            lines[to:to] = piece
        elif kind == 1:
            del lines[at:at + len(piece)]
        elif kind == 2:
            lines[at:at + len(piece)] = piece[::-1]
        else:
            first = rng.randrange(len(more))
            lines[to:to] = more[first:first + rng.choice((1, 2, 10))]
    return b"\n".join(lines)[:LARGEST]


# ---------------------------------------------------------------------------------------- IGES

def whole_iges(data, rng):
    """Columns, sequence numbers and counts made right again, so that damage reaches further in."""
    counts, lines = dict.fromkeys(b"SGDP", 0), []
    for line in data.replace(b"\r", b"").split(b"\n"):
        letter = line[72:73] if line[72:73] and line[72:73] in b"SGDP" else None
        if letter is None:
            continue
        counts[letter[0]] += 1
        lines.append((letter, line[:72].ljust(72)))
    lines.sort(key=lambda line: b"SGDP".index(line[0]))
    if counts[ord("D")] % 2 and rng.random() < 0.9:
        lines.append((b"D", b" " * 72))
        lines.sort(key=lambda line: b"SGDP".index(line[0]))
        counts[ord("D")] += 1
    numbers, out = dict.fromkeys(b"SGDP", 0), []
    for letter, text in lines:
        numbers[letter[0]] += 1
        out.append(text + letter + b"%7d" % numbers[letter[0]])
    last = b"".join(b"%c%7d" % (letter, counts[letter]) for letter in b"SGDP")
    out.append(last.ljust(72) + b"T      1")
    return b"\n".join(out) + b"\n"


def damaged_columns(data, rng, _):
    """Numbers of an IGES file exchanged within their columns."""
    lines = data.split(b"\n")
    for _ in range(rng.choice((1, 1, 2, 4))):
        at = rng.randrange(len(lines))
        line, letter = lines[at], lines[at][72:73]
        if letter == b"D":
            field = 8 * rng.randrange(9)
            value = rng.choice(NUMBERS[:9] + [str(2 * rng.randrange(30) + 1), "124", "120", "128",
                                              "102", "100", "122", "126", "144"]).encode()
            lines[at] = line[:field] + value[:8].rjust(8) + line[field + 8:]
        elif letter in b"GP" and letter:
            width = 64 if letter == b"P" else 72
            lines[at] = any_number(line[:width], rng, None)[:width].ljust(width) + line[width:]
    return b"\n".join(lines)


# --------------------------------------------------------------------------------------- decks

PIECES = [b"<", b">", b"<1/0>", b"<n>", b"<sqrt(-1)>", b"<2**2**2**2**2>", b"<" + b"(" * 3000,
          b"<" + b"-" * 3000 + b"1>", b'"', b"'", b"=", b",", b",,,,", b"*", b"**", b"$", b"#",
          b"\xff", b"\t", b"\r", b"x" * 5000, b"1," * 3000, b", INPUT=input", b", INPUT=.",
          b"*INCLUDE, INPUT=input\n", b"*END\n", b"*STEP\n", b"*END STEP\n", b"*PARAMETER\n",
          b"1e308", b"<1e308*10>", b"-1e-320", b"ALL", b"XI_MIN"]
NAME, NUMBER = rb"[A-Za-z_][A-Za-z_0-9]*", rb"(?<![A-Za-z_0-9.])[-+]?[0-9.]+(?:[eEdD][-+]?\d+)?"


def damaged_words(data, rng, other):
    """Words and numbers exchanged with others of this or another deck, or with pieces that mean
    something in a deck."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        pattern = rng.choice((NAME, NAME, NUMBER, NUMBER, rb"\n"))
        places = list(re.finditer(pattern, data))
        words = re.findall(pattern, rng.choice((data, other)))
        if not places or not words:
            continue
        first, last = rng.choice(places).span()
        word = rng.choice((rng.choice(words), rng.choice(words), rng.choice(PIECES),
                           rng.choice(NUMBERS).encode(), b""))
        if rng.random() < 0.3:
            word = data[first:last] + word
        data = data[:first] + word + data[last:]
    return data[:LARGEST]


def damaged_blocks(data, rng, other):
    """A keyword with its data moved, repeated, left out, or taken from another deck."""
    blocks, more = re.split(rb"(?m)^(?=\*[A-Za-z])", data), re.split(rb"(?m)^(?=\*[A-Za-z])", other)
    kind, at = rng.randrange(4), rng.randrange(len(blocks))
    if kind == 0:
        blocks.insert(rng.randrange(len(blocks) + 1), blocks[at])
    elif kind == 1:
        blocks.insert(at, rng.choice(more))
    elif kind == 2:
        del blocks[at]
    else:
        blocks.insert(rng.randrange(len(blocks)), blocks.pop(at))
    return b"".join(blocks)[:LARGEST]


# --------------------------------------------------------------------------------- checkpoints

MARK = b"igaform checkpoint 1 "
LAST = len(MARK) + 57       # bytes of the last line


def sealed(state, result):
    """A checkpoint of both parts with the checksum of src/core/checksum.f90."""
    data = state + result
    prime = 4294967291
    words = numpy.frombuffer(data.ljust(-(-len(data) // 4) * 4, b"\0"), "<u4").astype(numpy.uint64)
    first = (numpy.cumsum(words) + 1) % prime
    sums = (int(first[-1]) if len(first) else 1, int(first.sum()) % prime)
    return data + MARK + b"%20d%20d%08X%08X\n" % (len(state), len(result), *sums)


def parts(data):
    """Both parts of a checkpoint, or of what is left of one."""
    try:
        n_state, n_result = struct.unpack("20s20s", data[len(MARK) - LAST:][:40])
        n_state, n_result = int(n_state), int(n_result)
    except (struct.error, ValueError):
        return data, b""
    return data[:n_state], data[n_state:n_state + n_result]


def damaged_state(data, rng, _):
    """Numbers, shapes, types and names of an HDF5 file that stays one."""
    state, result = parts(data)
    memory = io.BytesIO(state)
    try:
        with h5py.File(memory, "r+", libver="latest") as file:
            for _ in range(rng.choice((1, 1, 2, 5))):
                change_object(file, rng)
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, MemoryError):
        return data
    return sealed(memory.getvalue(), result)


def change_object(file, rng):
    """One change of an open HDF5 file."""
    strange = (0.0, -1.0, 1e300, -1e300, numpy.nan, numpy.inf, 2**31, 2**53, 0.5, 1e-320)
    names = []
    file.visititems(lambda name, item: names.append(name) if hasattr(item, "dtype") else None)
    if not names or rng.random() < 0.15:
        values = ("", "any" * 1000, 3, [1.5] * 50, ["a", "bc"], b"any\0any",
                  h5py.Empty("f"), numpy.bytes_("any"), numpy.array([[b"any"] * 40] * 40))
        file.attrs[rng.choice(("program", "deck", "deck_file"))] = rng.choice(values)
        return
    name = rng.choice(names + ["names"])
    dataset = file[name]
    kind = rng.randrange(8)
    if kind <= 2 and dataset.dtype.kind == "f" and 0 < dataset.size < 2**20:
        values = dataset[()]
        at = rng.randrange(values.size) if rng.random() < 0.7 else slice(None)
        values.flat[at] = rng.choice(strange)
        dataset[()] = values
        return
    del file[name]
    if name == "names" or kind == 3:
        text = rng.choice(("", "\n" * 50, "no end", "run/instant\n" * 2, "../names\n", "x" * 70000,
                           "/state\n", "run\n", "nothing\n"))
        file[name] = rng.choice((text, numpy.bytes_(text), [text, text]))
    elif kind == 4:
        file[name] = numpy.zeros(rng.choice((0, 1, 2, 9, 1000, (3, 3), (1,) * 20, (0, 5))))
    elif kind == 5:
        file[name] = rng.choice((3, numpy.zeros((), "i1"), h5py.Empty("f8"),
                                 numpy.zeros(4, [("a", "f4"), ("b", "S9")]), [b"1", b"2"],
                                 numpy.zeros(3, "f4"), numpy.zeros(3, ">f8")))
    elif kind == 6:
        file[name] = rng.choice((h5py.SoftLink("/" + name), h5py.SoftLink("/state"),
                                 h5py.ExternalLink("input", "/"), h5py.ExternalLink("none", "/a")))
    else:
        file.create_dataset(name, (rng.choice((1, 2**20, 2**33, 2**40)),), "f8", chunks=(1024,),
                            fillvalue=rng.choice(strange))


def damaged_inside(data, rng, _):
    """Any damage to the HDF5 file, under the right checksum."""
    state, result = parts(data)
    return sealed(any_bytes(state, rng, None), result)


def damaged_lengths(data, rng, _):
    """Lengths that are not those of the parts, under the right checksum."""
    state, result = parts(data)
    cut = rng.choice((0, 1, 8, len(state) // 2, len(state) + 1))
    whole = sealed(state[:cut], state[cut:] + result)
    if rng.random() < 0.5:
        return whole
    lengths = rng.choice((b"%20d%20d" % (-len(state), 2 * len(state)), b"%20d%20d" % (2**62, 2**62),
                          b"x" * 40, b"%40d" % 7, b"%20d" % (len(state) + len(result)) + b" " * 20))
    return whole[:len(whole) - LAST + len(MARK)] + lengths + whole[-17:]


@dataclasses.dataclass
class Target:
    """What to do besides the general damage, and how to mend what hides the inside of a file."""
    changes: list                        # of (data, rng, another seed), damaged data
    endings: tuple = ("",)               # of the names of seeds
    mend: typing.Callable = None         # (data, rng), mended data
    decks: tuple = ()                    # read instead of the file, which they name
    is_written: bool = False             # the program writes the seed, of a deck
    megabytes: int = 400                 # for one file, above what the program takes at its start
    seconds: int = 10                    # of the processor for one file


MATERIAL = """*MATERIAL, NAME=steel
*DENSITY
1
*ELASTIC
1, 0
"""

PATH = MATERIAL + """*MATERIAL TEST, NAME=a, MATERIAL=steel, TYPE=PATH, INPUT=input
"""

POINTS = MATERIAL + """*BLANK, MATERIAL=steel
x, 0, 2, 2, 2
y, 0, 2, 2, 1
z, 0, 1, 2, 1
*TOOL, NAME=punch, TYPE=SURFACE
*KNOTS, PATCH=punch, AXIS=1, DEGREE=2
0, 0, 0, 1, 1, 1
*KNOTS, PATCH=punch, AXIS=2, DEGREE=1
0, 0, 1, 1
*CONTROL POINTS, PATCH=punch, INPUT=input
*CONTACT PAIR, TOOL=punch
*DYNAMIC, EXPLICIT
1
"""

TARGETS = {
    "iges": Target([damaged_columns], mend=whole_iges),
    # Ten million elements are allowed, and take their time where all is checked.
    "deck": Target([damaged_words, damaged_blocks], endings=(".key",), megabytes=4000, seconds=60),
    "csv": Target([damaged_words], decks=(PATH, POINTS)),
    "checkpoint": Target([damaged_state, damaged_inside, damaged_lengths], is_written=True),
}


def damaged(target, seeds, rng):
    """A new file of one to three kinds of damage."""
    data = rng.choice(seeds)
    kinds = [any_bytes, any_number, any_lines] + 3 * target.changes
    for _ in range(rng.choice((1, 1, 2, 3))):
        data = rng.choice(kinds)(data, rng, rng.choice(seeds))
    return target.mend(data, rng) if target.mend and rng.random() < 0.7 else data
