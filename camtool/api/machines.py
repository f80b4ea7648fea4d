"""The machines that camtool knows."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from camtool.errors import MachineError
from camtool.machine.loader import extended_by
from camtool.machine.registry import ListedTarget, LoadedTarget, list_target, target_names


def targets() -> list[ListedTarget]:
    """The machines that camtool knows, by name: title, extension, and what a machine file must
    still say of them. A plug-in that cannot be loaded is left out with a warning."""
    found = []
    for name in target_names():
        try:
            found.append(list_target(name))
        except MachineError as error:
            warnings.warn(str(error), stacklevel=2)
    return found


def load_target(
    name: str | None = None,
    *,
    machine: str | Path | None = None,
    settings: Mapping[str, Any] | Sequence[str] = (),
) -> LoadedTarget:
    """The target `name`, with a user's `machine` file and `settings` over it; without a name, the
    one that this file extends.

    `settings`: {"axes.x.backlash_mm": 0.2}, or as `--set` takes them. Units are those that the
    keys end on. Raises UnknownTargetError (with the nearest names) and MachineError.
    """
    from camtool.machine.registry import load_target as loaded

    if isinstance(settings, Mapping):
        settings = [f"{key}={_as_toml(value)}" for key, value in settings.items()]
    file = None if machine is None else Path(machine)
    if name is None:
        if file is None:
            raise TypeError("load_target needs a name, or a machine file that extends one")
        name = extended_by(file)
    return loaded(name, machine_file=file, settings=settings)


def as_target(target: str | LoadedTarget) -> LoadedTarget:
    """The target, loaded if only its name is given."""
    return load_target(target) if isinstance(target, str) else target


def _as_toml(value: Any) -> str:
    """A value as `--set` takes it."""
    import json

    return json.dumps(value, ensure_ascii=False)
