"""The job that a file and the flags say together.

    defaults of the file ◀ keys of the operation ◀ flags        the nearest value counts

A key that no operation of the job can use is refused, wherever it was given.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import replace
from pathlib import Path

from camtool.errors import OptionError
from camtool.jobs.file import Said, read_job_file
from camtool.jobs.given import Table, record_of, why_idle
from camtool.jobs.keys import OPERATION, PLACE, STOCK, WHOLE
from camtool.jobs.tools import Tools, refuse_bad_tools, with_table
from camtool.planning.job import Job, Operation, Placement, Stock

_NUMBER = re.compile(r"\d{1,6}")
"""An operation by its number."""

_TABLE_KEYS = ("tool_table", "tool_table_units")
_ANY_STOCK = {"thickness_mm": 1.0}


def build_job(file: Said, flags: Said, chosen: tuple[str, ...] = ()) -> Job:
    """The job of a file with the flags over it, of the operations that are `chosen` by name or
    number (none: all). OptionError names file, table and key, or the flag, and the mend."""
    whole = flags.whole.over(file.whole)
    tools = _tools(file, whole)
    tables = file.operations or (Table(),)
    record_of(Operation, OPERATION, file.defaults.only(OPERATION))
    operations = [
        _operation(n, (file.defaults, own, flags.defaults), tools, len(tables))
        for n, own in enumerate(tables, start=1)
    ]
    _refuse_twin_names(operations, tables)
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
    return build_job(read_job_file(path), Said(), chosen)


def _tools(file: Said, whole: Table) -> Tools:
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
    record_of(Operation, OPERATION, own.only(OPERATION))  # what flags hide must be right too
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
    """What is wrong with a key that a kind of operation does not know, and the mend."""
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


def _refuse_twin_names(operations: list[Operation], tables: tuple[Table, ...]) -> None:
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
        elif _NUMBER.fullmatch(text) and 1 <= int(text) <= len(names):
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
    """Refuse a default, or a flag, of which no operation makes use."""
    for name, given in layer.only(OPERATION).given.items():
        reasons = [_why_unused(name, operation) for operation in operations]
        if None not in reasons and reasons[0] is not None:
            raise given.refused(reasons[0].message, reasons[0].mend)


def _why_unused(name: str, operation: Operation) -> OptionError | None:
    if operation.kind not in OPERATION[name].kinds:
        message, mend = _unknown(name, operation.kind)
        return OptionError(message, mend=mend)
    return why_idle(OPERATION, name, operation)


def _placement(file: Said, flags: Said) -> Placement:
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
