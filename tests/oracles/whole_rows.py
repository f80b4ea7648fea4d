"""The figures of rows from the judge's columns of all of them, row by row."""

import math
from typing import Any

import numpy as np

from camtool.kernels import judging as at
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification.figures import END_STEPS
from camtool.verification.matching import Match


def whole_rows(
    columns: np.ndarray, cut: np.ndarray, match: Match, decoded: Toolpath, ended: np.ndarray
) -> list[dict[str, Any]]:
    """Of each row: its number, the largest error of interpolation, mechanics and total, NaN where
    there is none, and what else the figures are made of."""
    rows = []
    for row, column in enumerate(columns):
        judged = bool(cut[row]) and column[at.SAMPLES] > 0
        known = column[at.KNOWN] > 0
        off = np.abs(column[[at.COMMANDED_X, at.COMMANDED_Y]] - decoded.end[row, :2])
        rows.append(
            {
                "row": row,
                "samples": int(column[at.SAMPLES]) if cut[row] else 0,
                "known": int(column[at.KNOWN]),
                "inner": column[at.INNER_MAX] if judged else math.nan,
                "lag": column[at.LAG_MAX] if judged else math.nan,
                "total": column[at.TOTAL_MAX] if known else math.nan,
                "squares": column[at.TOTAL_SQUARES],
                "sum": column[at.TOTAL_SUM],
                "at": (column[at.TOTAL_X], column[at.TOTAL_Y]),
                "arc": decoded.kind[row] in (Kind.ARC_CW, Kind.ARC_CCW),
                "contour": int(match.contour[row]),
                "fit": match.off_mm[row],
                "off": [0.0, 0.0] if math.isnan(off[0]) else off.tolist(),
                "ended": bool(ended[row]),
            }
        )
    return rows


def most(rows: list[dict[str, Any]], name: str) -> float:
    """The largest known value; NaN without any."""
    return max((one[name] for one in rows if not math.isnan(one[name])), default=math.nan)


def worst(rows: list[dict[str, Any]], count: int) -> list[tuple[float, ...]]:
    """The rows with the largest total errors, worst first, of equals the first."""
    known = sorted((one for one in rows if one["known"]), key=lambda one: -one["total"])
    return [
        (one["row"], one["total"], one["inner"], one["lag"], *one["at"]) for one in known[:count]
    ]


def contours(rows: list[dict[str, Any]]) -> list[tuple[Any, ...]]:
    """Contour, row and place of the largest error, this, the root of the mean square, the mean,
    and the largest errors of interpolation, mechanics and fit."""
    found = []
    for contour in sorted({one["contour"] for one in rows if one["known"]} - {-1}):
        mine = [one for one in rows if one["known"] and one["contour"] == contour]
        samples = sum(one["known"] for one in mine)
        top = max(mine, key=lambda one: one["total"])
        rms = math.sqrt(sum(one["squares"] for one in mine) / samples)
        mean = sum(one["sum"] for one in mine) / samples
        largest = [max(0.0, *(one[name] for one in mine)) for name in ("inner", "lag", "fit")]
        found.append((contour, top["row"], top["at"], top["total"], rms, mean, *largest))
    return found


def missed(rows: list[dict[str, Any]], steps_mm: tuple[float, float]) -> tuple[int, int, float]:
    """Count the rows that end beside their ends, with the largest distance."""
    beside = [
        one
        for one in rows
        if any(off > END_STEPS * step for off, step in zip(one["off"], steps_mm, strict=True))
    ]
    far = max(beside, key=lambda one: math.hypot(*one["off"]), default=None)
    return (0, -1, 0.0) if far is None else (len(beside), far["row"], math.hypot(*far["off"]))
