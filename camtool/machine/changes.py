"""What of a machine is not its target's own: the values that a user's file and `--set` changed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import msgspec

from camtool.machine.loader import build_machine, missing_keys, read_table

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.machine.registry import LoadedTarget

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
