"""The decoded moves as the controller holds them, before it interpolates.

The chain of errors is: wanted ─rounding─▶ held ─interpolation─▶ commanded ─mechanics─▶ slides. A
program says micrometres; a controller works in steps, so what it interpolates is the move
between the nearest steps. That difference belongs to rounding, like the digits of the dialect.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine, PicMmhController
from camtool.toolpath.moves import Floats, Toolpath


def held(decoded: Toolpath, machine: Machine) -> Toolpath:
    """`decoded` on the controller's own grid, row by row: start, ends and, where the controller
    rounds them, arc centres. Raises ProgramError for rows that it cannot follow."""
    if isinstance(machine.controller, PicMmhController):
        coded_mm = [axis.coded_step_mm for axis in machine.axes]
        centre = _on_grid(np.where(decoded.is_arc[:, None], decoded.centre, 0.0), coded_mm[:2])
        return replace(
            decoded,
            start=_on_grid(decoded.start[None, :], coded_mm)[0],
            end=_on_grid(decoded.end, coded_mm),
            centre=np.where(decoded.is_arc[:, None], centre, np.nan),
        )
    from camtool.simulation.path import followed  # loads numba

    return followed(decoded, machine)


def _on_grid(points: Floats, coded_mm: list[float]) -> Floats:
    """Points (J, A) mm, each coordinate at its nearest step."""
    columns = [to_steps(points[:, axis], step) * step for axis, step in enumerate(coded_mm)]
    return np.column_stack(columns)
