"""What the deck of a result says of the model: its steps, planes of symmetry, tools by force."""
import re

from post.deck import same

FACE = re.compile(r"(X|Y|Z|XI|ETA|ZETA)_(MIN|MAX)")
SYMMETRY = re.compile(r"([XYZ])SYMM")


def step_names(results):
    """Names of the steps; empty for one without a name, no list if the deck has no *STEP."""
    return [record.options.get("NAME", "") for record in results.deck.named("STEP")]


def tools_by_force(results):
    """Names of the tools that a force moves."""
    moved = {same(record.options["TOOL"]) for record in results.deck.named("TOOL FORCE")}
    return {tool for tool in results.tools if same(tool) in moved}


def symmetry_planes(results):
    """Faces of the blank on symmetry planes, by axis: of each axis the first. A condition on ALL is
    plane strain, one on another set holds a rigid motion: neither is a plane of symmetry."""
    planes = {}
    for record in results.deck.named("BOUNDARY"):
        for name, *condition in record.data:
            symmetry = SYMMETRY.fullmatch(condition[0].upper()) if condition else None
            if symmetry and FACE.fullmatch(name.upper()):
                planes.setdefault(symmetry[1], name)
    return planes
