"""The findings that only programs for grbl have."""

from __future__ import annotations

from camtool.findings import INFO, WARNING, Code, Sentence

EVENT_LEFT_OUT = Sentence(
    Code.EVENT_LEFT_OUT,
    "the program names no tool, because grbl has no tool change: mount it before the program",
    severity=INFO,
)
TOOL_BY_HAND = Sentence(
    Code.TOOL_BY_HAND,
    "the program stops {measured:# time|# times} for another tool ({tools}): mount it so that its "
    "tip is where that of the last one was, or set Z zero again; grbl does not jog while it "
    "stops, so either your sender holds M0 back, or write a program for each tool with --split "
    "tool",
    "stops",
    WARNING,
)
FEED_TOO_SLOW = Sentence(
    Code.FEED_TOO_SLOW,
    "{count:# cut is|# cuts are} slower than the controller can step (it makes no less than "
    "{least_hz:g} steps a second): F{measured:g} runs at {limit:.3g} mm/min, and is simulated so",
    "mm_min",
)
