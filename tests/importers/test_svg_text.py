"""`<text>` of an SVG as curves: against the same text in a DXF, against resvg, and against itself
turned, moved and written in other ways."""

import io

import ezdxf
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import extents
from camtool.importers import text as text_fonts
from camtool.importers.dxf.reader import read as read_dxf
from camtool.importers.findings import DrawingCode
from camtool.importers.options import TEXT_SKIPPED, ReadOptions
from camtool.importers.svg import reader
from camtool.importers.svg.reader import read
from camtool.importers.text import TextLook, WantedFont, font_for
from tests.importers.test_dxf_text import MODES, OUTLINE_FONT, needs_font
from tests.oracles.svg_ink import ink
from tests.strategies import examples

FAMILY = "DejaVu Sans"
NEAR_MM = 1e-6
LINE = '<path id="l" d="M0 0h1"/>'
PAGE = 'xmlns="http://www.w3.org/2000/svg" width="200mm" height="100mm" viewBox="0 0 200 100"'
"""One user unit is 1 mm, and (x, y) of the file is (x, 100 − y) of the drawing."""


def drawn(body: str, mode: str = "stroke") -> Drawing:
    text = f'<svg {PAGE} font-family="{FAMILY}" font-size="10">{body}</svg>'
    return read(text.encode(), "part.svg", ReadOptions(text=mode))


def box(drawing: Drawing) -> np.ndarray:
    """[[left, right], [bottom, top]], exact over arcs."""
    return extents(drawing.paths)


def same(one: Drawing, other: Drawing) -> bool:
    """True if both draw the same curves."""
    return one.paths.vertices.shape == other.paths.vertices.shape and np.allclose(
        one.paths.vertices, other.paths.vertices, rtol=0.0, atol=NEAR_MM
    )


def width(words: str, size: float = 10.0, mode: str = "stroke", **looks: bool) -> float:
    """By the font's own advances."""
    font, _ = font_for(WantedFont(family=FAMILY, **looks), mode)
    return TextLook(font, size / font.em).width(words)


def refused(body: str, mode: str = "stroke") -> list[str]:
    """The reasons for which texts beside a line are left out."""
    drawing = drawn(LINE + body, mode)
    assert drawing.used == {"path": 1}
    assert len(drawing.paths) == 1
    return [item.reason for item in drawing.skipped if item.kind == "text"]


# ---- whether


def test_text_is_left_out_unless_it_is_wanted() -> None:
    drawing = drawn(LINE + "<text>Plate</text><g><text/></g>", "skip")
    assert [(item.kind, item.count, item.reason) for item in drawing.skipped] == [
        ("text", 2, TEXT_SKIPPED)
    ]


@pytest.mark.parametrize("mode", MODES)
def test_letters_are_contours_with_the_layer_and_colour_of_their_element(mode: str) -> None:
    drawing = drawn(
        '<g id="marks"><text id="t" y="20" fill="red">L<tspan fill="#00f">T</tspan></text></g>',
        mode,
    )
    assert drawing.used == {"text": 1}
    assert not drawing.skipped
    assert set(drawing.layers) == {"marks"}
    assert {drawing.paths[k].closed for k in range(len(drawing.paths))} == {mode == "outline"}
    assert set(drawing.colours) == {"#ff0000", "#0000ff"}
    assert all(source.startswith("text t") for source in drawing.sources)


def test_flowed_text_is_counted() -> None:
    drawing = drawn(LINE + "<flowRoot><flowRegion><rect/></flowRegion></flowRoot>")
    assert [(item.kind, item.count) for item in drawing.skipped] == [("flowRoot", 1)]


# ---- size and place


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("size", [0.7, 10.0, 31.0])
def test_the_same_text_in_a_dxf(mode: str, size: float) -> None:
    font, _ = font_for(WantedFont(family=FAMILY), mode)
    document = ezdxf.new(units=4)
    document.styles.add("plain", font=OUTLINE_FONT)
    document.modelspace().add_text(
        "Ago 7Q&%%%",
        dxfattribs={"style": "plain", "height": size / font.em, "insert": (12.0, 40.0)},
    )
    stream = io.StringIO()
    document.write(stream)
    dxf = read_dxf(stream.getvalue().encode(), "part.dxf", ReadOptions(text=mode))
    svg = drawn(f'<text x="12" y="60" font-size="{size}">Ago 7Q&amp;%</text>', mode)
    assert len(svg.paths) == len(dxf.paths) > 5
    assert box(svg) == pytest.approx(box(dxf), abs=0.001)  # arcs of mirrored curves differ
    assert svg.paths.closed.tolist() == dxf.paths.closed.tolist()


@needs_font
def test_the_font_size_is_the_em_of_the_font() -> None:
    # DejaVu Sans: 2048 units an em, an H is 1493 high and has its left side at 201.
    (left, _), (bottom, top) = box(
        drawn('<text x="5" y="50" font-size="20.48">H</text>', "outline")
    )
    assert (left, bottom, top) == pytest.approx((5.0 + 2.01, 50.0, 50.0 + 14.93), abs=1e-9)


@pytest.mark.parametrize(
    ("size", "mm"),
    [
        ("10", 10.0),
        ("10px", 10.0),
        ("1.5em", 15.0),
        ("50%", 5.0),
        ("larger", 12.0),
        ("32px", 32.0),
    ],
)
def test_font_sizes(size: str, mm: float) -> None:
    plain = drawn(f'<text y="50" font-size="{mm}">Rg</text>')
    assert same(drawn(f'<text y="50" font-size="{size}">Rg</text>'), plain)
    if not size.isdecimal():  # a bare number is no size in the short form
        assert same(drawn(f'<text y="50" style="font: {size}/2 {FAMILY}">Rg</text>'), plain)
    sheet = f"<style>text {{ font-size: {size} }}</style>"
    assert same(drawn(f'{sheet}<text y="50">Rg</text>'), plain)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    "matrix",
    [(1, 0, 0, 1, 7, 5), (-1, 0, 0, 1, 90, 0), (0, 2, -2, 0, 90, 5), (2, 0.5, 0.3, 1, 9, 9)],
)
def test_a_transform_of_a_text_transforms_its_outlines(
    mode: str, matrix: tuple[float, ...]
) -> None:
    words = '<text x="8" y="30" text-anchor="{}">Lo7</text>'.format("middle")
    numbers = " ".join(map(str, matrix))
    moved = drawn(f'<g transform="matrix({numbers})">{words}</g>', mode)
    own = drawn(words.replace("<text", f'<text transform="matrix({numbers})"'), mode)
    assert same(moved, own)
    a, b, c, d, e, f = matrix
    plain = drawn(words, mode)
    assert len(plain.paths) == len(moved.paths)
    # Corners lie where the map takes them; arcs are fitted anew, so compare where curves end.
    starts = np.array([start_of(plain, k) for k in range(len(plain.paths))])
    wanted = starts @ np.array([[a, b], [c, d]]) + (e, f)
    assert np.array([start_of(moved, k) for k in range(len(moved.paths))]) == pytest.approx(
        wanted, abs=NEAR_MM
    )


def start_of(drawing: Drawing, index: int) -> np.ndarray:
    """Return the start of a path, Y down."""
    x, y = drawing.paths[index].vertices[0, :2]
    return np.array([x, 100.0 - y])


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("anchor", "share"), [("start", 0.0), ("middle", 0.5), ("end", 1.0)])
def test_anchors(mode: str, anchor: str, share: float) -> None:
    words = "Width 10"
    found = drawn(f'<text x="90" y="50" text-anchor="{anchor}">{words}</text>', mode)
    plain = drawn(
        f'<text x="{90.0 - share * width(words, mode=mode)!r}" y="50">{words}</text>', mode
    )
    assert same(found, plain)


def test_an_anchor_holds_for_all_of_a_chunk_and_for_that_alone() -> None:
    both = drawn(
        '<text x="90" y="20" text-anchor="end">on<tspan font-size="5">ly</tspan>'
        '<tspan x="90" y="40">two</tspan></text>'
    )
    start = 90.0 - width("on") - width("ly", 5.0)
    apart = drawn(
        f'<text x="{start!r}" y="20">on</text>'
        f'<text x="{start + width("on")!r}" y="20" font-size="5">ly</text>'
        f'<text x="{90.0 - width("two")!r}" y="40">two</text>'
    )
    assert same(both, apart)


@pytest.mark.parametrize(
    ("written", "apart"),
    [
        ('<text x="5" y="20" dx="3" dy="-1">A</text>', [("A", 8, 19)]),
        ('<text y="2em">A</text>', [("A", 0, 20)]),
        ('<text y="9">A<tspan dx="3">I</tspan></text>', [("A", 0, 9), ("I", 3 + width("A"), 9)]),
        ('<text x="50%" y="10%">A</text>', [("A", 100, 10)]),
        ('<text x="5 30 60" y="20">ABC</text>', [("A", 5, 20), ("B", 30, 20), ("C", 60, 20)]),
        ('<text x="5" y="20 30">AI</text>', [("A", 5, 20), ("I", 5 + width("A"), 30)]),
        ('<text x="5" y="9">A<tspan dy="4">I</tspan></text>',
         [("A", 5, 9), ("I", 5 + width("A"), 13)]),
        ('<text x="1" y="9"><tspan x="5">A</tspan><a><tspan y="40" x="7">I</tspan></a></text>',
         [("A", 5, 9), ("I", 7, 40)]),
        ('<text x="1 2 3" y="9">A<tspan>I</tspan>L</text>',
         [("A", 1, 9), ("I", 2, 9), ("L", 3, 9)]),
        ('<text x="1" y="9"><tspan x="80"> </tspan>A</text>', [("A", 1, 9)]),
        ('<text x="1" y="9"><tspan display="none">I</tspan><a>A</a></text>', [("A", 1, 9)]),
        ('<text x="1" y="9"><title>I</title>A<!-- I --><desc>I</desc></text>', [("A", 1, 9)]),
    ],
)  # fmt: skip
def test_places(written: str, apart: list[tuple[str, float, float]]) -> None:
    texts = "".join(f'<text x="{x!r}" y="{y!r}">{letter}</text>' for letter, x, y in apart)
    assert same(drawn(written), drawn(texts))


@pytest.mark.parametrize(
    ("written", "plain"),
    [
        ("\n  A\t B \r\n", "A B"),
        ("A <tspan> B</tspan> ", "A B"),
        ("A<tspan>\n</tspan>B", "A B"),
        ("<tspan> </tspan>A", "A"),
        ("A&#160; B", "A&#160; B"),
        ("&#65;<![CDATA[ B]]>", "A B"),
    ],
)
def test_blanks_collapse(written: str, plain: str) -> None:
    text = '<text x="90" y="20" text-anchor="end">{}</text>'
    assert same(drawn(text.format(written)), drawn(text.format(plain)))


@pytest.mark.parametrize("how", ['xml:space="preserve"', 'style="white-space: pre"'])
def test_blanks_that_are_kept(how: str) -> None:
    moved = f'<text x="{2 * width(" ")!r}" y="9">A</text>'
    assert same(drawn(f'<text y="9" {how}>  A</text>'), drawn(moved))
    assert same(drawn(f'<g {how}><text y="9">  A</text></g>'), drawn(moved))


def test_use_draws_a_text_again() -> None:
    used = drawn(f'<defs><text id="t" y="9">A</text></defs><use href="#t" x="5"/>{LINE}')
    assert same(used, drawn(f'<text x="5" y="9">A</text>{LINE}'))


@needs_font
@pytest.mark.parametrize(
    "zoomed", ["", 'transform="rotate(20 60 40)"', 'transform="scale(-1 1) translate(-120)"']
)
@pytest.mark.parametrize(
    "body",
    [
        '<text x="10" y="50" font-size="30">Hxg</text>',
        '<text x="60" y="50" font-size="20" text-anchor="middle">Oo<tspan dy="8">Q</tspan></text>',
        '<text x="110" y="40" text-anchor="end" font-size="2em">\n  pB  d\n</text>',
        '<text x="20 50 70" y="30 40" font-size="25px">abc</text>',
        '<text x="20 60 100" y="30" text-anchor="middle">WOW</text>',
        '<text x="99" y="30" text-anchor="end" xml:space="preserve"> One  </text>',
        '<text x="60" y="30" text-anchor="middle">O e <tspan x="60" dy="1em">Nine</tspan></text>',
    ],
)  # fmt: skip
def test_resvg_puts_its_ink_there(body: str, zoomed: str) -> None:
    """Without kerning and ligatures, which resvg would apply."""
    page = 'xmlns="http://www.w3.org/2000/svg" width="120" height="80"'
    style = f"font-family: '{FAMILY}'; font-kerning: none"
    svg = f'<svg {page}><g style="{style}" {zoomed}>{body}</g></svg>'
    (path,) = {f.path for f in text_fonts.installed_fonts() if f.path.endswith(f"/{OUTLINE_FONT}")}
    wanted = ink(svg, 10, (path,)).extents
    drawing = read(svg.encode(), "text.svg", ReadOptions(text="outline"))
    (left, right), (bottom, top) = box(drawing) * 96.0 / 25.4
    assert (left, 80.0 - top, right, 80.0 - bottom) == pytest.approx(wanted, abs=0.12)


# ---- fonts


@needs_font
def test_weight_slope_and_families() -> None:
    plain, bold = drawn("<text y='9'>O</text>", "outline"), drawn(
        "<text y='9' font-weight='bold'>O</text>", "outline"
    )  # fmt: skip
    assert not same(plain, bold)
    assert same(bold, drawn("<text y='9' style='font-weight: 700'>O</text>", "outline"))
    assert same(plain, drawn(f"<text y='9' font-family=\"'{FAMILY}', x\">O</text>", "outline"))
    assert not any(f.code is DrawingCode.FONT_SUBSTITUTED for f in plain.findings)
    for family in (f"Nowhere Grotesk, {FAMILY}", "Nowhere Grotesk"):
        other = drawn(f'<text y="9" font-family="{family}">O</text>', "outline")
        (told,) = [f.message for f in other.findings if f.code is DrawingCode.FONT_SUBSTITUTED]
        assert told.startswith("1 text: font Nowhere Grotesk is not installed: drawn with ")


def test_a_letter_that_the_font_lacks_is_named() -> None:
    found = drawn("<text y='9'>A\ue123A</text>")
    (told,) = [f.message for f in found.findings if f.code is DrawingCode.FONT_SUBSTITUTED]
    assert told.endswith("has no U+E123: left blank")


def test_lines_along_a_text() -> None:
    found = drawn('<text y="9" text-decoration="underline">A <tspan>B</tspan></text>')
    plain = drawn('<text y="9">A <tspan>B</tspan></text>')
    assert len(found.paths) > len(plain.paths)
    (left, right), _ = box(found)
    assert (left, right) == pytest.approx((0.0, width("A B")), abs=NEAR_MM)


# ---- what is not drawn


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("<text> \n </text>", "is empty"),
        ('<text rotate="10 20">A</text>', "rotate"),
        ('<text textLength="50">A</text>', "textLength"),
        ("<text>A<tspan textLength='50'>A</tspan></text>", "textLength"),
        ('<text>A<textPath href="#l">B</textPath></text>', "textPath"),
        ('<text>A<tref href="#l"/></text>', "tref"),
        ('<text letter-spacing="1">A</text>', "letter-spacing"),
        ('<text style="word-spacing: -.1em">A</text>', "word-spacing"),
        ('<g writing-mode="tb"><text>A</text></g>', "writing-mode"),
        ('<text direction="rtl">A</text>', "direction"),
        ('<text>A<tspan baseline-shift="super">2</tspan></text>', "baseline-shift"),
        ('<text dominant-baseline="middle">A</text>', "dominant-baseline"),
        ('<text style="text-transform: uppercase">a</text>', "text-transform"),
        ('<text style="font-variant: small-caps">a</text>', "font-variant"),
        ('<text style="font: caption">a</text>', "font-size"),
        ('<text font-size="nan">A</text>', "font-size"),
        ('<text font-size="-5">A</text>', "font-size"),
        ('<text font-size="1e300">A</text>', "font-size"),
        ('<text font-size="0">A</text>', "has no size"),
        ('<text font-weight="heavy">A</text>', "font-weight"),
        ('<text text-anchor="left">A</text>', "text-anchor"),
        ("<text>\u05d0\u05d1</text>", "right to left"),
        ("<text>x\u0332</text>", "combined"),
        ('<text x="1 2">e\u0301a</text>', "combined"),
        ('<text style="white-space: pre">A\nB</text>', "white-space"),
        ('<text text-anchor="end">A<tspan dx="1">B</tspan></text>', "a dx within"),
        ('<text text-anchor="middle">A<tspan y="9">B</tspan></text>', "a y without an x"),
        ('<text>A<tspan dx="-50">B</tspan></text>', "a dx within"),
        ('<text x="nan">A</text>', "x 'nan' is no length"),
        ('<text y="1 2 ?">ABC</text>', "y '?' is no length"),
        ('<text x="1e30">A</text>', "is too large"),
        ('<text x="1e11">A</text>', "too far to be exact"),
        ('<text transform="scale(a)">A</text>', "cannot be read"),
        ('<text visibility="hidden">A</text>', "hidden"),
        ('<text display="none">A</text>', "hidden"),
        ('<text fill="none">A</text>', "neither stroke nor fill"),
        (f"<text>{'A' * 100_000}</text>", "has more than 20000 characters"),
        ("<text>" + "<tspan>AA</tspan>" * 10_001 + "</text>", "has more than 20000 characters"),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_as_it_is_shown_is_left_out_whole(text: str, why: str) -> None:
    (reason,) = refused(text)
    assert why in reason


@pytest.mark.parametrize(
    "plain",
    ['letter-spacing="0px"', 'word-spacing="normal"', 'writing-mode="lr-tb"', 'direction="ltr"',
     'baseline-shift="0%"', 'style="font-stretch: normal; font-variant: normal"'],
)  # fmt: skip
def test_what_asks_for_nothing_is_no_reason(plain: str) -> None:
    assert same(drawn(f'<text y="9" {plain}>A</text>'), drawn('<text y="9">A</text>'))


def test_a_part_that_is_hidden_keeps_its_place_and_is_counted() -> None:
    found = drawn('<text y="9">A<tspan visibility="hidden">B</tspan>C</text>')
    apart = drawn(f'<text y="9">A</text><text y="9" x="{width("AB")!r}">C</text>')
    assert same(found, apart)
    assert [(item.kind, item.reason) for item in found.skipped] == [
        ("part of a text", "is hidden (visibility)")
    ]


def test_weights_that_fonts_are_not_asked_for_are_told() -> None:
    if not text_fonts.installed_fonts():
        pytest.skip("no outline font is installed")
    found = drawn('<text y="9" font-weight="300">A</text>', "outline")
    assert [f.message for f in found.findings if f.code is DrawingCode.NOT_APPLIED] == [
        "1 font-weight 300 of text is not applied: 600 and more is bold"
    ]


def test_the_letters_of_a_file_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "MAX_LETTERS", 100)
    assert drawn("<text y='9'>AB</text>" * 50).used == {"text": 50}
    with pytest.raises(DrawingError, match=r"more than 100 letters.*--text skip"):
        drawn("<text y='9'>AB</text>" * 51)


@examples(60)
@given(
    st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=30),
    st.sampled_from(["x", "dy", "font-family", "font-size", "font-weight", "style", "xml:space"]),
    st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=12),
)
def test_any_text_is_drawn_or_counted(words: str, name: str, value: str) -> None:
    from xml.sax.saxutils import escape, quoteattr

    if any(sign in "\ufffe\uffff" for sign in words + value):
        return
    found = drawn(f"{LINE}<text y='9' {name}={quoteattr(value)}>{escape(words)}</text>")
    assert np.isfinite(found.paths.vertices).all()
    told = [f for f in found.findings if f.code is DrawingCode.FONT_SUBSTITUTED]
    assert found.used.get("text") or found.skipped or told
