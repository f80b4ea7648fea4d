"""Checks before a writer makes blocks: a PostError names the move and its source."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import PostError
from camtool.toolpath.moves import Toolpath


def refuse(
    toolpath: Toolpath,
    is_bad: Bools,
    message: str | Callable[[int], str],
    mend: str = "",
    *,
    rows: Ints | None = None,
) -> None:
    """Raise PostError for the first row of the mask `is_bad` (N,); `message` may be a function of
    the row.

    `rows` maps rows of `is_bad` to rows of `toolpath`, where `is_bad` is of a toolpath made from
    it."""
    if is_bad.any():
        row = int(np.argmax(is_bad)) if rows is None else int(rows[np.argmax(is_bad)])
        text = message if isinstance(message, str) else message(row)
        raise PostError(text, where=toolpath.place(row), mend=mend)


def refuse_start(toolpath: Toolpath) -> None:
    """Refuse a toolpath that does not start at part zero."""
    if toolpath.start.any():
        x, y, z = toolpath.start.tolist()
        raise PostError(
            f"the toolpath starts at ({x:g}, {y:g}, {z:g}) mm, a program starts at part zero",
            mend="begin with a rapid from (0, 0, 0)",
        )


def refuse_two_radii(toolpath: Toolpath, max_mm: float) -> None:
    """Refuse arcs whose radii at start and end differ by more than `max_mm`."""
    centred = np.isfinite(toolpath.centre).all(axis=1)
    refuse(
        toolpath, toolpath.is_arc & ~centred, "an arc without a centre", "give the arc a centre"
    )
    first, last = radii(toolpath)
    with np.errstate(invalid="ignore", over="ignore"):
        spread = np.abs(first - last)
        is_bad = toolpath.is_arc & ~(spread <= max_mm)
    refuse(
        toolpath,
        is_bad,
        lambda row: (
            f"the radii at start and end of an arc differ by {spread[row]:.4f} mm"
            f" ({first[row]:.4f} and {last[row]:.4f} mm)"
        ),
        f"they may differ by {max_mm:g} mm",
    )


def radii(toolpath: Toolpath) -> tuple[Floats, Floats]:
    """Compute the radii (N,) mm of arcs at their start and at their end; NaN for rows without a
    centre."""
    with np.errstate(invalid="ignore", over="ignore"):
        start_arm, end_arm = (p[:, :2] - toolpath.centre for p in (toolpath.starts, toolpath.end))
        return np.hypot(*start_arm.T), np.hypot(*end_arm.T)
