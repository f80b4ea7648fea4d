"""The findings of programs in G-code, whatever the machine."""

from __future__ import annotations

from camtool.findings import INFO, WARNING, Sentence, TargetCode
from camtool.toolpath.findings import ProgramCode

FEED_ROUNDED = ProgramCode.FEED_ROUNDED.says(
    "{count:# feed was|# feeds were} rounded down to a whole {whole:g} mm/min", "mm_min", INFO
)
ARC_MENDED = ProgramCode.ARC_MENDED.says(
    "{measured:# arc|# arcs} would have been refused by the controller after rounding: "
    "{recentred} re-centred, {split} split in two, {lines} written as lines",
    "arcs",
)
ARC_MENDED_PLAIN = ProgramCode.ARC_MENDED.says(
    "{recentred:# arc|# arcs} got another centre, so that start and end lie on the arc with the "
    "numbers of the program; {lines} too small or too large {lines:was|were} written as {lines:a "
    "line|lines}",
    "moves",
)
MOVE_COLLAPSED = ProgramCode.MOVE_COLLAPSED.says(
    "{dropped:# move|# moves} of less than the last decimal {dropped:was|were} left out, {flat:# "
    "arc|# arcs} flatter than half of it became {flat:a line|lines}",
    "moves",
    INFO,
)
MOVE_SPLIT = ProgramCode.MOVE_SPLIT.says(
    "{count:# feed move|# feed moves} in XY and Z became steps of at most {measured:g} mm, flat "
    "and then down, or up and then flat: nowhere deeper than the slope",
    "mm",
    WARNING,
)
FEED_ABOVE_LIMIT_IN_WORDS = ProgramCode.FEED_ABOVE_LIMIT.says(
    "{count:# F word is|# F words are} above the machine's highest feed, up to {measured:g} "
    "mm/min where {limit:g} is the limit: the controller runs each move as fast as its axes "
    "can, and so does the simulation",
    "mm_min",
    WARNING,
)
VALUE_ROUNDED = ProgramCode.VALUE_ROUNDED.says(
    "{count:# dwell or spindle speed was|# dwells or spindle speeds were} rounded to three "
    "decimals"
)
WORDS_PASSED_OVER_COOLANT = ProgramCode.WORDS_PASSED_OVER.says(
    "{count:# block switches|# blocks switch} coolant, which moves nothing and is skipped"
)
WORDS_PASSED_OVER_PAUSE = ProgramCode.WORDS_PASSED_OVER.says(
    "{count:# block waits|# blocks wait} for the operator (M0, M1), which moves nothing and is "
    "skipped"
)
SPINDLE_SPEED_NOT_SAID = ProgramCode.SPINDLE_SPEED_NOT_SAID.says(
    "the spindle is started before any S word: a controller that sets the speed turns it at 0; "
    "write S"
)
EVENT_LEFT_OUT_TOOL = ProgramCode.EVENT_LEFT_OUT.says(
    "the program names no tool, because the machine changes none: mount it before the program",
    severity=INFO,
)
NEVER_READ = ProgramCode.NEVER_READ.says(
    "{measured:# line stands|# lines stand} behind the end of the program, which the controller "
    "never reads",
    "lines",
)


def simulated_as_chords(code: TargetCode) -> Sentence:
    """Return the sentence of a target's own code for arcs that are not in XY."""
    return code.says(
        "{measured:# arc|# arcs} in XZ or YZ {measured:is|are} simulated as chords that stray by "
        "no more than 0.0001 mm",
        "arcs",
        INFO,
    )
