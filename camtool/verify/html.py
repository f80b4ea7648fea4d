"""A page as one HTML file that needs nothing else: no scripts, no network, nothing to fetch.

Its pictures are data addresses, so that whatever an SVG holds can neither run nor load anything,
and its policy forbids both besides.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING

from camtool.plain import one_line
from camtool.verify.page import setup_rows, shortened
from camtool.verify.sheets import sheets
from camtool.verify.wording import facts

if TYPE_CHECKING:
    from camtool.verify.page import Page
    from camtool.verify.sheets import Sheet

ROWS_SHOWN = 500
"""So many rows of each table and so many findings go into a page of HTML; JSON holds them all."""

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"

_STYLE = """
:root { color-scheme: light dark; font: 15px/1.5 system-ui, sans-serif; }
body { margin: 2rem auto; max-width: 62rem; padding: 0 1rem; overflow-wrap: anywhere; }
table { border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid #8886; padding: .2rem .7rem; text-align: left;
  vertical-align: top; }
td.number, th.number { text-align: right; }
img { max-width: 100%; height: auto; background: #fff; }
figure { margin: 1rem 0; } figcaption { opacity: .7; }
.error { color: #c5221f; } .warning { color: #a56300; } .fine { color: #2c7a32; }
@media (prefers-color-scheme: dark) {
  .error { color: #ff8a80; } .warning { color: #ffc266; } .fine { color: #8fd694; } }
@media print { body { margin: 0; max-width: none; } }
"""


def html(page: Page) -> str:
    """The page as a whole HTML document."""
    return "\n".join(_lines(page)) + "\n"


def _words(text: str) -> str:
    return escape(shortened(one_line(text)), quote=True)


def _lines(page: Page) -> Iterator[str]:
    title = _words(page.title)
    yield '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">'
    yield f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>{title}</title>\n<style>{_STYLE}</style>\n</head>\n<body>"
    yield f'<h1>{title} <small class="{page.verdict}">{page.verdict}</small></h1>'
    if page.report is not None:
        yield from _pairs(tuple(facts(page.report)))
    for caption, address in page.pictures:
        yield f'<figure><img src="{escape(address, quote=True)}" alt="{_words(caption)}">'
        yield f"<figcaption>{_words(caption)}</figcaption></figure>"
    yield from _findings(page)
    if page.report is not None:
        for sheet in sheets(page.report):
            yield from _table(sheet)
    if page.setup is not None:
        yield "<h2>Machine and settings</h2>"
        yield from _pairs(setup_rows(page.setup))
    if page.report is not None and page.report.assumptions:
        yield "<h2>Assumptions</h2>\n<ul>"
        yield from (f"<li>{_words(words)}</li>" for words in page.report.assumptions)
        yield "</ul>"
    yield "</body>\n</html>"


def _pairs(rows: tuple[tuple[str, str], ...]) -> Iterator[str]:
    yield "<table>"
    for name, value in rows:
        yield f'<tr><th scope="row">{_words(name)}</th><td>{_words(value)}</td></tr>'
    yield "</table>"


def _findings(page: Page) -> Iterator[str]:
    if not page.findings:
        return
    yield "<h2>Findings</h2>\n<ul>"
    for item in page.findings[:ROWS_SHOWN]:
        place = f" ({_words(item.where)})" if item.where else ""
        head = f'<span class="{_words(item.severity)}">{_words(item.severity)}</span>'
        yield f"<li>{head} <code>{_words(item.code)}</code>{place}: {_words(item.message)}</li>"
    yield "</ul>"
    yield from _more(len(page.findings), "findings")


def _table(sheet: Sheet) -> Iterator[str]:
    kinds = ["" if n < sheet.words else ' class="number"' for n in range(len(sheet.heads))]
    heads = zip(kinds, sheet.heads, strict=True)
    yield "<table>\n<thead><tr>"
    yield "".join(f'<th scope="col"{kind}>{_words(head)}</th>' for kind, head in heads)
    yield "</tr></thead>\n<tbody>"
    for row in sheet.rows[:ROWS_SHOWN]:
        cells = zip(kinds, row, strict=True)
        yield f"<tr>{''.join(f'<td{kind}>{_words(cell)}</td>' for kind, cell in cells)}</tr>"
    yield "</tbody>\n</table>"
    yield from _more(len(sheet.rows), sheet.noun)


def _more(count: int, noun: str) -> Iterator[str]:
    if count > ROWS_SHOWN:
        yield f"<p>and {count - ROWS_SHOWN} more {noun} in the JSON report</p>"
