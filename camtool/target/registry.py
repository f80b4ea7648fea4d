"""The installed targets: found by entry points, each with its machine file.

A third party adds a target as camtool adds its own: by an entry point of the group
`camtool.postprocessors` with the name of the target, which points at a `Target` (see
`camtool.target.contract`) in a package with `machine.toml` beside its `__init__.py`. Only the
target that is asked for is imported. A broken plug-in is reported by name and harms no other.

A folder `machines/` beside a target's `machine.toml` has further machines: files as a user's, each
of which extends a target, or another one of them, and is known by its own name."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast, get_args

import msgspec

from camtool.errors import CamtoolError, MachineError, OptionError, PostError, UnknownTargetError
from camtool.machine.model import Grade, Machine, PathController, TargetNames
from camtool.plugins import EntryPoint, entry_points
from camtool.records import FrozenRecord, replace
from camtool.tables import Table, read_table
from camtool.target.contract import Target
from camtool.target.loader import (
    extended_by,
    extended_table,
    machine_of,
    missing_keys,
    names_of,
    resolved_table,
)
from camtool.target.template import joined_text

if TYPE_CHECKING:
    from camtool.simulation.controller import ControllerModel
    from camtool.simulation.motion import Chunk, Options
    from camtool.simulation.timing import TimedChunk
    from camtool.target.twin import Twin
    from camtool.toolpath.moves import Toolpath

GROUP = "camtool.postprocessors"

MACHINE_FILE = "machine.toml"

SHIPPED_FOLDER = "machines"
"""Folder beside a target's own file, with the files of further machines."""

OWN_PREFIX = "camtool_postprocessors."
"""Prefix of camtool's own modules: exceptions in them are faults of camtool itself."""

MAX_CHAIN = 8

NOT_SAID = "not said"


def choices_of(record: type[msgspec.Struct]) -> Iterator[tuple[str, str]]:
    """Yield (name, values) of each choice that a twin leaves open; the default value comes
    first."""
    for each in msgspec.structs.fields(record):
        values = [str(value) for value in get_args(each.type) if isinstance(value, str)]
        default = str(each.default)
        yield each.name, "|".join([default, *(value for value in values if value != default)])


@dataclass(frozen=True, repr=False, eq=False)
class LoadedTarget(FrozenRecord):
    """A machine and its target. `file`: the target's own machine file; `table`: its values with
    those of the user; `base`: without those of the user (None: they are all in `file`).
    `placeholders`: the numbers that are examples of no particular machine, since the user has
    given no others."""

    machine: Machine
    target: Target
    file: Path
    table: Table
    placeholders: tuple[str, ...] = ()
    base: Table | None = None

    @property
    def model(self) -> ControllerModel[Any, Any]:
        """The model of the machine's controller."""
        if isinstance(self.machine.controller, PathController):
            from camtool.simulation.path import PathModel

            return PathModel()
        return self.target.model()

    @property
    def folder(self) -> Path:
        """The folder of the target's own code."""
        folder = self.file.parent
        return folder.parent if folder.name == SHIPPED_FOLDER else folder

    @property
    def interpolators(self) -> tuple[str, ...]:
        """The interpolators from which the user may choose."""
        exact = isinstance(self.machine.controller, PathController)
        return () if exact else self.target.interpolators

    def simulate(self, toolpath: Toolpath, options: Options | None = None) -> Iterator[Chunk]:
        """Return the motion that the machine's controller and mechanics make of a toolpath, in
        chunks.

        Rows after the end of the program are not run. Raises OptionError, MachineError, and
        ProgramError, which names the block (some only when that row is run)."""
        from camtool.simulation.motion import Options

        options = options or Options()
        self.check_options(options)
        return self.model.run(toolpath, self.machine, options)

    def timed(self, toolpath: Toolpath, options: Options) -> Iterator[TimedChunk]:
        """Return the motion as `simulate` does, with the times of its samples."""
        self.check_options(options)
        return self.model.timed(toolpath, self.machine, options)

    def check_options(self, options: Options) -> None:
        """Raise OptionError for options that the machine's controller does not have."""
        if options.chunk_steps < 1:
            raise OptionError(f"chunk_steps is {options.chunk_steps}", mend="give at least 1")
        names = self.interpolators
        if options.interpolator is None or options.interpolator in names:
            return
        if not names:
            raise OptionError(
                f"the controller of {self.machine.target.name} has no interpolators to choose "
                "from",
                where="--interpolator",
                mend="leave it out",
            )
        raise OptionError(
            f"unknown interpolator {options.interpolator!r}",
            mend=f"{', '.join(names[:-1])} or {names[-1]}",
        )

    def twin(self, choices: Sequence[str] = ()) -> Twin:
        """Return the virtual controller of this machine, with `key=value` choices for what its
        sources leave open. MachineError if it has none; OptionError, which lists the choices, for
        an unknown one."""
        has_twin = type(self.target).twin_kind is not Target.twin_kind
        if has_twin and isinstance(self.machine.controller, PathController):
            raise MachineError(
                "a virtual controller needs the model of the real one",
                where="table [controller], key model",
                mend=f'leave model = "path" out: its own is {self.target.name}',
            )
        kind: Any = self.target.twin_kind()
        given_choices = dict(choice.partition("=")[::2] for choice in choices)
        try:
            choices_made = msgspec.convert(given_choices, kind.settings, strict=False)
        except msgspec.ValidationError as error:
            listed = "; ".join(f"{name}={value}" for name, value in choices_of(kind.settings))
            raise OptionError(
                f"{', '.join(choices)}: {error}",
                mend=f"there are (the first is ours): {listed}"
                if listed
                else "there is no choice",
            ) from None
        twin: Twin = kind(self.machine, choices_made)
        return twin

    def with_settings(self, settings: Sequence[str]) -> LoadedTarget:
        """Return the target with further `key.key=value` settings; MachineError names a wrong
        one."""
        if not settings:
            return self
        table, name = resolved_table(self.target, self.table, str(self.file), None, settings)
        return replace(self, machine=machine_of(self.target, table, name), table=table)

    def values(self) -> dict[str, Any]:
        """Return all values of the machine by the keys of `--set`; of the dialect only those that
        are given."""
        values: dict[str, Any] = msgspec.to_builtins(self.machine)
        return values | {"dialect": self.table.get("dialect", {})}

    def changed_values(self) -> list[tuple[str, str, str]]:
        """Return (key, value, the target's own value) for all values that differ from the target's
        own file, as `--set` takes them.

        Keys of `needs` always differ: the target's own value is then `not said`."""
        import json

        values = dict(_flat("", self.values()))
        base = read_table(self.file) if self.base is None else self.base
        needs = missing_keys(base, str(self.file))
        settings = [f"{key}={json.dumps(values[key])}" for key in needs if key in values]
        table, name = resolved_table(self.target, base, str(self.file), None, settings)
        plain_target = replace(self, machine=machine_of(self.target, table, name), table=table)
        own_values = dict(_flat("", plain_target.values()))
        return [
            (
                key,
                _as_text(values.get(key)),
                _as_text(None if key in needs else own_values.get(key)),
            )
            for key in {**own_values, **values}
            if key in needs or values.get(key) != own_values.get(key)
        ]


@dataclass(frozen=True, repr=False, eq=False)
class ListedTarget(FrozenRecord):
    """A target in a list. `needs` are the keys that the user's machine file must give before it
    can be loaded, such as "axes.x.coded_step_mm"; () when it is complete. `files_below`: those
    that its file extends, the lowest first. `grade`: what its model knows."""

    target: TargetNames
    needs: tuple[str, ...]
    file: Path
    files_below: tuple[Path, ...] = ()
    grade: Grade = "step-true"

    @property
    def text(self) -> str:
        """The text of its machine file, with what it takes from the files that it extends."""
        files = (*self.files_below, self.file)
        return joined_text([file.read_text(encoding="utf-8") for file in files])


def own_names() -> list[str]:
    """Return the names of all installed targets, sorted; no target is imported."""
    return sorted(point.name for point in entry_points(GROUP))


def target_names() -> list[str]:
    """Return the names of all installed targets and of the machines that come with them,
    sorted."""
    return sorted({*own_names(), *shipped_files()})


def shipped_files() -> dict[str, Path]:
    """Return the files of the machines that come with installed targets, by machine name."""
    modules = tuple(dict.fromkeys(point.module for point in entry_points(GROUP)))
    return dict(_shipped_files(modules))


@cache
def _shipped_files(modules: tuple[str, ...]) -> tuple[tuple[str, Path], ...]:
    """Return (name, file) of the machines in the folders of these target modules."""
    machines = []
    for module in modules:
        try:
            spec = find_spec(module)
        except ImportError:  # a broken plug-in: reported where it is loaded
            continue
        for folder in (spec.submodule_search_locations or ()) if spec else ():
            files = sorted(Path(folder, SHIPPED_FOLDER).glob("*.toml"))
            machines += [(file.stem, file) for file in files]
    return tuple(machines)


def load_target(
    name: str, *, machine_file: Path | None = None, settings: Sequence[str] = ()
) -> LoadedTarget:
    """Return the target `name`, with the values of a user's machine file and of `--set`.

    Raises UnknownTargetError (with the nearest names) and MachineError."""
    user = None if machine_file is None else (read_table(machine_file), str(machine_file))
    return loaded_target(name, user, settings)


def loaded_target(
    name: str, user: tuple[Table, str] | None, settings: Sequence[str] = ()
) -> LoadedTarget:
    """Load the target `name` as `load_target` does, with the table and the file name of a user's
    machine file in place of a path."""
    target, file = find_target(name)
    base = base_table(name, target, file)
    table, last = resolved_table(target, base, str(file), user, settings)
    machine = machine_of(target, table, last)
    user_values = {} if user is None else user[0]
    unsaid = tuple(_placeholders(user_values, settings)) if target.any_machine else ()
    return LoadedTarget(machine, target, file, table, unsaid, base)


NUMBERS = {
    "travel": "travel_mm",
    "rates": "max_rate_mm_min",
    "accelerations": "acceleration_mm_s2",
    "backlash": "backlash_mm",
}
"""Keys of axes that differ from machine to machine, by the name of the quantity."""


def _placeholders(user_table: Table, settings: Sequence[str]) -> Iterator[str]:
    """Yield the names of placeholder numbers that the user has not given for all axes, neither in
    the machine file nor by `--set`."""
    axes = user_table.get("axes", {})
    given_keys = {f"axes.{axis}.{key}" for axis, keys in axes.items() for key in keys}
    given_keys |= {each.partition("=")[0].strip() for each in settings}
    for name, key in NUMBERS.items():
        if not all(f"axes.{axis}.{key}" in given_keys for axis in "xyz"):
            yield name


def list_target(name: str) -> ListedTarget:
    """Return the entry of a target for a list, even if keys of `needs` are missing; raises as
    `load_target`."""
    target, file = find_target(name)
    table = base_table(name, target, file)
    needs, names = missing_keys(table, str(file)), names_of(table, str(file))
    grade = names.grade or target.grade
    if not needs:
        grade = grade_of(target, machine_of(target, *resolved_table(target, table, str(file))))
    return ListedTarget(names, needs, file, _files_below(name), grade)


def grade_of(target: Target, machine: Machine) -> Grade:
    """Return the grade of a machine: how much the model of its controller computes."""
    exact = isinstance(machine.controller, PathController)
    return "path only" if exact else target.grade_of(machine)


def _files_below(name: str) -> tuple[Path, ...]:
    """Return the files that a machine's file extends, the lowest first; () for a target's own
    file."""
    if name in own_names() or name not in shipped_files():
        return ()
    below = extended_by(shipped_files()[name])
    return (*_files_below(below), find_target(below)[1])


Taken = TypeVar("Taken")


def each_target(
    take: Callable[[str], Taken],
    *,
    names: Sequence[str] | None = None,
    prefix: str = "",
    broken: list[CamtoolError] | None = None,
) -> Iterator[tuple[str, Taken]]:
    """Yield (name, what `take` returns for it) of the targets whose names start with `prefix`, or
    of those of `names`.

    A plug-in that is broken harms no other: it is left out, and its error is appended to `broken`.
    """
    for name in target_names() if names is None else names:
        if name.startswith(prefix):
            try:
                taken_value = take(name)
            except CamtoolError as error:
                if broken is not None:
                    broken.append(error)
                continue
            yield name, taken_value


def own_target_of(name: str) -> str:
    """Return the name of the installed target that a machine's file extends in the end; a target's
    own name is returned unchanged. MachineError for a ring."""
    names = own_names()
    for _ in range(MAX_CHAIN):
        if name in names or name not in shipped_files():
            return name
        name = extended_by(shipped_files()[name])
    raise MachineError(
        "machines that extend each other in a ring", where=f"target {name}", mend="mend extends"
    )


def base_table(name: str, target: Target, file: Path) -> Table:
    """Return the table of a target, or of a machine that comes with one laid over what it extends;
    its keys of `needs` are kept."""
    table = read_table(file)
    if name in own_names() or "extends" not in table:
        return table
    below_name = extended_by(file)
    below_target, below_file = find_target(below_name)
    below = base_table(below_name, below_target, below_file)
    return extended_table(target, below, table)


def filter_target() -> str | None:
    """Return the target that `camtool filter` uses by default."""
    targets = each_target(find_target)
    return next((name for name, (target, _) in targets if target.filter_default), None)


def find_target(name: str) -> tuple[Target, Path]:
    """Return (target, machine file) for the name of a target, or of a machine that comes with one;
    raises as `load_target`."""
    if name not in own_names() and name in shipped_files():
        target, _ = _load(_entry_point(own_target_of(name)))
        return target, shipped_files()[name]
    return _load(_entry_point(name))


def _entry_point(name: str) -> EntryPoint:
    """Return the entry point of a target; UnknownTargetError with the nearest names if there is
    none."""
    points = {point.name: point for point in entry_points(GROUP)}
    if name not in points:
        import difflib

        names = [*points, *shipped_files()]
        near_names = difflib.get_close_matches(name, names, n=3, cutoff=0.5) or sorted(points)
        raise UnknownTargetError(
            f"unknown target {name!r}", mend=f"did you mean {' or '.join(near_names)}?"
        )
    return points[name]


def _load(point: EntryPoint) -> tuple[Target, Path]:
    """Import a target; return it and its machine file. MachineError for a broken plug-in, with its
    name."""
    try:
        target = point.load()
        if not isinstance(target, Target):
            raise TypeError(f"{point.attr} is no camtool.target.contract.Target")
        for code in target.codes:
            if not code.name.startswith(f"{target.name}."):
                raise ValueError(f"the code {code.name} does not begin with {target.name}.")
        file = Path(str(sys.modules[point.module].__file__)).with_name(MACHINE_FILE)
    except Exception as error:  # a plug-in may raise anything
        raise MachineError(
            f"target {point.name!r} cannot be loaded ({type(error).__name__}: {error})",
            where=f"plug-in {point.value}",
            mend="reinstall or remove the package that brings it",
        ) from error
    if point.module.startswith(OWN_PREFIX):
        return target, file
    return cast(Target, Guarded(target, point.value)), file


class Guarded:
    """A third party's target, or its model: an unexpected exception is reported as a fault of the
    plug-in."""

    def __init__(self, guarded: Any, value: str) -> None:
        self._guarded = guarded
        self._value = value

    def __reduce__(self) -> tuple[Any, ...]:
        return Guarded, (self._guarded, self._value)

    def __getattr__(self, name: str) -> Any:
        attribute = getattr(self._guarded, name)
        if not callable(attribute) or isinstance(attribute, type):
            return attribute

        def call(*arguments: Any, **named: Any) -> Any:
            try:
                result = attribute(*arguments, **named)
            except CamtoolError:
                raise
            except Exception as error:
                raise self._fault(name, error) from error
            if isinstance(result, Iterator):
                return self._each(name, result)
            return Guarded(result, self._value) if name == "model" else result

        return call

    def _each(self, name: str, results: Iterator[Any]) -> Iterator[Any]:
        try:
            yield from results
        except CamtoolError:
            raise
        except Exception as error:
            raise self._fault(name, error) from error

    def _fault(self, name: str, error: Exception) -> PostError:
        return PostError(
            f"fails to {name} ({type(error).__name__}: {error})",
            where=f"plug-in {self._value}",
            mend="tell whoever made it, with the output of the same command with --debug",
        )


def _as_text(value: Any) -> str:
    import json

    return NOT_SAID if value is None else json.dumps(value, ensure_ascii=False)


def _flat(prefix: str, table: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield nested tables as (`axes.x.travel_mm`, value) pairs."""
    for key, value in table.items():
        name = f"{prefix}.{key}" if prefix else key
        if isinstance(value, dict):
            yield from _flat(name, value)
        else:
            yield name, value
