"""Dimensions of callouts and of tolerances.toml: read, brought together, and what is refused."""

from __future__ import annotations

import math
import re
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import CamtoolError
from camtool.findings import Severity
from camtool.geometry.drawing import Callout
from camtool.inspection.dimensions import Limits
from camtool.inspection.findings import InspectionCode
from camtool.inspection.limits import limits_of
from camtool.inspection.tolerances import dimensions_of, read_text, read_tolerances
from camtool.records import replace
from tests.importers.test_dxf import document, drawn


def part():
    """A plate of 40 by 20 with four holes of 5 and one of 6, both sizes as drawn."""
    doc = document()
    space = doc.modelspace()
    space.add_lwpolyline([(0, 0), (40, 0), (40, 20), (0, 20)], close=True)
    for at in ((5, 5), (35, 5), (5, 15), (35, 15)):
        space.add_circle(at, 2.5)
    space.add_circle((20, 10), 3)
    return doc


def with_text(doc, text: str, **override):
    """The part with the diameter of its bore dimensioned, and this text."""
    dimension = doc.modelspace().add_diameter_dim(
        center=(20, 10), radius=3, angle=30, override=override
    )
    dimension.render()
    dimension.dimension.dxf.text = text
    return doc


def write(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "tolerances.toml"
    file.write_text(text, encoding="utf-8")
    return file


# Texts of callouts.


@pytest.mark.parametrize(
    ("text", "count", "sign", "nominal", "words", "bare"),
    [
        ("", 1, "", None, "", False),
        ("<>", 1, "", None, "", False),
        ("Ø6 H7", 1, "Ø", 6, "H7", False),
        ("⌀6H7", 1, "Ø", 6, "H7", False),
        ("20 ±0.05", 1, "", 20, "±0.05", False),
        ("20±0,05 mm", 1, "", 20, "±0.05 mm", False),
        ("20 mm", 1, "", 20, "", False),
        ("R3 +0.1/0", 1, "R", 3, "+0.1/0", False),
        ("R3 +0.1/0 typ.", 1, "R", 3, "+0.1/0", False),
        ("4x Ø5 H7", 4, "Ø", 5, "H7", False),
        ("4 × Ø 5 H7 THRU", 4, "Ø", 5, "H7", False),
        ("20 0/-0.1", 1, "", 20, "0/-0.1", False),
        ("Ø<> +0.1 -0.2", 1, "Ø", None, "+0.1 -0.2", False),
        ("20.1/19.9", 1, "", None, "20.1/19.9", False),
        ("Ø20.1/19.9", 1, "Ø", None, "20.1/19.9", False),
        ("(20)", 1, "", 20, "", True),
        ("[<>]", 1, "", None, "", True),
        ("0.787in", 1, "", pytest.approx(19.9898), "", False),
    ],
)
def test_texts_of_callouts(text, count, sign, nominal, words, bare):
    said = read_text(text)
    assert said is not None
    assert (said.count, said.sign, said.nominal_mm) == (count, sign, nominal)
    assert (said.words, said.bare) == (words, bare)


@pytest.mark.parametrize("text", ["see note", "M6", "2 1/2", "2x45°", "0x Ø5", "Ø", "SR4", "20 /"])
def test_texts_that_are_no_sizes(text):
    assert read_text(text) is None


@given(st.text() | st.text(alphabet="0123456789.,x×ØR<>()[]+-±/ HhJS7mint%p", max_size=30))
def test_any_text_of_a_callout_is_read_or_not(text):
    said = read_text(text)
    assert said is None or said.count >= 1


# Callouts.


@pytest.mark.parametrize(
    ("text", "override", "limits"),
    [
        ("%%c6 H7", {}, Limits(0.0, 0.012, "H7")),
        ("%%c<> H7", {}, Limits(0.0, 0.012, "H7")),
        (r"\A1;6\S+0.1^ -0.2;", {}, Limits(-0.2, 0.1, "+0.1/-0.2")),
        ("6.1/5.95", {}, Limits(-0.05, 0.1, "+0.1/-0.05")),
        ("", {"dimtol": 1, "dimtp": 0.1, "dimtm": 0.2}, Limits(-0.2, 0.1, "+0.1/-0.2")),
        ("%%c<>", {"dimlim": 1, "dimtp": 0.05, "dimtm": 0.05}, Limits(-0.05, 0.05, "±0.05")),
        # The style's limits belong to "<>": a text without it does not show them.
        ("6", {"dimtol": 1, "dimtp": 0.1, "dimtm": 0.2}, None),
        ("(<>)", {"dimtol": 1, "dimtp": 0.1, "dimtm": 0.2}, None),
        ("6", {}, None),
    ],
)
def test_the_limits_of_a_callout(text, override, limits):
    (bore,), findings = dimensions_of(drawn(with_text(part(), text, **override)))
    assert (bore.kind, bore.nominal_mm, bore.limits) == ("diameter", 6.0, limits)
    assert math.dist(bore.places_mm[0], (20, 10)) == pytest.approx(3)
    assert not findings


def test_the_general_tolerance_is_for_those_without_limits(tmp_path):
    file = write(tmp_path, 'general = "ISO 2768-m"\n')
    for text, said in [("6", "ISO 2768-m"), ("6 H7", "H7"), ("(6)", None), ("[6]", None)]:
        (bore,), _ = dimensions_of(drawn(with_text(part(), text)), file)
        assert (bore.limits and bore.limits.said) == said


def test_in_inches():
    doc = document(units=1)
    doc.modelspace().add_circle((2, 1), 0.5)
    dimension = doc.modelspace().add_radius_dim(center=(2, 1), radius=0.5, angle=0)
    dimension.render()
    dimension.dimension.dxf.text = "%%c1.000 +.002/0"
    (bore,), _ = dimensions_of(drawn(doc))
    assert (bore.kind, bore.nominal_mm) == ("diameter", 25.4)
    assert bore.limits == Limits(0.0, pytest.approx(0.0508), "+0.0508/0")


def test_a_count_is_for_all_of_that_size_if_there_are_as_many():
    doc = part()
    dimension = doc.modelspace().add_diameter_dim(center=(5, 5), radius=2.5, angle=0)
    dimension.render()
    dimension.dimension.dxf.text = "4x %%c5 H7"
    found, findings = dimensions_of(drawn(doc))
    assert not findings
    assert {each.limits.said for each in found} == {"H7"}
    centres = [(5, 5), (35, 5), (5, 15), (35, 15)]
    near = [min(centres, key=lambda c: math.dist(c, each.places_mm[0])) for each in found]
    assert sorted(near) == sorted(centres)
    assert len({each.name for each in found}) == 4
    dimension.dimension.dxf.text = "3x %%c5 H7"
    found, findings = dimensions_of(drawn(doc))
    assert len(found) == 1
    assert [each.code for each in findings] == [InspectionCode.COUNT_DIFFERS]


def test_a_text_that_is_not_what_is_drawn_is_an_error_with_its_place():
    found, (finding,) = dimensions_of(drawn(with_text(part(), "6.5 H7")))
    assert not found
    assert (finding.code, finding.severity) == (InspectionCode.DIMENSION_DIFFERS, Severity.ERROR)
    assert (finding.measured, finding.limit) == (6.0, 6.5)
    assert re.search(r"test\.dxf, DIMENSION \w+, at \(17\.402, 8\.500\) mm", finding.where)


def test_what_is_not_understood_or_of_another_scale_is_named_and_not_inspected():
    for text, override, code in [
        ("see note 3", {}, InspectionCode.CALLOUT_TEXT),
        ("6 min", {}, InspectionCode.CALLOUT_TEXT),
        ("\x1b[2J", {}, InspectionCode.CALLOUT_TEXT),
        ("6 H7", {"dimlfac": 0.5}, InspectionCode.DIMENSION_DIFFERS),
    ]:
        found, (finding,) = dimensions_of(drawn(with_text(part(), text, **override)))
        assert not found
        assert (finding.code, finding.severity) == (code, Severity.WARNING)
        assert "\x1b" not in finding.message


@pytest.mark.parametrize(
    ("text", "override", "says"),
    [
        ("6 P7", {}, "class P7 of 6 mm is not in the tables"),
        ("6 H7/g6", {}, "fit of two parts"),
        ("6 -0.2/+0.1", {}, "wrong way round"),
        ("6 +0.1", {}, r"one number of two.*\+0\.1/0"),
        ("", {"dimtol": 1, "dimtp": -0.2, "dimtm": 0.1 - 0.2}, "wrong way round"),
        ("", {"dimtol": 1, "dimtp": 0, "dimtm": 0}, "no room"),
    ],
)
def test_limits_of_a_callout_that_are_wrong_are_one_line_unless_the_file_says_others(
    text, override, says, tmp_path
):
    drawing = drawn(with_text(part(), text, **override))
    with pytest.raises(CamtoolError, match=says) as told:
        dimensions_of(drawing)
    assert told.value.exit_code == 2
    assert re.match(r"test\.dxf: DIMENSION \w+, at \(.*\) mm: ", str(told.value))
    assert "tolerances.toml" in told.value.mend
    mended = '[[dimension]]\nkind = "diameter"\nat = [20, 10]\nlimits = "+0.1/-0.1"\n'
    (bore,), (finding,) = dimensions_of(drawing, write(tmp_path, mended))
    assert bore.limits == Limits(-0.1, 0.1, "±0.1")
    assert finding.code == InspectionCode.DIMENSION_TWICE


def test_two_callouts_of_one_bore():
    doc = with_text(with_text(part(), "6"), "6 H7")
    (bore,), (finding,) = dimensions_of(drawn(doc))
    assert bore.limits == Limits(0.0, 0.012, "H7")
    assert (finding.code, finding.severity) == (InspectionCode.DIMENSION_TWICE, Severity.INFO)
    (bore,), findings = dimensions_of(drawn(with_text(doc, "6 H8")))
    assert bore.limits == Limits(0.0, 0.012, "H7")
    (finding,) = [each for each in findings if each.severity == Severity.WARNING]
    assert "other limits (H8, there H7)" in finding.message


@given(
    st.sampled_from(["6 H7", "<> +0.1/-0.2", "6 ±0.05", "(6)"]),
    st.floats(-180, 180),
    st.sampled_from([1.0, -1.0]),
)
def test_turned_and_mirrored_parts_have_the_same_dimensions(text, turn, mirror):
    straight = drawn(with_text(part(), text))
    doc = document()
    block = doc.blocks.new("PART")
    block.add_circle((20, 10), 3)
    dimension = block.add_diameter_dim(center=(20, 10), radius=3, angle=30)
    dimension.render()
    dimension.dimension.dxf.text = text
    doc.modelspace().add_blockref("PART", (7, 8), {"rotation": turn, "xscale": mirror})
    (one,), _ = dimensions_of(straight)
    (other,), findings = dimensions_of(drawn(doc))
    assert not findings
    assert (one.kind, one.limits) == (other.kind, other.limits)
    assert one.nominal_mm == pytest.approx(other.nominal_mm)


# tolerances.toml

FILE = """
general = "ISO 2768-m"

[[dimension]]
name = "bore"
kind = "diameter"
at = ["20mm", "10mm"]
limits = "H7"

[[dimension]]
name = "length"
kind = "distance"
from = [0, 10]
to = ["4cm", 10]
direction = "x"
nominal = "40mm"
limits = "±50um"

[[dimension]]
kind = "width"
from = [20, 0]
to = [20, 20]

[[dimension]]
kind = "position"
at = [20, 10]
zone = "0.1mm"

[[dimension]]
kind = "distance"
from = [5, 5]
to = [35, 15]
direction = 90
"""


def test_a_file_of_every_kind(tmp_path):
    drawing = drawn(part())
    found, findings = dimensions_of(drawing, write(tmp_path, FILE))
    assert not findings
    assert [each.name for each in found] == [
        "bore",
        "length",
        "width 3",
        "position 4",
        "distance 5",
    ]
    assert [each.kind for each in found] == [
        "diameter",
        "distance",
        "distance",
        "position",
        "distance",
    ]
    assert [each.nominal_mm for each in found] == pytest.approx([6, 40, 20, None, 10])
    assert [each.limits for each in found] == [
        Limits(0.0, 0.012, "H7"),
        Limits(-0.05, 0.05, "±0.05"),
        Limits(-0.2, 0.2, "ISO 2768-m"),
        Limits(0.0, 0.1, "zone 0.1"),
        Limits(-0.2, 0.2, "ISO 2768-m"),
    ]
    assert found[1].places_mm == ((0, 10), (40, 10))
    assert [each.direction_rad for each in found[1:3]] == [0.0, None]
    assert found[4].direction_rad == pytest.approx(math.pi / 2)
    assert found[0].source == "tolerances.toml, dimension 1"


def test_the_file_holds_where_a_callout_measures_the_same(tmp_path):
    drawing = drawn(with_text(part(), "6 H11"))
    found, findings = dimensions_of(drawing, write(tmp_path, FILE))
    assert found[0].limits == Limits(0.0, 0.012, "H7")
    assert len(found) == 5
    (finding,) = findings
    assert finding.code == InspectionCode.DIMENSION_TWICE
    assert "tolerances.toml, dimension 1, which holds" in finding.message


def test_two_dimensions_of_a_file_that_measure_the_same(tmp_path):
    text = BORE + 'limits = "H7"\n' + BORE.replace("[20, 10]", "[23, 10]") + 'limits = "{}"\n'
    for limits, severity in (("+0.012/0", Severity.INFO), ("H8", Severity.WARNING)):
        said, (finding,) = dimensions_of(drawn(part()), write(tmp_path, text.format(limits)))
        assert [each.limits.said for each in said] == ["H7"]
        assert (finding.code, finding.severity) == (InspectionCode.DIMENSION_TWICE, severity)
        assert "tolerances.toml, dimension 2" in finding.where


def test_limits_wait_for_a_feature_that_is_not_there(tmp_path):
    nowhere = '[[dimension]]\nkind = "diameter"\nat = [1, 1]\nlimits = "H7"\n'
    (bore,), findings = dimensions_of(drawn(part()), write(tmp_path, nowhere))
    assert (bore.limits, bore.words) == (None, "H7")
    assert not findings


def test_a_nominal_size_that_is_not_drawn_is_an_error(tmp_path):
    wrong = '[[dimension]]\nkind = "diameter"\nat = [20, 10]\nnominal = "6in"\n'
    found, (finding,) = dimensions_of(drawn(part()), write(tmp_path, wrong))
    assert not found
    assert (finding.code, finding.severity) == (InspectionCode.DIMENSION_DIFFERS, Severity.ERROR)


BORE = '[[dimension]]\nkind = "diameter"\nat = [20, 10]\n'
LONG = '[[dimension]]\nkind = "distance"\nfrom = [0, 10]\nto = [40, 10]\n'


@pytest.mark.parametrize(
    ("text", "where", "says", "mend"),
    [
        ("general = 5", "key general", "Expected `str`", ""),
        ('general = "ISO 2768-x"', "key general", "not known", "ISO 2768-m"),
        ('generel = "ISO 2768-m"', "key generel", "unknown key", "did you mean|general"),
        (BORE + "tol = 1", r"table \[dimension 1\], key tol", "unknown key", "known keys"),
        (LONG + BORE + "tol = 1", r"table \[dimension 2\], key tol", "unknown key", "known keys"),
        ('[[dimension]]\nkind = "angle"', "key kind", "Invalid value", "diameter, distance"),
        ('[[dimension]]\nkind = "diameter"', "dimension 1, key at", "missing", "at = "),
        ("", "", "says nothing", "tolerances new"),
        ("# general = 1", "", "says nothing", "tolerances new"),
        (
            BORE.replace("[[", "[").replace("]]", "]"),
            "dimension",
            "single table",
            r"\[\[dimension",
        ),
        (BORE + 'nominal = "6in"\nlimits = "±1mm"', "key limits", "in inches", "one unit"),
        (BORE + LONG + "direction = nan", "dimension 2.direction", "not finite", "number"),
        ("dimension = 3", "key dimension", "Expected `array`", ""),
        ("[[dimension]]\nat = [1, 2]", "key kind", "missing", ""),
        (BORE + 'limits = "+0.1/+0.2"', "dimension 1, key limits", "wrong way round", r"\+0\.2/"),
        (BORE + 'limits = "H7/g6"', "dimension 1, key limits", "two parts", "H7"),
        (
            BORE + 'limits = "P7"',
            "dimension 1",
            "class P7 of 6 mm is not in the tables",
            "numbers",
        ),
        (BORE + 'nominal = "6mm"\nlimits = "P7"', "key limits", "class P7 of 6 mm", "numbers"),
        (BORE + 'nominal = "6mm"\nlimits = "±0.002in"', "key limits", "contradict", "one unit"),
        (BORE + 'nominal = "6 furlong"', "key nominal", "unknown unit", "mm"),
        (BORE + "nominal = -6", "key nominal", "not between", "correct"),
        (BORE + 'zone = "0.1mm"', "key zone", "diameter has no zone", "at, nominal, limits"),
        (BORE + "to = [1, 2]", "key to", "diameter has no to", "takes at"),
        (BORE + "at = [1]", "", "is no TOML", ""),
        (LONG + 'direction = "z"', "key direction", "is no number", '"x", "y"'),
        (LONG + "direction = inf", "key dimension 1.direction", "not finite", ""),
        (LONG.replace("40", "0"), "dimension 1", "same place", "differ"),
        ('[[dimension]]\nkind = "position"\nat = [20, 10]\nzone = 0', "key zone", "0 holds", ""),
        (
            '[[dimension]]\nkind = "profile"\nat = [0, 0]\nlimits = "H7"',
            "limits",
            "no limits",
            "zone",
        ),
    ],
)
def test_files_that_are_wrong_are_one_line_with_place_and_mend(text, where, says, mend, tmp_path):
    file = write(tmp_path, text)
    with pytest.raises(CamtoolError, match=says) as told:
        dimensions_of(drawn(part()), file)
    error = told.value
    assert error.exit_code == 2
    assert "\n" not in str(error)
    assert re.search(where, error.where or "")
    assert re.search(mend, error.mend)
    assert "tolerances.toml" in str(error) or "dimension 1" in str(error)


@given(st.text(alphabet="[]dimensonkia=\"\n'tHh7+-±0.1 ,{}", max_size=60))
def test_any_file_is_read_or_one_line(text):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "tolerances.toml"
        file.write_text(text, encoding="utf-8")
        told = None
        try:
            read_tolerances(file)
        except CamtoolError as error:
            told = str(error)
    assert told is None or "\n" not in told


@given(
    st.sampled_from([("mm", 1.0), ("in", 25.4), ("um", 0.001), ("cm", 10.0)]),
    st.integers(1, 39_000),
)
def test_sizes_in_any_unit(unit, size):
    name, mm = unit
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "t.toml"
        file.write_text(f'{BORE}nominal = "{size}{name}"', encoding="utf-8")
        _, (bore,) = read_tolerances(file)
    assert bore.nominal_mm == pytest.approx(size * mm)


def test_a_callout_on_nothing_stays_for_the_binder():
    drawing = drawn(part())
    loose = Callout("linear", ((1.0, 1.0), (3.0, 1.0)), 2.0, "2 ±0.1", "0", "DIMENSION X", 0.0)
    (one,), findings = dimensions_of(replace(drawing, callouts=(loose,)))
    assert one.limits == limits_of("±0.1", 2.0)
    assert not findings


@pytest.mark.parametrize(
    ("text", "nominal", "lower", "upper"),
    [("", 7.004, 0.0, 0.015), ("7 H7", 7.0, 0.0, 0.015), ("7.1/6.95", 7.004, -0.054, 0.096)],
)
def test_what_is_drawn_counts_not_the_rounded_places_of_a_dimension(text, nominal, lower, upper):
    doc = document()
    doc.modelspace().add_circle((20, 10), 3.502)
    said = text or "<> H7"
    dimension = doc.modelspace().add_diameter_dim(center=(20, 10), radius=3.5, angle=0)
    dimension.render()
    dimension.dimension.dxf.text = said
    (bore,), findings = dimensions_of(drawn(doc))
    assert not findings
    assert bore.nominal_mm == pytest.approx(nominal)
    assert bore.limits.lower_mm == pytest.approx(lower)
    assert bore.limits.upper_mm == pytest.approx(upper)
