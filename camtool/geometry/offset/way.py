"""What is asked of an offset: how far, and what is put about outer corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

from camtool.errors import GeometryError, OptionError
from camtool.geometry.offset.options import DEFAULT_OPTIONS, SHARP_LIMIT, OffsetOptions
from camtool.geometry.polylines import POSITION_EPS_MM

JOINS = ("round", "mitre", "sharp")


@dataclass(frozen=True)
class Way:
    """An offset to the left by `distance_mm` > 0. `limit` is inf for round joins; else a corner
    may be so many times the distance away from the source, and is cut off there.

    `both_sides` says that the left of the paths is all there is around them (`there_and_back`).
    """

    distance_mm: float
    limit: float = math.inf
    both_sides: bool = False
    options: OffsetOptions = DEFAULT_OPTIONS

    @property
    def is_round(self) -> bool:
        """Whether arcs go about outer corners."""
        return math.isinf(self.limit)


def limit_of(joins: str, mitre_limit: float) -> float:
    """The limit of a `Way`; OptionError for joins that do not exist and a limit below 1."""
    if joins not in JOINS:
        raise OptionError(f"no joins are called {joins!r}", mend=f"use one of {', '.join(JOINS)}")
    if joins == "mitre" and not 1.0 <= mitre_limit < math.inf:
        mend = "at 1 corners are cut off where an arc would be, at 2 those sharper than 60°"
        raise OptionError(f"a mitre limit of {mitre_limit} is not 1 or more", mend=mend)
    return {"round": math.inf, "sharp": SHARP_LIMIT}.get(joins, mitre_limit)


def is_nothing(distance_mm: float) -> bool:
    """True for a distance that moves nothing; GeometryError when it is not finite."""
    if not math.isfinite(distance_mm):
        raise GeometryError(f"an offset of {distance_mm} mm is not finite")
    return abs(distance_mm) <= POSITION_EPS_MM
