"""From machine files to a `Machine`: the target's own file, the user's file and `--set` values.

A user's file `extends = "pic-mmh"` a target and contains only what differs; a flag such as `--set
axes.x.backlash_mm=0.2` changes one value. Both replace values of the target's own file before the
result is checked. The target defines the contents of `[controller]` and `[dialect]`: its records
are part of the type to which the table is converted.

A target whose file lacks numbers that differ from machine to machine names them at its top; the
user's file must give them:

    needs = ["axes.x.coded_step_mm", "axes.y.coded_step_mm"]"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Any

import msgspec

from camtool.errors import MachineError
from camtool.machine.model import Machine, PathController, SlideStart, TargetNames
from camtool.tables import MAX_DEPTH, Table, convert, parse_table, read_table
from camtool.target.contract import Target

NEEDS = "needs"


def resolved_table(
    target: Target,
    base: Table,
    base_name: str,
    user: tuple[Table, str] | None = None,
    settings: Sequence[str] = (),
) -> tuple[Table, str]:
    """Return a target's table with the values of a `user`'s file (its table and name) and of
    `key.key=value` settings laid over it, and the name of the last of these sources. MachineError
    if keys of `needs` are missing."""
    table, name = base, base_name
    if user is not None:
        user_table, name = user
        extends = user_table.get("extends")
        if extends != base["target"]["name"]:
            raise MachineError(
                f"extends {extends!r}, but the target is {base['target']['name']!r}",
                file=name,
                where="key extends",
                mend=f'write extends = "{base["target"]["name"]}" or change --target',
            )
        table = extended_table(target, table, user_table)
    file = name
    for setting in settings:
        table, name = _overlaid(target, table, _parse_setting(setting)), f"--set {setting}"
    _refuse_incomplete(table, file)
    return {key: table[key] for key in table if key != NEEDS}, name


def extended_table(target: Target, below: Table, above: Table) -> Table:
    """Return the table of a file (`above`) laid over the table of what it extends (`below`)."""
    return _overlaid(target, below, {key: above[key] for key in above if key != "extends"})


def machine_of(target: Target, table: Table, name: str) -> Machine:
    """Convert a resolved table to a checked machine of this target; MachineError names the wrong
    key, and `name` as the source."""
    records: Any = reduce(or_, _records(target))
    generic: Any = Machine
    kind: type[Machine] = generic[records, target.dialect, target.link]
    full_table: Table = {"dialect": {}, "link": {}} | table
    machine: Machine = convert(full_table, kind, name)
    if machine.coolant.kinds and not target.switches_coolant:
        raise MachineError(
            f"programs of {machine.target.name} cannot switch coolant",
            file=name,
            where="table [coolant]",
            mend="leave it out",
        )
    try:
        machine.uncertainty.check()
        target.check(machine)
    except MachineError as error:
        error.file = name
        raise
    return machine


def _records(target: Target) -> tuple[type[SlideStart], ...]:
    """Return the record types that `[controller]` may have."""
    return (*target.controllers, PathController)


def extended_by(user_file: Path) -> str:
    """Return the name of the target that a user's machine file extends; MachineError if it extends
    none."""
    extends = read_table(user_file).get("extends")
    if not isinstance(extends, str):
        raise MachineError(
            "does not say which target it extends",
            file=str(user_file),
            where="key extends",
            mend='write extends = "..." at its top, with a name that camtool targets lists, '
            "or give --target",
        )
    return extends


def names_of(base: Table, base_name: str) -> TargetNames:
    """Return the `[target]` table of a target's file, even if the file lacks keys of `needs`."""
    return convert(base.get("target", {}), TargetNames, base_name, "target")


def missing_keys(table: Table, name: str) -> tuple[str, ...]:
    """Return the keys of `needs` that are not in the table, such as "axes.x.coded_step_mm"."""
    keys = convert(table.get(NEEDS, []), list[str], name, NEEDS)
    return tuple(key for key in keys if not _has_all(table, key.split(".")))


def _has_all(table: Any, keys: list[str]) -> bool:
    for key in keys:
        if not isinstance(table, dict) or key not in table:
            return False
        table = table[key]
    return True


def _refuse_incomplete(table: Table, name: str) -> None:
    """Raise MachineError if the table lacks keys of its `needs`."""
    missing = missing_keys(table, name)
    if not missing:
        return
    *tables, key = missing[0].split(".")
    target = table["target"]["name"]
    raise MachineError(
        f"key is missing: only the user can know it (needed: {', '.join(missing)})",
        file=name,
        where=(f"table [{'.'.join(tables)}], " if tables else "") + f"key {key}",
        mend=f'give it in your machine file, which extends = "{target}", and give --machine FILE',
    )


def _overlaid(target: Target, below: Table, above: Table) -> Table:
    """Return the values of `above` over those of `below`. If `above` names another controller
    model, the options that only the old model has are dropped."""
    old, new = below.get("controller"), above.get("controller")
    if isinstance(old, dict) and isinstance(new, dict) and "model" in new:
        own_options = (
            _own_options(target, old.get("model")) if new["model"] != old.get("model") else set()
        )
        below = below | {"controller": {key: old[key] for key in old.keys() - own_options}}
    return _laid_over(below, above)


def _own_options(target: Target, model: object) -> set[str]:
    """Return the names of the options that this controller model has and not every controller."""
    shared = {field.name for field in msgspec.structs.fields(SlideStart)}
    return {
        field.name
        for record in _records(target)
        if record.__struct_config__.tag == model
        for field in msgspec.structs.fields(record)
    } - shared


def _laid_over(below: Table, above: Table) -> Table:
    """Return the values of both tables, those of `above` where both have one, nested tables
    likewise; neither argument is changed."""
    merged = dict(below)
    for key, value in above.items():
        old = merged.get(key)
        are_tables = isinstance(old, dict) and isinstance(value, dict)
        merged[key] = _laid_over(old, value) if are_tables else value  # type: ignore[arg-type]
    return merged


def _parse_setting(text: str) -> Table:
    """Parse `axes.x.backlash_mm=0.2` to nested tables; a value that is not TOML becomes a
    string."""
    key, equals, value = text.partition("=")
    keys = key.strip().split(".")
    if (
        not equals
        or len(keys) > MAX_DEPTH
        or not all(re.fullmatch(r"[A-Za-z0-9_-]+", part) for part in keys)
    ):
        raise MachineError(
            f"{text!r} is no setting", where="--set", mend="write --set axes.x.backlash_mm=0.2"
        )
    try:
        parsed: Any = parse_table(f"v = {value.strip()}")["v"]
    except tomllib.TOMLDecodeError:
        parsed = value.strip()
    except ValueError as error:  # a whole number of too many digits
        raise MachineError(
            "is a whole number of thousands of digits", where=f"--set {key.strip()}"
        ) from error
    for part in reversed(keys):
        parsed = {part: parsed}
    return dict(parsed)
