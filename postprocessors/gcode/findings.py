"""What is said of programs in G-code, whatever the machine."""

from __future__ import annotations

from camtool.findings import INFO, WARNING, Code, Sentence

FEED_ROUNDED = Sentence(
    Code.FEED_ROUNDED,
    "{count} feeds were rounded down to a whole {whole:g} mm/min",
    "mm_min",
    INFO,
)
ARC_MENDED = Sentence(
    Code.ARC_MENDED,
    "{measured} arcs would not have passed the controller's rule with their rounded numbers: "
    "{recentred} were re-centred, {split} split in two, {lines} written as lines",
    "arcs",
)
ARC_MENDED_PLAIN = Sentence(
    Code.ARC_MENDED,
    "{recentred} arcs got another centre, so that start and end lie on them as the program says "
    "their numbers; {lines} too small or too large were written as lines",
    "moves",
)
MOVE_COLLAPSED = Sentence(
    Code.MOVE_COLLAPSED,
    "{dropped} moves of less than the last decimal were left out, {flat} arcs flatter than half "
    "of it became lines",
    "moves",
    INFO,
)
MOVE_COLLAPSED_PLAIN = Sentence(
    Code.MOVE_COLLAPSED,
    "{dropped} moves of less than the last decimal were left out, {flat} arcs flatter than half "
    "of it were written as lines",
    "moves",
    INFO,
)
MOVE_SPLIT = Sentence(
    Code.MOVE_SPLIT,
    "{count} feed moves in XY and Z became steps of at most {measured:g} mm, flat and then down, "
    "or up and then flat: nowhere deeper than the slope",
    "mm",
    WARNING,
)
FEED_ABOVE_LIMIT_IN_WORDS = Sentence(
    Code.FEED_ABOVE_LIMIT,
    "{count} F words are above the machine's highest feed, up to {measured:g} mm/min where "
    "{limit:g} is the limit: the controller holds each move to what its axes can do, and so does "
    "the simulation",
    "mm_min",
    WARNING,
)
VALUE_ROUNDED = Sentence(
    Code.VALUE_ROUNDED, "{count} dwells or spindle speeds were rounded to three decimals"
)
WORDS_PASSED_OVER_COOLANT = Sentence(
    Code.WORDS_PASSED_OVER,
    "{count} blocks switch coolant, which moves nothing and is passed over",
)
WORDS_PASSED_OVER_PAUSE = Sentence(
    Code.WORDS_PASSED_OVER,
    "{count} blocks wait for the operator (M0, M1), which moves nothing and is passed over",
)
SPINDLE_SPEED_NOT_SAID = Sentence(
    Code.SPINDLE_SPEED_NOT_SAID,
    "the spindle is started and no S word has said its speed: a controller that sets the speed "
    "turns it at 0",
)
NEVER_READ = Sentence(
    Code.NEVER_READ,
    "{measured} lines stand behind the end of the program, which the controller never reads",
    "lines",
)
