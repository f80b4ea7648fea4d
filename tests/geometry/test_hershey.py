"""Single-stroke letters."""

import pytest

from camtool.geometry.hershey import BASELINE, BOX, CAP_UNITS, glyph


def heights(letter: str) -> tuple[float, float]:
    """Lowest and highest y above the baseline, in heights of a capital."""
    found = glyph(letter)
    assert found is not None
    ys = [(BASELINE - y) / CAP_UNITS for stroke in found.strokes for _, y in stroke]
    return min(ys), max(ys)


@pytest.mark.parametrize("letter", "ABDEFHIKLMNPRTXYZ")
def test_capitals_stand_on_the_baseline_and_reach_one(letter: str) -> None:
    assert heights(letter) == (0.0, 1.0)


@pytest.mark.parametrize("letter", "gpqy")
def test_tails_hang_a_third_below(letter: str) -> None:
    assert heights(letter)[0] == pytest.approx(-1.0 / 3.0)


@pytest.mark.parametrize("letter", [chr(code) for code in range(33, 127)])
def test_every_printable_sign_has_strokes_within_its_width(letter: str) -> None:
    found = glyph(letter)
    assert found is not None
    assert found.strokes
    assert all(len(stroke) >= 2 for stroke in found.strokes)
    xs = [x for stroke in found.strokes for x, _ in stroke]
    assert min(xs) >= 0.0
    assert max(xs) <= found.advance


@pytest.mark.parametrize("letter", list("µμ×·•°±øØ⌀…²³→—–−“é"))
def test_signs_of_drawings_are_there(letter: str) -> None:
    assert glyph(letter) not in (None, BOX)


@pytest.mark.parametrize("letter", ["☃", "中", "\x07", "\ud800", "\u0301"])
def test_unknown_signs_are_none_not_a_box(letter: str) -> None:
    assert glyph(letter) is None


def test_a_blank_has_width_and_no_strokes() -> None:
    blank = glyph(" ")
    assert blank is not None
    assert blank.strokes == ()
    assert blank.advance > 0.0
