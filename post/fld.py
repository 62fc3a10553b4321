"""Forming-limit diagram: strains in the sheet's plane, a limit curve, zones; these on the part; or
principal stresses and their limit."""
import numpy as np

from post import fld_picture, limit_curve, picture, zone_map, zones
from post.mirror import parse_axes
from post.results import Results, ResultsError
from post.style import save

LAYERS = {"middle": "mid-surface", "top": "top face (zeta_max)", "bottom": "bottom face (zeta_min)"}


def add_arguments(command):
    which = command.add_mutually_exclusive_group()
    which.add_argument("--frame", type=int, metavar="N",
                       help="frame from 0, negative from the end (default: the last)")
    which.add_argument("--time", type=float, metavar="T", help="the frame nearest to this time")
    command.add_argument("--layer", choices=LAYERS, nargs="+",
                         help="layers of the sheet (default: top and bottom; of the map middle)")
    command.add_argument("--map", action="store_true", help="draw the zones on the part instead")
    command.add_argument("--mirror", type=parse_axes, default=(), metavar="AXES",
                         help="complete the part of the map as in `post picture`")
    picture.add_size_argument(command)
    limit_curve.add_arguments(command).add_argument(
        "--stress", metavar="CSV", help="principal stresses instead, with the limit of a table of "
        "TYPE=FORMING LIMIT or LIMIT STRESS; needs FIELDS=STRESS")
    zones.add_arguments(command)
    command.add_argument("--engineering", action="store_true",
                         help="strains of picture and --curve are engineering strains")


def run(arguments):
    with Results(arguments.file) as results:
        frame = results.frame(arguments.frame, arguments.time)
        if arguments.stress:
            save(draw_stresses(results, frame, arguments), arguments.out, arguments.small)
            return 0
        borders = zones.Borders(limit_curve.limit_curve(arguments, results), arguments)
        tell(results, frame, borders)
        if arguments.map:
            figure = draw_map(results, frame, borders, arguments)
        else:
            figure = draw(results, frame, borders, arguments)
    save(figure, arguments.out, arguments.small)
    return 0


def draw(results, frame, borders, arguments):
    """The diagram with a cloud of points for each layer."""
    clouds = {LAYERS[layer]: strains(results, frame, layer)[:2]
              for layer in arguments.layer or ("bottom", "top")}
    return fld_picture.draw(clouds, borders, arguments.engineering,
                            picture.time_text(results, frame))


def draw_stresses(results, frame, arguments):
    """The diagram of stresses; prints how near each layer comes to the limit."""
    if arguments.map or arguments.engineering:
        raise ResultsError("--stress goes with neither --map nor --engineering, which are of "
                           "strains")
    unit = results.unit_of_field("mises")
    borders = zones.StressBorders(limit_curve.stress_curve(arguments.stress, unit), arguments)
    clouds = {name: plane_stresses(results, frame, layer) for layer, name in LAYERS.items()}
    for name, (minor, major) in clouds.items():
        share = borders.share(minor, major)
        print(f"{name}: largest major stress {major.max():.5g} {unit} at minor "
              f"{minor[np.argmax(major)]:.5g}; {np.count_nonzero(share > 1)} of {len(share)} "
              f"points beyond the limit; largest stress is {share.max():.3f} of its limit")
    shown = [LAYERS[layer] for layer in arguments.layer or ("bottom", "top")]
    return fld_picture.draw_stresses({name: clouds[name] for name in shown}, borders, unit,
                                     picture.time_text(results, frame))


def plane_stresses(results, frame, layer):
    """Minor and major principal stress in the sheet's plane at the display points of a layer. The
    principal stress nearest to zero counts as that through the thickness."""
    found = []
    for patch in results.patches:
        grid = [patch.field_inside(name, frame)[..., 0]
                for name in ("stress_min", "stress_mid", "stress_max")]
        values = layer_of(np.stack(grid, axis=-1), layer).reshape(-1, 3)
        values = values[np.all(np.isfinite(values), axis=1)]
        is_kept = np.arange(3) != np.argmin(np.abs(values), axis=1)[:, None]
        found.append(values[is_kept].reshape(-1, 2))
    return np.concatenate(found).T


def draw_map(results, frame, borders, arguments):
    """The zones of a layer on the part."""
    layer = (arguments.layer or ["middle"])[0]
    return zone_map.draw(results, frame, layer, borders, LAYERS[layer], arguments.mirror)


def tell(results, frame, borders):
    """How near each layer comes to the limit, and how much of it lies in each zone."""
    if borders.curve is None:
        print("no limit curve: give -n and, if lengths are not in mm, --thickness, or --curve")
    for layer in LAYERS:
        minor, major, area = strains(results, frame, layer)
        zone, share = borders.zone(minor, major), borders.share(minor, major)
        print(f"{LAYERS[layer]}: minor strains {minor.min():.4f} to {minor.max():.4f}, largest "
              f"major strain {major.max():.4f} at minor {minor[np.argmax(major)]:.4f}")
        if borders.curve is not None:
            print(f"  {np.count_nonzero(share > 1)} of {len(share)} points beyond the limit; "
                  f"largest strain is {share.max():.3f} of its limit")
        parts = np.bincount(zone, area, len(zones.ZONES)) / area.sum()
        print("  of the area " + ", ".join(f"{name} {100 * part:.3g} %" for (name, _), part
                                           in zip(zones.ZONES, parts) if part))


def strains(results, frame, layer):
    """Minor and major strain in a layer at a frame, and the area each point stands for. At the last
    frame the points are columns of integration points, else display points."""
    minor, major, area = [], [], []
    for patch in results.patches:
        if frame == len(results.times) - 1:
            values, volume = patch.points("principal_strain"), patch.points("reference_volume")
            values, volume = layer_of(values, layer), layer_of(volume, layer)
        else:
            grid = [patch.field_inside(name, frame)[..., 0]
                    for name in ("major_strain", "minor_strain")]
            values = layer_of(np.stack(grid, axis=-1), layer)
            volume = np.ones(values.shape[:-1])
        is_there = np.isfinite(values[..., 0])    # not outside an outline
        values, volume = values[is_there], volume[is_there]
        major.append(values[..., 0].ravel())
        minor.append(values[..., 1].ravel())
        area.append(volume.ravel())
    return np.concatenate(minor), np.concatenate(major), np.concatenate(area)


def layer_of(values, layer):
    """The first or last layer, or the mean of the two around the middle."""
    n = len(values)
    if layer == "middle":
        return 0.5 * (values[(n - 1) // 2] + values[n // 2])
    return values[-1 if layer == "top" else 0]
