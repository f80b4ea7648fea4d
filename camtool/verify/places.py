"""Places in words, for findings: points, blocks, and how many more there are."""

from __future__ import annotations

from camtool.geometry.polylines import Floats
from camtool.toolpath.moves import Toolpath

FINDINGS_PER_CODE = 20
"""No more findings of one kind are listed; the last one says how many there are."""


def at_point(point: Floats | tuple[float, float]) -> str:
    """`(1.234, 5.678) mm`."""
    return f"({float(point[0]):.3f}, {float(point[1]):.3f}) mm"


def block_name(toolpath: Toolpath, row: int) -> str:
    """`block 12` (from 1, as people count), or `move 12` when no program was read."""
    block = int(toolpath.block[row])
    return f"block {block + 1}" if block >= 0 else f"move {row + 1}"


def and_more(number: int, total: int, noun: str) -> str:
    """Text for the last finding that is listed, "" for all others."""
    more = total - FINDINGS_PER_CODE
    return f"; and {more} more {noun}" if more > 0 and number == FINDINGS_PER_CODE - 1 else ""
