"""Zones of the forming-limit diagram, by minor and major logarithmic strain.

Crack is beyond the limit curve, marginal within a margin below it. The strain of the thickness is
minus the sum of both (constant volume): beyond pure shear the sheet thickens, which is a tendency
to wrinkle, and strong thickening is more than the clearance of usual dies leaves room for. Margin,
both amounts of thickening and the colours are conventions.
"""
from typing import NamedTuple

import numpy as np


class Zone(NamedTuple):
    name: str
    colour: str


ZONES = (Zone("safe", "#8fc48b"), Zone("marginal", "#f2d24b"), Zone("crack", "#d1495b"),
         Zone("wrinkle tendency", "#7fb2e5"), Zone("strong thickening", "#8a6bbf"),
         Zone("not judged: no limit given", "#d0d0d0"))
SAFE, MARGINAL, CRACK, WRINKLE, THICKENING, NOT_JUDGED = range(len(ZONES))
LEAST = 0.005        # thickening [logarithmic] below which sheet counts as hardly strained


def add_arguments(command):
    """Options that move the borders of the zones."""
    command.add_argument("--margin", type=float, default=0.1, metavar="PART",
                         help="marginal is within this part below the limit (default: 0.1)")
    command.add_argument("--thickening", type=float, default=0.1, metavar="PART",
                         help="strong is thickening by more than this part (default: 0.1)")


class Borders:
    """Where the zones meet, for a limit curve or None."""

    def __init__(self, curve, arguments):
        self.curve = curve
        self.below_limit = NOT_JUDGED if curve is None else SAFE
        self.margin, self.thickening = arguments.margin, np.log1p(arguments.thickening)

    def far_from_limit(self, minor, major):
        """Number of the zone of each point if no limit is near."""
        thickening = -(minor + major)
        found = np.where(thickening > LEAST, WRINKLE, self.below_limit)
        return np.where(thickening > self.thickening, THICKENING, found)

    def far_levels(self, minor):
        """Zones far from the limit, and up to which major strain."""
        return [(THICKENING, -minor - self.thickening), (WRINKLE, -minor - LEAST)]

    def zone(self, minor, major):
        """Number of the zone of each point."""
        found = self.far_from_limit(minor, major)
        if self.curve is not None:
            share = self.share(minor, major)
            found = np.where(share > 1 - self.margin, MARGINAL, found)
            found = np.where(share > 1, CRACK, found)
        return found

    def share(self, minor, major):
        """Major strain over its limit; zero without a limit."""
        return np.zeros_like(major) if self.curve is None else major / self.curve(minor)

    def lines(self, minor, lowest, highest):
        """Zones and the major strains between which they lie at minor strains, from below."""
        levels = self.far_levels(minor)
        if self.curve is not None:
            limit = self.curve(minor)
            levels += [(SAFE, (1 - self.margin) * limit), (MARGINAL, limit)]
        levels.append((NOT_JUDGED if self.curve is None else CRACK, np.full_like(minor, highest)))
        below = np.maximum(minor, lowest)   # the major strain is not less than the minor one
        for zone, above in levels:
            above = np.clip(above, below, np.maximum(highest, below))
            yield zone, below, above
            below = above


class StressBorders(Borders):
    """The same of principal stresses, which say nothing of the thickness: the limit alone."""

    def far_from_limit(self, minor, major):
        return np.full_like(major, SAFE, dtype=int)

    def far_levels(self, minor):
        return []
