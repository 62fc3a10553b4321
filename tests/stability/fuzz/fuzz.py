"""Feed a reader with damaged files: exit code 0 if it takes all of them without crash, hang or
growing memory.

    fuzz.py TARGET PROGRAM SEEDS... [--seconds N] [--seed N] [--keep FOLDER]

PROGRAM reads paths from its standard input, one a line, treats the file as its target would and
answers each with a line. Whatever it answers is right; that it answers in time, in little memory
and lives on is what is tested. SEEDS are sound files or folders of them; the files that do harm are
kept. A new target is a new entry in TARGETS of damage.py and a program with that loop.
"""
import argparse
import math
import os
import pathlib
import random
import re
import select
import subprocess
import sys
import tempfile
import time

from damage import TARGETS, damaged

BUSY = 20                   # seconds of the clock for one of the processor on a busy machine
MEGABYTES_LEAKED = 60
# One thread; a heap that shrinks when large arrays are freed, and does not learn to keep them;
# of the address sanitizer little memory held back, and no end where it has none.
ENVIRONMENT = {"OMP_NUM_THREADS": "1",
               "MALLOC_MMAP_THRESHOLD_": "33554432", "MALLOC_TRIM_THRESHOLD_": "33554432",
               "ASAN_OPTIONS": "quarantine_size_mb=16:allocator_may_return_null=1"}


class Reader:
    """The program under test, started again after it has died."""

    def __init__(self, command, folder, target):
        self.command, self.path, self.target = command, folder / "input", target
        self.errors = folder / "errors"
        self.asked = [folder / f"{i}.key" for i in range(len(target.decks))] or [self.path]
        for path, deck in zip(self.asked, target.decks):
            path.write_text(deck)
        self.start()

    def start(self):
        with open(self.errors, "wb") as errors:
            self.process = subprocess.Popen(self.command, stdin=subprocess.PIPE,
                                            stdout=subprocess.PIPE, stderr=errors,
                                            env=os.environ | ENVIRONMENT)
        self.first = None

    def memory(self, name):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(rf"{name}:\s+(\d+)", status).group(1)) / 1024

    def take(self, data):
        """Why the program did wrong with a file; empty if it did right."""
        self.path.write_bytes(data)
        self.answer = b""
        try:
            for path in self.asked:
                self.process.stdin.write(f"{path}\n".encode())
                self.process.stdin.flush()
                if not self.has_answer():
                    self.stop()
                    return f"no answer in {self.target.seconds} s"
                answer = self.process.stdout.readline()
                if not answer:
                    raise BrokenPipeError
                self.answer += answer
        except BrokenPipeError:
            code = self.process.wait()
            return f"ended with {code}: " + self.errors.read_text(errors="replace")[:2000]
        if self.first is None:
            self.first = self.memory("VmHWM")
        if self.memory("VmHWM") > self.first + self.target.megabytes:
            peak = self.memory("VmHWM")
            self.stop()
            return f"{peak:.0f} MB"
        return ""

    def has_answer(self):
        """Wait until there is something to read; false if that takes too long."""
        spent, begin = self.seconds(), time.monotonic()
        while not select.select([self.process.stdout], [], [], 1)[0]:
            if (self.seconds() - spent > self.target.seconds
                    or time.monotonic() - begin > BUSY * self.target.seconds):
                return False
        return True

    def seconds(self):
        """Time of the processor so far."""
        status = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text()
        fields = status.rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def stop(self):
        self.process.kill()
        self.process.wait()

    def end(self):
        """Exit code after the end of the input, when leaks are told."""
        self.process.stdin.close()
        return self.process.wait(timeout=60)


def sound_files(target, paths, program, folder):
    """Bytes of the seeds, and the command that reads them. Files of other endings are what the
    seeds refer to."""
    files = []
    for path in paths:
        files += sorted(path.iterdir()) if path.is_dir() else [path]
    if target.is_written:
        written = folder / "written"
        subprocess.run([program, files[0], written], check=True, stdin=subprocess.DEVNULL)
        return [written.read_bytes()], [program, files[0]]
    for file in files:
        if file.is_file() and not file.name.endswith(target.endings):
            (folder / file.name).write_bytes(file.read_bytes())
    return [file.read_bytes() for file in files if file.name.endswith(target.endings)], [program]


def feed(target, seeds, reader, options):
    """Numbers of files, of those that did harm and of answers, and the least memory [MB] in the
    second tenth of the time and after it, while the sound files are read again: what one file
    leaves free on the heap does not count, what none gives back does."""
    rng = random.Random(options.seed)
    found, n, answers, least = 0, 0, set(), {}
    begin = time.monotonic()
    while time.monotonic() - begin < options.seconds and found < 10:
        data = seeds[n] if n < len(seeds) else damaged(target, seeds, rng)
        why = reader.take(data)
        n += 1
        if why:
            found += 1
            options.keep.mkdir(exist_ok=True)
            path = options.keep / f"{options.target}_{options.seed}_{n}"
            path.write_bytes(data)
            print(f"{path}: {why}", flush=True)
            reader.start()
            continue
        if target.is_written and n == 1 and reader.answer != b"taken up\n":
            sys.exit(f"the sound file is refused: {reader.answer.decode()}")
        answers.add(re.sub(rb"[\d.]+", b"0", reader.answer))
        # One file that ends past the time would be all that its tenth has.
        tenth = min(9, int(10 * (time.monotonic() - begin) / options.seconds))
        least[tenth] = min(reader.memory("VmRSS"), least.get(tenth, math.inf))
    late = least.get(9, math.inf)
    for data in seeds[:20]:
        if not reader.take(data):
            late = min(late, reader.memory("VmRSS"))
    return n, found, len(answers), least.get(1, late), late


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("program")
    parser.add_argument("seeds", type=pathlib.Path, nargs="+")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path, default=pathlib.Path("fuzz_found"))
    options = parser.parse_args()
    target = TARGETS[options.target]
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        seeds, command = sound_files(target, options.seeds, options.program, folder)
        reader = Reader(command, folder, target)
        n, found, answers, early, late = feed(target, seeds, reader, options)
        code = reader.end()
        errors = reader.errors.read_text(errors="replace")[:2000]
    print(f"{n} files in {options.seconds:.0f} s, {answers} kinds of answers, {found} of them did "
          f"harm; memory {early:.0f} MB early, {late:.0f} MB late")
    if found == 0 and late - early > MEGABYTES_LEAKED:
        print("the memory grows")
        return 1
    if code != 0:
        print(f"the end of the program has code {code}: {errors}")
    return 1 if found or code != 0 else 0


if __name__ == "__main__":
    sys.exit(main())
