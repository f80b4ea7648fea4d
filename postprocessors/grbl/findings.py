"""The findings that only programs for grbl have."""

from __future__ import annotations

from camtool.findings import INFO, Code, Sentence

EVENT_LEFT_OUT = Sentence(
    Code.EVENT_LEFT_OUT,
    "the program names no tool, because grbl has no tool change: mount it before the program",
    severity=INFO,
)
FEED_TOO_SLOW = Sentence(
    Code.FEED_TOO_SLOW,
    "{count:# cut is|# cuts are} slower than the controller can step (it makes no less than "
    "{least_hz:g} steps a second): F{measured:g} runs at {limit:.3g} mm/min, and is simulated so",
    "mm_min",
)
