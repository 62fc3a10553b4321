"""One HTML page on a run, with all pictures in it: what one mails to a colleague.

The pictures and the figures below them are those of the other commands.
"""
import base64
import contextlib
import html
import io
import os
import tempfile

from post import limit_curve, model, report_facts
from post.results import Results, ResultsError
from post.section_line import add_section_argument
from post.steps import frame_before_release

ENDING = ".html"
STYLE = """
body { font: 15px/1.45 sans-serif; color: #222; max-width: 62em; margin: 2em auto; padding: 0 1em }
h1 { font-size: 1.6em } h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #ccc }
table { border-collapse: collapse; margin: 0.8em 0 }
th, td { text-align: left; vertical-align: top; padding: 0.15em 1.2em 0.15em 0 }
th { font-weight: 600 } tr + tr { border-top: 1px solid #eee }
img { max-width: 100%; max-height: 52em } pre { background: #f6f6f6; padding: 0.6em; overflow: auto;
font-size: 0.85em } .warning { color: #8a4b00 } .error { color: #a00000 }
@media print { h2 { break-after: avoid } img, table { break-inside: avoid } }
"""


def add_arguments(command):
    command.add_argument("file", metavar="FILE", help="result file of igaform")
    command.add_argument("-o", "--out", metavar="HTML",
                         help="the page to write (default: FILE without its ending, -report.html)")
    command.add_argument("--parts", metavar="N", help="as in `post force`")
    add_section_argument(command)
    limit_curve.add_arguments(command)


def run(arguments):
    with Results(arguments.file) as results:
        body = [*report_facts.page(results), *pictures(results, arguments),
                *report_facts.deck(results)]
        title = report_facts.title(results)
    page = (f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
            f"<title>{html.escape(title)}</title><style>{STYLE}</style></head>\n<body>\n"
            + "\n".join(body) + "\n</body></html>\n")
    try:
        with open(arguments.out, "w", encoding="utf-8") as file:
            file.write(page)
    except OSError as fault:
        raise ResultsError(f"cannot write '{arguments.out}': {fault.strerror}") from None
    print(f"report written: {arguments.out}")
    return 0


def sections(results, arguments):
    """Heading and command of each picture."""
    limit = [word for option in ("exponent", "curve", "thickness")
             if (value := getattr(arguments, option)) is not None
             for word in (f"--{option}", str(value))]
    axes = "".join(axis for axis, face in model.symmetry_planes(results).items()
                   if face[0] == axis and face[1] == "_")
    mirror = ["--mirror", axes] if axes else []
    section = []
    if arguments.section:
        section = ["--section={}={!r}".format("xyz"[arguments.section[0]], arguments.section[1])]
    is_strip = model.is_plane_strain(results)    # of which one sees the section only
    if is_strip or section:
        yield "Section", ["profile", *section]
    if not is_strip:
        yield "Thinning", ["picture", "--field", "thinning", "--small", *mirror]
    yield "Forming limits", ["fld", *limit]
    if not is_strip:
        yield "Forming-limit zones on the part", ["fld", "--map", "--small", *mirror, *limit]
    if results.tools:
        yield "Forces of the tools", ["force", *(["--parts", arguments.parts] if arguments.parts
                                                 else [])]
    yield "Energies", ["history"]
    if not is_strip:
        yield "Draw-in", ["draw-in"]
    if frame_before_release(results, len(results.times) - 1) is not None:
        yield "Springback", ["springback", *section]


def pictures(results, arguments):
    """The sections with a picture."""
    said = set()
    with tempfile.TemporaryDirectory() as folder:
        for heading, words in sections(results, arguments):
            yield f"<h2>{heading}</h2>"
            try:
                picture, text = drawn(words, results.path, os.path.join(folder, "picture.png"))
            except ResultsError as error:
                yield f'<p class="warning">not drawn: {html.escape(str(error))}</p>'
                continue
            yield f"<p><code>post {html.escape(' '.join(words))}</code></p>"
            yield f'<img alt="{heading}" src="data:image/png;base64,{picture}">'
            if text and text not in said:
                yield f"<pre>{html.escape(text)}</pre>"
            said.add(text)


def drawn(words, path, out):
    """The picture of a command, in base64, and what it prints."""
    from post.__main__ import parser   # which knows this module
    name, *options = words
    arguments = parser(name).parse_args([name, path, "--out", out, *options])
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        arguments.run(arguments)
    with open(out, "rb") as file:
        picture = base64.b64encode(file.read()).decode()
    lines = [line for line in text.getvalue().splitlines() if out not in line]
    return picture, "\n".join(lines)
