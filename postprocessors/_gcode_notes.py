"""What the readers of G-code noticed, and tell as one finding each."""

from __future__ import annotations

from dataclasses import dataclass, field

from camtool.findings import Code, Finding, Severity


@dataclass
class ReadNotes:
    """Blocks (index from 0) of one run of a reader; `fast` with their feeds, mm/min."""

    max_feed_mm_min: float
    fast: list[tuple[int, float]] = field(default_factory=list)
    coolant: list[int] = field(default_factory=list)
    pauses: list[int] = field(default_factory=list)
    speedless: list[int] = field(default_factory=list)
    behind_end: tuple[int, int] | None = None
    """How many lines stand behind the end, and the first of them (from 1)."""

    def findings(self) -> tuple[Finding, ...]:
        """One finding for each kind that was noticed."""
        passed_over = (
            (self.coolant, "switch coolant"),
            (self.pauses, "wait for the operator (M0, M1)"),
        )
        return (
            *([self._too_fast()] if self.fast else []),
            *([self._without_speed()] if self.speedless else []),
            *([_never_read(*self.behind_end)] if self.behind_end else []),
            *(_passed_over(blocks, what) for blocks, what in passed_over if blocks),
        )

    def _without_speed(self) -> Finding:
        return Finding(
            Code.SPINDLE_SPEED_NOT_SAID,
            Severity.WARNING,
            "the spindle is started and no S word has said its speed: a controller that sets the "
            "speed turns it at 0",
            where=f"block {self.speedless[0] + 1}",
        )

    def _too_fast(self) -> Finding:
        most = max(feed for _, feed in self.fast)
        return Finding(
            Code.FEED_ABOVE_LIMIT,
            Severity.WARNING,
            f"{len(self.fast)} F words are above the machine's highest feed, up to "
            f"{most:g} mm/min where {self.max_feed_mm_min:g} is the limit: the controller holds "
            "each move to what its axes can do, and so does the simulation",
            where=f"block {self.fast[0][0] + 1}",
            measured=most,
            limit=self.max_feed_mm_min,
            unit="mm_min",
        )


def _never_read(count: int, line: int) -> Finding:
    return Finding(
        Code.NEVER_READ,
        Severity.WARNING,
        f"{count} lines stand behind the end of the program, which the controller never reads",
        where=f"line {line}",
        measured=float(count),
        unit="lines",
    )


def _passed_over(blocks: list[int], what: str) -> Finding:
    return Finding(
        Code.WORDS_PASSED_OVER,
        Severity.INFO,
        f"{len(blocks)} blocks {what}, which moves nothing and is passed over",
        where=f"block {blocks[0] + 1}",
    )
