"""What writers refuse before a block is made: a PostError that names the move and its source."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import PostError
from camtool.toolpath.moves import Toolpath


def refuse(
    toolpath: Toolpath,
    bad: Bools,
    message: str | Callable[[int], str],
    mend: str = "",
    *,
    rows: Ints | None = None,
) -> None:
    """PostError for the first bad row (N,), if there is one; `message` may be made of the row.

    `rows`: where `bad` is of a toolpath that was made of this one, this one's row of each.
    """
    if bad.any():
        row = int(np.argmax(bad)) if rows is None else int(rows[np.argmax(bad)])
        text = message if isinstance(message, str) else message(row)
        raise PostError(text, where=toolpath.place(row), mend=mend)


def refuse_start(toolpath: Toolpath) -> None:
    """A program starts at part zero."""
    if toolpath.start.any():
        x, y, z = toolpath.start.tolist()
        raise PostError(
            f"the toolpath starts at ({x:g}, {y:g}, {z:g}) mm, a program starts at part zero",
            mend="begin with a rapid from (0, 0, 0)",
        )


def refuse_two_radii(toolpath: Toolpath, most_mm: float) -> None:
    """The radii at the start and at the end of an arc may differ by `most_mm`, no more."""
    spread = radius_spread(toolpath)
    with np.errstate(invalid="ignore"):
        bad = toolpath.is_arc & ~(spread <= most_mm)
    refuse(
        toolpath,
        bad,
        lambda row: f"start and end differ by {spread[row]:g} mm in their distance to the centre",
        "give the arc one radius",
    )


def radius_spread(toolpath: Toolpath) -> Floats:
    """(N,) mm by which an arc's start and end differ in their distance to its centre; NaN for
    rows without a centre."""
    with np.errstate(invalid="ignore", over="ignore"):
        out, back = (p[:, :2] - toolpath.centre for p in (toolpath.starts, toolpath.end))
        return np.asarray(np.abs(np.hypot(*out.T) - np.hypot(*back.T)))
