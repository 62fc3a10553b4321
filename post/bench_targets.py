"""What the program is to reach, and whether it does: parts of the machine's bound and ratios of one
run, which hold for any processor.
"""
from typing import NamedTuple

from post.bench_records import chosen, find, share_of_bound
from post.results import counted

# Parts of the bound that the force routine with von Mises and Voce reaches on one thread.
SHARES = {"3x3x3": 0.72, "2x2x3": 0.70, "2x2x2": 0.66}
RATIONAL_SHARE = 0.55
# The same with 2x2x3 points and other laws, all points flowing, over that with Voce.
OVER_VOCE = {"table": 1.3, "swift": 1.4, "ludwik": 1.4, "cowper": 1.4, "johnson": 1.4,
             "hill48": 1.7, "chaboche": 2.0, "yoshida": 3.0, "yld91": 4.0, "yld2000": 4.0,
             "yld2004": 7.0}
# Shells of degree 2 with six layers over other records of the same run.
SHELL = "shell/p2/2x2/6/"
SHELL_OVER = (("voce/plain", "force/p2/2x2x6/voce/plain/default", 0.55),
              ("voce/plain", "force/p2/2x2x3/voce/plain/default", 0.85),
              ("hill48/plain", SHELL + "voce/plain", 1.7),
              ("barlat89/plain", SHELL + "voce/plain", 2.0),
              ("yld2000/plain", SHELL + "voce/plain", 3.5),
              ("yoshida/plain", SHELL + "voce/plain", 3.0),
              ("voce/rational", SHELL + "voce/plain", 1.5))
OVER_PLAIN = 1.6       # weights over none
OVER_TUNED = 3.0       # a point of the general routine over one of the instance for 3x3x3
OVER_GENERAL = 3.0     # a point of smooth projections over one of the plain general routine
OVER_STATE = 2.0       # memory of a patch over that of its state
STEP_OVER_BLANK = 1.5
CONTACT_OVER_BLANK = 1.0
TRIMMED_OVER_WHOLE = 1.3
EFFICIENCY = {"force/p2/2x2x3/voce/plain/default": 0.95, "elements/8000": 0.90,
              "force/p2/2x2x3/umat_voce/plain/default": 0.90}
TUNED = "force/p2/3x3x3/voce/plain/default"
GENERAL = tuple(f"force/{rule}/voce/plain/default" for rule in (
    "p1/1x1x2", "p1/2x2x2", "p2/2x3x2", "p2/3x3x4", "p3/3x3x3", "p3/4x4x4", "p4/4x4x4",
    "p5/5x5x5"))
PLAIN_GENERAL = "force/p2/3x3x4/voce/plain/default"
GROWING = ("contact/faces/", "search/faces/", "contact/refined/", "search/refined/")


class Verdict(NamedTuple):
    """One target and what was measured."""
    what: str
    value: float
    limit: float
    is_met: bool

    def __str__(self):
        return (f"{'met' if self.is_met else 'missed':6}  {self.what:62.62}{self.value:10.2f}"
                f"  target{self.limit:8.2f}")


def verdicts(records):
    """All targets of a run, empty where no record has one."""
    return [*of_shares(records), *of_laws(records), *of_shells(records), *of_step(records),
            *of_memory(records), *of_weights(records), *of_general(records),
            *of_smooth(records), *of_threads(records), *of_growth(records), *of_contact(records)]


def at_most(what, value, limit):
    return Verdict(what, value, limit, value <= limit)


def at_least(what, value, limit):
    return Verdict(what, value, limit, value >= limit)


def of_shares(records):
    """Time that the machine could need at least, over that needed."""
    for rule, plain in SHARES.items():
        for weights, least in (("plain", plain), ("rational", RATIONAL_SHARE)):
            record = find(records, f"force/p2/{rule}/voce/{weights}/default", 1)
            share = record and share_of_bound(records, record)
            if share:
                yield at_least(f"{record['name']}, part of the bound", share, least)


def of_laws(records):
    base = find(records, "force/p2/2x2x3/voce/plain/default", 1)
    for law, most in OVER_VOCE.items():
        record = find(records, f"force/p2/2x2x3/{law}/plain/default", 1)
        if base and record:
            yield at_most(f"{record['name']}, over Voce", record["ns"] / base["ns"], most)


def of_shells(records):
    for name, other, most in SHELL_OVER:
        shell, base = find(records, SHELL + name, 1), find(records, other, 1)
        if shell and base:
            yield at_most(f"{shell['name']}, over {other}", shell["ns"] / base["ns"], most)


def of_step(records):
    """A whole increment of the channel over its elements."""
    for threads in (1, 2):
        step, blank = (find(records, name, threads)
                       for name in ("step/channel", "step/channel/blank"))
        if step and blank:
            yield at_most(f"step/channel, {counted(threads, 'thread')}, over elements",
                          step["ns"] / blank["ns"], STEP_OVER_BLANK)


def of_memory(records):
    for record in records:
        if (record["threads"] == 1 and "/voce/plain/default" in record["name"]
                and record["memory_ratio"] is not None):
            yield at_most(f"{record['name']}, memory over state", record["memory_ratio"],
                          OVER_STATE)


def of_weights(records):
    """Weights over none, ratios of one run."""
    for threads in (1, 2):
        for rule in SHARES:
            stem = f"force/p2/{rule}/voce/"
            above = find(records, stem + "rational/default", threads)
            below = find(records, stem + "plain/default", threads)
            if above and below:
                yield at_most(f"{above['name']}, {counted(threads, 'thread')}, over plain",
                              above["ns"] / below["ns"], OVER_PLAIN)


def of_general(records):
    """What has no instance of its own over the one with 3 x 3 x 3 points, point by point."""
    tuned = point_time(find(records, TUNED, 1))
    for name in GENERAL:
        general = point_time(find(records, name, 1))
        if tuned and general:
            yield at_most(f"{name}, a point over 3x3x3", general / tuned, OVER_TUNED)


def of_smooth(records):
    """Projections, which go through a general routine of their own, over the plain general one,
    point by point."""
    general = point_time(find(records, PLAIN_GENERAL, 1))
    for record in chosen(records, "force/", 1):
        if "_smooth" in record["name"] and general and point_time(record):
            yield at_most(f"{record['name']}, over plain", point_time(record) / general,
                          OVER_GENERAL)


def point_time(record):
    """Time a point, None where there is no record or it has none."""
    return record and record["ns_per_point"]


def of_threads(records):
    for name, least in EFFICIENCY.items():
        one, two = (find(records, name, threads) for threads in (1, 2))
        if one and two:
            yield at_least(f"{name}, efficiency of two threads", one["ns"] / (2 * two["ns"]), least)


def of_growth(records):
    """Cost may grow as the logarithm of the number of faces: from 100 to 10^5 by 2.5, to 10^6 by
    3."""
    for stem in GROWING:
        few = find(records, stem + "100", 1)
        for power in (5, 6):
            many = find(records, f"{stem}{10**power}", 1)
            if few and many:
                yield at_most(f"{many['name']} over 100", many["ns"] / few["ns"], 0.5 * power)


def of_contact(records):
    """Contact must not cost more than the elements in the channel, nor much more on a die whose
    surfaces are trimmed."""
    blank = find(records, "step/channel/blank", 1)
    if blank:
        total = sum(record["ns"] for record in chosen(records, "step/channel/contact", 1))
        yield at_most("step/channel, contact over elements", total / blank["ns"],
                      CONTACT_OVER_BLANK)
    whole, cut = (find(records, f"contact/die/{name}", 1) for name in ("whole", "200_pieces"))
    if whole and cut:
        yield at_most("contact/die/200_pieces, over the whole die", cut["ns"] / whole["ns"],
                      TRIMMED_OVER_WHOLE)
