"""What the window shows, and round numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.pictures.page import ticks_of
from camtool.pictures.view import (
    EMPTY_WINDOW_MM,
    TALLEST,
    WIDEST,
    decimals_of,
    fit,
    multiples,
    round_length,
    round_step,
    window,
)

SIZES = st.floats(2e-3, 1e5)


def box(x0: float, x1: float, y0: float, y1: float) -> np.ndarray:
    return np.array([[x0, x1], [y0, y1]])


@given(SIZES, SIZES, st.floats(-1e4, 1e4), st.floats(-1e4, 1e4))
def test_the_part_fills_the_plot_and_lies_within(
    width: float, height: float, x: float, y: float
) -> None:
    part = box(x, x + width, y, y + height)
    view = fit(window(part, None), 60.0, 100.0, 960.0)
    left, bottom = view.page(x, y)
    right, top = view.page(x + width, y + height)
    assert view.box.left < left < right < view.box.right
    assert view.box.top < top < bottom < view.box.bottom
    assert WIDEST - 0.01 <= view.box.height / view.box.width <= TALLEST + 0.01
    filled = max((right - left) / view.box.width, (bottom - top) / view.box.height)
    assert filled > 0.8


def test_y_points_up() -> None:
    view = fit(box(0, 10, 0, 5), 0.0, 0.0, 900.0)
    assert view.page(0.0, 5.0)[1] < view.page(0.0, 0.0)[1]
    assert view.matrix() == f"matrix({view.scale:g} 0 0 -{view.scale:g} 0 450)"


def test_near_surroundings_are_shown_and_far_ones_are_not() -> None:
    part = box(1, 3, 1, 3)
    assert window(part, box(0, 0, 0, 0))[0, 0] < 0.0
    assert window(part, box(-90, 0, 0, 0))[0, 0] > 0.0
    assert window(None, box(-90, 0, 0, 0))[0, 0] < -90.0


def test_a_point_and_nothing_have_a_window() -> None:
    point = window(box(5, 5, 7, 7), None)
    assert (point[:, 0] < [5, 7]).all()
    assert (point[:, 1] > [5, 7]).all()
    assert window(None, None)[0].tolist() == [-EMPTY_WINDOW_MM / 2, EMPTY_WINDOW_MM / 2]


@pytest.mark.parametrize(
    ("least", "step"), [(1.0, 1.0), (1.01, 2.0), (2.5, 5.0), (0.06, 0.1), (9.0, 10.0)]
)
def test_round_steps(least: float, step: float) -> None:
    assert round_step(least) == pytest.approx(step)


@pytest.mark.parametrize("most", [0.1, 0.19, 1.0, 4.9, 5.0, 99.0])
def test_round_lengths_fit(most: float) -> None:
    length = round_length(most)
    assert most / 2.5 < length <= most
    assert f"{length:.0e}"[0] in "125"


def test_multiples_and_their_decimals() -> None:
    assert multiples(-0.25, 0.31, 0.1) == pytest.approx([-0.2, -0.1, 0.0, 0.1, 0.2, 0.3])
    assert [decimals_of(step) for step in (0.05, 0.1, 0.2, 1.0, 20.0)] == [2, 1, 1, 0, 0]


@given(SIZES, SIZES, st.floats(-1e4, 1e4))
def test_ticks_lie_in_the_window_and_there_are_few(width: float, height: float, x: float) -> None:
    view = fit(window(box(x, x + width, 0, height), None), 60.0, 100.0, 960.0)
    ticks = ticks_of(view)
    assert all(view.shows(value, 0.5 * height) for value in ticks.x)
    assert len(ticks.x) <= 12
    assert len(set(map(ticks.text, ticks.x))) == len(ticks.x)
