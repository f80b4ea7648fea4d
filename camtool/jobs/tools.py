"""The tool of an operation: by name, by number, or key by key."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from camtool.errors import OptionError
from camtool.jobs.given import Given, Table, record_of, refuse_idle
from camtool.jobs.keys import TOOL, TOOL_KEYS, TOOL_NAME
from camtool.planning.job import Tool
from camtool.planning.tooltable import TableTool, read_tool_table

_NUMBER = re.compile(r"\d{1,9}")
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
        """The tool of an operation of this kind. `layers`: what is said of it, the nearest last.

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
        if isinstance(value, str) and _NUMBER.fullmatch(value.strip()):
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
    """Refuse what is no tool, used or not, and two tools of one number."""
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
