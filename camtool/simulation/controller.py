"""The model of a controller: the motion of a toolpath, and what is known about it.

A model is a subclass of `ControllerModel` that overrides what differs. Its toolpaths are those
that `read` of its target decodes; the `[controller]` of its machines is a record of that target.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, ClassVar, Generic, Protocol

import numpy as np

from camtool.arrays import Floats
from camtool.findings import Finding
from camtool.machine.model import ControllerT, DialectT, Machine
from camtool.simulation.motion import Chunk, Ledger, Options
from camtool.simulation.rows import check_positions, with_event_positions
from camtool.simulation.timing import SampleClock, TimedChunk
from camtool.toolpath.moves import Toolpath


class FusedRun(Protocol):
    """A run of a program that is judged row by row while it is simulated, without chunks."""

    @property
    def rows(self) -> int:
        """Return the number of rows."""

    def judge(self, low: int, high: int, task: Any, sums: Any) -> Ledger:
        """Simulate and judge the rows low:high, which follow those of the last call; their figures
        are added to `sums` in place (`camtool.kernels.judging`). Return the ledger of the rows."""


class ControllerModel(ABC, Generic[ControllerT, DialectT]):
    """The model of one kind of controller: how it rounds, interpolates and times moves."""

    samples_per_speed: ClassVar[int] = 16
    """A speed is measured over this many samples: steps of several axes come in turns, and one
    alone is up to 41 % off; 16 are at most 3 % off. 1 where samples are positions of a smooth
    motion."""

    def speed_period_s(self, machine: Machine[ControllerT, DialectT]) -> float:
        """Return the shortest time (s) over which a speed is averaged; 0 if the speed between two
        samples is meaningful."""
        return 0.0

    @abstractmethod
    def run(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> Iterator[Chunk]:
        """Yield the motion in chunks, up to the end of the program. MachineError, and ProgramError
        with the block (for some faults only when that row is run)."""

    def timed(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> Iterator[TimedChunk]:
        """Yield the motion of `run` with the time of each sample."""
        clock = self.clock(toolpath, machine)
        for chunk in self.run(toolpath, machine, options):
            yield clock.timed(chunk)

    def clock(self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT]) -> SampleClock:
        """Return the clock that times the samples; by default the samples of a row within a chunk
        share its time equally."""
        return SampleClock(self.quantised(toolpath, machine), machine)

    @abstractmethod
    def interpolation(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> str:
        """Return a word for the report that names how lines and arcs are interpolated, such as
        "dsm" or "path"."""

    def quantised(self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT]) -> Toolpath:
        """Return the moves as the controller rounds them before interpolation, row by row; the
        error of interpolation is measured from these. ProgramError for rows that it cannot follow.

        By default nothing is rounded, and homing ends at machine zero."""
        check_positions(toolpath, machine)
        return with_event_positions(
            toolpath, np.array(machine.controller.machine_zero_mm, dtype=np.float64)
        )

    def spacing_mm(self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT]) -> float:
        """Return the approximate distance of samples of the motion in XY, mm; by default a
        step."""
        return min(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)

    def seconds(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT]
    ) -> Floats | None:
        """Return (N,) s that each row takes, computed without simulating the motion; None for a
        model that cannot. Raises as `run`."""
        return None

    def assumptions(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT]
    ) -> tuple[str, ...]:
        """Return the assumptions behind times and figures, one short sentence each."""
        return ()

    def findings(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> tuple[Finding, ...]:
        """Return findings that only the model can make."""
        return ()

    def fused_run(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> FusedRun | None:
        """Return the motion of `run` in a form that is judged while it is simulated (faster); None
        for a model that only makes chunks."""
        return None
