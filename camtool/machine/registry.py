"""The targets: post-processors found by entry point, each with the machine file beside it.

A third party adds a target as camtool's own are added: an entry point of the group
`camtool.postprocessors`, named like the target, that points at an object with `name`, `check`,
`write`, `read` (see `camtool.toolpath.program.PostProcessor`). Its machine file is `machine.toml`
beside the `__init__.py` of a package, or beside a module the .toml file of the module's own name.
Nothing is imported but the target that is asked for.
"""

from __future__ import annotations

import difflib
import hashlib
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

import msgspec

from camtool.errors import CamtoolError, MachineError, PostError, UnknownTargetError
from camtool.machine.loader import build_machine, missing_keys, read_table, target_of
from camtool.machine.model import Machine, Target

GROUP = "camtool.postprocessors"

OURS = "camtool_postprocessors."
"""Modules that are camtool's own: what goes wrong in them is a fault of camtool itself."""


@dataclass(frozen=True)
class LoadedTarget:
    """A machine and the post-processor that speaks to it (a `PostProcessor`). `any_machine`: the
    numbers are those of no particular machine, and nobody has said others."""

    machine: Machine
    post: Any
    file: Path
    any_machine: bool = False


@dataclass(frozen=True)
class ListedTarget:
    """What a list says of a target: `needs` are the keys that the user's machine file must give
    before it can be loaded, such as "axes.x.coded_step_mm"; () when it is complete."""

    target: Target
    needs: tuple[str, ...]
    file: Path


def target_names() -> list[str]:
    """Names of all installed targets, sorted; nothing is imported."""
    return sorted(point.name for point in entry_points(group=GROUP))


def load_target(
    name: str, *, machine_file: Path | None = None, settings: Sequence[str] = ()
) -> LoadedTarget:
    """The target `name`, with a user's machine file and `--set` values over it.

    Raises UnknownTargetError (with the nearest names) and MachineError.
    """
    post, file = _load(_found(name))
    machine = build_machine(read_table(file), str(file), machine_file, settings)
    post.check(machine)
    said = machine_file is not None or any(each.startswith("axes.") for each in settings)
    return LoadedTarget(machine, post, file, getattr(post, "any_machine", False) and not said)


def list_target(name: str) -> ListedTarget:
    """What a list says of the target `name`, complete or not; raises as `load_target` does."""
    post, file = _load(_found(name))
    table = read_table(file)
    needs = missing_keys(table, str(file))
    if not needs:
        post.check(build_machine(table, str(file)))
    return ListedTarget(target_of(table, str(file)), needs, file)


def _found(name: str) -> EntryPoint:
    """The entry point of a target; UnknownTargetError when there is none."""
    found = {point.name: point for point in entry_points(group=GROUP)}
    if name not in found:
        near = difflib.get_close_matches(name, found, n=3, cutoff=0.4) or sorted(found)
        raise UnknownTargetError(
            f"unknown target {name!r}", mend=f"did you mean {' or '.join(near)}?"
        )
    return found[name]


def _load(point: EntryPoint) -> tuple[Any, Path]:
    """The post-processor object and its machine file; a broken plug-in is named, nothing else."""
    try:
        post = point.load()
        module = sys.modules[point.module]
        file = _machine_file(Path(str(module.__file__)))
    except Exception as error:  # whatever a third party's module raises belongs to it
        raise MachineError(
            f"target {point.name!r} cannot be loaded ({type(error).__name__}: {error})",
            where=f"plug-in {point.value}",
            mend="reinstall or remove the package that brings it",
        ) from error
    return post if point.module.startswith(OURS) else Guarded(post, point.value), file


def _machine_file(module: Path) -> Path:
    """The machine file that belongs to the module of a target."""
    if module.name == "__init__.py":
        return module.with_name("machine.toml")
    return module.with_suffix(".toml")


class Guarded:
    """A third party's post-processor: what it raises and should not is told as its own fault."""

    def __init__(self, post: Any, value: str) -> None:
        self._post = post
        self._value = value

    def __reduce__(self) -> tuple[Any, ...]:
        return Guarded, (self._post, self._value)

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._post, name)
        if not callable(found):
            return found

        def called(*arguments: Any, **named: Any) -> Any:
            try:
                return found(*arguments, **named)
            except CamtoolError:
                raise
            except Exception as error:
                raise PostError(
                    f"fails to {name} ({type(error).__name__}: {error})",
                    where=f"plug-in {self._value}",
                    mend="tell whoever made it, with the output of the same command with --debug",
                ) from error

        return called


# What of a machine is not its target's own: the values that a user's file and `--set` changed.

NOT_SAID = "not said"


def machine_digest(machine: Machine) -> str:
    """SHA-256, hex, of all values of a machine: equal for equal machines, on every computer."""
    return hashlib.sha256(msgspec.json.encode(machine)).hexdigest()


def changed_values(target: LoadedTarget) -> list[tuple[str, str, str]]:
    """(key, value, the target's own value) of all that differs, as `--set` takes them.

    What the target leaves to the user to say differs always: its own value is `not said`.
    """
    now = dict(_flat("", msgspec.to_builtins(target.machine)))
    table = read_table(target.file)
    needs = missing_keys(table, str(target.file))
    given = [f"{key}={json.dumps(now[key])}" for key in needs if key in now]
    own = dict(_flat("", msgspec.to_builtins(build_machine(table, str(target.file), None, given))))
    return [
        (key, _said(now.get(key)), _said(None if key in needs else own.get(key)))
        for key in {**own, **now}
        if key in needs or now.get(key) != own.get(key)
    ]


def _said(value: Any) -> str:
    return NOT_SAID if value is None else json.dumps(value, ensure_ascii=False)


def _flat(prefix: str, table: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Nested tables as (`axes.x.travel_mm`, value)."""
    for key, value in table.items():
        name = f"{prefix}.{key}" if prefix else key
        if isinstance(value, dict):
            yield from _flat(name, value)
        else:
            yield name, value
