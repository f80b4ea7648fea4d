"""The feed rises where a tool is engaged less, and chips get no thicker by it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats, Ints
from camtool.geometry.polylines import Polyline, Segments
from camtool.planning.thin_chips import feed_levels, level_of, thin_chip_feeds, without_peaks
from tests.strategies import examples


@examples(200, nightly=2_000)
@given(st.floats(0.1, 1.5), st.floats(1e-3, 1.0), st.floats(50.0, 1000.0), st.floats(1.0, 20.0))
def test_chips_are_no_thicker_than_at_the_limit(
    limit: float, part: float, feed: float, ratio: float
) -> None:
    levels = feed_levels(feed, ratio * feed)
    assert levels[0] == feed
    assert levels[-1] == pytest.approx(ratio * feed)
    assert (levels[1:] <= 1.2501 * levels[:-1]).all()
    engaged = part * limit
    level = int(level_of(np.array([engaged]), limit, levels)[0])
    thickest = feed * math.sin(limit) * (1.0 + 1e-9)
    assert levels[level] * math.sin(engaged) <= thickest
    if level + 1 < len(levels):
        assert levels[level + 1] * math.sin(engaged) > feed * math.sin(limit) * (1.0 - 1e-9)


@examples(200, nightly=2_000)
@given(st.lists(st.tuples(st.integers(0, 4), st.floats(0.1, 3.0)), min_size=1, max_size=30))
def test_no_rise_is_shorter_than_a_length(rows: list[tuple[int, float]]) -> None:
    level, lengths = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    steady = without_peaks(level, lengths, 2.0)
    assert (steady <= level).all()
    for k in range(1, 5):
        total = 0.0
        for one, size in [*zip(steady.tolist(), lengths.tolist(), strict=True), (0, 0.0)]:
            if one >= k:
                total += size
                continue
            assert total == 0.0 or total >= 2.0 - 1e-9
            total = 0.0


def cut(*points: tuple[float, float]) -> tuple[Floats, Ints]:
    path = Segments.of(Polyline(np.array([[*point, 0.0] for point in points])))
    count = len(path)
    ends = np.column_stack([path.start, path.end])
    return np.column_stack([ends, np.ones(count), np.zeros((count, 4))]), np.arange(count)


def straight(width: float, beyond: tuple[tuple[float, float], ...] = ()) -> Floats:
    """The feeds of a tool of radius 1 along y = 0, towards −x, with stock of this width on its
    right, after a cut beside it; `beyond`: a cut before on the other side."""
    before = [cut((-9.0, -width), (30.0, -width))]
    if beyond:
        before.append(cut(*beyond))
    rows = [*before, cut((25.0, 0.0), (5.0, 0.0))]
    levels = feed_levels(100.0, 400.0)
    return thin_chip_feeds(rows, 1.0, math.radians(60.0), levels)[-1].feed_mm_min


@pytest.mark.parametrize("width", [0.02, 0.1, 0.2, 0.4, 0.49])
def test_beside_a_straight_cut_the_feed_follows_from_the_width(width: float) -> None:
    """A cut of the width a engages by acos(1 − a):  h = f sqrt(2 a − a²)."""
    feed = straight(width)[0]
    thickness = math.sqrt(2.0 * width - width**2)
    best = min(100.0 * math.sin(math.radians(60.0)) / thickness, 400.0)
    assert best / 1.32 <= feed <= best * 1.02


def test_a_thin_wall_ahead_of_the_tool_has_thick_chips() -> None:
    """Stock of 1.2 with all but 0.1 of its far side cleared: the tool meets the wall in front."""
    assert straight(1.0, ((-9.0, 1.1), (30.0, 1.1)))[0] == 100.0
