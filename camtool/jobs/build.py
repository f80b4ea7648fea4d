"""The job that a job file and the flags give together.

    safe_z = "0.5mm"                # the job as a whole
    depth = "0.1mm"                 # keys of operations up here hold for all that have them
    [place]                         # the drawing in the work frame
    [stock]
    [[keep_out]]                    # clamps
    [[setups]]                      # sides of the part
    [tools.finish]
    [[operations]]                  # in the order in which they are cut

A file is TOML, read as strictly as a machine's; one without `[[operations]]` is one operation,
whose keys stand at its top. docs/jobs.md explains every key.

    defaults of the file ◀ keys of the operation ◀ flags        the nearest value counts

A key that no operation of the job can use is refused, wherever it was given."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from msgspec import Struct, field

from camtool.errors import MachineError, OptionError
from camtool.jobs.keys import (
    FINISH_TOOL,
    KEEP_OUT,
    OPERATION,
    PLACE,
    SETUP,
    STOCK,
    TOOL_KEYS,
    TOOL_NAME,
    WHOLE,
    flag_name,
    is_known,
)
from camtool.jobs.tools import Described, Shop, Tools, Used, tool_tables, tools_for
from camtool.keys import Given, Table, record_of, table_of, why_idle
from camtool.planning.job import (
    Job,
    JobSetup,
    KeepOutBox,
    Operation,
    Placement,
    Stock,
    operation_of,
    rested,
)
from camtool.records import replace
from camtool.tables import read_table

OF_OPERATIONS = (*OPERATION, TOOL_NAME, *TOOL_KEYS)
"""Keys of `[[operations]]`."""

_RECORDED = tuple(name for name in OPERATION if name != FINISH_TOOL)
"""Keys of operations each of which sets a field by itself."""

_OF_FINISH = ("finish", "finish_feed", "finish_spindle", FINISH_TOOL)
"""Keys of a finishing pass."""

_OF_WALLS = ("allowance", *_OF_FINISH)
"""Keys whose fields depend on the tools."""

TABLES = ("place", "stock", "keep_out", "setups", "tools", "operations")

AT_THE_TOP = (*WHOLE, *OF_OPERATIONS, "origin", *TABLES)
"""Keys at the top of a job file; the origin may stand here too."""

_OPERATION_NUMBER = re.compile(r"\d{1,6}")
"""The number of an operation as text."""

_OF_TOOLS = ("material", "tool_library", "tool_table", "tool_table_units")
"""Keys of the whole job that concern its tools."""

EITHER = {"depth": "breakthrough", "breakthrough": "depth", "scale": "fit", "fit": "scale"}
"""Pairs of keys that set the same in different ways: a key of a nearer layer replaces the other
key of a farther one."""

_ANY_STOCK = {"thickness_mm": 1.0}

_ANY_SETUP = partial(JobSetup, name="", operations=())

_ANY_BOX = partial(KeepOutBox, name="", x_mm=(0.0, 1.0), y_mm=(0.0, 1.0))


class JobTables(Struct, frozen=True):
    """The tables of a job, from a file or from flags. `defaults` hold for all `operations`;
    `operations` None: those of the other source apply."""

    whole: Table = field(default_factory=Table)
    place: Table = field(default_factory=Table)
    stock: Table | None = None
    keep_out: tuple[Table, ...] = ()
    setups: tuple[Table, ...] = ()
    tools: Mapping[str, Described] = field(default_factory=dict)
    defaults: Table = field(default_factory=Table)
    operations: tuple[Table, ...] | None = None
    folder: Path = Path()


def read_job_file(path: Path, data: bytes | None = None) -> JobTables:
    """Return the tables of a job file; OptionError names file, table and key, and says how to fix
    it. `data`: the content of the file, if it has been read already."""
    try:
        values = read_table(path, data)
    except MachineError as error:
        raise OptionError(error.message, file=error.file, mend=error.mend) from error
    return tables_of(values, path)


def tables_of_flags(values: Mapping[str, Any]) -> JobTables:
    """Return the tables of a job that the given command-line flags amount to, by the names of
    their keys."""
    flags = Table({key: Given(value, flag_name(key)) for key, value in values.items()})
    return JobTables(flags.only(WHOLE), flags.only(PLACE), defaults=flags.only(OF_OPERATIONS))


def tables_of(values: dict[str, Any], path: Path) -> JobTables:
    """Return the tables of a job as TOML gives them; `path` names the file."""
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
        keep_out=_list_of_tables(values, "keep_out", "boxes", KEEP_OUT, file),
        setups=_list_of_tables(values, "setups", "set-ups", SETUP, file),
        tools=tool_tables(values, file),
        defaults=defaults,
        operations=operations,
        folder=path.parent,
    )


def _operation_tables(values: dict[str, Any], file: str) -> tuple[Table, ...] | None:
    """Return the tables `[[operations]]`; None if the file has none."""
    if "operations" not in values:
        return None
    return _list_of_tables(values, "operations", "operations", OF_OPERATIONS, file)


def _list_of_tables(
    values: dict[str, Any], key: str, subject: str, known_keys: Iterable[str], file: str
) -> tuple[Table, ...]:
    """Return the tables `[[key]]`, () if there are none; OptionError for a key in them that is not
    one of `known_keys`."""
    rows = values.get(key, ())
    if key in values and not (isinstance(rows, list) and rows):
        raise OptionError(
            f"is no list of {subject}",
            file=file,
            where=f"key {key}",
            mend=f"begin each with [[{key}]]",
        )
    return tuple(
        table_of(row, known_keys, f"table [[{key}]] {_name_words(n, row)}", file)
        for n, row in enumerate(rows, start=1)
    )


def _name_words(number: int, row: object) -> str:
    name = row.get("name") if isinstance(row, dict) else None
    return f"{number} {name!r}" if isinstance(name, str) else str(number)


def _place_table(top: Table, values: dict[str, Any], file: str) -> Table:
    place = table_of(values.get("place", {}), PLACE, "table [place]", file)
    if "origin" in top.given and "origin" in place.given:
        raise top.given["origin"].refused("stands in [place] too", "give it once")
    return place.over(top.only(["origin"]))


def build_job(
    file: JobTables,
    flags: JobTables,
    selection: tuple[str, ...] = (),
    shop: Shop = Shop(),  # noqa: B008
) -> Job:
    """Return the job that a file and the flags over it describe. `selection` names or numbers the
    operations to keep (empty: all); `shop` has the tools that jobs may name, and the tool and
    material where the job names none. OptionError names file, table and key, or the flag, and says
    how to fix it."""
    job_table = flags.whole.over(file.whole)
    tools = tools_for(file.tools, job_table, file.folder, shop)
    tables = file.operations or (Table(),)
    record_of(operation_of, OPERATION, file.defaults.only(_RECORDED))
    stock = _stock(file.stock)
    operations = [
        _operation(n, (file.defaults, own_table, flags.defaults), tools, len(tables))
        for n, own_table in enumerate(tables, start=1)
    ]
    operations = [
        _settled(operation, (file.defaults, own_table, flags.defaults), stock)
        for operation, own_table in zip(operations, tables, strict=True)
    ]
    _refuse_equal_names(operations, tables)
    operations = _rested(operations, tables)
    tools.refuse_idle_material(operations)
    rows = _rows(operations, selection)
    for layer in (file.defaults, flags.defaults):
        _refuse_unused(
            layer, operations if layer is file.defaults else [operations[n] for n in rows]
        )
    keys = {name for name in WHOLE if name not in _OF_TOOLS}
    job = record_of(Job, WHOLE, job_table.only(keys))
    job = replace(
        job,
        operations=tuple(operations[n] for n in rows),
        placement=_placement(file, flags),
        stock=stock,
        keep_out=tuple(_keep_out(n, table) for n, table in enumerate(file.keep_out, start=1)),
    )
    return _with_setups(job, file.setups, [operation.name for operation in operations])


def _with_setups(job: Job, tables: Sequence[Table], names: Sequence[str]) -> Job:
    """Return the job with the set-ups of its file. Operations in `names` that the job lacks,
    because a selection left them out, are removed from the set-ups, and so are set-ups that become
    empty."""
    absent = set(names) - {each.name for each in job.operations}
    setups = []
    for table in tables:
        for key in ("name", "operations"):
            if key not in table.given:
                raise table.refused(f"key {key} is missing", "give name and operations")
        setup = record_of(_ANY_SETUP, SETUP, table.only(["name", "operations", "flip"]))
        fields = {SETUP[key].field: SETUP[key].read(table.given[key]) for key in table.given}
        try:
            setup = replace(setup, **fields)
        except OptionError as error:
            raise table.refused(error.message, error.mend) from error
        remaining = tuple(name for name in setup.operations if name not in absent)
        if remaining:
            setups.append(replace(setup, operations=remaining))
    try:
        return replace(job, setups=tuple(setups))
    except OptionError as error:
        if tables and not error.file:
            error.file = tables[0].file
        raise


def job_of_file(
    path: Path, selection: tuple[str, ...] = (), libraries: tuple[Path, ...] = ()
) -> Job:
    """Return the job of a file without flags; `libraries` are its tool libraries, the nearest
    first. Raises as `build_job` does."""
    return build_job(read_job_file(path), JobTables(), selection, Shop(libraries))


def _operation(
    number: int, layers: tuple[Table, Table, Table], tools: Tools, count: int
) -> Operation:
    """Return operation `number` of `count`, with its own keys over the file's defaults and the
    flags over both; OptionError for a key that its kind does not know or that has no effect."""
    defaults, own_table, flags = layers
    merged = _merged_layers((defaults, own_table, flags)).only(OPERATION)
    record_of(
        operation_of, OPERATION, own_table.only(_RECORDED)
    )  # keys that flags override must be right too
    kind = Operation.kind
    if "kind" in merged.given:
        kind = OPERATION["kind"].read(merged.given["kind"])
    for name, key_value in own_table.only(OPERATION).given.items():
        if not is_known(name, kind):
            raise key_value.refused(*_unknown(name, kind))
    tool_used = tools.of(layers, kind)
    preset = tuple(key for key in tool_used.preset.given if key not in merged.given)
    merged = merged.over(tool_used.preset)
    known_keys = merged.only(name for name in OPERATION if is_known(name, kind))
    operation = record_of(operation_of, OPERATION, known_keys.only(_RECORDED))
    for name, key_value in own_table.only(OPERATION).given.items():
        reason = why_idle(OPERATION, name, operation)
        if reason is not None and merged.given[name] is key_value:
            raise key_value.refused(reason.message, reason.mend)
    if not operation.name and count > 1:
        operation = replace(operation, name=f"{kind} {number}")
    operation = replace(_tooled(operation, known_keys, tool_used, tools), preset=preset)
    _refuse_tool(operation, own_table)
    return operation


def _tooled(operation: Operation, known_keys: Table, tool_used: Used, tools: Tools) -> Operation:
    """Return the operation with its tool and the tool of its finishing pass, which takes feed and
    spindle speed from its own preset unless the operation sets them."""
    fields: dict[str, Any] = {"tool": tool_used.tool, "material": tool_used.material}
    keys = {key: known_keys.given[key] for key in _OF_WALLS if key in known_keys.given}
    if FINISH_TOOL in keys:
        last = tools.of([Table({TOOL_NAME: keys[FINISH_TOOL]})], operation.kind)
        fields["finish_tool"] = last.tool
        for key in ("feed", "spindle"):
            field = OPERATION[f"finish_{key}"].field
            if key in last.preset.given and getattr(operation, field) is None:
                fields[field] = OPERATION[key].read(last.preset.given[key])
    try:
        operation = replace(operation, **fields)
        operation.stages()
        return operation
    except OptionError as error:
        named = re.search(r"key (\w+)$", error.where or "")
        if named is None or named[1] not in keys:
            raise
        raise keys[named[1]].refused(error.message, error.mend) from error


def _merged_layers(layers: Sequence[Table]) -> Table:
    """Return the keys of all layers, the last of which counts most. A depth replaces the
    breakthrough of another layer, and a breakthrough its depth, where the operation knows both
    keys."""
    merged = layers[0]
    kinds = [layer.given["kind"].value for layer in layers if "kind" in layer.given]
    kind = kinds[-1] if kinds else Operation.kind
    for layer in layers[1:]:
        below = dict(merged.given)
        for one in layer.only(OPERATION).given:
            if one in EITHER and is_known(one, kind):
                below.pop(EITHER[one], None)
        merged = layer.over(Table(below, merged.where, merged.file))
    return merged


def _settled(operation: Operation, layers: Sequence[Table], stock: Stock | None) -> Operation:
    """Return the operation completed by its kind and the stock, such as the depth from the
    thickness; an OptionError names the key at fault."""
    try:
        return operation.settled(stock)
    except OptionError as error:
        # The fault may be in the last pass, which has a key of its own.
        key_values = _merged_layers(layers).given
        named = re.search(r"key (\w+)$", error.where or "")
        keys = (named[1] if named else "", "breakthrough", "kind")
        stated = (key for key in keys if key in key_values and is_known(key, operation.kind))
        place = key_values.get(next(stated, ""))
        if place is None:
            raise
        raise place.refused(error.message, error.mend) from error


def _rested(operations: list[Operation], tables: Sequence[Table]) -> list[Operation]:
    """Return the operations, each that clears what others leave (`rest`) linked to those;
    OptionError for a depth of its own where the floor of a carving sets it."""
    carvings = {each.name for each in operations if each.contract.rest == "floor" and each.name}
    for operation, own_table in zip(operations, tables, strict=True):
        for key in ("depth", "breakthrough"):
            if operation.rest in carvings and key in own_table.given:
                raise own_table.given[key].refused(
                    f"the floor of {operation.rest!r} has a depth already",
                    f"leave {key} out, it is that of the carving",
                )
    try:
        return rested(operations)
    except OptionError as error:
        for operation, own_table in zip(operations, tables, strict=True):
            if operation.rest and repr(operation.name or operation.kind) in (error.where or ""):
                raise own_table.given["rest"].refused(error.message, error.mend) from error
        raise


def _unknown(name: str, kind: str) -> tuple[str, str]:
    """Return the message and the correction for a key that a kind of operation does not have."""
    known_keys = [key for key in OPERATION if is_known(key, kind)]
    return f"means nothing to the kind {kind}", f"it has: {', '.join(known_keys)}, tool"


def _refuse_tool(operation: Operation, own_table: Table) -> None:
    """Raise OptionError where the operation needs a V bit and the tool is none, or its tip angle
    is missing."""
    tool, kind = operation.tool, operation.kind
    if operation.contract.needs_v_bit and (tool.kind != "v" or tool.tip_angle_rad is None):
        place = own_table.given.get("tool", own_table)
        raise place.refused(
            f"{kind} needs a V bit, not a tool of kind {tool.kind!r}"
            if tool.kind != "v"
            else f"{kind} needs the angle of its V bit",
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


def _rows(operations: list[Operation], selection: tuple[str, ...]) -> list[int]:
    """Return the indices of the operations that `selection` names or numbers, in the order of the
    job (all if it is empty); OptionError for an unknown one."""
    names = [operation.name for operation in operations]
    rows = set()
    for text in selection:
        if text in names:
            rows.add(names.index(text))
        elif _OPERATION_NUMBER.fullmatch(text) and 1 <= int(text) <= len(names):
            rows.add(int(text) - 1)
        else:
            import difflib

            near_names = difflib.get_close_matches(text, names, n=1)
            raise OptionError(
                f"there is no operation {text!r}",
                where="--operation",
                mend=(f"did you mean {near_names[0]!r}? " if near_names else "")
                + f"known: {', '.join(name or '1' for name in names)}",
            )
    return sorted(rows) or list(range(len(names)))


def _refuse_unused(layer: Table, operations: list[Operation]) -> None:
    """Raise OptionError for a default or a flag that no operation uses."""
    for name, key_value in layer.only(OPERATION).given.items():
        reasons = [_why_unused(name, operation) for operation in operations]
        if None not in reasons and reasons[0] is not None:
            raise key_value.refused(reasons[0].message, reasons[0].mend)


def _why_unused(name: str, operation: Operation) -> OptionError | None:
    if not is_known(name, operation.kind):
        message, mend = _unknown(name, operation.kind)
        return OptionError(message, mend=mend)
    return why_idle(OPERATION, name, operation)


def _placement(file: JobTables, flags: JobTables) -> Placement:
    """Return the placement of the drawing; a scale on the command line replaces the file's
    `fit`."""
    below = dict(file.place.given)
    for one in flags.place.given:
        below.pop(EITHER.get(one, ""), None)
    return record_of(
        Placement, PLACE, flags.place.over(Table(below, file.place.where, file.place.file))
    )


def _stock(table: Table | None) -> Stock | None:
    if table is None:
        return None
    if "thickness" not in table.given:
        raise table.refused("key thickness is missing", "give thickness, and corner and size")
    return record_of(Stock, STOCK, table, _ANY_STOCK)


def _keep_out(number: int, table: Table) -> KeepOutBox:
    """Return the box of a table `[[keep_out]]`, called "box NUMBER" if the table has no name."""
    for key in ("x", "y"):
        if key not in table.given:
            raise table.refused(f"key {key} is missing", "give x and y, and z if it ends")
    box = record_of(_ANY_BOX, KEEP_OUT, table)
    return box if box.name else replace(box, name=f"box {number}")
