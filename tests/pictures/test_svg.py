"""Numbers, escaping, elements and path data."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.pictures.svg import PathData, clean, element, escape, number, one_line, title
from tests.oracles import svg_page


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [
        (0.0, 2, "0"),
        (-0.0, 2, "0"),
        (-0.004, 2, "0"),
        (0.005001, 2, "0.01"),
        (100.0, 0, "100"),
        (100.0, 2, "100"),
        (-2.50, 2, "-2.5"),
        (1e-7, 9, "0.0000001"),
        (123456789.125, 9, "123456789.125"),
    ],
)
def test_numbers_are_short_and_never_scientific(value: float, decimals: int, text: str) -> None:
    assert number(value, decimals) == text


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="cannot be drawn"):
        number(value)


@given(st.text())
def test_text_survives_as_attribute_and_as_title(text: str) -> None:
    svg = element("g", {"xmlns": "http://www.w3.org/2000/svg", "aria-label": text}, title(text))
    root = svg_page.parse(svg)
    assert root.get("aria-label") == clean(text)
    assert (root[0].text or "") == clean(text)


def test_what_xml_cannot_hold_is_replaced() -> None:
    assert clean("a\x00\x1f\ud800\ufffe\t\n") == "a" + "\ufffd" * 4 + "\t\n"
    assert escape("<&>\"'\n") == "&lt;&amp;&gt;&quot;'&#10;"
    assert one_line(" a \n b\t") == "a b"


@pytest.mark.parametrize(
    ("sweep", "flags"),
    [(0.5, "0 1"), (-0.5, "0 0"), (math.pi + 0.1, "1 1"), (-math.pi - 0.1, "1 0")],
)
def test_flags_of_arcs(sweep: float, flags: str) -> None:
    data = PathData()
    data.move(1.0, 0.0)
    data.arc(0.0, 1.0, radius=1.0, sweep_rad=sweep)
    assert str(data) == f"M1 0A1 1 0 {flags} 0 1"
