"""MTEXT as curves: lines, codes, columns."""

import math
import re
from typing import Any

import ezdxf
import numpy as np
import pytest
from ezdxf.entities.mtext import MTextColumns
from ezdxf.math import Matrix44
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.importers.dxf.text import TextShape, text_strokes
from camtool.importers.pieces import Unusable

PITCH = 5.0 / 3.0


def new_mtext(words: str, **attributes: Any) -> Any:
    """An MTEXT in strokes, 3 high, at (10, 20), hanging from its top left corner."""
    document = ezdxf.new()
    document.styles.add("plain", font="txt")
    said = {"style": "plain", "char_height": 3.0, "insert": (10.0, 20.0)} | attributes
    return document.modelspace().add_mtext(words, dxfattribs=said)


def points(shape: TextShape) -> Floats:
    return np.concatenate([part for contour in shape.contours for part in contour.parts])


def drawn(words: str, **attributes: Any) -> Floats:
    return points(text_strokes(new_mtext(words, **attributes), "stroke"))


def along(x: float) -> Floats:
    """A shift to the right."""
    return np.array([x, 0.0, 0.0])


def baselines(words: str, **attributes: Any) -> list[float]:
    """The bottoms of an MTEXT made of "H" and "I" alone, from the top down."""
    shape = text_strokes(new_mtext(words, **attributes), "stroke")
    bottoms = {
        round(float(min(part[:, 1].min() for part in contour.parts)), 9)
        for contour in shape.contours
        if np.ptp(np.concatenate(contour.parts)[:, 1]) > 0.0
    }
    return sorted(bottoms, reverse=True)


def test_lines_hang_below_each_other_by_the_line_spacing() -> None:
    assert baselines(r"HI\PHI\PHI") == pytest.approx([17.0, 12.0, 7.0])
    assert baselines(r"HI\PHI", line_spacing_factor=1.5) == pytest.approx([17.0, 9.5])
    assert baselines(r"HI\P\PHI") == pytest.approx([17.0, 7.0])
    assert baselines("HI\nHI") == pytest.approx([17.0, 12.0])
    assert baselines("HI^JHI") == pytest.approx([17.0, 12.0])


def test_larger_letters_take_more_room_unless_spacing_is_exact() -> None:
    large = r"HI\P{\H2x;HI}\PHI"
    second = 17.0 - (PITCH * 3.0 - 3.0 + 6.0)
    assert baselines(large) == pytest.approx([17.0, second, second - (PITCH * 6.0 - 6.0 + 3.0)])
    assert baselines(large, line_spacing_style=2) == pytest.approx([17.0, 12.0, 7.0])


def test_a_line_of_mtext_is_a_line_of_text() -> None:
    mtext = drawn("Handle 12", attachment_point=1)
    document = ezdxf.new()
    text = document.modelspace().add_text("Handle 12", height=3.0)
    text.dxf.insert = (10.0, 17.0)
    assert mtext == pytest.approx(points(text_strokes(text, "stroke")))


@pytest.mark.parametrize("width", [0.0, 100.0])
@pytest.mark.parametrize("point", range(1, 10))
def test_attachment_points(point: int, width: float) -> None:
    found = drawn(r"HHH\PHHH", attachment_point=point, width=width)
    plain = drawn(r"HHH\PHHH", attachment_point=1)
    row, column = divmod(point - 1, 3)
    bearing = float(plain[:, 0].min() - 10.0)
    size = float(np.ptp(plain[:, 0])) + 2.0 * bearing  # an H has equal room on both sides
    shift = (-0.5 * column * size, 0.5 * row * (3.0 + PITCH * 3.0), 0.0)
    assert found == pytest.approx(plain + shift)


def test_words_wrap_at_the_width() -> None:
    words = "HI HI HI HI"
    pair = float(np.ptp(drawn("HI HI")[:, 0]))
    assert len(baselines(words, width=0.0)) == 1
    assert len(baselines(words, width=1.2 * pair)) == 2
    assert len(baselines(words, width=0.9 * pair)) == 4
    assert len(baselines(words.replace(" ", r"\~"), width=0.9 * pair)) == 1
    assert len(baselines("HIHIHIHI", width=0.5 * pair)) == 1
    assert np.ptp(drawn(words, width=1.2 * pair)[:, 0]) == pytest.approx(pair)


def test_paragraphs_align_as_they_say() -> None:
    left, centre, right = (drawn(rf"\pq{c};H", width=50.0) for c in "lcr")
    wide = 50.0 - (left[:, 0].max() + left[:, 0].min() - 20.0)
    assert centre == pytest.approx(left + along(0.5 * wide))
    assert right == pytest.approx(left + along(wide))
    assert drawn("H", width=50.0) == pytest.approx(left)


def test_justified_lines_reach_both_edges_but_not_the_last() -> None:
    found = drawn(r"\pqj;HI HI HI HI", width=20.0)
    first, last = found[found[:, 1] > 16.9], found[found[:, 1] < 15.0]
    single = drawn("H")
    bearing = float(single[:, 0].min()) - 10.0
    assert first[:, 0].min() == pytest.approx(10.0 + bearing)
    assert 30.0 - first[:, 0].max() == pytest.approx(bearing)  # an I has the same as an H
    assert last[:, 0].max() < 16.0


def test_indents_and_tabs() -> None:
    assert (drawn(r"\pi2,l0;H") - drawn("H"))[:, 0] == pytest.approx(6.0)
    tabbed, plain = drawn("^IH"), drawn("H")
    assert tabbed == pytest.approx(plain + along(12.0))
    assert drawn(r"\pt5;^IH") == pytest.approx(plain + along(15.0))
    right = drawn(r"\ptr5;^IH")
    assert right[:, 0].max() < 25.0
    assert right[:, 0].max() > 24.0


@pytest.mark.parametrize(
    ("coded", "shown"),
    [
        ("%%c12", "Ø12"),
        (r"45%%d", "45°"),
        (r"%%065", "A"),
        (r"A%%123B\P%%092", r"A\{B\P\\"),
        (r"x^3", r"x^ 3"),
        (r"{\C1;a}b", "ab"),
        (r"{\fArial|b1|i0|c0|p34;a}b", "ab"),
        (r"\Ftxt.shx;ab", "ab"),
        (r"a\{b\}\\", r"\Q0;a\{b\}\\"),
        (r"\H3;a", "a"),
        (r"\S1^2;", r"\S1^ 2;"),
        (r"{{{a", "a"),
        ("a}}", "a"),
    ],
)
def test_codes_in_the_text(coded: str, shown: str) -> None:
    assert drawn(coded) == pytest.approx(drawn(shown))


@pytest.mark.parametrize(("code", "lift"), [("0", 0.0), ("1", 0.75), ("2", 1.5)])
def test_smaller_letters_stand_low_in_the_middle_or_high(code: str, lift: float) -> None:
    lines = baselines(rf"H{{\H0.5x;\A{code};H}}")
    assert lines == pytest.approx(sorted({17.0, 17.0 + lift}, reverse=True))


def test_height_width_slant_and_tracking_codes() -> None:
    corner = np.array([10.0, 20.0, 0.0])
    plain = drawn("HA") - corner
    assert drawn(r"\H6;HA") - corner == pytest.approx(2.0 * plain)
    assert drawn(r"\H2x;HA") - corner == pytest.approx(2.0 * plain)
    assert drawn(r"\W2;HA") - corner == pytest.approx(plain * (2.0, 1.0, 1.0))
    slanted = plain + np.column_stack(
        [math.tan(math.radians(15.0)) * (plain[:, 1] + 3.0), np.zeros((len(plain), 2))]
    )
    assert drawn(r"\Q15;HA") - corner == pytest.approx(slanted)
    assert np.ptp(drawn(r"\T2;HA")[:, 0]) > 1.3 * np.ptp(plain[:, 0])


@pytest.mark.parametrize(("bar", "lines"), [("/", 1), ("#", 1), ("^ ", 0)])
def test_stacked_fractions_are_readable(bar: str, lines: int) -> None:
    """Numerator above the denominator, nothing crossing."""
    shape = text_strokes(new_mtext(rf"\S11{bar}44;"), "stroke")
    ones = text_strokes(new_mtext("11"), "stroke").contours
    fours = text_strokes(new_mtext("44"), "stroke").contours
    assert len(shape.contours) == len(ones) + len(fours) + lines
    above = np.concatenate([p for c in shape.contours[: len(ones)] for p in c.parts])
    below = np.concatenate(
        [p for c in shape.contours[len(ones) : len(ones) + len(fours)] for p in c.parts]
    )
    assert above[:, 1].min() >= below[:, 1].max()
    assert below[:, 1].max() - below[:, 1].min() == pytest.approx(3.0)
    if lines:
        (bar_part,) = shape.contours[-1].parts
        middle = 0.5 * (above[:, 1].min() + below[:, 1].max())
        assert bar_part[:, 1].mean() == pytest.approx(middle)


def test_an_underline_is_one_line_over_many_words() -> None:
    plain = text_strokes(new_mtext("a b c d e"), "stroke").contours
    shape = text_strokes(new_mtext(r"a \Lb c d\l e"), "stroke")
    assert len(shape.contours) == len(plain) + 1
    (line,) = (c.parts[0] for c in shape.contours if np.ptp(c.parts[0][:, 0]) > 6.0)
    assert line[:, 1] == pytest.approx([17.0 - 0.6, 17.0 - 0.6])


def in_columns(text: str, count: int, height: float) -> np.ndarray:
    """Return the points (n, 2) of a text in columns of 30 with gaps of 5 between them."""
    mtext = (
        ezdxf.new()
        .modelspace()
        .add_mtext(text, dxfattribs={"char_height": 3.0, "insert": (0.0, 0.0)})
    )
    columns = MTextColumns.new_static_columns(
        count=count, width=30.0, gutter_width=5.0, height=height
    )
    mtext.setup_columns(columns)
    return points(text_strokes(mtext, "stroke"))


def test_columns_fill_one_after_the_other() -> None:
    found = in_columns(r"HI\PHI\PHI\PHI", count=2, height=8.0)
    left, right = found[found[:, 0] < 30.0], found[found[:, 0] >= 30.0]
    assert len(left) == len(right)
    assert right == pytest.approx(left + along(35.0))


def test_a_column_break_begins_the_next_column() -> None:
    each = np.split(in_columns(r"HI\NHI\NHI", count=3, height=90.0), 3)
    assert each[1] == pytest.approx(each[0] + along(35.0))
    assert each[2] == pytest.approx(each[0] + along(70.0))


@given(
    angle=st.floats(-360.0, 360.0),
    shift=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-10.0, 10.0)),
    point=st.integers(1, 9),
)
def test_a_moved_and_turned_entity_gives_curves_moved_alike(
    angle: float, shift: tuple[float, float, float], point: int
) -> None:
    mtext = new_mtext(r"Ag \S1/2;\P{\H2x;4}", attachment_point=point, rotation=20.0)
    before = points(text_strokes(mtext, "stroke"))
    matrix = Matrix44.z_rotate(math.radians(angle)) @ Matrix44.translate(*shift)
    mtext.transform(matrix)
    wanted = np.array([tuple(matrix.transform(tuple(p))) for p in before])
    assert np.abs(points(text_strokes(mtext, "stroke")) - wanted).max() < 1e-6


def test_text_seen_from_below_is_mirrored() -> None:
    corner = np.array([10.0, 20.0, 0.0])
    above = drawn("Ag") - corner
    below = drawn("Ag", extrusion=(0.0, 0.0, -1.0), text_direction=(1.0, 0.0, 0.0)) - corner
    assert below == pytest.approx(above * (1.0, -1.0, 1.0))


def test_attributes_of_many_lines() -> None:
    document = ezdxf.new()
    block = document.blocks.new("part")
    insert = document.modelspace().add_blockref("part", (0.0, 0.0))
    attribute = insert.add_attrib("NOTE", "HI")
    plain = document.modelspace().add_mtext(
        r"HI\PHI", dxfattribs={"char_height": 3.0, "insert": (10.0, 20.0)}
    )
    attribute.set_mtext(plain)
    assert block is not None
    assert points(text_strokes(attribute, "stroke")) == pytest.approx(
        points(text_strokes(plain, "stroke"))
    )


def test_fonts_are_named() -> None:
    shape = text_strokes(new_mtext(r"a{\fNowhere|b1;b}"), "stroke")
    assert shape.font == "Hershey Roman simplex"
    assert shape.substituted == ""
    assert text_strokes(new_mtext("a"), "outline").substituted == "txt"


def test_what_the_font_lacks_is_named() -> None:
    assert text_strokes(new_mtext(r"a中\P\S中/2;"), "stroke").missing == "中中"


@pytest.mark.parametrize(
    ("words", "attributes", "why"),
    [
        ("", {}, "empty"),
        (r"  \P ", {}, "empty"),
        (r"\H0;a", {}, "no size"),
        (r"\H1e400;a", {}, "not finite or too large"),
        (r"\S1\ ".strip(), {}, "codes in its text"),
        ("a" * 20_001, {}, "more than 20000"),
        ("a", {"char_height": math.inf}, "not finite or too large"),
        ("a", {"char_height": 0.0}, "no size"),
        ("a", {"width": math.nan}, "not finite or too large"),
        ("a", {"line_spacing_factor": math.nan}, "not finite or too large"),
        ("a", {"rotation": math.nan}, "not finite or too large"),
        ("a", {"insert": (0.0, math.inf)}, "not finite or too large"),
        ("a", {"text_direction": (0.0, 0.0, 0.0)}, "no direction"),
        ("a", {"text_direction": (0.0, 0.0, 1.0)}, "no direction"),
    ],
)
def test_what_cannot_be_laid_out_is_told(words: str, attributes: dict[str, Any], why: str) -> None:
    mtext = new_mtext("a")
    mtext.text = words
    for name, value in attributes.items():
        mtext.dxf.unprotected_set(
            name, ezdxf.math.Vec3(value) if isinstance(value, tuple) else value
        )
    with pytest.raises(Unusable, match=re.escape(why)):
        text_strokes(mtext, "stroke")


CODES = (
    r"\P \S \S1/2; \H 2x; \p q c, \f \T \Q \N \C999; \A7; \U+0041 1e999 -3 %%c %%300 ^I ^J \L 中"
)
PIECES = st.sampled_from([*CODES.split(), *"aH1 ;{}\\^|%", "^ ", "\n"])


@given(st.lists(PIECES, max_size=30).map("".join), st.floats(0.0, 100.0), st.integers(1, 9))
def test_any_codes_are_laid_out_or_refused(words: str, width: float, point: int) -> None:
    mtext = new_mtext("a", width=width, attachment_point=point)
    mtext.text = words
    for mode in ("stroke", "outline"):
        try:
            shape = text_strokes(mtext, mode)
        except Unusable:
            continue
        for contour in shape.contours:
            assert all(np.isfinite(part).all() for part in contour.parts)
