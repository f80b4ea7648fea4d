"""The compiled direct search against the literal loop, and against mathematics."""

import math
from itertools import islice

import numpy as np
import pytest
from camtool_postprocessors.pic_mmh.steps import (
    NOWHERE,
    direct_search_fill,
    direct_search_start,
    first_at,
    nearest_to,
    skip,
)
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles.controllers import direct_search

pytestmark = pytest.mark.checked


def twin(x: int, y: int, clockwise: bool, count: int, error: int = 0) -> np.ndarray:
    """The first positions of the literal loop."""
    points = list(islice(direct_search(x, y, clockwise, error), count))
    return np.array(points, dtype=np.int64).reshape(count, 2)


def compiled(x: int, y: int, clockwise: bool, count: int, error: int = 0) -> np.ndarray:
    """The first positions of the compiled search."""
    out = np.empty((count, 2), dtype=np.int64)
    direct_search_fill(direct_search_start(x, y, clockwise, error), NOWHERE, NOWHERE, out)
    return out


def hit(x: int, y: int, clockwise: bool, end: tuple[int, int], limit: int) -> int:
    """The first iteration at the end, or −1."""
    return int(first_at(direct_search_start(x, y, clockwise), *end, limit))


def radial_error(points: np.ndarray, radius: float) -> float:
    """Greatest distance of the points from the circle."""
    return float(np.abs(np.hypot(points[:, 0], points[:, 1]) - radius).max())


@pytest.mark.parametrize("clockwise", [True, False])
@pytest.mark.parametrize("start", [(0, 30), (30, 0), (0, -30), (-30, 0)])
def test_circle_of_30_takes_168_iterations(start: tuple[int, int], clockwise: bool) -> None:
    assert hit(*start, clockwise, start, 1000) == 168
    assert radial_error(compiled(*start, clockwise, 168), 30.0) < 0.5


@pytest.mark.parametrize("clockwise", [True, False])
def test_every_small_start_equals_the_literal_loop(clockwise: bool) -> None:
    for x in range(-40, 41):
        for y in range(-40, 41):
            if not 0 < math.hypot(x, y) <= 40:
                continue
            count = int(6 * math.hypot(x, y)) + 12
            rounded = x * x + y * y - round(math.hypot(x, y)) ** 2
            for error in {0, rounded}:
                got = compiled(x, y, clockwise, count, error)
                assert np.array_equal(got, twin(x, y, clockwise, count, error)), (x, y, error)


def test_large_seeded_starts_equal_the_literal_loop() -> None:
    rng = np.random.default_rng(20)
    for radius in (300, 3000, 21_428, 714_285):
        angle = rng.uniform(0.0, 2.0 * math.pi)
        x, y = round(radius * math.cos(angle)), round(radius * math.sin(angle))
        clockwise = bool(rng.integers(2))
        count = min(6 * radius, 40_000)
        got = compiled(x, y, clockwise, count)
        assert np.array_equal(got, twin(x, y, clockwise, count)), (x, y, clockwise)


def test_radial_error_is_below_half_a_step() -> None:
    """Against the circle through the start; the derivation is in the kernel's header."""
    rng = np.random.default_rng(21)
    for _ in range(300):
        x, y = (int(v) for v in rng.integers(-2000, 2001, 2))
        radius = math.hypot(x, y)
        if radius == 0.0:
            continue
        points = compiled(x, y, bool(rng.integers(2)), int(12 * radius) + 20)
        assert radial_error(points, radius) < 0.5, (x, y)


@given(
    st.tuples(st.integers(-900, 900), st.integers(-900, 900)).filter(any),
    st.booleans(),
    st.booleans(),
    st.lists(st.integers(0, 3000), max_size=5),
)
def test_skipped_iterations_are_as_if_they_were_run(
    start: tuple[int, int], clockwise: bool, rounded: bool, counts: list[int]
) -> None:
    x, y = start
    error = x * x + y * y - round(math.hypot(x, y)) ** 2 if rounded else 0
    state = direct_search_start(x, y, clockwise, error)
    for count in counts:
        skip(state, count)
    wanted = twin(x, y, clockwise, sum(counts) + 40, error)
    at = wanted[sum(counts) - 1].tolist() if sum(counts) else [x, y]
    assert state[:2].tolist() == at
    out = np.empty((40, 2), dtype=np.int64)
    direct_search_fill(state, NOWHERE, NOWHERE, out)
    assert np.array_equal(out, wanted[-40:])


@pytest.mark.parametrize("size", [1, 7, 64, 1000])
def test_filling_goes_on_where_it_stopped(size: int) -> None:
    whole = twin(17, -29, False, 140)
    end = (int(whole[-1, 0]), int(whole[-1, 1]))
    state, buffer = direct_search_start(17, -29, False), np.empty((size, 2), dtype=np.int64)
    parts, met = [], False
    while not met:
        count, met = direct_search_fill(state, *end, buffer)
        parts.append(buffer[:count].copy())
    assert np.array_equal(np.concatenate(parts), whole)


def filled(
    start: tuple[int, int],
    clockwise: bool,
    error: int,
    end: tuple[int, int],
    limits: tuple[int, int],
) -> tuple[np.ndarray, bool]:
    """Positions of the compiled fill up to the end, or so many; in buffers of some size."""
    most, size = limits
    state = direct_search_start(*start, clockwise, error)
    buffer, parts, met, filled_so_far = np.empty((2, size), dtype=np.int64).T, [], False, 0
    while not met and filled_so_far < most:
        count, met = direct_search_fill(state, *end, buffer)
        parts.append(buffer[:count].copy())
        filled_so_far += count
    return np.concatenate(parts), met


@pytest.mark.parametrize("clockwise", [True, False])
def test_runs_of_the_closed_form_equal_the_iterations(clockwise: bool) -> None:
    """Every small start."""
    for x in range(-20, 21):
        for y in range(-20, 21):
            size = math.hypot(x, y)
            if size == 0.0:
                continue
            for error in {0, x * x + y * y - round(size) ** 2}:
                count = int(6 * size) + 12
                got, _ = filled((x, y), clockwise, error, (NOWHERE, NOWHERE), (count, 512))
                wanted = twin(x, y, clockwise, len(got), error)
                assert np.array_equal(got, wanted), (x, y, error)


def test_runs_of_large_radii_equal_the_iterations() -> None:
    rng = np.random.default_rng(24)
    for radius in (70, 900, 33_333, 714_285, 16_777_215, 16_777_217, 40_000_000):
        for axis in (0, 1, 2, 3, None):
            angle = rng.uniform(0.0, 2.0 * math.pi) if axis is None else axis * math.pi / 2
            x, y = round(radius * math.cos(angle)), round(radius * math.sin(angle))
            nowhere = NOWHERE, NOWHERE
            got, _ = filled((x, y), bool(axis), 0, nowhere, (min(6 * radius, 200_000), 777))
            assert np.array_equal(got, twin(x, y, bool(axis), len(got)))


def test_runs_end_where_the_stop_test_ends_them() -> None:
    rng = np.random.default_rng(25)
    missed = 0
    for number in range(400):
        radius, angle = 10.0 ** rng.uniform(1.0, 3.5), rng.uniform(0.0, 6.28)
        x, y = round(radius * math.cos(angle)), round(radius * math.sin(angle))
        count, clockwise = int(6 * radius), bool(number % 2)
        path = compiled(x, y, clockwise, count)
        end = path[rng.integers(count)] + (rng.integers(-1, 2, 2) if number % 3 else 0)
        at = hit(x, y, clockwise, (int(end[0]), int(end[1])), count)
        size = int(rng.choice([1, 7, 64, 512]))
        got, met = filled((x, y), clockwise, 0, (int(end[0]), int(end[1])), (count, size))
        assert (met and len(got) == at) if at > 0 else (not met or len(got) > count)
        assert np.array_equal(got[:count], path[: len(got)])
        missed += at < 0
    assert 0 < missed < 400


def test_hits_and_nearest_agree_with_the_path() -> None:
    rng = np.random.default_rng(22)
    missed = 0
    for _ in range(300):
        x, y, ex, ey = (int(v) for v in rng.integers(-60, 61, 4))
        if (x, y) == (0, 0):
            continue
        path = twin(x, y, True, 500)
        met = np.flatnonzero((path == (ex, ey)).all(axis=1))
        assert hit(x, y, True, (ex, ey), 500) == (met[0] + 1 if len(met) else -1)
        missed += len(met) == 0
        with_start = np.vstack([[(x, y)], path])
        squares = ((with_start - (ex, ey)) ** 2).sum(axis=1)
        low, high = 30, 400
        best = int(np.argmin(squares[low : high + 1])) + low
        state = direct_search_start(x, y, True)
        assert nearest_to(state, ex, ey, low, high) == (best, squares[best])
    assert 0 < missed < 300
    assert nearest_to(direct_search_start(5, 0, True), 0, 5, 0, 0) == (0, 50)
    assert nearest_to(direct_search_start(5, 0, True), 0, 5, 3, 2) == (-1, -1)


def test_the_limit_of_hits_counts() -> None:
    assert hit(0, 30, True, (0, 30), 168) == 168
    assert hit(0, 30, True, (0, 30), 167) == -1


@pytest.mark.parametrize("clockwise", [True, False])
def test_the_ties_never_decide(clockwise: bool) -> None:
    """A start turned by 90° (X and Y change places) gives the turned path; so does a mirror."""
    for x in range(60):
        for y in range(1, 60):
            path = compiled(x, y, clockwise, 350)
            turned = compiled(-y, x, clockwise, 350)
            assert np.array_equal(turned, np.column_stack([-path[:, 1], path[:, 0]])), (x, y)
            mirrored = compiled(-x, y, not clockwise, 350)
            assert np.array_equal(mirrored, path * [-1, 1]), (x, y)


def test_whole_circles_close_from_every_start() -> None:
    """Seen, not proved: the path comes back to any start after one turn, on an axis or not."""
    rng = np.random.default_rng(23)
    starts = [(x, y) for x in range(-40, 41) for y in range(-40, 41) if (x, y) != (0, 0)]
    starts += [(int(x), int(y)) for x, y in rng.integers(-3000, 3001, (300, 2))]
    for x, y in starts:
        turn = 4 * math.sqrt(2.0) * math.hypot(x, y)
        assert hit(x, y, True, (x, y), int(turn) + 4) > turn - 4, (x, y)
