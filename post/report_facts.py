"""Facts of a run as pieces of HTML: set-up, tools, steps, quality, warnings, the deck."""
import html
import os

import numpy as np

from post import model
from post.force import Part, stroke_and_force
from post.results import counted, text_of
from post.steps import steps_of

LONGEST_DECK = 200_000   # characters of a deck that is shown whole


def title(results):
    """The heading of the deck, or its name."""
    return provenance(results, "heading") or deck_name(results)


def page(results):
    """Everything but pictures and deck."""
    status = text_of(results.file["provenance"].attrs["status"])
    yield f"<h1>{html.escape(title(results))}</h1>"
    yield f"<p>Run of {html.escape(deck_name(results))}: {html.escape(status)}.</p>"
    yield from warnings(results)
    yield "<h2>Set-up</h2>" + table(set_up(results))
    if results.tools:
        yield table(tools(results), has_head=True)
    yield table(steps(results), has_head=True)
    yield "<h2>Quality</h2>" + table(quality(results))


def provenance(results, name):
    return text_of(results.file["provenance"][name][()]).strip()


def deck_name(results):
    return os.path.basename(provenance(results, "deck_file") or results.path)


def table(rows, has_head=False):
    """Rows of texts; the first cell of a row, or the first row, is a heading."""
    lines = []
    for i, row in enumerate(rows):
        tags = ["th" if (i == 0 if has_head else j == 0) else "td" for j in range(len(row))]
        lines.append("<tr>" + "".join(f"<{tag}>{html.escape(str(cell))}</{tag}>"
                                      for tag, cell in zip(tags, row)) + "</tr>")
    return "<table>" + "\n".join(lines) + "</table>"


def warnings(results):
    """Warnings and errors of the log next to the result."""
    path = results.path.removesuffix(".h5") + ".log"
    try:
        with open(path, encoding="utf-8", errors="replace") as log:
            found = [line.strip() for line in log if line.startswith(("warning:", "error:"))]
    except OSError:
        yield f"<p>No log {html.escape(path)}: warnings are not known.</p>"
        return
    yield "<h2>Warnings of the run</h2>" if found else "<p>The log holds no warning.</p>"
    if found:
        yield "<ul>" + "\n".join(f'<li class="{line.partition(":")[0]}">{html.escape(line)}</li>'
                                 for line in found) + "</ul>"


def set_up(results):
    """Deck, program and blank."""
    file = results.file
    degrees = {" x ".join(map(str, patch.degrees)) for patch in results.patches}
    yield "deck", deck_name(results)
    yield "command", provenance(results, "command_line")
    yield "units", provenance(results, "units") or "not named"
    yield "program", (f"igaform {provenance(results, 'version')} "
                      f"({provenance(results, 'git_commit')}), {provenance(results, 'compiler')}")
    yield "started", provenance(results, "start_time")
    yield "time of the run", (f"{file['timings/wall_seconds'][()]:.4g} s, "
                              f"{counted(file['provenance/threads'][()], 'thread')}")
    n_elements = sum(int(np.prod(patch.n_elements)) for patch in results.patches)
    yield "blank", (f"{counted(n_elements, 'element')} of degree {', '.join(sorted(degrees))} in "
                    f"{counted(len(results.patches), 'patch', 'patches')}, "
                    f"{control_points(results)} control points, "
                    f"mass {file['provenance/blank_mass'][()]:.4g} "
                    f"{results.unit('provenance/blank_mass')}")
    yield "part", Part(results).text
    yield "effects", ", ".join(file["timings/effects"])


def control_points(results):
    blank = results.file["nurbs/blank"]
    return sum((blank[patch.name] if patch.name else blank)["weights"].size
               for patch in results.patches)


def tools(results):
    """How each tool moves."""
    length = results.unit("VTKHDF/Points")
    by_force = model.tools_by_force(results)
    yield "tool", "motion", f"largest stroke [{length}]", "surfaces"
    for name in results.tools:
        stroke = np.abs(stroke_and_force(results, name)[0]).max()
        motion = "by force" if name in by_force else "prescribed" if stroke > 0 else "fixed"
        yield name, motion, f"{stroke:.4g}", len(results.file["nurbs/tools"][name])


def steps(results):
    """Times and increments of the steps, and how much inertia governs them."""
    time, increments = results.history("time"), results.history("step")
    kinetic, internal = results.history("kinetic_energy"), results.history("internal_energy")
    yield ("step", f"from [{results.unit('history/time')}]", "to", "increments", "frames",
           "kinetic over internal energy, second half")
    for step in steps_of(results):
        own = step.samples
        late = own.start + np.flatnonzero(time[own] >= 0.5 * (time[own][0] + time[own][-1]))
        ratio = kinetic[late] / np.maximum(internal[late], 1e-30)
        yield (step.title, f"{time[own][0]:.4g}", f"{time[own][-1]:.4g}",
               increments[own][-1] - increments[own][0], len(step.frames), percent(ratio.max()))


def quality(results):
    """Balance, penetration, added mass and extremes of the last frame."""
    last = len(results.times) - 1
    thickness = float(np.nanmedian(results.patches[0].field("thickness", 0)))
    mass = float(results.file["provenance/blank_mass"][()])
    error = np.abs(results.balance_error())
    at = f"{results.history('time')[error.argmax()]:.4g} {results.unit('history/time')}"
    yield "largest energy error", f"{percent(error.max())} of the largest energy, at {at}"
    for name, where in (("max_penetration", "at contact points"),
                        ("true_penetration", "between contact points too")):
        if name in results.file["history"]:
            depth, unit = results.history(name).max(), results.unit("history/" + name)
            yield f"largest penetration {where}", (f"{depth:.3g} {unit}, "
                                                   f"{percent(depth / thickness)} of the thickness")
    if mass > 0 and "added_mass" in results.file["history"]:
        yield "added mass", percent(results.history("added_mass").max() / mass) + " of the blank"
    for name, label in (("eqps", "equivalent plastic strain"), ("thinning", "thinning")):
        values = [extreme(results, name, last, function) for function in (np.nanmin, np.nanmax)]
        yield f"{label} at the end", f"{values[0]:.4g} to {values[1]:.4g}"


def percent(part):
    return f"{100 * part:.3g} %"


def extreme(results, name, frame, function):
    """Of a field, inside of outlines."""
    return float(function([function(patch.field_inside(name, frame))
                           for patch in results.patches]))


def deck(results):
    """The text of the deck, folded."""
    text = provenance(results, "deck_text")
    if len(text) > LONGEST_DECK:
        text = text[:LONGEST_DECK] + "\n..."
    yield (f"<h2>Deck</h2><details><summary>{html.escape(deck_name(results))} with its include "
           f"files</summary><pre>{html.escape(text)}</pre></details>")
