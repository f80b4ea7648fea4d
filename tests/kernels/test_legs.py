"""Straight legs by a counter: Tabla 8 of ValCNC, and every pass of a literal counter."""

import itertools

import numpy as np
import pytest

from camtool.kernels.motion import legs_fill
from tests.oracles.valcnc_run import Place, counter, table_8

pytestmark = pytest.mark.checked

UNIT = np.ones(3)


def filled(begin: Place, ways: list[Place], size: int) -> np.ndarray:
    """The places after all passes of legs, asked for in windows of `size`."""
    way = np.array(ways, dtype=np.int64)
    first = np.concatenate([[0], np.cumsum(np.abs(way).max(axis=1))])
    starts = np.array(begin) + np.cumsum(way, axis=0) - way
    out = np.empty((int(first[-1]), 3))
    for low in range(0, len(out), size):
        leg = int(np.searchsorted(first, low, side="right")) - 1
        done = low - int(first[leg])
        legs_fill(done, starts[leg:], way[leg:], UNIT, out[low : low + size])
    return out.astype(np.int64)


def literal(begin: Place, ways: list[Place]) -> list[Place]:
    places = []
    for way in ways:
        places += [place for place, _ in counter(begin, way)]
        begin = places[-1]
    return places


def test_table_8() -> None:
    """7 steps in X, 3 in Y (L1239-1250)."""
    printed = table_8()
    assert [(x, y, cuenta[1]) for (x, y, _), cuenta in counter((0, 0, 0), (7, 3, 0))] == printed
    assert filled((0, 0, 0), [(7, 3, 0)], 100)[:, :2].tolist() == [[x, y] for x, y, _ in printed]


def test_every_small_leg() -> None:
    ways = [way for way in itertools.product(range(-7, 8), repeat=3) if any(way)]
    wanted = np.array(literal((5, -3, 2), ways))
    for size in (1_000_000, 1, 7):
        assert np.array_equal(filled((5, -3, 2), ways, size), wanted)


@pytest.mark.parametrize("most", [90, 5000])
def test_random_legs(most: int) -> None:
    rng = np.random.default_rng(most)
    ways = [tuple(way) for way in rng.integers(-most, most + 1, (40, 3)).tolist() if any(way)]
    assert np.array_equal(filled((0, 0, 0), ways, 4096), np.array(literal((0, 0, 0), ways)))


def test_long_legs_by_division() -> None:
    """⌊k·d/M⌋ in Python's integers, near the longest legs that are allowed."""
    way = (-(1 << 31) + 1, 1_234_567_891, 3)
    most = -way[0]
    begin = np.zeros((1, 3), dtype=np.int64)
    for low in (0, most // 3, most - 500):
        out = np.empty((500, 3))
        legs_fill(low, begin, np.array([way]), UNIT, out)
        passes = range(low + 1, low + 501)
        wanted = [[-k, k * way[1] // most, k * way[2] // most] for k in passes]
        assert out.astype(np.int64).tolist() == wanted


def test_lengths_are_steps_by_the_step() -> None:
    out = np.empty((3, 3))
    step_mm = np.array([0.1, 0.0125, 0.04])
    legs_fill(0, np.array([[7, 0, -2]]), np.array([[3, -3, 1]]), step_mm, out)
    assert out.tolist() == [
        [8 * 0.1, -1 * 0.0125, -2 * 0.04],
        [9 * 0.1, -2 * 0.0125, -2 * 0.04],
        [10 * 0.1, -3 * 0.0125, -1 * 0.04],
    ]


def test_the_counter_lags_its_line_by_less_than_a_step_and_never_leads() -> None:
    """0.788 steps for 7/3, below 1 for all slopes; there and back are two paths."""
    worst = 0.0
    for most in range(1, 60):
        for least in range(most + 1):
            places = filled((0, 0, 0), [(most, least, 0)], 1000)
            lag = (places[:, 0] * least - places[:, 1] * most) / np.hypot(most, least)
            assert lag.min() >= 0.0
            worst = max(worst, lag.max())
            if (most, least) == (7, 3):
                assert lag.max() == pytest.approx(0.788, abs=5e-4)
    assert 0.97 < worst < 1.0
    there = filled((0, 0, 0), [(7, 3, 0)], 100).tolist()
    back = filled((7, 3, 0), [(-7, -3, 0)], 100).tolist()
    assert there[-2::-1] != back[:-1]
