"""Pockets: all within closed contours is cleared, except islands."""

from __future__ import annotations

import math

from camtool.errors import OptionError
from camtool.keys import FEED, Key, Value, engagement_angle, one_of, plain
from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, WALL_KEYS, OperationKind

STRATEGIES = ("passes", "adaptive")

MIN_ENGAGEMENT_RAD = math.radians(5.0)
MAX_ENGAGEMENT_RAD = math.radians(90.0)
"""Beside a straight cut a tool that is engaged by 90 degrees removes half of its diameter."""


def engagement(value: object) -> float:
    """Read the limit of engagement of an adaptive pocket, rad."""
    angle_rad = engagement_angle(value)
    if not MIN_ENGAGEMENT_RAD <= angle_rad <= MAX_ENGAGEMENT_RAD:
        raise OptionError(
            f"an engagement of {math.degrees(angle_rad):.3g}° is not within 5° and 90° (0.2 % and"
            " 50 % of the diameter)",
            mend='give a part of the diameter such as engagement = "15%", or an angle',
        )
    return angle_rad


POCKET = OperationKind(
    name="pocket",
    work="camtool.operations.pocket.work:pocket",
    propose="camtool.operations.pocket.proposal:propose",
    keys=(
        *COMMON_KEYS,
        *SELECTING_KEYS,
        *WALL_KEYS,
        "depth",
        "breakthrough",
        "step_down",
        "last_pass",
        "entry",
        "pattern",
        "rest",
        "step_over",
        "angle",
    ),
    own={
        "strategy": Key(
            "strategy", one_of(STRATEGIES), "How its engagement is kept.", default="passes"
        ),
        "engagement": Key(
            "engagement_rad",
            Value(plain(engagement), "PART|ANGLE"),
            "Limit of an adaptive pocket: part of the diameter, or angle.",
            '"15%"',
            only=("strategy", ("adaptive",)),
            default=math.acos(1.0 - 2.0 * 0.15),
        ),
        "link_feed": Key(
            "link_feed_mm_min",
            FEED,
            "Feed of links of an adaptive pocket, which cut nothing.",
            '"2000mm/min"',
            only=("strategy", ("adaptive",)),
        ),
    },
    rank=2,
    proposal_rank=4,
    cuts="within",
    leaves_walls=True,
    rest="corners",
    cut_name="pocket",
    reason="it is cleared as a pocket",
)
