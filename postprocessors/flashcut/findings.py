"""The findings that only programs of this machine have."""

from __future__ import annotations

from camtool.findings import WARNING
from camtool.toolpath.findings import ProgramCode

FEED_ABOVE_LIMIT = ProgramCode.FEED_ABOVE_LIMIT.says(
    "{count:# block has|# blocks have} a feed above what the machine's shortest half period "
    "gives, up to {measured:g} mm/min where {limit:.4g} is the limit: the controller "
    "runs them at the limit, and so does the simulation",
    "mm_min",
    WARNING,
)
VALUE_ROUNDED = ProgramCode.VALUE_ROUNDED.says(
    "{speeds:# spindle speed|# spindle speeds} and {tools:# tool number|# tool numbers} cannot "
    "be written: the spindle turns with the feed, and M00 waits for the tool"
)
EVENT_LEFT_OUT_DWELL = ProgramCode.EVENT_LEFT_OUT.says(
    "{count:# event was|# events were} left out ({kinds}): this controller has no dwell",
    severity=WARNING,
)
EVENT_LEFT_OUT_STOP = ProgramCode.EVENT_LEFT_OUT.says(
    "{count:# event was|# events were} left out ({kinds}): M05 is written, but this machine's "
    "spindle turns with every move",
    severity=WARNING,
)
EXECUTED_OTHERWISE = ProgramCode.EXECUTED_OTHERWISE.says(
    "{count:# straight move|# straight moves} of both axes {count:makes its|make their} shorter "
    "one too long, by up to {steps:# step|# steps} ({measured:.1f} µm), because each axis has a "
    "timer of its own{stays:|; it stays in all that follows|}. To lower it, use longer half "
    "periods (controller.half_period_ms) or lines in pieces (dialect.slants=split){rapids:|, "
    "rapids along one axis at a time (dialect.rapids=one-axis)|}",
    "um",
)
FEED_HELD = ProgramCode.FEED_HELD.says(
    "{count:# cut is slower than its F|# cuts are slower than their F}: F{limit:g} becomes "
    "{measured:.3g} mm/min of both axes, because of the shortest half "
    "period (controller.half_period_ms, controller.single_axis_half_period_ms); a shorter one "
    "makes slanted lines less exact",
    "mm_min",
)
FEED_HELD_ALONE = ProgramCode.FEED_HELD.says(
    "{count:# cut is slower than its F|# cuts are slower than their F}: F{limit:g} becomes "
    "{measured:.3g} mm/min along one axis, because of the shortest half period "
    "(controller.half_period_ms, controller.single_axis_half_period_ms); a shorter one makes "
    "slanted lines less exact",
    "mm_min",
)
