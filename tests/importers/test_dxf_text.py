"""TEXT, ATTRIB and ATTDEF as curves."""

import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from ezdxf.enums import TextEntityAlignment as Align
from ezdxf.math import Matrix44
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.importers import text as text_fonts
from camtool.importers.dxf.text import TextShape, text_strokes
from camtool.importers.findings import DrawingCode
from camtool.importers.options import ReadOptions
from camtool.importers.pieces import Unusable
from camtool.importers.read import read_drawing
from camtool.importers.text import WantedFont, font_for

OUTLINE_FONT = "DejaVuSans.ttf"


def has_font() -> bool:
    from ezdxf.fonts import fonts

    return bool(fonts.font_manager.has_font(OUTLINE_FONT))


needs_font = pytest.mark.skipif(not has_font(), reason=f"{OUTLINE_FONT} is not installed")
MODES = ["stroke", pytest.param("outline", marks=needs_font)]


def new_text(words: str = "HANDLE", align: Align | None = None, **attributes: Any) -> Any:
    """A TEXT in an outline font, 5 high, at (10, 20)."""
    document = ezdxf.new()
    document.styles.add("plain", font=OUTLINE_FONT)
    given_attributes = {"style": "plain", "height": 5.0, "insert": (10.0, 20.0)} | attributes
    text = document.modelspace().add_text(words, dxfattribs=given_attributes)
    if align is not None:
        text.set_align_enum(align)
        text.dxf.align_point = attributes.get("align_point", (10.0, 20.0))
    return text


def points(shape: TextShape) -> Floats:
    return np.concatenate([part for contour in shape.contours for part in contour.parts])


def box(entity: Any, mode: str = "stroke") -> tuple[float, float, float, float]:
    """Left, bottom, right, top of all control points."""
    found = points(text_strokes(entity, mode))[:, :2]
    return (*found.min(axis=0), *found.max(axis=0))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("height", [0.05, 1.0, 300.0])
def test_a_capital_is_as_high_as_the_text(mode: str, height: float) -> None:
    _, bottom, _, top = box(new_text("HXE", height=height), mode)
    assert bottom == pytest.approx(20.0, abs=1e-9 * height)
    assert top == pytest.approx(20.0 + height, rel=1e-9)


@pytest.mark.parametrize("mode", MODES)
def test_parts_are_joined_and_outlines_closed(mode: str) -> None:
    shape = text_strokes(new_text("A8&g%%c"), mode)
    assert shape.contours
    for contour in shape.contours:
        assert contour.closed is (mode == "outline")
        for part in contour.parts:
            assert part.shape in ((2, 3), (3, 3), (4, 3))
        ends = [
            (one[-1], two[0]) for one, two in zip(contour.parts, contour.parts[1:], strict=False)
        ]
        if contour.closed:
            ends.append((contour.parts[-1][-1], contour.parts[0][0]))
        for end, start in ends:
            assert math.dist(end, start) < 1e-9


@needs_font
@pytest.mark.parametrize("words", ["Quick brown fox 0123", "Ørsted ±0.1°", "gjpqy"])
def test_outlines_lie_where_ezdxf_draws_them(words: str) -> None:
    from ezdxf import path
    from ezdxf.addons import text2path

    text = new_text(words, rotation=30.0, oblique=10.0, width=1.3)
    text.dxf.oblique = 0.0  # ezdxf leans letters before it widens them, CAD afterwards
    reference = path.bbox([text2path.make_path_from_entity(text)], fast=True)
    assert box(text, "outline") == pytest.approx(
        (reference.extmin.x, reference.extmin.y, reference.extmax.x, reference.extmax.y)
    )


@needs_font
def test_outlines_are_ezdxfs_own_curves() -> None:
    from ezdxf.addons import text2path

    text = new_text("S&o")
    reference = list(text2path.make_path_from_entity(text).sub_paths())
    contours = text_strokes(text, "outline").contours
    assert len(contours) == len(reference)
    for contour, path in zip(contours, reference, strict=True):
        mine = np.array([part[-1] for part in contour.parts])
        theirs = np.array([tuple(command.end) for command in path.commands()])
        distances = np.linalg.norm(mine[:, None] - theirs[None], axis=2)
        assert distances.min(axis=1).max() < 1e-9
        assert distances.min(axis=0).max() < 1e-9


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    ("align", "across", "up"),
    [
        (Align.LEFT, 0.0, 0.0),
        (Align.CENTER, 0.5, 0.0),
        (Align.RIGHT, 1.0, 0.0),
        (Align.MIDDLE_LEFT, 0.0, 0.5),
        (Align.MIDDLE_CENTER, 0.5, 0.5),
        (Align.TOP_RIGHT, 1.0, 1.0),
        (Align.TOP_CENTER, 0.5, 1.0),
        (Align.BOTTOM_LEFT, 0.0, "depth"),
        (Align.BOTTOM_RIGHT, 1.0, "depth"),
        (Align.MIDDLE, 0.5, "middle"),
    ],
)
def test_alignment_moves_the_text_by_its_width_and_height(
    mode: str, align: Align, across: float, up: float | str
) -> None:
    text = new_text("Handle", align, rotation=0.0)
    plain = new_text("Handle")
    font, _ = font_for(WantedFont(OUTLINE_FONT), mode)
    width = 5.0 * sum(letter.advance for c in "Handle" if (letter := font.letter(c)))
    if isinstance(up, float):
        share = up
    else:
        share = 0.5 * (1.0 - font.descent) if up == "middle" else -font.descent
    moved = points(text_strokes(text, mode)) - points(text_strokes(plain, mode))
    assert moved == pytest.approx(np.tile((-across * width, -5.0 * share, 0.0), (len(moved), 1)))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("align", [Align.FIT, Align.ALIGNED])
def test_fitted_text_spans_its_two_points(mode: str, align: Align) -> None:
    text = new_text("MHHM", align, insert=(0.0, 0.0), align_point=(30.0, 40.0))
    flat = new_text("MHHM", align, insert=(0.0, 0.0), align_point=(50.0, 0.0))
    turn = np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    assert points(text_strokes(text, mode)) == pytest.approx(
        points(text_strokes(flat, mode)) @ turn
    )
    left, bottom, right, top = box(flat, mode)
    bearing = 0.06 * 50.0
    assert 0.0 <= left < bearing
    assert 50.0 - bearing < right <= 50.0
    plain = box(new_text("MHHM", insert=(0.0, 0.0)), mode)
    scale = (right - left) / (plain[2] - plain[0])
    assert (bottom, top) == pytest.approx((0.0, 5.0 * (scale if align is Align.ALIGNED else 1.0)))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("flag", "signs"), [(2, (-1, 1)), (4, (1, -1)), (6, (-1, -1))])
@pytest.mark.parametrize("align", [Align.LEFT, Align.TOP_RIGHT, Align.MIDDLE])
def test_backward_and_upside_down_mirror_about_the_alignment_point(
    mode: str, flag: int, signs: tuple[int, int], align: Align
) -> None:
    at = np.array([10.0, 20.0, 0.0])
    plain = points(text_strokes(new_text("Rag", align), mode)) - at
    mirrored = points(text_strokes(new_text("Rag", align, text_generation_flag=flag), mode)) - at
    assert mirrored == pytest.approx(plain * (*signs, 1.0))


@pytest.mark.parametrize("flag", [2, 4])
def test_mirrored_fitted_text_still_runs_from_its_first_point(flag: int) -> None:
    text = new_text(
        "LT", Align.FIT, insert=(0, 0), align_point=(20.0, 0.0), text_generation_flag=flag
    )
    left, bottom, right, top = box(text)
    assert 0.0 <= left < right <= 20.0
    assert (bottom, top) == pytest.approx((-5.0, 0.0))
    first = points(text_strokes(text, "stroke"))[0]
    assert first[0] < 10.0  # the L, not the T


@pytest.mark.parametrize("mode", MODES)
@given(
    angle=st.floats(-360.0, 360.0),
    shift=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-10.0, 10.0)),
    scale=st.floats(0.1, 10.0),
    mirrored=st.booleans(),
    align=st.sampled_from([Align.LEFT, Align.MIDDLE, Align.TOP_RIGHT, Align.FIT]),
)
def test_a_moved_turned_scaled_mirrored_entity_gives_curves_moved_alike(
    mode: str,
    angle: float,
    shift: tuple[float, float, float],
    scale: float,
    mirrored: bool,
    align: Align,
) -> None:
    """Mirroring makes ezdxf turn the extrusion to (0, 0, -1)."""
    text = new_text("Ag4", align, rotation=12.0, oblique=7.0, width=0.8)
    text.dxf.align_point = (31.0, 25.0)
    before = points(text_strokes(text, mode))
    matrix = Matrix44.scale(-scale if mirrored else scale, scale, scale)
    matrix @= Matrix44.z_rotate(math.radians(angle)) @ Matrix44.translate(*shift)
    text.transform(matrix)
    after = points(text_strokes(text, mode))
    wanted = np.array([tuple(matrix.transform(tuple(point))) for point in before])
    assert np.abs(after - wanted).max() < 1e-6 * (1.0 + np.abs(wanted).max())


@pytest.mark.parametrize("mode", MODES)
def test_width_factor_and_oblique_angle(mode: str) -> None:
    at = np.array([10.0, 20.0, 0.0])
    plain = points(text_strokes(new_text("Rag"), mode)) - at
    changed = points(text_strokes(new_text("Rag", width=1.7, oblique=20.0), mode)) - at
    slant = math.tan(math.radians(20.0))
    wanted = np.column_stack([1.7 * plain[:, 0] + slant * plain[:, 1], plain[:, 1:]])
    assert changed == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("raw", "shown"),
    [
        ("%%c12", "Ø12"),
        ("45%%D", "45°"),
        ("%%p0.1", "±0.1"),
        ("100%%%", "100%"),
        ("%%065b", "Ab"),
        ("%%181", "µ"),
        ("A^ 3", "A^3"),
        ("2^3", "2^3"),
        ("a^Ib", "a b"),
        ("50%", "50%"),
        ("%%%%%%z", "%%z"),
        ("%%%%%%300", "%%300"),
        ("e\u0301", "é"),
    ],
)
def test_codes_are_the_signs_that_they_stand_for(raw: str, shown: str) -> None:
    coded, plain = new_text("x"), new_text("x")
    coded.dxf.text, plain.dxf.text = raw, shown
    assert points(text_strokes(coded, "stroke")) == pytest.approx(
        points(text_strokes(plain, "stroke"))
    )


@pytest.mark.parametrize(
    ("code", "share"),
    [("%%u", -0.2), ("%%k", 0.5), ("%%o", 1.2)],
    ids=["under", "through", "over"],
)
@pytest.mark.parametrize("mode", MODES)
def test_lines_along_a_part_of_the_text(mode: str, code: str, share: float) -> None:
    plain = text_strokes(new_text("Under me"), mode).contours
    ruled = text_strokes(new_text(f"{code}Under{code} me"), mode).contours
    assert len(ruled) == len(plain) + 1
    line = np.concatenate(
        [c for contour in ruled for c in contour.parts if np.ptp(c[:, 0]) > 14.0]
    )
    assert line[:, 1].mean() == pytest.approx(20.0 + 5.0 * share)
    assert np.ptp(line[:, 1]) == pytest.approx(0.0 if mode == "stroke" else 0.35)


def test_what_the_font_lacks_is_named_and_keeps_its_place() -> None:
    shape = text_strokes(new_text("a☃b中☃"), "stroke")
    assert shape.missing == "☃☃中"
    assert shape.lacks == "Hershey Roman simplex has no ☃ 中: left blank"
    plain = text_strokes(new_text("a☃b"), "stroke")
    assert points(shape) == pytest.approx(points(plain))
    assert box(new_text("a☃b"))[2] > box(new_text("ab"))[2]


@needs_font
def test_what_an_outline_font_lacks_is_named() -> None:
    shape = text_strokes(new_text("a\ue123b"), "outline")
    assert shape.missing == "\ue123"
    assert "has no U+E123: left blank" in shape.lacks
    assert shape.contours


def test_a_text_of_unknown_signs_alone_is_no_error() -> None:
    shape = text_strokes(new_text("☃"), "stroke")
    assert (shape.contours, shape.missing) == ([], "☃")


@needs_font
def test_a_named_font_is_used_and_an_absent_one_named() -> None:
    assert text_strokes(new_text("A"), "outline").lacks == ""
    assert OUTLINE_FONT in text_strokes(new_text("A"), "outline").font
    text = new_text("A")
    text.doc.styles.get("plain").dxf.font = "Nowhere.ttf"
    shape = text_strokes(text, "outline")
    assert shape.substituted == "Nowhere.ttf"
    assert shape.lacks == f"font Nowhere.ttf is not installed: drawn with {shape.font}"
    assert all(contour.closed for contour in shape.contours)


@needs_font
def test_a_family_is_found_with_its_weight() -> None:
    text = new_text("A")
    style = text.doc.styles.get("plain")
    style.set_extended_font_data("DejaVu Sans", bold=True)
    shape = text_strokes(text, "outline")
    if "Bold" not in shape.font:
        pytest.skip("DejaVu Sans Bold is not installed")
    assert shape.substituted == ""


@pytest.mark.parametrize("font", ["txt", "txt.shx", "romans.shx", "simplex", "iso.lff", ""])
def test_stroke_fonts_are_drawn_with_strokes_even_as_outlines(font: str) -> None:
    text = new_text("Ab")
    text.doc.styles.get("plain").dxf.font = font
    shape = text_strokes(text, "outline")
    assert not any(contour.closed for contour in shape.contours)
    assert shape.substituted == (font or "txt")
    assert text_strokes(text, "stroke").substituted == ""


@pytest.fixture
def no_fonts(monkeypatch: pytest.MonkeyPatch) -> Any:
    def none_installed() -> tuple[()]:
        return ()

    monkeypatch.setattr(text_fonts, "installed_fonts", none_installed)
    font_for.cache_clear()
    yield
    font_for.cache_clear()


@pytest.mark.usefixtures("no_fonts")
def test_strokes_need_no_installed_font() -> None:
    assert text_strokes(new_text("A"), "stroke").contours
    with pytest.raises(Unusable, match=r"no outline font is installed; use --text stroke"):
        text_strokes(new_text("A"), "outline")


def test_a_style_that_is_not_there_is_named() -> None:
    text = new_text("A", style="lost")
    assert text_strokes(text, "stroke").contours


@pytest.mark.parametrize(
    ("attributes", "why"),
    [
        ({"height": 0.0}, "no size"),
        ({"height": math.inf}, "finite"),
        ({"height": math.nan}, "finite"),
        ({"width": math.nan}, "finite"),
        ({"oblique": math.inf}, "finite"),
        ({"rotation": math.nan}, "finite"),
        ({"insert": (math.nan, 0.0)}, "finite"),
        ({"insert": (1e308, 0.0)}, "not finite or too large"),
        ({"extrusion": (0.0, 0.0, 0.0)}, "extrusion of 0"),
        ({"extrusion": (0.0, math.nan, 0.0)}, "finite"),
        ({"text": ""}, "empty"),
        ({"text": "   "}, "empty"),
        ({"text": "%%u%%u"}, "no size"),
        ({"text": "x" * 20_001}, "more than 20000 characters"),
    ],
)
def test_what_cannot_be_laid_out_is_told(attributes: dict[str, Any], why: str) -> None:
    text = new_text("A")
    for name, value in attributes.items():
        text.dxf.unprotected_set(name, value)
    with pytest.raises(Unusable, match=why):
        text_strokes(text, "stroke")


def test_fitted_between_equal_points_is_told() -> None:
    with pytest.raises(Unusable, match="two equal points"):
        text_strokes(new_text("A", Align.FIT), "stroke")


@pytest.mark.parametrize("name", ["insert", "height"])
def test_what_the_file_does_not_say_is_not_made_up(name: str) -> None:
    text = new_text("A")
    text.dxf.discard(name)
    with pytest.raises(Unusable, match=f"lacks its {name}"):
        text_strokes(text, "stroke")


def test_letters_below_each_other_are_told() -> None:
    text = new_text("A")
    text.doc.styles.get("plain").is_vertical_stacked = True
    with pytest.raises(Unusable, match="one below the other"):
        text_strokes(text, "stroke")


def test_attributes() -> None:
    document = ezdxf.new()
    block = document.blocks.new("part")
    definition = block.add_attdef("NAME", (1.0, 2.0), text="bolt", height=3.0)
    constant = block.add_attdef("SIZE", (1.0, 2.0), text="M8", height=3.0)
    constant.is_const = True
    insert = document.modelspace().add_blockref("part", (0.0, 0.0))
    value = insert.add_attrib("NAME", "nut", (5.0, 6.0), {"height": 3.0})
    for entity, words, at in (
        (definition, "NAME", (1, 2)),
        (constant, "M8", (1, 2)),
        (value, "nut", (5, 6)),
    ):
        plain = new_text(words, insert=at, height=3.0)
        assert points(text_strokes(entity, "stroke")) == pytest.approx(
            points(text_strokes(plain, "stroke"))
        )
    value.is_invisible = True
    with pytest.raises(Unusable, match="invisible"):
        text_strokes(value, "stroke")


@pytest.mark.parametrize("mode", MODES)
def test_the_importer_reads_text_when_asked(mode: str, tmp_path: Path) -> None:
    text = new_text("HI\ue123")
    text.doc.units = 4
    file = tmp_path / "label.dxf"
    text.doc.saveas(file)
    drawing = read_drawing(file, options=ReadOptions(text=mode))
    assert len(drawing.paths) == (2 if mode == "outline" else 4)
    assert (drawing.paths.closed == (mode == "outline")).all()
    notes = [f.message for f in drawing.findings if f.code is DrawingCode.FONT_SUBSTITUTED]
    assert [note.endswith("has no U+E123: left blank") for note in notes] == [True]


@pytest.mark.parametrize("mode", MODES)
def test_text_in_a_mirrored_and_stretched_block(mode: str, tmp_path: Path) -> None:
    document = ezdxf.new(units=4)
    document.styles.add("plain", font=OUTLINE_FONT)
    block = document.blocks.new("part")
    text = block.add_text("LT", dxfattribs={"style": "plain", "height": 5.0, "insert": (1.0, 2.0)})
    document.modelspace().add_blockref("part", (10.0, 0.0), {"xscale": -2.0, "yscale": 3.0})
    file = tmp_path / "label.dxf"
    document.saveas(file)
    drawing = read_drawing(file, options=ReadOptions(text=mode))
    found = points(text_strokes(text, mode))[:, :2] * (-2.0, 3.0) + (10.0, 0.0)
    corners = drawing.paths.vertices[:, :2]
    assert corners.min(axis=0) == pytest.approx(found.min(axis=0))
    assert corners.max(axis=0) == pytest.approx(found.max(axis=0))


@given(st.text(max_size=40), st.sampled_from(["stroke", "outline"]))
def test_any_words_are_laid_out_or_refused(words: str, mode: str) -> None:
    text = new_text("A")
    text.dxf.unprotected_set("text", words)
    try:
        shape = text_strokes(text, mode)
    except Unusable:
        return
    assert shape.contours or shape.missing or not words.strip()
    for contour in shape.contours:
        assert all(np.isfinite(part).all() for part in contour.parts)
