"""Lengths and feeds at the door."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.units import MM_PER_UNIT, parse_angle, parse_feed, parse_length, parse_time


@pytest.mark.parametrize(
    ("text", "mm"),
    [
        ("3", 3.0),
        ("-0.5", -0.5),
        ("0.2mm", 0.2),
        ("200 um", 0.2),
        ("200µm", 0.2),
        ("1/8in", 3.175),
        ('1/4"', 6.35),
        (".5cm", 5.0),
        ("1e-3 m", 1.0),
        ("96px", 25.4),
        ("4Q", 1.0),
    ],
)
def test_lengths(text: str, mm: float) -> None:
    assert parse_length(text) == pytest.approx(mm, rel=1e-12)


@pytest.mark.parametrize(
    "text", ["", "mm", "1,5", "nan", "inf", "1e999", "1/0in", "3 furlongs", "1 2", "0x10", "--1"]
)
def test_bad_lengths(text: str) -> None:
    with pytest.raises(OptionError):
        parse_length(text)


@given(st.floats(-1e6, 1e6), st.sampled_from(sorted(MM_PER_UNIT)))
def test_every_unit_multiplies(value: float, unit: str) -> None:
    expected = value * MM_PER_UNIT[unit]
    assert parse_length(f"{value!r}{unit}") == pytest.approx(expected, rel=1e-12, abs=1e-300)


@given(st.text(max_size=12))
def test_any_text_gives_a_finite_number_or_an_option_error(text: str) -> None:
    for parse in (parse_length, parse_feed, parse_angle, parse_time):
        try:
            value = parse(text)
        except OptionError:
            continue
        assert math.isfinite(value)


@pytest.mark.parametrize(
    ("text", "mm_min"), [("0.8", 0.8), ("0.8mm/min", 0.8), ("0.01 mm/s", 0.6), ("2in/min", 50.8)]
)
def test_feeds(text: str, mm_min: float) -> None:
    assert parse_feed(text) == pytest.approx(mm_min, rel=1e-12)


@pytest.mark.parametrize("text", ["fast", "0.8mm", "0.8/min", "0.8mm/h", "nan"])
def test_bad_feeds(text: str) -> None:
    with pytest.raises(OptionError):
        parse_feed(text)


@pytest.mark.parametrize(
    ("text", "rad"),
    [("90", math.pi / 2), ("90deg", math.pi / 2), ("-45°", -math.pi / 4), ("0.5 rad", 0.5)],
)
def test_angles(text: str, rad: float) -> None:
    assert parse_angle(text) == rad


@pytest.mark.parametrize(
    ("text", "seconds"), [("2", 2.0), ("0.5s", 0.5), ("200 ms", 0.2), ("1.5min", 90.0)]
)
def test_times(text: str, seconds: float) -> None:
    assert parse_time(text) == pytest.approx(seconds, rel=1e-15)


@pytest.mark.parametrize("text", ["right", "3mm", "3s", "nan", "", "inf"])
def test_bad_angles(text: str) -> None:
    with pytest.raises(OptionError):
        parse_angle(text)


@pytest.mark.parametrize("text", ["soon", "3mm", "3deg", "nan", "3d"])
def test_bad_times(text: str) -> None:
    with pytest.raises(OptionError):
        parse_time(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1/8", "'1/8' has no unit; write 1/8in, or 1/8mm"),
        ("3,175", "has a comma; write 3.175 with a point"),
        ("3,175 mm", "has a comma; write 3.175 mm with a point"),
    ],
)
def test_what_could_be_meant_in_two_ways_is_refused(text: str, words: str) -> None:
    with pytest.raises(OptionError) as refused:
        parse_length(text)
    assert words in str(refused.value)
