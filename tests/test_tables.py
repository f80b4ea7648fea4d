"""Tables as text: what is written is read as the same."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from camtool.tables import parse_table, toml_lines, toml_string

texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
numbers = st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False, allow_infinity=False)
plain = st.booleans() | numbers | texts
values = plain | st.lists(plain, max_size=3)
tables = st.dictionaries(texts, values | st.dictionaries(texts, values, max_size=2), max_size=4)
rows = st.lists(tables, min_size=1, max_size=3)
whole = st.dictionaries(texts, tables | rows | values, max_size=4)


@given(whole)
def test_tables_are_read_as_they_were_written(table: dict[str, Any]) -> None:
    assert parse_table("\n".join(toml_lines(table))) == table


def test_notes_stand_behind_their_values() -> None:
    table = {"a": 1, "t": {"b": 0.5}, "rows": [{"c": {"d": True}}]}
    notes = {"a": "one", "t.b": "a half", "rows.c": "a table"}
    lines = list(toml_lines(table, notes))
    assert lines == [
        "a = 1    # one",
        "",
        "[t]",
        "b = 0.5    # a half",
        "",
        "[[rows]]",
        "c = {d = true}    # a table",
    ]
    assert parse_table("\n".join(lines)) == table


@given(st.text())
def test_any_text_stands_in_quotes(text: str) -> None:
    found = parse_table(f"a = {toml_string(text)}")["a"]
    assert len(found) == len(text)
    assert all(
        a == b or (b == "?" and 0xD800 <= ord(a) < 0xE000)
        for a, b in zip(text, found, strict=True)
    )
