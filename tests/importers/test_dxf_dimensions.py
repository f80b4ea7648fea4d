"""DIMENSION entities as callouts: what they measure, between which places, text and limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.geometry.drawing import Callout, Drawing
from camtool.importers.dxf.mtext import plain_text
from camtool.importers.dxf.reader import read
from camtool.importers.findings import DrawingCode
from camtool.importers.options import ReadOptions, Selection
from camtool.importers.pieces import Unusable
from tests.importers.test_dxf import OPTIONS, R2000, document, drawn
from tests.strategies import examples

WITH_LINES = ReadOptions(dimensions=True)


def only(drawing: Drawing) -> Callout:
    (found,) = drawing.callouts
    return found


def unread(drawing: Drawing) -> list[str]:
    return [f.message for f in drawing.findings if f.code == DrawingCode.CALLOUT_NOT_READ]


def plate(units: int = 4, version: str = "R2000"):
    """A document with a hole, so that something is drawn beside the dimensions."""
    doc = document(version, units)
    doc.modelspace().add_circle((10, 10), 3)
    return doc


def linear(doc, **more):
    """A dimension of 20 between (0, 0) and (20, 5), along x."""
    given = {"base": (0, 8), "p1": (0, 0), "p2": (20, 5), **more}
    dimension = doc.modelspace().add_linear_dim(**given)
    dimension.render()
    return dimension


@pytest.mark.parametrize("options", [OPTIONS, WITH_LINES])
@pytest.mark.parametrize("version", ["R12", "R2000", "R2018"])
def test_what_each_kind_measures(version, options):
    doc = plate(version=version)
    space = doc.modelspace()
    linear(doc)
    linear(doc, angle=90)
    aligned = space.add_aligned_dim(p1=(0, 0), p2=(3, 4), distance=2)
    aligned.render()
    aligned.dimension.dxf.dimtype = 1  # ezdxf makes a rotated one
    space.add_diameter_dim(center=(10, 10), radius=3, angle=45).render()
    space.add_radius_dim(center=(10, 10), radius=3, angle=90).render()
    found = drawn(doc, options).callouts
    assert [(each.kind, each.direction_rad) for each in found] == [
        ("linear", 0.0),
        ("linear", pytest.approx(math.pi / 2)),
        ("linear", None),
        ("diameter", None),
        ("radius", None),
    ]
    assert [each.measured_mm for each in found] == pytest.approx([20, 5, 5, 6, 3])
    assert found[0].points_mm == ((0, 0), (20, 5))
    assert math.dist(*found[3].points_mm) == pytest.approx(6)
    assert np.mean(found[3].points_mm, axis=0) == pytest.approx((10, 10))
    assert found[4].points_mm == (pytest.approx((10, 10)), pytest.approx((10, 13)))
    assert all(each.source.startswith("DIMENSION ") and not each.text for each in found)
    assert all(each.upper_mm is None and each.lower_mm is None for each in found)


def test_callouts_stay_whatever_is_selected():
    doc = plate()
    linear(doc, dxfattribs={"layer": "SIZES"})
    found = drawn(doc, ReadOptions(select=Selection(exclude_layers=("SIZES",))))
    assert only(found).layer == "SIZES"


def test_those_on_hidden_layers_do_not_count():
    doc = plate()
    doc.layers.add("OFF").off()
    linear(doc, dxfattribs={"layer": "OFF"})
    assert not drawn(doc).callouts


def test_what_is_not_inspected_is_named_with_and_without_its_lines():
    doc = plate()
    space = doc.modelspace()
    space.add_angular_dim_2l(base=(5, 5), line1=((0, 0), (9, 0)), line2=((0, 0), (0, 9))).render()
    space.add_angular_dim_3p(base=(5, 5), center=(0, 0), p1=(9, 0), p2=(0, 9)).render()
    space.add_ordinate_x_dim(feature_location=(4, 4), offset=(0, 5)).render()
    space.add_arc_dim_3p(base=(5, 5), center=(0, 0), p1=(9, 0), p2=(0, 9)).render()
    linear(doc, p2=(0, 5))  # along x it measures nothing
    linear(doc, text=" ")
    for options in (OPTIONS, WITH_LINES):
        found = drawn(doc, options)
        assert not found.callouts
        assert sorted(unread(found)) == [
            "1 ARC_DIMENSION cannot be inspected: is the length of an arc",
            "1 DIMENSION cannot be inspected: is an ordinate",
            "1 DIMENSION cannot be inspected: measures nothing",
            "1 DIMENSION cannot be inspected: shows no text",
            "2 DIMENSION cannot be inspected: is an angle",
        ]


# Limits by style and by override.

SYMMETRIC = {"dimtol": 1, "dimtp": 0.05, "dimtm": 0.05}
UNEQUAL = {"dimtol": 1, "dimtp": 0.1, "dimtm": 0.2}
AS_LIMITS = {"dimlim": 1, "dimtp": 0.3, "dimtm": -0.1}


@pytest.mark.parametrize(
    ("values", "upper", "lower"),
    [
        (SYMMETRIC, 0.05, -0.05),
        (UNEQUAL, 0.1, -0.2),
        (AS_LIMITS, 0.3, 0.1),
        ({**UNEQUAL, "dimtol": 0}, None, None),
    ],
)
@pytest.mark.parametrize("version", ["R12", "R2000"])
def test_limits_by_style_and_by_override(version, values, upper, lower):
    doc = plate(version=version)
    doc.dimstyles.new("FITS").dxf.update(values)
    doc.dimstyles.new("LOUD").dxf.update({"dimtol": 1, "dimtp": 9, "dimtm": 9})
    linear(doc, dimstyle="FITS")
    linear(doc, dimstyle="LOUD", override={"dimlim": 0, "dimtol": 0, **values})
    for each in drawn(doc).callouts:
        assert (each.upper_mm, each.lower_mm) == (upper, lower)


def test_limits_are_in_the_unit_that_the_dimension_shows():
    doc = plate(units=1)  # inches
    linear(doc, override=UNEQUAL)
    linear(doc, override={**UNEQUAL, "dimlfac": 25.4})
    linear(doc, override={**UNEQUAL, "dimlfac": -3})  # for layouts
    found = drawn(doc).callouts
    assert [each.measured_mm for each in found] == pytest.approx([508, 508, 508])
    assert [each.upper_mm for each in found] == pytest.approx([2.54, 0.1, 2.54])
    assert [each.lower_mm for each in found] == pytest.approx([-5.08, -0.2, -5.08])
    assert [each.mm_per_unit for each in found] == [25.4, 1.0, 25.4]
    assert {each.scale for each in found} == {1.0}
    doc = plate()  # mm
    linear(doc, override={**UNEQUAL, "dimlfac": 0.03937})
    assert only(drawn(doc)).mm_per_unit == 25.4
    assert only(drawn(doc)).upper_mm == pytest.approx(2.54)


def test_a_view_of_another_scale_says_so():
    doc = plate()
    linear(doc, override={**UNEQUAL, "dimlfac": 0.5})  # drawn twice as large
    found = only(drawn(doc))
    assert (found.measured_mm, found.scale, found.upper_mm) == (20.0, 0.5, 0.1)
    doc = plate()
    block = doc.blocks.new("VIEW")
    block.add_linear_dim(base=(0, 8), p1=(0, 0), p2=(20, 5)).render()
    doc.modelspace().add_blockref("VIEW", (0, 0), {"xscale": 4, "yscale": 4, "zscale": 4})
    scaled = drawn(doc).callouts[-1]
    assert (scaled.measured_mm, scaled.scale) == (pytest.approx(80), 0.25)


def test_a_frame_around_the_text_makes_it_exact():
    doc = plate()
    linear(doc, override={"dimgap": -0.6})
    assert only(drawn(doc)).exact


@examples(20, 2000)
@given(
    st.floats(-180, 180),
    st.sampled_from([1.0, -1.0]),
    st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
    st.floats(0, 180),
)
def test_turned_and_mirrored_blocks_measure_the_same(turn, mirror, at, angle):
    doc = plate()
    block = doc.blocks.new("PART")
    block.add_linear_dim(base=(0, 8), p1=(1, 2), p2=(20, 5), angle=angle).render()
    block.add_diameter_dim(center=(3, 4), radius=2, angle=angle).render()
    attributes = {"rotation": turn, "xscale": mirror}
    doc.modelspace().add_blockref("PART", at, attributes)
    straight = math.radians(angle)
    along = abs(19 * math.cos(straight) + 3 * math.sin(straight))
    if along < 1e-3:
        return
    found, circle = drawn(doc).callouts
    assert found.measured_mm == pytest.approx(along)
    assert circle.measured_mm == pytest.approx(4)
    cosine, sine = math.cos(math.radians(turn)), math.sin(math.radians(turn))

    def moved(x, y):
        x *= mirror
        return at[0] + cosine * x - sine * y, at[1] + sine * x + cosine * y

    assert found.points_mm[0] == pytest.approx(moved(1, 2))
    assert found.points_mm[1] == pytest.approx(moved(20, 5))
    assert np.mean(circle.points_mm, axis=0) == pytest.approx(moved(3, 4))
    wanted = math.radians(turn) + math.atan2(math.sin(straight), mirror * math.cos(straight))
    assert math.sin(found.direction_rad - wanted) == pytest.approx(0, abs=1e-9)
    assert 0 <= found.direction_rad < math.pi + 1e-12


def test_unequal_scales_are_named():
    doc = plate()
    block = doc.blocks.new("PART")
    block.add_linear_dim(base=(0, 8), p1=(0, 0), p2=(20, 5)).render()
    doc.modelspace().add_blockref("PART", (0, 0), {"xscale": 2})
    assert unread(drawn(doc)) == [
        "1 DIMENSION cannot be inspected: stands in a block of unequal scales"
    ]


# Texts.


@pytest.mark.parametrize(
    ("raw", "plain"),
    [
        ("<>", ""),
        ("%%c6 H7", "Ø6 H7"),
        ("20 %%p0.05", "20 ±0.05"),
        ("%%P0,05", "±0,05"),
        (r"\A1;20\S+0.1^ -0.2;", "20 +0.1/-0.2"),
        (r"\A1;20{\H0.7x;\S+0.1^-0.2;}", "20 +0.1/-0.2"),
        (r"{\fArial|b0|i0|c0|p34;\C1;%%c<> H7}", "Ø<> H7"),
        (r"4x %%c5\~H7\Pdrilled", "4x Ø5 H7 drilled"),
        (r"R3 +0.1/0\Xtyp.", "R3 +0.1/0 typ."),
        (r"%%c6 \SH7/g6;", "Ø6 H7/g6"),
        (r"2\S1/2;", "2 1⁄2"),
        (r"\U+22056 \U+00B10.1", "∅6 ±0.1"),
        ("<>%%p.1 []", "<>±.1"),
    ],
)
@pytest.mark.parametrize("version", ["R2000", "R2007"])
def test_texts_without_their_codes(version, raw, plain):
    doc = plate(version=version)
    linear(doc).dimension.dxf.text = raw
    assert only(drawn(doc)).text == plain


def test_what_a_style_writes_around_the_number():
    for post, text, plain in [
        ("%%c<> H7", "", "Ø<> H7"),
        (" mm", "", "<> mm"),
        ("<> H7[] x", "4x <>", "4x <> H7"),
        ("<> H7", "20", "20"),
    ]:
        doc = plate()
        doc.dimstyles.new("POST").dxf.dimpost = post
        linear(doc).dimension.dxf.update({"text": text, "dimstyle": "POST"})
        assert only(drawn(doc)).text == plain


@given(st.text(max_size=40) | st.text(alphabet="\\S^/#;{}%pc<>AHX+-.0159 \n", max_size=40))
@example(r"\S")
@example(r"\A")
@example("{{{")
@example("^")
def test_any_text_is_read_or_named(raw):
    try:
        found = plain_text(raw)
    except Unusable:
        return
    assert isinstance(found, str)


# By hand, as programs write them: each line is a group code and its value.


def dxf(*groups: str, tables: str = "", header: str = R2000) -> bytes:
    """A DXF of these entities; each text is one entity, its groups "code value" by lines."""
    words = ["0", "SECTION", "2", "HEADER", *header.split(), "0", "ENDSEC"]
    lines = [part for text in groups for part in text.strip().split("\n")]
    body = [word for line in lines for word in line.strip().partition(" ")[::2]]
    styles = [w for line in tables.strip().split("\n") for w in line.strip().partition(" ")[::2]]
    if tables:
        words += ["0", "SECTION", "2", "TABLES", *styles, "0", "ENDSEC"]
    words += ["0", "SECTION", "2", "ENTITIES", *body]
    return "\n".join([*words, "0", "ENDSEC", "0", "EOF", ""]).encode()


CIRCLE = """0 CIRCLE
5 1F
100 AcDbEntity
8 0
100 AcDbCircle
10 10
20 10
40 3"""

ISO_25 = """0 TABLE
2 DIMSTYLE
5 A
100 AcDbSymbolTable
70 1
0 DIMSTYLE
105 27
100 AcDbSymbolTableRecord
100 AcDbDimStyleTableRecord
2 ISO-25
70 0
47 0.021
48 0.0
71 1
144 1.0
0 ENDTAB"""
"""As AutoCAD writes a style with deviations."""


def autocad(text: str = "", dstyle: str = "") -> str:
    """A diameter of 6 at (10, 10), as AutoCAD writes it."""
    said = f"\n1 {text}" if text else ""
    return f"""0 DIMENSION
5 2A1
330 1F
100 AcDbEntity
8 DIMS
100 AcDbDimension
280 0
2 *D4
10 13.0
20 10.0
30 0.0
11 18.0
21 18.0
31 0.0
70 163{said}
71 5
42 6.0
3 ISO-25
100 AcDbDiametricDimension
15 7.0
25 10.0
35 0.0
40 0.0{dstyle}"""


OVERRIDE = """
1001 ACAD
1000 DSTYLE
1002 {
1070 47
1040 0.1
1070 71
1070 1
1070 48
1040 0.2
1070 176
1070 3
1002 }"""


def test_a_dimension_of_autocad_with_the_limits_of_its_style():
    found = only(read(dxf(CIRCLE, autocad(), tables=ISO_25), "a.dxf", OPTIONS))
    assert (found.kind, found.measured_mm, found.layer) == ("diameter", 6.0, "DIMS")
    assert found.points_mm == ((13.0, 10.0), (7.0, 10.0))
    assert (found.upper_mm, found.lower_mm, found.source) == (0.021, 0.0, "DIMENSION 2A1")


def test_a_dimension_of_autocad_with_limits_of_its_own():
    data = dxf(CIRCLE, autocad(dstyle=OVERRIDE), tables=ISO_25)
    found = only(read(data, "a.dxf", OPTIONS))
    assert (found.upper_mm, found.lower_mm) == (0.1, -0.2)
    # A style that the file lacks says nothing.
    found = only(read(dxf(CIRCLE, autocad()), "a.dxf", OPTIONS))
    assert (found.upper_mm, found.lower_mm) == (None, None)
    found = only(read(dxf(CIRCLE, autocad(dstyle=OVERRIDE)), "a.dxf", OPTIONS))
    assert (found.upper_mm, found.lower_mm) == (0.1, -0.2)


def test_a_dimension_of_autocad_with_a_stacked_tolerance_in_its_text():
    text = r"\A1;%%c<>{\H0.71x;\S+0.1^ -0.2;}"
    found = only(read(dxf(CIRCLE, autocad(text), tables=ISO_25), "a.dxf", OPTIONS))
    assert found.text == "Ø<> +0.1/-0.2"


def librecad(text: str) -> str:
    """A dimension along x from (0, 0) to (20, 5), as LibreCAD writes it: no overrides, and signs
    by their codes."""
    return f"""0 DIMENSION
5 32
100 AcDbEntity
8 0
6 ByLayer
62 256
370 -1
100 AcDbDimension
10 20.0
20 15.0
30 0.0
11 10.0
21 16.0
31 0.0
70 32
1 {text}
71 5
72 1
41 1.0
42 0.0
3 Standard
100 AcDbAlignedDimension
13 0.0
23 0.0
33 0.0
14 20.0
24 5.0
34 0.0
50 0.0
100 AcDbRotatedDimension"""


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("", ""),
        ("20 %%p0.05", "20 ±0.05"),
        (r"<> \S+0.1^-0.2;", "<> +0.1/-0.2"),
        ("%%c20 H7", "Ø20 H7"),
    ],
)
def test_a_dimension_of_librecad(text, plain):
    found = only(read(dxf(CIRCLE, librecad(text)), "a.dxf", OPTIONS))
    assert (found.kind, found.measured_mm, found.direction_rad) == ("linear", 20.0, 0.0)
    assert found.text == plain
    assert found.upper_mm is None


def test_a_large_radius():
    """Groups 10 and 15 of a jogged radius are its centre and the place on the arc; at 13 and 14
    the line is broken."""
    large = """0 LARGE_RADIAL_DIMENSION
5 37C
100 AcDbEntity
8 0
100 AcDbDimension
10 -90
20 10
30 0
70 169
42 100.0
3 Standard
100 AcDbRadialDimensionLarge
13 -20
23 12
33 0
14 -15
24 11
34 0
15 10
25 10
35 0
40 0.7854"""
    found = only(read(dxf(CIRCLE, large), "a.dxf", OPTIONS))
    assert (found.kind, found.measured_mm) == ("radius", 100.0)
    assert found.points_mm == ((-90.0, 10.0), (10.0, 10.0))


@given(
    st.sampled_from(["10", "13", "14", "15", "23", "24", "50", "70", "42", "1040", "1070", "3"]),
    st.sampled_from(["nan", "1e400", "-7", "x", "99999999999", ""]),
)
def test_damaged_dimensions_are_read_named_or_one_line(code, value):
    lines = (autocad(dstyle=OVERRIDE) + "\n" + librecad("<>")).split("\n")
    damaged = [f"{code} {value}" if line.startswith(f"{code} ") else line for line in lines]
    try:
        found = read(dxf(CIRCLE, "\n".join(damaged), tables=ISO_25), "a.dxf", OPTIONS)
    except DrawingError as error:
        assert "\n" not in str(error)  # noqa: PT017
        return
    named = sum(f.measured for f in found.findings if f.code == DrawingCode.CALLOUT_NOT_READ)
    hidden = sum(each.count for each in found.skipped if each.kind == "DIMENSION")
    assert len(found.callouts) + named == 2 == hidden
