"""Styles of SVG elements: the cascade, selectors, CSS transforms, and what is not applied."""

import numpy as np
import pytest

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import extents
from camtool.importers.findings import DrawingCode
from camtool.importers.options import ReadOptions, Selection
from camtool.importers.svg.colours import parse_colour
from camtool.importers.svg.reader import read

PAGE = 'xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100"'
RECT = '<rect x="10" y="20" width="4" height="6" {}/>'


def drawn(body: str, **options: object) -> Drawing:
    return read(f"<svg {PAGE}>{body}</svg>".encode(), "part.svg", ReadOptions(**options))


def told(drawing: Drawing) -> list[str]:
    return [f.message for f in drawing.findings if f.code == DrawingCode.NOT_APPLIED]


@pytest.mark.parametrize(
    ("sheet", "attributes", "wanted"),
    [
        ("rect {stroke: red}", "", "#ff0000"),
        ("rect {stroke: red} rect {stroke: lime}", "", "#00ff00"),
        (".a {stroke: red} rect {stroke: lime}", 'class="a"', "#ff0000"),
        ("#i {stroke: red} .a.b {stroke: lime}", 'id="i" class="a b"', "#ff0000"),
        (".a.b {stroke: red} .b {stroke: lime}", 'class="b a"', "#ff0000"),
        (".a.c {stroke: red} .b {stroke: lime}", 'class="b a"', "#00ff00"),
        ("* {stroke: red}", 'stroke="lime"', "#ff0000"),
        ("rect {stroke: red}", 'style="stroke: lime"', "#00ff00"),
        ("rect {stroke: red !important}", 'style="stroke: lime"', "#ff0000"),
        ("rect {stroke: red ! important}", 'style="stroke: lime!important"', "#00ff00"),
        ("rect {stroke: red !important; stroke: lime}", "", "#ff0000"),
        ("g rect {stroke: red} rect {stroke: lime}", "", "#ff0000"),
        ("svg > g > rect {stroke: red}", "", "#ff0000"),
        ("svg > rect, g>rect {stroke: red}", "", "#ff0000"),
        ("svg > rect {stroke: red}", "", "#000000"),
        (".outer rect {stroke: red}", "", "#ff0000"),
        ("#no rect {stroke: red}", "", "#000000"),
        ("[rx] {stroke: red}", 'rx="0"', "#ff0000"),
        ("rect[class^=cut] {stroke: red}", 'class="cut-1"', "#ff0000"),
        ('rect[class~="b"] {stroke: red}', 'class="a b"', "#ff0000"),
        ("rect[class|='a'] {stroke: red}", 'class="a-b"', "#ff0000"),
        ("rect[class$=b] {stroke: red}", 'class="a-b"', "#ff0000"),
        ("rect[class*='-'] {stroke: red}", 'class="a-b"', "#ff0000"),
        ("rect[width='5'] {stroke: red}", "", "#000000"),
        ("@import 'x.css'; rect {stroke: red}", "", "#ff0000"),
        ("@font-face {src: x} rect {stroke: red}", "", "#ff0000"),
        ("/* { */ rect /* } */ {stroke: /* */ red}", "", "#ff0000"),
        ("<!-- rect {stroke: red} -->", "", "#ff0000"),
        ("rect {STROKE: RED}", "", "#ff0000"),
        ("rect {stroke: red", "", "#000000"),
        ("rect {stroke: inherit}", "", "#0000ff"),
        ("rect {stroke: initial; fill: teal}", "", "#008080"),
        ("rect {stroke: unset}", 'stroke="red"', "#0000ff"),
    ],
)
def test_the_cascade(sheet: str, attributes: str, wanted: str) -> None:
    above = ' stroke="blue"' if "inherit" in sheet or "unset" in sheet else ""
    body = (
        f'<style><![CDATA[{sheet}]]></style><g class="outer"{above}>{RECT.format(attributes)}</g>'
    )
    assert drawn(body).colours == (wanted,)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [("hsl(0, 100%, 50%)", "#ff0000"), ("hsla(240deg 100% 25% / .5)", "#000080"),
     ("hsl(480,100%,50%)", "#00ff00"), ("hsl(-120,100%,50%)", "#0000ff"),
     ("rgb(255 128 0)", "#ff8000"), ("rgba(300,-5,0,.2)", "#ff0000"),
     ("RGB( 10% , 20% , 30% )", "#1a334d"), ("url(#a)", ""), ("url(#a) none", ""),
     ("url(#a) #f00", "#ff0000"), ("#cd853f icc-color(x, 1)", "#cd853f"), ("var(--x)", ""),
     ("#ff", ""), ("rgb(1,2)", ""), ("rgb(1.2.3,4,5)", ""), ("hsl(1,2,3)", "")],
)  # fmt: skip
def test_colours(text: str, wanted: str) -> None:
    assert parse_colour(text) == wanted


def test_a_colour_of_a_gradient_is_its_second_word() -> None:
    assert drawn(RECT.format('stroke="url(#fade) teal"')).colours == ("#008080",)


# (x, y) of the rectangle's corner nearest to the origin of its own frame.
@pytest.mark.parametrize(
    ("attributes", "wanted"),
    [
        ('style="transform: translate(3px, 4px)"', [(13, 17), (24, 30)]),
        ('style="transform:translateX(1cm)translateY(50%)"', [(47.7953, 51.7953), (70, 76)]),
        ('style="transform: scale(2)"', [(20, 28), (40, 52)]),
        ('style="transform: scaleX(2) scaleY(50%)"', [(20, 28), (10, 13)]),
        ('style="transform: rotate(90deg)"', [(-26, -20), (10, 14)]),
        ('style="transform: rotate(.25turn)"', [(-26, -20), (10, 14)]),
        ('style="transform: rotate(100grad)"', [(-26, -20), (10, 14)]),
        ('style="transform: skew(45deg)"', [(30, 40), (20, 26)]),
        ('style="transform: skewX(0) skewy(45deg)"', [(10, 14), (30, 40)]),
        ('style="transform: matrix(1 0 0 1 2 3)"', [(12, 16), (23, 29)]),
        ('style="transform: none" transform="scale(9)"', [(10, 14), (20, 26)]),
        ('style="transform: scale(2)" transform="scale(9)"', [(20, 28), (40, 52)]),
        ('transform="scale(2)" transform-origin="10 20"', [(10, 18), (20, 32)]),
        ('transform="scale(2)" transform-origin="center"', [(-30, -22), (-10, 2)]),
        ('transform="scale(2)" style="transform-origin: right 10px"', [(-80, -72), (30, 42)]),
        ('transform="scale(2)" transform-origin="top"', [(-30, -22), (40, 52)]),
        ('transform="scale(2)" transform-origin="bottom left"', [(20, 28), (-60, -48)]),
    ],
)
def test_transforms_of_the_style(attributes: str, wanted: list[tuple[float, float]]) -> None:
    box = extents(drawn(RECT.format(attributes)).paths)
    (left, right), (low, high) = box
    np.testing.assert_allclose([(left, right), (100 - high, 100 - low)], wanted, atol=1e-3)


@pytest.mark.parametrize(
    "transform",
    ["translate(3em", "rotate(3px)", "rotate(1 2 3)", "scale(1px)", "perspective(3px)",
     "rotate3d(1,1,1,3deg)", "translate(calc(1px + 2px))", "skew()", "translatex(1px,2px)"],
)  # fmt: skip
def test_a_style_transform_that_is_none_leaves_the_element_out(transform: str) -> None:
    rest = drawn(RECT.format("") + RECT.format(f'style="transform: {transform}"'))
    assert len(rest.paths) == 1
    assert "cannot be read (rect at line 1: transform" in rest.skipped[0].reason


def test_the_font_size_is_what_em_are_of() -> None:
    for size, wanted in (("", 16), ('font-size="10"', 10), ('style="font-size:2em"', 32),
                         ('font-size="50%"', 8), ('font-size="small"', 13)):  # fmt: skip
        box = extents(drawn(f'<g {size}><rect width="1em" height="2ex"/></g>').paths)
        np.testing.assert_allclose(box[:, 1] - box[:, 0], [wanted, wanted])


@pytest.mark.parametrize(
    ("body", "wanted"),
    [
        (RECT.format('clip-path="url(#c)"'), "1 clip-path of rect is not applied"),
        (f'<g mask="url(#c)">{RECT.format("")}</g>', "1 mask of g is not applied"),
        ("<style>.a{clip-path:url(#c)}</style>" + RECT.format('class="a"') * 2, "2 clip-path"),
        (RECT.format('style="marker-end:url(#c)"'), "1 marker-end of rect is not drawn"),
        (RECT.format('filter="url(#c)"'), "1 filter of rect"),
        ("<style>rect:hover, a + b {fill: red}</style>" + RECT.format(""), "2 rules of <style>"),
        ("<style>@media print {rect {fill: red}}</style>" + RECT.format(""), "1 rules"),
        (f'<svg width="12" height="99">{RECT.format("")}</svg>', "1 pieces reach out of the"),
        (RECT.format('transform="scale(2)" style="transform-box: fill-box"'), "1 transform-box"),
    ],
)
def test_what_is_not_applied_is_told(body: str, wanted: str) -> None:
    drawing = drawn(body)
    (message,) = told(drawing)
    assert message.startswith(wanted)
    assert drawing.paths.vertices.shape[0] >= 4


@pytest.mark.parametrize(
    "body",
    [RECT.format('clip-path="none" mask="none" style="filter:none"'),
     f'<svg width="14" height="26">{RECT.format("")}</svg>',
     f'<svg width="5" height="5" overflow="visible">{RECT.format("")}</svg>',
     f'<style>svg {{overflow: visible}}</style><svg width="5">{RECT.format("")}</svg>',
     f'<defs><clipPath id="c"/><mask/><marker/></defs>{RECT.format("")}'],
)  # fmt: skip
def test_what_changes_nothing_is_not_told(body: str) -> None:
    assert not told(drawn(body))


def test_a_transform_of_the_page_is_told() -> None:
    text = f'<svg {PAGE} transform="scale(2)">{RECT.format("")}</svg>'
    assert told(read(text.encode(), "a.svg", ReadOptions())) == [
        "1 transform of the page is not applied"
    ]


def test_dashed_strokes_can_be_chosen() -> None:
    body = (
        '<line x2="9" stroke="red" stroke-dasharray="2 1"/><line y1="5" y2="9" stroke="red"/>'
        '<line y1="15" y2="19" stroke="red" stroke-dasharray="0"/>'
        '<g style="stroke-dasharray:4"><line y1="25" y2="29" stroke="red"/></g>'
    )
    assert len(drawn(body, select=Selection(line_types=("DASHED",))).paths) == 2
    assert len(drawn(body, select=Selection(line_types=("continuous",))).paths) == 2


def test_colours_and_layers_can_be_chosen() -> None:
    body = f'<g id="cut" stroke="red">{RECT.format("")}</g><g id="fold">{RECT.format("")}</g>'
    assert drawn(body, select=Selection(colours=("#ff0000",))).layers == ("cut",)
    assert drawn(body, select=Selection(layers=("f*",))).layers == ("fold",)
    with pytest.raises(DrawingError, match="no layer matches"):
        drawn(body, select=Selection(layers=("x",)))


@pytest.mark.parametrize(
    ("attributes", "is_drawn"),
    [('systemLanguage="de"', False), ('systemLanguage="de, en-GB"', True),
     ('systemLanguage=""', False), ('requiredExtensions="x"', False), ('opacity="0"', True),
     ('stroke-width="0" stroke="red"', True), ('fill="transparent"', False)],
)  # fmt: skip
def test_what_is_for_others_is_left_out(attributes: str, is_drawn: bool) -> None:
    drawing = drawn('<line x2="5"/>' + RECT.format(attributes))
    assert len(drawing.paths) == 1 + is_drawn
    assert len(drawing.skipped) == 1 - is_drawn


def test_a_used_svg_takes_the_size_of_its_use() -> None:
    inner = (
        '<defs><svg id="s" x="5" y="6" width="20" height="30" viewBox="0 0 10 10">{}</svg></defs>'
    )
    body = inner.format('<rect width="10" height="10"/>')
    for size, wanted in (
        ('width="30" height="40"', [(15, 45), (21, 51)]),
        ('width="10"', [(15, 25), (26, 36)]),
        ("", [(15, 35), (21, 41)]),
    ):
        box = extents(drawn(f'{body}<use href="#s" x="10" y="10" {size}/>').paths)
        (left, right), (low, high) = box
        np.testing.assert_allclose([(left, right), (100 - high, 100 - low)], wanted)


def test_percentages_in_a_symbol_are_of_the_symbol() -> None:
    body = '<symbol id="s" viewBox="0 0 60 50"><rect width="50%" height="50%"/></symbol>'
    box = extents(drawn(body + '<use href="#s" width="60" height="50"/>').paths)
    np.testing.assert_allclose(box, [(0, 30), (75, 100)])


def test_shapes_in_elements_that_nobody_draws_are_counted() -> None:
    drawing = drawn(RECT.format("") + f"<glyph>{RECT.format('') * 2}</glyph><title/>")
    (item,) = drawing.skipped
    assert (item.kind, item.count) == ("rect", 2)


def test_a_page_sized_by_its_style() -> None:
    text = f'<svg style="width: 50mm; height:50mm" viewBox="0 0 100 100">{RECT.format("")}</svg>'
    drawing = read(text.encode(), "a.svg", ReadOptions())
    np.testing.assert_allclose(extents(drawing.paths), [(5, 7), (37, 40)])
