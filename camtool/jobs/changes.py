"""A job as a file again: what its file and the flags say together, with changes, as TOML.

    JobTables of the file ─┐
    JobTables of flags ────┴─▶ together ─▶ tables ─changed─▶ tables ─text_of─▶ a job file

The tables are plain TOML. `build_job` makes of their text what it makes of file and flags."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any

from msgspec import Struct

from camtool.jobs.build import EITHER, JobTables, build_job, tables_of
from camtool.jobs.keys import OPERATION, TOOL_KEYS, TOOL_NAME, is_known
from camtool.jobs.template import pattern_of
from camtool.jobs.tools import Shop
from camtool.keys import Given, Table, length
from camtool.planning.job import Job
from camtool.planning.kinds import kind_named
from camtool.tables import Table as Values
from camtool.tables import parse_table, toml_lines

FILES = ("tool_library", "tool_table")
"""Keys that name files, relative to the job file."""

LEFT_DIGITS = 4
"""Decimals of an allowance in mm: a tenth of a micrometre."""


class Change(Struct, frozen=True):
    """A new value for a key of the operation with this index in the file, or (None) of the whole
    job. `instead`: the present value as text, "" if the key is not set."""

    key: str
    value: Any
    operation: int | None = None
    instead: str = ""


class Left(Struct, frozen=True):
    """A change of the allowance on the walls of an operation by `by_mm` (negative: less is left):
    for the contours of these `entities`, or (if empty) for all contours of the operation."""

    operation: int
    by_mm: float
    entities: tuple[str, ...] = ()


def merged_tables(file: JobTables, flags: JobTables, folder: Path) -> Values:
    """Return the tables of one job file in `folder` that means the same as a file and flags
    together.

    OptionError for flags of a tool where the operation names its tool: a job file has one or the
    other."""
    job_values = _raw(_merged(flags.whole, file.whole))
    for key in FILES:
        key_value = flags.whole.given.get(key) or file.whole.given.get(key)
        if key_value is not None:
            job_values[key] = _relative(key_value, file.folder, folder)
    tables: Values = {**job_values, **_raw(file.defaults)}
    place = _raw(_merged(flags.place, file.place))
    if place:
        tables["place"] = place
    if file.stock is not None:
        tables["stock"] = _raw(file.stock)
    if file.keep_out:
        tables["keep_out"] = [_raw(each) for each in file.keep_out]
    if file.setups:
        tables["setups"] = [_raw(each) for each in file.setups]
    if file.tools:
        tables["tools"] = {
            name: {
                **_raw(each.keys),
                **({"presets": _presets(each.presets)} if each.presets else {}),
            }
            for name, each in file.tools.items()
        }
    rows = file.operations or (Table(),)
    carved = {str(_raw(table).get("name")) for table in rows if _leaves_floor(_raw(table))}
    tables["operations"] = [
        _operation(table, file.defaults, flags.defaults, carved) for table in rows
    ]
    return tables


def _operation(own_table: Table, defaults: Table, flags: Table, carved: set[str]) -> Values:
    """Return the table of an operation, overridden by the flags that its kind knows. An operation
    that clears the floor of a carving (`rest` in `carved`) takes no depth from flags: the carving
    sets it."""
    if _raw(own_table).get("rest") in carved:
        flags = flags.only(set(flags.given) - {"depth", "breakthrough"})
    kind = {**defaults.given, **own_table.given, **flags.given}.get("kind")
    named = kind.value if kind is not None else "profile"
    tool = flags.only(TOOL_KEYS).given
    if tool and TOOL_NAME in own_table.given and TOOL_NAME not in flags.given:
        raise next(iter(tool.values())).refused(
            "cannot be written into a job file whose operation names its tool",
            "change the tool in the job file",
        )
    known_keys = [name for name in flags.given if name not in OPERATION or is_known(name, named)]
    return _raw(_merged(flags.only(known_keys), own_table))


def _leaves_floor(table: Values) -> bool:
    """Return True if the operation of this table carves a flat floor that other operations can
    clear."""
    kind = table.get("kind")
    return isinstance(kind, str) and kind_named(kind).rest == "floor"


def _merged(above: Table, below: Table) -> Table:
    """Return the keys of both tables. A key of `above` wins, and removes keys of `below` that
    contradict it, such as a scale for a fit or a tool's name for single keys of a tool."""
    overridden = {EITHER[name] for name in above.given if name in EITHER}
    if TOOL_NAME in above.given:
        overridden |= set(TOOL_KEYS)
    return above.over(below.only(set(below.given) - overridden))


def _raw(table: Table) -> Values:
    return {name: each.value for name, each in table.given.items()}


def _presets(presets: Mapping[str, Table]) -> Values:
    return {material: _raw(each) for material, each in presets.items()}


def _relative(raw: Given, old_folder: Path, folder: Path) -> str:
    """Return the path of a file relative to `folder`. Names in a job file are relative to
    `old_folder`, names in flags to the current directory."""
    named = old_folder / str(raw.value) if raw.file is not None else Path(str(raw.value))
    return Path(os.path.relpath(named.absolute(), folder.absolute())).as_posix()


def changed_tables_of(
    tables: Values, changes: Sequence[Change], own_parts: Sequence[Left] = ()
) -> Values:
    """Return the tables with these changes. An operation with several `own_parts` is divided into
    one operation for each, in their order; together these must name all entities that it takes."""
    changed_tables = {
        **tables,
        **{each.key: each.value for each in changes if each.operation is None},
    }
    names = {str(table.get("name")) for table in tables["operations"]}
    operations: list[Values] = []
    for row, table in enumerate(tables["operations"]):
        own_changes = {each.key: each.value for each in changes if each.operation == row}
        left_parts = [each for each in own_parts if each.operation == row]
        operations += _divided({**table, **own_changes}, left_parts, names)
    changed_tables["operations"] = operations
    return changed_tables


def _divided(table: Values, parts_left: Sequence[Left], names: set[str]) -> list[Values]:
    """Return the operations into which the parts divide an operation, each with its own allowance
    and entities. The first keeps the name, the others get numbers after it; new names are added to
    `names`."""
    if not parts_left:
        return [table]
    name = str(table.get("name") or table.get("kind") or "profile")
    parts: list[Values] = []
    for each in parts_left:
        part = dict(table)
        if each.by_mm:
            allowance = length(table.get("allowance", 0.0)) + each.by_mm
            part["allowance"] = f"{round(allowance, LEFT_DIGITS) + 0.0:.10g}mm"
        if each.entities:
            part["select_entities"] = [pattern_of(entity) for entity in each.entities]
        if len(parts_left) > 1:
            part["name"] = name
        if parts:
            numbers = (f"{name} ({number})" for number in count(2))
            part["name"] = next(each for each in numbers if each not in names)
            names.add(part["name"])
        parts.append(part)
    return parts


def text_of(tables: Values, head: Sequence[str] = ()) -> str:
    """Return the text of a job file, with the lines `head` as comments at its top. The keys of a
    single operation stand at the top level."""
    if len(tables["operations"]) == 1:
        job_values = {key: value for key, value in tables.items() if key != "operations"}
        tables = {**job_values, **tables["operations"][0]}
    body = "\n".join(toml_lines(tables)).lstrip("\n")
    return "".join(f"# {line}\n" for line in head) + ("\n" if head else "") + body + "\n"


def job_of_tables(tables: Values, place: Path, shop: Shop) -> Job:
    """Return the job of these tables as if read from a file at `place`: the text is written and
    parsed again."""
    return build_job(tables_of(parse_table(text_of(tables)), place), JobTables(), (), shop)
