"""The job that a job file and the flags give together.

    safe_z = "0.5mm"                # the job as a whole
    depth = "0.1mm"                 # keys of operations up here hold for all that have them
    [place]                         # the drawing in the work frame
    [stock]
    [tools.finish]
    [[operations]]                  # in the order in which they are cut

A file is TOML, read as strictly as a machine's; one without `[[operations]]` is one operation,
whose keys stand at its top. docs/jobs.md explains every key.

    defaults of the file ◀ keys of the operation ◀ flags        the nearest value counts

A key that no operation of the job can use is refused, wherever it was given.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from camtool.errors import MachineError, OptionError
from camtool.jobs.keys import (
    OPERATION,
    PLACE,
    STOCK,
    TOOL,
    TOOL_KEYS,
    TOOL_NAME,
    WHOLE,
    Given,
    Table,
    flag_name,
    record_of,
    refuse_idle,
    table_of,
    why_idle,
)
from camtool.jobs.tool_table import TableTool, read_tool_table
from camtool.planning.job import Job, Operation, Placement, Stock, Tool
from camtool.tables import read_table

OF_OPERATIONS = (*OPERATION, TOOL_NAME, *TOOL_KEYS)
"""Keys of `[[operations]]`."""

TABLES = ("place", "stock", "tools", "operations")
"""Tables of a job file."""

AT_THE_TOP = (*WHOLE, *OF_OPERATIONS, "origin", *TABLES)
"""Keys at the top of a job file; the origin may stand here too."""

_OPERATION_NUMBER = re.compile(r"\d{1,6}")
"""An operation by its number."""

_TABLE_KEYS = ("tool_table", "tool_table_units")
_ANY_STOCK = {"thickness_mm": 1.0}


@dataclass(frozen=True)
class JobTables:
    """The tables of a job as a file gives them, or flags. `defaults` hold for all `operations`;
    None are the operations of the other source."""

    whole: Table = field(default_factory=Table)
    place: Table = field(default_factory=Table)
    stock: Table | None = None
    tools: Mapping[str, Table] = field(default_factory=dict)
    defaults: Table = field(default_factory=Table)
    operations: tuple[Table, ...] | None = None
    folder: Path = Path()


def read_job_file(path: Path) -> JobTables:
    """The tables of a job file; OptionError names file, table and key, and says how to fix it."""
    try:
        values = read_table(path)
    except MachineError as error:
        raise OptionError(error.message, file=error.file, mend=error.mend) from error
    return tables_of(values, path)


def tables_of_flags(given: Mapping[str, Any]) -> JobTables:
    """The tables of the flags that were given, by the names of their keys."""

    flags = Table({key: Given(value, flag_name(key)) for key, value in given.items()})
    return JobTables(flags.only(WHOLE), flags.only(PLACE), defaults=flags.only(OF_OPERATIONS))


def tables_of(values: dict[str, Any], path: Path) -> JobTables:
    """The tables of a job as TOML gives them; `path` names the file."""
    file = str(path)
    top = table_of(values, AT_THE_TOP, "", file)
    defaults = top.only(OF_OPERATIONS)
    operations = _operation_tables(values, file)
    if operations is None:
        defaults, operations = Table(file=file), (defaults,)
    elif "name" in defaults.given:
        raise defaults.given["name"].refused(
            "every operation needs a name of its own", "move it into [[operations]]"
        )
    return JobTables(
        whole=top.only(WHOLE),
        place=_place_table(top, values, file),
        stock=table_of(values["stock"], STOCK, "table [stock]", file)
        if "stock" in values
        else None,
        tools=_tool_tables(values, file),
        defaults=defaults,
        operations=operations,
        folder=path.parent,
    )


def _operation_tables(values: dict[str, Any], file: str) -> tuple[Table, ...] | None:
    """The tables of `[[operations]]`, None without any."""
    if "operations" not in values:
        return None
    rows = values["operations"]
    if not isinstance(rows, list) or not rows:
        raise OptionError(
            "is no list of operations",
            file=file,
            where="key operations",
            mend="begin each operation with [[operations]]",
        )
    return tuple(
        table_of(row, OF_OPERATIONS, f"table [[operations]] {_called(n, row)}", file)
        for n, row in enumerate(rows, start=1)
    )


def _called(number: int, row: object) -> str:
    name = row.get("name") if isinstance(row, dict) else None
    return f"{number} {name!r}" if isinstance(name, str) else str(number)


def _place_table(top: Table, values: dict[str, Any], file: str) -> Table:
    place = table_of(values.get("place", {}), PLACE, "table [place]", file)
    if "origin" in top.given and "origin" in place.given:
        raise top.given["origin"].refused("stands in [place] too", "give it once")
    return place.over(top.only(["origin"]))


def _tool_tables(values: dict[str, Any], file: str) -> dict[str, Table]:
    tools = values.get("tools", {})
    if not isinstance(tools, dict):
        raise Given(tools, "key tools", file).refused(
            "is no table of tools", "begin each tool with [tools.NAME]"
        )
    return {
        name: table_of(tool, TOOL, f"table [tools.{name}]", file) for name, tool in tools.items()
    }


def build_job(file: JobTables, flags: JobTables, chosen: tuple[str, ...] = ()) -> Job:
    """The job of a file with the flags over it, of the operations that are `chosen` by name or
    number (none: all). OptionError names file, table and key, or the flag, and says how to
    fix it."""
    whole = flags.whole.over(file.whole)
    tools = _tools(file, whole)
    tables = file.operations or (Table(),)
    record_of(Operation, OPERATION, file.defaults.only(OPERATION))
    operations = [
        _operation(n, (file.defaults, own, flags.defaults), tools, len(tables))
        for n, own in enumerate(tables, start=1)
    ]
    _refuse_equal_names(operations, tables)
    rows = _rows(operations, chosen)
    for layer in (file.defaults, flags.defaults):
        _refuse_unused(
            layer, operations if layer is file.defaults else [operations[n] for n in rows]
        )
    keys = {name for name in WHOLE if name not in _TABLE_KEYS}
    job = record_of(Job, WHOLE, whole.only(keys))
    return replace(
        job,
        operations=tuple(operations[n] for n in rows),
        placement=_placement(file, flags),
        stock=_stock(file.stock),
    )


def job_of_file(path: Path, chosen: tuple[str, ...] = ()) -> Job:
    """The job of a file alone; raises as `build_job` does."""
    return build_job(read_job_file(path), JobTables(), chosen)


def _tools(file: JobTables, whole: Table) -> Tools:
    refuse_bad_tools(file.tools)
    given = whole.given.get("tool_table")
    units = whole.given.get("tool_table_units")
    if given is None:
        if units is not None:
            raise units.refused("has no effect without tool_table", "give tool_table too")
        return Tools(file.tools)
    name = WHOLE["tool_table"].read(given)
    # A path in a job file is relative to the file, one on the command line to where it is run.
    path = file.folder / name if given.file is not None else Path(name)
    unit = "mm" if units is None else WHOLE["tool_table_units"].read(units)
    return with_table(Tools(file.tools, units=unit), path)


def _operation(
    number: int, layers: tuple[Table, Table, Table], tools: Tools, count: int
) -> Operation:
    """Operation `number` of `count`: its own keys over the defaults, flags over both."""
    defaults, own, flags = layers
    merged = flags.over(own.over(defaults)).only(OPERATION)
    record_of(
        Operation, OPERATION, own.only(OPERATION)
    )  # keys that flags override must be right too
    kind = Operation.kind
    if "kind" in merged.given:
        kind = OPERATION["kind"].read(merged.given["kind"])
    for name, given in own.only(OPERATION).given.items():
        if kind not in OPERATION[name].kinds:
            raise given.refused(*_unknown(name, kind))
    known = merged.only(name for name in OPERATION if kind in OPERATION[name].kinds)
    operation = record_of(Operation, OPERATION, known)
    for name, given in own.only(OPERATION).given.items():
        why = why_idle(OPERATION, name, operation)
        if why is not None and merged.given[name] is given:
            raise given.refused(why.message, why.mend)
    if not operation.name and count > 1:
        operation = replace(operation, name=f"{kind} {number}")
    operation = replace(operation, tool=tools.of(layers, kind))
    _refuse_tool(operation, own)
    return operation


def _unknown(name: str, kind: str) -> tuple[str, str]:
    """What is wrong with a key that a kind of operation does not know, and how to fix it."""
    known = [key for key in OPERATION if kind in OPERATION[key].kinds]
    return f"means nothing to the kind {kind}", f"it has: {', '.join(known)}, tool"


def _refuse_tool(operation: Operation, own: Table) -> None:
    """A V bit is needed to carve, and its angle to know how deep."""
    tool = operation.tool
    if operation.kind == "vcarve" and (tool.kind != "v" or tool.tip_angle_rad is None):
        place = own.given.get("tool", own)
        raise place.refused(
            f"vcarve needs a V bit, not a tool of kind {tool.kind!r}"
            if tool.kind != "v"
            else "vcarve needs the angle of its V bit",
            'give a tool with kind = "v" and its tip_angle',
        )


def _refuse_equal_names(operations: list[Operation], tables: tuple[Table, ...]) -> None:
    names = [operation.name for operation in operations]
    for n, table in enumerate(tables):
        if names[n] in names[:n]:
            raise table.given.get("name", table).refused(
                f"operation {names.index(names[n]) + 1} has the name {names[n]!r} already",
                "give each operation a name of its own",
            )


def _rows(operations: list[Operation], chosen: tuple[str, ...]) -> list[int]:
    """The rows of the operations of these names or numbers, in the order of the job."""
    names = [operation.name for operation in operations]
    rows = set()
    for text in chosen:
        if text in names:
            rows.add(names.index(text))
        elif _OPERATION_NUMBER.fullmatch(text) and 1 <= int(text) <= len(names):
            rows.add(int(text) - 1)
        else:
            near = difflib.get_close_matches(text, names, n=1)
            raise OptionError(
                f"there is no operation {text!r}",
                where="--operation",
                mend=(f"did you mean {near[0]!r}? " if near else "")
                + f"known: {', '.join(name or '1' for name in names)}",
            )
    return sorted(rows) or list(range(len(names)))


def _refuse_unused(layer: Table, operations: list[Operation]) -> None:
    """Refuse a default or a flag that no operation uses."""
    for name, given in layer.only(OPERATION).given.items():
        reasons = [_why_unused(name, operation) for operation in operations]
        if None not in reasons and reasons[0] is not None:
            raise given.refused(reasons[0].message, reasons[0].mend)


def _why_unused(name: str, operation: Operation) -> OptionError | None:
    if operation.kind not in OPERATION[name].kinds:
        message, mend = _unknown(name, operation.kind)
        return OptionError(message, mend=mend)
    return why_idle(OPERATION, name, operation)


def _placement(file: JobTables, flags: JobTables) -> Placement:
    """The drawing's placement; a scale on the command line takes the place of the file's fit."""
    below = dict(file.place.given)
    for one, other in (("scale", "fit"), ("fit", "scale")):
        if one in flags.place.given:
            below.pop(other, None)
    return record_of(
        Placement, PLACE, flags.place.over(Table(below, file.place.where, file.place.file))
    )


def _stock(table: Table | None) -> Stock | None:
    if table is None:
        return None
    if "thickness" not in table.given:
        raise table.refused("key thickness is missing", "give thickness, and corner and size")
    return record_of(Stock, STOCK, table, _ANY_STOCK)


# The tool of an operation: by name, by number, or key by key.

_TOOL_NUMBER = re.compile(r"\d{1,9}")
"""A tool by its number."""


@dataclass(frozen=True)
class Tools:
    """The tools of a job: `named` in its file, and by number in a LinuxCNC `table`, whose lengths
    have the unit `units`."""

    named: Mapping[str, Table] = field(default_factory=dict)
    table: Mapping[int, TableTool] = field(default_factory=dict)
    table_file: str = ""
    units: str = "mm"

    def of(self, layers: Sequence[Table], kind: str) -> Tool:
        """The tool of an operation of this kind. `layers`: the tables that apply to
        it, the nearest last.

        The nearest name or number counts, and single keys (`tool_diameter`) of that layer and
        of nearer ones change it.
        """
        at = max((n for n, layer in enumerate(layers) if TOOL_NAME in layer.given), default=-1)
        name, keys = ("", Table()) if at < 0 else self._chosen(layers[at].given[TOOL_NAME])
        for n, layer in enumerate(layers[max(at, 0) :], start=max(at, 0)):
            own = layer.only(TOOL_KEYS)
            if n == at and own.given:
                raise next(iter(own.given.values())).refused(
                    "contradicts the tool that is named beside it", "give one of the two"
                )
            given = {key.removeprefix("tool_"): value for key, value in own.given.items()}
            keys = Table(given, own.where, own.file).over(keys)
        return _tool(name, keys, kind)

    def _chosen(self, given: Given) -> tuple[str, Table]:
        """Name and keys of the tool that a name or a number says."""
        value = given.value
        if isinstance(value, str) and value in self.named:
            return value, self._completed(self.named[value])
        if isinstance(value, str) and _TOOL_NUMBER.fullmatch(value.strip()):
            value = int(value)
        if type(value) is int:
            return self._numbered(value, given)
        if not isinstance(value, str):
            raise given.refused(f"{value!r} is no tool", "give its name in quotes, or its number")
        near = difflib.get_close_matches(value, self.named, n=1)
        raise given.refused(
            f"there is no tool {value!r}",
            (f"did you mean {near[0]!r}? " if near else "")
            + (f"known: {', '.join(self.named)}" if self.named else f"write [tools.{value}]"),
        )

    def _numbered(self, number: int, given: Given) -> tuple[str, Table]:
        for name, keys in self.named.items():
            if _number_of(keys) == number:
                return name, self._completed(keys)
        if number in self.table:
            return self.table[number].remark, self._of_table(number)
        known = [str(each) for each in self.table]
        raise given.refused(
            f"there is no tool {number}",
            f"{self.table_file} has: {', '.join(known) or 'none'}"
            if self.table_file
            else 'give the tool table: tool_table = "tool.tbl"',
        )

    def _completed(self, keys: Table) -> Table:
        """A named tool of a number may leave its diameter to the tool table."""
        number = _number_of(keys)
        if number is None or number not in self.table:
            return keys
        return keys.over(self._of_table(number, needed="diameter" not in keys.given))

    def _of_table(self, number: int, *, needed: bool = True) -> Table:
        """The keys of a tool of the table; refused when it lacks a diameter that is needed."""
        tool = self.table[number]
        table = Table({}, f"line {tool.line}", self.table_file)
        if tool.diameter is None and needed:
            raise table.refused(f"tool {number} has no diameter", "give it a D")
        values = {"number": number, "diameter": f"{tool.diameter!r}{self.units}"}
        if tool.diameter is None:
            del values["diameter"]
        given = {name: Given(value, table.where, table.file) for name, value in values.items()}
        return replace(table, given=given)


def with_table(tools: Tools, path: Path) -> Tools:
    """The tools, and those of a LinuxCNC tool table; OptionError names file and line."""
    try:
        text = path.read_bytes().decode("utf-8", errors="replace")
    except OSError as error:
        raise OptionError(
            f"cannot be read ({error.strerror})", file=str(path), mend="check the path"
        ) from error
    return replace(tools, table=read_tool_table(text, str(path)), table_file=str(path))


def refuse_bad_tools(named: Mapping[str, Table]) -> None:
    """Refuse tools that are wrong, used or not, and two tools with one number."""
    seen: dict[int, str] = {}
    for name, keys in named.items():
        _tool(name, keys, "")
        number = _number_of(keys)
        if number is None:
            continue
        if number in seen:
            raise keys.given["number"].refused(
                f"tool {number} is {seen[number]!r} already", "give each tool a number of its own"
            )
        seen[number] = name


def _number_of(keys: Table) -> int | None:
    """The number of a tool of the file, if it has one."""
    given = keys.given.get("number")
    number: int | None = None if given is None else TOOL["number"].read(given)
    return number


def _tool(name: str, keys: Table, kind: str) -> Tool:
    """The record; a tool with a tip that does not say its kind is a V bit, or drills."""
    if "tip_angle" in keys.given and "kind" not in keys.given:
        meant = Given("drill" if kind == "drill" else "v", keys.where, keys.file)
        keys = Table({**keys.given, "kind": meant}, keys.where, keys.file)
    tool = record_of(Tool, TOOL, keys)
    refuse_idle(TOOL, keys, tool)
    return replace(tool, name=name)
