"""The findings that only programs of this machine have."""

from __future__ import annotations

from camtool.findings import INFO, WARNING
from camtool.toolpath.findings import ProgramCode

BLOCK_TOO_LONG = ProgramCode.BLOCK_TOO_LONG.says(
    "{count:# block is|# blocks are} longer than the controller's buffer of {limit} characters, "
    "the longest has {measured}; use --set dialect.form=annex",
    "chars",
    WARNING,
)
BLOCK_TOO_LONG_PERHAPS = ProgramCode.BLOCK_TOO_LONG.says(
    "{count:# block has|# blocks have} more than {limit} characters, up to {measured}: the "
    "thesis's sample block has 43, its buffer would hold 35; check that the controller echoes "
    "the first one whole, otherwise use --set dialect.form=annex",
    "chars",
    INFO,
)
BLOCK_TOO_LONG_READ = ProgramCode.BLOCK_TOO_LONG.says(
    "{count:# block exceeds|# blocks exceed} the controller's buffer of {limit:.0f} characters, "
    "the longest has {measured:.0f}; use --set dialect.form=annex",
    "chars",
    WARNING,
)
FEED_ROUNDED = ProgramCode.FEED_ROUNDED.says(
    "the feed of {count:# move|# moves} was rounded down to whole steps of {limit:g} mm/min, at "
    "most from {feed:g} to {lowered:g}",
    "mm_min",
    INFO,
)
ARC_MENDED = ProgramCode.ARC_MENDED.says(
    "{count:# arc ends|# arcs end} on a step that the controller passes, and a line goes "
    "on to the wanted end: at most {measured:.2f} µm ({steps:.1f} steps)",
    "um",
)
ARC_MENDED_FLAT = ProgramCode.ARC_MENDED.says(
    "{measured:# nearly straight arc, whose centre has|# nearly straight arcs, whose centres "
    "have} more than five digits of µm, became {measured:a line|lines} within a step or unit of "
    "{measured:it|them}",
    "moves",
)
MOVE_COLLAPSED = ProgramCode.MOVE_COLLAPSED.says(
    "{dropped:# move|# moves} of less than a step {dropped:was|were} left out, {arcs:# arc|# "
    "arcs} too small to end as {arcs:an arc|arcs} became {arcs:a line|lines}",
    "moves",
    INFO,
)
MOVE_SPLIT = ProgramCode.MOVE_SPLIT.says(
    "{count:# feed move|# feed moves} in XY and Z became steps of at most {measured:g} mm, "
    "nowhere deeper than the slope, because a block moves either XY or Z",
    "mm",
    WARNING,
)
FEED_ABOVE_LIMIT = ProgramCode.FEED_ABOVE_LIMIT.says(
    "{count:# block has|# blocks have} a feed above what the link carries, up to {measured:g} "
    "mm/min: they run at {limit:.4g}",
    "mm_min",
    WARNING,
)
VALUE_ROUNDED = ProgramCode.VALUE_ROUNDED.says(
    "{count:# dwell (up) or spindle speed (to the nearest) was|# dwells (up) or spindle speeds "
    "(to the nearest) were} rounded to whole numbers"
)
ARC_END_UNSURE = ProgramCode.ARC_END_UNSURE.says(
    "{measured} of {arcs:# arc does|# arcs do} not stop on the end by every reading of the "
    "thesis (controller.arc_end): by equal {missed} run on past it ({missed_rounded} with "
    "initial_error=rounded-radius), by final-quadrant they stop up to {final_quadrant:.1f} steps "
    "beside it, by nearest up to {nearest:.1f}; the simulation takes {taken}",
    "arcs",
)
