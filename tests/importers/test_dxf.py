"""DXF files to drawings: exact shapes, blocks, layers, units, and everything that is no DXF."""

from __future__ import annotations

import cmath
import io
import logging
import math
import re

import ezdxf
import numpy as np
import pytest
from ezdxf.math import Vec3
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.findings import Code, Severity
from camtool.geometry.curves import EllipseCurve, SplineCurve
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import signed_area
from camtool.geometry.polylines import Segments
from camtool.importers.dxf.reader import read
from camtool.importers.dxf.walk import MAX_INSERTED, BlockSizes
from camtool.importers.findings import DrawingCode
from camtool.importers.options import ReadOptions
from camtool.importers.read import read_drawing
from tests.oracles import arcs
from tests.strategies import examples

OPTIONS = ReadOptions()
SINGLE = ReadOptions(chain_gaps=False)
TOLERANCE_MM = OPTIONS.tolerance_mm


def text(*entities: str, header: str = "") -> bytes:
    """A minimal DXF: entities as "KIND code value code value ..." words."""
    words = ["0", "SECTION", "2", "HEADER", *header.split(), "0", "ENDSEC"]
    words += ["0", "SECTION", "2", "ENTITIES"]
    for entity in entities:
        words += ["0", *entity.split()]
    return "\n".join([*words, "0", "ENDSEC", "0", "EOF", ""]).encode()


MM = "9 $ACADVER 1 AC1009 9 $INSUNITS 70 4"
R2000 = "9 $ACADVER 1 AC1015 9 $INSUNITS 70 4"


def words(*entities: str, options: ReadOptions = OPTIONS) -> Drawing:
    return read(text(*entities, header=MM), "test.dxf", options)


def document(version: str = "R2000", units: int = 4):
    doc = ezdxf.new(version)
    doc.header["$INSUNITS"] = units
    return doc


def data_of(doc) -> bytes:
    stream = io.StringIO()
    doc.write(stream)
    return stream.getvalue().encode(doc.output_encoding, errors="dxfreplace")


def drawn(doc, options: ReadOptions = OPTIONS) -> Drawing:
    return read(data_of(doc), "test.dxf", options)


def codes(drawing: Drawing) -> list[Code]:
    return [finding.code for finding in drawing.findings]


def points(drawing: Drawing, path: int = 0):
    return drawing.paths[path].vertices


def skipped(drawing: Drawing) -> dict[tuple[str, str], int]:
    return {(item.kind, item.reason): item.count for item in drawing.skipped}


# --- shapes ---------------------------------------------------------------------------------


def test_a_line_is_exact():
    found = words("LINE 5 2F 8 CUT 10 0.1 20 0.2 11 3.7 21 -4.25")
    assert points(found).tolist() == [[0.1, 0.2, 0.0], [3.7, -4.25, 0.0]]
    assert found.sources == ("LINE 2F",)
    assert found.layers == ("CUT",)
    assert found.used == {"LINE": 1}
    assert found.fit.max_mm == 0.0


def test_a_circle_is_two_exact_half_circles():
    found = words("CIRCLE 8 0 10 1 20 2 40 0.15")
    rows = Segments.of(found.paths)
    assert found.paths.closed.tolist() == [True]
    assert rows.radius == pytest.approx([0.15, 0.15], rel=1e-15)
    assert rows.centre == pytest.approx(np.array([[1.0, 2.0], [1.0, 2.0]]), rel=1e-15)
    assert rows.sweep == pytest.approx([math.pi, math.pi])


@pytest.mark.parametrize(
    ("start", "end", "sweep"), [(0, 90, 90), (350, 10, 20), (10, 350, 340), (-45, 45, 90)]
)
def test_an_arc_is_exact(start, end, sweep):
    found = words(f"ARC 8 0 10 1 20 2 40 3 50 {start} 51 {end}")
    rows = Segments.of(found.paths)
    assert rows.radius == pytest.approx(3.0, rel=1e-14)
    assert rows.sweep.sum() == pytest.approx(math.radians(sweep))
    begin = 1.0 + 2.0j + cmath.rect(3.0, math.radians(start))
    stop = 1.0 + 2.0j + cmath.rect(3.0, math.radians(end))
    assert points(found)[0, :2] == pytest.approx([begin.real, begin.imag])
    assert points(found)[-1, :2] == pytest.approx([stop.real, stop.imag])


def test_a_polyline_keeps_its_bulges():
    doc = document()
    rows = [(0.0, 0.0, 0.25), (4.0, 0.0, 0.0), (4.0, 3.0, -1.0), (0.0, 3.0, 0.0)]
    doc.modelspace().add_lwpolyline(rows, format="xyb", close=True)
    found = drawn(doc)
    assert found.paths.closed.tolist() == [True]
    assert points(found).tolist() == [list(row) for row in rows]


def test_an_arc_of_more_than_a_half_circle_is_split_exactly():
    doc = document()
    bulge = math.tan(math.radians(300.0) / 4.0)
    doc.modelspace().add_lwpolyline([(1.0, 0.0, bulge), (2.0, 0.0, 0.0)], format="xyb")
    rows = Segments.of(drawn(doc).paths)
    assert np.abs(rows.bulge).max() <= 1.0
    assert rows.sweep.sum() == pytest.approx(math.radians(300.0))
    # Chord 1 over 300°: radius 1, from 120° to 420° about a centre below the chord's middle.
    assert rows.radius == pytest.approx([1.0, 1.0])
    assert rows.centre == pytest.approx(np.array([[1.5, -math.sqrt(0.75)]] * 2))


def test_a_closed_polyline_may_end_with_a_large_arc():
    doc = document()
    bulge = math.tan(math.radians(270.0) / 4.0)
    rows = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 2.0, bulge)]
    doc.modelspace().add_lwpolyline(rows, format="xyb", close=True)
    found = drawn(doc)
    assert len(found.paths[0]) == 4
    # A triangle of 2 and, over its long side, the larger part of a circle of radius 2.
    assert signed_area(found.paths[0]) == pytest.approx(2.0 + (3.0 * math.pi + 2.0))


def test_old_polylines_with_vertices():
    found = words(
        "POLYLINE 8 0 66 1 70 1",
        "VERTEX 8 0 10 0 20 0 42 1",
        "VERTEX 8 0 10 2 20 0",
        "VERTEX 8 0 10 2 20 2",
        "SEQEND 8 0",
    )
    assert points(found).tolist() == [[0, 0, 1], [2, 0, 0], [2, 2, 0]]
    assert found.paths.closed.tolist() == [True]


def test_a_splined_polyline_is_read_by_its_curve_not_by_its_frame():
    found = words(
        "POLYLINE 8 0 66 1 70 4",
        "VERTEX 8 0 10 9 20 9 70 16",
        "VERTEX 8 0 10 0 20 0 70 8",
        "VERTEX 8 0 10 1 20 0.5 70 8",
        "VERTEX 8 0 10 2 20 0 70 8",
        "SEQEND 8 0",
    )
    assert points(found)[:, :2].tolist() == [[0, 0], [1, 0.5], [2, 0]]


def test_a_flat_3d_polyline_is_used_and_a_rising_one_is_counted():
    doc = document()
    doc.modelspace().add_polyline3d([(0, 0, 5), (1, 0, 5), (1, 1, 5)])
    doc.modelspace().add_polyline3d([(0, 0, 0), (1, 0, 5), (1, 1, 5)])
    found = drawn(doc)
    assert points(found).tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
    assert skipped(found) == {("POLYLINE", "is not flat"): 1}


def _true_ellipse(centre, major, ratio, start=0.0, end=2.0 * math.pi):
    minor = ratio * np.array([-major[1], major[0]])
    return EllipseCurve(np.array(centre), np.array(major), minor, start, end)


def _off(curve, vertices, closed):
    if closed:
        vertices = np.vstack([vertices, vertices[:1]])
    t = np.linspace(curve.breaks[0], curve.breaks[-1], 999)
    return float(arcs.chain_distances(curve.point(t), vertices).max())


def test_an_ellipse_is_fitted_within_the_tolerance():
    doc = document()
    doc.modelspace().add_ellipse((1, 2), (3, 1), 0.1)
    found = drawn(doc)
    assert found.paths.closed.tolist() == [True]
    curve = _true_ellipse([1.0, 2.0], [3.0, 1.0], 0.1)
    off = _off(curve, points(found), closed=True)
    assert 0.0 < off <= found.fit.max_mm * 1.001 <= TOLERANCE_MM * 1.001


def test_an_elliptic_arc_keeps_its_ends_and_its_direction():
    doc = document()
    doc.modelspace().add_ellipse((0, 0), (2, 0), 0.5, start_param=1.0, end_param=4.0)
    found = drawn(doc)
    curve = _true_ellipse([0.0, 0.0], [2.0, 0.0], 0.5, 1.0, 4.0)
    assert found.paths.closed.tolist() == [False]
    assert points(found)[0, :2] == pytest.approx(curve.point(np.array([0.0]))[0])
    assert points(found)[-1, :2] == pytest.approx(curve.point(np.array([3.0]))[0])
    assert _off(curve, points(found), closed=False) <= TOLERANCE_MM * 1.001


def test_an_ellipse_of_equal_axes_is_an_exact_circle():
    doc = document()
    doc.modelspace().add_ellipse((1, 2), (0, 3), 1.0, start_param=0.5, end_param=2.5)
    found = drawn(doc)
    rows = Segments.of(found.paths)
    assert len(rows) == 1
    assert rows.sweep == pytest.approx(2.0)
    assert rows.radius == pytest.approx(3.0)
    assert found.fit.max_mm == 0.0


def test_an_ellipse_whose_end_is_rounded_to_six_digits_is_closed():
    found = words(
        "ELLIPSE 100 AcDbEntity 8 0 100 AcDbEllipse 10 0 20 0 30 0 11 2 21 0 31 0 40 0.5 41 0 "
        "42 6.283185"
    )
    assert found.paths.closed.tolist() == [True]
    assert DrawingCode.GAP_CLOSED not in codes(found)


def test_a_spline_is_fitted_within_the_tolerance():
    control = np.array([[0, 0], [1, 3], [3, -2], [4, 2], [6, 0], [7, 1.0]])
    doc = document()
    doc.modelspace().add_open_spline([(*row, 0.0) for row in control])
    found = drawn(doc)
    curve = SplineCurve(3, np.array([0, 0, 0, 0, 1, 2, 3, 3, 3, 3.0]), control)
    assert points(found)[0, :2] == pytest.approx(control[0])
    assert points(found)[-1, :2] == pytest.approx(control[-1])
    off = _off(curve, points(found), closed=False)
    assert 0.3 * TOLERANCE_MM < off <= found.fit.max_mm * 1.001 <= TOLERANCE_MM * 1.001


def test_a_rational_spline_that_is_a_circle_becomes_one():
    w = math.sqrt(0.5)
    corner = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    doc = document()
    doc.modelspace().add_rational_spline(
        [(2 * x, 2 * y, 0) for x, y in corner],
        weights=[1, w, 1, w, 1, w, 1, w, 1],
        knots=[0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4],
        degree=2,
    )
    found = drawn(doc)
    rows = Segments.of(found.paths)
    assert found.paths.closed.tolist() == [True]
    assert len(rows) <= 4
    assert rows.radius == pytest.approx(2.0, abs=1e-9)
    assert np.hypot(*rows.centre.T) == pytest.approx(0.0, abs=1e-9)


def test_a_spline_of_fit_points_passes_through_them():
    doc = document()
    through = [(0, 0, 0), (1, 2, 0), (3, 1, 0), (4, 3, 0)]
    doc.modelspace().add_spline(through)
    found = drawn(doc)
    assert found.used == {"SPLINE": 1}
    off = arcs.chain_distances(np.array(through)[:, :2].astype(float), points(found))
    assert off.max() <= TOLERANCE_MM * 1.001


def test_a_spline_with_too_few_points_is_told():
    data = text(
        "LINE 8 0 10 0 20 0 11 1 21 0",
        "SPLINE 100 AcDbEntity 8 0 100 AcDbSpline 70 8 71 3 72 2 73 2 40 0 40 1 "
        "10 0 20 0 30 0 10 1 20 1 30 0",
        header=R2000,
    )
    found = read(data, "part.dxf", OPTIONS)
    assert found.used == {"LINE": 1}
    assert skipped(found) == {
        ("SPLINE", "has no curve: 2 control points are too few for degree 3"): 1
    }


@pytest.mark.parametrize(
    ("entity", "lacks"),
    [
        ("CIRCLE 8 0 10 0 20 0", "radius"),
        ("ARC 8 0 10 0 20 0 40 1 50 0", "end angle"),
        ("LINE 8 0 10 0 20 0", "end"),
    ],
)
def test_numbers_that_the_file_does_not_say_are_not_made_up(entity, lacks):
    found = words(entity, "LINE 8 0 10 5 20 0 11 6 21 0")
    assert len(found.paths) == 1
    assert skipped(found) == {(entity.split()[0], f"lacks its {lacks}"): 1}


def test_shapes_of_one_outline_are_joined():
    found = words(
        "LINE 8 0 10 0 20 0 11 2 21 0",
        "LINE 8 0 10 2 20 2 11 0 21 2",
        "ARC 8 0 10 2 20 1 40 1 50 270 51 90",
        "ARC 8 0 10 0 20 1 40 1 50 90 51 270",
    )
    assert found.paths.closed.tolist() == [True]
    assert abs(signed_area(found.paths[0])) == pytest.approx(4.0 + math.pi)


# --- planes and blocks ----------------------------------------------------------------------


def test_an_extrusion_downwards_mirrors():
    # OCS of (0, 0, −1): x is −X of the world.
    found = words("ARC 8 0 10 5 20 1 40 2 50 0 51 90 210 0 220 0 230 -1")
    assert points(found)[0, :2] == pytest.approx([-7.0, 1.0])
    assert points(found)[-1, :2] == pytest.approx([-5.0, 3.0])
    assert points(found)[0, 2] == pytest.approx(-math.tan(math.pi / 8.0))


def test_a_tilted_plane_is_counted():
    found = words(
        "LINE 8 0 10 0 20 0 11 1 21 0",
        "CIRCLE 8 0 10 0 20 0 40 1 210 1 220 0 230 0",
        "CIRCLE 8 0 10 0 20 0 40 1 210 0.6 220 0 230 0.8",
        "LINE 8 0 10 0 20 0 30 0 11 1 21 0 31 1",
    )
    assert skipped(found) == {("CIRCLE", "lies in a tilted plane"): 2, ("LINE", "is not flat"): 1}


def _place(z: complex, at: complex, scale: complex, turn_deg: float) -> complex:
    """Transform a point of a block as its INSERT does: scale.real in X, scale.imag in Y."""
    squeezed = complex(z.real * scale.real, z.imag * scale.imag)
    return at + squeezed * cmath.exp(1j * math.radians(turn_deg))


def _nested():
    doc = document()
    inner = doc.blocks.new("INNER", base_point=(1, 1))
    inner.add_arc((2, 1), 0.5, 0, 90)
    inner.add_lwpolyline([(0, 0, 0.5), (1, 0, 0)], format="xyb")
    outer = doc.blocks.new("OUTER")
    outer.add_blockref(
        "INNER", (3, 4), dxfattribs={"xscale": -2, "yscale": 2, "zscale": 2, "rotation": 30}
    )
    doc.modelspace().add_blockref(
        "outer", (-1, 5), dxfattribs={"xscale": 0.5, "yscale": 0.5, "rotation": -70}
    )
    return doc


def test_nested_mirrored_scaled_inserts():
    found = drawn(_nested(), SINGLE)

    def world(x, y):
        inner = _place(complex(x, y) - (1 + 1j), 3 + 4j, complex(-2, 2), 30.0)
        outer = _place(inner, -1 + 5j, complex(0.5, 0.5), -70.0)
        return [outer.real, outer.imag]

    arc, line = points(found, 0), points(found, 1)
    assert arc[0, :2] == pytest.approx(world(2.5, 1.0))
    assert arc[-1, :2] == pytest.approx(world(2.0, 1.5))
    assert arc[0, 2] == pytest.approx(-math.tan(math.pi / 8.0))
    assert Segments.of(found.paths).radius[0] == pytest.approx(0.5)
    assert line[:, :2] == pytest.approx(np.array([world(0, 0), world(1, 0)]))
    assert line[0, 2] == pytest.approx(-0.5)
    assert found.used == {"INSERT": 2, "ARC": 1, "LWPOLYLINE": 1}
    assert re.fullmatch(r"ARC \w+ in INSERT \w+", found.sources[0])


def test_unequal_scales_turn_circles_into_fitted_ellipses():
    doc = document()
    block = doc.blocks.new("B")
    block.add_circle((1, 0), 1)
    block.add_lwpolyline([(0, 5, 1), (2, 5, 0), (2, 7, 0)], format="xyb", close=True)
    doc.modelspace().add_blockref(
        "B", (10, 0), dxfattribs={"xscale": 3, "yscale": -1, "rotation": 90}
    )
    found = drawn(doc, SINGLE)
    assert found.fit.max_mm > 0.0
    # (x, y) → (10 + y, 3x)
    curve = _true_ellipse([10.0, 3.0], [0.0, 3.0], 1.0 / 3.0)
    assert _off(curve, points(found, 0), closed=True) <= TOLERANCE_MM * 1.001
    shape = points(found, 1)
    assert found.paths.closed.tolist() == [True, True]
    half = _true_ellipse([15.0, 3.0], [0.0, 3.0], 1.0 / 3.0, math.pi, 2.0 * math.pi)
    t = np.linspace(0.0, math.pi, 300)
    below = half.point(t)
    below[:, 0] = 30.0 - below[:, 0]  # the half circle lies below the chord in the block
    off = arcs.chain_distances(below, np.vstack([shape, shape[:1]]))
    assert off.max() <= TOLERANCE_MM * 1.001
    assert shape[-1, :2] == pytest.approx([17.0, 6.0])


def test_arrays_are_rotated_but_not_scaled():
    doc = document()
    doc.blocks.new("B").add_line((0, 0), (1, 0))
    doc.modelspace().add_blockref(
        "B",
        (1, 1),
        dxfattribs={
            "rotation": 90,
            "xscale": 2,
            "yscale": 2,
            "column_count": 3,
            "column_spacing": 10,
            "row_count": 2,
            "row_spacing": 7,
        },
    )
    found = drawn(doc, SINGLE)
    starts = {tuple(np.round(points(found, k)[0, :2], 9)) for k in range(6)}
    assert starts == {(1 - 7 * row, 1 + 10 * column) for row in range(2) for column in range(3)}
    assert points(found, 0)[1, :2] == pytest.approx([1.0, 3.0])


def test_entities_on_layer_0_of_a_block_take_after_the_insert():
    doc = document()
    doc.layers.add("CUT", color=1)
    doc.layers.add("OWN", color=5)
    block = doc.blocks.new("B")
    block.add_line((0, 0), (1, 0))
    block.add_line((0, 1), (1, 1), dxfattribs={"layer": "OWN"})
    block.add_line((0, 2), (1, 2), dxfattribs={"color": 0})
    doc.modelspace().add_blockref("B", (0, 0), dxfattribs={"layer": "CUT", "color": 3})
    found = drawn(doc)
    assert found.layers == ("CUT", "OWN", "CUT")
    assert found.colours == ("#ff0000", "#0000ff", "#00ff00")


def test_colours_by_layer_by_index_and_true():
    doc = document("R2010")
    doc.layers.add("A", true_color=0x123456)
    space = doc.modelspace()
    space.add_line((0, 0), (1, 0), dxfattribs={"layer": "A"})
    space.add_line((0, 1), (1, 1), dxfattribs={"layer": "A", "color": 2})
    space.add_line((0, 2), (1, 2), dxfattribs={"true_color": 0xABCDEF})
    space.add_line((0, 3), (1, 3), dxfattribs={"layer": "not in the table"})
    assert drawn(doc).colours == ("#123456", "#ffff00", "#abcdef", "#000000")


def test_hidden_layers_are_counted_with_their_state():
    doc = document()
    doc.layers.add("OFF").off()
    doc.layers.add("ICE").freeze()
    block = doc.blocks.new("B")
    block.add_line((0, 0), (1, 0))
    block.add_line((0, 1), (1, 1), dxfattribs={"layer": "SHOWN"})
    space = doc.modelspace()
    space.add_line((5, 0), (6, 0), dxfattribs={"layer": "off"})
    space.add_circle((5, 0), 1, dxfattribs={"layer": "ICE"})
    space.add_line((5, 5), (6, 5), dxfattribs={"invisible": 1})
    space.add_blockref("B", (0, 0), dxfattribs={"layer": "OFF"})
    space.add_blockref("B", (0, 9), dxfattribs={"layer": "ICE"})
    found = drawn(doc)
    assert found.layers == ("SHOWN",)
    assert skipped(found) == {
        ("LINE", "layer OFF is off"): 2,
        ("CIRCLE", "layer ICE is frozen"): 1,
        ("INSERT", "layer ICE is frozen"): 1,
        ("LINE", "is invisible"): 1,
    }
    assert codes(found).count(DrawingCode.ENTITY_SKIPPED) == 4


def test_what_is_no_line_is_counted_by_kind():
    doc = document()
    space = doc.modelspace()
    space.add_line((0, 0), (1, 0))
    space.add_text("M30;")
    space.add_text("G00")
    space.add_hatch()
    space.add_ray((0, 0), (1, 1))
    space.add_3dface([(0, 0), (1, 0), (1, 1, 1)])
    space.add_blockref("MISSING", (0, 0))
    doc.layout("Layout1").add_line((0, 0), (1, 1))
    found = drawn(doc)
    counts = {item.kind: item.count for item in found.skipped}
    assert counts.pop("INSERT", 1) == 1  # or deleted by the audit, which is told as a repair
    assert counts == {"TEXT": 2, "HATCH": 1, "RAY": 1, "3DFACE": 1, "entity": 1}
    assert len(found.paths) == 1


def test_attributes_of_inserts_are_counted():
    doc = document()
    block = doc.blocks.new("B")
    block.add_line((0, 0), (1, 0))
    block.add_attdef("TAG", (0, 0))
    doc.modelspace().add_blockref("B", (0, 0)).add_attrib("TAG", "text", (0, 0))
    counts = {item.kind: item.count for item in drawn(doc).skipped}
    assert counts == {"ATTRIB": 1, "ATTDEF": 1}


@pytest.mark.parametrize("radius", [0.0, -2.0])
def test_a_circle_without_a_radius_is_counted(radius):
    found = words(f"CIRCLE 8 0 10 0 20 0 40 {radius}", "LINE 8 0 10 0 20 0 11 1 21 0")
    assert found.used == {"LINE": 1}
    assert found.skipped or DrawingCode.FILE_REPAIRED in codes(found)


def test_endless_arrays_and_nests_are_refused_quickly():
    doc = document()
    doc.blocks.new("B").add_line((0, 0), (1, 0))
    doc.modelspace().add_blockref(
        "B",
        (0, 0),
        dxfattribs={
            "column_count": 32767,
            "row_count": 32767,
            "column_spacing": 1,
            "row_spacing": 1,
        },
    )
    with pytest.raises(DrawingError, match=f"more than {MAX_INSERTED} entities"):
        drawn(doc)
    doc = document()
    doc.blocks.new("B0").add_line((0, 0), (1, 0))
    for level in range(1, 9):
        block = doc.blocks.new(f"B{level}")
        for k in range(10):
            block.add_blockref(f"B{level - 1}", (k, 0))
    doc.modelspace().add_blockref("B8", (0, 0))
    with pytest.raises(DrawingError, match=f"more than {MAX_INSERTED} entities"):
        drawn(doc)


def test_an_array_of_blocks_stands_for_all_that_it_holds():
    doc = document()
    inner, outer = doc.blocks.new("INNER"), doc.blocks.new("OUTER")
    for k in range(3):
        inner.add_line((0, k), (1, k))
    for k in range(4):
        outer.add_line((0, k), (1, k))
    outer.add_blockref("INNER", (0, 0), dxfattribs={"column_count": 2, "column_spacing": 9})
    array = {"column_count": 3, "row_count": 5, "column_spacing": 9, "row_spacing": 9}
    insert = doc.modelspace().add_blockref("OUTER", (0, 0), dxfattribs=array)
    held = 4 + 2 * (1 + 3)
    assert BlockSizes(doc.blocks).inserted(insert) == 3 * 5 * (1 + held)
    assert drawn(doc).used["LINE"] == 15 * (4 + 2 * 3)


def test_an_array_without_spacing_stands_once():
    doc = document()
    doc.blocks.new("B").add_line((0, 0), (1, 0))
    doc.modelspace().add_blockref("B", (0, 0), dxfattribs={"column_count": 32767})
    assert drawn(doc).used == {"INSERT": 1, "LINE": 1}


def test_a_block_that_holds_itself_ends():
    doc = document()
    block = doc.blocks.new("B")
    block.add_line((0, 0), (1, 0))
    block.add_blockref("B", (5, 5))
    doc.modelspace().add_blockref("B", (0, 0))
    doc.modelspace().add_line((0, 3), (1, 3))
    assert drawn(doc).used["LINE"] >= 1


# --- units ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("code", "name", "mm"),
    [(1, "in", 25.4), (2, "ft", 304.8), (4, "mm", 1.0), (5, "cm", 10.0), (13, "µm", 0.001)],
)
def test_units_of_the_file(code, name, mm):
    header = f"9 $ACADVER 1 AC1009 9 $INSUNITS 70 {code}"
    found = read(text("CIRCLE 8 0 10 2 20 0 40 1", header=header), "a.dxf", OPTIONS)
    assert (found.units.name, found.units.mm_per_unit) == (name, mm)
    assert found.units.why == f"$INSUNITS {code}"
    assert Segments.of(found.paths).radius == pytest.approx(mm)
    assert DrawingCode.UNITLESS not in codes(found)


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("9 $ACADVER 1 AC1009", "no $INSUNITS"),
        ("9 $ACADVER 1 AC1009 9 $INSUNITS 70 0", "$INSUNITS 0"),
        ("9 $ACADVER 1 AC1009 9 $INSUNITS 70 99", "$INSUNITS 99, which is no unit"),
        ("9 $ACADVER 1 AC1009 9 $INSUNITS 70 3 9 $MEASUREMENT 70 0", "$INSUNITS 3 (miles"),
    ],
)
def test_a_file_without_a_unit_is_taken_as_mm_with_a_warning(header, said):
    found = read(text("CIRCLE 8 0 10 2 20 0 40 1", header=header), "a.dxf", OPTIONS)
    assert found.units.mm_per_unit == 1.0
    [finding] = [one for one in found.findings if one.code is DrawingCode.UNITLESS]
    assert finding.severity is Severity.WARNING
    assert said in finding.message
    assert "--units" in finding.message


@pytest.mark.parametrize("code", ["", "9 $INSUNITS 70 0 "])
@pytest.mark.parametrize(
    ("measurement", "name", "mm", "severity"),
    [(0, "in", 25.4, Severity.WARNING), (1, "mm", 1.0, Severity.INFO)],
)
def test_without_a_unit_the_system_of_measurement_is_the_hint(
    code, measurement, name, mm, severity
):
    header = f"9 $ACADVER 1 AC1009 {code}9 $MEASUREMENT 70 {measurement}"
    found = read(text("CIRCLE 8 0 10 2 20 0 40 1", header=header), "a.dxf", OPTIONS)
    assert (found.units.name, found.units.mm_per_unit) == (name, mm)
    [finding] = [one for one in found.findings if one.code is DrawingCode.UNIT_GUESSED]
    assert finding.severity is severity
    assert "--units" in finding.message
    assert DrawingCode.UNITLESS not in codes(found)


def test_the_callers_unit_wins():
    options = ReadOptions(units="in")
    found = read(text("LINE 8 0 10 0 20 0 11 1 21 0", header=MM), "a.dxf", options)
    assert points(found)[1, 0] == 25.4
    assert found.units.why == "as asked; the file says $INSUNITS 4"
    assert DrawingCode.UNITLESS not in codes(found)


def test_scaling_by_units_scales_the_tolerance_of_nothing():
    doc = document(units=6)
    doc.modelspace().add_ellipse((0, 0), (0.05, 0), 0.5)
    found = drawn(doc)
    curve = _true_ellipse([0.0, 0.0], [50.0, 0.0], 0.5)
    assert _off(curve, points(found), closed=True) <= TOLERANCE_MM * 1.001


# --- files ----------------------------------------------------------------------------------


@pytest.mark.parametrize("version", ["R12", "R2000", "R2004", "R2010", "R2018"])
@pytest.mark.parametrize("fmt", ["asc", "bin"])
def test_all_versions_ascii_and_binary(version, fmt, tmp_path):
    doc = document(version)
    doc.layers.add("Größe")
    doc.modelspace().add_circle((1, 2), 3, dxfattribs={"layer": "Größe"})
    doc.saveas(tmp_path / "a.dxf", fmt=fmt)
    found = read_drawing(tmp_path / "a.dxf")
    assert Segments.of(found.paths).radius == pytest.approx([3.0, 3.0])
    assert found.layers == ("Größe",)
    assert found.units.name == "mm"
    assert found.file == str(tmp_path / "a.dxf")
    assert DrawingCode.FILE_REPAIRED not in codes(found)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "is empty"),
        (b" \r\n ", "is empty"),
        (b"solid cube\nfacet normal 0 0 1\n", "is no DXF"),
        (b"\x00\x01\x02" * 99, "is no DXF"),
        (b"AutoCAD Binary DXF\r\n\x1a\x00", "is no DXF"),
        (b"0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n10\n0\n", "is cut off"),
        (b"0\nSECTION\nnonsense\nEOF\n0\nEOF\n", "line 3: 'nonsense' is no group code"),
        (b"0\nSECTION\n2\nENTITIES\n0\nSEQEND\n0\nEOF\n", "holds no lines or curves"),
        (b"0\nSECTION\n2\nENTITIES\n0\nENDSEC\n0\nEOF\n", "holds no lines or curves"),
    ],
)
def test_what_is_no_drawing_is_refused_in_one_line(data, says):
    with pytest.raises(DrawingError, match=says) as caught:
        read(data, "part.dxf", OPTIONS)
    message = str(caught.value)
    assert message.startswith("part.dxf: ")
    assert "\n" not in message
    assert caught.value.mend


@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e999"])
@pytest.mark.parametrize(
    "entity",
    [
        "LINE 5 2F 8 CUT 10 # 20 0 11 1 21 0",
        "CIRCLE 5 2F 8 CUT 10 0 20 0 40 #",
        "ARC 5 2F 8 CUT 10 0 20 0 40 1 50 # 51 90",
        "LWPOLYLINE 5 2F 100 AcDbEntity 8 CUT 100 AcDbPolyline 90 2 10 0 20 0 42 # 10 1 20 0",
        "ELLIPSE 5 2F 100 AcDbEntity 8 CUT 100 AcDbEllipse 10 0 20 0 11 1 21 0 40 # 41 0 42 3",
    ],
)
def test_numbers_that_are_not_finite_are_named_by_layer_and_entity(entity, number):
    header = R2000 if " 100 " in entity else MM
    data = text(entity.replace("#", number), "LINE 8 0 10 0 20 0 11 1 21 0", header=header)
    with pytest.raises(DrawingError, match="finite") as caught:
        read(data, "part.dxf", OPTIONS)
    assert caught.value.where == f"layer CUT, {entity.split()[0]} 2F"
    assert caught.value.mend


def test_an_insert_with_a_number_that_is_not_finite_is_named():
    doc = document()
    doc.blocks.new("B").add_line((0, 0), (1, 0))
    doc.modelspace().add_blockref("B", (0, 0), dxfattribs={"rotation": 77.125})
    data = data_of(doc).replace(b"77.125", b"nan")
    with pytest.raises(DrawingError, match="finite") as caught:
        read(data, "part.dxf", OPTIONS)
    assert "INSERT" in str(caught.value.where)


def test_a_drawing_too_far_away_is_named():
    doc = document()
    doc.modelspace().add_ellipse((1e12, 0), (1, 0), 0.5)
    with pytest.raises(DrawingError, match="too far to be exact") as caught:
        drawn(doc)
    assert "ELLIPSE" in str(caught.value.where)


def test_repairs_are_told_the_first_few_in_full():
    whole = text("LINE 8 0 10 0 20 0 11 1 21 0", header=MM)
    trash = b"".join(b"0\nTRASH%d\n" % k for k in range(5))
    found = read(whole.replace(b"0\nEOF", trash + b"0\nEOF"), "test.dxf", OPTIONS)
    [finding] = [one for one in found.findings if one.code is DrawingCode.FILE_REPAIRED]
    assert len(found.paths) == 1
    assert finding.severity is Severity.WARNING
    assert finding.measured >= 5.0
    assert finding.message.count("stands outside the sections") == 3
    assert finding.message.endswith(f"and {finding.measured - 3:.0f} more")


def test_a_missing_section_end_is_repaired_and_told():
    data = text("LINE 8 0 10 0 20 0 11 1 21 0", header=MM).replace(b"0\nENDSEC\n0\nEOF", b"0\nEOF")
    found = read(data, "part.dxf", OPTIONS)
    [finding] = [one for one in found.findings if one.code is DrawingCode.FILE_REPAIRED]
    assert "section ENTITIES has no end (ENDSEC)" in finding.message


def test_a_file_that_ends_behind_its_entities_is_whole_enough():
    data = text("LINE 8 0 10 0 20 0 11 1 21 0", header=MM)
    for end in (b"0\nEOF", b"0\nSECTION\n2\nOBJECTS\n0\nDICTIONARY\n5\n3"):
        found = read(data.replace(b"0\nEOF\n", end[:-1]), "part.dxf", OPTIONS)
        [finding] = [one for one in found.findings if one.code is DrawingCode.FILE_REPAIRED]
        assert "end mark EOF is missing" in finding.message
        assert len(found.paths) == 1
    with pytest.raises(DrawingError, match="cut off"):
        read(data.replace(b"0\nENDSEC\n0\nEOF\n", b"0\nENDSE"), "part.dxf", OPTIONS)


def test_nothing_is_logged_or_printed_and_the_logger_is_left_alone(caplog, capfd):
    logger = logging.getLogger("ezdxf")
    before = (logger.propagate, list(logger.handlers), logger.level)
    data = text("LINE 8 0 10 0 20 0 11 1 21 0", header="9 $ACADVER 1 AC1003")
    read(data, "part.dxf", OPTIONS)
    with pytest.raises(DrawingError):
        read(b"0\nSECTION\n2\nHEADER\n0\nENDSEC\n0\nEOF\n", "part.dxf", OPTIONS)
    assert (logger.propagate, list(logger.handlers), logger.level) == before
    assert caplog.records == []
    assert capfd.readouterr() == ("", "")


def _sample() -> bytes:
    doc = _nested()
    doc.modelspace().add_ellipse((1, 2), (3, 1), 0.1)
    doc.modelspace().add_open_spline([Vec3(0, 0), Vec3(1, 3), Vec3(3, -2), Vec3(4, 2)])
    doc.modelspace().add_text("text")
    return data_of(doc)


SAMPLE = _sample()
ENTITIES = SAMPLE.index(b"ENTITIES")


ALL_ENTITIES = SAMPLE.index(b"ENDSEC", ENTITIES) + len(b"ENDSEC")


@given(st.integers(0, ALL_ENTITIES - 1))
def test_a_file_that_is_cut_off_is_refused(end):
    with pytest.raises(DrawingError, match=r"cut off|no DXF|empty"):
        read(SAMPLE[:end], "part.dxf", OPTIONS)


@examples(20, 2000)
@given(st.integers(ALL_ENTITIES, len(SAMPLE) - 5))
def test_a_file_that_is_cut_off_behind_its_entities_has_all_of_them(end):
    found = read(SAMPLE[:end], "part.dxf", OPTIONS)
    assert found.used == read(SAMPLE, "part.dxf", OPTIONS).used
    assert DrawingCode.FILE_REPAIRED in codes(found)


LINES = SAMPLE.split(b"\n")


@given(
    st.integers(SAMPLE[:ENTITIES].count(b"\n"), len(LINES) - 6),
    st.sampled_from(
        [b"", b"0", b"-1", b"nan", b"1e300", b"xyz", b"\xff\xfe", b"LINE", b"ENDSEC", b"999999"]
    ),
    st.booleans(),
)
def test_any_changed_line_gives_a_drawing_or_one_clear_line(row, line, delete):
    lines = LINES.copy()
    lines[row : row + 1] = [] if delete else [line]
    message = "part.dxf: a drawing"
    try:
        read(b"\n".join(lines), "part.dxf", OPTIONS)
    except DrawingError as error:
        message = str(error)
    assert message.startswith("part.dxf: ")
    assert "\n" not in message
