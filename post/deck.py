"""The deck of a result: its keywords with parameters replaced, as the file holds its text.

The program has accepted the deck, so nothing is checked here.
"""
import ast
import math
import operator
import os
import re
from dataclasses import dataclass

FILE = "** file "
OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
             ast.Div: operator.truediv, ast.Pow: operator.pow, ast.USub: operator.neg,
             ast.UAdd: operator.pos}
FUNCTIONS = {name: getattr(math, name) for name in
             ("sqrt", "sin", "cos", "tan", "exp", "log", "floor", "ceil")}
FUNCTIONS |= {"abs": abs, "min": min, "max": max,
              "round": lambda x: math.copysign(math.floor(abs(x) + 0.5), x)}


@dataclass
class Record:
    """A keyword with its options and data lines, and the step it belongs to (from 1)."""
    keyword: str
    options: dict
    data: list
    step: int


class Deck:
    def __init__(self, text, command_line=""):
        self.files = files_of(text)
        self.values = {name: value_of(value, {}) for name, value in settings(command_line)}
        self.fixed = set(self.values)
        self.records = []
        self.step = 0
        if self.files:
            self._read(next(iter(self.files)))

    def _read(self, path):
        for keyword, options, data in keywords_of(self.files.get(path, [])):
            if keyword == "PARAMETER":
                self._define("DEFAULT" in options, data)
                continue
            options = {name: self._replaced(value) for name, value in options.items()}
            if keyword == "INCLUDE":
                self._read(os.path.normpath(os.path.join(os.path.dirname(path), options["INPUT"])))
            elif keyword == "END":
                return
            else:
                self.step += keyword == "STEP"
                rows = [fields(self._replaced(line)) for line in data]
                self.records.append(Record(keyword, options, rows, max(self.step, 1)))

    def _define(self, is_default, lines):
        for line in lines:
            name, _, value = (part.strip() for part in line.partition("="))
            name = name.lower()
            if name not in self.fixed and not (is_default and name in self.values):
                self.values[name] = value_of(value, self.values)

    def _replaced(self, line):
        return re.sub(r"<([^<>]*)>", lambda found: str(value_of(found[1], self.values)), line)

    def named(self, *keywords):
        return [record for record in self.records if record.keyword in keywords]

    def is_removed(self, tool, step):
        """Whether the deck has taken a tool away in a step."""
        is_away = False
        for record in self.named("MODEL CHANGE"):
            names = [same(name) for row in record.data for name in [*row, " ".join(row)]]
            if record.step <= step and same(tool) in names:
                is_away = "REMOVE" in record.options
        return is_away

    def symmetric_faces(self, letter):
        """Faces of the blank that *BOUNDARY makes planes of symmetry across X, Y or Z."""
        return {row[0].upper() for record in self.named("BOUNDARY") for row in record.data
                if len(row) > 1 and row[1].upper() == f"{letter}SYMM"}

    def side(self, tool):
        """1 where the sheet lies on the side of a tool's normals, else -1; None without a *TOOL."""
        for record in self.named("TOOL"):
            if same(record.options["NAME"]) != same(tool):
                continue
            if record.options["TYPE"].upper() != "OFFSET":
                return -1 if record.options.get("SIDE", "").upper() == "NEGATIVE" else 1
            return self.side(record.options["OF"]) * (-1 if number(record.data[0][0]) > 0 else 1)
        return None


def number(text):
    """A number as Fortran writes it."""
    return float(text.lower().replace("d", "e"))


def same(name):
    """A name as the program compares it."""
    return " ".join(name.upper().split())


def files_of(text):
    """Lines of each file of a deck by its path; a file may have been read more than once."""
    files, lines = {}, []
    for line in text.splitlines():
        if line.startswith(FILE):
            lines = files.setdefault(os.path.normpath(line[len(FILE):]), [])
            lines.clear()
        else:
            lines.append(line)
    return files


def settings(command_line):
    """Names and values of --set on a command line, whose words are joined without quotes."""
    return [(name.lower(), value) for name, value in
            re.findall(r"--set\s+(\w+)\s*=\s*(\S+)", command_line)]


def keywords_of(lines):
    """Keywords with options and data lines; a line that ends with a comma goes on."""
    found, is_open = [], False
    for line in lines:
        line = line.strip()
        if not line or line.startswith(("**", "$")):
            continue
        is_keyword = line.startswith("*")
        if is_keyword:
            found.append([line, []])
        elif is_open:
            found[-1][0] += line
        elif found:
            found[-1][1].append(line)
        is_open = line.endswith(",") and (is_open or is_keyword)
    for line, data in found:
        head, *options = commas(line[1:])
        pairs = [option.partition("=") for option in options]
        yield (same(head.replace("_", " ")),
               {same(name.replace("_", " ")): value.strip().strip('"')
                for name, _, value in pairs}, data)


def commas(line):
    """Parts between commas that are not in quotes; nothing after the last comma."""
    parts = [part.strip() for part in re.split(r',(?=(?:[^"]*"[^"]*")*[^"]*$)', line)]
    return parts[:-1] if len(parts) > 1 and not parts[-1] else parts


def fields(line):
    """Fields of a data line; spaces separate where there are no commas."""
    parts = commas(line)
    return parts if len(parts) > 1 or line.endswith(",") else re.findall(r'"[^"]*"|\S+', line)


def value_of(text, values):
    """Value of an expression or text of *PARAMETER."""
    text = text.strip()
    if text.startswith('"'):
        return text.strip('"')
    if text.lower() in values:
        return values[text.lower()]
    try:
        plain = re.sub(r"(\d\.?)d([+-]?\d)", r"\1e\2", text.lower())
        return evaluated(ast.parse(plain, mode="eval").body, values)
    except (SyntaxError, KeyError, TypeError, ValueError, ArithmeticError):
        return text


def evaluated(node, values):
    """Value of a parsed expression of numbers, names, operators and functions."""
    match node:
        case ast.Constant():
            return node.value
        case ast.Name():
            return math.pi if node.id == "pi" else values[node.id]
        case ast.BinOp():
            return OPERATORS[type(node.op)](evaluated(node.left, values),
                                            evaluated(node.right, values))
        case ast.UnaryOp():
            return OPERATORS[type(node.op)](evaluated(node.operand, values))
        case ast.Call():
            return FUNCTIONS[node.func.id](*(evaluated(part, values) for part in node.args))
    raise ValueError(f"no expression: {ast.dump(node)}")
