"""Which module simulates which controller, and what each of them offers."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from typing import Any, Protocol, cast

from camtool.errors import OptionError
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
from camtool.simulation.motion import Chunk, Ledger, Options
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
    PicMmhController: "camtool_postprocessors.pic_mmh.controller",
    PathController: "camtool.simulation.path",
    FlashcutController: "camtool_postprocessors.flashcut.controller",
    MatlabRouterController: "camtool_postprocessors.matlab_router.controller",
    I8751Controller: "camtool_postprocessors.i8751.controller",
    ValcncController: "camtool_postprocessors.valcnc.controller",
    GrblController: "camtool_postprocessors.grbl.controller",
    LinuxcncController: "camtool_postprocessors.linuxcnc.controller",
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
    module: Any = import_module(_MODULES[type(machine.controller)])
    return cast(ControllerModel, module)


# The door of the simulation: a toolpath and a machine in, the motion of its slides out.


def simulate(
    toolpath: Toolpath, machine: Machine, options: Options | None = None
) -> Iterator[Chunk]:
    """The motion that the machine's controller and mechanics make of a toolpath, chunk by chunk.

    Rows behind the end of the program are not run. Raises OptionError, MachineError, and
    ProgramError (some of them only when the row comes) naming the block.
    """
    options = options or Options()
    check_options(machine, options)
    return model_of(machine).run(toolpath, machine, options)


def check_options(machine: Machine, options: Options) -> None:
    """OptionError for what the machine's controller cannot do."""
    if options.chunk_steps < 1:
        raise OptionError(f"chunk_steps is {options.chunk_steps}", mend="give at least 1")
    if options.interpolator not in (None, "dsm", "dda", "stairs"):
        raise OptionError(
            f"unknown interpolator {options.interpolator!r}", mend="dsm, dda or stairs"
        )
    if options.interpolator is not None and not isinstance(machine.controller, PicMmhController):
        raise OptionError(
            f"the controller of {machine.target.name} has no interpolators to choose from",
            where="--interpolator",
            mend="leave it out",
        )
