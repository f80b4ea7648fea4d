"""Sizes of the part and of its closed contours, wanted and predicted; and how contours close.

Of a contour that is cut in several passes, the last and deepest pass counts, without leads and
ramps: its loop (`camtool.verification.cuts`); of a pocket, bore or carving all that is cleared.
The part is all of these and open contours together. Sizes are those of the cut edges, and nominal
sizes are as drawn, where the plan says which edges are cut (`camtool.toolpath.wanted`); what cuts
no edge counts in no size. The slides move an edge by as much as they move the bounding box of the
tool centre's path:

    predicted edge = planned edge + (box of the slides − box of the wanted moves)

Where what is cleared reaches beyond the stock, as in a pocket that is open at its edge, sizes end
where the stock does: the part keeps no wall there.

Where the edges are not known, and of lines that a tool of some width follows with its centre,
sizes are those of the tool centre's path.

    error_percent = (predicted − nominal) / nominal · 100

is positive when the part comes out too large. (The thesis's equation 5.5, L2755, takes
real − measured: the same figure with the other sign.)"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.toolpath.moves import ROWS_AT_ONCE
from camtool.toolpath.wanted import NO_EDGE, UNKNOWN_EDGE
from camtool.verification.cuts import NO_LOOP, CutMoves, is_in_loop
from camtool.verification.matching import Match

SAME_MM = 1e-3
"""Edges nearer to each other than this are one side of the part."""


class PredictedSize(Struct, frozen=True):
    """A dimension, such as "part X" or "contour 3 Y", mm. `of_edge`: it is that of the cut
    edge, not of the tool centre's path."""

    name: str
    nominal_mm: float
    predicted_mm: float
    of_edge: bool

    @property
    def error_percent(self) -> float | None:
        """Predicted against nominal, per cent, positive when too large; None for a nominal 0."""
        if self.nominal_mm <= POSITION_EPS_MM:
            return None
        return (self.predicted_mm - self.nominal_mm) / self.nominal_mm * 100.0


class LoopedCuts(Struct, frozen=True, eq=False):
    """Cutting moves and the loops (C, 2) of their contours (`camtool.verification.cuts.loops`)."""

    cuts: CutMoves
    loops: Ints


class SlideExtents:
    """Boxes of the slides' path in the rows that determine sizes, and closure errors."""

    def __init__(self, start: Floats, decoded: LoopedCuts, goal: LoopedCuts, match: Match) -> None:
        """Begin with the slides at `start` (3,) mm. `goal` holds the wanted moves; `match` maps
        each decoded row to its wanted row and contour."""
        count, contour = goal.cuts.contour_count, match.contour
        self._counts = np.zeros(len(contour), dtype=np.bool_)
        self._begins = self._counts.copy()
        self._contour = contour
        sized_rows = _sized_rows(decoded, goal, match)
        self._counts[sized_rows] = True
        self._begins[sized_rows[np.flatnonzero(np.diff(contour[sized_rows], prepend=-1))]] = True
        self._least = np.full((count, 2), np.inf)
        self._most = np.full((count, 2), -np.inf)
        self._at = start[:2]
        # The rows before and after which the slides are at the ends of closed contours.
        begin, finish = decoded.loops[decoded.loops[:, 0] != NO_LOOP].T
        self._ends = begin, finish + 1
        self._places = np.full((2, len(begin), 2), np.nan)

    @property
    def has_sizes(self) -> bool:
        """True if any row determines a size."""
        return bool(self._counts.any())

    @property
    def boxes(self) -> Floats:
        """(C, 2, 2) box [[x low, x high], [y low, y high]] of the slides in each wanted contour;
        infinite where no row belongs to it. The position where it begins is part of it."""
        return np.stack([self._least, self._most], axis=2)

    @property
    def closure_mm(self) -> float:
        """Largest distance, mm, between where the slides begin and where they end a closed
        contour; NaN where no contour is closed."""
        gap = self._places[1] - self._places[0]
        return float(np.hypot(gap[:, 0], gap[:, 1]).max()) if len(gap) else math.nan

    def add(self, low: int, box: tuple[Floats, Floats], end: Floats) -> None:
        """Add rows from `low` on, which come in order: the lowest and highest positions of the
        slides (R, 2), (R, 2), mm, infinite where they did not move, and the last positions (R, 2),
        mm, NaN there."""
        rows = slice(low, low + len(end))
        is_known = np.isfinite(end[:, 0])
        latest = np.maximum.accumulate(np.where(is_known, np.arange(1, len(end) + 1), 0))
        places = np.concatenate([self._at[None, :], end])[np.concatenate([[0], latest])]
        self._at = places[-1]
        counts, begins = self._counts[rows], self._begins[rows]
        contour = self._contour[rows]
        for extent, extreme, part in (
            (self._least, np.minimum, box[0]),
            (self._most, np.maximum, box[1]),
        ):
            extreme.at(extent, contour[counts], part[counts])
            extreme.at(extent, contour[begins], places[:-1][begins])
        for ends, places_kept in zip(self._ends, self._places, strict=True):
            # The place after the last row of a block is the place before the first row of the
            # next.
            one, other = np.searchsorted(ends, [low, low + len(end) + 1])
            places_kept[one:other] = places[ends[one:other] - low]


def sizes(slides: SlideExtents, goal: LoopedCuts, gap_mm: float) -> Iterator[PredictedSize]:
    """Yield the sizes in X and Y of the whole part, then of each closed contour of the wanted
    moves (`goal`), predicted from the extents of the slides.

    Contours to which no row belongs are left out (a finding names them), and so are contours that
    cut no edge, if edges are known."""
    if not slides.has_sizes:
        return
    centre, lowest = _extents(goal.cuts, _wanted_rows(goal))
    slide = slides.boxes
    edges = _edges(goal, centre, slide)
    sized = edges.counts & np.isfinite(centre[:, 0, 0])
    is_seen = sized & np.isfinite(slide[:, 0, 0])
    if not is_seen.any():
        return
    # Contours that the program does not cut still count in the nominal size of the part.
    yield from _axis_sizes(
        "part",
        _joint_size(edges.nominal[sized], edges.followed[sized]),
        _joint_size(
            edges.predicted[_finest_contours(edges, is_seen)],
            edges.followed[_finest_contours(edges, is_seen)],
        ),
    )
    closed = (goal.loops[:, 0] != NO_LOOP) | edges.cleared
    for index in np.flatnonzero(
        closed & _is_final_pass(centre, lowest, gap_mm) & is_seen & edges.listed
    ):
        followed = edges.followed[index : index + 1]
        yield from _axis_sizes(
            f"contour {index + 1}",
            _joint_size(edges.own_boxes[index : index + 1], followed),
            _joint_size(edges.predicted[index : index + 1], followed),
        )


class _Edges(Struct, frozen=True, eq=False):
    """The edges of C contours: the mask `counts` (C,) of those that count in sizes; boxes (C, 2,
    2), mm, of the `nominal` and of the `predicted` edge; the distance `rough` (C,), mm, that the
    contour's line is planned to keep from its nominal edge; and the record of `DrawnEdges` for
    each. `own_boxes`: the nominal box of what the contour cuts of its line; `listed` (C,): False
    for rings inside it."""

    counts: Bools
    nominal: Floats
    predicted: Floats
    rough: Floats
    followed: Bools
    cleared: Bools
    own_boxes: Floats
    listed: Bools


def _edges(goal: LoopedCuts, centre: Floats, slide: Floats) -> _Edges:
    """Return the edges that the contours of the wanted moves cut. `centre`, `slide` (C, 2, 2): the
    boxes of these contours and of the slides on them; these boxes are the edges where none are
    known."""
    cuts, drawn = goal.cuts, goal.cuts.toolpath.drawn
    count = len(centre)
    edge = _edge_of(cuts)
    nominal, predicted, rough = centre.copy(), slide.copy(), np.zeros(count)
    own_boxes = centre.copy()
    followed, cleared = np.ones(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
    listed = np.ones(count, dtype=np.bool_)
    if drawn is not None and (edge >= 0).any():
        with_edge = np.flatnonzero(edge >= 0)
        numbers = edge[with_edge]
        low, high = np.full((2, int(drawn.line.max()) + 1, 2), np.inf)
        np.minimum.at(low, drawn.line, drawn.planned[:, :, 0])
        np.minimum.at(high, drawn.line, -drawn.planned[:, :, 1])
        drawn_boxes = np.stack([low, -high], axis=2)[drawn.line[numbers]]
        nominal[with_edge] = drawn.nominal[numbers]
        predicted[with_edge] = drawn.planned[numbers] + slide[with_edge] - centre[with_edge]
        rough[with_edge] = np.abs(drawn_boxes - drawn.nominal[numbers]).max(axis=(1, 2))
        followed[with_edge], cleared[with_edge] = (drawn.followed[numbers], drawn.cleared[numbers])
        makes = np.abs(drawn.planned[numbers] - drawn_boxes) <= SAME_MM
        own_boxes[with_edge] = np.where(
            makes.all(axis=(1, 2))[:, None, None], drawn.nominal[numbers], drawn.planned[numbers]
        )
        listed[with_edge] = makes.any(axis=(1, 2)) | ~drawn.cleared[numbers]
        if drawn.stock_mm is not None:
            inner = with_edge[drawn.cleared[numbers]]
            low, high = np.array(drawn.stock_mm).reshape(2, 2, 1)
            for boxes in (nominal, predicted, own_boxes):
                boxes[inner] = np.clip(boxes[inner], low, high)
    return _Edges(
        edge >= UNKNOWN_EDGE, nominal, predicted, rough, followed, cleared, own_boxes, listed
    )


def _edge_of(cuts: CutMoves) -> Ints:
    """Return (C,) the edge that each contour cuts: an index, UNKNOWN_EDGE or NO_EDGE."""
    drawn, rows = cuts.toolpath.drawn, cuts.rows
    if drawn is None:
        return np.full(cuts.contour_count, UNKNOWN_EDGE)
    edge = np.full(cuts.contour_count, NO_EDGE)
    np.maximum.at(edge, cuts.contour[rows], drawn.edge[rows])
    return edge


def _finest_contours(edges: _Edges, is_seen: Bools) -> Ints:
    """Return the contours in the mask `is_seen` (C,) that decide a size. Where several lines cut
    the same edge, as in roughing and finishing, those of the line nearest to the edge decide."""
    rows = np.flatnonzero(is_seen)
    boxes = edges.nominal[rows].reshape(len(rows), 4)
    _, groups = np.unique(boxes, axis=0, return_inverse=True)
    min_rough = np.full(len(rows), np.inf)
    np.minimum.at(min_rough, groups.reshape(-1), edges.rough[rows])
    return rows[edges.rough[rows] <= min_rough[groups.reshape(-1)]]


def _joint_size(boxes: Floats, followed: Bools) -> tuple[Floats, Bools]:
    """Return (2,) the size in X and Y of all boxes (C, 2, 2) together, and (2,) True where lines
    that the tool's centre follows (`followed` (C,)) determine it."""
    low, high = boxes[:, :, 0].min(axis=0), boxes[:, :, 1].max(axis=0)
    walls = boxes[~followed]
    if not len(walls):
        return high - low, np.ones(2, dtype=np.bool_)
    is_outside = walls[:, :, 0].min(axis=0) > low, walls[:, :, 1].max(axis=0) < high
    return high - low, is_outside[0] | is_outside[1]


def _is_final_pass(boxes: Floats, lowest: Floats, gap_mm: float) -> Bools:
    """Return the mask (C,) of contours below which no contour with the same box is cut. Passes
    between which the tool leaves the stock are separate contours. `boxes` (C, 2, 2) and `lowest`
    (C,) come from `_extents`."""
    rows = boxes.transpose(0, 2, 1).reshape(-1, 4)
    is_known = np.isfinite(rows[:, 0])
    keys = np.full(rows.shape, np.iinfo(np.int64).min)
    keys[is_known] = np.rint(rows[is_known] / gap_mm).astype(np.int64)
    _, groups = np.unique(keys, axis=0, return_inverse=True)
    deepest = np.full(groups.max(initial=-1) + 1, np.inf)
    np.minimum.at(deepest, groups.reshape(-1), lowest)
    return np.asarray(lowest == deepest[groups.reshape(-1)])


def _is_looped(goal: LoopedCuts) -> Bools:
    """Return the mask (C,) of contours whose size is that of their loop, not of all that they
    clear."""
    drawn, edge = goal.cuts.toolpath.drawn, _edge_of(goal.cuts)
    closed = np.asarray(goal.loops[:, 0] != NO_LOOP)
    if drawn is not None:
        closed &= ~np.append(drawn.cleared, False)[np.maximum(edge, UNKNOWN_EDGE)]
    return closed


def _wanted_rows(goal: LoopedCuts) -> Bools:
    """Return the mask (W,) of wanted rows that determine sizes: those of loops, and those of
    contours without a loop."""
    cuts, looped = goal.cuts, np.append(_is_looped(goal), False)[goal.cuts.contour]
    return np.asarray(cuts.is_cut & (is_in_loop(cuts, goal.loops) | ~looped))


def _sized_rows(decoded: LoopedCuts, goal: LoopedCuts, match: Match) -> Ints:
    """Return the decoded rows that determine sizes: for a wanted contour with a loop, the rows of
    its decoded loops if there are any; otherwise the rows that follow a wanted row that determines
    sizes."""
    if len(decoded.cuts.rows) == 0 or len(goal.cuts.rows) == 0:
        return np.empty(0, dtype=np.int64)
    wanted_contour, has_loop = match.contour, np.append(_is_looped(goal), False)
    follow = _wanted_rows(goal)[match.row] & (wanted_contour >= 0)
    looped = (
        is_in_loop(decoded.cuts, decoded.loops) & (wanted_contour >= 0) & has_loop[wanted_contour]
    )
    with_loop = np.zeros(len(has_loop), dtype=np.bool_)
    with_loop[wanted_contour[looped]] = True
    return np.flatnonzero(looped | (follow & ~with_loop[wanted_contour]))


def _extents(cuts: CutMoves, counts: Bools) -> tuple[Floats, Floats]:
    """Return (C, 2, 2) mm, the box [[x low, x high], [y low, y high]] of each contour's rows in
    the mask `counts` (N,), and (C,) mm, the lowest height of their ends; infinite for a contour
    without such rows."""
    low_corner = np.full((cuts.contour_count, 2), np.inf)
    high_corner = np.full((cuts.contour_count, 2), -np.inf)
    lowest = np.full(cuts.contour_count, np.inf)
    for low in range(0, len(cuts.segments), ROWS_AT_ONCE):
        row = cuts.row[low : low + ROWS_AT_ONCE]
        counted_rows = np.flatnonzero(counts[row])
        row, contour = row[counted_rows], cuts.contour[row[counted_rows]]
        boxes = segment_boxes(cuts.segments[low + counted_rows])
        np.minimum.at(low_corner, contour, boxes[:, :2])
        np.maximum.at(high_corner, contour, boxes[:, 2:])
        begin, end = cuts.toolpath.starts_of(row), cuts.toolpath.end[row]
        np.minimum.at(lowest, contour, np.minimum(begin[:, 2], end[:, 2]))
    return np.stack([low_corner, high_corner], axis=2), lowest


def _axis_sizes(
    name: str, nominal: tuple[Floats, Bools], predicted: tuple[Floats, Bools]
) -> Iterator[PredictedSize]:
    """Yield the sizes in X and Y, from pairs as `_joint_size` returns them; a size counts as that
    of the tool's centre if its nominal or its predicted part is."""
    of_centre = nominal[1] | predicted[1]
    for k, axis in enumerate("XY"):
        sizes_mm = float(nominal[0][k]), float(predicted[0][k])
        yield PredictedSize(f"{name} {axis}", *sizes_mm, of_edge=not of_centre[k])
