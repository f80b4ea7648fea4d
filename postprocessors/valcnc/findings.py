"""The findings that only programs of this machine have."""

from __future__ import annotations

from camtool.findings import WARNING
from camtool.toolpath.findings import ProgramCode

FEED_ROUNDED = ProgramCode.FEED_ROUNDED.says(
    "the feed of {count:# move|# moves} is not written: the machine has one speed, {limit:g} "
    "mm/min",
    "mm_min",
    WARNING,
)
ARC_MENDED = ProgramCode.ARC_MENDED.says(
    "{measured:# arc was|# arcs were} written as lines within {tolerance:g} mm: on axes of "
    "unequal steps the controller would make ellipses of them",
    "moves",
)
EVENT_LEFT_OUT = ProgramCode.EVENT_LEFT_OUT.says(
    "{count:# event was|# events were} left out ({kinds}): this machine has no codes but G00 to "
    "G03; do it by hand",
    severity=WARNING,
)
COORDINATES_SCALED = ProgramCode.COORDINATES_SCALED.says(
    "the program writes {measured:g} for 1 mm; the thesis gives 200 steps a unit and 25 steps a "
    "mm: measure a move, then set dialect.coord_scale (1 if a unit moves 1 mm) and "
    "dialect.coord_scale_checked=true"
)
COORDINATES_SCALED_READ = ProgramCode.COORDINATES_SCALED.says(
    "lengths are the program's numbers divided by {measured:g} (dialect.coord_scale)"
)
ARC_MISSES_END = ProgramCode.ARC_MISSES_END.says(
    "{count:# arc|# arcs} of about 180°: the controller takes the angle from an arcsine and ends "
    "up to {measured:.3g} mm off",
    "mm",
    WARNING,
)
