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
two only the smaller part counts, and only if something is left of it at the end."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints, distinct
from camtool.kernels.pieces import CUT, partings, piece_at
from camtool.records import replace
from camtool.stock.before import THROUGH_SLACK_MM, WHOLE, StockBefore
from camtool.stock.cutters import CutterProfile
from camtool.stock.heightmap import Box, HeightMap, cell_for, height_map
from camtool.stock.moves import StockMoves

CELL_SHARE = 1.0 / 3.0
"""Width of a cell, over that of the narrowest cut through the stock."""

MAX_RASTER_CELLS = 4_000_000
"""Cells are made wider if there would be more than this; pieces within narrower cuts are then
missed, which `LoosePieces.seen_mm` says."""

MIN_PIECE_SHARE = 0.25
"""Area of the smallest piece that is reported, over that of the narrowest tool's disc; smaller
ones leave with the chips."""

MIN_CUT_SHARE = 1.0
"""Area of a loose piece that must be cut away later to be reported, over that of the disc; the
ends of the cut that frees it take less."""

MAX_PIECE_CELLS = 400_000
"""A piece is measured with about this many cells, or fewer if there are many pieces: its area is
off by half of such a cell along its edge at most, its box by a cell."""

STANDING = np.iinfo(np.int64).max
"""Time of cells that are never cut through."""


BEFORE = -1

MAX_LEVELS = 16
"""Largest number of heights of floors from below that are distinguished, ..."""

LEVEL_POINTS = 20_000
"""... of those found at this many points of the stock."""


class LoosePiece(Struct, frozen=True, eq=False):
    """A piece of the stock that comes loose: the index of the move that frees it, its area (mm²),
    its box (low x, low y, high x, high y), mm, and points (P, 2) in it. `again`: the index of the
    next move that cuts into it, −1: none."""

    move: int
    area_mm2: float
    box_mm: Box
    points: Floats
    again: int


class LoosePieces(Struct, frozen=True, eq=False):
    """The pieces that come loose, in the order of time. Pieces within cuts narrower than `seen_mm`
    are not found; the narrowest cut is `narrowest_mm` wide."""

    pieces: list[LoosePiece]
    seen_mm: float = 0.0
    narrowest_mm: float = 0.0


class _Level(Struct, frozen=True, eq=False):
    """The cuts that go through the stock where its floor is at this height, mm, and the index of
    each among all moves."""

    floor_mm: float
    cuts: StockMoves
    number: Ints


def loose_pieces(
    moves: StockMoves, thickness_mm: float, box_mm: Box | None, before: StockBefore = WHOLE
) -> LoosePieces:
    """Return the pieces that come loose from a stock of this thickness and with these sides (None:
    unlimited). `before`: what other set-ups have cut."""
    levels = [
        _Level(floor, *_through_cuts(moves, floor))
        for floor in _floors(moves, thickness_mm, before)
    ]
    # From uncut stock a piece can come loose only by cuts through it.
    has_others = bool(before.above or before.below)
    cuts = moves.select(moves.table[moves.tool, 0] > 0.0) if has_others else levels[0].cuts
    across = (cuts.start[:, :2] != cuts.end[:, :2]).any(axis=1)
    if not across.any():
        return LoosePieces([])
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
        return LoosePieces([])
    box = (*low.tolist(), *high.tolist())
    max_cells = MAX_PIECE_CELLS if has_others else MAX_RASTER_CELLS
    cell = max(CELL_SHARE * 2.0 * min_radius, cell_for(box, max_cells))
    raster = _Raster(levels, before, box, cell)
    time = raster.times(box, cell, math.sqrt(0.5) * cell)[1]
    disc = math.pi * min_radius**2
    rows = partings(time, STANDING, MIN_PIECE_SHARE * disc / cell**2)
    cells = min(MAX_PIECE_CELLS, MAX_RASTER_CELLS // max(len(rows), 1))
    pieces = []
    for parting in rows:
        piece = raster.measured(time, parting, cells)
        if piece is not None and piece.area_mm2 >= MIN_PIECE_SHARE * disc:
            is_cut = parting[CUT] * cell**2 >= MIN_CUT_SHARE * disc
            pieces.append(piece if is_cut else replace(piece, again=-1))
    pieces.sort(key=lambda each: each.move)
    return LoosePieces(pieces, cell / CELL_SHARE, 2.0 * min_radius)


def _floors(moves: StockMoves, thickness_mm: float, before: StockBefore) -> list[float]:
    """Return the heights of the floors that moves must reach to cut through: minus the thickness,
    and those that cuts from the other face have left, the lowest first."""
    if not before.below:
        return [-thickness_mm]
    ends = np.concatenate([moves.start, moves.end])[:, :2]
    low, high = ends.min(axis=0), ends.max(axis=0)
    step = math.sqrt(max(float(np.prod(high - low)), 1e-12) / LEVEL_POINTS)
    x, y = (np.arange(low[k], high[k] + step, step) for k in (0, 1))
    floors = before.floors(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))
    floors = distinct(np.floor(floors / WIDTH_STEP_MM) * WIDTH_STEP_MM)
    floors = floors[(floors > -thickness_mm) & (floors < 0.0)]
    return [-thickness_mm, *floors[:: max(1, math.ceil(len(floors) / MAX_LEVELS))].tolist()]


def _through_cuts(moves: StockMoves, bottom_mm: float) -> tuple[StockMoves, Ints]:
    """Return the parts of moves that cut through the stock, and the index of each among all moves.
    They become level moves of flat tools as wide as the tool is at the height `bottom_mm`."""
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
    """The cuts through the stock by level, what other set-ups have cut, and the box and cell size
    of the raster in which pieces are searched."""

    levels: list[_Level]
    before: StockBefore
    box: Box
    cell_mm: float

    def times(
        self, box: Box, cell_mm: float, inwards_mm: float, until: int | None = None
    ) -> tuple[HeightMap, Ints]:
        """Return a raster of a box, and for each of its cells (NY, NX) the first move that cuts it
        through. Only moves up to `until` count, with tools narrower by `inwards_mm`."""
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
            time = number[drawn.owner]  # the last entry is for cells that nothing cuts
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

    def measured(self, time: Ints, parting: Ints, cells: int) -> LoosePiece | None:
        """Return a piece at the time when a move frees it. `parting`: its row from
        `camtool.kernels.pieces.partings`. None if no fine cell of it is left uncut."""
        now, place, low, high, left_column, right = parting[:CUT].tolist()
        row, column = divmod(place, time.shape[1])
        time = time[low : high + 1, left_column : right + 1]
        is_piece = piece_at(time > now, row - low, column - left_column)
        cell = self.cell_mm
        corner = np.array(self.box[:2]) + cell * np.array([left_column, low])
        size = cell * np.array(is_piece.shape[::-1])
        box = (*corner.tolist(), *(corner + size).tolist())
        fine, cut = self.times(box, min(cell, cell_for(box, cells)), 0.0, now)
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
        return LoosePiece(now, len(points) * fine.cell_mm**2, ends, points, next_cut)


def _centres(drawn: HeightMap) -> Floats:
    """Return the centres (P, 2) of all cells of a raster, row by row."""
    return np.stack(np.meshgrid(drawn.x, drawn.y), axis=-1).reshape(-1, 2)
