"""The contract of a target: one machine's dialect and its controller, behind one object.

A target is the object that an entry point of the group `camtool.postprocessors` names. It defines
what its machine file may contain (`controllers`, `dialect`), writes and reads programs, and has
the model of its controller. Methods with a body are optional: a target overrides them where it
differs. docs/write-a-post.md builds a complete target.

A list of all targets uses only the attributes of each; so a target imports its writer, its reader
and its model within the methods that need them, or names them with `lazy_call`."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

import msgspec
from msgspec import Struct

from camtool.errors import MachineError
from camtool.findings import TargetCode
from camtool.machine.model import Axis, Grade, Link, Machine, SlideStart
from camtool.target.signals import NoSignals, SignalModel

if TYPE_CHECKING:
    from pathlib import Path

    from camtool.machine.servo import ServoTicks, SpeedLoop
    from camtool.simulation.controller import ControllerModel
    from camtool.target.twin import Twin
    from camtool.target.wire import NoWire, Wire
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program


class NoDialect(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The `[dialect]` of a target without options of its own."""


NEAR_RATIO = 1e-6
"""Settings whose ratio is nearer to 1 than this are equal."""


class ControllerSetting(Struct, frozen=True):
    """A value of a machine file from a controller's own settings: its key, such as
    "axes.x.travel_mm"; the setting that says it, such as "$130"; and where that stands. `doubt`:
    why it may not be a value of this machine; it is then written as a comment."""

    key: str
    value: float | int | str | Sequence[str]
    said: str
    where: str = ""
    doubt: str = ""


class OpenKey(Struct, frozen=True):
    """A key of a machine file that a sample program leaves open: the question to ask, our default,
    and the possible answers, () for any. `is_list`: the file has a list of such values."""

    key: str
    question: str
    default: float | int | str
    choices: tuple[str, ...] = ()
    is_list: bool = False


class SampledDialect(Struct, frozen=True):
    """What a sample program reveals of its dialect, and the questions that it leaves open."""

    settings: tuple[ControllerSetting, ...]
    questions: tuple[OpenKey, ...]


def lazy_call(path: str) -> Any:
    """Return a method that calls the function or class at `path` ("package.module:name") with its
    own arguments; the module is imported at the first call, so that listing targets stays fast."""

    def call(self: Target, *arguments: Any, **named: Any) -> Any:
        return _named_by(path)(*arguments, **named)

    call.path = path  # type: ignore[attr-defined]
    return call


def lazy_name(path: str) -> Any:
    """Return a method that returns what is at `path`, as `lazy_call` calls it."""

    def get(self: Target) -> Any:
        return _named_by(path)

    get.path = path  # type: ignore[attr-defined]
    return get


def _named_by(path: str) -> Any:
    module, _, name = path.partition(":")
    return getattr(import_module(module), name)


class Target(ABC):
    """A machine for which camtool writes programs. `read` shares no code with `write`, so that a
    fault in one shows in the other.

    `controllers`: the records of `[controller]`, one for each `model`; the exact path
    (`PathController`) is always possible. `dialect`: the record of `[dialect]`; writer and reader
    find it in `machine.dialect`. `link`: the record of `[link]`, with keys of its own line."""

    name: ClassVar[str]
    controllers: ClassVar[tuple[type[SlideStart], ...]] = ()
    dialect: ClassVar[type[msgspec.Struct]] = NoDialect
    link: ClassVar[type[Link]] = Link

    interpolators: ClassVar[tuple[str, ...]] = ()
    """The choices of `--interpolator`, if there are any."""
    ways: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Keys of the machine file for how its controller draws, with the possible values of each,
    which `camtool meet` may propose."""
    meanings: ClassVar[Mapping[str, str]] = {}
    """The meanings of words that move nothing, such as "G21", for `camtool explain`."""
    codes: ClassVar[tuple[TargetCode, ...]] = ()
    """The codes of its own findings; their names start with the name of the target and a dot."""
    starts_spindle: ClassVar[bool] = False
    """True if a program starts the spindle, at a speed in the program."""
    switches_coolant: ClassVar[bool] = False
    """True if a program can switch coolant."""
    any_machine: ClassVar[bool] = False
    """True if the machine file describes no particular machine: travel and rates are examples."""
    grade: ClassVar[Grade] = "step-true"
    """How much the model of its controllers computes."""
    filter_default: ClassVar[bool] = False
    """True if `camtool filter` uses it by default."""
    no_twin: ClassVar[str] = "its wire is not modelled"
    """Reason for the lack of a virtual controller."""
    settings_listing: ClassVar[str] = ""
    """Name of the listing that `settings_from` reads, such as "what it answers to $$"; "" where it
    reads none."""

    @abstractmethod
    def write(self, toolpath: Toolpath, machine: Machine[Any, Any]) -> Program:
        """Return the program for a toolpath; PostError, with the move, for what the machine or its
        dialect cannot do."""

    @abstractmethod
    def read(self, data: bytes, machine: Machine[Any, Any]) -> Toolpath:
        """Return the moves of a program as the controller decodes them; ProgramError, with block
        and column."""

    def read_in(self, data: bytes, machine: Machine[Any, Any], folder: Path | None) -> Toolpath:
        """Return the moves as `read` does, for a program whose file lies in `folder` (None: it has
        no file), where the controller looks for programs that it calls."""
        return self.read(data, machine)

    def check(self, machine: Machine[Any, Any]) -> None:  # noqa: B027 - most need not
        """Raise MachineError for values of a machine that contradict each other."""

    def grade_of(self, machine: Machine[Any, Any]) -> Grade:
        """Return how much the model of this machine's controller computes (see `Grade`), if that
        is not the exact path."""
        return machine.target.grade or self.grade

    def model(self) -> ControllerModel[Any, Any]:
        """Return the model of the target's controllers; needed only if `controllers` names any."""
        raise NotImplementedError(f"{self.name} has no model of its controllers")

    def speed_loop(self, machine: Machine[Any, Any]) -> SpeedLoop | None:
        """Return the speed loops of the machine's servo axes; None for a controller
        without any."""
        return None

    def loop_keys(self, loop: SpeedLoop) -> Mapping[str, Any]:
        """Return the keys of `[controller]` that describe this loop in a machine file."""
        raise NotImplementedError(f"{self.name} has no speed loop")

    def servo_ticks(self, toolpath: Toolpath, machine: Machine[Any, Any]) -> Iterator[ServoTicks]:
        """Yield the passes of its speed loops in order, as many and at the same times as the
        samples of its model. Raises as `ControllerModel.run`."""
        raise NotImplementedError(f"{self.name} has no speed loop")

    def settings_from(self, text: str) -> Sequence[ControllerSetting] | None:
        """Return the values for a machine file in a listing of the controller's own settings; None
        if the text is no such listing. MachineError for settings that are missing or cannot be
        used."""
        return None

    def dialect_from(self, data: bytes) -> SampledDialect | None:
        """Return what a sample program reveals of its dialect (b"": nothing); None for a target
        whose dialect is not described by machine files."""
        return None

    def compare_settings(
        self, text: str, machine: Machine[Any, Any]
    ) -> tuple[list[str], list[str]]:
        """Compare the controller's own settings with the machine file. Return the differences that
        spoil a part or may damage the machine, and other remarks. MachineError as
        `settings_from`."""
        settings = self.settings_from(text)
        if settings is None:
            raise MachineError("says nothing of a machine")
        errors = []
        for setting in settings:
            value: Any = machine
            for name in setting.key.split("."):
                value = getattr(value, name, None)
            is_near = value == setting.value
            if isinstance(value, float | int) and isinstance(setting.value, float | int):
                is_near = math.isclose(value, setting.value, rel_tol=NEAR_RATIO)
            if value is not None and not is_near:
                errors.append(
                    f"{setting.said} means {setting.value}, but {setting.key} of the machine file "
                    f"is {value}: change one of the two"
                )
        return errors, []

    def signals(self) -> SignalModel | NoSignals:
        """Return the model of the signals of the machine's motors; by default a `NoSignals`, which
        says why there is none."""
        return NoSignals()

    def wire(self) -> Wire | NoWire:
        """Return the protocol that sends programs to the machine; by default a `NoWire`, which
        says why there is none."""
        from camtool.target.wire import NoWire

        return NoWire()

    def listing(self, data: bytes, machine: Machine[Any, Any]) -> Listing | None:
        """Return a program that `read` accepts, divided into blocks; None for a dialect without
        such a listing."""
        return None

    def made_elsewhere(self, data: bytes) -> bool:
        """Return True if the program's text shows that it was not written by camtool."""
        return False

    def line_bytes(self, data: bytes, machine: Machine[Any, Any]) -> int:
        """Return the number of bytes sent over the line to the machine; by default the size of the
        file."""
        return len(data)

    def stray_mm(self, machine: Machine[Any, Any]) -> float:
        """Return the largest distance from the wanted path that the writer allows on purpose,
        mm."""
        return 0.0

    def unit_mm(self, machine: Machine[Any, Any], axis: Axis) -> float:
        """Return the resolution of positions in a program along an axis, mm."""
        return max(axis.coded_step_mm, axis.resolution_mm or 0.0)

    def rest(
        self, data: bytes, machine: Machine[Any, Any], first: int
    ) -> tuple[bytes, int] | None:
        """Return the program from block `first` (from 0) on, and the number of its blocks that
        bring the machine there. None: the caller writes the moves again behind an entry. PostError
        where a rest is impossible."""
        return None

    def twin_kind(self) -> type[Twin]:
        """Return the class of its virtual controllers, which are made from a machine and a record
        of its `settings`; MachineError, which says why, for a target that has none."""
        raise MachineError(f"{self.name} has no virtual controller: {self.no_twin}")
