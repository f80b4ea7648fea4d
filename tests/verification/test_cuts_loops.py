"""Where contours come back to: the latest place before that is the same, against all pairs."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.verification.cuts import latest_before


def literally(places: np.ndarray, run: np.ndarray, gap_mm: float) -> list[int]:
    latest = []
    for later in range(len(places)):
        near = [
            earlier
            for earlier in range(later)
            if run[earlier] == run[later]
            and math.hypot(*(places[earlier] - places[later])) <= gap_mm
        ]
        latest.append(near[-1] if near else -1)
    return latest


@given(
    st.integers(1, 100),
    st.sampled_from([0.1, 0.5, 1.0, 3.0]),
    st.integers(1, 30),
    st.integers(0, 1000),
)
def test_returns_are_those_of_all_pairs(count: int, gap_mm: float, runs: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(-3.0, 3.0, (count, 2))
    places[::3] = np.round(places[::3])
    run = np.sort(rng.integers(0, runs, count))
    assert latest_before(places, run, gap_mm).tolist() == literally(places, run, gap_mm)


@pytest.mark.parametrize("laps", [1, 2, 500])
def test_many_laps_come_back_to_the_lap_before(laps: int) -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    places = np.tile(square, (laps, 1))
    run = np.zeros(len(places), dtype=np.int64)
    latest = latest_before(places, run, 1e-3)
    assert latest.tolist() == [k - 4 if k >= 4 else -1 for k in range(4 * laps)]
