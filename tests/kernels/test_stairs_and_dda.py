"""The compiled stairs and DDA against the literal loops, and against the thesis's counts."""

import math
from itertools import islice

import numpy as np
import pytest
from camtool_postprocessors.pic_mmh.steps import (
    dda_arc_fill,
    dda_arc_start,
    dda_line_fill,
    stairs_fill,
    stairs_start,
)

from tests.oracles import controllers as twins

pytestmark = pytest.mark.checked

NOWHERE = (10**9, 10**9)
STARTS = [(0, 30), (30, 0), (0, -30), (-30, 0)]


def fill_stairs(
    x: int, y: int, clockwise: bool, count: int, error: int = 0, end: tuple[int, int] = NOWHERE
) -> np.ndarray:
    out = np.empty((count, 2), dtype=np.int64)
    filled, _ = stairs_fill(stairs_start(x, y, clockwise, error), *end, out)
    return out[:filled]


def fill_dda(
    x: int, y: int, clockwise: bool, count: int, end: tuple[int, int] = NOWHERE
) -> tuple[np.ndarray, int]:
    out = np.empty((count, 2), dtype=np.int64)
    filled, passes, _ = dda_arc_fill(dda_arc_start(x, y, clockwise), *end, out)
    return out[:filled], passes


def twin_dda(x: int, y: int, clockwise: bool, count: int) -> tuple[np.ndarray, int]:
    points, passes = [], 0
    for point, pulse in twins.dda_arc(x, y, clockwise):
        passes += 1
        if pulse:
            points.append(point)
            if len(points) == count:
                break
    return np.array(points, dtype=np.int64), passes


def small_starts() -> list[tuple[int, int]]:
    span = range(-40, 41)
    return [(x, y) for x in span for y in span if 0 < math.hypot(x, y) <= 40]


@pytest.mark.parametrize("clockwise", [True, False])
@pytest.mark.parametrize("start", STARTS)
def test_full_circles_take_the_counts_of_the_thesis(
    start: tuple[int, int], clockwise: bool
) -> None:
    """Tabla 7: 240 iterations of stairs; 188 passes of DDA, of which 8 are idle."""
    path = fill_stairs(*start, clockwise, 1000, end=start)
    assert len(path) == 240
    points, passes = fill_dda(*start, clockwise, 1000, end=start)
    assert (passes, len(points)) == (188, 180)


@pytest.mark.parametrize("clockwise", [True, False])
def test_every_small_start_equals_the_literal_loops(clockwise: bool) -> None:
    for x, y in small_starts():
        radius = round(math.hypot(x, y))
        count = 9 * radius + 12
        got, passes = fill_dda(x, y, clockwise, count)
        want, want_passes = twin_dda(x, y, clockwise, count)
        assert np.array_equal(got, want), (x, y)
        assert passes == want_passes
        for square in (x * x + y * y, radius**2):
            literal = list(islice(twins.stairs(x, y, clockwise, square), count))
            path = fill_stairs(x, y, clockwise, count, x * x + y * y - square)
            assert np.array_equal(path, literal), (x, y, square)


def test_large_seeded_starts_equal_the_literal_loops() -> None:
    rng = np.random.default_rng(30)
    for radius in (300, 3000, 21_428, 714_285):
        angle = rng.uniform(0.0, 2.0 * math.pi)
        x, y = round(radius * math.cos(angle)), round(radius * math.sin(angle))
        clockwise, count = bool(rng.integers(2)), min(9 * radius, 30_000)
        assert np.array_equal(
            fill_dda(x, y, clockwise, count)[0], twin_dda(x, y, clockwise, count)[0]
        )
        literal = list(islice(twins.stairs(x, y, clockwise, x * x + y * y), count))
        assert np.array_equal(fill_stairs(x, y, clockwise, count), literal)


def test_stairs_stay_within_a_step() -> None:
    rng = np.random.default_rng(31)
    for x, y in rng.integers(1, 2000, (200, 2)):
        radius = math.hypot(x, y)
        path = fill_stairs(int(x), int(y), bool(rng.integers(2)), int(9 * radius))
        assert np.abs(np.hypot(path[:, 0], path[:, 1]) - radius).max() < 1.0


def test_dda_quadrants_end_full() -> None:
    """From an axis every quadrant ends on the next one at exactly R; greatest error 1.155."""
    worst = 0.0
    for radius in range(1, 600):
        path, _ = fill_dda(0, radius, True, 8 * radius, end=(radius, 0))
        assert tuple(path[-1]) == (radius, 0)
        if radius < 300:
            worst = max(worst, np.abs(np.hypot(path[:, 0], path[:, 1]) - radius).max())
    assert worst == pytest.approx(1.155, abs=0.001)


def test_dda_from_inside_a_quadrant_misses_the_axis_by_one_at_most() -> None:
    rng = np.random.default_rng(32)
    stalled = 0
    for x, y in rng.integers(1, 400, (500, 2)):
        radius = round(math.hypot(x, y))
        path, _ = fill_dda(int(x), int(y), True, 3 * radius)
        on_axis = path[path[:, 1] == 0][0]
        assert radius - 1 <= on_axis[0] <= radius
        stalled += int(on_axis[0] < radius)
    assert 5 <= stalled <= 50


@pytest.mark.parametrize("size", [1, 7, 64])
def test_filling_goes_on_where_it_stopped(size: int) -> None:
    buffer = np.empty((size, 2), dtype=np.int64)
    whole, whole_passes = fill_dda(0, 30, False, 180)
    state, parts, passes = dda_arc_start(0, 30, False), [], 0
    met = False
    while not met:
        filled, more, met = dda_arc_fill(state, 0, 30, buffer)
        parts.append(buffer[:filled].copy())
        passes += more
    assert np.array_equal(np.concatenate(parts), whole)
    assert passes == whole_passes
    steps = fill_stairs(0, 30, False, 240)
    state, parts, met = stairs_start(0, 30, False), [], False
    while not met:
        filled, met = stairs_fill(state, 0, 30, buffer)
        parts.append(buffer[:filled].copy())
    assert np.array_equal(np.concatenate(parts), steps)


def run_line(a: int, b: int, size: int) -> tuple[np.ndarray, int]:
    registers, counters = np.zeros(2), np.zeros(2, dtype=np.int64)
    buffer, parts, passes = np.empty((size, 2), dtype=np.int64), [], 0
    done = False
    while not done:
        filled, more, done = dda_line_fill(a, b, registers, counters, buffer)
        parts.append(buffer[:filled].copy())
        passes += more
    return np.concatenate(parts), passes


def check_line(a: int, b: int, size: int) -> None:
    literal = list(twins.dda_line(a, b))
    points = np.array([p for p, pulse in literal if pulse], dtype=np.int64).reshape(-1, 2)
    got, passes = run_line(a, b, size)
    assert np.array_equal(got, points), (a, b)
    assert passes == len(literal)


def test_every_small_line_equals_the_literal_loop() -> None:
    for a in range(41):
        for b in range(41):
            check_line(a, b, 1000)


def test_large_seeded_lines_equal_the_literal_loop() -> None:
    rng = np.random.default_rng(33)
    for scale in (300, 5000, 40_000):
        for _ in range(3):
            a, b = (int(v) for v in rng.integers(0, scale, 2))
            check_line(a, b, int(rng.integers(1, 5000)))


def test_a_line_along_an_axis_has_one_idle_pass() -> None:
    assert run_line(10, 0, 64)[1] == 11
    assert len(run_line(10, 0, 64)[0]) == 10
    points, passes = run_line(0, 0, 4)
    assert (len(points), passes) == (0, 0)


def test_a_diagonal_gives_a_pulse_to_both_axes_at_once() -> None:
    points, passes = run_line(100, 100, 1000)
    assert np.array_equal(points[:, 0], points[:, 1])
    assert len(points) == 100
    assert passes == pytest.approx(100 * math.sqrt(2.0), abs=2.0)
