"""Places of dimensions find their circles and edges, whichever way the drawing lies."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.findings import Finding
from camtool.geometry.polylines import Polyline, Polylines
from camtool.inspection.dimensions import Dimension, Kind, Place
from camtool.inspection.features import (
    BoundDimension,
    CircleFeature,
    EdgeFeature,
    bind,
    features_of,
)
from camtool.inspection.findings import InspectionCode
from camtool.planning.place import AffineMap

QUARTER = math.tan(math.pi / 8)


def plate() -> Polylines:
    """60 × 40 mm with corners of 5 mm, a hole of 6 mm at (15, 20), a slot 8 mm wide."""
    outline = [
        (5, 0, 0), (55, 0, QUARTER), (60, 5, 0), (60, 35, QUARTER),
        (55, 40, 0), (5, 40, QUARTER), (0, 35, 0), (0, 5, QUARTER),
    ]  # fmt: skip
    hole = [(18, 20, 1), (12, 20, 1)]
    slot = [(30, 16, 0), (50, 16, 1), (50, 24, 0), (30, 24, 1)]
    return Polylines.of([Polyline(np.array(p, dtype=float), True) for p in (outline, hole, slot)])


FEATURES = features_of(plate())


def bound(kind: Kind, *places: Place, direction: float | None = None) -> BoundDimension | Finding:
    return bind(Dimension("d", kind, places, "test", direction), FEATURES, "plate.dxf")


def test_features_of_a_plate() -> None:
    circles = [each for each in FEATURES if isinstance(each, CircleFeature)]
    edges = [each for each in FEATURES if isinstance(each, EdgeFeature)]
    assert sorted(round(each.radius_mm, 6) for each in circles) == [3, 4, 4, 5, 5, 5, 5]
    assert [each.is_closed for each in circles if each.radius_mm < 3.5] == [True]
    assert sorted(round(each.length_mm, 6) for each in edges) == [20, 20, 30, 30, 50, 50]


def test_segments_in_line_are_one_edge() -> None:
    path = np.array([(0, 0, 0), (10, 0, 0), (30, 0, 0), (30, 10, 0), (0, 10, 0), (0, 4, 0)])
    edges = features_of(Polylines.of([Polyline(path.astype(float), True)]))
    lengths = sorted(each.length_mm for each in edges if isinstance(each, EdgeFeature))
    assert lengths == pytest.approx([10, 10, 30, 30])


@pytest.mark.parametrize(
    ("kind", "places", "direction", "drawn"),
    [
        ("diameter", ((15, 20),), None, 6.0),
        ("diameter", ((18, 20),), None, 6.0),
        ("diameter", ((12, 20), (18, 20)), None, 6.0),
        ("radius", ((60 - 5 + 5 * math.sqrt(0.5), 40 - 5 + 5 * math.sqrt(0.5)),), None, 5.0),
        ("distance", ((0, 10), (60, 30)), 0.0, 60.0),
        ("distance", ((60, 30), (0, 10)), 0.0, 60.0),
        ("distance", ((0, 5), (60, 5)), None, 60.0),  # where edges and arcs meet
        ("distance", ((40, 16), (40, 24)), None, 8.0),
        ("distance", ((26, 20), (54, 20)), None, 28.0),  # over the slot's ends
        ("distance", ((0, 10), (15, 20)), 0.0, 15.0),
        ("distance", ((15, 20), (30, 20)), None, 15.0),  # the slot's end has a centre, too
        ("straightness", ((0, 20),), None, 0.0),
        ("roundness", ((15, 23),), None, 0.0),
        ("profile", ((0, 20),), None, 0.0),
    ],
)
def test_places_bind(
    kind: Kind, places: tuple[Place, ...], direction: float | None, drawn: float
) -> None:
    found = bound(kind, *places, direction=direction)
    assert isinstance(found, BoundDimension)
    assert found.drawn_mm == pytest.approx(drawn, abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "places", "direction"),
    [
        ("diameter", ((40, 20),), None),  # nothing there
        ("diameter", ((0, 20),), None),  # an edge
        ("distance", ((0, 10), (30, 20)), math.pi / 4),  # no edge is square to that
        ("distance", ((0, 10), (0, 10)), None),
        ("straightness", ((15, 23),), None),
        ("profile", ((99, 99),), None),
    ],
)
def test_what_fits_nothing_is_a_finding(
    kind: Kind, places: tuple[Place, ...], direction: float | None
) -> None:
    found = bound(kind, *places, direction=direction)
    assert isinstance(found, Finding)
    assert found.code == InspectionCode.DIMENSION_UNBOUND
    assert "plate.dxf" in found.where


def test_several_that_differ_are_a_finding_unless_a_nominal_value_chooses() -> None:
    rings = [[(x + r, 0, 1), (x - r, 0, 1)] for x, r in ((0, 3), (0, 5))]
    lines = Polylines.of([Polyline(np.array(p, dtype=float), True) for p in rings])
    features = features_of(lines)
    both = Dimension("d", "diameter", ((0, 0),), "test")
    assert isinstance(bind(both, features, "x"), Finding)
    one = bind(Dimension("d", "diameter", ((0, 0),), "test", None, 10.0), features, "x")
    assert isinstance(one, BoundDimension)
    assert one.drawn_mm == pytest.approx(10.0)


@given(
    turn=st.floats(-7.0, 7.0),
    flip=st.booleans(),
    shift=st.tuples(st.floats(-99, 99), st.floats(-99, 99)),
    scale=st.sampled_from([1.0, 0.1, 25.4]),
)
def test_placed_features_lie_where_the_drawing_comes_to_lie(
    turn: float, flip: bool, shift: Place, scale: float
) -> None:
    cos, sin = scale * math.cos(turn), scale * math.sin(turn)
    matrix = np.array([[cos, -sin], [sin, cos]]) @ np.diag([-1.0 if flip else 1.0, 1.0])
    where = AffineMap(matrix, np.array(shift), scale)
    moved = plate()
    vertices = where.vertices(moved.vertices)
    there = features_of(Polylines(vertices, moved.offsets, moved.closed))
    for drawn, other in zip(FEATURES, there, strict=True):
        here = drawn.in_work_frame(where)
        if isinstance(here, CircleFeature):
            assert isinstance(other, CircleFeature)
            assert here.centre_mm == pytest.approx(other.centre_mm, abs=1e-9)
            assert here.radius_mm == pytest.approx(other.radius_mm, abs=1e-9)
            angles = np.arange(0.01, 6.28, 0.1)
            assert (here.has(angles, 1e-6) == other.has(angles, 1e-6)).all()
        else:
            assert isinstance(other, EdgeFeature)
            assert here.start_mm == pytest.approx(other.start_mm, abs=1e-9)
            assert here.end_mm == pytest.approx(other.end_mm, abs=1e-9)


def test_a_hole_is_meant_and_not_the_rounding_around_it() -> None:
    bulge = math.tan(math.pi / 8)
    outline = [(5, 0, 0), (30, 0, 0), (30, 30, 0), (0, 30, 0), (0, 5, bulge)]
    hole = [(7, 5, 1), (3, 5, 1)]
    paths = [Polyline(np.array(p, dtype=float), True) for p in (outline, hole)]
    features = features_of(Polylines.of(paths))
    found = bind(Dimension("d", "diameter", ((5, 5),), "test"), features, "x")
    assert isinstance(found, BoundDimension)
    assert found.drawn_mm == pytest.approx(4.0)
    across = Dimension("d", "distance", ((5, 5), (30, 10)), "test", 0.0)
    reach = bind(across, features, "x")
    assert isinstance(reach, BoundDimension)
    assert reach.drawn_mm == pytest.approx(25.0)
