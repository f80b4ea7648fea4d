"""The outline of what a disc sweeps along paths: by formula, and against buffers of chords."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.measure import signed_areas
from camtool.geometry.offset import swept_outline
from camtool.geometry.polylines import Polyline, Polylines
from tests.oracles.geometry import line_string
from tests.strategies import examples, polylines

CHORDS = 64
"""Chords of a segment in the oracle."""


def area_of(paths: list[Polyline], radius_mm: float) -> float:
    outline = swept_outline(Polylines.of(paths), radius_mm)
    assert outline is not None
    assert outline.closed.all()
    return float(signed_areas(outline).sum())


def line(*numbers: float) -> Polyline:
    return Polyline(np.array([[*numbers[:2], 0.0], [*numbers[2:], 0.0]]))


def circle(radius_mm: float) -> Polyline:
    return Polyline(np.array([[radius_mm, 0.0, 1.0], [-radius_mm, 0.0, 1.0]]), True)


def test_a_line_is_a_capsule() -> None:
    assert area_of([line(0, 0, 3, 4)], 0.5) == pytest.approx(5.0 + 0.25 * math.pi, rel=1e-12)


@pytest.mark.parametrize(("radius_mm", "hole_mm"), [(0.5, 1.5), (2.0, 0.0), (3.0, 0.0)])
def test_a_circle_is_a_ring_until_its_middle_is_covered(radius_mm: float, hole_mm: float) -> None:
    wanted = math.pi * ((2.0 + radius_mm) ** 2 - hole_mm**2)
    assert area_of([circle(2.0)], radius_mm) == pytest.approx(wanted, rel=1e-12)


def test_arcs_stay_arcs() -> None:
    outline = swept_outline(Polylines.of([circle(2.0)]), 0.5)
    assert outline is not None
    assert len(outline) == 2
    assert (outline.vertices[:, 2] != 0.0).all()
    assert sorted(np.hypot(*outline.vertices[:, :2].T).round(9)) == [1.5, 1.5, 2.5, 2.5]


@pytest.mark.parametrize("times", [2, 3])
def test_what_is_repeated_counts_once(times: int) -> None:
    paths = [circle(2.0), line(-5, 0, 5, 0), line(-3, 0, 1, 0)]
    once = area_of(paths, 0.25)
    assert area_of(paths * times, 0.25) == pytest.approx(once, rel=1e-9)


def test_a_path_that_ends_beside_its_start() -> None:
    # As slides do that come back to a contour's start with an error.
    corners = [[0, 0], [5, 0], [5, 5], [0, 5], [0.01, 0.004]]
    path = Polyline(np.column_stack([corners, np.zeros(5)]))
    assert area_of([path], 0.5) == pytest.approx(
        shapely.buffer(shapely.LineString(corners), 0.5, quad_segs=500).area, rel=1e-5
    )


@examples(60, 3000)
@given(
    st.lists(polylines(max_points=7), min_size=1, max_size=3),
    st.sampled_from([0.05, 0.5, 3.0, 20.0]),
    st.booleans(),
)
def test_any_paths_cover_what_their_chords_cover(
    paths: list[Polyline], radius_mm: float, is_twice: bool
) -> None:
    # Pieces of a path: a buffer of a closed line loses what it covers within itself.
    chords = [shapely.get_coordinates(line_string(path, CHORDS)) for path in paths]
    pieces = [
        shapely.LineString(points[low : low + 17])
        for points in chords
        for low in range(0, len(points) - 1, 16)
    ]
    wanted = shapely.union_all(shapely.buffer(pieces, radius_mm, quad_segs=100)).area
    found = area_of(paths * 2 if is_twice else paths, radius_mm)
    assert found == pytest.approx(wanted, rel=2e-3, abs=1e-3)
