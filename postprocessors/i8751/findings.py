"""The findings that only programs of this machine have."""

from __future__ import annotations

from camtool.findings import INFO, WARNING
from camtool.toolpath.findings import ProgramCode

FEED_ROUNDED = ProgramCode.FEED_ROUNDED.says(
    "the feed of {count:# move|# moves} is not written: the machine has one speed, and 8 steps a "
    "second in moves of less than 90 steps",
    severity=INFO,
)
MOVE_COLLAPSED = ProgramCode.MOVE_COLLAPSED.says(
    "{measured:# move|# moves} of less than a step {measured:was|were} left out", "moves", INFO
)
MOVE_SPLIT = ProgramCode.MOVE_SPLIT.says(
    "{count:# feed move|# feed moves} in XY and Z became steps of at most {measured:g} mm, "
    "nowhere deeper than the slope, because Z moves alone",
    "mm",
    WARNING,
)
MOVE_SPLIT_ARCS = ProgramCode.MOVE_SPLIT.says(
    "{arcs:# arc|# arcs} became {measured:# chord|# chords} within {tolerance:g} mm "
    "(dialect.arc_tolerance_mm)",
    "moves",
    INFO,
)
MOVE_SPLIT_LINES = ProgramCode.MOVE_SPLIT.says(
    "{lines:# line|# lines} became {measured}, so that 45° and then one axis stay within "
    "{tolerance:g} mm of them (dialect.tolerance_mm)",
    "moves",
    INFO,
)
MOVE_SPLIT_LONG = ProgramCode.MOVE_SPLIT.says(
    "{measured:# move|# moves} of more than {most} steps {measured:was|were} split", "moves", INFO
)
VALUE_ROUNDED = ProgramCode.VALUE_ROUNDED.says(
    "{count:# distance is|# distances are} no whole steps and {count:was|were} rounded, at most "
    "by {measured:.2f} steps",
    "steps",
)
VALUE_ROUNDED_DWELL = ProgramCode.VALUE_ROUNDED.says(
    "{count:# dwell was|# dwells were} rounded up to whole seconds"
)
EVENT_LEFT_OUT_TOOL = ProgramCode.EVENT_LEFT_OUT.says(
    "the program names no tool: mount it before the program", severity=INFO
)
EVENT_LEFT_OUT_SPINDLE = ProgramCode.EVENT_LEFT_OUT.says(
    "{count:# spindle event was|# spindle events were} left out: the machine cannot switch its "
    "spindle; do it by hand",
    severity=WARNING,
)
READ_TWO_WAYS = ProgramCode.READ_TWO_WAYS.says(
    "{measured:# run|# runs} of a motor {measured:has|have} more than 255 steps, read by "
    "dialect.high_byte = {high_byte}, and by the other reading (255 or 256) a motor ends up to "
    "{steps:# step|# steps} elsewhere: post again in shorter runs, or, if you know the reading, "
    "use --set dialect.long_runs=true",
    "runs",
)
