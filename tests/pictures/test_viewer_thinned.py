"""Fewer points of the predicted path: the path stays within the tolerance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.distance import points_to_segments
from camtool.geometry.polylines import Segments
from camtool.pictures.viewer.columns import FINEST_MM, FINEST_SHARE, thinned


def wandering(seed: int, count: int) -> np.ndarray:
    """A path of straight and bent segments with steps of some µm."""
    rng = np.random.default_rng(seed)
    turn = np.where(rng.random(count) < 0.1, rng.normal(0.0, 1.0, count), 0.0).cumsum()
    turn += np.where(rng.random(count) < 0.5, 1e-3, 0.0).cumsum()
    return np.column_stack([np.cos(turn), np.sin(turn)]).cumsum(axis=0) * 3e-3


@given(st.integers(0, 1000), st.integers(2, 120))
def test_points_left_out_lie_near_and_have_the_colour_of_those_that_stay(
    seed: int, count: int
) -> None:
    points = wandering(seed, count)
    bins = np.random.default_rng(seed).integers(0, 3, count) // 2
    kept = thinned(points, bins, 0.005)
    assert kept[0] == 0
    assert kept[-1] == count - 1
    # Each point has the colour of the next one that stays: pieces keep theirs.
    after = kept[np.searchsorted(kept, np.arange(1, count))]
    assert (bins[1:] == bins[after]).all()
    pieces = Segments.between(points[kept[:-1]], points[kept[1:]], np.zeros(len(kept) - 1))
    away = points_to_segments(points, pieces).min(axis=1).max()
    assert away <= np.log2(count) * min(FINEST_MM, FINEST_SHARE * 0.005)


def test_a_straight_line_keeps_its_ends_alone() -> None:
    points = np.column_stack([np.linspace(0.0, 5.0, 1025), np.zeros(1025)])
    assert thinned(points, np.zeros(1025, dtype=np.int64), 0.005).tolist() == [0, 1024]


@pytest.mark.parametrize("colours", [1, 24])
def test_there_are_never_more_than_most(colours: int) -> None:
    points = wandering(5, 4000)
    bins = np.arange(4000) % colours
    kept = thinned(points, bins, 0.005, max_points=500)
    assert 50 < len(kept) <= 500
    assert (np.diff(kept) > 0).all()


def test_the_smaller_the_errors_the_finer_the_path() -> None:
    turn = np.linspace(0.0, 6.28, 5000)
    points = np.column_stack([np.cos(turn), np.sin(turn)])
    bins = np.zeros(5000, dtype=np.int64)
    coarse, fine = (len(thinned(points, bins, largest)) for largest in (0.01, 0.0001))
    assert coarse < 0.3 * fine
