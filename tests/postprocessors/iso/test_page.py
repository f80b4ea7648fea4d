"""docs/dialects/iso.md has every key of a dialect and no other, and each example is one; so
has the file that `camtool targets new` begins."""

import re
from pathlib import Path
from typing import get_type_hints

import msgspec
import pytest
from camtool_postprocessors.iso.dialect import ArcFormat, IsoDialect

from camtool.tables import parse_table
from camtool.target.registry import list_target
from camtool.target.template import machine_template
from tests.postprocessors.iso.tables import machine_with

PAGE = Path("docs/dialects/iso.md").read_text(encoding="utf-8")
TABLES = {
    name: kind
    for name, kind in get_type_hints(IsoDialect).items()
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct)
}


def rows_of(table: str) -> list[tuple[str, str]]:
    """(keys, examples) of the rows of a table of the page."""
    _, part = PAGE.split(f"## `[dialect.{table}]`", 1)
    part = part.split("\n## ", 1)[0]
    return re.findall(r"^\| (`\w.*?) \|.*\| (`.*`) \|$", part, re.MULTILINE)


@pytest.mark.parametrize("table", TABLES)
def test_the_page_has_every_key_and_no_other(table: str) -> None:
    keys = re.findall(r"`(\w+)`", " ".join(cell for cell, _ in rows_of(table)))
    assert sorted(keys) == sorted(TABLES[table].__struct_fields__)


@pytest.mark.parametrize("table", TABLES)
def test_each_key_has_an_example_that_is_taken(table: str) -> None:
    for keys, examples in rows_of(table):
        parsed = [parse_table(text) for text in re.findall(r"`(.*?)`(?:, |$)", examples)]
        assert [key for one in parsed for key in one] == re.findall(r"`(\w+)`", keys)
        for one in parsed:
            machine_with({table: one})


def test_a_new_file_shows_every_key_with_its_default() -> None:
    """Without the # before each line of its dialect, the file that `targets new` begins is the
    same dialect."""
    text = machine_template("made-up", "iso", list_target("iso").text)
    _, *parts = text.split("\n[dialect.")
    dialect = "".join("[" + part.split("\n[uncertainty", 1)[0] + "\n" for part in parts)
    tables = parse_table(re.sub(r"^# (?=\w+ = )", "", dialect, flags=re.MULTILINE))
    for name, kind in TABLES.items():
        assert sorted(tables[name]) == sorted(kind.__struct_fields__)
    assert tables["work_offsets_mm"] == {"G54": [0.0, 0.0, 0.0]}
    assert tables["arcs"].pop("max_sweep_deg") == ArcFormat().sweep_deg
    tables["work_offsets_mm"] = {}
    assert msgspec.convert(tables, IsoDialect) == IsoDialect()
