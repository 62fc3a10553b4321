"""What a run by several processes would take with others of them, or through another network, from
the log of one: its work is shared, its output is not, and each increment passes a few messages."""
import math
import re

from post.results import ResultsError

SERIAL = ("output", "checkpoint", "other")


def add_arguments(command):
    command.add_argument("file", metavar="LOG", help="log of a run by igaform-mpi")
    command.add_argument("-o", "--out", default="processes.md", metavar="FILE",
                         help="file of the table (default: processes.md)")
    command.add_argument("-n", "--counts", type=int, nargs="+", metavar="N",
                         default=[1, 2, 4, 8, 16, 32, 64], help="numbers of processes")
    command.add_argument("--latency", type=float, default=1e-5, metavar="S",
                         help="seconds a message takes at least (default: 1e-5)")
    command.add_argument("--rate", type=float, default=1e10, metavar="B/S",
                         help="bytes a second of the network (default: 1e10)")
    command.add_argument("--elements", type=float, metavar="N",
                         help="as if the sheet had so many elements (default: those of the run)")
    command.add_argument("--without-output", action="store_true",
                         help="leave out what one process does for results, checkpoints and log")


def run(arguments):
    """The table, on paper and on the terminal."""
    facts = Facts(arguments.file)
    if arguments.without_output:
        facts.serial = 0.0
    if arguments.rate <= 0 or arguments.latency < 0 or min(arguments.counts) < 1:
        raise ResultsError("a rate and numbers of processes must be positive, a latency not "
                           "negative")
    size = arguments.elements/facts.elements if arguments.elements else 1.0
    lines = ["| processes | ms an increment | speed | efficiency | exchange |",
             "|---:|---:|---:|---:|---:|"]
    alone = facts.seconds(1, arguments.latency, arguments.rate, size)
    for n in arguments.counts:
        seconds = facts.seconds(n, arguments.latency, arguments.rate, size)
        passing = facts.passing(n, arguments.latency, arguments.rate, size)
        lines.append(f"| {n} | {1e3*seconds:.3g} | {alone/seconds:.1f} | {alone/seconds/n:.2f} | "
                     f"{100*passing/seconds:.0f} % |")
    text = "\n".join(lines)
    print(text)
    with open(arguments.out, "w", encoding="utf-8") as file:
        file.write(text + "\n")
    return 0


class Facts:
    """From the log of a run: seconds of one increment, and what passes in it."""

    def __init__(self, path):
        try:
            with open(path, encoding="utf-8") as file:
                text = file.read()
        except OSError as fault:
            raise ResultsError(f"cannot read '{path}': {fault.strerror}") from None
        self.count = int(self.find(text, path, r"^processes +(\d+) with", "several processes"))
        self.find(text, path, r"^rows +of \d+ rows", "processes that move but some of the control "
                  "points: with what it simulates each process moves all, see docs/running.md")
        self.kilobytes = float(self.find(text, path, r"^exchange +up to (\S+) kB", "an exchange"))
        table = text[text.index("\neffect  "):]
        found = re.findall(r"^(.{1,38}?) +(\d+\.\d+) +\d+\.\d+ *(\d*)$", table, re.MULTILINE)
        rows = {name.strip(): float(seconds) for name, seconds, _ in found}
        calls = {name.strip(): int(number or 0) for name, _, number in found}
        elements, steps = self.find(table, path, r"^(\d+) elements, (\d+) steps", "its end")
        self.elements, self.steps = int(elements), int(steps)
        total = rows.pop("all steps")
        self.exchange = rows.pop("exchange", 0.0)/self.steps
        self.serial = sum(rows.pop(name, 0.0) for name in SERIAL)/self.steps
        self.shared = total/self.steps - self.exchange - self.serial
        self.has_supports = any(name.startswith("boundary") for name in rows)
        # One for the forces, and one before for the shape of shells that tools touch.
        self.passes = max(1, round(calls.get("exchange", 0)/self.steps) - self.has_supports)

    @staticmethod
    def find(text, path, pattern, what):
        found = re.findall(pattern, text, re.MULTILINE)
        if not found:
            raise ResultsError(f"'{path}' is no log of a finished run by igaform-mpi with {what}")
        return found[-1]

    def passing(self, count, latency, rate, size=1.0):
        """Seconds of an increment that messages are under way. Neighbours exchange once, of shells
        in contact twice; all gather what tiles report, and the forces of supports, in log2 of
        their number of messages. What passes goes with the edge of a sheet; two processes have one
        neighbour, more have two."""
        if count == 1:
            return 0.0
        steps = math.ceil(math.log2(count) - 1e-9)
        kilobytes = self.kilobytes*math.sqrt(size)
        if self.count == 2 and count > 2:
            kilobytes *= 2
        if self.count > 2 and count == 2:
            kilobytes /= 2
        return (self.passes + (1 + self.has_supports)*steps)*latency + 1e3*kilobytes/rate

    def seconds(self, count, latency, rate, size=1.0):
        """Seconds of an increment. Output and decisions are of one process; packing and adding
        what passes took what it did here."""
        return (self.shared*self.count*size/count + self.serial*size
                + (self.exchange*math.sqrt(size) if count > 1 else 0.0)
                + self.passing(count, latency, rate, size))
