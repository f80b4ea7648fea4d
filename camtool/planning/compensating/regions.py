"""What play and compensation leave over in each region of the table, seen from the motors.

A wanted path is cut at the edges of the regions. They belong to positions of the controller,
which are the wanted ones but for the play: near an edge the play of the neighbour may be taken.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import pairwise

import msgspec

from camtool.kernels.lattice import to_steps
from camtool.machine.model import Axis, Machine, PlayCells
from camtool.planning.compensating.stretch import Stretch
from camtool.planning.reversing.residual import Residual, residual

LEAST_SHARE = 1e-9
"""An edge nearer than this share of a stretch to its end is that end."""


class Regions:
    """The residuals of a machine by place; play is divided by the scale, since the path is that
    of the motors."""

    def __init__(self, machine: Machine) -> None:
        self._cells: tuple[PlayCells | None, ...] = machine.play_map.used
        self._zero = machine.controller.machine_zero_mm
        self._plain = tuple(_residual(axis, machine, None) for axis in machine.axes)
        self._by_cell: list[list[list[Residual]]] = [
            [[_residual(axis, machine, play) for play in row] for row in one.play_mm]
            if one is not None
            else []
            for axis, one in zip(machine.axes, self._cells, strict=True)
        ]

    @property
    def matter(self) -> bool:
        """Whether there is play or compensation anywhere."""
        cells = [one for table in self._by_cell for row in table for one in row]
        return any(one.matters for one in (*self._plain, *cells))

    def residuals(self, point: Sequence[float]) -> tuple[Residual, ...]:
        """(X, Y, Z) where the tool is at `point` mm."""
        found = []
        for axis, cells in enumerate(self._cells):
            if cells is None:
                found.append(self._plain[axis])
                continue
            column = bisect_right(cells.x_mm[1:-1], point[0] - self._zero[0])
            row = bisect_right(cells.y_mm[1:-1], point[1] - self._zero[1])
            found.append(self._by_cell[axis][row][column])
        return tuple(found)

    def parts(self, stretch: Stretch) -> Iterator[Stretch]:
        """The stretch cut at the edges of all regions."""
        shares = {0.0, 1.0}
        for cells in self._cells:
            if cells is None:
                continue
            for axis, edges in ((0, cells.x_mm), (1, cells.y_mm)):
                low, high = sorted((stretch.begin[axis], stretch.end[axis]))
                for edge in edges[1:-1]:
                    value = edge + self._zero[axis]
                    if low < value < high:
                        share = stretch.where(axis, value)
                        if LEAST_SHARE < share < 1.0 - LEAST_SHARE:
                            shares.add(share)
        if len(shares) == 2:
            yield stretch
            return
        for begin, end in pairwise(sorted(shares)):
            yield stretch.part(begin, end)


def _residual(axis: Axis, machine: Machine, play_mm: float | None) -> Residual:
    """Of an axis with this play, None: its own; compensation is whole steps."""
    play = axis.backlash_mm if play_mm is None else play_mm
    whole = float(to_steps(axis.compensation_mm, axis.coded_step_mm)) * axis.coded_step_mm
    at_motor = msgspec.structs.replace(
        axis,
        backlash_mm=play * axis.coded_step_mm / axis.real_step_mm,
        compensation_mm=whole,
    )
    return residual(at_motor, machine.controller)
