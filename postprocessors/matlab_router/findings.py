"""The findings that only programs of this machine have."""

from __future__ import annotations

from camtool.findings import ERROR, INFO, WARNING
from camtool.toolpath.findings import ProgramCode

OUT_OF_TRAVEL = ProgramCode.OUT_OF_TRAVEL.says(
    "points outside of the machine's area: {count}, up to {measured:.1f} mm from home", "mm"
)
FEED_ROUNDED = ProgramCode.FEED_ROUNDED.says(
    "feeds were rounded to whole counts of the encoder in 5 ms, by {measured:.3g} mm/min at most",
    "mm_min",
    INFO,
)
FEED_ROUNDED_TO_LIMIT = ProgramCode.FEED_ROUNDED.says(
    "{measured:# line runs|# lines run} at the highest speed of an axis, less than wanted",
    "moves",
    WARNING,
)
FEED_ROUNDED_UP = ProgramCode.FEED_ROUNDED.says(
    "the feed is that of the faster axis: on slanted lines the tool runs up to {measured:.2f} "
    "times as fast; use --set dialect.speed=path",
    "times",
    INFO,
)
MOVE_COLLAPSED = ProgramCode.MOVE_COLLAPSED.says(
    "{measured:# line|# lines} shorter than the grid of {grid:g} mm {measured:was|were} left out",
    "moves",
    INFO,
)
MOVE_COLLAPSED_STROKES = ProgramCode.MOVE_COLLAPSED.says(
    "{measured:# stroke is|# strokes are} smaller than the grid of {grid:g} mm and not cut at "
    "all; scale the drawing up",
    "strokes",
    WARNING,
)
MOVE_COLLAPSED_READ = ProgramCode.MOVE_COLLAPSED.says("lines of no length: {count}", "mm", INFO)
MOVE_SPLIT = ProgramCode.MOVE_SPLIT.says(
    "{measured:# move|# moves} in XY and Z {measured:was|were} split: up first, down last, "
    "because Z only goes from home to its one depth",
    "moves",
    WARNING,
)
MOVE_SPLIT_BENT = ProgramCode.MOVE_SPLIT.says(
    "{measured:# line|# lines} nearly along an axis became several, because whole speeds would "
    "bend {measured:it|them} by more than {tolerance:g} mm",
    "moves",
    INFO,
)
MOVE_SPLIT_INTO_JOBS = ProgramCode.MOVE_SPLIT.says(
    "strokes of more than {most} lines became {measured:# more job|# more jobs}: between two "
    "jobs the machine goes home, and begins where it ended",
    "jobs",
    WARNING,
)
FEED_ABOVE_LIMIT = ProgramCode.FEED_ABOVE_LIMIT.says(
    "speeds above the limit of an axis: {count}, up to {measured:.4g} mm/min", "mm_min", ERROR
)
EVENT_LEFT_OUT_DWELL = ProgramCode.EVENT_LEFT_OUT.says(
    "{measured:# dwell is|# dwells are} not sent: the arrays have no place for {measured:it|them}",
    severity=WARNING,
)
EVENT_LEFT_OUT_TOOL = ProgramCode.EVENT_LEFT_OUT.says(
    "{measured:# tool number is|# tool numbers are} not sent: the arrays have no place for "
    "{measured:it|them}",
    severity=INFO,
)
EVENT_LEFT_OUT_SPEED = ProgramCode.EVENT_LEFT_OUT.says(
    "{measured:# spindle speed is|# spindle speeds are} not sent: the arrays have no place for "
    "{measured:it|them}",
    severity=INFO,
)
PLACES_SNAPPED = ProgramCode.PLACES_SNAPPED.says(
    "vertices were moved to the grid of {limit:g} mm, by {moved_um:.0f} µm at most", "mm"
)
PLACES_SNAPPED_AND_STARTS = ProgramCode.PLACES_SNAPPED.says(
    "vertices were moved to the grid of {limit:g} mm, by {moved_um:.0f} µm at most; {starts:# "
    "stroke begins|# strokes begin} at least {limit:g} mm from home, because the slave never "
    "ends a distance of 0",
    "mm",
)
PLACES_SNAPPED_FROM_ONE = ProgramCode.PLACES_SNAPPED.says(
    "{measured:# vertex was|# vertices were} moved by 0.1 mm, because the slave never ends a "
    "distance of 0.1 mm"
)
EXECUTED_OTHERWISE_ODD = ProgramCode.EXECUTED_OTHERWISE.says(
    "odd distances are cut short by 0.1 mm each, because the slaves run chunks of 0.2 mm: "
    "{count}; places are off by {measured:.1f} mm at most; use --set dialect.grid_mm=0.2",
    "mm",
)
EXECUTED_OTHERWISE_START = ProgramCode.EXECUTED_OTHERWISE.says(
    "jobs that begin at Y {start:g} mm, whatever the program says: {count}; if your master "
    "starts where the program says, use --set dialect.master_y=sent",
    "mm",
)
EXECUTED_OTHERWISE_BENT = ProgramCode.EXECUTED_OTHERWISE.says(
    "lines that are bent by their speeds, because one axis arrives first: {count}, by "
    "{measured:.2f} mm at most",
    "mm",
)
