"""Feed a reader with damaged files: exit code 0 if it takes all of them without crash, hang or
growing memory.

    fuzz.py TARGET PROGRAM SEEDS [--seconds N] [--seed N] [--keep FOLDER]

PROGRAM reads paths from its standard input, one a line, treats the file as its target would and
answers each with a line. Whatever it answers is right; that it answers in time, in little memory
and lives on is what is tested. SEEDS is a folder of sound files; the files that do harm are kept. A
new target is a new entry in TARGETS and a program with that loop.
"""
import argparse
import pathlib
import random
import re
import select
import subprocess
import sys
import tempfile
import time

SECONDS_PER_FILE = 10       # far above what the largest of the files needs
MEGABYTES_PER_FILE = 400    # above what the program takes at its start
MEGABYTES_LEAKED = 60       # growth from the first tenth of a run to its end
LARGEST = 200_000           # bytes of a damaged file

NUMBERS = ["0", "-1", "1", "2", "3", "5", "7", "99999999", "2147483647", "2147483648",
           "-2147483648", "1.D308", "1.E400", "1.D-320", "-0.", "NaN", "Inf", "1e", ".", "1.2.3",
           "", "+", "1000000"]


def any_bytes(data, rng):
    """Change, insert, remove or repeat a few bytes."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 5, 20))):
        at = rng.randrange(len(data) + 1)
        size = rng.choice((1, 1, 2, 8, 72, 80, 400))
        kind = rng.randrange(5)
        if kind == 0 and at < len(data):
            data[at] = rng.randrange(256)
        elif kind == 1:
            data[at:at] = bytes(rng.choice(b"0123456789.,;-+DEHT \n\r") for _ in range(size))
        elif kind == 2:
            del data[at:at + size]
        elif kind == 3:
            data[at:at] = data[at:at + size] * rng.choice((1, 1, 2, 20))
        else:
            del data[at:]
    return bytes(data[:LARGEST])


def any_number(data, rng):
    """Put strange numbers in the place of some."""
    places = [match.span() for match in re.finditer(rb"[-+.0-9DE]+", data)]
    for first, last in sorted(rng.sample(places, min(len(places), rng.choice((1, 1, 2, 4)))),
                              reverse=True):
        data = data[:first] + rng.choice(NUMBERS).encode() + data[last:]
    return data


def any_lines(data, rng, other):
    """Move, repeat, drop lines or take some of another file."""
    lines, more = data.split(b"\n"), other.split(b"\n")
    for _ in range(rng.choice((1, 1, 3))):
        at, to = rng.randrange(len(lines) + 1), rng.randrange(len(lines) + 1)
        piece = lines[at:at + rng.choice((1, 1, 2, 10))]
        kind = rng.randrange(4)
        if kind == 0:
            lines[to:to] = piece
        elif kind == 1:
            del lines[at:at + len(piece)]
        elif kind == 2:
            lines[at:at + len(piece)] = piece[::-1]
        else:
            first = rng.randrange(len(more))
            lines[to:to] = more[first:first + rng.choice((1, 2, 10))]
    return b"\n".join(lines)[:LARGEST]


def whole_iges(data, rng):
    """Columns, sequence numbers and counts made right again, so that damage reaches further in."""
    counts, lines = dict.fromkeys(b"SGDP", 0), []
    for line in data.replace(b"\r", b"").split(b"\n"):
        letter = line[72:73] if line[72:73] and line[72:73] in b"SGDP" else None
        if letter is None:
            continue
        counts[letter[0]] += 1
        lines.append((letter, line[:72].ljust(72)))
    lines.sort(key=lambda line: b"SGDP".index(line[0]))
    if counts[ord("D")] % 2 and rng.random() < 0.9:
        lines.append((b"D", b" " * 72))
        lines.sort(key=lambda line: b"SGDP".index(line[0]))
        counts[ord("D")] += 1
    numbers, out = dict.fromkeys(b"SGDP", 0), []
    for letter, text in lines:
        numbers[letter[0]] += 1
        out.append(text + letter + b"%7d" % numbers[letter[0]])
    last = b"".join(b"%c%7d" % (letter, counts[letter]) for letter in b"SGDP")
    out.append(last.ljust(72) + b"T      1")
    return b"\n".join(out) + b"\n"


def damaged_columns(data, rng):
    """Numbers of an IGES file exchanged within their columns."""
    lines = data.split(b"\n")
    for _ in range(rng.choice((1, 1, 2, 4))):
        at = rng.randrange(len(lines))
        line, letter = lines[at], lines[at][72:73]
        if letter == b"D":
            field = 8 * rng.randrange(9)
            value = rng.choice(NUMBERS[:9] + [str(2 * rng.randrange(30) + 1), "124", "120", "128",
                                              "102", "100", "122", "126", "144"]).encode()
            lines[at] = line[:field] + value[:8].rjust(8) + line[field + 8:]
        elif letter in b"GP" and letter:
            width = 64 if letter == b"P" else 72
            lines[at] = any_number(line[:width], rng)[:width].ljust(width) + line[width:]
    return b"\n".join(lines)


# What to do besides the general damage, and how to mend what hides the inside of a file.
TARGETS = {"iges": ([damaged_columns], whole_iges)}


def damage(target, seeds, rng):
    """A new file of one or two kinds of damage."""
    own, mend = TARGETS[target]
    data = rng.choice(seeds)
    for _ in range(rng.choice((1, 1, 2, 3))):
        kinds = [lambda d: any_bytes(d, rng), lambda d: any_number(d, rng),
                 lambda d: any_lines(d, rng, rng.choice(seeds))]
        kinds += 3 * [lambda d, change=change: change(d, rng) for change in own]
        data = rng.choice(kinds)(data)
    return mend(data, rng) if mend and rng.random() < 0.7 else data


class Reader:
    """The program under test, started again after it has died."""

    def __init__(self, program, folder):
        self.program, self.path = program, folder / "input"
        self.errors = folder / "errors"
        self.start()

    def start(self):
        with open(self.errors, "wb") as errors:
            self.process = subprocess.Popen([self.program], stdin=subprocess.PIPE,
                                            stdout=subprocess.PIPE, stderr=errors)
        self.first = None

    def memory(self, name):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(rf"{name}:\s+(\d+)", status).group(1)) / 1024

    def take(self, data):
        """Why the program did wrong with a file; empty if it did right."""
        self.path.write_bytes(data)
        try:
            self.process.stdin.write(f"{self.path}\n".encode())
            self.process.stdin.flush()
            if not select.select([self.process.stdout], [], [], SECONDS_PER_FILE)[0]:
                self.stop()
                return f"no answer in {SECONDS_PER_FILE} s"
            if not self.process.stdout.readline():
                raise BrokenPipeError
        except BrokenPipeError:
            code = self.process.wait()
            return f"ended with {code}: " + self.errors.read_text(errors="replace")[:2000]
        if self.first is None:
            self.first = self.memory("VmHWM")
        if self.memory("VmHWM") > self.first + MEGABYTES_PER_FILE:
            peak = self.memory("VmHWM")
            self.stop()
            return f"{peak:.0f} MB"
        return ""

    def stop(self):
        self.process.kill()
        self.process.wait()

    def end(self):
        """Exit code after the end of the input, when leaks are told."""
        self.process.stdin.close()
        return self.process.wait(timeout=60)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("program")
    parser.add_argument("seeds", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path, default=pathlib.Path("fuzz_found"))
    options = parser.parse_args()
    rng = random.Random(options.seed)
    seeds = [path.read_bytes() for path in sorted(options.seeds.iterdir())]
    found, n, early = 0, 0, None
    with tempfile.TemporaryDirectory() as folder:
        reader = Reader(options.program, pathlib.Path(folder))
        begin = time.monotonic()
        while time.monotonic() - begin < options.seconds and found < 10:
            data = seeds[n] if n < len(seeds) else damage(options.target, seeds, rng)
            why = reader.take(data)
            n += 1
            if why:
                found += 1
                options.keep.mkdir(exist_ok=True)
                path = options.keep / f"{options.target}_{options.seed}_{n}"
                path.write_bytes(data)
                print(f"{path}: {why}")
                reader.start()
            elif early is None and time.monotonic() - begin > 0.1 * options.seconds:
                early = reader.memory("VmRSS")
        late = reader.memory("VmRSS")
        code = reader.end()
        errors = reader.errors.read_text(errors="replace")[:2000]
    print(f"{n} files in {options.seconds:.0f} s, {found} of them did harm; memory "
          f"{early or late:.0f} MB early, {late:.0f} MB at the end")
    if found == 0 and late - (early or late) > MEGABYTES_LEAKED:
        print("the memory grows")
        return 1
    if code != 0:
        print(f"the end of the program has code {code}: {errors}")
    return 1 if found or code != 0 else 0


if __name__ == "__main__":
    sys.exit(main())
