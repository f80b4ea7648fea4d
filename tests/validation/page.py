"""The tables of docs/validation.md: written by tests (`--bless`), compared with what comes out.

A table stands between `<!-- NAME -->` and `<!-- end -->`. Words of its cells must be the same;
numbers may differ by two of their last place, which another computer's sines may turn over.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "validation.md"
NUMBER = re.compile(r"(?<![\w.])[-+−]?\d+(?:\.\d+)?")
LAST_PLACES = 2.0

Rows = Sequence[Sequence[str]]


def check(
    name: str,
    heads: Sequence[str],
    rows: Rows,
    bless: bool,
    places: float = LAST_PLACES,
    scatter: Mapping[tuple[str, str], float] | None = None,
) -> None:
    """The table `name` of the page is this one, but for so many of the last places, or for those
    of `scatter` in the cells that it names by row, or "" for all rows, and head; with `bless` it
    becomes it."""
    page = PAGE.read_text(encoding="utf-8")
    text = _table(heads, rows)
    begin, end = f"<!-- {name} -->\n", "<!-- end -->"
    assert page.count(begin) == 1, f"docs/validation.md has no place for {name}"
    before, _, rest = page.partition(begin)
    held, _, after = rest.partition(end)
    if bless:
        PAGE.write_text(before + begin + text + end + after, encoding="utf-8")
        return
    again = f"pytest --bless tests/validation writes {name} anew"
    lines = zip(held.splitlines(), text.splitlines(), strict=False)
    for line, wanted in lines:
        row, told = wanted.split("|")[1].strip(), f"{line}\n{wanted}\n{again}"
        assert line.count("|") == wanted.count("|"), told
        for head, *cells in zip(["", *heads, ""], line.split("|"), wanted.split("|"), strict=True):
            more = scatter or {}
            assert same(*cells, more.get((row, head), more.get(("", head), places))), told
    assert len(held.splitlines()) == len(text.splitlines()), again


def same(line: str, wanted: str, last: float = LAST_PLACES) -> bool:
    """True if two lines of a table agree within the last digit."""
    if NUMBER.sub("#", line) != NUMBER.sub("#", wanted):
        return False
    pairs = zip(NUMBER.findall(line), NUMBER.findall(wanted), strict=True)
    return all(_near(one, other, last) for one, other in pairs)


def _near(one: str, other: str, last: float) -> bool:
    places = len(one.partition(".")[2])
    if places != len(other.partition(".")[2]):
        return False
    if not places:
        return one == other  # counts and lines of a thesis
    apart = abs(float(one.replace("−", "-")) - float(other.replace("−", "-")))
    return bool(apart < (last + 0.5) * 0.1**places)


def _table(heads: Sequence[str], rows: Rows) -> str:
    """Markdown; columns of numbers to the right."""
    cells = [list(heads), ["---:" if _right(rows, k) else "---" for k in range(len(heads))]]
    lines = ["| " + " | ".join(row) + " |" for row in [*cells, *rows]]
    return "\n".join(lines) + "\n"


def _right(rows: Rows, column: int) -> bool:
    """True if a column holds nothing but numbers."""
    held = [row[column] for row in rows if row[column] not in ("", "–")]
    return bool(held) and all(NUMBER.fullmatch(text) for text in held)


def mm(value: float, places: int = 3) -> str:
    """A length."""
    return f"{value:.{places}f}"


def signed(value: float, places: int = 1) -> str:
    """A difference, with its sign: "−11.0", "+3.5"."""
    text = f"{value:+.{places}f}".replace("-", "−")
    return text[1:] if float(text.replace("−", "-")) == 0.0 else text
