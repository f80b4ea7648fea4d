"""Which module simulates which controller, and what each of them offers."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from typing import Any, Protocol, cast

from camtool.findings import Finding
from camtool.machine.controllers import (
    FlashcutController,
    GrblController,
    I8751Controller,
    LinuxcncController,
    MatlabRouterController,
    PathController,
    PicMmhController,
    ValcncController,
)
from camtool.machine.model import Machine
from camtool.simulation.motion import Chunk, Ledger
from camtool.simulation.options import Options
from camtool.toolpath.moves import Toolpath


class ControllerModel(Protocol):
    """What the module of a controller offers."""

    def run(self, toolpath: Toolpath, machine: Machine, options: Options) -> Iterator[Chunk]:
        """The motion, chunk by chunk, up to the end of the program. Raises MachineError, and
        ProgramError (some only when the row comes) naming the block."""

    def held(self, toolpath: Toolpath, machine: Machine) -> Toolpath:
        """The moves as the controller holds them before it interpolates, row by row: what its
        interpolation is measured against. ProgramError for rows that it cannot follow."""

    def spacing_mm(self, toolpath: Toolpath, machine: Machine) -> float:
        """How far apart in XY the samples of the motion are, about."""

    def interpolation(self, toolpath: Toolpath, machine: Machine, options: Options) -> str:
        """A word for the report: how lines and arcs are made, such as "dsm" or "path"."""

    def assumptions(self, toolpath: Toolpath, machine: Machine) -> tuple[str, ...]:
        """What the times and figures take for granted, one short sentence each."""


_MODULES: dict[type, str] = {
    PicMmhController: "pic_mmh",
    PathController: "path",
    FlashcutController: "flashcut",
    MatlabRouterController: "matlab_router",
    I8751Controller: "i8751",
    ValcncController: "valcnc",
    GrblController: "grbl",
    LinuxcncController: "linuxcnc",
}


class StepsOnTheWay(Protocol):
    """A controller that is run and judged in one go, row by row, without chunks."""

    @property
    def rows(self) -> int:
        """How many rows it runs."""

    def judge(self, low: int, high: int, task: Any, sums: Any) -> Ledger:
        """Run the rows low:high, which follow those run before, and judge them by the task and
        sums of `camtool.kernels.judge`."""


def steps_on_the_way(
    toolpath: Toolpath, machine: Machine, options: Options
) -> StepsOnTheWay | None:
    """The same motion as that of `run`, for models whose module has `judged_steps`; None for
    others, and where that needs chunks."""
    made = getattr(model_of(machine), "judged_steps", None)
    steps: StepsOnTheWay | None = made and made(toolpath, machine, options)
    return steps


def findings_of(toolpath: Toolpath, machine: Machine, options: Options) -> tuple[Finding, ...]:
    """What the controller's model alone knows of a program, from models whose module has
    `findings`."""
    made = getattr(model_of(machine), "findings", None)
    found: tuple[Finding, ...] = made(toolpath, machine, options) if made else ()
    return found


def model_of(machine: Machine) -> ControllerModel:
    """The module that simulates the machine's controller; loads numba."""
    module: Any = import_module(f"camtool.simulation.{_MODULES[type(machine.controller)]}")
    return cast(ControllerModel, module)
