"""Lengths, areas, extents and points against very many short chords, and moved about."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import GeometryError
from camtool.geometry.distance import points_to_segments
from camtool.geometry.measure import (
    extents,
    length,
    path_extents,
    path_lengths,
    point_at,
    sample,
    segment_boxes,
    signed_area,
    signed_areas,
)
from camtool.geometry.polylines import Polyline, Polylines, Segments, begin_at, reverse, rotate
from tests.oracles.geometry import chord_length, dense_points, polygon, sagitta
from tests.paths import mirrored, moved, scaled
from tests.strategies import contours, polylines

N = 400
CIRCLE = Polyline(np.array([[-2.0, 1.0, 1.0], [4.0, 1.0, 1.0]]), closed=True)


def test_a_circle_of_two_half_arcs() -> None:
    assert length(CIRCLE) == pytest.approx(6.0 * math.pi, rel=1e-15)
    assert signed_area(CIRCLE) == pytest.approx(9.0 * math.pi, rel=1e-15)
    assert signed_area(reverse(CIRCLE)) == pytest.approx(-9.0 * math.pi, rel=1e-15)
    box = extents(Polylines.of([CIRCLE]))
    assert box == pytest.approx(np.array([[-2.0, 4.0], [-2.0, 4.0]]), abs=1e-15)


def test_open_paths_have_no_area_and_nothing_has_no_extents() -> None:
    assert signed_area(Polyline(CIRCLE.vertices)) == 0.0
    assert path_lengths(Polylines.of([])).shape == (0,)
    assert signed_areas(Polylines.of([])).shape == (0,)
    with pytest.raises(GeometryError):
        extents(Polylines.of([]))


@given(st.lists(st.one_of(polylines(), contours()), max_size=8), st.integers(1, 5))
def test_segments_that_are_looked_at_in_lots_measure_the_same(
    paths: list[Polyline], at_once: int
) -> None:
    lines = Polylines.of(paths)
    measured = [measure(lines) for measure in (path_lengths, signed_areas, path_extents)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("camtool.geometry.polylines.SEGMENTS_AT_ONCE", at_once)
        in_lots = [measure(lines) for measure in (path_lengths, signed_areas, path_extents)]
    for one, other in zip(measured, in_lots, strict=True):
        assert np.array_equal(one, other)


def test_each_path_has_its_own_numbers() -> None:
    square = Polyline(np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]), closed=True)
    paths = Polylines.of([square, CIRCLE, Polyline(square.vertices)])
    assert path_lengths(paths) == pytest.approx([8.0, 6.0 * math.pi, 6.0])
    assert signed_areas(paths) == pytest.approx([4.0, 9.0 * math.pi, 0.0])
    assert path_extents(paths)[2].tolist() == [[0.0, 2.0], [0.0, 2.0]]
    assert extents(paths) == pytest.approx(np.array([[-2.0, 4.0], [-2.0, 4.0]]))


@pytest.mark.parametrize("bulge", [1e-12, 1e-9, 9.99e-4, 1.001e-3, 1e-2, -1e-3])
def test_areas_beside_shallow_arcs_follow_their_series(bulge: float) -> None:
    path = Polyline(np.array([[0.0, 0, bulge], [3, 0, 0]]), closed=True)
    wanted = 9.0 * bulge / 3.0 * (1.0 + bulge**2 / 5.0 - bulge**4 / 35.0)
    assert signed_area(path) == pytest.approx(wanted, rel=1e-10)


@given(polylines())
def test_length_is_that_of_short_chords(path: Polyline) -> None:
    chords = chord_length(path, N)
    # n chords of an arc are shorter than it by sweep²/(24n²) of its length, sweep ≤ π.
    assert chords * (1.0 - 1e-9) <= length(path)
    assert length(path) <= chords * (1.0 + math.pi**2 / (20.0 * N**2))


@given(contours())
def test_area_is_that_of_a_fine_polygon(path: Polyline) -> None:
    fine = polygon(path, N)
    sign = 1.0 if fine.exterior.is_ccw else -1.0
    assert abs(signed_area(path) - sign * fine.area) <= sagitta(path, N) * length(path)


@given(polylines())
def test_extents_hold_the_path_and_touch_it(path: Polyline) -> None:
    points = dense_points(path, N)
    box = extents(Polylines.of([path]))
    assert (points >= box[:, 0] - 1e-12).all()
    assert (points <= box[:, 1] + 1e-12).all()
    slack = sagitta(path, N) + 1e-12
    assert (np.abs(points.min(axis=0) - box[:, 0]) <= slack).all()
    assert (np.abs(points.max(axis=0) - box[:, 1]) <= slack).all()


@given(polylines(), st.integers(0, 7), st.floats(-3.2, 3.2))
def test_numbers_change_as_they_should_when_a_path_is_moved_about(
    path: Polyline, start: int, angle: float
) -> None:
    size, area = length(path), signed_area(path)
    scale = size * size
    same = [moved(path, 1000.0, -300.0), rotate(path, angle)]
    if path.closed:
        same.append(begin_at(path, start % len(path)))
    for other in same:
        assert length(other) == pytest.approx(size, rel=1e-9)
        assert signed_area(other) == pytest.approx(area, abs=1e-9 * scale)
    for other in (reverse(path), mirrored(path)):
        assert length(other) == pytest.approx(size, rel=1e-12)
        assert signed_area(other) == pytest.approx(-area, abs=1e-12 * scale)
    twice = scaled(path, 2.0)
    assert length(twice) == pytest.approx(2.0 * size, rel=1e-12)
    assert signed_area(twice) == pytest.approx(4.0 * area, abs=1e-12 * scale)


@given(polylines())
def test_boxes_of_segments_make_the_box_of_the_path(path: Polyline) -> None:
    boxes = segment_boxes(Segments.of(path))
    box = extents(Polylines.of([path]))
    assert boxes[:, :2].min(axis=0).tolist() == box[:, 0].tolist()
    assert boxes[:, 2:].max(axis=0).tolist() == box[:, 1].tolist()


@given(polylines(), st.floats(0.0, 1.0))
def test_points_lie_on_their_segment_at_their_part_of_its_length(path: Polyline, t: float) -> None:
    segments = Segments.of(path)
    rows = np.arange(len(segments))
    points = point_at(segments, rows, np.full(len(rows), t))
    away = points_to_segments(points, segments)[rows, rows]
    assert away.max() <= 1e-12
    arcs = segments.is_arc & (np.abs(segments.bulge) > 1e-3)
    arm = points[arcs] - segments.centre[arcs]
    swept = np.arctan2(arm[:, 1], arm[:, 0]) - segments.start_angle[arcs]
    sweep = segments.sweep[arcs]
    turn = np.mod(swept - t * sweep + math.pi, 2.0 * math.pi) - math.pi
    assert (np.abs(turn) <= 1e-9).all()


def test_points_at_the_ends_are_the_ends() -> None:
    segments = Segments.of(CIRCLE)
    rows = np.array([0, 1])
    assert point_at(segments, rows, np.zeros(2)).tolist() == segments.start.tolist()
    assert point_at(segments, rows, np.ones(2)) == pytest.approx(segments.end, abs=1e-15)


@given(polylines(), st.floats(0.05, 50.0))
def test_samples_hold_all_vertices_and_no_step_is_too_long(path: Polyline, step: float) -> None:
    points = sample(path, step)
    for vertex in path.vertices[:, :2]:
        assert (points == vertex).all(axis=1).any()
    ring = np.concatenate([points, points[:1]]) if path.closed else points
    assert np.hypot(*np.diff(ring, axis=0).T).max() <= step * (1.0 + 1e-12)
    assert points_to_segments(points, Segments.of(path)).min(axis=1).max() <= 1e-12


@pytest.mark.parametrize("step", [0.0, -1.0, math.nan])
def test_a_step_that_leads_nowhere_is_refused(step: float) -> None:
    with pytest.raises(GeometryError):
        sample(CIRCLE, step)
