"""The findings that only programs of this machine have."""

from __future__ import annotations

from camtool.findings import WARNING, Sentence
from camtool.toolpath.findings import ProgramCode

FEED_ROUNDED = Sentence(
    ProgramCode.FEED_ROUNDED,
    "the feed of {count:# move|# moves} is not written: the machine has one speed, {limit:g} "
    "mm/min",
    "mm_min",
    WARNING,
)
ARC_MENDED = Sentence(
    ProgramCode.ARC_MENDED,
    "{measured:# arc was|# arcs were} written as lines within {tolerance:g} mm: on axes of "
    "unequal steps the controller would make ellipses of them",
    "moves",
)
EVENT_LEFT_OUT = Sentence(
    ProgramCode.EVENT_LEFT_OUT,
    "{count:# event was|# events were} left out ({kinds}): this machine has no codes but G00 to "
    "G03; do it by hand",
    severity=WARNING,
)
COORDINATES_SCALED = Sentence(
    ProgramCode.COORDINATES_SCALED,
    "the program writes {measured:g} for 1 mm; the thesis gives 200 steps a unit and 25 steps a "
    "mm: measure a move, then set dialect.coord_scale (1 if a unit moves 1 mm) and "
    "dialect.coord_scale_checked=true",
)
COORDINATES_SCALED_READ = Sentence(
    ProgramCode.COORDINATES_SCALED,
    "lengths are the program's numbers divided by {measured:g} (dialect.coord_scale)",
)
ARC_MISSES_END = Sentence(
    ProgramCode.ARC_MISSES_END,
    "{count:# arc|# arcs} of about 180°: the controller takes the angle from an arcsine and ends "
    "up to {measured:.3g} mm off",
    "mm",
    WARNING,
)
