"""The planners of controllers whose language a machine file describes, by `[controller] model`.

A planner is a record, which names what its controller may be set to, and a model, which turns the
decoded toolpath and the machine into chunks of motion (`camtool.simulation.controller`). A new one
is a file of its own in this folder with its model, a record in `controllers.py`, and a line in
`PLANNERS`:

    "marlin": Planner(MarlinController, "timed", _marlin)

where `_marlin` imports the file and returns its `ControllerModel`. The exact path (`model =
"path"`) is always there; it knows no times of acceleration."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Any, Final, Literal

from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import CamtoolError
from camtool.findings import Finding
from camtool.machine.model import Machine, SlideStart
from camtool.simulation.controller import ControllerModel, FusedRun
from camtool.simulation.motion import Chunk, Options
from camtool.simulation.path import PathModel
from camtool.toolpath.moves import Toolpath

from .controllers import KlipperController, MarlinController, TrapezoidController

AnyMachine = Machine[Any, Any]


class Planner(Struct, frozen=True):
    """A planner: the record of its controller's settings, the grade of its model, and a function
    that imports the model."""

    record: type[SlideStart]
    grade: Literal["step-true", "timed"]
    model: Callable[[], ControllerModel[Any, Any]]


def _klipper() -> ControllerModel[Any, Any]:
    from .klipper import KlipperModel

    return KlipperModel()


def _marlin() -> ControllerModel[Any, Any]:
    from .marlin import MarlinModel

    return MarlinModel()


def _trapezoid() -> ControllerModel[Any, Any]:
    from .trapezoid import TrapezoidModel

    return TrapezoidModel()


PLANNERS: Final[Mapping[str, Planner]] = {
    "klipper": Planner(KlipperController, "timed", _klipper),
    "marlin": Planner(MarlinController, "timed", _marlin),
    "trapezoid": Planner(TrapezoidController, "timed", _trapezoid),
}
"""Planners by the name that `[controller] model` gives, which is the tag of their record."""


def controller_records() -> tuple[type[SlideStart], ...]:
    """Return the records that `[controller]` may be read into, besides that of the exact path."""
    return tuple(planner.record for planner in PLANNERS.values())


def planner_of(machine: AnyMachine) -> Planner | None:
    """Return the planner of the machine's controller; None for the exact path."""
    record = type(machine.controller)
    return next((each for each in PLANNERS.values() if each.record is record), None)


def model_of(machine: AnyMachine) -> ControllerModel[Any, Any]:
    """Return the model of the machine's controller."""
    planner = planner_of(machine)
    return PathModel() if planner is None else planner.model()


def seconds_of(toolpath: Toolpath, machine: AnyMachine) -> Floats | None:
    """Return (N,) seconds that the controller takes for each row; None where no planner gives them
    or they are not asked for."""
    if machine.dialect.comments.show in ("none", "header"):
        return None
    with suppress(CamtoolError):
        return model_of(machine).seconds(toolpath, machine)
    return None


class PlannedModel(ControllerModel[Any, Any]):
    """Passes each call on to the model of the machine's own planner."""

    def run(self, toolpath: Toolpath, machine: AnyMachine, options: Options) -> Iterator[Chunk]:
        """Yield the motion in chunks."""
        return model_of(machine).run(toolpath, machine, options)

    def interpolation(self, toolpath: Toolpath, machine: AnyMachine, options: Options) -> str:
        """Return the planner's name for its interpolation."""
        return model_of(machine).interpolation(toolpath, machine, options)

    def quantised(self, toolpath: Toolpath, machine: AnyMachine) -> Toolpath:
        """Return the toolpath with its places as the planner rounds them."""
        return model_of(machine).quantised(toolpath, machine)

    def spacing_mm(self, toolpath: Toolpath, machine: AnyMachine) -> float:
        """Return the distance between the planner's samples, mm."""
        return model_of(machine).spacing_mm(toolpath, machine)

    def seconds(self, toolpath: Toolpath, machine: AnyMachine) -> Floats | None:
        """Return (N,) seconds that each row takes; None where the planner does not know them
        without the motion."""
        return model_of(machine).seconds(toolpath, machine)

    def assumptions(self, toolpath: Toolpath, machine: AnyMachine) -> tuple[str, ...]:
        """Return the planner's assumptions."""
        return model_of(machine).assumptions(toolpath, machine)

    def findings(
        self, toolpath: Toolpath, machine: AnyMachine, options: Options
    ) -> tuple[Finding, ...]:
        """Return the findings of the planner itself."""
        return model_of(machine).findings(toolpath, machine, options)

    def fused_run(
        self, toolpath: Toolpath, machine: AnyMachine, options: Options
    ) -> FusedRun | None:
        """Return the planner's fused run; None if it has none."""
        return model_of(machine).fused_run(toolpath, machine, options)
