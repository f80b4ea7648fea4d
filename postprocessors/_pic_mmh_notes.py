"""What the writer noticed while it wrote, counted, and told as one finding each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from camtool.findings import Code, Finding, Severity


@dataclass
class Notes:
    """Counts of one run of the writer; places name the first of each kind."""

    dropped: int = 0
    """Moves of less than a step."""
    arcs_as_lines: int = 0
    split: int = 0
    split_place: str = ""
    split_step_mm: float = 0.0
    far: int = 0
    """Arcs whose centre the dialect cannot say."""
    far_place: str = ""
    mended: int = 0
    remainder_um: float = 0.0
    remainder_place: str = ""
    rounded: int = 0
    rounded_place: str = ""

    def findings(self, step_um: float) -> list[Finding]:
        """One finding for each count that is not 0."""
        found = []
        if self.split:
            found.append(
                Finding(
                    Code.MOVE_SPLIT,
                    Severity.WARNING,
                    f"{self.split} feed moves in XY and Z became steps of at most "
                    f"{self.split_step_mm:g} mm, nowhere deeper than the slope, because a block "
                    "moves either XY or Z",
                    where=self.split_place,
                    measured=self.split_step_mm,
                    unit="mm",
                )
            )
        if collapsed := self.dropped + self.arcs_as_lines:
            found.append(
                Finding(
                    Code.MOVE_COLLAPSED,
                    Severity.INFO,
                    f"{self.dropped} moves of less than a step were left out, "
                    f"{self.arcs_as_lines} arcs too small to end as arcs were written as lines",
                    measured=float(collapsed),
                    unit="moves",
                )
            )
        if self.far:
            found.append(
                Finding(
                    Code.ARC_MENDED,
                    Severity.INFO,
                    f"{self.far} nearly straight arcs, whose centres have more than five digits "
                    "of µm, were written as lines within a step or unit of them",
                    where=self.far_place,
                    measured=float(self.far),
                    unit="moves",
                )
            )
        if self.mended:
            found.append(
                Finding(
                    Code.ARC_MENDED,
                    Severity.INFO,
                    f"{self.mended} arcs end on a step that the controller really meets, and a "
                    f"line goes on to the wanted end: at most {self.remainder_um:.2f} µm "
                    f"({self.remainder_um / step_um:.1f} steps)",
                    where=self.remainder_place,
                    measured=self.remainder_um,
                    unit="um",
                )
            )
        if self.rounded:
            found.append(
                Finding(
                    Code.VALUE_ROUNDED,
                    Severity.INFO,
                    f"{self.rounded} dwells (up) or spindle speeds (to the nearest) were rounded "
                    "to whole numbers",
                    where=self.rounded_place,
                )
            )
        return found


BUFFER_CHARS: Final = 35
"""Characters of the thesis's buffer (L1740-1742), which cannot have taken its own sample block."""


def too_long(blocks: list[str], buffer_chars: int | None) -> list[Finding]:
    """One BLOCK_TOO_LONG finding when blocks do not fit the controller's buffer: a remark where
    it is that of the thesis, which contradicts itself, and a warning where the user knows it."""
    lengths = [len(block) for block in blocks]
    limit = BUFFER_CHARS if buffer_chars is None else buffer_chars
    count = sum(length > limit for length in lengths)
    if not count:
        return []
    longest = max(lengths)
    message = (
        f"{count} blocks are longer than the controller's buffer of {limit} characters, the "
        f"longest has {longest}; use --set dialect.form=annex"
    )
    if buffer_chars is None:
        message = (
            f"{count} blocks have more than {limit} characters, up to {longest}: the thesis's "
            "sample block has 43, its buffer would hold 35; see that the controller's echo of the "
            "first one is whole, otherwise use --set dialect.form=annex"
        )
    return [
        Finding(
            Code.BLOCK_TOO_LONG,
            Severity.INFO if buffer_chars is None else Severity.WARNING,
            message,
            where=f"block {lengths.index(longest) + 1}",
            measured=float(longest),
            limit=float(limit),
            unit="chars",
        )
    ]
