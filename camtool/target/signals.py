"""The signals of a controller: which lines its motors have, and when it moves them.

A target that has steps returns a `SignalModel` from `Target.signals`; any other a `NoSignals`,
which says why. Lines are bits of ports, bytes that the controller writes; two kinds of motors:

    Coils           the controller switches the coils itself, by a cyclic sequence of states
    StepDirection   a driver has a line for steps and one for the direction"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from msgspec import Struct

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.simulation.pulses import Pulses
    from camtool.toolpath.moves import Toolpath


class Coils(Struct, frozen=True):
    """A motor whose coils are the bits of `port` from `shift` on: `lines`, their names from the
    lowest one; `states`, the values of these bits in the order of a positive move;
    `states_per_step`, the number of these in a step. `at_start`: the first state is on, or there
    is no current until the first move, which then begins with the first state of its direction."""

    name: str
    port: str
    shift: int
    lines: tuple[str, ...]
    states: tuple[int, ...]
    states_per_step: int = 1
    at_start: Literal["first", "off"] = "first"


class StepDirection(Struct, frozen=True):
    """A motor with a driver: (port, bit) of its lines. The step line is high for `width_s`, and
    the level of the direction line is `positive` (0 or 1) for positive moves; it is set together
    with the step."""

    name: str
    step: tuple[str, int]
    direction: tuple[str, int]
    width_s: float
    positive: int = 0


Motor: TypeAlias = Coils | StepDirection


class Board(Struct, frozen=True):
    """The lines of a controller. `motors`: X, Y, Z and further ones, as `Pulses.moves` has them.
    Times are whole numbers of `tick_s`, 1, 10 or 100 of a power of 1000; tables have them in
    `unit` ("ms" or "us"). `notes`: assumptions about the lines, a sentence each."""

    motors: tuple[Motor, ...]
    tick_s: float
    unit: Literal["ms", "us"]
    notes: tuple[str, ...] = ()


class SignalModel(ABC):
    """The signals that a controller makes of a toolpath that `read` of its target decodes."""

    @abstractmethod
    def board(self, machine: Machine[Any, Any]) -> Board:
        """Return the lines of the machine's controller."""

    @abstractmethod
    def pulses(self, toolpath: Toolpath, machine: Machine[Any, Any]) -> Iterator[Pulses]:
        """Yield the pulses of all motors up to the end of the program. Not counting those that are
        `is_added`, each axis makes the same steps as in the ledgers of the controller's model.
        Raises as `ControllerModel.run`."""


class NoSignals(Struct, frozen=True):
    """A controller without signals of its own: `why`, and what shows its motion, `mend`."""

    why: str = "its model does not say when each step comes"
    mend: str = "camtool preview --simulate FILE.html plays its motion"
