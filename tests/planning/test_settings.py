"""The z of passes: equal steps down to exactly the depth."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.planning.settings import MAX_PASSES, carved_levels, levels

depths = st.floats(1e-3, 100.0)
shares = st.floats(0.02, 1.0)


@pytest.mark.parametrize(
    ("depth", "step", "last", "wanted"),
    [
        (1.0, None, None, [-1.0]),
        (1.0, 2.0, None, [-1.0]),
        (1.0, 1.0, None, [-1.0]),
        (0.3, 0.1, None, [-0.1, -0.2, -0.3]),  # 0.3 / 0.1 is a hair below 3, and 0.1 · 3 above 0.3
        (2.1, 0.3, None, [-0.3 * k for k in range(1, 8)]),  # 2.1 / 0.3 is a hair above 7
        (1.0, 0.4, None, [-1 / 3, -2 / 3, -1.0]),
        (1.0, 0.5, 0.1, [-0.45, -0.9, -1.0]),
        (1.0, None, 0.1, [-0.9, -1.0]),
        (1.0, None, 1.0, [-1.0]),  # the last pass is all there is
        (0.3, 0.1, 0.1, [-0.1, -0.2, -0.3]),
    ],
)
def test_levels(depth: float, step: float | None, last: float | None, wanted: list[float]) -> None:
    assert levels(depth, step, last) == pytest.approx(wanted, rel=1e-12)


@given(depths, shares, st.one_of(st.none(), shares))
def test_steps_are_equal_and_no_larger_than_asked(
    depth: float, share: float, last_share: float | None
) -> None:
    step = share * depth
    last = None if last_share is None else last_share * step
    found = levels(depth, step, last)
    assert found[-1] == -depth
    steps = -np.diff([0.0, *found])
    assert (steps > 0.0).all()
    assert steps.max() <= step * (1.0 + 1e-6)
    if last is not None:
        assert steps[-1] == pytest.approx(last, rel=1e-6)
        steps = steps[:-1]
    if len(steps):
        assert steps == pytest.approx(np.full(len(steps), steps[0]), rel=1e-6)
        rest = depth - (last or 0.0)
        # One pass less would step further down than asked.
        assert len(steps) == 1 or rest / (len(steps) - 1) > step * (1.0 - 1e-6)


@pytest.mark.parametrize(
    ("depth", "step", "last", "key"),
    [
        (0.0, None, None, "depth"),
        (-1.0, None, None, "depth"),
        (math.nan, None, None, "depth"),
        (math.inf, None, None, "depth"),
        (1.0, 0.0, None, "step_down"),
        (1.0, -0.1, None, "step_down"),
        (1.0, 0.5 / MAX_PASSES, None, "step_down"),
        (1.0, 1e-320, None, "step_down"),
        (1.0, 0.5, 0.0, "last_pass"),
        (1.0, 0.5, 0.6, "last_pass"),
        (1.0, None, 1.1, "last_pass"),
    ],
)
def test_what_cannot_be(depth: float, step: float | None, last: float | None, key: str) -> None:
    with pytest.raises(OptionError) as caught:
        levels(depth, step, last)
    assert caught.value.where == f"key {key}"
    assert caught.value.mend


@given(depths, shares, st.one_of(st.none(), shares))
def test_a_v_bit_takes_no_more_than_the_step_under_its_tip(
    depth: float, share: float, last_share: float | None
) -> None:
    step = depth * share
    last = None if last_share is None else step * last_share
    passes = np.array([0.0, *carved_levels(depth, step, last)])
    steps = -np.diff(passes)
    assert passes[-1] == -depth
    assert steps[0] <= step * (1.0 + 1e-8)
    assert np.all(steps > 0.0)
    assert np.all(2.0 * steps[1:] <= step * (1.0 + 1e-8))
    assert set(levels(depth, step, last)) <= set(passes.tolist())


def test_a_v_bit_without_a_step_down_makes_the_passes_that_are_asked() -> None:
    assert carved_levels(1.0, None, None) == levels(1.0, None, None)
    assert carved_levels(1.0, None, 0.2) == levels(1.0, None, 0.2)
