"""What a machine file may say of the mechanics beyond its single axes."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

import msgspec
from msgspec import Meta

from camtool.machine.ranges import Lost, Place

MAX_SQUARENESS_RAD = 0.1
"""No machine is out of square by more (5.7°): a larger number was meant in other units."""


class PlayCells(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The play of one axis by region of the table, in mm.

    `x_mm` and `y_mm` are the edges of the cells, ascending, in table coordinates: those of the
    work frame less `controller.machine_zero_mm`. `play_mm[j][i]` holds from y_mm[j] up to
    y_mm[j + 1] and from x_mm[i] up to x_mm[i + 1]; outside of all edges holds the nearest cell.
    """

    x_mm: tuple[Place, ...]
    y_mm: tuple[Place, ...]
    play_mm: tuple[tuple[Lost, ...], ...]

    def __post_init__(self) -> None:
        for name, edges in (("x_mm", self.x_mm), ("y_mm", self.y_mm)):
            if len(edges) < 2 or any(a >= b for a, b in pairwise(edges)):
                raise ValueError(f"{name} must be two edges or more, each above the one before")
        rows, columns = len(self.y_mm) - 1, len(self.x_mm) - 1
        if len(self.play_mm) != rows or any(len(row) != columns for row in self.play_mm):
            raise ValueError(
                f"play_mm must be {rows} rows (along y_mm) of {columns} numbers (along x_mm)"
            )


class PlayMap(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The play of X and of Y by region, in place of their `backlash_mm` when `use` is true; an
    axis without cells keeps that."""

    use: bool = False
    x: PlayCells | None = None
    y: PlayCells | None = None

    def __post_init__(self) -> None:
        if self.use and self.x is None and self.y is None:
            raise ValueError("use is true, but neither play_map.x nor play_map.y is there")

    @property
    def used(self) -> tuple[PlayCells | None, PlayCells | None, None]:
        """The cells of X, Y and Z that hold; None where `backlash_mm` does."""
        return (self.x, self.y, None) if self.use else (None, None, None)


class MechanicsOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`squareness_rad`: how much the angle between +X and +Y is less than a right one.
    `seed`: which draws the random repeatability of the axes makes."""

    squareness_rad: Annotated[float, Meta(ge=-MAX_SQUARENESS_RAD, le=MAX_SQUARENESS_RAD)] = 0.0
    seed: Annotated[int, Meta(ge=0, le=(1 << 32) - 1)] = 0
