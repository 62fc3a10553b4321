"""Does the stability suite see what is wrong? Marks are held against margins of our own.

usage: check_suite.py OUT
"""
import math
import sys

from stability import Mark, Scene, Suite

SCENE = Scene("scene", "deck", "why", check=list)
RECORDED = {("scene", "drift"): 0.4, ("scene", "error"): 0.01}


def faults(*marks, scene="scene"):
    """What the suite says to marks of a scene."""
    suite = Suite("igaform", "decks", sys.argv[1])
    suite.recorded = RECORDED
    for mark in marks:
        suite.take(SCENE, mark)
    suite.miss_dropped(scene)
    return suite.faults


def expect(said, *words):
    assert len(said) == len(words), said
    for fault, word in zip(said, words):
        assert word in fault, said


drift, error = Mark("drift", 4.1, 10.0), Mark("error", 1e-5, 1e-3)
expect(faults(drift, error))
expect(faults(Mark("drift", 5.9, 10.0), Mark("error", 1.9e-4, 1e-3)))
expect(faults(Mark("drift", 6.1, 10.0), error), "the margin is eaten")
expect(faults(drift, Mark("error", 2.1e-4, 1e-3)), "the margin is eaten")
for value in (10.1, -0.1, math.nan, math.inf):
    expect(faults(Mark("drift", value, 10.0), error), "not within 0 and 10")
expect(faults(drift, error, Mark("new", 1.0, 2.0)), "new is not in margins.csv")
expect(faults(drift), "error is in margins.csv, but no criterion any more")
expect(faults(drift, error, scene="other"))
expect(faults(), "drift is in margins.csv", "error is in margins.csv")
