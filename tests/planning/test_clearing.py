"""Ways between two places of a region: they stay in it, and are straight where they can be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import Point, Polygon

from camtool.geometry.measure import length, point_at, sample
from camtool.geometry.polylines import Polyline, Segments
from camtool.planning import clearing
from camtool.planning.clearing import (
    ConnectedRegion,
    closest,
    outside_parts,
    route,
    routes,
    scanned,
)
from camtool.planning.paths import MeasuredPath
from tests.oracles.contours import CIRCLE, DUMBBELL, ELL, SQUARE
from tests.oracles.contours import opened as open_path
from tests.oracles.offset import chords, dense, distance, inside
from tests.oracles.routes import outside as outside_of_one
from tests.paths import moved, scaled
from tests.planning.pocket_cases import SHAPES, region_of, shapes
from tests.strategies import examples, polylines


def way(paths: list[Polyline], start: tuple[float, float], end: tuple[float, float]) -> Polyline:
    found = route(np.array(start), np.array(end), ConnectedRegion(region_of(paths)))
    assert found is not None
    return Polyline(found)


def test_straight_where_nothing_is_in_the_way() -> None:
    assert way([SQUARE], (1.0, 1.0), (9.0, 2.0)).vertices.tolist() == [[1, 1, 0], [9, 2, 0]]


def test_round_an_island_the_shorter_way() -> None:
    island = moved(scaled(CIRCLE, 0.2), 5.0, 5.0)
    found = way([SQUARE, island], (1.0, 4.5), (9.0, 4.5))
    half_chord = math.sqrt(4.0 - 0.25)
    arc = 2.0 * 2.0 * math.asin(half_chord / 2.0)
    assert length(found) == pytest.approx(8.0 - 2.0 * half_chord + arc)
    assert found.vertices[:, 1].max() == pytest.approx(4.5)
    assert found.vertices[:, 2].any()


def test_through_the_neck_along_the_wall() -> None:
    found = way([DUMBBELL], (1.0, 1.0), (29.0, 1.0))
    assert [10.0, 4.0] in found.vertices[:, :2].round(9).tolist()
    assert found.vertices[0, :2].tolist() == [1.0, 1.0]
    assert found.vertices[-1, :2].tolist() == [29.0, 1.0]


def test_along_a_corner_of_the_boundary_itself() -> None:
    found = way([ELL], (10.0, 4.0), (4.0, 10.0))
    assert found.vertices[:, :2].tolist() == [[10, 4], [4, 4], [4, 10]]


def test_no_way_to_another_region() -> None:
    rails = ConnectedRegion(region_of([SQUARE, moved(SQUARE, 20.0, 0.0)]))
    assert route(np.array([5.0, 5.0]), np.array([25.0, 5.0]), rails) is None


def are_joined(paths: list[Polyline], ends: list[np.ndarray]) -> bool:
    """True if both ends lie on one connected part of the area that the paths enclose: an island of
    a lopsided contour may lie beside it, as a region of its own."""
    whole = Polygon()
    for path in paths:
        whole = whole.symmetric_difference(Polygon(sample(path, 0.02)))
    return any(
        all(part.distance(Point(*end)) < 1e-3 for end in ends)
        for part in getattr(whole, "geoms", [whole])
    )


@examples(40)
@given(paths=shapes(), parts=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)))
def test_ways_stay_in_the_region(paths: list[Polyline], parts: tuple[float, float]) -> None:
    region = region_of(paths)
    ends = [MeasuredPath.of(region[-i]).at(np.array([part * length(region[-i])]))[0]
            for i, part in enumerate(parts)]  # fmt: skip
    found = route(ends[0], ends[1], ConnectedRegion(region))
    assert (found is not None) == are_joined(paths, ends)
    if found is None or len(found) < 2:
        return
    points = dense(Polyline(found), 17)
    apart = np.min([distance(points, path) for path in region], axis=0)
    clear = points[apart > 1e-3]
    assert inside(clear, [chords(path, 1e-3) for path in region]).all()
    assert found[[0, -1], :2] == pytest.approx(np.array(ends), abs=1e-5)


@examples(40)
@given(
    paths=shapes(),
    parts=st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), max_size=9),
    at_once=st.integers(1, 10),
)
def test_ways_that_are_looked_for_together_are_those_of_one_at_a_time(
    paths: list[Polyline], parts: list[tuple[float, float]], at_once: int
) -> None:
    boundary = region_of(paths)
    region, along = ConnectedRegion(boundary), [MeasuredPath.of(path) for path in boundary]
    ends = np.array(
        [
            [
                each.at(np.array([part * each.total_mm]))[0]
                for each, part in zip((along[-1], along[0]), of, strict=True)
            ]
            for of in parts
        ]
    ).reshape(-1, 2, 2)
    plain = [outside_of_one(*pair, region) for pair in ends]
    assert clearing._outside(ends[:, 0], ends[:, 1], region) == plain
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clearing, "LINKS_AT_ONCE", at_once)
        together = routes(ends[:, 0], ends[:, 1], region)
    for found, (start, end) in zip(together, ends, strict=True):
        one = route(start, end, region)
        assert (found is None) == (one is None)
        assert found is None or np.array_equal(found, one)


@given(path=polylines(), place=st.tuples(st.floats(-20, 20), st.floats(-20, 20)))
def test_the_closest_place_of_a_path(path: Polyline, place: tuple[float, float]) -> None:
    along, point = MeasuredPath.of(path), np.array(place)
    apart, at = closest(along, point)
    assert apart == pytest.approx(float(distance(point[None, :], path)[0]), abs=1e-9)
    found = along.at(np.array([at]))[0]
    assert math.dist(found, point) == pytest.approx(apart, abs=1e-6)


@examples(30)
@given(path=polylines(closed=True), shape=st.sampled_from(["annulus", "ell", "letter"]))
def test_outside_parts_are_what_samples_say(path: Polyline, shape: str) -> None:
    region = region_of(SHAPES[shape])
    parts = outside_parts(region_of([path]), region)
    points = sample(path, length(path) / 4000)
    out = ~inside(points, [chords(ring, 1e-3) for ring in region])
    total = sum(length(part) for part in parts)
    assert total == pytest.approx(out.mean() * length(path), abs=0.02 * length(path))


def test_parts_outside_run_on_over_the_start() -> None:
    (part,) = outside_parts(region_of([SQUARE]), region_of([moved(SQUARE, 5.0, 5.0)]))
    assert not part.closed
    assert length(part) == pytest.approx(30.0)
    assert [part.start.tolist(), part.end.tolist()] == [[5.0, 10.0], [10.0, 5.0]]


def test_scanned_lines() -> None:
    line = Segments.of(open_path((-20, 0.5), (20, 0.5)))
    region = Segments.of(region_of(SHAPES["annulus"]))
    row, low, high = scanned(line, region)
    assert row.tolist() == [0, 0]
    ends = point_at(line, np.repeat(row, 2), np.column_stack([low, high]).ravel())[:, 0]
    outer, inner = math.sqrt(100 - 0.25), math.sqrt(49 - 0.25)
    assert ends == pytest.approx([-outer, -inner, inner, outer])
