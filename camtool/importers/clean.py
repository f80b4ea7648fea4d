"""Pieces in columns: numbers checked, repeated points taken out, each piece kept once.

Tolerance: POSITION_EPS_MM, below which two points are one; it decides what is a repeated point,
what has no length, and what is drawn twice.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.errors import DrawingError, GeometryError
from camtool.geometry.chain import numbered
from camtool.geometry.drawing import Skipped
from camtool.geometry.measure import path_lengths
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Bools,
    Floats,
    Ints,
    Polylines,
    encloses,
    without_repeats,
)
from camtool.importers.piece import MAX_COORDINATE_MM, Piece

DRAWN_TWICE = "is drawn twice"
"""Why a piece went that is another one again."""


@dataclass(frozen=True, eq=False)
class Cleaned:
    """Paths, the piece that each came from (M,), and what was left out.

    `duplicates` pieces of `duplicates_mm` were drawn twice.
    """

    lines: Polylines
    piece: Ints
    skipped: tuple[Skipped, ...] = ()
    duplicates: int = 0
    duplicates_mm: float = 0.0


def cleaned(pieces: Sequence[Piece], file: str) -> Cleaned:
    """The pieces without repeated points, each drawn once, and the count of what went.

    DrawingError when a number is not finite or beyond MAX_COORDINATE_MM, or a piece is no path.
    """
    if not pieces:
        return Cleaned(Polylines.of([]), np.empty(0, dtype=np.int64))
    vertices, counts = _columns(pieces, file)
    closed = np.array([piece.closed for piece in pieces], dtype=np.bool_)
    keep, repeated = without_repeats(vertices, counts, closed)
    owner = np.repeat(np.arange(len(pieces)), counts)[keep]
    vertices = vertices[keep]
    left = np.bincount(owner, minlength=len(pieces))
    long_enough = left >= 2
    closed &= encloses(vertices, owner, left)
    gone = _kinds(pieces, ~long_enough, "has no length")
    points = _kinds(pieces, long_enough & (repeated > 0), "is repeated", repeated, "point of ")
    rows = np.flatnonzero(long_enough)
    chosen = [pieces[row] for row in rows.tolist()]
    lines = _lines(vertices[long_enough[owner]], left[rows], closed[rows], chosen, file)
    once = _drawn_once(lines, [(piece.layer, piece.colour) for piece in chosen])
    twice = np.zeros(len(pieces), dtype=np.bool_)
    twice[rows[~once]] = True
    lengths = path_lengths(lines)
    return Cleaned(
        lines=lines.select(np.flatnonzero(once)),
        piece=rows[once],
        skipped=(*gone, *points, *_kinds(pieces, twice, DRAWN_TWICE)),
        duplicates=int(np.count_nonzero(~once)),
        duplicates_mm=float(lengths[~once].sum()),
    )


def is_placed(piece: Piece) -> bool:
    """Whether every number of a piece is finite, and every point within MAX_COORDINATE_MM."""
    vertices = piece.vertices
    near = (np.abs(vertices[:, :2]) <= MAX_COORDINATE_MM).all()
    return bool(near and np.isfinite(vertices).all())


def _columns(pieces: Sequence[Piece], file: str) -> tuple[Floats, Ints]:
    """All vertices (N, 3) and how many each piece has; DrawingError when one is no position."""
    counts = np.array([len(piece.vertices) for piece in pieces], dtype=np.int64)
    vertices = np.concatenate([piece.vertices for piece in pieces]).astype(np.float64)
    finite = np.asarray(np.isfinite(vertices).all(axis=1))
    near = (np.abs(vertices[:, :2]) <= MAX_COORDINATE_MM).all(axis=1)
    if (finite & near).all():
        return vertices, counts
    row = int(np.argmin(finite & near))
    where = pieces[int(np.searchsorted(np.cumsum(counts), row, side="right"))].where
    if not finite[row]:
        raise DrawingError("a number is not finite", file=file, where=where)
    raise DrawingError(
        f"a point lies {np.abs(vertices[row, :2]).max():.6g} mm away, where micrometres are lost",
        file=file,
        where=where,
        mend="move the drawing to its origin, or name its unit with --units",
    )


def _kinds(
    pieces: Sequence[Piece],
    chosen: Bools,
    reason: str,
    times: Ints | None = None,
    before: str = "",
) -> list[Skipped]:
    """The chosen pieces counted by kind; `times` counts each so often."""
    counts: Counter[str] = Counter()
    for index in np.flatnonzero(chosen).tolist():
        counts[pieces[index].kind] += 1 if times is None else int(times[index])
    return [Skipped(before + kind, count, reason) for kind, count in counts.items()]


def _lines(
    vertices: Floats, counts: Ints, closed: Bools, pieces: Sequence[Piece], file: str
) -> Polylines:
    """The pieces as paths; a fault is named by its piece."""
    try:
        return Polylines(vertices, np.concatenate([[0], np.cumsum(counts)]), closed)
    except GeometryError as error:
        row = int(str(error.where).removeprefix("path ").partition(",")[0])
        raise DrawingError(error.message, file=file, where=pieces[row].where) from error


_Words = npt.NDArray[np.uint64]


def _drawn_once(lines: Polylines, styles: Iterable[tuple[str, str]]) -> Bools:
    """(M,) false for each path that is one before it again: same style, same segments.

    Each segment is a number (`segment_numbers`); a path is the sum of its segments, the same from
    any start. 64 bits: two different ones of
    a million paths are taken for one with a chance of one in thirty million.
    """
    count = len(lines)
    if not count:
        return np.empty(0, dtype=np.bool_)
    following = np.arange(1, len(lines.vertices) + 1)
    following[lines.offsets[1:] - 1] = lines.offsets[:-1]
    segment = segment_numbers(lines.vertices, lines.vertices[following])
    segment[lines.offsets[1:][~lines.closed] - 1] = 0
    kind = 2 * numbered(list(styles), count) + lines.closed
    key = _mixed(np.add.reduceat(segment, lines.offsets[:-1]) + _mixed(kind.view(np.uint64)))
    once = np.zeros(count, dtype=np.bool_)
    once[np.unique(key, return_index=True)[1]] = True
    return once


def segment_numbers(begin: Floats, end: Floats) -> _Words:
    """(K,) a number mixed from the rounded ends and the bulge of the segment between two vertices
    (K, 3), the same in both directions."""
    # Adding 0 makes −0 and 0 one.
    grid = (np.round(begin / POSITION_EPS_MM) + 0.0).astype(np.int64).view(np.uint64)
    ahead = (np.round(end[:, :2] / POSITION_EPS_MM) + 0.0).astype(np.int64).view(np.uint64)
    bulge = grid[:, 2].view(np.int64)
    point = _mixed(_mixed(grid[:, 0]) + grid[:, 1])
    onward = _mixed(_mixed(ahead[:, 0]) + ahead[:, 1])
    bend = np.where(onward < point, -bulge, bulge).view(np.uint64)
    segment = _mixed(_mixed(np.minimum(point, onward)) + np.maximum(point, onward))
    return _mixed(segment + bend)


def _mixed(words: _Words) -> _Words:
    """Numbers scattered over 64 bits (the finalizer of SplitMix64, Steele and others 2014)."""
    word = words + np.uint64(0x9E3779B97F4A7C15)
    word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return word ^ (word >> np.uint64(31))
