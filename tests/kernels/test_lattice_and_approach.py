"""Rounding to steps, headings, and the search for the nearest approach."""

import math
from fractions import Fraction
from itertools import islice

import numpy as np
import pytest
from camtool_postprocessors.pic_mmh.steps import (
    approach_scan,
    approach_start,
    expected_quadrants,
    heading,
    rounded_radius,
)

from camtool.kernels.lattice import to_steps
from tests.oracles.controllers import SIGNS, direct_search, first_quadrant, x_grows

pytestmark = pytest.mark.checked


def test_hundredths_of_a_micrometre_round_half_away_from_zero() -> None:
    """Every value of the format: n · 0.01 µm is n/14 steps of 0.14 µm, halves included."""
    rng = np.random.default_rng(50)
    counts = np.concatenate([np.arange(-3000, 3000), rng.integers(-9_999_999, 9_999_999, 20_000)])
    got = to_steps([int(n) / 100.0 / 1000.0 for n in counts], 0.00014)
    for n, steps in zip(counts, got, strict=True):
        exact = math.floor(Fraction(abs(int(n)), 14) + Fraction(1, 2))
        assert steps == (exact if n >= 0 else -exact), n


def test_whole_steps_stay_whole() -> None:
    steps = np.arange(-200_000, 200_000, 7)
    for step_mm in (0.00014, 0.5 / 3584, 0.00187):
        assert np.array_equal(to_steps(steps * step_mm, step_mm), steps)


@pytest.mark.parametrize("clockwise", [True, False])
def test_heading_is_that_of_the_numbered_quadrant(clockwise: bool) -> None:
    for x in range(-4, 5):
        for y in range(-4, 5):
            if (x, y) == (0, 0):
                continue
            quadrant = first_quadrant(x, y, clockwise)
            sign_x, sign_y = SIGNS[quadrant]
            grows = x_grows(quadrant, clockwise)
            want = (sign_x, -sign_y) if grows else (-sign_x, sign_y)
            assert heading(x, y, clockwise) == want


def test_rounded_radius_near_halves() -> None:
    for k in (1, 2, 30, 1000, 714_285):
        assert rounded_radius(k, 0) == k
    rng = np.random.default_rng(51)
    for x, y in rng.integers(1, 1_500_000, (2000, 2)):
        square = int(x) ** 2 + int(y) ** 2
        assert rounded_radius(int(x), int(y)) == (math.isqrt(4 * square) + 1) // 2


def test_expected_quadrants_follow_the_sweep() -> None:
    """The count of axes crossed or reached on the way, from the angles."""
    for clockwise in (True, False):
        turn = -1.0 if clockwise else 1.0
        for x, y in [(5, 3), (3, -5), (-4, -4), (0, 6), (6, 0), (-1, 7)]:
            for ex, ey in [(5, 3), (4, 4), (-2, 5), (0, 6), (0, -6), (6, 0), (-6, 0), (5, 2)]:
                quarter = math.pi / 2.0
                a = turn * math.atan2(y, x) / quarter % 4.0
                b = turn * math.atan2(ey, ex) / quarter % 4.0
                if b <= a:
                    b += 4.0
                want = math.floor(b) - math.floor(a)
                assert expected_quadrants(x, y, clockwise, ex, ey) == want, (x, y, ex, ey)


def test_an_end_at_the_centre_is_no_hang() -> None:
    assert expected_quadrants(3, 4, True, 0, 0) == 0


def test_nearest_approach_is_on_the_right_turn() -> None:
    """An end just behind the start belongs to the end of the turn, one just before it to its
    begin; chunks do not matter."""
    path = np.array(list(islice(direct_search(100, 0, False), 2000)))
    for end, around in [((103, -8), 558), ((103, 8), 8)]:
        expected = expected_quadrants(100, 0, False, *end)
        low, high = expected - 1, expected + 1
        found = set()
        for size in (1, 50, 2000):
            tracker = approach_start(100, 0, *end, low)
            for at in range(0, 2000, size):
                approach_scan(path[at : at + size], np.array(end), tracker, low, high)
            found.add((int(tracker[4]), int(tracker[5])))
        assert len(found) == 1
        nearest, square = found.pop()
        assert nearest == pytest.approx(around, abs=3)
        assert square == ((path[nearest - 1] - end) ** 2).sum()


def test_the_first_of_equally_near_samples_counts() -> None:
    points = np.array([[3, 1], [3, 3], [1, 3], [1, 1]])
    tracker = approach_start(1, 1, 2, 2, 1)
    assert tracker[5] == -1
    approach_scan(points, np.array([2, 2]), tracker, 0, 4)
    assert (tracker[4], tracker[5]) == (1, 2)
    tracker = approach_start(1, 1, 2, 2, 0)
    approach_scan(points, np.array([2, 2]), tracker, 0, 4)
    assert (tracker[4], tracker[5]) == (0, 2)
