"""Where closed paths cross themselves: inside and outside are not clear there.

Pairs of segments come from their boxes; where they meet, arcs are arcs (intersect.py). Within
two segments a meeting is a crossing unless they only touch. At a vertex the path passes twice,
along four directions: it crosses itself when the two of one passage part the two of the other. So
a contour that touches itself, at a corner or along a run (a keyhole), does not cross itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from camtool.geometry.boxes import touching_boxes
from camtool.geometry.drawing import SelfCrossing
from camtool.geometry.frames import Frames
from camtool.geometry.intersect import Crossings, meetings
from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Bools,
    Floats,
    Ints,
    Polylines,
    Segments,
)

PAIRS_AT_A_TIME = 1 << 16
"""So many pairs of segments are looked at exactly at a time: it bounds the memory."""

MOST_CROSSINGS = 1000
"""Looking for crossings ends when there are more than this."""

MOST_PAIRS = 4_000_000
"""Looking for crossings ends after so many pairs of segments with boxes that touch."""

ALONG_RAD = 1e-6
"""Directions nearer than this run along each other: that is touching, not crossing."""


def self_crossings_of(lines: Polylines, layers: Sequence[str]) -> tuple[SelfCrossing, ...]:
    """The places where closed paths cross themselves, path by path, each place once.

    At most about MOST_CROSSINGS.
    """
    segments = Segments.of(lines)
    segments = segments[lines.closed[segments.path]]
    if not len(segments):
        return ()
    frames = Frames.of(segments)
    found: dict[tuple[int, int, int], SelfCrossing] = {}
    for row_a, row_b in _pairs_of_one_path(segments):
        meets, crosses = meetings(segments, row_a, row_b)
        crossing = np.where(_at_vertex(meets), _pass_through(meets, segments, frames), crosses)
        for row in np.flatnonzero(crossing).tolist():
            path = int(segments.path[meets.row_a[row]])
            x, y = meets.point[row].tolist()
            key = (path, round(x / _SAME_MM), round(y / _SAME_MM))
            found.setdefault(key, SelfCrossing((x, y), path, layers[path]))
        if len(found) > MOST_CROSSINGS:
            break
    return tuple(found[key] for key in sorted(found))


_SAME_MM = 4.0 * POSITION_EPS_MM


def _pairs_of_one_path(segments: Segments) -> Iterator[tuple[Ints, Ints]]:
    """Rows a < b of segments of one path whose boxes touch; two lines in a row cannot cross."""
    boxes = segment_boxes(segments)
    margin = 0.5 * POSITION_EPS_MM * np.array([-1.0, -1.0, 1.0, 1.0])
    every = np.ones(len(segments), dtype=np.bool_)
    one, other = touching_boxes(
        boxes + margin, segments.path, np.arange(len(segments)), every, most=MOST_PAIRS
    )
    counts = np.bincount(segments.path)[segments.path]
    in_a_row = (other - one == 1) | (other - one == counts[one] - 1)
    both_lines = ~segments.is_arc[one] & ~segments.is_arc[other]
    keep = ~(in_a_row & both_lines)
    one, other = one[keep], other[keep]
    for begin in range(0, len(one), PAIRS_AT_A_TIME):
        batch = slice(begin, begin + PAIRS_AT_A_TIME)
        yield one[batch], other[batch]


def _at_vertex(meets: Crossings) -> Bools:
    return np.asarray(np.isin(meets.ta, (0.0, 1.0)) | np.isin(meets.tb, (0.0, 1.0)))


def _pass_through(meets: Crossings, segments: Segments, frames: Frames) -> Bools:
    """For meetings at a vertex: whether the passage along a parts that along b.

    Each passage has two directions, back along where it came from and on to where it goes.
    """
    back_a, on_a = _passage(meets.row_a, meets.ta, segments, frames)
    back_b, on_b = _passage(meets.row_b, meets.tb, segments, frames)
    same = _one_passage(meets, segments)
    turn = 2.0 * np.pi
    wedge = np.mod(on_a - back_a, turn)
    one, other = np.mod(back_b - back_a, turn), np.mod(on_b - back_a, turn)
    clear = np.ones(len(same), dtype=np.bool_)
    for side in (one, other):
        for edge in (0.0, wedge, turn):
            clear &= np.abs(side - edge) > ALONG_RAD
    return np.asarray(clear & ~same & ((one < wedge) != (other < wedge)))


def _passage(row: Ints, t: Floats, segments: Segments, frames: Frames) -> tuple[Floats, Floats]:
    """The directions (J,) rad back and on at the fraction t of these rows."""
    before, after = _neighbours(segments)
    came = np.where(t == 0.0, before[row], row)
    goes = np.where(t == 1.0, after[row], row)
    at_came = frames[came].tangent_at(np.where(t == 0.0, 1.0, t))
    at_goes = frames[goes].tangent_at(np.where(t == 1.0, 0.0, t))
    back = np.arctan2(-at_came[:, 1], -at_came[:, 0])
    return back, np.arctan2(at_goes[:, 1], at_goes[:, 0])


def _neighbours(segments: Segments) -> tuple[Ints, Ints]:
    """The rows before and after each row in its closed path."""
    rows = np.arange(len(segments))
    first = np.searchsorted(segments.path, segments.path)
    last = np.searchsorted(segments.path, segments.path, side="right") - 1
    before = np.where(rows == first, last, rows - 1)
    after = np.where(rows == last, first, rows + 1)
    return before, after


def _one_passage(meets: Crossings, segments: Segments) -> Bools:
    """True for the vertex that a row shares with the next one of its path."""
    _, after = _neighbours(segments)
    a_first = (after[meets.row_a] == meets.row_b) & (meets.ta == 1.0) & (meets.tb == 0.0)
    b_first = (after[meets.row_b] == meets.row_a) & (meets.tb == 1.0) & (meets.ta == 0.0)
    return np.asarray(a_first | b_first)
