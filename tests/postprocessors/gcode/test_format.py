"""Numbers and comments as the writers of G-code say them."""

import numpy as np
import pytest
from camtool_postprocessors.gcode.format import (
    COMMENT_CHARS,
    NumberStyle,
    check_length,
    comment,
    format_column,
    format_number,
    units_of,
    values_of,
)
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import PostError

numbers = st.floats(-1e5, 1e5)


@pytest.mark.parametrize(
    ("value", "style", "text"),
    [
        (1.5, NumberStyle(3), "1.500"),
        (1.5, NumberStyle(3, strip=True), "1.5"),
        (100.0, NumberStyle(3, strip=True), "100"),
        (100.0, NumberStyle(0), "100"),
        (100.0, NumberStyle(0, strip=True), "100"),
        (-0.0004, NumberStyle(3), "0.000"),
        (-0.0, NumberStyle(3, strip=True), "0"),
        (0.0005, NumberStyle(3), "0.001"),
        (-0.0005, NumberStyle(3), "-0.001"),
        (12345.6789, NumberStyle(4), "12345.6789"),
    ],
)
def test_a_number(value: float, style: NumberStyle, text: str) -> None:
    assert format_number(value, style) == text


@given(st.lists(numbers, max_size=20), st.integers(0, 6), st.booleans())
def test_a_column_says_what_units_mean(values: list[float], decimals: int, strip: bool) -> None:
    column = np.array(values, dtype=np.float64)
    texts = format_column(column, NumberStyle(decimals, strip=strip))
    units = units_of(column, decimals)
    assert [float(text) for text in texts] == values_of(units, decimals).tolist()
    assert np.abs(np.array(units) - column * 10.0**decimals).max(initial=0.0) <= 0.5 + 1e-6
    for text in texts:
        assert float(text) != 0.0 or not text.startswith("-")
        assert "e" not in text
        if not strip and decimals:
            assert len(text.split(".")[1]) == decimals


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, 1e300])
def test_no_text_for_what_is_no_number(value: float) -> None:
    with pytest.raises(ValueError, match="not finite, or too large"):
        format_column(np.array([1.0, value]), NumberStyle(3))


def test_an_empty_column_is_no_text() -> None:
    assert format_column(np.empty(0), NumberStyle(3)) == []


@pytest.mark.parametrize(
    ("text", "safe"),
    [
        ("logo (v2).dxf", "logo _v2_.dxf"),
        ("a)\nG0 Z-50\n(b", "a_ G0 Z-50 _b"),
        ("x ; M3 % end", "x _ M3 _ end"),
        ("MSG,stop", "MSG_stop"),
        ("ärger\x00\x18", "_rger__"),
        ("!~?$#[1]", "______1_"),
        ("  a \t b  ", "a b"),
        ("", ""),
    ],
)
def test_a_text_that_cannot_command(text: str, safe: str) -> None:
    assert comment(text) == f"({safe})"


@given(st.text(max_size=200))
def test_no_text_ends_its_comment(text: str) -> None:
    said = comment(text)
    assert len(said) <= COMMENT_CHARS + 2
    assert said.isascii()
    assert said.isprintable()
    assert not set(said[1:-1]) & set("();%,$!?~#[]<>\"'\n\r")


def test_the_first_line_that_is_too_long() -> None:
    with pytest.raises(
        PostError, match=r"a line of 6 characters, the controller takes 5"
    ) as raised:
        check_length(b"aaaaa\nbbbbbb\nccccccc\n", 5, "line", "")
    assert raised.value.where == "line 2"
    check_length(b"aaaaa\n", 5, "line", "")
