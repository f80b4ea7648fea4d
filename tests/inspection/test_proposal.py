"""The tolerances.toml that a drawing begins names what is drawn, and is read back as it is."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import InputError
from camtool.geometry.drawing import Drawing
from camtool.importers.read import read_drawing
from camtool.inspection.features import BoundDimension, bind, features_of
from camtool.inspection.proposal import MAX_DIMENSIONS, propose_file
from camtool.inspection.tolerances import dimensions_of
from tests.importers.test_dxf import document, drawn
from tests.inspection.test_tolerances import part, with_text

SAMPLES = Path(__file__).parents[2] / "samples"


def rows(drawing: Drawing) -> list[dict]:
    text, findings, _ = propose_file(drawing)
    assert not findings
    return tomllib.loads(text)["dimension"]


def read_back(drawing: Drawing, folder: Path):
    file = folder / "tolerances.toml"
    file.write_text(propose_file(drawing)[0], encoding="utf-8")
    return dimensions_of(drawing, file)


def test_circles_and_outlines_of_a_part():
    found = rows(drawn(part()))
    assert [each["name"] for each in found] == [
        *(f"circle {number}" for number in range(1, 6)),
        "outline 1 x",
        "outline 1 y",
    ]
    assert found[4]["nominal"] == "6mm"
    assert found[5]["direction"] == "x"
    assert found[5]["from"] == [0, 10]
    assert found[5]["to"] == [40, 10]
    assert (found[5]["nominal"], found[6]["nominal"]) == ("40mm", "20mm")


def test_callouts_come_first_with_their_limits_and_once():
    text, findings, _ = propose_file(drawn(with_text(part(), "%%c6 H7")))
    assert not findings
    found = tomllib.loads(text)["dimension"]
    assert (found[0]["name"], found[0]["nominal"], found[0]["limits"]) == ("Ø6", "6mm", "H7")
    assert sum(each["nominal"] == "6mm" for each in found) == 1
    assert len(found) == 7
    assert text.count('# limits = "H7"') == 4


def slot(turn: float, at: tuple[float, float], mirror: float = 1.0):
    """A slot of 6 by 22, turned."""
    doc = document()
    block = doc.blocks.new("SLOT")
    vertices = [(-8, -3, 0), (8, -3, 1), (8, 3, 0), (-8, 3, 1)]
    block.add_lwpolyline(vertices, format="xyb", close=True)
    doc.modelspace().add_blockref("SLOT", at, {"rotation": turn, "xscale": mirror})
    return drawn(doc)


@given(
    st.floats(-180, 180),
    st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
    st.sampled_from([1.0, -1.0]),
)
def test_slots_in_any_direction(turn, at, mirror):
    width, length = rows(slot(turn, at, mirror))
    assert (width["name"], width["nominal"]) == ("slot 1 width", "6mm")
    assert (length["name"], length["nominal"]) == ("slot 1 length", "22mm")
    axis = {"x": 0.0, "y": 90.0}
    directions = [axis.get(each["direction"], each["direction"]) for each in (width, length)]
    assert math.sin(math.radians(directions[1] - turn)) == pytest.approx(0, abs=1e-5)
    assert math.cos(math.radians(directions[0] - turn)) == pytest.approx(0, abs=1e-5)


@pytest.mark.parametrize(
    "name",
    ["plate.dxf", "mount.dxf", "mount.svg", "logo.dxf", "logo.svg", "board.dxf", "sign.svg"],
)
def test_the_samples_are_read_back_and_every_dimension_binds(name, tmp_path):
    drawing = read_drawing(SAMPLES / name)
    found, findings = read_back(drawing, tmp_path)
    assert not findings
    assert len(found) == len(rows(drawing)) > 0
    features = features_of(drawing.paths)
    for each in found:
        bound = bind(each, features, name)
        assert isinstance(bound, BoundDimension), each
        assert bound.drawn_mm == pytest.approx(each.nominal_mm, abs=1e-4)


def test_rings_are_two_circles(tmp_path):
    doc = document()
    for radius in (5, 8):
        doc.modelspace().add_circle((1, 2), radius)
    assert [each["nominal"] for each in rows(drawn(doc))] == ["10mm", "16mm"]
    found, _ = read_back(drawn(doc), tmp_path)
    assert [each.nominal_mm for each in found] == [10, 16]


def test_a_corner_is_no_end_of_a_size():
    doc = document()
    doc.modelspace().add_lwpolyline([(0, 0), (10, 5), (0, 5)], close=True)
    doc.modelspace().add_circle((30, 0), 1)
    names = [each["name"] for each in rows(drawn(doc))]
    assert names == ["circle 1"]  # along x and along y one end is a corner


def test_nothing_to_measure_is_one_line():
    doc = document()
    doc.modelspace().add_line((0, 0), (5, 5))
    with pytest.raises(InputError, match="no circles and slots") as told:
        propose_file(drawn(doc))
    assert told.value.mend


def test_many_circles_are_counted():
    doc = document()
    for number in range(MAX_DIMENSIONS + 7):
        doc.modelspace().add_circle((3 * number, 0), 1)
    text, _, _ = propose_file(drawn(doc))
    assert text.count("[[dimension]]") == MAX_DIMENSIONS
    assert "# 7 more circles, slots and sizes" in text


def test_names_from_texts_stay_text(tmp_path):
    drawing = drawn(with_text(part(), 'see "x" [[dimension]]'))
    text, findings, _ = propose_file(drawing)
    assert len(findings) == 1
    assert len(tomllib.loads(text)["dimension"]) == 7


def test_a_callout_with_wrong_limits_stands_there_without_them(tmp_path):
    drawing = drawn(with_text(part(), "%%c6 P7"))
    text, _, (fault,) = propose_file(drawing)
    assert "class P7 of 6 mm" in str(fault)
    assert "class P7 of 6 mm" in text
    found = tomllib.loads(text)["dimension"]
    assert (found[0]["name"], "limits" in found[0]) == ("Ø6", False)
    file = tmp_path / "tolerances.toml"
    mended = text.replace('# limits = "H7"', 'limits = "-0.012/-0.024"', 1)
    file.write_text(mended, encoding="utf-8")
    (bore, *_), _ = dimensions_of(drawing, file)
    assert bore.limits is not None
    assert bore.limits.upper_mm == -0.012
