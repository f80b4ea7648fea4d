"""What the model of a controller offers: the motion of a toolpath, and what is known of it.

A model subclasses `ControllerModel` and overrides what is different about it. It is asked about
toolpaths as `read` of its target decodes them, on machines whose `[controller]` is a record of
that target.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, Generic, Protocol

import numpy as np

from camtool.findings import Finding
from camtool.machine.model import ControllerT, DialectT, Machine
from camtool.simulation.motion import Chunk, Ledger, Options
from camtool.simulation.rows import check_positions, placed
from camtool.toolpath.moves import Toolpath


class FusedRun(Protocol):
    """A run that is simulated and judged in one go, row by row, without chunks."""

    @property
    def rows(self) -> int:
        """How many rows it runs."""

    def judge(self, low: int, high: int, task: Any, sums: Any) -> Ledger:
        """Run the rows low:high, which follow those run before, and judge them by the task and
        sums of `camtool.kernels.judge`."""


class ControllerModel(ABC, Generic[ControllerT, DialectT]):
    """One controller's own arithmetic."""

    @abstractmethod
    def run(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> Iterator[Chunk]:
        """The motion, chunk by chunk, up to the end of the program. Raises MachineError, and
        ProgramError (some only when the row comes) naming the block."""

    @abstractmethod
    def interpolation(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> str:
        """A word for the report: how lines and arcs are made, such as "dsm" or "path"."""

    def quantised(self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT]) -> Toolpath:
        """The moves as the controller has them before it interpolates, row by row: what its
        interpolation is measured against. ProgramError for rows that it cannot follow.

        Here: as they are read, homing at machine zero, nothing rounded.
        """
        check_positions(toolpath, machine)
        return placed(toolpath, np.array(machine.controller.machine_zero_mm, dtype=np.float64))

    def spacing_mm(self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT]) -> float:
        """How far apart in XY the samples of the motion are, about; here: a step."""
        return min(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)

    def assumptions(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT]
    ) -> tuple[str, ...]:
        """What the times and figures take for granted, one short sentence each."""
        return ()

    def findings(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> tuple[Finding, ...]:
        """What the model alone knows of a program."""
        return ()

    def fused_run(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> FusedRun | None:
        """The same motion as that of `run`, judged as it is made; None where that needs chunks."""
        return None
