"""What a planned toolpath is wanted for: what was drawn, and what it must leave standing."""

from __future__ import annotations

from dataclasses import dataclass, replace

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.polylines import Polylines


@dataclass(frozen=True, eq=False)
class Drawn:
    """What was drawn, as far as the N rows of a planned toolpath stand for it.

    `off_mm` (N, 2): the largest and the rms distance, mm, between the lines that a row was planned
    along and what was drawn; 0 for rows that stand for nothing drawn. `edge` (N,): the edge of the
    part that a row cuts, −1 where none is known. Of E edges, [[x low, x high], [y low, y high]] mm
    in the work frame: `nominal` (E, 2, 2) as drawn, and `planned` (E, 2, 2) as the tool leaves
    them when it runs exactly as planned.
    """

    off_mm: Floats
    edge: Ints
    nominal: Floats
    planned: Floats

    def picked(self, row: Ints) -> Drawn:
        """Rows (M,) of this one, in that order and as often as they are named."""
        return replace(self, off_mm=self.off_mm[row], edge=self.edge[row])


@dataclass(frozen=True, eq=False)
class Kept:
    """Runs of one tool and the region that they must leave.

    `runs`: vertices (n, 4) each of x, y, z, bulge, mm. `lines`: M closed paths, outer ones before
    those within them; what a path holds stays where `stays` (M,) is true and is free where it is
    not; `beyond`: whether what no path holds stays.
    """

    runs: tuple[Floats, ...]
    lines: Polylines
    stays: Bools
    beyond: bool
