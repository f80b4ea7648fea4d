"""Pieces that come loose: what a program cuts off through the whole thickness of the stock.

Only cuts through the stock count. A cell of a raster is gone when a single move has cut all of it
through; so whatever holds a piece, however thin, keeps a cell, and cells that touch at an edge or
a corner hold each other. The cells are a third of the narrowest cut wide, so that gone cells close
round every piece that is cut out. What reaches the edge of the stock, or beyond all cuts, is held.

Where other set-ups have cut from the other face before, cuts need not go as deep: each cell has
its own floor, one of `MAX_LEVELS` heights, rounded down. A cell that is gone already has the time
BEFORE.

Backwards in time, gone cells come back, those cut last first: where one joins two pieces, its move
has parted them, and the one that is not held has come loose then. Of a loose piece that is cut in
two only the smaller part counts, and only if something is left of it at the end.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import groupby

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.records import replace
from camtool.stock.before import THROUGH_SLACK_MM, WHOLE, StockBefore
from camtool.stock.cutters import CutterProfile
from camtool.stock.heightmap import Box, HeightMap, cell_for, height_map
from camtool.stock.moves import StockMoves

CELL_SHARE = 1.0 / 3.0
"""Of the width of the narrowest cut through the stock, the width of a cell."""

MAX_RASTER_CELLS = 4_000_000
"""Cells are wider where there would be more; pieces within narrower cuts are then missed."""

MIN_PIECE_SHARE = 0.25
"""The smallest piece that comes loose, as a share of the area of the narrowest tool's disc:
smaller ones go away with the chips."""

MIN_CUT_SHARE = 1.0
"""Of that disc, how much of a piece is cut away after it has come loose, at least: less are the
ends of the cut that frees it."""

MAX_PIECE_CELLS = 400_000
"""The size of a piece is measured with about so many cells, or fewer where there are many pieces:
its area is wrong by half of such a cell along its edge at most, its box by a cell."""

STANDING = np.iinfo(np.int64).max
"""Time of cells that are never cut through."""


BEFORE = -1
"""Time of cells that other set-ups have cut through."""

MAX_LEVELS = 16
"""So many heights of floors from below are told apart, ..."""

LEVEL_POINTS = 20_000
"""... of those at so many points of the stock."""


class LoosePiece(Struct, frozen=True, eq=False):
    """A piece as it comes loose: the number of the move that frees it, its area, mm², its box (low
    x, low y, high x, high y), mm, and points (P, 2) in it. `again`: the move from which on it is
    cut through once more (−1: none)."""

    move: int
    area_mm2: float
    box_mm: Box
    points: Floats
    again: int


class _Parting(Struct, frozen=True):
    """A piece of cells that comes loose: its time, the row and column of a cell of it, the least
    and the greatest of all its rows and columns, and how many of its cells are cut later."""

    time: int
    place: tuple[int, int]
    rows: tuple[int, int]
    columns: tuple[int, int]
    cut: int


class _Level(Struct, frozen=True, eq=False):
    """The cuts that go through the stock where its floor is at a height, mm, and the number of
    each among all moves."""

    floor_mm: float
    cuts: StockMoves
    number: Ints


def loose_pieces(
    moves: StockMoves, thickness_mm: float, box_mm: Box | None, before: StockBefore = WHOLE
) -> list[LoosePiece]:
    """Return the pieces that come loose of a stock with this thickness and these sides (None:
    without limits), which set-ups have cut before, in the order of time."""
    levels = [
        _Level(floor, *_through(moves, floor)) for floor in _floors(moves, thickness_mm, before)
    ]
    # Of whole stock only what is cut through can come loose.
    has_others = bool(before.above or before.below)
    cuts = moves.select(moves.table[moves.tool, 0] > 0.0) if has_others else levels[0].cuts
    across = (cuts.start[:, :2] != cuts.end[:, :2]).any(axis=1)
    if not across.any():
        return []
    radius = cuts.table[cuts.tool, 0]
    min_radius = float(radius[across].min())
    low = np.minimum(cuts.start, cuts.end)[:, :2] - radius[:, None]
    high = np.maximum(cuts.start, cuts.end)[:, :2] + radius[:, None]
    edge = 3.0 * min_radius
    low, high = low.min(axis=0) - edge, high.max(axis=0) + edge
    if box_mm is not None and has_others:
        low, high = np.array(box_mm).reshape(2, 2)
    elif box_mm is not None:
        low, high = np.maximum(low, box_mm[:2]), np.minimum(high, box_mm[2:])
    if (low >= high).any():
        return []
    box = (*low.tolist(), *high.tolist())
    max_cells = MAX_PIECE_CELLS if has_others else MAX_RASTER_CELLS
    cell = max(CELL_SHARE * 2.0 * min_radius, cell_for(box, max_cells))
    raster = _Raster(levels, before, box, cell)
    time = raster.times(box, cell, math.sqrt(0.5) * cell)[1]
    disc = math.pi * min_radius**2
    partings = list(_partings(time, MIN_PIECE_SHARE * disc / cell**2))
    cells = min(MAX_PIECE_CELLS, MAX_RASTER_CELLS // max(len(partings), 1))
    pieces = []
    for parting in partings:
        piece = raster.measured(time, parting, cells)
        if piece is not None and piece.area_mm2 >= MIN_PIECE_SHARE * disc:
            is_cut = parting.cut * cell**2 >= MIN_CUT_SHARE * disc
            pieces.append(piece if is_cut else replace(piece, again=-1))
    return sorted(pieces, key=lambda each: each.move)


def _floors(moves: StockMoves, thickness_mm: float, before: StockBefore) -> list[float]:
    """Return the heights of the floors through which moves cut, the lowest first."""
    if not before.below:
        return [-thickness_mm]
    ends = np.concatenate([moves.start, moves.end])[:, :2]
    low, high = ends.min(axis=0), ends.max(axis=0)
    step = math.sqrt(max(float(np.prod(high - low)), 1e-12) / LEVEL_POINTS)
    x, y = (np.arange(low[k], high[k] + step, step) for k in (0, 1))
    floors = before.floors(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))
    floors = np.unique(np.floor(floors / WIDTH_STEP_MM) * WIDTH_STEP_MM)
    floors = floors[(floors > -thickness_mm) & (floors < 0.0)]
    return [-thickness_mm, *floors[:: max(1, math.ceil(len(floors) / MAX_LEVELS))].tolist()]


def _through(moves: StockMoves, bottom_mm: float) -> tuple[StockMoves, Ints]:
    """Return the parts of moves that cut through the stock, as level moves of flat tools that are
    as wide there as the tool is at the bottom, and the number of each among all moves."""
    start, end = moves.start, moves.end
    low = np.minimum(start[:, 2], end[:, 2]) <= bottom_mm
    low &= moves.table[moves.tool, 0] > 0.0
    number = np.flatnonzero(low)
    cuts = moves.select(number).below(bottom_mm)
    begin, finish = cuts.start, cuts.end
    # A cone is nowhere narrower along a move than at its higher end.
    higher = np.maximum(begin[:, 2], finish[:, 2])
    radius, flat, corner, rise = cuts.table[cuts.tool].T
    depths = np.maximum(bottom_mm - higher, 0.0)
    cone = flat + depths / np.where(rise > 0.0, rise, 1.0)
    round_ = flat + np.sqrt(np.maximum(corner**2 - np.maximum(corner - depths, 0.0) ** 2, 0.0))
    wide = np.where(rise > 0.0, cone, np.where(corner > 0.0, round_, radius))
    wide = np.floor(np.minimum(wide, radius) / WIDTH_STEP_MM) * WIDTH_STEP_MM
    begin[:, 2] = finish[:, 2] = LEVEL_MM
    widths, tool = np.unique(wide, return_inverse=True)
    cutters = tuple(CutterProfile(width, width) for width in widths.tolist())
    keep = wide > 0.0
    flat_moves = StockMoves(
        begin, finish, cuts.row, cuts.rapid, tool.astype(np.int64), cutters, moves.beside_mm
    )
    return flat_moves.select(keep), number[keep]


LEVEL_MM = -1.0
"""Height at which cuts through the stock are drawn into a raster."""

WIDTH_STEP_MM = 1e-3
"""Widths of cuts are rounded down to this."""


class _Raster(Struct, frozen=True, eq=False):
    """The cuts of each level, what other set-ups have cut, and the box and the cells in which
    pieces are looked for."""

    levels: list[_Level]
    before: StockBefore
    box: Box
    cell_mm: float

    def times(
        self, box: Box, cell_mm: float, inwards_mm: float, until: int | None = None
    ) -> tuple[HeightMap, Ints]:
        """Return a raster of a box, and the first move (NY, NX) that cuts each of its cells
        through, of those up to `until`, with tools that are slimmer by `inwards_mm`."""
        first_cuts: Ints | None = None
        for level in self.levels:
            is_chosen = level.number <= (STANDING if until is None else until)
            cuts = level.cuts.select(is_chosen)
            slim = [max(each.radius_mm - inwards_mm, 0.0) for each in cuts.cutters]
            cutters = tuple(CutterProfile(radius, radius) for radius in slim)
            kept_moves = np.flatnonzero(np.array(slim)[cuts.tool] > 0.0)
            drawn = height_map(
                replace(cuts, cutters=cutters).select(kept_moves), box, cell_mm, owners=True
            )
            assert drawn.owner is not None
            number = np.append(level.number[is_chosen][kept_moves], STANDING)
            time = number[drawn.owner]  # the last for cells that nothing cuts
            if not (self.before.above or self.before.below):
                return drawn, time
            if first_cuts is None:
                points = _centres(drawn)
                floor = self.before.floors(points, -inwards_mm).reshape(time.shape)
                top = self.before.tops(points, -inwards_mm).reshape(time.shape)
                is_gone = np.maximum(floor, level.floor_mm) >= top - THROUGH_SLACK_MM
            first_cuts = (
                time if first_cuts is None else np.where(floor >= level.floor_mm, time, first_cuts)
            )
        assert first_cuts is not None
        return drawn, np.where(is_gone, BEFORE, first_cuts)

    def measured(self, time: Ints, parting: _Parting, cells: int) -> LoosePiece | None:
        """Return a piece as it is when a move frees it; None where all its cells are cut in
        part."""
        (low, high), (left_column, right) = parting.rows, parting.columns
        time = time[low : high + 1, left_column : right + 1]
        label = _labels(time > parting.time)
        row, column = parting.place
        is_piece = label == label[row - low, column - left_column]
        cell = self.cell_mm
        corner = np.array(self.box[:2]) + cell * np.array([left_column, low])
        size = cell * np.array(is_piece.shape[::-1])
        box = (*corner.tolist(), *(corner + size).tolist())
        fine, cut = self.times(box, min(cell, cell_for(box, cells)), 0.0, parting.time)
        points = _centres(fine)[(cut == STANDING).ravel()]
        x, y = np.floor((points - corner) / cell).astype(np.int64).T
        inside = is_piece[y.clip(max=len(is_piece) - 1), x.clip(max=is_piece.shape[1] - 1)]
        points = points[inside]
        if not len(points):
            return None
        half = 0.5 * fine.cell_mm
        ends = (*(points.min(axis=0) - half).tolist(), *(points.max(axis=0) + half).tolist())
        later = time[is_piece & (time != STANDING)]
        next_cut = int(later.min()) if len(later) else -1
        return LoosePiece(parting.time, len(points) * fine.cell_mm**2, ends, points, next_cut)


def _centres(drawn: HeightMap) -> Floats:
    """Return the centres (P, 2) of all cells of a raster, row by row."""
    return np.stack(np.meshgrid(drawn.x, drawn.y), axis=-1).reshape(-1, 2)


def _partings(time: Ints, min_cells: float) -> Iterator[_Parting]:
    """Yield each piece of `min_cells` cells or more that comes loose. `time` (NY, NX): when each
    cell is cut through."""
    label = _labels(time == STANDING)
    count = int(label.max()) + 1
    size = np.bincount(label[label >= 0], minlength=count).tolist()
    edges = np.concatenate([label[0], label[-1], label[:, 0], label[:, -1]])
    is_held = np.isin(np.arange(count), edges).tolist()
    y, x = np.nonzero(time != STANDING)
    order = np.argsort(-time[y, x], kind="stable")
    y, x = y[order], x[order]
    node = np.pad(label, 1, constant_values=-1)
    width = node.shape[1]
    spans = [*_spans(label, count), *zip(*np.stack([y, y, x, x]).tolist(), strict=True)]
    owner, cells = node.ravel().tolist(), ((y + 1) * width + x + 1).tolist()
    _, first = np.unique(label, return_index=True)
    sample = [*first[-count:].tolist(), *(y * label.shape[1] + x).tolist()]
    root, cut = list(range(count + len(cells))), [0] * (count + len(cells))
    size += [0] * len(cells)
    is_held += [False] * len(cells)
    neighbours = [dy * width + dx for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx]

    def top(one: int) -> int:
        while root[one] != one:
            root[one] = root[root[one]]
            one = root[one]
        return one

    times = time[y, x].tolist()
    for time_now, group in groupby(range(len(cells)), key=times.__getitem__):
        added = [count + k for k in group]
        for added_index in added:
            cell = cells[added_index - count]
            owner[cell] = added_index
            for neighbour in [owner[cell + step] for step in neighbours]:
                one, other = top(added_index), top(neighbour) if neighbour >= 0 else -1
                if other < 0 or one == other:
                    continue
                if is_held[one] or (not is_held[other] and size[one] > size[other]):
                    one, other = other, one
                left_over = size[one] if is_held[other] else size[one] - cut[one]
                if left_over >= min_cells and not is_held[one]:
                    low, high, left_column, right = spans[one]
                    place = divmod(sample[one], label.shape[1])
                    yield _Parting(time_now, place, (low, high), (left_column, right), cut[one])
                root[one] = other
                size[other] += size[one]
                cut[other] += cut[one]
                a, b = spans[one], spans[other]
                spans[other] = min(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), max(a[3], b[3])
        for added_index in added:
            # The cells of one move come back at once.
            one = top(added_index)
            size[one] += 1
            cut[one] += 1


def _spans(label: Ints, count: int) -> list[tuple[int, int, int, int]]:
    """Return the least and the greatest row and column of each label."""
    y, x = np.nonzero(label >= 0)
    labels = label[y, x]
    ends = np.empty((4, count), dtype=np.int64)
    for k, column in ((0, y), (2, x)):
        ends[k], ends[k + 1] = label.size, -1
        np.minimum.at(ends[k], labels, column)
        np.maximum.at(ends[k + 1], labels, column)
    return list(zip(*ends.tolist(), strict=True))


def _labels(standing: Bools) -> Ints:
    """Return the number of the piece (NY, NX) of each standing cell, −1 elsewhere: cells that
    touch at an edge or a corner are one piece."""
    padded = np.pad(standing, ((0, 0), (1, 1)))
    turns = np.diff(padded.astype(np.int8), axis=1)
    run = np.cumsum((turns == 1).ravel()).reshape(turns.shape)[:, :-1] - 1
    run[~standing] = -1
    pairs = []
    for shift in (-1, 0, 1):
        one = run[:-1, max(shift, 0) : run.shape[1] + min(shift, 0)]
        other = run[1:, max(-shift, 0) : run.shape[1] + min(-shift, 0)]
        are_both = (one >= 0) & (other >= 0)
        pairs.append(np.column_stack([one[are_both], other[are_both]]))
    pair = np.unique(np.concatenate(pairs), axis=0)
    label = np.arange(int((turns == 1).sum()))
    while len(pair):
        min_label = label[pair].min(axis=1)
        for side in (0, 1):
            np.minimum.at(label, label[pair[:, side]], min_label)
        label = label[label]
        pair = pair[label[pair[:, 0]] != label[pair[:, 1]]]
    while (label[label] != label).any():
        label = label[label]
    _, label = np.unique(label, return_inverse=True)
    if not len(label):
        return np.full(standing.shape, -1, dtype=np.int64)
    return np.where(standing, label[run.clip(min=0)], -1).astype(np.int64)
