"""Height maps of the stock, for pictures: exact heights at the centres of the cells of a grid."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from camtool.arrays import Floats, Indices
from camtool.kernels.heightmap import cut_heights
from camtool.stock.moves import StockMoves

MAX_CELLS = 16_000_000
"""A larger map is refused: 64 MB, and as much for the moves that cut its cells."""

NO_MOVE = -1
"""Owner of cells that no move cuts."""

Box = tuple[float, float, float, float]
"""Left, lower, right and upper edge, mm."""


class HeightMap(Struct, frozen=True, eq=False):
    """Heights (NY, NX) mm of the stock at the centres of square cells, row 0 the lowest in Y; 0 at
    its top. The lower left corner of cell (0, 0) lies at `corner_mm`. `owner` (NY, NX): the move
    that cut a cell deepest (the earliest of several), or NO_MOVE; None where not asked for."""

    heights: npt.NDArray[np.float32]
    cell_mm: float
    corner_mm: tuple[float, float]
    owner: Indices | None = None

    @property
    def x(self) -> Floats:
        """X of the centres of the columns (NX,), mm."""
        place = np.arange(self.heights.shape[1], dtype=np.float64)
        return np.asarray(self.corner_mm[0] + (place + 0.5) * self.cell_mm)

    @property
    def y(self) -> Floats:
        """Y of the centres of the rows (NY,), mm."""
        place = np.arange(self.heights.shape[0], dtype=np.float64)
        return np.asarray(self.corner_mm[1] + (place + 0.5) * self.cell_mm)

    def at(self, points: Floats) -> Floats:
        """Return the heights (J,) of the cells that contain the points (J, 2); NaN outside the
        map."""
        place = np.floor((points - np.array(self.corner_mm)) / self.cell_mm)
        inside = ((place >= 0.0) & (place < self.heights.shape[::-1])).all(axis=1)
        column, row = np.where(inside[:, None], place, 0.0).astype(np.int64).T
        return np.where(inside, self.heights[row, column].astype(np.float64), np.nan)


def height_map(moves: StockMoves, box: Box, cell_mm: float, *, owners: bool = False) -> HeightMap:
    """Return a map of the box with the moves cut into it; ValueError for more than MAX_CELLS
    cells."""
    left_x, bottom, right, top = box
    columns = max(1, math.ceil((right - left_x) / cell_mm - 1e-9))
    rows = max(1, math.ceil((top - bottom) / cell_mm - 1e-9))
    if columns * rows > MAX_CELLS:
        raise ValueError(f"{columns} × {rows} cells are more than {MAX_CELLS}")
    heights = HeightMap(
        np.zeros((rows, columns), dtype=np.float32),
        cell_mm,
        (left_x, bottom),
        np.full((rows, columns), NO_MOVE, dtype=np.int32) if owners else None,
    )
    add_moves(heights, moves)
    return heights


def add_moves(heights: HeightMap, moves: StockMoves, first: int = 0) -> None:
    """Cut more moves into a map, in place; the owners of cells are numbered from `first` on."""
    left_x, bottom = heights.corner_mm
    half = 0.5 * heights.cell_mm
    owner = np.empty((0, 0), dtype=np.int32) if heights.owner is None else heights.owner
    cut_heights(
        heights.heights,
        owner,
        (left_x + half, bottom + half, heights.cell_mm),
        np.ascontiguousarray(moves.start),
        np.ascontiguousarray(moves.end),
        np.ascontiguousarray(moves.tool, dtype=np.int64),
        moves.table,
        first,
    )


def cell_for(box: Box, cells: int) -> float:
    """Return the side of a square cell, mm, with which a map of the box has about `cells`
    cells."""
    area = max((box[2] - box[0]) * (box[3] - box[1]), 1e-12)
    return math.sqrt(area / cells)
