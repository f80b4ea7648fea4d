"""Keys by which an operation says how it limits the tool's engagement, for the kinds that can."""

from __future__ import annotations

import math
from typing import NamedTuple

from camtool.errors import OptionError
from camtool.keys import (
    FEED,
    LENGTH,
    Key,
    Value,
    engagement_angle,
    fraction,
    length,
    one_of,
    plain,
)

STRATEGIES = ("passes", "adaptive", "trochoidal")
LIMITED = STRATEGIES[1:]
"""Strategies that keep to a limit of engagement, for pockets and for profiles."""

SCALLOP_DISC_SHARE = 0.0216
"""An adaptive pocket clears what discs of tool centres with a radius of this share of the tool's
radius can cover. The rest of a corner stays as a scallop, ..."""

MAX_SCALLOP_DISCS = 5.0
"""... up to this many times as thick as the disc's radius, in corners of 19 degrees; anything
thicker that is left is no scallop."""

MIN_ENGAGEMENT_RAD = math.radians(5.0)
MAX_ENGAGEMENT_RAD = math.radians(90.0)
"""Largest limit of engagement: along a straight cut, a tool that is engaged by 90 degrees cuts
with half of its diameter."""


def engagement(value: object) -> float:
    """Read the limit of engagement that an operation keeps, rad."""
    angle_rad = engagement_angle(value)
    if not MIN_ENGAGEMENT_RAD <= angle_rad <= MAX_ENGAGEMENT_RAD:
        raise OptionError(
            f"an engagement of {math.degrees(angle_rad):.3g}° is not within 5° and 90° (0.2 % and"
            " 50 % of the diameter)",
            mend='give a part of the diameter such as engagement = "15%", or an angle',
        )
    return angle_rad


class SlotWidth(NamedTuple):
    """The width of a slot, in mm or as a multiple of the tool's diameter."""

    amount: float
    is_part: bool

    def mm(self, diameter_mm: float) -> float:
        """Return the width for a tool of this diameter, mm."""
        return self.amount * diameter_mm if self.is_part else self.amount


def width(value: object) -> SlotWidth:
    """Read a width of slots: a length, or a percentage of the tool's diameter such as "150%"."""
    if isinstance(value, str) and value.strip().endswith("%"):
        return SlotWidth(fraction(value), True)
    return SlotWidth(length(value), False)


LIMIT_KEYS = {
    "strategy": Key(
        "strategy", one_of(STRATEGIES), "How its engagement is kept.", default="passes"
    ),
    "engagement": Key(
        "engagement_rad",
        Value(plain(engagement), "PART|ANGLE"),
        "Limit of the engagement: part of the diameter, or angle.",
        '"15%"',
        only=("strategy", LIMITED),
        default=math.acos(1.0 - 2.0 * 0.15),
    ),
    "link_feed": Key(
        "link_feed_mm_min",
        FEED,
        "Feed of links, which cut nothing.",
        '"2000mm/min"',
        only=("strategy", LIMITED),
    ),
    "lift": Key(
        "lift_mm",
        LENGTH,
        "Height by which links are lifted.",
        '"0.2mm"',
        only=("strategy", LIMITED),
        default=0.0,
    ),
    "max_feed": Key(
        "max_feed_mm_min",
        FEED,
        "Greatest feed, where less engagement makes thinner chips.",
        '"1500mm/min"',
        only=("strategy", LIMITED),
    ),
}

SLOT_KEYS = {
    "slot_width": Key(
        "slot_width",
        Value(plain(width), "LENGTH|PART"),
        "Width of a trochoidal slot.",
        '"150%"',
        only=("strategy", ("trochoidal",)),
        default=SlotWidth(1.5, True),
    )
}
