"""The findings of programs in G-code, whatever the machine."""

from __future__ import annotations

from camtool.findings import INFO, WARNING, Sentence, TargetCode
from camtool.toolpath.findings import ProgramCode

FEED_ROUNDED = Sentence(
    ProgramCode.FEED_ROUNDED,
    "{count:# feed was|# feeds were} rounded down to a whole {whole:g} mm/min",
    "mm_min",
    INFO,
)
ARC_MENDED = Sentence(
    ProgramCode.ARC_MENDED,
    "{measured:# arc|# arcs} would have been refused by the controller after rounding: "
    "{recentred} re-centred, {split} split in two, {lines} written as lines",
    "arcs",
)
ARC_MENDED_PLAIN = Sentence(
    ProgramCode.ARC_MENDED,
    "{recentred:# arc|# arcs} got another centre, so that start and end lie on the arc with the "
    "numbers of the program; {lines} too small or too large {lines:was|were} written as {lines:a "
    "line|lines}",
    "moves",
)
MOVE_COLLAPSED = Sentence(
    ProgramCode.MOVE_COLLAPSED,
    "{dropped:# move|# moves} of less than the last decimal {dropped:was|were} left out, {flat:# "
    "arc|# arcs} flatter than half of it became {flat:a line|lines}",
    "moves",
    INFO,
)
MOVE_SPLIT = Sentence(
    ProgramCode.MOVE_SPLIT,
    "{count:# feed move|# feed moves} in XY and Z became steps of at most {measured:g} mm, flat "
    "and then down, or up and then flat: nowhere deeper than the slope",
    "mm",
    WARNING,
)
FEED_ABOVE_LIMIT_IN_WORDS = Sentence(
    ProgramCode.FEED_ABOVE_LIMIT,
    "{count:# F word is|# F words are} above the machine's highest feed, up to {measured:g} "
    "mm/min where {limit:g} is the limit: the controller runs each move as fast as its axes "
    "can, and so does the simulation",
    "mm_min",
    WARNING,
)
VALUE_ROUNDED = Sentence(
    ProgramCode.VALUE_ROUNDED,
    "{count:# dwell or spindle speed was|# dwells or spindle speeds were} rounded to three "
    "decimals",
)
WORDS_PASSED_OVER_COOLANT = Sentence(
    ProgramCode.WORDS_PASSED_OVER,
    "{count:# block switches|# blocks switch} coolant, which moves nothing and is skipped",
)
WORDS_PASSED_OVER_PAUSE = Sentence(
    ProgramCode.WORDS_PASSED_OVER,
    "{count:# block waits|# blocks wait} for the operator (M0, M1), which moves nothing and is "
    "skipped",
)
SPINDLE_SPEED_NOT_SAID = Sentence(
    ProgramCode.SPINDLE_SPEED_NOT_SAID,
    "the spindle is started before any S word: a controller that sets the speed turns it at 0; "
    "write S",
)
EVENT_LEFT_OUT_TOOL = Sentence(
    ProgramCode.EVENT_LEFT_OUT,
    "the program names no tool, because the machine changes none: mount it before the program",
    severity=INFO,
)
NEVER_READ = Sentence(
    ProgramCode.NEVER_READ,
    "{measured:# line stands|# lines stand} behind the end of the program, which the controller "
    "never reads",
    "lines",
)


def simulated_as_chords(code: TargetCode) -> Sentence:
    """Return the sentence of a target's own code for arcs that are not in XY."""
    return Sentence(
        code,
        "{measured:# arc|# arcs} in XZ or YZ {measured:is|are} simulated as chords that stray by "
        "no more than 0.0001 mm",
        "arcs",
        INFO,
    )
