"""The tools of a job: by name, by number, or key by key; libraries of them, and their presets.

    [tools.mill]                    # in a job file, or in a library (`tools.toml`)
    diameter = "3.175mm"
    flutes = 2

    [tools.mill.presets.plywood]    # what it is used with where `material` says so
    feed = "800mm/min"
    step_down = "1.5mm"

    libraries ◀ tools of the job file            the nearest of a name, or number, counts
    preset ◀ defaults of the file ◀ keys of the operation ◀ flags

docs/jobs.md explains the keys.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from msgspec import Struct, field

from camtool.errors import MachineError, OptionError
from camtool.jobs.keys import (
    LIMITS,
    OPERATION,
    PRESET,
    TOOL,
    TOOL_KEYS,
    TOOL_NAME,
    WHOLE,
)
from camtool.jobs.tool_table import TableTool, read_tool_table
from camtool.keys import Given, Table, record_of, refuse_idle, table_of
from camtool.patterns import guess
from camtool.planning.job import Operation, Tool, operation_of
from camtool.planning.kinds import kind_named
from camtool.records import replace
from camtool.tables import read_table

PRESETS = "presets"
"""The key of a tool whose tables are its presets, by material."""

_TOOL_NUMBER = re.compile(r"\d{1,9}")
"""A tool by its number."""


class Described(Struct, frozen=True):
    """A tool as a file describes it: its keys, and what it is used with, by material."""

    keys: Table
    presets: Mapping[str, Table] = field(default_factory=dict)


class Shop(Struct, frozen=True):
    """Tools and materials from outside the job: the files of `libraries`, the nearest first; the
    tool of operations that say none, and what is cut, where the job does not say it."""

    libraries: tuple[Path, ...] = ()
    tool: Given | None = None
    material: Given | None = None


class Used(Struct, frozen=True):
    """The tool of an operation, with the limits of its preset; the keys of operations that the
    preset gives, and the material that it is for, "" without one."""

    tool: Tool
    preset: Table
    material: str = ""


def tool_tables(values: Mapping[str, Any], file: str) -> dict[str, Described]:
    """Return the tables `[tools.NAME]` of a file, each checked; OptionError for tools that are
    wrong, used or not, and for two tools with one number."""
    tools = values.get("tools", {})
    if not isinstance(tools, dict):
        raise Given(tools, "key tools", file).refused(
            "is no table of tools", "begin each tool with [tools.NAME]"
        )
    described = {name: _described(name, tool, file) for name, tool in tools.items()}
    names_by_number: dict[int, str] = {}
    for name, each in described.items():
        tool_of(name, each)
        number = _number_of(each.keys)
        if number is None:
            continue
        if number in names_by_number:
            raise each.keys.given["number"].refused(
                f"tool {number} is {names_by_number[number]!r} already",
                "give each tool a number of its own",
            )
        names_by_number[number] = name
    return described


def _described(name: str, values: object, file: str) -> Described:
    place = f"table [tools.{name}]"
    table = table_of(values, (*TOOL, PRESETS), place, file)
    presets = table.given.get(PRESETS)
    if presets is None:
        return Described(table)
    if not isinstance(presets.value, dict):
        raise presets.refused(
            "is no table of presets", f"begin each with [tools.{name}.presets.MATERIAL]"
        )
    tables = {
        material: table_of(preset, PRESET, f"table [tools.{name}.presets.{material}]", file)
        for material, preset in presets.value.items()
    }
    for preset in tables.values():
        record_of(operation_of, OPERATION, preset.only(OPERATION))
        record_of(Tool, TOOL, preset.only(LIMITS))
    return Described(table.only(TOOL), tables)


def read_library(path: Path) -> dict[str, Described]:
    """Return the tools of a library; OptionError names file, table and key, and says how to fix
    it."""
    try:
        values = read_table(path)
    except MachineError as error:
        raise OptionError(error.message, file=error.file, mend=error.mend) from error
    table_of(values, ("tools",), "", str(path))
    return tool_tables(values, str(path))


def tool_of(name: str, described: Described) -> Tool:
    """Return the record of a tool that a file describes."""
    return replace(_tool(name, described.keys, ""), materials=tuple(described.presets))


def tools_for(named: Mapping[str, Described], job_table: Table, folder: Path, shop: Shop) -> Tools:
    """Return the tools of a job: those `named` in its file, which is in this folder, those of
    libraries, and those of a tool table, which its keys for the `job_table` job name."""
    library = _path_of("tool_library", job_table, folder)
    tools = Tools(
        named,
        libraries=shop.libraries if library is None else (library, *shop.libraries),
        material=job_table.given.get("material", shop.material),
        material_is_asked="material" in job_table.given,
        default=shop.tool,
    )
    units, table = (
        job_table.given.get("tool_table_units"),
        _path_of("tool_table", job_table, folder),
    )
    if table is None:
        if units is not None:
            raise units.refused("has no effect without tool_table", "give tool_table too")
        return tools
    unit = "mm" if units is None else WHOLE["tool_table_units"].read(units)
    return _with_table(replace(tools, units=unit), table)


def _path_of(key: str, job_table: Table, folder: Path) -> Path | None:
    """Return the file that a key names: in a job file relative to it, on the command line to
    where it is run."""
    key_value = job_table.given.get(key)
    if key_value is None:
        return None
    name = WHOLE[key].read(key_value)
    return folder / name if key_value.file is not None else Path(name)


class Tools(Struct, frozen=True, dict=True):
    """The tools of a job: `named` in its file, those of `libraries`, the nearest first, which are
    read when one is needed, and by number those of a LinuxCNC `table`, whose lengths have the unit
    `units`. `material`: what is cut, if it is said, and whether the job or a flag says so;
    `default`: the tool of operations that say none."""

    named: Mapping[str, Described] = field(default_factory=dict)
    libraries: tuple[Path, ...] = ()
    table: Mapping[int, TableTool] = field(default_factory=dict)
    table_file: str = ""
    units: str = "mm"
    material: Given | None = None
    material_is_asked: bool = False
    default: Given | None = None

    def of(self, layers: Sequence[Table], kind: str) -> Used:
        """Return the tool of an operation of this kind. `layers`: the tables that apply to
        it, the nearest last.

        The nearest name or number counts, and single keys (`tool_diameter`) of that layer and
        of nearer ones change it. The default tool is for operations that say nothing of a tool.
        """
        row = max((n for n, layer in enumerate(layers) if TOOL_NAME in layer.given), default=-1)
        tool_name = None if row < 0 else layers[row].given[TOOL_NAME]
        if tool_name is None and not any(layer.only(TOOL_KEYS).given for layer in layers):
            tool_name = self.default
        name, described = (
            ("", Described(Table())) if tool_name is None else self._chosen(tool_name)
        )
        keys = described.keys
        for n, layer in enumerate(layers[max(row, 0) :], start=max(row, 0)):
            own_keys = layer.only(TOOL_KEYS)
            if n == row and own_keys.given:
                raise next(iter(own_keys.given.values())).refused(
                    "contradicts the tool that is named beside it", "give one of the two"
                )
            tool_keys = {key.removeprefix("tool_"): value for key, value in own_keys.given.items()}
            keys = Table(tool_keys, own_keys.where, own_keys.file).over(keys)
        return self._used(name, replace(described, keys=keys), kind)

    def _used(self, name: str, described: Described, kind: str) -> Used:
        """Return the tool, and its preset for what is cut. OptionError for a material for which
        it has none, though it has some."""
        tool = _tool(name, described.keys, kind)
        if self.material is None or not described.presets:
            return Used(replace(tool, materials=tuple(described.presets)), Table())
        material = WHOLE["material"].read(self.material)
        preset = described.presets.get(material)
        if preset is None:
            presets = described.presets
            raise self.material.refused(
                f"tool {name!r} has no preset for {material!r}",
                f"{guess(material, presets)}it has: {', '.join(presets)}",
            )
        limits = {
            LIMITS[key].field: LIMITS[key].read(key_value)
            for key, key_value in preset.only(LIMITS).given.items()
        }
        tool = replace(tool, materials=tuple(described.presets), **limits)
        return Used(tool, preset.only(OPERATION), material)

    def refuse_idle_material(self, operations: Iterable[Operation]) -> None:
        """Raise OptionError for a material that the job or a flag says, and no tool has
        presets."""
        if self.material is None or not self.material_is_asked:
            return
        if not any(operation.material for operation in operations):
            raise self.material.refused(
                "has no effect: no tool of the job has presets",
                "name a tool of a library (camtool tools), or leave the material out",
            )

    def _chosen(self, raw: Given) -> tuple[str, Described]:
        """Return the tool that a name or a number says, and its name."""
        value = raw.value
        if isinstance(value, str) and value in self.named:
            return value, self._completed(self.named[value])
        if isinstance(value, str) and _TOOL_NUMBER.fullmatch(value.strip()):
            value = int(value)
        if type(value) is int:
            return self._numbered(value, raw)
        if not isinstance(value, str):
            raise raw.refused(f"{value!r} is no tool", "give its name in quotes, or its number")
        every_tool = self._every
        if value in every_tool:
            return value, self._completed(every_tool[value])
        raise raw.refused(
            f"there is no tool {value!r}",
            guess(value, every_tool)
            + (f"known: {', '.join(every_tool)}" if every_tool else f"write [tools.{value}]"),
        )

    def _numbered(self, number: int, raw: Given) -> tuple[str, Described]:
        for tools in (self.named, self._every):
            for name, described in tools.items():
                if _number_of(described.keys) == number:
                    return name, self._completed(described)
            if number in self.table:
                return self.table[number].remark, Described(self._of_table(number))
        numbers = [str(each) for each in self.table]
        raise raw.refused(
            f"there is no tool {number}",
            f"{self.table_file} has: {', '.join(numbers) or 'none'}"
            if self.table_file
            else 'give the tool table: tool_table = "tool.tbl"',
        )

    @cached_property
    def _every(self) -> Mapping[str, Described]:
        """All tools that have a name, the nearest of each."""
        every = dict(self.named)
        for file in self.libraries:
            every = {**read_library(file), **every}
        return every

    def _completed(self, described: Described) -> Described:
        """Complete a named tool that has a number with the diameter of the tool table."""
        keys, number = described.keys, _number_of(described.keys)
        if number is None or number not in self.table:
            return described
        table_keys = self._of_table(number, needed="diameter" not in keys.given)
        return replace(described, keys=keys.over(table_keys))

    def _of_table(self, number: int, *, needed: bool = True) -> Table:
        """Return the keys of a tool of the table; refused when it lacks a diameter that is
        needed."""
        tool = self.table[number]
        table = Table({}, f"line {tool.line}", self.table_file)
        if tool.diameter is None and needed:
            raise table.refused(f"tool {number} has no diameter", "give it a D")
        values = {"number": number, "diameter": f"{tool.diameter!r}{self.units}"}
        if tool.diameter is None:
            del values["diameter"]
        key_values = {
            name: Given(value, table.where, table.file) for name, value in values.items()
        }
        return replace(table, given=key_values)


def _with_table(tools: Tools, path: Path) -> Tools:
    """Return the tools, and those of a LinuxCNC tool table; OptionError names file and line."""
    try:
        text = path.read_bytes().decode("utf-8", errors="replace")
    except OSError as error:
        raise OptionError(
            f"cannot be read ({error.strerror})", file=str(path), mend="check the path"
        ) from error
    return replace(tools, table=read_tool_table(text, str(path)), table_file=str(path))


def _number_of(keys: Table) -> int | None:
    """Return the number of a tool of the file, if it has one."""
    number_value = keys.given.get("number")
    number: int | None = None if number_value is None else TOOL["number"].read(number_value)
    return number


def _tool(name: str, keys: Table, kind: str) -> Tool:
    """Return the record; a tool with a tip that does not say its kind is a V bit, or drills."""
    if "tip_angle" in keys.given and "kind" not in keys.given:
        drills = bool(kind) and kind_named(kind).descent == "pecks"
        meant = Given("drill" if drills else "v", keys.where, keys.file)
        keys = Table({**keys.given, "kind": meant}, keys.where, keys.file)
    tool = record_of(Tool, TOOL, keys)
    refuse_idle(TOOL, keys, tool)
    return replace(tool, name=name)
