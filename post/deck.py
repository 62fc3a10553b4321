"""The deck of a result: its keywords with includes and parameters replaced, as the program writes
them to /provenance/deck_resolved."""
import re
from dataclasses import dataclass


@dataclass
class Record:
    """A keyword with its options and data lines, and the step it belongs to (from 1)."""
    keyword: str
    options: dict
    data: list
    step: int


class Deck:
    def __init__(self, text):
        self.records = []
        step = 0
        for line in text.splitlines():
            if line.startswith("**"):
                continue
            head, *rest = commas(line)
            if head.startswith("*"):
                step += head == "*STEP"
                pairs = [option.partition("=") for option in rest]
                options = {name: unquoted(value) for name, _, value in pairs}
                self.records.append(Record(head[1:], options, [], max(step, 1)))
            elif self.records:
                self.records[-1].data.append([unquoted(field) for field in (head, *rest)])

    def named(self, *keywords):
        return [record for record in self.records if record.keyword in keywords]

    def is_removed(self, tool, step):
        """Whether the deck has taken a tool away in a step, or never brings it: it touches nothing,
        and another one is its offset."""
        touching = {same(record.options.get("TOOL", "")) for record in self.named("CONTACT PAIR")}
        bases = {same(record.options.get("OF", "")) for record in self.named("TOOL")}
        is_away = bool(touching) and same(tool) in bases - touching
        for record in self.named("MODEL CHANGE"):
            names = [same(name) for row in record.data for name in row]
            if record.step <= step and same(tool) in names:
                is_away = "REMOVE" in record.options
        return is_away

    def symmetric_faces(self, letter):
        """Faces of the blank that *BOUNDARY makes planes of symmetry across X, Y or Z."""
        return {row[0].upper() for record in self.named("BOUNDARY") for row in record.data
                if len(row) > 1 and row[1].upper() == f"{letter}SYMM"}


def number(text):
    """A number as Fortran writes it."""
    return float(text.lower().replace("d", "e"))


def unquoted(text):
    """A value without its quotes, doubled ones inside it single."""
    return text[1:-1].replace('""', '"') if text.startswith('"') else text


def same(name):
    """A name as the program compares it."""
    return " ".join(name.upper().split())


def commas(line):
    """Parts between commas that are not in quotes."""
    return [part.strip() for part in re.split(r',(?=(?:[^"]*"[^"]*")*[^"]*$)', line)]
