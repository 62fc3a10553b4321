"""Sound decks of many features at once: every kind of blank, refined, joined, projected, reduced,
scaled, held, loaded, touched by tools and taken through steps, drawn by chance."""
import dataclasses
import math

DENSITY = 7.85e-9            # all in mm, t, s, N, MPa
FACES = ("XI_MIN", "XI_MAX", "ETA_MIN", "ETA_MAX", "ZETA_MIN", "ZETA_MAX")
SIDES = ("X_MIN", "X_MAX", "Y_MIN", "Y_MAX", "Z_MIN", "Z_MAX")
MATERIALS = (
    "",
    "*PLASTIC, HARDENING=VOCE\n250, 250, 6\n",
    "*PLASTIC, HARDENING=SWIFT\n500, 0.01, 0.2\n*POTENTIAL, TYPE=HILL48\n1.8, 1.5, 2.2\n"
    "*ORIENTATION\n1, 0, 0, 0, 1, 0\n",
    "*PLASTIC, HARDENING=LINEAR\n250, 1000\n*BACK STRESS\n20000, 200\n1500, 10\n",
    "*PLASTIC\n250, 250, 6\n*RATE DEPENDENT, TYPE=COWPER SYMONDS\n40, 5\n"
    "*ADIABATIC HEATING\n0.9, 4.6e8, 20, 20, 1500, 1\n",
    "*PLASTIC, HARDENING=PERFECT\n250\n*POTENTIAL, TYPE=YLD91\n1, 1.1, 0.9, 1, 1, 1, 8\n"
    "*ORIENTATION\n1, 0, 0, 0, 1, 0\n",
    "*HYPERELASTIC, NEO HOOKE\n",
)


@dataclasses.dataclass
class Shape:
    """A blank, and what a deck of it may name."""
    kind: str
    lines: str               # behind the *BLANK line, with the *PATCH that belong to it
    volume: float            # in closed form
    low: tuple               # corners of the box around it
    high: tuple
    faces: tuple = FACES
    patches: tuple = ()      # names, but that of the blank
    is_exact: bool = True    # plane faces: no round-off of curved ones
    takes_merge: bool = True


@dataclasses.dataclass
class Deck:
    text: str
    volume: float            # of the blank
    is_exact: bool
    is_scaled: bool          # *MASS SCALING, STEP: heavier than volume and density say


def new_deck(rng):
    """A deck by chance, small enough to be checked and run within a second."""
    shape = rng.choice(SHAPES)(rng)
    material = rng.choice(MATERIALS)
    lines = [f"*MATERIAL, NAME=m\n*DENSITY\n{DENSITY}\n*ELASTIC\n210000, 0.3\n{material}",
             f"*BLANK, NAME=b, MATERIAL=m, TYPE={shape.kind}{blank_options(rng, shape)}\n",
             shape.lines]
    lines += [refinement(rng, shape)] if rng.random() < 0.25 else []
    lines += ["*AMPLITUDE, NAME=ramp\n0, 0, 1e-6, 1\n"]
    names = [f"t{i + 1}" for i in range(rng.choice((0, 0, 1, 2)))]
    lines += [tool(rng, shape, name) for name in names]
    lines += [contact(rng, shape, name) for name in names]
    lines += [supports(rng, shape)] if rng.random() < 0.6 else []
    lines += [load(rng, shape)] if rng.random() < 0.4 else []
    lines += [start(rng, shape)] if rng.random() < 0.3 else []
    lines += [reduction(rng, shape)] if rng.random() < (0.05 if shape.patches else 0.4) else []
    scaling = ""
    if rng.random() < 0.5:
        scaling = rng.choice(("THICKNESS=4", "STEP=5e-7", "THICKNESS=4, STEP=2e-7", "STEP=1e-12"))
        lines += [f"*MASS SCALING, {scaling}\n"]
    lines += [f"*PROBE, NAME=p\n{numbers(rng.random() for _ in range(3))}\n"] \
        if rng.random() < 0.3 else []
    lines += [extras(rng, shape)]
    lines += [steps(rng, shape, names)]
    return Deck("".join(lines), shape.volume, shape.is_exact, "STEP" in scaling)


def numbers(values):
    return ", ".join(f"{value:.9g}" for value in values)


def degree(rng):
    return rng.choice((1, 1, 2, 2, 2, 2, 3))


def few(rng):
    return rng.choice((1, 1, 1, 2, 3))


# ------------------------------------------------------------------------------------------ blanks

def box_axes(rng, low, high, order="xyz", graded=True):
    """Data lines of a box between two corners."""
    grading = rng.choice((1, 1, 3, 0.2)) if graded else 1
    return "".join(f"{name}, {low['xyz'.index(name)]:.9g}, {high['xyz'.index(name)]:.9g}, "
                   f"{degree(rng)}, {few(rng)}, {grading}\n" for name in order)


def box(rng):
    low = [rng.choice((0, -3, 100)) for _ in range(3)]
    high = [low[0] + rng.choice((8, 30)), low[1] + rng.choice((4, 30)),
            low[2] + rng.choice((1, 2, 0.01))]
    order = "".join(rng.sample("xyz", 3))
    volume = math.prod(h - l for l, h in zip(low, high))
    spacing = "" if rng.random() < 0.7 else ", SPACING=CONTROL POINTS"
    return Shape("BOX" + spacing, box_axes(rng, low, high, order), volume, tuple(low), tuple(high),
                 SIDES, takes_merge=False)


def disk(rng):
    radius, height = rng.choice((5, 40)), rng.choice((1, 2, 20))
    angle = rng.choice((90, 180, 360))
    axis = rng.choice("XYZ")
    core = rng.choice((0.3, 0.5, 0.8))
    lines = (f"0, 0, 0, {radius}, {height}\n{angle}, {rng.choice((2, 2, 3))}, "
             f"{rng.choice((1, 2))}, {rng.choice((1, 2))}, {degree(rng)}, {few(rng)}, {core}\n")
    low, high = round_bounds(radius, height, axis)
    return Shape(rng.choice(("DISK", "BAR")) + f", AXIS={axis}", lines,
                 math.pi*radius**2*height*angle/360, low, high,
                 patches=("CORE", "RIM1", "RIM"), is_exact=False)


def ring(rng):
    inner, height = rng.choice((3, 10)), rng.choice((1, 2, 20))
    outer = inner + rng.choice((0.5, 2, 10))
    angle = rng.choice((360, 360, 360, 180, 90, 37))
    axis = rng.choice("XYZ")
    lines = (f"1, 0, 0, {inner}, {outer}, {height}\n{rng.choice((0, 0, 45))}, {angle}, "
             f"{rng.choice((2, 2, 3))}, {few(rng)}, {few(rng)}, {degree(rng)}, {few(rng)}\n")
    low, high = round_bounds(outer, height, axis)
    return Shape(rng.choice(("RING", "TUBE")) + f", AXIS={axis}", lines,
                 math.pi*(outer**2 - inner**2)*height*angle/360, low, high, is_exact=False)


def round_bounds(radius, height, axis):
    place = "XYZ".index(axis)
    low, high = [-radius]*3, [radius]*3
    low[place], high[place] = 0, height
    return tuple(low), tuple(high)


def cup(rng):
    radius, height, thick, corner = 20, rng.choice((12, 30)), rng.choice((1, 2)), rng.choice((2, 5))
    angle = rng.choice((90, 180, 360))
    axis = rng.choice("XYZ")
    lines = (f"0, 0, 0, {radius}, {height}, {thick}, {corner}\n{angle}, 2, 1, 1, "
             f"{rng.choice((1, 2))}, 1, {degree(rng)}, 1, 0.5\n")
    flat, wide = radius - thick - corner, thick + corner
    volume = math.pi*(flat**2*thick + (radius**2 - (radius - thick)**2)*(height - wide)
                      + flat*math.pi/2*(wide**2 - corner**2) + 2/3*(wide**3 - corner**3))
    low, high = round_bounds(radius, height, axis)
    return Shape(f"CUP, AXIS={axis}", lines, volume*angle/360, low, high,
                 patches=("CORE", "RIM", "CORNER1", "WALL"), is_exact=False)


def boxes(rng):
    """Cells of a grid as patches: a row, an angle, a frame that closes, or what chance leaves."""
    cells = rng.choice((((0, 0), (1, 0)), ((0, 0), (1, 0), (1, 1)),
                        ((0, 0), (0, 1), (1, 1), (1, 0)),
                        tuple((i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)),
                        ((0, 0), (1, 1)), ((0, 0), (2, 0))))
    sizes = [(degree(rng), few(rng)) for _ in range(3)]
    lines = ""
    for n, (i, j) in enumerate(cells):
        lines += f"*PATCH, NAME=c{n + 1}, TYPE=BOX\n"
        for name, at, size, (p, m) in zip("xyz", (i, j, 0), (10, 6, 1), sizes):
            if rng.random() < 0.03:
                m += 1
            lines += f"{name}, {size*at}, {size*(at + 1)}, {p}, {m}\n"
    return Shape("PATCHES", lines, 60*len(cells), (0, 0, 0),
                 (10*(1 + max(i for i, _ in cells)), 6*(1 + max(j for _, j in cells)), 1),
                 patches=tuple(f"c{n + 1}" for n in range(len(cells))))


def polygon(rng):
    """A closed prism of straight walls as one patch of listed points, or an open part of it; a wall
    that goes to the axis makes a face a line."""
    n = rng.choice((4, 5, 8))
    n_open = rng.choice((n, n, n - 1))
    inner, outer, height = rng.choice((4, 4, 0)), 6, rng.choice((2, 10))
    turn = rng.random()
    axes = ((n_open, 1), (1, 1), (1, 1))
    stands = rng.random() < 0.5        # axis 2 along the height and 3 outward, or inward and up
    points = []
    for k in range(2):
        for j in range(2):
            for i in range(n_open + 1):
                angle = turn + 2*math.pi*(i % n)/n
                r = (inner, outer)[k] if stands else (outer, inner)[j]
                points.append((r*math.cos(angle), r*math.sin(angle), height*(j if stands else k)))
    lines = ""
    for axis, (m, p) in enumerate(axes):
        knots = [0]*(p + 1) + list(range(1, m)) + [m]*(p + 1)
        lines += f"*KNOTS, PATCH=b, AXIS={axis + 1}, DEGREE={p}\n{numbers(knots)}\n"
    lines += "*CONTROL POINTS, PATCH=b\n" + "".join(numbers(point) + "\n" for point in points)
    area = n_open/2*math.sin(2*math.pi/n)*(outer**2 - inner**2)
    return Shape("NURBS", lines, area*height, (-outer, -outer, 0), (outer, outer, height))


SHAPES = (box, box, disk, ring, ring, cup, boxes, boxes, polygon)


def blank_options(rng, shape):
    rule = rng.choice(4*("",) + 2*(", RULE=FULL", ', RULE="3,3,2x2"') + (", RULE=REDUCED",))
    projection = rng.choice(("", "", ", PROJECTION=BBAR", ", PROJECTION=ANS"))
    if projection:
        projection += rng.choice(("", "", "", ", SPACE=SMOOTH", ", SPACE=SMOOTH",
                                  ', SAMPLES="2,2,1"'))
    merge = rng.choice(7*("",) + 3*(", MERGE=NO", ", TOLERANCE=1e-3") + (", TOLERANCE=0.7",))
    return rule + projection + (merge if shape.takes_merge else "")


def refinement(rng, shape):
    text = ""
    for _ in range(rng.choice((1, 1, 2))):
        patch = rng.choice(shape.patches) if shape.patches and shape.kind == "PATCHES" else "b"
        how = rng.choice(("SUBDIVIDE=2", "ELEVATE=1", "SUBDIVIDE=2, ELEVATE=1"))
        text += f"*REFINE, PATCH={patch}, AXIS={rng.randint(1, 3)}, {how}\n"
    return text


# -------------------------------------------------------------------------------- what acts on them

def middle(shape):
    return [(low + high)/2 for low, high in zip(shape.low, shape.high)]


def extent(shape):
    return [high - low for low, high in zip(shape.low, shape.high)]


def tool(rng, shape, name):
    """A plane, cylinder or ball beside the blank along a coordinate, as wide as it or wider."""
    across = rng.randrange(3)
    size, centre = extent(shape), middle(shape)
    a, b = [axis for axis in range(3) if axis != across]
    kind = rng.choice(("PLANE", "PLANE", "CYLINDER", "SPHERE"))
    gap = rng.choice((0.0, 0.1, 0.1, 5.0))
    sign = rng.choice((-1, 1))
    wide = rng.choice((1.0, 1.2, 3.0))
    # The normal of the plane is a x b: along -y for a = x, b = z.
    is_positive = kind != "PLANE" or (across == 1) == (sign > 0)
    if rng.random() < 0.05:
        is_positive = not is_positive
    side = ", SIDE=POSITIVE" if is_positive else ", SIDE=NEGATIVE"
    at = list(centre)
    reach = size[across]/2 + gap
    if kind == "PLANE":
        at[across] += sign*reach
        for axis in (a, b):
            at[axis] -= wide*size[axis]/2
        edges = [[0.0]*3, [0.0]*3]
        edges[0][a], edges[1][b] = wide*size[a], wide*size[b]
        lines = f"{numbers(at)}\n{numbers(edges[0])}\n{numbers(edges[1])}\n"
    else:
        radius = rng.choice((1, 5, 20))
        at[across] += sign*(reach + radius)
        if kind == "SPHERE":
            lines = f"{numbers(at + [radius])}\n"
        else:
            axis = [0.0]*3
            at[b] -= wide*size[b]/2
            axis[b] = wide*size[b]
            lines = f"{numbers(at + axis)}\n{radius}\n"
    text = f"*TOOL, NAME={name}, TYPE={kind}{side}\n{lines}"
    if rng.random() < 0.2:
        way = [0.0]*3
        way[across] = -sign
        text += f"*TOOL PLACEMENT, TOOL={name}, CLEARANCE=0.05\n{numbers(way)}\n"
    return text


def contact(rng, shape, name):
    options = rng.choice(("", "", f", FACE={rng.choice(shape.faces)}"))
    options += rng.choice(("", ", POINTS=KNOT", ", POINTS=GREVILLE", ', COUNT="2,4"'))
    options += rng.choice(("", ", FRICTION=0.1", ", STIFFNESS=1000", ", DAMPING=0.2"))
    return f"*CONTACT PAIR, TOOL={name}{options}\n"


def place(rng, shape):
    return rng.choice(shape.faces + ("ALL",))


def supports(rng, shape):
    text = ""
    name = place(rng, shape)
    if rng.random() < 0.4:
        name = "part"
        text = f"*SET, NAME=part\n{' '.join(rng.sample(shape.faces, rng.choice((1, 2))))}\n"
    text += "*BOUNDARY, TYPE=VELOCITY\n"
    for _ in range(rng.choice((1, 2))):
        what = rng.choice(("XSYMM", "YSYMM", "ZSYMM", "PINNED", "1, 2", "3, 3, 100"))
        text += f"{name}, {what}\n"
        name = place(rng, shape)
    return text


def load(rng, shape):
    value = numbers(rng.choice((0, 0, 5, -20)) for _ in range(3))
    return rng.choice((f"*PRESSURE\n{rng.choice(shape.faces)}, 1\n",
                       f"*TRACTION, AMPLITUDE=ramp\n{rng.choice(shape.faces)}, {value}\n",
                       f"*GRAVITY\n{value}\n"))


def start(rng, shape):
    return rng.choice((
        f"*INITIAL CONDITIONS, TYPE=VELOCITY\n{place(rng, shape)}, {rng.randint(1, 3)}, 1000\n",
        f"*INITIAL CONDITIONS, TYPE=ROTATING VELOCITY\nALL, 0, 0, 100, 0, 0, 0\n"))


def reduction(rng, shape):
    axis = rng.choice(("", "", ", AXIS=X", ", AXIS=Y", ", AXIS=Z"))
    size = rng.choice(extent(shape))
    width = rng.choice(("", "", f", WIDTH={size/7:.9g}", f", WIDTH={size:.9g}", ", WIDTH=1e-7"))
    return f"*REDUCE, TYPE=PLANE STRAIN{axis}{width}\n"


def extras(rng, shape):
    text = ""
    if rng.random() < 0.2:
        text += "*BULK VISCOSITY\n" + rng.choice(("0, 0", "0.2, 1.2")) + "\n"
    if rng.random() < 0.15:
        text += "*DAMPING, ALPHA=500\n"
    if rng.random() < 0.1:
        low, high = shape.low, shape.high
        text += (f"*DRAW BEAD, NAME=bead, WIDTH={extent(shape)[0]/4:.9g}\n100, 10\n"
                 f"{numbers([middle(shape)[0], low[1], high[2]])}\n"
                 f"{numbers([middle(shape)[0], high[1], high[2]])}\n")
    return text


def steps(rng, shape, tools):
    """One step, or several that take supports, loads and tools away and bring others."""
    options = rng.choice(5*("",) + 2*(", SAFETY=0.5",) + (", STABLE STEP=ELEMENT",))
    seconds = rng.choice(("1e-7", "5e-7", "2e-6"))
    last = f"*DYNAMIC, EXPLICIT{options}\n{seconds}\n"
    last += rng.choice(("", "", "*OUTPUT, FRAMES=2, HISTORY=3\n",
                        "*OUTPUT, FRAMES=1, HISTORY=2, FIELDS=WEAR\n",
                        "*OUTPUT, FRAMES=1, HISTORY=2, CELLS=BEZIER\n"))
    if rng.random() < 0.6:
        return last
    text = ""
    for n in range(rng.choice((1, 2, 3))):
        text += f"*STEP, NAME=s{n}\n"
        if tools and rng.random() < 0.5:
            text += (f"*TOOL MOTION, TOOL={rng.choice(tools)}, AMPLITUDE=ramp\n"
                     f"{numbers(rng.choice((0, 0, 100)) for _ in range(3))}\n")
        if n > 0:
            text += rng.choice(("", supports(rng, shape).replace("part", f"part{n}"),
                                "*BOUNDARY, OP=NEW\n", load(rng, shape)))
            if tools and rng.random() < 0.3:
                text += f"*MODEL CHANGE, REMOVE\n{rng.choice(tools)}\n"
        text += last + "*END STEP\n"
    return text
