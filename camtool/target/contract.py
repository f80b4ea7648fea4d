"""The contract of a target: one machine's dialect and its controller, behind one object.

A target is the object that an entry point of the group `camtool.postprocessors` names. It says
what its machine file may hold (`controllers`, `dialect`), writes and reads programs, and has the
model of its controller. What stands here with a body is optional: a target overrides what is
different about it. docs/write-a-post.md builds a whole one.

A list of all targets asks each for its records only; so a target imports its writer, its reader
and its model in the methods that need them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

import msgspec

from camtool.findings import TargetCode
from camtool.machine.model import Axis, Machine, SlideStart

if TYPE_CHECKING:
    from camtool.simulation.controller import ControllerModel
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program


class NoDialect(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The `[dialect]` of a target without options of its own."""


class Target(ABC):
    """A machine that camtool speaks to. `read` shares no code with `write`, so that a fault in one
    shows in the other.

    `controllers`: what `[controller]` may be, one record per `model`; that of the exact path
    (`PathController`) may stand there always. `dialect`: what `[dialect]` may say; writer and
    reader find it in `machine.dialect`.
    """

    name: ClassVar[str]
    controllers: ClassVar[tuple[type[SlideStart], ...]] = ()
    dialect: ClassVar[type[msgspec.Struct]] = NoDialect

    interpolators: ClassVar[tuple[str, ...]] = ()
    """What `--interpolator` may put in the place of the controller's own, if anything."""
    codes: ClassVar[tuple[TargetCode, ...]] = ()
    """Codes of its own findings; each name begins with the target's and a dot."""
    starts_spindle: ClassVar[bool] = False
    """Whether a program starts the spindle, at the speed that it says."""
    any_machine: ClassVar[bool] = False
    """Whether the machine file stands for any machine, with travel and rates of none in
    particular."""
    filter_default: ClassVar[bool] = False
    """Whether `camtool filter` takes it where no target is named."""

    @abstractmethod
    def write(self, toolpath: Toolpath, machine: Machine[Any, Any]) -> Program:
        """The program; PostError naming the move that the machine or the dialect cannot do."""

    @abstractmethod
    def read(self, data: bytes, machine: Machine[Any, Any]) -> Toolpath:
        """The moves as this machine's controller decodes them; ProgramError with block, column."""

    def check(self, machine: Machine[Any, Any]) -> None:  # noqa: B027 - most need not
        """Raise MachineError where values of a machine do not go together."""

    def model(self) -> ControllerModel[Any, Any]:
        """How its controllers move; asked only where `controllers` names any."""
        raise NotImplementedError(f"{self.name} has no model of its controllers")

    def listing(self, data: bytes, machine: Machine[Any, Any]) -> Listing | None:
        """Which part of a program, which `read` takes, each block is; None where nobody can show
        it."""
        return None

    def line_bytes(self, data: bytes, machine: Machine[Any, Any]) -> int:
        """How many bytes go over the line to the machine, where the file is a listing of them."""
        return len(data)

    def stray_mm(self, machine: Machine[Any, Any]) -> float:
        """How far moves may leave the wanted path on purpose, at most."""
        return 0.0

    def unit_mm(self, machine: Machine[Any, Any], axis: Axis) -> float:
        """The finest difference of places that a program can say along an axis."""
        return max(axis.coded_step_mm, axis.resolution_mm or 0.0)
