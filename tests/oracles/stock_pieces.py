"""Pieces that come loose, as sets of cells: the twin of `camtool.kernels.pieces`."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.ndimage import label

from camtool.arrays import Bools, Ints

AROUND = np.ones((3, 3))


@dataclass(eq=False)
class Part:
    """Cells that hold each other; `size` and `cut` count those of earlier groups alone."""

    held: bool = False
    size: int = 0
    cut: int = 0
    cells: set[tuple[int, int]] = field(default_factory=set)


def partings(time: Ints, standing: int, min_cells: float) -> list[tuple[int, ...]]:
    """Time, the least and the greatest row and column, and the number of cells that are cut later,
    of each piece that comes loose."""
    ny, nx = time.shape
    owner: dict[tuple[int, int], Part] = {}
    labels, count = label(time == standing, AROUND)
    for k in range(1, count + 1):
        cells = {(int(y), int(x)) for y, x in np.argwhere(labels == k)}
        held = any(y in (0, ny - 1) or x in (0, nx - 1) for y, x in cells)
        owner |= dict.fromkeys(cells, Part(held, len(cells), 0, cells))
    found = []
    for now in sorted(set(time[time != standing].tolist()), reverse=True):
        added = [(int(y), int(x)) for y, x in np.argwhere(time == now)]
        for cell in added:
            owner[cell] = Part(cells={cell})
            for dy, dx in product((-1, 0, 1), repeat=2):
                one, other = owner[cell], owner.get((cell[0] + dy, cell[1] + dx))
                if other is None or one is other:
                    continue
                if one.held or (not other.held and one.size > other.size):
                    one, other = other, one
                left = one.size if other.held else one.size - one.cut
                if left >= min_cells and not one.held:
                    y, x = zip(*one.cells, strict=True)
                    found.append((now, min(y), max(y), min(x), max(x), one.cut))
                other.size, other.cut = other.size + one.size, other.cut + one.cut
                other.cells |= one.cells
                owner |= dict.fromkeys(one.cells, other)
        for cell in added:
            owner[cell].size += 1
            owner[cell].cut += 1
    return found


def piece_at(standing: Bools, row: int, column: int) -> Bools:
    """The standing cells that one is joined to."""
    labels, _ = label(standing, AROUND)
    return np.asarray((labels == labels[row, column]) & standing)
