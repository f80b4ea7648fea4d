"""A page as Markdown that fits the summary of a pipeline's job or a comment of a pull request.

Names come from drawings: whatever they hold, they are words here, neither mark-up nor a link, a
picture, a mention or a formula.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING
from urllib.parse import quote

from camtool.plain import one_line
from camtool.verify.page import setup_rows, shortened
from camtool.verify.sheets import sheets
from camtool.verify.wording import facts

if TYPE_CHECKING:
    from camtool.verify.page import Page
    from camtool.verify.sheets import Sheet

ROWS_SHOWN = 12
"""So many rows of each table go into Markdown; JSON holds them all."""

FINDINGS_SHOWN = 50
"""So many findings go into Markdown, the gravest first; JSON holds them all."""

PAGE_BYTES = 65_000
"""A page ends before it is longer: a comment on GitHub holds 65,536 characters, and a job's
summary 1 MiB, so that sixteen pages fit one."""

_MARKS = frozenset("\\`*_[]<>|#~$&!")
_BROKEN = {"@": "@<!-- -->", "://": ":<!-- -->//", "www.": "www<!-- -->."}
_GRAVEST_FIRST = {"error": 0, "warning": 1}


def markdown(page: Page) -> str:
    """The page, at most PAGE_BYTES long; a line at its end says so where something is left out."""
    kept: list[str] = []
    room = PAGE_BYTES
    for line in _lines(page):
        room -= len(line.encode(errors="replace")) + 1
        if room < 0:
            kept += ["", "*The rest is left out: the page would be too long.*"]
            break
        kept.append(line)
    return "\n".join(kept).rstrip() + "\n"


def plain(words: str) -> str:
    """One line that Markdown takes as words, and not too many of them."""
    line = shortened(one_line(words))
    escaped = "".join("\\" + sign if sign in _MARKS else sign for sign in line)
    for mark, broken in _BROKEN.items():
        escaped = escaped.replace(mark, broken)
    return escaped


def _lines(page: Page) -> Iterator[str]:
    yield f"# {plain(page.title)}"
    yield ""
    if page.report is not None:
        yield from (f"- **{name}:** {plain(value)}" for name, value in facts(page.report))
        yield ""
    for caption, address in page.pictures:
        yield f"![{plain(caption)}]({quote(address, errors='surrogateescape')})"
        yield ""
    yield from _findings(page)
    if page.report is not None:
        for sheet in sheets(page.report):
            yield from _table(sheet)
    if page.setup is not None:
        yield "| machine and settings | |"
        yield "|---|---|"
        yield from (
            f"| {plain(name)} | {plain(value)} |" for name, value in setup_rows(page.setup)
        )
        yield ""
    if page.report is not None:
        yield from (f"- assumed: {plain(words)}" for words in page.report.assumptions)


def _findings(page: Page) -> Iterator[str]:
    ordered = sorted(page.findings, key=lambda item: _GRAVEST_FIRST.get(item.severity, 2))
    for item in ordered[:FINDINGS_SHOWN]:
        place = f" ({plain(item.where)})" if item.where else ""
        yield f"- {item.severity} `{item.code}`{place}: {plain(item.message)}"
    if len(ordered) > FINDINGS_SHOWN:
        yield f"- and {len(ordered) - FINDINGS_SHOWN} more findings in the JSON report"
    if ordered:
        yield ""


def _table(sheet: Sheet) -> Iterator[str]:
    numbers = len(sheet.heads) - sheet.words
    yield f"| {' | '.join(sheet.heads)} |"
    yield "|" + "---|" * sheet.words + "---:|" * numbers
    for row in sheet.rows[:ROWS_SHOWN]:
        yield f"| {' | '.join(map(plain, row))} |"
    if len(sheet.rows) > ROWS_SHOWN:
        yield ""
        yield f"and {len(sheet.rows) - ROWS_SHOWN} more {sheet.noun} in the JSON report"
    yield ""
