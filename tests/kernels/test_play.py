"""The play operator and the compensation against a literal loop and against mathematics."""

from itertools import islice, pairwise, product

import numpy as np
import pytest

from camtool.kernels.play import play_fill, play_limits, play_start
from tests.oracles import controllers as twins
from tests.oracles.controllers import direct_search
from tests.oracles.mechanics import PulsedAxis

pytestmark = pytest.mark.checked

STEP = 0.00014


def run(
    steps: np.ndarray, limits: tuple[float, float], compensation: int = 0, direction: int = 1
) -> tuple[np.ndarray, int]:
    """Slide (n,) mm and reversals of X, for commanded steps that begin at steps[0]."""
    walk = Walk(steps, limits, compensation, direction)
    slide = walk.go(steps)
    return slide, walk.reversals


class Walk:
    """X moves in steps, the other axes stand."""

    def __init__(
        self, steps: np.ndarray, limits: tuple[float, float], compensation: int, direction: int
    ) -> None:
        self.axes = np.array([[STEP, *limits, compensation, 0.5]] * 3)
        self.states = np.array([play_start(at, STEP, direction) for at in (steps[0], 0, 0)])
        self.reversals = 0

    def go(self, steps: np.ndarray) -> np.ndarray:
        """The slide (n,) for the next steps (n,)."""
        positions = np.column_stack([steps, np.zeros((len(steps), 2))]).astype(float)
        slide, turns = np.empty(positions.shape), np.zeros((1, 3), dtype=np.int64)
        play_fill(positions, np.array([0, len(steps)]), self.axes, self.states, slide, turns)
        self.reversals += int(turns[0, 0])
        return slide[:, 0]


def there_and_back(*turns: int) -> np.ndarray:
    """Every step of a walk over these turning points."""
    parts = [np.array([turns[0]])]
    for low, high in pairwise(turns):
        sense = 1 if high > low else -1
        parts.append(np.arange(low + sense, high + sense, sense))
    return np.concatenate(parts)


def test_preloaded_line_there_and_back() -> None:
    """Forward the slide follows at once; back it waits for the play, and lags by it ever after."""
    steps = there_and_back(0, 1000, 0, 1000)
    play = 300 * STEP
    slide, reversals = run(steps, play_limits(play, "preloaded", 1))
    motor = steps * STEP
    back = np.minimum(1000 * STEP, motor[1000:2001] + play)
    assert slide[:1001] == pytest.approx(motor[:1001], abs=1e-15)
    assert slide[1000:2001] == pytest.approx(back, abs=1e-15)
    assert slide[2000:] == pytest.approx(np.maximum(play, motor[2000:]), abs=1e-15)
    assert reversals == 2


def test_conventions_differ_by_half_the_play() -> None:
    steps = there_and_back(0, 1000, -1000, 500)
    play = 300 * STEP
    plus, _ = run(steps, play_limits(play, "preloaded", 1))
    middle, _ = run(steps, play_limits(play, "centred", 1))
    minus, _ = run(steps, play_limits(play, "preloaded", -1), direction=-1)
    engaged = 301
    assert plus[engaged:] - middle[engaged:] == pytest.approx(play / 2.0)
    assert middle[engaged:] - minus[engaged:] == pytest.approx(play / 2.0)
    assert middle[100] == 0.0
    assert minus[299] == 0.0


def test_exact_compensation_undoes_the_play() -> None:
    steps = there_and_back(0, 1000, -400, 20, -7)
    slide, reversals = run(steps, play_limits(300 * STEP, "preloaded", 1), compensation=300)
    assert slide == pytest.approx(steps * STEP, abs=1e-15)
    assert reversals == 3


def test_too_much_compensation_oversizes_by_the_excess() -> None:
    """Back again the slide is 80 steps too far: motor −380, flank at +300."""
    steps = there_and_back(0, 1000, 0)
    slide, _ = run(steps, play_limits(300 * STEP, "preloaded", 1), compensation=380)
    assert slide[1001] == pytest.approx((999 - 80) * STEP)
    assert slide[-1] == pytest.approx(-80 * STEP)


def test_a_first_motion_against_the_start_counts() -> None:
    _, reversals = run(there_and_back(0, -10), (0.0, 0.0), compensation=5)
    assert reversals == 1
    _, reversals = run(there_and_back(0, -10), (0.0, 0.0), compensation=5, direction=-1)
    assert reversals == 0


@pytest.mark.parametrize(
    ("back", "reversals"), [(0.5, 1), (0.5000001, 0), (0.75, 0), (0.4999999, 1)]
)
def test_half_a_step_back_is_a_reversal_and_less_is_none(back: float, reversals: int) -> None:
    """From the furthest place, whatever jitter was on the way; compensation moves the motor."""
    steps = np.array([0.0, 1.0, 0.75, 1.0, 0.875, back])
    slide, count = run(steps, (0.0, 0.0), compensation=3)
    assert count == reversals
    assert slide[-1] == pytest.approx((back - 3 * reversals) * STEP)


def test_circle_with_play_is_four_shifted_quarters() -> None:
    """X of a CW circle from the top: up to +R, down to −R, up to 0, with play and nothing else."""
    radius, play = 2000, 250 * STEP
    path = np.vstack([[(0, radius)], list(islice(direct_search(0, radius, True), 11312))])
    x = path[:, 0].copy()
    slide, reversals = run(x, play_limits(play, "preloaded", 1))
    first, second = int(np.argmax(x)), int(np.argmin(x))
    motor, big = x * STEP, radius * STEP
    want = np.concatenate(
        [
            motor[:first],
            np.minimum(big, motor[first:second] + play),
            np.maximum(-big + play, motor[second:]),
        ]
    )
    assert slide == pytest.approx(want, abs=1e-15)
    assert reversals == 2


@pytest.mark.parametrize(("low", "high"), [(0, 0), (0, 1), (0, 3), (-2, 0), (-1, 1), (-2, 2)])
@pytest.mark.parametrize("compensation", [0, 1, 2, 4])
@pytest.mark.parametrize("direction", [1, -1])
def test_all_short_walks_equal_the_nut_in_whole_numbers(
    low: int, high: int, compensation: int, direction: int
) -> None:
    """All walks of seven steps forward, back or none, three of them at once, one for each axis."""
    walks = np.array(list(product((1, 0, -1), repeat=7)))
    positions = np.cumsum(walks, axis=1).reshape(-1, 3, 7).transpose(0, 2, 1).astype(float)
    axes = np.array([[1.0, low, high, compensation, 0.5]] * 3)
    offsets, found = np.array([0, 7]), np.empty(positions.shape)
    turns = np.zeros((len(positions), 3), dtype=np.int64)
    for at, out, count in zip(positions, found, turns[:, None, :], strict=True):
        states = np.array([play_start(0.0, 1.0, direction)] * 3)
        play_fill(np.ascontiguousarray(at), offsets, axes, states, out, count)
    slides = found.transpose(0, 2, 1).reshape(-1, 7)
    for walk, slide, count in zip(walks.tolist(), slides.tolist(), turns.ravel(), strict=True):
        nut = PulsedAxis(low, high, compensation, direction)
        assert slide == [nut.go(sense) for sense in walk]
        assert count == nut.reversals


@pytest.mark.parametrize("convention", ["preloaded", "centred"])
@pytest.mark.parametrize("direction", [1, -1])
def test_random_walks_equal_the_literal_loop(convention: str, direction: int) -> None:
    rng = np.random.default_rng(40)
    for _ in range(40):
        steps = np.cumsum(rng.integers(-3, 4, 400))
        limits = play_limits(float(rng.uniform(0, 40)) * STEP, convention, direction)
        compensation = int(rng.integers(0, 50))
        slide, reversals = run(steps, limits, compensation, direction)
        want, turns = twins.play([int(s) for s in steps], STEP, *limits, compensation, direction)
        assert np.array_equal(slide, want)
        assert reversals == turns


@pytest.mark.parametrize("size", [1, 13, 400])
def test_chunks_do_not_matter(size: int) -> None:
    steps = np.cumsum(np.random.default_rng(41).integers(-1, 2, 2000))
    whole = Walk(steps, (0.0, 0.002), 9, 1)
    parts = Walk(steps, (0.0, 0.002), 9, 1)
    want = whole.go(steps)
    found = [parts.go(steps[at : at + size]) for at in range(0, len(steps), size)]
    assert np.array_equal(np.concatenate(found), want)
    assert np.array_equal(parts.states, whole.states)
    assert parts.reversals == whole.reversals
