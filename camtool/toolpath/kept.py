"""What cuts must leave of the material: regions between drawn lines, and who must leave them."""

from __future__ import annotations

from dataclasses import dataclass

from camtool.geometry.polylines import Bools, Floats, Polylines


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
