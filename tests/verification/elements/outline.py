"""Shells and solids inside outlines that cut their elements.

A strip in tension has the same stress everywhere, whatever slivers its edges leave. What is
symmetric stays so, under contact too. Free disks have
the frequencies of plates (A. W. Leissa, Vibration of Plates, NASA SP-160, 1969, sec. 2.1.3), worked
out here from the frequency equation of two nodal diameters; masses summed by rows give an error
that falls with the square of the elements. Solids shear and twist at the edge, as plates do not:
0.16 % of the frequency, a third of that at half of the thickness. Loads act on what is inside. A
chain of forming, trimming, springback and a second cut keeps its balances, and has the same bits
for any number of threads and when it is taken up again; solids come to the shape of shells.
"""
import os

import h5py
import numpy as np
from static_runs import same_bits
from suite import Case

YOUNG, POISSON, DENSITY, STRETCH = 210000.0, 0.3, 7.85e-9, 1e-3
RADIUS, THICKNESS = 50.0, 1.0
SHELLS, SOLIDS = '"SHELL"', '"SOLID"'
ANGLES = (np.arange(400) + 0.5) * np.pi / 400


def bessel(n, x):
    """J_n and I_n by their integrals, whose sums converge at once."""
    return (np.cos(n * ANGLES - x * np.sin(ANGLES)).mean(),
            (np.exp(x * np.cos(ANGLES)) * np.cos(n * ANGLES)).mean())


def lack(x, n=2):
    """Determinant of the free edge for n nodal diameters, w = A J_n(x r) + B I_n(x r) at r = 1: the
    bending moment and the Kirchhoff shear force vanish."""
    (j, i), (jp, ip), (jm, im) = (bessel(k, x) for k in (n, n + 1, n - 1))
    dj, di = 0.5 * x * (jm - jp), 0.5 * x * (im + ip)           # derivatives by r
    nu, rows = POISSON, []
    for value, slope, sign in ((j, dj, -1), (i, di, 1)):
        bend = sign * x**2 * value - slope + n**2 * value       # w'' from the equation of J or I
        moment = bend + nu * (slope - n**2 * value)
        shear = sign * x**2 * slope - (1 - nu) * n**2 * (slope - value)
        rows.append((moment, shear))
    return rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]


def frequency_of_disk():
    """The lowest one, of two nodal diameters [1/time]."""
    low, high = 2.0, 2.6
    for _ in range(60):
        mid = 0.5 * (low + high)
        low, high = (mid, high) if lack(low) * lack(mid) > 0 else (low, mid)
    rigidity = YOUNG * THICKNESS**3 / (12 * (1 - POISSON**2))
    return (low / RADIUS)**2 * np.sqrt(rigidity / (DENSITY * THICKNESS)) / (2 * np.pi)


def strips(case, element):
    """Uniform tension of strips whose edges lie anywhere in their elements."""
    stress = YOUNG * np.log1p(STRETCH)
    for p, low in ((2, 2.37), (2, 0.0001), (2, 3.6), (2, 3.99), (2, 7.9999), (3, 3.9), (4, 2.37)):
        run = case.run("outline_strip", p=p, low=low, element=element)
        values = run.fields["mises"]
        values = values[np.isfinite(values)]
        case.deviation(f"stress of the strip, {element}, degree {p}, edge at {low}: farthest from "
                       "its value", np.abs(values / stress - 1).max(), 2e-6)


def mirrored(case, deck, element, **settings):
    """A square with a hole in its middle, pulled at all sides, or a disk, pressed all over, equals
    its mirror images by the axes and by the line between them, whatever elements are cut."""
    run = case.run(deck, element=element, **settings)
    fields = {name: run.fields[name] for name in ("thinning", "mises", "major_strain")}
    fields["displacement"] = run.points - run.start
    is_left = run.fields["edge_distance"] > 0
    key = np.round(run.start, 6) + 0.0
    order = np.lexsort(key.T)
    points = run.at_points
    is_wrong = np.isnan(points["stress"][..., 0]) != (points["reference_volume"] == 0)
    case.deviation(f"points of integration that are NaN and not cut away, or the other way "
                   f"round, {deck}, {element}, {settings}", np.count_nonzero(is_wrong), 0)
    if deck == "outline_hole" and element == SHELLS:
        follow_strains(case, points, settings)
    worst = 0.0
    for matrix in (np.diag([-1, 1, 1]), np.diag([1, -1, 1]), np.eye(3)[[1, 0, 2]]):
        image = np.lexsort((key @ matrix + 0.0).T)
        for values in fields.values():
            turned = values @ matrix if values.ndim == 2 else values
            apart = np.abs(turned[image] - values[order])[is_left[order]]
            worst = max(worst, apart.max() / np.abs(values[is_left]).max())
    case.deviation(f"fields of {deck}, {element}, {settings}, against those of its mirror images",
                   worst, 2e-8)


def follow_strains(case, points, settings):
    """Principal stresses in plane stress by Hooke's law, from the strains of the same points."""
    stress, strain = (points[name].reshape(-1, n) for name, n in (("stress", 6),
                                                                  ("principal_strain", 2)))
    xx, yy, xy = stress[np.isfinite(stress[:, 0])][:, [0, 1, 3]].T
    radius = np.hypot((xx - yy) / 2, xy)
    found = np.stack([(xx + yy) / 2 + radius, (xx + yy) / 2 - radius], axis=1)
    strain = strain[np.isfinite(strain[:, 0])]
    due = YOUNG / (1 - POISSON**2) * (strain + POISSON * strain[:, ::-1])
    case.deviation(f"stresses at the points of a square with a hole, {settings}, against Hooke's "
                   "law for their strains", np.abs(found - due).max() / found.max(), 3e-4)


def loads(case, element):
    """Pressure, traction and gravity on a disk give it the momentum of the area inside."""
    run = case.run("outline_disk", pressure=1e-3, traction=1e-3, element=element)
    area = np.pi * RADIUS**2
    time = run.time()[-1] + 0.5 * run.history["dt"][-1]      # of the velocities
    impulse = 1e-3 * area * time
    weight = 1e3 * DENSITY * THICKNESS * area * time
    for axis, value, name in ((0, impulse, "traction"), (1, weight, "gravity"),
                              (2, -impulse, "pressure")):
        case.error(f"momentum that {name} gives to a disk, {element}",
                   run.history["momentum"][-1][axis], value, 1e-5)


def pieces(case):
    """Two disks that a trim leaves, released by a static step: no stress stays, and the log names
    what the trim takes away from the rest of the deck."""
    run = case.run("trim_pieces")
    before = YOUNG * 2.7e-2 / 60                    # of the mean strain, at least
    case.deviation("stress that stays in two pieces, over that before",
                   np.nanmax(run.fields["mises"]) / before, 0.02)
    with open(os.path.join(case.out, "outline_trim_pieces.log"), encoding="utf-8") as file:
        log = file.read()
    case.between("components held, 6 for each piece", log.count("static     12 components"), 1, 1)
    for words in ("*BOUNDARY: the set X_MIN", "*PRESSURE: the set end",
                  "*HISTORY POINT: the history point edge"):
        case.between(f"reported: {words}",
                     log.count(f"{words}, which lies in what *TRIM cuts away"), 1, 1)


def flight(case, element):
    """A sheet of 60 x 30 is trimmed in flight to a disk of radius 11: mass, momentum and kinetic
    energy are those of the area inside."""
    run = case.run("trim_flight", element=element)
    speed = np.array([3000.0, -1000.0, 4000.0])
    for what, area, at in (("sheet", 1800.0, 0), ("disk", np.pi * 11.0**2, -1)):
        mass = DENSITY * THICKNESS * area
        momentum = run.history["momentum"][at]
        case.deviation(f"momentum of the flying {what}, {element}",
                       np.abs(momentum / (mass * speed) - 1).max(), 3e-6)
        case.error(f"kinetic energy of the flying {what}, {element}",
                   run.history["kinetic_energy"][at], mass * speed @ speed / 2, 3e-6)
    place, volume = (run.at_points[f"reference_{name}"] for name in ("position", "volume"))
    apart = ((place - np.average(place, axis=(0, 1, 2), weights=volume))[..., :2]**2).sum(-1)
    case.error(f"volume of the points of the disk, {element}", volume.sum(), THICKNESS * area, 3e-6)
    case.error(f"mean square of their distance from its middle, {element}",
               np.average(apart, weights=volume), 11.0**2 / 2, 3e-6)
    case.deviation(f"energy balance across the trim in flight, {element}",
                   np.abs(run.history["energy_error"]).max(), 1e-9)


def disks(case, element, exact):
    """Sizes of elements and errors of the lowest frequency."""
    sizes, errors = [], []
    for n in (24, 48):
        both = [case.modes("outline_disk", 8, n=n, x=x, element=element)[6:8] for x in (0.137, 0.4)]
        case.deviation(f"disk, {element}, {n} elements: where it lies among them",
                       both[0].mean() / both[1].mean() - 1, 2e-4)
        case.deviation(f"disk, {element}, {n} elements: one frequency of two modes",
                       both[0][1] / both[0][0] - 1, 1e-3)
        sizes.append(110 / n)
        errors.append(both[0].mean() / exact - 1)
    case.deviation(f"frequency of the free disk, {element}, {exact:.5g}, of both meshes",
                   errors[1] + (errors[1] - errors[0]) / 3, 2e-3 if element == SOLIDS else 1e-4)
    return sizes, errors


def chain(case, element):
    """Balances of the chain; curvature of the disk after its release, and how thin it is."""
    run = case.run("trim_chain", element=element)
    has_begun = run.history["internal_energy"] > 1e-6       # before the roll comes all is round-off
    case.deviation(f"draw, trim, springback, hole, {element}: energy balance",
                   np.abs(run.history["energy_error"])[has_begun].max(), 1e-3)
    blank = run.frames[:, :run.n_blank]
    is_middle = np.abs(blank[0][:, 2]) < 1e-9
    x, y, z = blank[4][is_middle & (np.hypot(blank[2][:, 0] - 1, blank[2][:, 1] - 0.7) < 14)].T
    terms = np.stack([np.ones_like(x), x, y, x**2 / 2, x * y, y**2 / 2], axis=1)
    is_left = is_middle & (run.fields["edge_distance"][:run.n_blank] > 0)
    gone_points(case, element, run)
    return (np.linalg.lstsq(terms, z, rcond=None)[0][3],
            run.fields["thinning"][:run.n_blank][is_left].mean())


def gone_points(case, element, run):
    """What the chain writes at integration points is NaN exactly in the elements of which the cuts
    up to a frame leave nothing: the node in the middle of these is NaN, too."""
    n_wrong = 0
    with h5py.File(os.path.join(case.out, "outline_trim_chain.h5")) as file:
        strain = file["frames/eqps"][...]
        edge = file["VTKHDF/PointData/edge_distance"][...].reshape(len(strain), run.n_points)
        of_frames = [[values] for values in strain]
        of_frames[-1] += [file["points"][name][...] for name in
                          ("eqps", "stress", "statev", "principal_strain")]
        for distance, fields in zip(edge, of_frames):
            is_gone = np.isnan(distance[:run.n_blank].reshape(-1, 21, 31)[0, 1::2, 1::2])
            for values in fields:
                values = values.reshape(6, 10, 2, 15, 2, -1)
                n_wrong += np.count_nonzero(np.isnan(values) != is_gone[:, None, :, None, None])
        volume = file["points/reference_volume"][...].reshape(6, 10, 2, 15, 2)
    case.deviation(f"values of the chain that are NaN and not gone, or the other way round, "
                   f"{element}", n_wrong, 0)
    case.between(f"elements of the chain that are gone, {element}", np.count_nonzero(is_gone), 90,
                 100)
    case.deviation(f"points of the chain without volume and not gone, or the other way round, "
                   f"{element}", np.count_nonzero((volume == 0) != is_gone[:, None, :, None]), 0)


def main():
    case = Case("Sheets inside outlines", "uniform tension; frequencies of free disks")
    exact = frequency_of_disk()
    lines, ends = [], []
    for element, style in ((SHELLS, "o-"), (SOLIDS, "s--")):
        strips(case, element)
        mirrored(case, "outline_hole", element)
        mirrored(case, "outline_hole", element, p=3, n=15)
        mirrored(case, "outline_press", element)
        loads(case, element)
        flight(case, element)
        sizes, errors = disks(case, element, exact)
        if element == SHELLS:
            case.rate("rate of the frequency", sizes, errors, 1.8, 2.3)
        lines.append((f"free disk, {element}", style, sizes, np.abs(errors)))
        ends.append(chain(case, element))
    mirrored(case, "outline_press", SHELLS, points='"KNOT"')
    same_bits(case, "trim_press", 2, 3, element=SHELLS, n=6)   # a contact begins after it
    same_bits(case, "trim_chain", 2, 3, element=SOLIDS, n=6)   # it swings, after the second cut
    pieces(case)
    for name, of_shells, of_solids, limit in zip(("curvature", "mean thinning"), *ends,
                                                 (0.05, 0.03)):
        case.error(f"{name} after the springback, solids against shells", of_solids, of_shells,
                   limit)
    case.panel("element [mm]", "error of the frequency", lines, "log")
    case.finish()


main()
