"""Where a contour comes back to: the latest place before that is the same, against all pairs."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.verification.cuts import returns_to_itself


def literally(places: np.ndarray, gap_mm: float) -> list[tuple[int, int]]:
    found = []
    for later in range(len(places)):
        near = [
            earlier
            for earlier in range(later)
            if math.hypot(*(places[earlier] - places[later])) <= gap_mm
        ]
        if near:
            found.append((near[-1], later))
    return found


@given(st.integers(1, 100), st.sampled_from([0.1, 0.5, 1.0, 3.0]), st.integers(0, 1000))
def test_returns_are_those_of_all_pairs(count: int, gap_mm: float, seed: int) -> None:
    places = np.random.default_rng(seed).uniform(-3.0, 3.0, (count, 2))
    places[::3] = np.round(places[::3])
    assert list(returns_to_itself(places, gap_mm)) == literally(places, gap_mm)


@pytest.mark.parametrize("laps", [1, 2, 500])
def test_many_laps_come_back_to_the_lap_before(laps: int) -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    places = np.tile(square, (laps, 1))
    assert list(returns_to_itself(places, 1e-3)) == [(k - 4, k) for k in range(4, 4 * laps)]
