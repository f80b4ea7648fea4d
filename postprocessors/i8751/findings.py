"""The findings that only programs of this machine have."""

from __future__ import annotations

from camtool.findings import INFO, WARNING, Sentence
from camtool.toolpath.findings import ProgramCode

FEED_ROUNDED = Sentence(
    ProgramCode.FEED_ROUNDED,
    "the feed of {count:# move|# moves} is not written: the machine has one speed, and 8 steps a "
    "second in moves of less than 90 steps",
    severity=INFO,
)
MOVE_COLLAPSED = Sentence(
    ProgramCode.MOVE_COLLAPSED,
    "{measured:# move|# moves} of less than a step {measured:was|were} left out",
    "moves",
    INFO,
)
MOVE_SPLIT = Sentence(
    ProgramCode.MOVE_SPLIT,
    "{count:# feed move|# feed moves} in XY and Z became steps of at most {measured:g} mm, "
    "nowhere deeper than the slope, because Z moves alone",
    "mm",
    WARNING,
)
MOVE_SPLIT_ARCS = Sentence(
    ProgramCode.MOVE_SPLIT,
    "{arcs:# arc|# arcs} became {measured:# chord|# chords} within {tolerance:g} mm "
    "(dialect.arc_tolerance_mm)",
    "moves",
    INFO,
)
MOVE_SPLIT_LINES = Sentence(
    ProgramCode.MOVE_SPLIT,
    "{lines:# line|# lines} became {measured}, so that 45° and then one axis stay within "
    "{tolerance:g} mm of them (dialect.tolerance_mm)",
    "moves",
    INFO,
)
MOVE_SPLIT_LONG = Sentence(
    ProgramCode.MOVE_SPLIT,
    "{measured:# move|# moves} of more than {most} steps {measured:was|were} split",
    "moves",
    INFO,
)
VALUE_ROUNDED = Sentence(
    ProgramCode.VALUE_ROUNDED,
    "{count:# distance is|# distances are} no whole steps and {count:was|were} rounded, at most "
    "by {measured:.2f} steps",
    "steps",
)
VALUE_ROUNDED_DWELL = Sentence(
    ProgramCode.VALUE_ROUNDED, "{count:# dwell was|# dwells were} rounded up to whole seconds"
)
EVENT_LEFT_OUT_TOOL = Sentence(
    ProgramCode.EVENT_LEFT_OUT,
    "the program names no tool: mount it before the program",
    severity=INFO,
)
EVENT_LEFT_OUT_SPINDLE = Sentence(
    ProgramCode.EVENT_LEFT_OUT,
    "{count:# spindle event was|# spindle events were} left out: the machine cannot switch its "
    "spindle; do it by hand",
    severity=WARNING,
)
READ_TWO_WAYS = Sentence(
    ProgramCode.READ_TWO_WAYS,
    "{measured:# run|# runs} of a motor {measured:has|have} more than 255 steps, read by "
    "dialect.high_byte = {high_byte}, and by the other reading (255 or 256) a motor ends up to "
    "{steps:# step|# steps} elsewhere: post again in shorter runs, or, if you know the reading, "
    "use --set dialect.long_runs=true",
    "runs",
)
