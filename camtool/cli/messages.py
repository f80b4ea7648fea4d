"""Output of commands for people: messages and findings, summaries in colour.

Messages always go to stderr, so that stdout stays for machines. Streams that are no terminal get
the same words without colours. Colours are click's and not rich's: loading rich takes a tenth of
the time of a whole `verify`."""

from __future__ import annotations

import os
import re
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, TextIO

import click

from camtool.cli.life_signs import hide_signs
from camtool.errors import CamtoolError
from camtool.plain import one_line

if TYPE_CHECKING:
    from camtool.findings import Finding
    from camtool.verification.contrast import ContrastRow


COLOURS = {"error": "red", "warning": "yellow", "info": "cyan"}


def say(text: str, *, quiet: bool = False) -> None:
    """Show one message on one line, unless `quiet`; invisible characters are escaped."""
    if not quiet:
        _echo(tint(one_line(text)))


def show_text(text: str, *, err: bool = False) -> None:
    """Print lines to stdout (with `err` to stderr), with or without styles; names in them must
    have gone through `one_line`."""
    if err:
        _echo(text)
    else:
        hide_signs()
        click.echo(text)


def _echo(text: str) -> None:
    """Write text to stderr; a full stderr is ignored, since there is nowhere to report it."""
    hide_signs()
    with suppress(OSError):
        click.echo(text, err=True)


def in_colour(stream: TextIO | None) -> bool:
    """Return True if a stream is a terminal whose user has set neither NO_COLOR (no-color.org) nor
    CLICOLOR=0 (bixense.com/clicolors); a closed stream is None."""
    variable = os.environ.get
    return (
        stream is not None
        and stream.isatty()
        and not variable("NO_COLOR")
        and variable("CLICOLOR") != "0"
        and variable("TERM") != "dumb"
    )


def say_error(error: CamtoolError) -> None:
    """Show an error on one line; on a terminal the advice is bold."""
    text, mend = one_line(f"camtool: error: {error}"), one_line(" ".join(error.mend.split()))
    if mend and text.endswith(mend) and in_colour(sys.stderr):
        text = text.removesuffix(mend) + click.style(mend, bold=True)
    _echo(tint(text))


def tint(text: str) -> str:
    """Colour the severity of a message, if stderr shows colours."""
    if not in_colour(sys.stderr):
        return text
    words = "|".join(COLOURS)
    return re.sub(
        rf"^(camtool: )({words})\b",
        lambda match: match[1] + click.style(match[2], fg=COLOURS[match[2]], bold=True),
        text,
    )


def say_findings(
    findings: Iterable[Finding], *, quiet: bool, verbose: bool, file: str = ""
) -> None:
    """Show errors always, warnings unless quiet, remarks when verbose: one line each, and one line
    for many alike, unless verbose. `file` is the name of one of several files that these are
    about."""
    from camtool.findings import Severity, summarise_findings

    head = f"camtool: {file}: " if file else "camtool: "
    min_severity = Severity.ERROR if quiet else Severity.INFO if verbose else Severity.WARNING
    shown = [finding for finding in findings if finding.severity >= min_severity]
    for finding, alike_count in (
        [(each, 0) for each in shown] if verbose else summarise_findings(shown)
    ):
        say(f"{head}{finding}")
        if alike_count:
            name = f"{finding.severity.name.lower()} {finding.code.name}"
            say(f"{head}{name}: and {alike_count} more (-v shows all)")


# Summaries and tables: names are bold, values that exceed a limit are coloured.

Marks = Mapping[str, str]
"""The severity ("error", "warning" or "info") of lines, by their names."""

MIN_WIDTH = 20
"""Values are wrapped to the width of the terminal, but never to fewer columns than this."""

REPORT_NAMES = 11
"""Width, in columns, of the names in the summary of a report."""

_LINES = {
    "--max-error": "error",
    "--max-time": "time",
    "--max-reversals": "reversals",
    "MANY_REVERSALS": "reversals",
    "END_NOT_REACHED": "ends",
    "ARC_MISSES_END": "ends",
}
"""The line of the summary that a gate, or the code of a finding, is about."""


def show_facts(text: str, name_width: int, marks: Marks, *, err: bool = False) -> None:
    """Show lines of a name and a value; the names are `name_width` wide."""
    if in_colour(sys.stderr if err else sys.stdout):
        import shutil

        columns = shutil.get_terminal_size().columns
        lines = text.split("\n")
        text = "\n".join(_line(line, name_width, marks, columns) for line in lines)
    show_text(text, err=err)


def show_compared(text: str, rows: Sequence[ContrastRow]) -> None:
    """Show the table of `--compare`: the variant with the least error green, endless ones red."""
    if in_colour(sys.stdout):
        head, *lines = text.split("\n")
        ends = [row.total_max_um for row in rows if not row.endless]
        min_error = min((error for error in ends if error is not None), default=None)
        shown = [
            _variant_line(line, row, min_error) for line, row in zip(lines, rows, strict=True)
        ]
        text = "\n".join([click.style(head, bold=True), *shown])
    show_text(text)


def report_marks(findings: Iterable[Finding]) -> dict[str, str]:
    """Return the severity of each line of the summary that findings are about, by the name of the
    line."""
    marks: dict[str, str] = {}
    for finding in sorted(findings, key=lambda finding: finding.severity):
        name = _LINES.get(finding.where) or _LINES.get(finding.code.name)
        if name is not None:
            marks[name] = finding.severity.name.lower()
    return marks


def _line(line: str, name_width: int, marks: Marks, columns: int) -> str:
    """Return a name and its value, with the value wrapped in its own column."""
    name, value = line[:name_width], line[name_width:]
    mark = marks.get(name.strip())
    colour = None if mark is None else COLOURS[mark]
    wide = max(columns - name_width, MIN_WIDTH)
    parts = textwrap.wrap(value, wide, break_long_words=False, break_on_hyphens=False)
    value = f"\n{' ' * name_width}".join(click.style(part, fg=colour) for part in parts)
    return f"{click.style(name.rstrip(), bold=True, fg=colour)}{name[len(name.rstrip()) :]}{value}"


def _variant_line(line: str, row: ContrastRow, min_error: float | None) -> str:
    if row.endless:
        return click.style(line, fg="red")
    best = min_error is not None and row.total_max_um == min_error
    return click.style(line, fg="green") if best else line
