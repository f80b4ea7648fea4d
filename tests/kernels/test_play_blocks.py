"""Play over blocks against the step-by-step kernel, to the last bit."""

import itertools

import numpy as np
import pytest

from camtool.kernels.play import play_block, play_fill, way_of

pytestmark = pytest.mark.checked

STEP = 0.00014


def slow(steps: np.ndarray, axis: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, int]:
    """Slides and reversals; `states` (3, 6) goes on."""
    positions = np.repeat((steps * STEP)[:, None], 3, axis=1)
    out, turns = np.empty(positions.shape), np.zeros((1, 3), dtype=np.int64)
    play_fill(positions, np.array([0, len(steps)]), np.tile(axis, (3, 1)), states, out, turns)
    return out[:, 0], int(turns[0, 0])


def start(position: int, direction: int) -> np.ndarray:
    state = np.zeros(6)
    state[:4] = position * STEP, direction, 0.0, position * STEP * 1.01
    return state


def compare(blocks: list[np.ndarray], axis: np.ndarray, direction: int, begin: int) -> int:
    """All blocks in order both ways; returns how many ran one way."""
    fast, literal = start(begin, direction), np.tile(start(begin, direction), (3, 1))
    at, simple = begin, 0
    for steps in blocks:
        way = way_of(at, steps)
        simple += way != 2
        out = np.empty(len(steps))
        reversals = play_block(way, steps * STEP, axis, fast, out)
        wanted, turns = slow(steps, axis, literal)
        assert np.array_equal(out, wanted)
        assert reversals == turns
        assert np.array_equal(fast[:4], literal[0, :4])
        at = int(steps[-1])
    return simple


AXES = [
    (1.01, 0.0, 0.0, 0.0),
    (1.0, 0.0, 3.5 * STEP, 0.0),
    (0.99, -2.0 * STEP, 2.0 * STEP, 3 * STEP),
    (1.01, -4.2 * STEP, 0.0, 7 * STEP),
]


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("direction", [1, -1])
def test_every_short_walk_in_blocks(axis: tuple[float, ...], direction: int) -> None:
    """All walks of six samples that step by −1, 0 or 1, cut in the middle."""
    numbers = np.array([*axis, 0.5 * STEP])
    for walk in itertools.product((-1, 0, 1), repeat=6):
        steps = np.cumsum(walk)
        compare([steps[:3], steps[3:]], numbers, direction, 0)


@pytest.mark.parametrize("axis", AXES)
def test_long_walks_and_places_that_the_controller_only_believes_in(axis) -> None:
    rng = np.random.default_rng(3)
    numbers, simple = np.array([*axis, 0.5 * STEP]), 0
    for _ in range(40):
        turns = np.repeat(rng.choice([-1, 1], 30), rng.integers(1, 60, 30))
        steps = np.cumsum(turns * rng.integers(0, 2, len(turns)))
        simple += compare(np.array_split(steps, len(steps) // 20), numbers, 1, 0)
    assert simple > 200
    for jump in (-3, -1, 1, 3):
        fast, literal = start(0, 1), np.tile(start(0, 1), (3, 1))
        fast[0] = jump * STEP
        literal[:, 0] = jump * STEP
        steps = jump + np.array([0, -1, -2, -2, -3])
        for part in (steps[1:], steps):
            out = np.empty(len(part))
            one, other = fast.copy(), literal.copy()
            play_block(way_of(jump, part), part * STEP, numbers, one, out)
            assert np.array_equal(out, slow(part, numbers, other)[0])
            assert np.array_equal(one[:4], other[0, :4])
