"""Closed forms of stepped lines against their events in fractions."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.kernels.floors import (
    COUNTED_AT_ONCE,
    counted_along,
    most_along,
    negative_along,
    sums_along,
)
from tests.oracles.stepped_lines import steps_of_line, sums_of_line, values_of_line
from tests.strategies import examples

pytestmark = pytest.mark.checked


@st.composite
def windows(draw: st.DrawFn) -> tuple[int, tuple[int, int, int]]:
    """Count, and size, phase and events of a window into a line: along an axis, a diagonal, with
    a common divisor, or any; even and odd, and from any event on."""
    divisor, events = draw(st.sampled_from([1, 1, 2, 3, 8])), draw(st.integers(1, 400))
    size = draw(st.one_of(st.just(0), st.just(events), st.integers(0, events)))
    begin = draw(st.integers(0, events * divisor))
    phase = draw(st.sampled_from([0, events * divisor - 1]))
    phase = (2 * size * divisor * begin + phase) % (2 * events * divisor)
    count = draw(st.integers(1, events * divisor + 1))
    return count, (size * divisor, phase, events * divisor)


@st.composite
def forms(draw: st.DrawFn, line: tuple[int, int, int]) -> tuple[float, float, float]:
    """Distances from a line: exactly that of the steps, a little turned and shifted, and any."""
    size, _, events = line
    across = draw(st.sampled_from([0.004, -0.004, 1.0]))
    turned = draw(st.sampled_from([0.0, 0.0, 0.3, -0.7, 5.0])) * across / events
    level = draw(st.sampled_from([0.0, 0.25, -0.5])) * across
    kind = draw(st.integers(0, 5))
    if kind == 0:
        number = st.floats(-1.0, 1.0)
        return draw(number), draw(number), draw(number)
    if kind == 1:  # the minor slide stands
        return turned, 0.0, level
    if kind == 2:  # the major slide stands
        return 0.0, across, -across * draw(st.floats(0.0, 1.0)) * max(size, 1)
    return -across * size / events + turned, across, level


@given(windows())
def test_sums_are_those_of_the_events(window: tuple[int, tuple[int, int, int]]) -> None:
    count, line = window
    exact = [float(one) for one in sums_of_line(count, *line)]
    assert sums_along(count, *line) == pytest.approx(exact, rel=1e-15)


@given(st.data())
def test_the_greatest_value_and_its_event(data: st.DataObject) -> None:
    count, line = data.draw(windows())
    along, across, _ = data.draw(forms(line))
    values = values_of_line(steps_of_line(count, *line), along, across, 0.0)
    index, most = most_along(count, along, across, *line)
    rounding = 1e-15 * max(abs(float(one)) for one in (*values, 1))
    assert abs(float(values[index] - max(values))) <= rounding
    assert most == pytest.approx(float(values[index]), rel=1e-14, abs=rounding)


@given(st.data())
def test_counts_of_values_up_to_a_limit(data: st.DataObject) -> None:
    count, line = data.draw(windows())
    form = data.draw(forms(line))
    sizes = sorted(abs(one) for one in values_of_line(steps_of_line(count, *line), *form))
    near = 1e-6 * abs(form[1]) + 1e-13
    for size in (data.draw(st.sampled_from(sizes)), data.draw(st.floats(0.0, 0.01))):
        limit = float(size) + 2.0 * near
        certain = sum(one <= Fraction(limit) - Fraction(near) for one in sizes)
        possible = sum(one <= Fraction(limit) + Fraction(near) for one in sizes)
        assert certain <= counted_along(count, line, form, limit) <= possible
    assert counted_along(count, line, form, -1.0) == 0


@pytest.mark.parametrize("across", [1e-300, -1e-300, 1e-25, -1e-18, 5e-324])
@pytest.mark.parametrize("along", [0.5, -0.25, 0.0])
def test_forms_that_hardly_depend_on_the_steps(along: float, across: float) -> None:
    """A nominal line along the major axis, but for rounding: levels are farther away than any."""
    count, line = 41, (7, 3, 50)
    for level in (-10.0, 0.0, 4.0, 1e-20):
        values = values_of_line(steps_of_line(count, *line), along, across, level)
        exact = float(sum(one for one in values if one < 0))
        assert negative_along(count, line, (along, across, level)) == pytest.approx(
            exact, abs=1e-12
        )
        for limit in (0.3, 4.1, 20.3):
            expected = sum(abs(one) <= limit for one in values)
            assert counted_along(count, line, (along, across, level), limit) == expected


@given(st.data())
def test_the_sum_of_negative_values(data: st.DataObject) -> None:
    count, line = data.draw(windows())
    form = data.draw(forms(line))
    values = values_of_line(steps_of_line(count, *line), *form)
    exact = float(sum(one for one in values if one < 0))
    size = float(sum(abs(one) for one in values))
    assert negative_along(count, line, form) == pytest.approx(
        exact, rel=1e-12, abs=1e-12 * size + 1e-15
    )


@given(st.integers(1, 3000), st.integers(0, 3000), st.booleans())
def test_figures_of_a_whole_line(events: int, size: int, nearest: bool) -> None:
    """The formulas of a line from grid point to grid point: n = N / gcd, L = √(a'² + n²)."""
    size = min(size, events)
    divisor = math.gcd(size, events)
    n, a = events // divisor, size // divisor
    length = math.hypot(a, n)
    line = (size, events - 1 if nearest else 0, events)
    count, _, _, teeth, squares, _ = sums_along(events, *line)
    scale = events * length / n
    most = max(most_along(events, -sign * size, sign * events, *line)[1] for sign in (1, -1))
    if not nearest:
        assert most / scale == pytest.approx((n - 1) / length)
        return
    assert most / scale == pytest.approx(n // 2 / length)
    assert teeth / count / scale == pytest.approx(0.0 if n % 2 else -0.5 / length)
    square = (n * n - 1) / 12 if n % 2 else (n * n + 2) / 12
    assert math.sqrt(squares / count) / scale == pytest.approx(math.sqrt(square) / length)
    rank = math.ceil(0.95 * events)
    j = 0 if rank <= divisor else math.ceil((rank - divisor) / (2 * divisor))
    form = (-size / events, 1.0, 0.0)
    unit = divisor / events
    assert counted_along(events, line, form, (j + 0.5) * unit) >= rank
    assert j == 0 or counted_along(events, line, form, (j - 0.5) * unit) < rank


@examples(20)
@given(st.integers(1 << 20, 1 << 29), st.floats(0.0, 1.0), st.integers(1, 60))
def test_long_lines_are_sums_of_their_parts(events: int, slope: float, parts: int) -> None:
    """Beyond 63 bits: the sums of a line in one piece are those of windows of it."""
    size = int(slope * events)
    line = (size, events - 1, events)
    whole = sums_along(events, *line)
    bounds = np.linspace(0, events, parts + 1).astype(int).tolist()
    teeth = squares = by_place = 0.0
    for low, high in pairwise(bounds):
        if low == high:
            continue
        before = 2 * size * low + events - 1
        base = events * (before // (2 * events)) - size * low
        n, j, _, u, uu, ju = sums_along(high - low, size, before % (2 * events), events)
        teeth += u + base * n
        squares += uu + 2.0 * base * u + float(base) * base * n
        by_place += ju + base * j + low * (u + base * n)
    assert squares == pytest.approx(whole[4], rel=1e-12)
    assert teeth == pytest.approx(whole[3], abs=1e-12 * math.sqrt(events * whole[4]))
    scale = math.sqrt(whole[2] * whole[4])
    assert by_place == pytest.approx(whole[5], abs=1e-12 * scale)


def test_counts_of_a_line_in_several_windows() -> None:
    events = 3 * COUNTED_AT_ONCE + 5
    size = 1_234_567
    form = (-size / events, 1.0, 0.0)
    half = counted_along(events, (size, events - 1, events), form, 0.25)
    assert half == pytest.approx(events / 2, abs=10)
