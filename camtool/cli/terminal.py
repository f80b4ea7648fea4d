"""Summaries and tables as a terminal shows them: names bold, what exceeds a limit in colour.

What is no terminal gets the same words as they are. Colours are click's and not rich's: loading
rich takes a tenth of the time of a whole `verify`.
"""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import click

from camtool.cli.talk import COLOURS, in_colour, show_text

if TYPE_CHECKING:
    from camtool.findings import Finding
    from camtool.verify.contrast import ContrastRow

Marks = Mapping[str, str]
"""How bad the lines of these names are: "error", "warning" or "info"."""

LEAST_WIDTH = 20
"""Values are wrapped to the terminal's width, and to no less than so many columns."""

REPORT_NAMES = 11
"""Columns before the values in the summary of a report."""

DRAWING_MARKS = dict.fromkeys(("not used", "gap", "branch", "crossing", "open"), "warning")
"""What in the facts of a drawing somebody should look at."""

_LINES = {
    "--max-error": "error",
    "--max-time": "time",
    "--max-reversals": "reversals",
    "MANY_REVERSALS": "reversals",
    "END_NOT_REACHED": "ends",
    "ARC_MISSES_END": "ends",
}
"""The line of the summary that says what a limit, or else a finding, is about."""


def show_facts(plain: str, name_width: int, marks: Marks, *, err: bool = False) -> None:
    """Lines of a name and a value; the names are `name_width` wide."""
    if in_colour(sys.stderr if err else sys.stdout):
        columns = shutil.get_terminal_size().columns
        lines = plain.split("\n")
        plain = "\n".join(_line(line, name_width, marks, columns) for line in lines)
    show_text(plain, err=err)


def show_compared(plain: str, rows: Sequence[ContrastRow]) -> None:
    """The table of `--compare`: the way with the least error in green, endless ones in red."""
    if in_colour(sys.stdout):
        head, *lines = plain.split("\n")
        ends = [row.total_max_um for row in rows if not row.endless]
        least = min((error for error in ends if error is not None), default=None)
        shown = [_way(line, row, least) for line, row in zip(lines, rows, strict=True)]
        plain = "\n".join([click.style(head, bold=True), *shown])
    show_text(plain)


def report_marks(findings: Iterable[Finding]) -> dict[str, str]:
    """The lines of a report's summary that these findings are about, and how bad they are."""
    marks: dict[str, str] = {}
    for finding in sorted(findings, key=lambda finding: finding.severity):
        name = _LINES.get(finding.where) or _LINES.get(finding.code.name)
        if name is not None:
            marks[name] = finding.severity.name.lower()
    return marks


def _line(line: str, name_width: int, marks: Marks, columns: int) -> str:
    """A name and its value, wrapped below itself."""
    name, value = line[:name_width], line[name_width:]
    mark = marks.get(name.strip())
    colour = None if mark is None else COLOURS[mark]
    wide = max(columns - name_width, LEAST_WIDTH)
    parts = textwrap.wrap(value, wide, break_long_words=False, break_on_hyphens=False)
    said = f"\n{' ' * name_width}".join(click.style(part, fg=colour) for part in parts)
    return f"{click.style(name.rstrip(), bold=True, fg=colour)}{name[len(name.rstrip()) :]}{said}"


def _way(line: str, row: ContrastRow, least: float | None) -> str:
    if row.endless:
        return click.style(line, fg="red")
    best = least is not None and row.total_max_um == least
    return click.style(line, fg="green") if best else line
