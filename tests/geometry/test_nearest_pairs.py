"""Segments beside points: the search against the distances of all segments from all points."""

from __future__ import annotations

import numpy as np
import pytest

from camtool.geometry.boxes import distances_from, moves_of, nearest_pairs
from camtool.geometry.distance import points_to_segments
from camtool.geometry.polylines import Polyline, Polylines, Segments

pytestmark = pytest.mark.checked


def drawn(seed: int, count: int) -> Polylines:
    """Paths of lines and arcs about the same places, every other one closed."""
    rng = np.random.default_rng(seed)
    paths = []
    for number in range(count):
        vertices = np.column_stack([rng.uniform(0.0, 9.0, (7, 2)), rng.uniform(-1.0, 1.0, 7)])
        vertices[::2, 2] = 0.0
        paths.append(Polyline(vertices, closed=bool(number % 2)))
    return Polylines.of(paths)


@pytest.mark.parametrize("count", [1, 2, 40])
@pytest.mark.parametrize("seed", range(3))
def test_finds_what_all_distances_say(seed: int, count: int) -> None:
    segments = Segments.of(drawn(seed, count))
    moves = moves_of(segments)
    points = np.random.default_rng(seed + 10).uniform(-2.0, 11.0, (200, 2))
    points = np.vstack([points, segments.start])  # distances from 0 to many octaves of it
    every = points_to_segments(points, segments)
    distances, point, move = nearest_pairs(points, moves, 2.0, 1e-9)
    assert distances == pytest.approx(every.min(axis=1), abs=1e-12)
    assert (distances == distances_from(points, moves)).all()
    wanted = np.argwhere(every <= (2.0 * distances + 1e-9)[:, None])
    assert sorted(zip(point, move, strict=True)) == sorted(map(tuple, wanted.tolist()))


def test_no_points_have_no_distances() -> None:
    moves = moves_of(Segments.of(drawn(0, 1)))
    distances, point, move = nearest_pairs(np.empty((0, 2)), moves, 1.0, 1e-9)
    assert len(distances) == len(point) == len(move) == 0


def test_points_of_nothing_are_infinitely_far() -> None:
    moves = moves_of(Segments.of(Polylines.of([])))
    assert distances_from(np.zeros((2, 2)), moves).tolist() == [np.inf, np.inf]
