"""Where contours come back to: the latest place before that is the same, against all pairs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.kernels.chaining import FAR, latest_near
from tests.oracles import returns

pytestmark = pytest.mark.checked


@given(
    st.integers(0, 100),
    st.sampled_from([0.1, 0.5, 1.0, 3.0]),
    st.integers(1, 30),
    st.integers(0, 1000),
)
def test_returns_are_those_of_all_pairs(count: int, gap_mm: float, paths: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(-3.0, 3.0, (count, 2))
    places[::3] = np.round(places[::3])
    begins = np.sort(np.append(rng.integers(0, count + 1, paths - 1), [0, count]))
    found = latest_near(places, begins, gap_mm)
    assert found.tolist() == returns.latest_near(places, begins, gap_mm)
    shift = np.array([0.0, 6.0 * gap_mm])
    for moved, reach in ((places[:, ::-1], gap_mm), (-places, gap_mm), (2 * places, 2 * gap_mm)):
        again = latest_near(np.ascontiguousarray(moved), begins, reach)
        assert np.array_equal(again, found)
    again = latest_near(places + shift, begins, gap_mm)
    assert again.tolist() == returns.latest_near(places + shift, begins, gap_mm)


@pytest.mark.parametrize("laps", [1, 2, 500])
def test_many_laps_come_back_to_the_lap_before(laps: int) -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    latest = latest_near(np.tile(square, (laps, 1)), np.array([0, 4 * laps]), 1e-3)
    assert latest.tolist() == [k - 4 if k >= 4 else -1 for k in range(4 * laps)]


def test_places_too_far_for_cells_are_compared_as_they_are() -> None:
    places = FAR * np.array([[1.0, 2.0], [3.0, 4.0], [1.0, 2.0], [-5.0, 0.0], [3.0, 4.0]])
    assert latest_near(places, np.array([0, 5]), 0.5).tolist() == [-1, -1, 0, -1, 1]
