"""Segments too short to matter: merged, and no point of the path moved by more than the limit."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.distance import points_to_segments
from camtool.geometry.measure import sample, segment_lengths
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.geometry.simplify import without_tiny

LIMIT = 0.01


def path(*points: tuple[float, ...], closed: bool = False) -> Polyline:
    return Polyline(np.array([(*p, 0.0)[:3] for p in points], dtype=np.float64), closed)


def merged(one: Polyline) -> tuple[list[list[float]], int]:
    found = without_tiny(Polylines.of([one]), LIMIT)
    return found.lines[0].vertices.tolist(), found.count


def test_a_speck_between_lines_goes_and_the_corner_stays() -> None:
    found, count = merged(path((0, 0), (5, 0), (5, 0.004), (5, 3)))
    assert (found, count) == ([[0, 0, 0], [5, 0, 0], [5, 3, 0]], 1)


def test_arcs_beside_a_speck_stay_as_they_are() -> None:
    before = path((0, 0, 0.5), (5, 0), (5, 0.004), (5, 3))
    assert merged(before) == ([[0, 0, 0.5], [5, 0, 0], [5, 3, 0]], 1)
    after = path((0, 0), (5, 0), (5, 0.004, 0.5), (5, 3))
    assert merged(after) == ([[0, 0, 0], [5, 0.004, 0.5], [5, 3, 0]], 1)
    both = path((0, 0, 0.5), (5, 0), (5, 0.004, 0.5), (5, 3))
    assert merged(both) == (both.vertices.tolist(), 0)


def test_ends_of_open_paths_stay() -> None:
    found, count = merged(path((0, 0), (0.004, 0), (5, 0), (5, 0.004)))
    assert (found, count) == ([[0, 0, 0], [5, 0.004, 0]], 2)


def test_a_path_of_specks_stays() -> None:
    speck = path((0, 0), (0.003, 0), (0.003, 0.003), closed=True)
    assert merged(speck)[1] == 0


def test_a_curve_of_very_short_chords_keeps_its_shape() -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 5001)[:-1]
    circle = Polyline(np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]), True)
    found, count = merged(circle)
    assert len(found) == 5000 - count
    assert 600 < len(found) < 900
    assert np.hypot(*np.array(found)[:, :2].T).min() > 1.0 - 1e-12


STEPS = st.sampled_from([0.002, 0.004, 0.007, 0.3, 1.0])


@st.composite
def strokes(draw: st.DrawFn) -> Polyline:
    """Long and very short steps in all directions."""
    points = [(0.0, 0.0)]
    for _ in range(draw(st.integers(2, 14))):
        angle, step = draw(st.floats(0.0, 6.28)), draw(STEPS)
        x, y = points[-1]
        points.append((x + step * math.cos(angle), y + step * math.sin(angle)))
    bulges = [draw(st.sampled_from([0.0, 0.0, 0.5, -0.2])) for _ in points]
    steps = np.diff(np.array([*points, points[0]]), axis=0)
    closed = draw(st.booleans()) and bool(np.hypot(*steps[-1]) > 1e-5)
    return Polyline(np.column_stack([points, bulges]), closed)


@given(strokes())
def test_nothing_moves_by_more_than_the_limit(one: Polyline) -> None:
    found = without_tiny(Polylines.of([one]), LIMIT)
    (after,) = found.lines
    assert found.count == len(one) - len(after)
    for here, there in ((one, after), (after, one)):
        points = np.concatenate([sample(here, 0.003), here.vertices[:, :2]])
        assert points_to_segments(points, Segments.of(there)).min(axis=1).max() <= LIMIT + 1e-9
    if not one.closed:
        assert after.start.tolist() == one.start.tolist()
        assert after.end.tolist() == one.end.tolist()
    arcs = segment_lengths(Segments.of(one)) > LIMIT
    long_arcs = {tuple(row) for row in Segments.of(one).end[arcs & Segments.of(one).is_arc]}
    assert long_arcs <= {tuple(row) for row in after.vertices[:, :2]}
