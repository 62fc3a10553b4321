"""What the deck of a result says of the model: its steps, planes of symmetry, tools by force."""
import re

from post.deck import same

FACE = re.compile(r"(X|Y|Z|XI|ETA|ZETA)_(MIN|MAX)")


def step_names(results):
    """Names of the steps; empty for one without a name, no list if the deck has no *STEP."""
    return [record.options.get("NAME", "") for record in results.deck.named("STEP")]


def tools_by_force(results):
    """Names of the tools that a force moves."""
    moved = {same(record.options["TOOL"]) for record in results.deck.named("TOOL FORCE")}
    return {tool for tool in results.tools if same(tool) in moved}


def symmetry_planes(results):
    """Faces of the blank on symmetry planes, one for each axis. A condition on a set of the deck's
    own may only hold a rigid motion and counts as none."""
    faces = {axis: sorted(filter(FACE.fullmatch, results.deck.symmetric_faces(axis)))
             for axis in "XYZ"}
    return {axis: names[0] for axis, names in faces.items() if names}


def is_plane_strain(results):
    """Whether the deck forbids all motion along an axis."""
    return any("ALL" in results.deck.symmetric_faces(axis) for axis in "XYZ")
