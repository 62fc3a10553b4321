"""What the program is to reach, and whether it does.

The absolute times are for processors with 512-bit registers at about 2.5 GHz; those that are ratios
of one run hold anywhere.
"""
from typing import NamedTuple

from post.bench_records import chosen, find, share_of_bound

# Force routine with von Mises and Voce, without weights: one and two threads [ns an element and
# step].
TIMES = {"3x3x3": (412.5, 212.5), "2x2x3": (218.75, 115.0), "2x2x2": (187.5, 97.5)}
OVER_PLAIN = 1.6       # weights over none
OVER_TUNED = 3.0       # a point of the general routine over one of the instance for 3x3x3
OVER_GENERAL = 3.0     # a point of smooth projections over one of the plain general routine
OVER_STATE = 2.0       # memory of a patch over that of its state
STEP_OVER_BLANK = 1.5
CONTACT_OVER_BLANK = 1.0
EFFICIENCY = {"force/p2/2x2x3/voce/plain/default": 0.95, "elements/8000": 0.90}
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
    reason: str = ""

    def __str__(self):
        return (f"{'met' if self.is_met else 'missed':6}  {self.what:62.62}{self.value:10.2f}"
                f"  target{self.limit:8.2f}{self.reason}")


def verdicts(records):
    """All targets of a run, empty where no record has one."""
    return [*of_times(records), *of_memory(records), *of_weights(records), *of_general(records),
            *of_smooth(records), *of_threads(records), *of_growth(records), *of_contact(records)]


def at_most(what, value, limit, reason=""):
    return Verdict(what, value, limit, value <= limit, reason)


def time_limit(records, record):
    """The most time that a record may need [ns], None where there is no limit."""
    name, threads = record["name"], record["threads"]
    if name == "step/channel":
        blank = find(records, "step/channel/blank", threads)
        return blank and STEP_OVER_BLANK * blank["ns"]
    for rule, limits in TIMES.items():
        for weights, factor in (("plain", 1.0), ("rational", OVER_PLAIN)):
            if name == f"force/p2/{rule}/voce/{weights}/default" and threads <= len(limits):
                return factor * limits[threads - 1]
    return None


def of_times(records):
    for record in records:
        limit = time_limit(records, record)
        if limit is not None:
            yield at_most(f"{record['name']}, {record['threads']} threads, ns", record["ns"], limit,
                          reason_of(records, record, limit))


def reason_of(records, record, limit):
    """What a missed time would ask of this processor: the absolute ones were set on another."""
    if record["ns"] <= limit or (share := share_of_bound(records, record)) is None:
        return ""
    return (f", which would take {100 * share * record['ns'] / limit:.0f} % of this processor's "
            "bound")


def of_memory(records):
    for record in records:
        if (record["threads"] == 1 and "/voce/plain/default" in record["name"]
                and record["memory_ratio"] is not None):
            yield at_most(f"{record['name']}, memory over state", record["memory_ratio"],
                          OVER_STATE)


def of_weights(records):
    """Weights over none, ratios of one run."""
    for threads in (1, 2):
        for rule in TIMES:
            stem = f"force/p2/{rule}/voce/"
            above = find(records, stem + "rational/default", threads)
            below = find(records, stem + "plain/default", threads)
            if above and below:
                yield at_most(f"{above['name']}, {threads} threads, over plain",
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
            efficiency = one["ns"] / (2 * two["ns"])
            yield Verdict(f"{name}, efficiency of two threads", efficiency, least,
                          efficiency >= least)


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
    """Contact must not cost more than the elements in the channel."""
    blank = find(records, "step/channel/blank", 1)
    if blank:
        total = sum(record["ns"] for record in chosen(records, "step/channel/contact", 1))
        yield at_most("step/channel, contact over elements", total / blank["ns"],
                      CONTACT_OVER_BLANK)
