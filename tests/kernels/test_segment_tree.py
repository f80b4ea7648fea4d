"""Segments beside points: the tree against the distances of all segments from all points."""

from __future__ import annotations

import numpy as np
import pytest

from camtool.geometry.boxes import segment_tree
from camtool.geometry.distance import points_to_segments
from camtool.geometry.polylines import Polyline, Polylines, Segments, next_vertices, segment_rows
from camtool.kernels.offsets import distances_from, segments_within

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
def test_the_tree_finds_what_all_distances_say(seed: int, count: int) -> None:
    lines = drawn(seed, count)
    rows = segment_rows(lines)
    ends = next_vertices(lines.offsets)[rows]
    tree = segment_tree(lines.vertices, rows.astype(np.int32), ends.astype(np.int32))
    points = np.random.default_rng(seed + 10).uniform(-2.0, 11.0, (200, 2))
    every = points_to_segments(points, Segments.of(lines))
    found = distances_from(points, tree)
    assert found == pytest.approx(every.min(axis=1), abs=1e-12)
    pairs = segments_within(points, 2.0 * found + 1e-9, tree)
    wanted = np.argwhere(every <= (2.0 * found + 1e-9)[:, None])
    assert sorted(map(tuple, pairs.tolist())) == sorted(map(tuple, wanted.tolist()))
    assert (np.diff(pairs[:, 0]) >= 0).all()


def test_no_points_have_no_distances() -> None:
    lines = drawn(0, 1)
    rows = segment_rows(lines).astype(np.int32)
    tree = segment_tree(lines.vertices, rows, (rows + 1).astype(np.int32))
    assert len(distances_from(np.empty((0, 2)), tree)) == 0
    assert len(segments_within(np.empty((0, 2)), np.empty(0), tree)) == 0
