"""What is said of programs of this machine alone."""

from __future__ import annotations

from camtool.findings import INFO, WARNING, Code, Sentence

FEED_ROUNDED = Sentence(
    Code.FEED_ROUNDED,
    "the feeds of {count} moves are not said: the machine has one speed, and 8 steps a second in "
    "moves of less than 90 steps",
    severity=INFO,
)
MOVE_COLLAPSED = Sentence(
    Code.MOVE_COLLAPSED, "{measured} moves of less than a step were left out", "moves", INFO
)
MOVE_SPLIT = Sentence(
    Code.MOVE_SPLIT,
    "{count} feed moves in XY and Z became steps of at most {measured:g} mm, nowhere deeper than "
    "the slope, because Z moves alone",
    "mm",
    WARNING,
)
MOVE_SPLIT_ARCS = Sentence(
    Code.MOVE_SPLIT,
    "{arcs} arcs became {measured} chords within {tolerance:g} mm (dialect.arc_tolerance_mm)",
    "moves",
    INFO,
)
MOVE_SPLIT_LINES = Sentence(
    Code.MOVE_SPLIT,
    "{lines} lines became {measured}, so that 45° and then one axis stay within {tolerance:g} mm "
    "of them (dialect.tolerance_mm)",
    "moves",
    INFO,
)
MOVE_SPLIT_LONG = Sentence(
    Code.MOVE_SPLIT, "{measured} moves of more than {most} steps were split", "moves", INFO
)
VALUE_ROUNDED = Sentence(
    Code.VALUE_ROUNDED,
    "{count} distances are no whole steps and were rounded, at most by {measured:.2f} steps",
    "steps",
)
VALUE_ROUNDED_DWELL = Sentence(
    Code.VALUE_ROUNDED, "{count} dwells were rounded up to whole seconds"
)
EVENT_LEFT_OUT_TOOL = Sentence(
    Code.EVENT_LEFT_OUT, "the tool is not said: mount it before the program", severity=INFO
)
EVENT_LEFT_OUT_SPINDLE = Sentence(
    Code.EVENT_LEFT_OUT,
    "{count} spindle events were left out: the machine cannot switch its spindle; do it by hand",
    severity=WARNING,
)
READ_TWO_WAYS = Sentence(
    Code.READ_TWO_WAYS,
    "{measured} runs of a motor have more than 255 steps; they are read by dialect.high_byte = "
    "{high_byte}, and by the other reading (255 or 256) a motor ends up to {steps} steps "
    "elsewhere: post again in shorter runs, or say dialect.long_runs=true where it is known",
    "runs",
)
