"""Sections of the stock as pictures."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.pictures.colours import FEED, on_dark
from camtool.pictures.options import PictureOptions
from camtool.pictures.section import MAX_FACTOR, SHAPES, StockSection, height_factor, section_svg
from tests.oracles import svg_page

# A block of 40 × 4 mm with a slot from 10 to 16 mm, 1.5 mm deep, and one through it at 30 mm.
PROFILE = np.array(
    [[0, 0], [10, 0], [10, -1.5], [16, -1.5], [16, 0], [30, 0], [30, -4.2], [33, -4.2], [33, 0],
     [40, 0]], dtype=float,
)  # fmt: skip
BAND = np.array([[10.0, -1.6, -1.4], [16.0, -1.6, -1.4], [20.0, 0.0, math.inf], [40.0, 0.0, 0.0]])


def points(svg: str, name: str) -> list[Floats]:
    """The lines (n, 2) of a path, on the page."""
    found = re.search(rf'<path id="{name}" d="([^"]*)"', svg)
    assert found is not None
    parts = found[1].replace("Z", "").split("M")[1:]
    return [
        np.array([list(map(float, pair.split())) for pair in part.split("L")]) for part in parts
    ]


def spoken(svg: str) -> list[str]:
    return re.findall(r'aria-label="([^"]*)"', svg)


def test_heights_and_places_have_the_scales_that_the_picture_says() -> None:
    svg = section_svg("a slot", StockSection("y", 12.0, PROFILE, -4.0, BAND))
    (surface,) = points(svg, "surface")
    per_mm = (surface[-1, 0] - surface[0, 0]) / 40.0
    assert (surface[:, 0] - surface[0, 0]) / per_mm == pytest.approx(PROFILE[:, 0], abs=0.01)
    (factor,) = (float(x) for x in re.findall(r"heights are drawn (\S+) times as large", svg)[:1])
    depths = (surface[:, 1] - surface[0, 1]) / per_mm / factor
    assert depths == pytest.approx(-PROFILE[:, 1], abs=0.01)
    (material,) = points(svg, "material")
    assert material[:, 1].max() - surface[0, 1] == pytest.approx(4.0 * per_mm * factor, abs=0.1)
    assert "section at Y 12 mm; cut 4.2 mm deep" in spoken(svg)
    assert {"X (mm)", "Z (mm)", "stock", "wanted heights"} <= {*spoken(svg)}
    bars = [label for label in spoken(svg) if re.fullmatch(r"\d+ mm", label)]
    assert bars == ["5 mm"] or bars == ["10 mm"]


def test_wanted_heights_are_interrupted_where_there_is_no_limit() -> None:
    svg = section_svg("a slot", StockSection("y", 12.0, PROFILE, -4.0, BAND))
    assert [len(part) for part in points(svg, "wanted")] == [4, 2, 1]
    bare = section_svg("a slot", StockSection("x", 12.0, PROFILE))
    assert 'id="wanted"' not in bare
    assert {"Y (mm)", "section at X 12 mm; cut 4.2 mm deep"} <= {*spoken(bare)}


def test_equal_sections_give_equal_bytes_in_both_palettes() -> None:
    section = StockSection("y", 12.0, PROFILE, -4.0, BAND)
    assert section_svg("a", section) == section_svg("a", section)
    dark = section_svg("a", section, PictureOptions(dark=True))
    assert on_dark(FEED) in dark
    assert FEED not in dark
    svg_page.parse(dark)


def test_a_stock_that_is_not_cut_has_a_section_too() -> None:
    flat = np.array([[0.0, 0.0], [10.0, 0.0]])
    assert "section at Y 0 mm; not cut" in spoken(
        section_svg("none", StockSection("y", 0.0, flat))
    )
    with pytest.raises(ValueError, match="two places"):
        section_svg("none", StockSection("y", 0.0, flat[:1]))


@given(length=st.floats(1e-3, 1e4), height=st.floats(1e-3, 1e3))
def test_the_factor_of_heights_is_round_and_large_enough(length: float, height: float) -> None:
    factor = height_factor(length, height)
    assert 1.0 <= factor <= MAX_FACTOR
    assert float(f"{factor:.0e}"[0]) in (1.0, 2.0, 5.0)
    if factor < MAX_FACTOR:
        assert 1.3 * height * factor >= 0.999 * SHAPES[0] * length
