"""Every kind of DXF entity, in every version and placement, against ezdxf's own flattening."""

from __future__ import annotations

import io
import math

import ezdxf
import numpy as np
import pytest
from ezdxf import path as ezdxf_path
from ezdxf.math import Vec3
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.findings import Severity
from camtool.geometry.drawing import Drawing
from camtool.importers.dxf.reader import read
from camtool.importers.findings import DrawingCode
from camtool.importers.options import ReadOptions
from tests.oracles import arcs
from tests.strategies import examples

TOLERANCE_MM = 0.0005
FLATTENING_MM = 0.002
OPTIONS = ReadOptions(chain_gaps=False, tolerance_mm=TOLERANCE_MM)
VERSIONS = ("R12", "R2000", "R2007", "R2018")

PLACEMENTS = {
    "as it is": {},
    "turned": {"rotation": 33.0},
    "mirrored": {"xscale": -1.0, "yscale": 1.0, "rotation": 10.0},
    "enlarged": {"xscale": 2.5, "yscale": 2.5, "zscale": 2.5, "rotation": -120.0},
    "squeezed": {"xscale": 2.0, "yscale": -0.5, "rotation": 70.0},
    "seen from below": {"extrusion": (0.0, 0.0, -1.0), "rotation": 25.0},
}


def document(version="R2018"):
    doc = ezdxf.new(version)
    if version != "R12":
        doc.header["$INSUNITS"] = 4
    return doc


def data_of(doc, binary=False) -> bytes:
    if binary:
        stream = io.BytesIO()
        doc.write(stream, fmt="bin")
        return stream.getvalue()
    text = io.StringIO()
    doc.write(text)
    return text.getvalue().encode(doc.output_encoding, errors="dxfreplace")


def drawn(doc, options: ReadOptions = OPTIONS) -> Drawing:
    return read(data_of(doc), "test.dxf", options)


def line(space):
    space.add_line((1, 2), (7, -3))


def arc(space):
    space.add_arc((3, 1), 4, 200, 20)


def mirrored_arc(space):
    space.add_arc((3, 1), 4, 200, 20, dxfattribs={"extrusion": (0, 0, -1)})


def circle(space):
    space.add_circle((3, 1), 2.5)


def old_polyline(space):
    rows = [(0, 0, 0.5), (4, 0, -2.0), (4, 3, 0), (1, 5, 0.1)]
    space.add_polyline2d(rows, format="xyb", close=True)


def polyline(space):
    rows = [(0, 0, 0.5), (4, 0, -2.0), (4, 3, 0), (1, 5, 0.1)]
    space.add_lwpolyline(rows, format="xyb")


def space_polyline(space):
    space.add_polyline3d([(0, 0, 3), (4, 1, 3), (2, 6, 3)], close=True)


def ellipse(space):
    space.add_ellipse((1, 2), (3, 1), 0.3)


def elliptic_arc(space):
    space.add_ellipse((1, 2), (3, 1), 0.3, 0.4, 5.1, dxfattribs={"extrusion": (0, 0, -1)})


CONTROL = [(0, 0, 0), (1, 4, 0), (3, -2, 0), (5, 3, 0), (6, 0, 0), (8, 1, 0)]


def open_spline(space):
    space.add_open_spline(CONTROL)


def rational_spline(space):
    space.add_rational_spline(CONTROL, weights=[1, 3, 0.5, 2, 1, 1])


def solid(space):
    space.add_solid([(0, 0), (4, 0), (0, 3), (4, 3)])


def triangle(space):
    space.add_trace([(0, 0), (4, 0), (0, 3)])


def face(space):
    space.add_3dface([(0, 0, 2), (4, 0, 2), (5, 3, 2), (0, 3, 2)])


def hatch(space):
    entity = space.add_hatch()
    entity.paths.add_polyline_path([(0, 0, 0.4), (5, 0, 0), (5, 5, -0.3)], is_closed=True)
    edges = entity.paths.add_edge_path()
    edges.add_line((10, 0), (15, 0))
    edges.add_arc((15, 2), 2, 270, 90)
    edges.add_ellipse((13, 4), (2, 0), 0.5, 0, 180)
    edges.add_spline(
        control_points=[(11, 4), (9, 3), (12, 1), (10, 0)],
        knot_values=[0, 0, 0, 0, 1, 1, 1, 1],
        degree=3,
    )


def clockwise_hatch(space):
    edges = space.add_hatch().paths.add_edge_path()
    edges.add_arc((15, 2), 2, 30, 130, ccw=False)
    edges.add_ellipse((13, 4), (2, 1), 0.5, 20, 250, ccw=False)


def polygon(space):
    space.add_mpolygon().paths.add_polyline_path([(0, 0, 0.4), (5, 0, 0), (5, 5, -0.3)])


def multiple_line(space):
    space.add_mline([(0, 0), (6, 0), (6, 4)])


OLD = (line, arc, mirrored_arc, circle, old_polyline, space_polyline, solid, triangle, face)
NEW = (
    polyline,
    ellipse,
    elliptic_arc,
    open_spline,
    rational_spline,
    hatch,
    clockwise_hatch,
    polygon,
    multiple_line,
)


def flattened(entity) -> list[np.ndarray]:
    """ezdxf's chords of an entity, seen from above, as vertices; their points lie on the curve."""
    kind = entity.dxftype()
    if kind in ("INSERT", "MLINE", "LWPOLYLINE", "POLYLINE"):
        return [row for part in entity.virtual_entities() for row in flattened(part)]
    if kind in ("ARC", "CIRCLE"):
        runs = [entity.flattening(FLATTENING_MM)]
    elif kind in ("ELLIPSE", "SPLINE"):
        runs = [entity.flattening(FLATTENING_MM, 16)]
    else:
        is_area = kind in ("HATCH", "MPOLYGON")
        paths = ezdxf_path.from_hatch(entity) if is_area else [ezdxf_path.make_path(entity)]
        parts = [part for one in paths for part in one.sub_paths()]
        runs = [part.flattening(FLATTENING_MM, 16) for part in parts]
    found = []
    for run in runs:
        rows = np.array([(p.x, p.y, 0.0) for p in run])
        steps = np.hypot(*np.diff(rows[:, :2], axis=0).T)
        found.append(rows[np.append(True, steps > 1e-9)])
    return found


def nearest(points: np.ndarray, chains: list[np.ndarray]) -> np.ndarray:
    return np.min([arcs.chain_distances(points, chain) for chain in chains], axis=0)


def chains_of(drawing: Drawing) -> list[np.ndarray]:
    rows = []
    for k in range(len(drawing.paths)):
        vertices, closed = drawing.paths[k].vertices, bool(drawing.paths.closed[k])
        rows.append(np.vstack([vertices, vertices[:1]]) if closed else vertices)
    return rows


def judge(drawing: Drawing, expected: list[np.ndarray], slack_mm: float = 0.0) -> None:
    """All points of either lie on the other."""
    ours = chains_of(drawing)
    missing = max(nearest(rows[:, :2], ours).max() for rows in expected)
    extra = max(nearest(arcs.chain_points(chain, 8), expected).max() for chain in ours)
    assert missing <= TOLERANCE_MM * 1.01 + slack_mm
    # Chords lie off the true curve themselves.
    assert extra <= 2.0 * FLATTENING_MM + TOLERANCE_MM + slack_mm


def slack(draw) -> float:
    """ezdxf draws the arcs of areas by cubic Béziers, which are off by 2.7e-4 of the radius."""
    return 2.8e-4 * 25.0 if draw in (hatch, clockwise_hatch, polygon) else 1e-9


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("draw", [*OLD, *NEW])
def test_each_kind_in_each_version(draw, version, binary):
    if version == "R12" and draw in NEW:
        pytest.skip("is not a kind of R12")
    doc = document(version)
    draw(doc.modelspace())
    expected = [row for entity in doc.modelspace() for row in flattened(entity)]
    found = read(data_of(doc, binary), "test.dxf", OPTIONS)
    assert found.skipped == ()
    judge(found, expected, slack(draw))


@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize("draw", [*OLD, *NEW])
def test_each_kind_in_each_placement(draw, placement):
    doc = document()
    block = doc.blocks.new("B", base_point=(1, 2))
    draw(block)
    insert = doc.modelspace().add_blockref("B", (5, 7), dxfattribs=PLACEMENTS[placement])
    found = drawn(doc)
    assert found.used.get("INSERT") == 1
    # ezdxf maps areas and multiple lines otherwise when they are mirrored or squeezed.
    by_points = draw in (hatch, clockwise_hatch, polygon, multiple_line)
    expected = mapped(block, insert) if by_points else flattened(insert)
    judge(found, expected, slack(draw))


def mapped(block, *inserts) -> list[np.ndarray]:
    """The chords of a block's entities where inserts put them, the inmost first."""
    found = []
    for rows in [rows for entity in block for rows in flattened(entity)]:
        points = [Vec3(row) for row in rows]
        for insert in inserts:
            points = list(insert.matrix44().transform_vertices(points))
        found.append(np.array([(p.x, p.y, 0.0) for p in points]))
    return found


@examples(15)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(-180, 180),
    st.floats(0.2, 3.0),
    st.floats(0.2, 3.0),
    st.booleans(),
)
def test_random_curves_in_random_nests(seed, turn, xscale, yscale, mirror):
    rng = np.random.default_rng(seed)
    doc = document()
    block = doc.blocks.new("B", base_point=tuple(rng.uniform(-1, 1, 2)))
    rows = np.column_stack([rng.uniform(-9, 9, (4, 2)), rng.uniform(-3, 3, 4)])
    block.add_lwpolyline(rows.tolist(), format="xyb", close=bool(rng.integers(2)))
    block.add_arc(tuple(rng.uniform(-9, 9, 2)), rng.uniform(0.5, 5), *rng.uniform(0, 360, 2))
    control = [(*row, 0.0) for row in rng.uniform(-9, 9, (5, 2)).tolist()]
    block.add_rational_spline(control, weights=rng.uniform(0.5, 2, 5).tolist())
    inner = doc.blocks.new("C").add_blockref("B", (3, 1), dxfattribs={"rotation": turn})
    scales = {"xscale": -xscale if mirror else xscale, "yscale": yscale}
    outer = doc.modelspace().add_blockref("C", (2, 2), dxfattribs={**scales, "rotation": -turn})
    judge(drawn(doc), mapped(block, inner, outer), slack_mm=4.0 * FLATTENING_MM)


def test_a_periodic_spline_is_closed_and_passes_where_its_knots_are():
    doc = document()
    loop = np.array([(0, 0), (4, -1), (6, 3), (3, 6), (-1, 4)], dtype=float)
    wrapped = np.vstack([loop, loop[:3]])
    entity = doc.modelspace().add_spline(dxfattribs={"degree": 3, "flags": 11})
    entity.control_points = [(*row, 0.0) for row in wrapped.tolist()]
    entity.knots = [float(k) for k in range(len(wrapped) + 4)]
    found = drawn(doc)
    assert found.paths.closed.tolist() == [True]
    # A uniform cubic B-spline has the weights 1, 4 and 1 at its knots.
    at_knots = (wrapped[:-3] + 4.0 * wrapped[1:-2] + wrapped[2:-1]) / 6.0
    assert nearest(at_knots, chains_of(found)).max() <= TOLERANCE_MM


# --- what paths leave out -------------------------------------------------------------------


@pytest.mark.parametrize("widths", [{"const_width": 2.0}, {}])
def test_the_width_of_a_polyline_is_told_and_its_middle_is_the_path(widths):
    doc = document()
    tapering = [(0, 0, 0, 0), (5, 0, 1 if not widths else 0, 0)]
    doc.modelspace().add_lwpolyline(tapering, format="xyse", dxfattribs=widths)
    doc.modelspace().add_polyline2d([(0, 5, 1, 2), (5, 5, 0, 0)], format="xyse")
    doc.modelspace().add_lwpolyline([(0, 9), (5, 9)])
    found = drawn(doc)
    assert len(found.paths) == 3
    told = [one for one in found.findings if one.code is DrawingCode.NOT_APPLIED]
    assert [one.severity for one in told] == [Severity.WARNING] * 2
    assert ["1 LWPOLYLINE" in told[0].message, "1 POLYLINE" in told[1].message] == [True, True]


def test_a_hatch_along_other_entities_is_left_to_them():
    doc = document()
    space = doc.modelspace()
    outline = space.add_lwpolyline([(0, 0), (5, 0), (5, 5)], close=True)
    entity = space.add_hatch()
    path = entity.paths.add_polyline_path([(0, 0), (5, 0), (5, 5)], is_closed=True)
    entity.associate(path, [outline])
    found = drawn(doc)
    assert found.used == {"LWPOLYLINE": 1}
    assert [(item.kind, item.reason) for item in found.skipped] == [
        ("HATCH", "has the outline of other entities, which are read")
    ]


def test_the_box_of_a_text_in_a_hatch_is_no_outline():
    doc = document()
    entity = doc.modelspace().add_hatch()
    entity.paths.add_polyline_path([(0, 0), (9, 0), (9, 9)], is_closed=True)
    entity.paths.add_polyline_path([(6, 1), (7, 1), (7, 2)], is_closed=True, flags=8)
    found = drawn(doc)
    assert len(found.paths) == 1


def test_a_bow_tie_stays_one():
    doc = document()
    doc.modelspace().add_solid([(0, 0), (4, 0), (4, 3), (0, 3)])
    rows = chains_of(drawn(doc))[0][:, :2].tolist()
    assert rows == [[0, 0], [4, 0], [0, 3], [4, 3], [0, 0]]


def test_hidden_edges_of_a_face_are_left_out():
    doc = document()
    corners = [(0, 0), (4, 0), (4, 3), (0, 3)]
    doc.modelspace().add_3dface(corners, dxfattribs={"invisible_edges": 0b0101})
    found = drawn(doc)
    rows = sorted(chain[:, :2].tolist() for chain in chains_of(found))
    assert rows == [[[0, 3], [0, 0]], [[4, 0], [4, 3]]]


def test_points_become_marks_where_their_blocks_put_them():
    doc = document()
    doc.layers.add("DRILL", color=1)
    doc.blocks.new("B").add_point((1, 0, 9))
    doc.modelspace().add_point((3, 4), dxfattribs={"layer": "drill"})
    doc.modelspace().add_blockref("B", (10, 0), dxfattribs={"rotation": 90, "layer": "DRILL"})
    found = drawn(doc)
    assert len(found.paths) == 0
    assert [mark.at_mm for mark in found.marks] == [(3.0, 4.0), pytest.approx((10.0, 1.0))]
    assert {(mark.layer, mark.colour) for mark in found.marks} == {("DRILL", "#ff0000")}
    assert found.used == {"POINT": 2, "INSERT": 1}


@pytest.mark.parametrize("knots", [[0, 0, 0, 0, 1, 1, 1], [3, 2, 1, 0, 0, 0, 0, 0, 0, 0]])
def test_a_spline_whose_knots_are_wrong_is_not_guessed(knots):
    doc = document()
    doc.modelspace().add_line((0, 0), (1, 0))
    entity = doc.modelspace().add_open_spline(CONTROL)
    data = data_of(doc)
    old = b"".join(b" 40\n%s\n" % repr(float(k)).encode() for k in entity.knots)
    assert old in data
    new = b"".join(b" 40\n%s\n" % repr(float(k)).encode() for k in knots)
    found = read(data.replace(old, new), "test.dxf", OPTIONS)
    assert found.used == {"LINE": 1}
    assert [item.reason.partition(":")[0] for item in found.skipped] == ["has no curve"]


def test_a_closed_spline_through_points_comes_back():
    doc = document()
    through = [(0, 0), (4, -1), (6, 3), (2, 5)]
    doc.modelspace().add_spline(through, dxfattribs={"flags": 1 | 8})
    found = drawn(doc)
    assert found.paths.closed.tolist() == [True]
    assert nearest(np.array(through, dtype=float), chains_of(found)).max() <= TOLERANCE_MM


def helix(doc, pitch):
    entity = doc.modelspace().new_entity("HELIX", {"degree": 3, "flags": 8})
    turn = np.linspace(0.0, 2.0 * math.pi, 9)
    points = [Vec3(math.cos(t), math.sin(t), pitch * t) for t in turn]
    tool = ezdxf.math.fit_points_to_cad_cv(points)
    entity.apply_construction_tool(tool)


def test_a_helix_is_used_when_it_does_not_rise():
    doc = document()
    helix(doc, 0.0)
    helix(doc, 1.0)
    found = drawn(doc)
    assert found.used == {"HELIX": 1}
    assert [(item.kind, item.reason) for item in found.skipped] == [("HELIX", "is not flat")]


# --- annotations ----------------------------------------------------------------------------


def annotated():
    doc = ezdxf.new("R2018", setup=True)
    doc.header["$INSUNITS"] = 4
    space = doc.modelspace()
    space.add_line((0, 0), (6, 0))
    space.add_linear_dim(base=(0, 3), p1=(0, 0), p2=(6, 0)).render()
    space.add_leader([(10, 0), (12, 2), (15, 2)])
    return doc


def test_dimensions_are_read_when_they_are_wanted():
    found = drawn(annotated())
    assert found.used == {"LINE": 1}
    assert {item.kind: item.reason for item in found.skipped} == {
        "DIMENSION": "is an annotation: read its lines with --dimensions",
        "LEADER": "is an annotation: read its lines with --dimensions",
    }
    found = drawn(annotated(), ReadOptions(chain_gaps=False, dimensions=True))
    assert found.used == {"LINE": 1, "DIMENSION": 1, "LEADER": 1}
    assert "MTEXT" in {item.kind for item in found.skipped}
    assert found.marks == ()
    judge_line = np.array([[0.0, 3.0, 0.0], [6.0, 3.0, 0.0]])
    assert nearest(arcs.chain_points(judge_line, 8), chains_of(found)).max() <= 1e-6


def test_a_dimension_that_holds_itself_ends():
    doc = annotated()
    dimension = doc.modelspace().query("DIMENSION").first
    name = dimension.dxf.geometry
    again = dimension.copy()
    doc.blocks.get(name).add_entity(again)
    again.dxf.geometry = name
    found = drawn(doc, ReadOptions(dimensions=True))
    assert found.used == {"LINE": 1, "LEADER": 1}
    reasons = {item.kind: item.reason for item in found.skipped}
    assert reasons == {"DIMENSION": "cannot be drawn: its data is damaged"}


def test_text_is_read_when_it_is_wanted():
    doc = document()
    doc.modelspace().add_text("TEXT", height=5.0)
    doc.blocks.new("B").add_attdef("TAG", (0, 0), "default")
    insert = doc.modelspace().add_blockref("B", (0, 20))
    insert.add_attrib("TAG", "value", (0, 20), dxfattribs={"height": 3.0})
    with pytest.raises(DrawingError, match="--text outline"):
        drawn(doc)
    found = drawn(doc, ReadOptions(text="stroke"))
    assert found.used == {"TEXT": 1, "ATTRIB": 1, "INSERT": 1}
    assert {item.kind for item in found.skipped if "template" in item.reason} == {"ATTDEF"}
    y = found.paths.vertices[:, 1]
    assert y.min() < 6.0 < 19.0 < y.max()


# --- layouts, line types --------------------------------------------------------------------


def test_a_layout_is_read_by_its_name_instead_of_model_space():
    doc = document()
    doc.modelspace().add_line((0, 0), (1, 0))
    doc.layout("Layout1").add_circle((5, 5), 1)
    doc.layouts.new("Plate").add_line((0, 0), (0, 7))
    found = drawn(doc, ReadOptions(layout="plate"))
    assert found.used == {"LINE": 1}
    assert found.paths.vertices[:, 1].max() == 7.0
    assert {(i.kind, i.reason, i.count) for i in found.skipped} >= {
        ("entity", "is in model space", 1),
        ("entity", "is in paper space", 1),
    }
    with pytest.raises(DrawingError, match="has no layout 'Plan'") as caught:
        drawn(doc, ReadOptions(layout="Plan"))
    assert "Model, Layout1, Plate" in caught.value.mend


def test_line_types_come_from_entity_layer_or_block():
    from camtool.importers.dxf import reader as dxf

    doc = ezdxf.new("R2010", setup=True)
    doc.layers.add("CUT", linetype="DASHED")
    block = doc.blocks.new("B")
    block.add_line((0, 0), (1, 0), dxfattribs={"linetype": "BYBLOCK"})
    block.add_line((0, 1), (1, 1))
    space = doc.modelspace()
    space.add_line((0, 2), (1, 2), dxfattribs={"linetype": "CENTER", "layer": "CUT"})
    space.add_line((0, 3), (1, 3), dxfattribs={"layer": "cut"})
    space.add_line((0, 4), (1, 4))
    space.add_blockref("B", (0, 9), dxfattribs={"layer": "CUT", "linetype": "DOT"})
    loaded = dxf.load(data_of(doc), "a.dxf")
    walk = dxf.DxfWalk(loaded, "a.dxf", OPTIONS)
    walk.space(loaded.document.modelspace(), 1.0)
    found = [(piece.line_type, piece.layer) for piece in walk.pieces]
    assert found == [
        ("CENTER", "CUT"),
        ("DASHED", "CUT"),
        ("Continuous", "0"),
        ("DOT", "CUT"),
        ("DASHED", "CUT"),
    ]
