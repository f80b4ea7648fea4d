"""What the writer changed, counted, and told as one finding each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from camtool.findings import Code, Finding, Severity

from ._matlab_router_options import UNIT_MM, Dialect

FEED_NOTICE: Final = 1e-6
"""A feed that is off by less than this many mm/min is as wanted."""

SNAP_NOTICE_MM: Final = 1e-6
"""A vertex that is moved by less lies on the grid already."""


@dataclass
class Notes:
    """Counts of one run of the writer; places name the worst or the first of each kind."""

    snap_mm: float = 0.0
    snap_place: str = ""
    late_starts: int = 0
    ones: int = 0
    dropped: int = 0
    lost_strokes: int = 0
    lost_place: str = ""
    bent: int = 0
    more_jobs: int = 0
    limited: int = 0
    feed_off: float = 0.0
    faster: float = 1.0

    def snapped(self, moved_mm: float, place: str) -> None:
        """A stroke whose worst vertex was moved by this much."""
        if moved_mm > max(self.snap_mm, SNAP_NOTICE_MM):
            self.snap_mm, self.snap_place = moved_mm, place

    def lost(self, place: str) -> None:
        """A stroke of which nothing is left on the grid."""
        self.lost_strokes += 1
        self.lost_place = self.lost_place or place

    def findings(self, dialect: Dialect) -> list[Finding]:
        """One finding for each kind of change that was made."""
        return [*self._places(dialect), *self._lines(dialect), *self._feeds()]

    def _places(self, dialect: Dialect) -> list[Finding]:
        grid_mm = dialect.grid_units * UNIT_MM
        found = []
        if self.snap_mm:
            starts = (
                f"; {self.late_starts} strokes begin at least {grid_mm:g} mm from home, because"
                " the way to a first point of 0 would never end"
                if self.late_starts
                else ""
            )
            found.append(
                Finding(
                    Code.PLACES_SNAPPED,
                    Severity.WARNING,
                    f"vertices were moved to the grid of {grid_mm:g} mm, by"
                    f" {self.snap_mm * 1000.0:.0f} µm at most{starts}",
                    where=self.snap_place,
                    measured=self.snap_mm,
                    limit=grid_mm,
                    unit="mm",
                )
            )
        if self.ones:
            found.append(
                Finding(
                    Code.PLACES_SNAPPED,
                    Severity.WARNING,
                    f"{self.ones} vertices were moved by 0.1 mm, because a distance of 0.1 mm"
                    " would never end",
                    measured=float(self.ones),
                )
            )
        return found

    def _lines(self, dialect: Dialect) -> list[Finding]:
        grid_mm = dialect.grid_units * UNIT_MM
        found = []
        if self.lost_strokes:
            found.append(
                Finding(
                    Code.MOVE_COLLAPSED,
                    Severity.WARNING,
                    f"{self.lost_strokes} strokes are smaller than the grid of {grid_mm:g} mm and"
                    " are not cut at all; scale the drawing up",
                    where=self.lost_place,
                    measured=float(self.lost_strokes),
                    unit="strokes",
                )
            )
        if self.dropped:
            found.append(
                Finding(
                    Code.MOVE_COLLAPSED,
                    Severity.INFO,
                    f"{self.dropped} lines shorter than the grid of {grid_mm:g} mm were left out",
                    measured=float(self.dropped),
                    unit="moves",
                )
            )
        if self.bent:
            found.append(
                Finding(
                    Code.MOVE_SPLIT,
                    Severity.INFO,
                    f"{self.bent} lines nearly along an axis became several, because whole speeds"
                    f" would bend them by more than {dialect.bend_tolerance_mm:g} mm",
                    measured=float(self.bent),
                    unit="moves",
                )
            )
        if self.more_jobs:
            found.append(
                Finding(
                    Code.MOVE_SPLIT,
                    Severity.WARNING,
                    f"strokes of more than {dialect.max_lines} lines became {self.more_jobs} more"
                    " jobs: between two jobs the machine goes home, and begins where it ended",
                    measured=float(self.more_jobs),
                    unit="jobs",
                )
            )
        return found

    def _feeds(self) -> list[Finding]:
        found = []
        if self.limited:
            found.append(
                Finding(
                    Code.FEED_ROUNDED,
                    Severity.WARNING,
                    f"{self.limited} lines run at the highest speed of an axis, less than wanted",
                    measured=float(self.limited),
                    unit="moves",
                )
            )
        if self.feed_off > FEED_NOTICE:
            found.append(
                Finding(
                    Code.FEED_ROUNDED,
                    Severity.INFO,
                    "feeds were rounded to whole counts of the encoder in 5 ms, by"
                    f" {self.feed_off:.3g} mm/min at most",
                    measured=self.feed_off,
                    unit="mm_min",
                )
            )
        if self.faster > 1.0:
            found.append(
                Finding(
                    Code.FEED_ROUNDED,
                    Severity.INFO,
                    "the feed is that of the faster axis: on slanted lines the tool runs up to"
                    f" {self.faster:.2f} times as fast; use --set dialect.speed=path",
                    measured=self.faster,
                    unit="times",
                )
            )
        return found
