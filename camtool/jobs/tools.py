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
from camtool.jobs.keys import LIMITS, OPERATION, PRESET, TOOL, TOOL_KEYS, TOOL_NAME, WHOLE
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
"""The number of a tool as text."""


class Described(Struct, frozen=True):
    """A tool as a file describes it: its keys, and the keys of its presets by material."""

    keys: Table
    presets: Mapping[str, Table] = field(default_factory=dict)


class Shop(Struct, frozen=True):
    """Tools and materials from outside the job: the files of `libraries`, the nearest first, and
    the tool and the material for operations and jobs that name none."""

    libraries: tuple[Path, ...] = ()
    tool: Given | None = None
    material: Given | None = None


class Used(Struct, frozen=True):
    """The tool of an operation, with the limits of its preset; the keys of operations that the
    preset sets, and the material of the preset ("" without one)."""

    tool: Tool
    preset: Table
    material: str = ""


def tool_tables(values: Mapping[str, Any], file: str) -> dict[str, Described]:
    """Return the tools of the tables `[tools.NAME]` of a file. All are checked, even unused ones:
    OptionError for a wrong tool, and for two tools with one number."""
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
    """Return the Tool record for a description in a file."""
    return replace(_tool(name, described.keys, ""), materials=tuple(described.presets))


def tools_for(named: Mapping[str, Described], job_table: Table, folder: Path, shop: Shop) -> Tools:
    """Return the tools that the operations of a job may use: those `named` in its file, those of
    its libraries, and those of the LinuxCNC tool table that `job_table` names. `folder`: that of
    the job file."""
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
    """Return the path that a key names, None if it is not set. Names in a job file are relative to
    its folder, names on the command line to the current directory."""
    key_value = job_table.given.get(key)
    if key_value is None:
        return None
    name = WHOLE[key].read(key_value)
    return folder / name if key_value.file is not None else Path(name)


class Tools(Struct, frozen=True, dict=True):
    """The tools of a job: `named` in its file; those of `libraries`, the nearest first, which are
    read when needed; and those of a LinuxCNC `table` by number, with lengths in `units`.
    `material`: the material that is cut, if given; `material_is_asked`: it comes from the job or a
    flag, not from the shop; `default`: the tool of operations that name none."""

    named: Mapping[str, Described] = field(default_factory=dict)
    libraries: tuple[Path, ...] = ()
    table: Mapping[int, TableTool] = field(default_factory=dict)
    table_file: str = ""
    units: str = "mm"
    material: Given | None = None
    material_is_asked: bool = False
    default: Given | None = None

    def of(self, layers: Sequence[Table], kind: str) -> Used:
        """Return the tool of an operation of this kind. `layers`: the tables that apply to it, the
        nearest last.

        The nearest tool name or number counts; single keys such as `tool_diameter` of the same or
        a nearer layer change that tool. The default tool is used where no layer has any key of a
        tool.
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
        """Return the tool with its preset for the material that is cut. OptionError if it has
        presets but none for this material."""
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
        """Raise OptionError if the job or a flag sets a material but no tool of the job has
        presets."""
        if self.material is None or not self.material_is_asked:
            return
        if not any(operation.material for operation in operations):
            raise self.material.refused(
                "has no effect: no tool of the job has presets",
                "name a tool of a library (camtool tools), or leave the material out",
            )

    def _chosen(self, raw: Given) -> tuple[str, Described]:
        """Return name and description of the tool that a name or a number refers to; OptionError
        for an unknown one."""
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
        """Return the tool with the keys of the LinuxCNC tool table for its number, which fill in a
        missing diameter."""
        keys, number = described.keys, _number_of(described.keys)
        if number is None or number not in self.table:
            return described
        table_keys = self._of_table(number, needed="diameter" not in keys.given)
        return replace(described, keys=keys.over(table_keys))

    def _of_table(self, number: int, *, needed: bool = True) -> Table:
        """Return the keys of tool `number` of the LinuxCNC table; OptionError if its diameter is
        missing and `needed`."""
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
    """Return the tools together with those of a LinuxCNC tool table; OptionError names file and
    line."""
    try:
        text = path.read_bytes().decode("utf-8", errors="replace")
    except OSError as error:
        raise OptionError(
            f"cannot be read ({error.strerror})", file=str(path), mend="check the path"
        ) from error
    return replace(tools, table=read_tool_table(text, str(path)), table_file=str(path))


def _number_of(keys: Table) -> int | None:
    """Return the key `number` of a tool, or None."""
    number_value = keys.given.get("number")
    number: int | None = None if number_value is None else TOOL["number"].read(number_value)
    return number


def _tool(name: str, keys: Table, kind: str) -> Tool:
    """Return the Tool record of these keys. A tool with a tip angle but no kind is a drill for
    operations that peck and need no V bit, else a V bit."""
    if "tip_angle" in keys.given and "kind" not in keys.given:
        contract = kind_named(kind) if kind else None
        drills = contract and contract.descent == "pecks" and not contract.needs_v_bit
        meant = Given("drill" if drills else "v", keys.where, keys.file)
        keys = Table({**keys.given, "kind": meant}, keys.where, keys.file)
    tool = record_of(Tool, TOOL, keys)
    refuse_idle(TOOL, keys, tool)
    return replace(tool, name=name)
