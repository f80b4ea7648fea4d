"""Reversals as a ball-bar shows them, on circles that are made up."""

import math

import numpy as np
import pytest

from camtool.verification.circles import (
    FAR_BINS,
    NEAR_BINS,
    CirclePairs,
    FullCircle,
    reversal_figures,
)

RADIUS = 5.0


def bins_of(points: np.ndarray) -> np.ndarray:
    """(720, 9): count, sum, nearest, farthest of the points in each half degree."""
    bins = np.zeros((720, 9))
    bins[:, 3], bins[:, 6] = np.inf, -np.inf
    angle = np.degrees(np.arctan2(points[:, 1], points[:, 0])) % 360.0
    for which, point in zip((angle * 2.0).astype(int) % 720, points, strict=True):
        one, square = bins[which], float(point @ point)
        one[0] += 1.0
        one[1:3] += point
        if square < one[3]:
            one[3], one[4:6] = square, point
        if square > one[6]:
            one[6], one[7:9] = square, point
    return bins


def travel(ccw: bool, count: int = 72_000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles, points and directions (d_x, d_y) of a way round."""
    angle = (np.arange(count) + 0.5) * 2.0 * np.pi / count * (1.0 if ccw else -1.0)
    points = RADIUS * np.column_stack([np.cos(angle), np.sin(angle)])
    way = np.diff(points, axis=0, append=points[:1])
    return angle, points, np.sign(way)


@pytest.mark.parametrize("ccw", [True, False])
@pytest.mark.parametrize(("x", "y"), [(0.02, 0.0), (0.0, 0.03), (0.02, -0.01)])
def test_play_is_found_again(ccw: bool, x: float, y: float) -> None:
    _, points, way = travel(ccw)
    # Slides that lag by half the play, at once.
    found = reversal_figures(bins_of(points - 0.5 * way * np.array([x, y])), ccw)
    assert found.value == pytest.approx((x, y), abs=2e-4)
    assert found.step[0] == pytest.approx(x, rel=0.02, abs=2e-4)
    assert found.step[2] == pytest.approx(x, rel=0.02, abs=2e-4)
    assert found.step[1] == pytest.approx(y, rel=0.02, abs=2e-4)
    assert found.step[3] == pytest.approx(y, rel=0.02, abs=2e-4)


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
@pytest.mark.parametrize("height", [0.01, -0.02])
def test_a_spike_is_seen_where_it_is(degrees: int, height: float) -> None:
    angle, points, _ = travel(True)
    apart = np.degrees(np.abs(np.angle(np.exp(1j * (angle - math.radians(degrees))))))
    points = points * (1.0 + height / RADIUS * np.maximum(0.0, 1.0 - apart))[:, None]
    spikes = reversal_figures(bins_of(points), True).spike
    assert spikes[degrees // 90] == pytest.approx(height, rel=0.02)
    for other in (90, 180, 270):
        assert spikes[(degrees + other) % 360 // 90] == pytest.approx(0.0, abs=1e-6)


def test_a_true_circle_turns_without_a_trace() -> None:
    found = reversal_figures(bins_of(travel(True)[1]), True)
    numbers = (*found.step, *found.spike, *found.value)
    assert numbers == pytest.approx([0.0] * 10, abs=1e-6)


def test_half_a_circle_says_what_it_can() -> None:
    angle, points, _ = travel(True)
    found = reversal_figures(bins_of(points[np.sin(angle) > 0.0]), True)
    assert math.isnan(found.step[0])
    assert found.step[1] == pytest.approx(0.0, abs=1e-6)
    nothing = reversal_figures(bins_of(points[:1]), True)
    assert all(math.isnan(number) for number in (*nothing.step, *nothing.spike, *nothing.value))


def circle(ccw: bool, radius: float = RADIUS, x: float = 0.0) -> FullCircle:
    return FullCircle((x, 0.0), radius, ccw, -1.0, 0, 0)


def test_both_ways_round() -> None:
    ways = [bins_of(travel(ccw)[1] * scale) for ccw, scale in ((True, 1.002), (False, 0.999))]
    pairs = CirclePairs([circle(True), circle(False)])
    assert pairs.add(0, ways[0]) == []
    (both,) = pairs.add(1, ways[1])
    assert both.circular_mm == pytest.approx(RADIUS * 0.003, rel=1e-3)
    assert both.radial_mean_mm == pytest.approx(RADIUS * 0.0005, rel=1e-2)


@pytest.mark.parametrize(
    "other", [circle(True), circle(False, x=1.0), circle(False, radius=6.0)], ids=str
)
def test_circles_that_are_no_pair(other: FullCircle) -> None:
    pairs = CirclePairs([circle(True), other])
    bins = bins_of(travel(True)[1])
    assert pairs.add(0, bins) == []
    assert pairs.add(1, bins) == []


def test_each_circle_has_one_partner() -> None:
    bins = bins_of(travel(True)[1])
    pairs = CirclePairs([circle(True), circle(True), circle(False)])
    assert [len(pairs.add(index, bins)) for index in range(3)] == [0, 0, 1]


def test_steps_are_those_of_lines_by_least_squares() -> None:
    """Against numpy's fit of the bins on both sides of 0°, on radii of any kind."""
    rng = np.random.default_rng(4)
    bins = np.zeros((720, 9))
    angle = np.radians((np.arange(720) + 0.5) / 2.0)
    radius = RADIUS + rng.normal(0.0, 0.1, 720)
    bins[:, 0], bins[:, 1], bins[:, 2] = 1.0, radius * np.cos(angle), radius * np.sin(angle)
    bins[:, 3] = bins[:, 6] = radius**2
    of_arc = math.radians(0.25) / math.sin(math.radians(0.25))
    away = np.arange(NEAR_BINS, FAR_BINS)
    ahead, behind = (
        np.polyfit(away + 0.5, of_arc * radius[row], 1)[1] for row in (away, -1 - away)
    )
    assert reversal_figures(bins, True).step[0] == pytest.approx(ahead - behind, rel=1e-9)
