"""Job files: TOML that says how a drawing is cut, read as strictly as a machine's.

    safe_z = "0.5mm"                # the job as a whole
    depth = "0.1mm"                 # keys of operations up here hold for all that know them
    [place]                         # the drawing in the work frame
    [stock]
    [tools.finish]
    [[operations]]                  # in the order in which they are cut

A file without `[[operations]]` is one operation, whose keys stand at its top. docs/jobs.md
explains every key. What is read here is not yet a job: `build` lays the flags over it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from camtool.errors import MachineError, OptionError
from camtool.jobs.given import Given, Table, table_of
from camtool.jobs.keys import OPERATION, PLACE, STOCK, TOOL, TOOL_KEYS, TOOL_NAME, WHOLE
from camtool.machine.loader import read_table

OF_OPERATIONS = (*OPERATION, TOOL_NAME, *TOOL_KEYS)
"""Keys of `[[operations]]`."""

TABLES = ("place", "stock", "tools", "operations")
"""Tables of a job file."""

AT_THE_TOP = (*WHOLE, *OF_OPERATIONS, "origin", *TABLES)
"""Keys at the top of a job file; the origin may stand here too."""


@dataclass(frozen=True)
class Said:
    """What a file, or the flags, say of a job: its tables as given. `defaults` hold for all
    `operations`; None are the operations of the other source."""

    whole: Table = field(default_factory=Table)
    place: Table = field(default_factory=Table)
    stock: Table | None = None
    tools: Mapping[str, Table] = field(default_factory=dict)
    defaults: Table = field(default_factory=Table)
    operations: tuple[Table, ...] | None = None
    folder: Path = Path()


def read_job_file(path: Path) -> Said:
    """The tables of a job file; OptionError names file, table, key and mend."""
    try:
        values = read_table(path)
    except MachineError as error:
        raise OptionError(error.message, file=error.file, mend=error.mend) from error
    return said_of(values, path)


def said_of(values: dict[str, Any], path: Path) -> Said:
    """The tables of a job as TOML gives them; `path` names the file."""
    file = str(path)
    top = table_of(values, AT_THE_TOP, "", file)
    defaults = top.only(OF_OPERATIONS)
    operations = _operations(values, file)
    if operations is None:
        defaults, operations = Table(file=file), (defaults,)
    elif "name" in defaults.given:
        raise defaults.given["name"].refused(
            "every operation needs a name of its own", "move it into [[operations]]"
        )
    return Said(
        whole=top.only(WHOLE),
        place=_place(top, values, file),
        stock=table_of(values["stock"], STOCK, "table [stock]", file)
        if "stock" in values
        else None,
        tools=_tools(values, file),
        defaults=defaults,
        operations=operations,
        folder=path.parent,
    )


def _operations(values: dict[str, Any], file: str) -> tuple[Table, ...] | None:
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


def _place(top: Table, values: dict[str, Any], file: str) -> Table:
    place = table_of(values.get("place", {}), PLACE, "table [place]", file)
    if "origin" in top.given and "origin" in place.given:
        raise top.given["origin"].refused("stands in [place] too", "give it once")
    return place.over(top.only(["origin"]))


def _tools(values: dict[str, Any], file: str) -> dict[str, Table]:
    tools = values.get("tools", {})
    if not isinstance(tools, dict):
        raise Given(tools, "key tools", file).refused(
            "is no table of tools", "begin each tool with [tools.NAME]"
        )
    return {
        name: table_of(tool, TOOL, f"table [tools.{name}]", file) for name, tool in tools.items()
    }
