"""Labels drawn as strokes."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from camtool.pictures import text
from camtool.pictures.text import TextStyle
from tests.oracles import svg_page


def strokes_box(
    words: str, style: TextStyle, at: tuple[float, float] = (0.0, 0.0)
) -> tuple[float, float, float, float]:
    svg = text.label(words, at, style).replace("<g", f'<g xmlns="{svg_page.SVG[1:-1]}"', 1)
    root = svg_page.parse(svg)
    (found,) = svg_page.label_boxes(root).values()
    return found


def test_capitals_stand_on_the_baseline_and_are_as_high_as_asked() -> None:
    _, top, _, bottom = strokes_box("HTEF", TextStyle(cap=10.0), (5.0, 50.0))
    assert (top, bottom) == (40.0, 50.0)


@pytest.mark.parametrize(("anchor", "share"), [("start", 0.0), ("middle", 0.5), ("end", 1.0)])
def test_anchors_move_the_label_by_its_width(anchor: str, share: float) -> None:
    width = text.width("gear 12", 21.0)
    left, _, right, _ = strokes_box("gear 12", TextStyle(cap=21.0, anchor=anchor))
    assert left >= -share * width - 0.01
    assert right <= (1.0 - share) * width + 0.01
    assert right - left > 0.9 * width


def test_width_follows_the_size() -> None:
    assert text.width("0.5 mm", 20.0) == pytest.approx(2.0 * text.width("0.5 mm", 10.0))
    assert text.width("ab", 10.0) == pytest.approx(text.width("a", 10.0) + text.width("b", 10.0))
    assert text.width("a \n\t b", 10.0) == text.width("a b", 10.0)


@pytest.mark.parametrize("letter", list("µ×·°±øØ⌀…²³→—ñÁéîöçŠ"))
def test_signs_that_the_font_lacks_are_put_together(letter: str) -> None:
    assert text.label(letter, (0, 0), TextStyle()) != text.label("☃", (0, 0), TextStyle()).replace(
        "☃", letter
    )


def test_an_unknown_sign_is_a_box_but_keeps_its_name() -> None:
    svg = text.label("☃", (0.0, 0.0), TextStyle(cap=21.0))
    assert 'aria-label="☃"' in svg
    assert "<title>☃</title>" in svg
    assert strokes_box("☃", TextStyle(cap=21.0)) == (3.0, -21.0, 15.0, 0.0)


def test_accents_lie_above_their_letters() -> None:
    assert strokes_box("é", TextStyle(cap=21.0))[1] < strokes_box("e", TextStyle(cap=21.0))[1]
    assert strokes_box("É", TextStyle(cap=21.0))[1] < strokes_box("E", TextStyle(cap=21.0))[1]
    assert strokes_box("ç", TextStyle(cap=21.0))[3] > strokes_box("c", TextStyle(cap=21.0))[3]


def test_the_full_text_stays_when_the_shown_one_is_cut() -> None:
    svg = text.label("long…", (0.0, 0.0), TextStyle(), full_text="long name")
    assert 'aria-label="long name"' in svg


@given(st.text(max_size=60), st.floats(20.0, 400.0))
@example("0 µm", 31.0)
def test_shortened_and_wrapped_text_fits(words: str, limit: float) -> None:
    assert text.width(text.shortened(words, 13.0, limit), 13.0) <= limit
    lines = text.wrapped(words, 13.0, limit)
    assert all(text.width(line, 13.0) <= limit for line in lines)
    # A number and its unit are one word.
    if all(text.width(word, 13.0) <= limit for word in text._UNIT.split(" ".join(words.split()))):
        assert " ".join(lines) == " ".join(words.split())


def test_blank_text_has_no_strokes() -> None:
    assert "<path" not in text.label(" \n", (0.0, 0.0), TextStyle())


def test_a_unit_stays_with_its_number() -> None:
    words = "error 14.95 µm at most, 3 mm, about (1, 2) (µm) and 2:10 h"
    for limit in range(80, 700, 10):
        lines = text.wrapped(words, 13.0, float(limit))
        assert not any(line.lstrip("(").startswith(("µm", "mm", "h ")) for line in lines)
        assert " ".join(lines).count("…") or " ".join(lines) == words


def test_nothing_is_no_line() -> None:
    assert text.wrapped("", 13.0, 100.0) == text.wrapped(" \n ", 13.0, 100.0) == []
