"""Where the blocks of a DXF drawing stand, and how many entities that makes.

The count comes first, from the sizes of the blocks alone: nested arrays can say more entities in
a kilobyte than anybody could draw.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.polylines import Floats
from camtool.importers.dxf.frames import Unusable

MAX_INSERTED = 100_000
"""No drawing may grow by more entities than this through its blocks."""


class BlockSizes:
    """How many entities each block holds, blocks within counted in full."""

    def __init__(self, blocks: Any) -> None:
        self._blocks = blocks
        self._sizes: dict[str, int] = {}

    def inserted(self, insert: Any) -> int:
        """Entities that an INSERT stands for, itself included; 1 when its block is missing."""
        if not insert.dxf.hasattr("name"):
            return 1
        name = block_key(insert.dxf.name)
        if name not in self._sizes:
            self._sizes[name] = 0  # what a block that holds itself finds on its way round
            block = self._blocks.get(insert.dxf.name)
            self._sizes[name] = sum(
                self.inserted(entity) if entity.dxftype() == "INSERT" else 1
                for entity in block or ()
            )
        columns, rows = _array(insert)
        return columns * rows * (1 + self._sizes[name])


def matrix(insert: Any) -> Floats:
    """The map (4, 4), for row vectors, of a block's entities to where its INSERT stands.

    DrawingError for numbers that are not finite, Unusable when it has no plane.
    """
    dxf = insert.dxf
    numbers = (*dxf.insert, *dxf.extrusion, dxf.rotation)
    spacing, scales = (dxf.column_spacing, dxf.row_spacing), (dxf.xscale, dxf.yscale, dxf.zscale)
    if not np.isfinite([*numbers, *spacing, *scales]).all():
        raise DrawingError(
            "has a number that is not finite", mend="delete it or insert the block again"
        )
    if not any(dxf.extrusion):
        raise Unusable("has an extrusion of 0")
    return np.array(tuple(insert.matrix44())).reshape(4, 4)


def places(insert: Any) -> Iterator[Floats]:
    """Where the members of an array stand relative to the first one, (3,) in world units.

    The array turns with the INSERT, but its spacing is not scaled.
    """
    columns, rows = _array(insert)
    dxf, ocs = insert.dxf, insert.ocs()
    turn = np.radians(dxf.rotation)
    along = np.array([np.cos(turn), np.sin(turn), 0.0]) * dxf.column_spacing
    across = np.array([-np.sin(turn), np.cos(turn), 0.0]) * dxf.row_spacing
    for row, column in product(range(rows), range(columns)):
        yield np.array(tuple(ocs.to_wcs(tuple(column * along + row * across))))


def block_key(name: Any) -> str:
    """Names of blocks and layers are the same in any case."""
    return str(name).casefold()


def _array(insert: Any) -> tuple[int, int]:
    """Columns and rows; without spacing all members stand on the first one."""
    columns = max(int(insert.dxf.column_count), 1) if insert.dxf.column_spacing else 1
    rows = max(int(insert.dxf.row_count), 1) if insert.dxf.row_spacing else 1
    return columns, rows
