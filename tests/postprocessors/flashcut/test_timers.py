"""The timers of the parallel-port machine against a clock that is looked at each millisecond."""

import itertools
import math
import random
from fractions import Fraction
from typing import Literal

import numpy as np
import pytest
from camtool_postprocessors.flashcut.dialect import FlashcutController
from camtool_postprocessors.flashcut.steps import XY, Counters, Issued, Moves, Rules, timers_fill
from camtool_postprocessors.flashcut.timers import steps_too_many

from tests.oracles.flashcut_run import Pc

pytestmark = pytest.mark.checked

STEP = 0.0019


class Ran:
    """Moves of these steps in X and Y, one after the other, `room` samples at a time: samples in
    steps, and the ledger of each move."""

    def __init__(
        self, ways: list[tuple[int, int]], p: int, late: bool, room: int = 1 << 16
    ) -> None:
        count = len(ways)
        target = np.zeros((count, 3))
        target[:, :2] = np.cumsum(np.array(ways, dtype=np.float64), axis=0) * STEP
        self.ms, self.steps = np.zeros(count, np.int64), np.zeros((count, 3), np.int64)
        what = np.full(count, XY, np.int64)
        moves = Moves(what, target, np.full(count, p, np.int64), np.arange(count))
        rules, counters = fresh(late)
        move, parts = 0, [np.empty((0, 3))]
        self.times = list[tuple[int, int]]()
        while move < count:
            issued = Issued(
                np.empty((room, 3)), *np.empty((3, room), np.int64), self.ms, self.steps
            )
            move, filled = timers_fill(moves, move, rules, counters, issued)
            parts.append(issued.commanded[:filled])
            pairs = zip(
                issued.move[:filled].tolist(), issued.since_ms[:filled].tolist(), strict=True
            )
            self.times += pairs
        self.commanded = np.concatenate(parts)

    @property
    def at(self) -> list[tuple[int, ...]]:
        steps = np.rint(self.commanded / STEP)
        assert (self.commanded == steps * STEP).all()
        return [tuple(row) for row in steps.astype(int).tolist()]


def fresh(late: bool) -> tuple[Rules, Counters]:
    rules = Rules(np.zeros(3), np.full(3, STEP), 0.5, False, late)
    return rules, Counters(np.zeros(3, np.int64), np.zeros(3), np.zeros(10, np.int64))


def literally(ways: list[tuple[int, int]], p: int, late: bool) -> Pc:
    pc = Pc((STEP, STEP, STEP), late=late)
    for nx, ny in ways:
        pc.timers(((0, nx), (1, ny)), p)
    return pc


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("p", range(1, 8))
def test_every_short_move(p: int, late: bool) -> None:
    ways = [(nx, ny) for nx in range(-9, 10) for ny in range(-9, 10)]
    ran, wanted = Ran(ways, p, late), literally(ways, p, late)
    assert ran.at == wanted.seen
    assert ran.ms.tolist() == [max(abs(nx), abs(ny)) * (p + 1) for nx, ny in ways]
    assert ran.ms.sum() == wanted.spent_ms


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("room", [1, 7, 4096])
def test_long_moves_however_many_samples_there_is_room_for(late: bool, room: int) -> None:
    rng = random.Random(20 + late)
    for p in (1, 3, 6, 20, 40):
        ways = [(rng.randint(-150, 150), rng.randint(-150, 150)) for _ in range(4)]
        ran, wanted = Ran(ways, p, late, room), literally(ways, p, late)
        assert ran.at == wanted.seen
        assert ran.ms.sum() == wanted.spent_ms


@pytest.mark.parametrize("late", [False, True])
def test_the_shorter_axis_by_its_formula(late: bool) -> None:
    rng = random.Random(4)
    over = exact = 0
    for _ in range(20):
        p = rng.randint(1, 100)
        ways = [
            (n, rng.randint(1, min(n, rng.choice([p, n]))))
            for n in rng.choices(range(1, 5000), k=20)
        ]
        for (n, m), made in zip(ways, Ran(ways, p, late).steps.tolist(), strict=True):
            wanted = m * (p + 1) // p if late else n * (p + 1) // (p * n // m + 1)
            assert made == [n, wanted, 0]
            assert m <= wanted <= m * (p + 1) / p
            over += wanted > m
            exact += m <= p
            # No more than P steps on the shorter axis are made without one too many (late: P − 1).
            assert wanted == m or m > p - late
        turned = Ran([(m, -n) for n, m in ways if n > m], p, late).steps
        straight = Ran([(n, m) for n, m in ways if n > m], p, late).steps
        assert turned[:, [1, 0, 2]].tolist() == straight.tolist()
    assert over > 50 < exact


@pytest.mark.slow
@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("p", [*range(1, 12), 20, 31])
def test_every_move_of_up_to_40_steps(p: int, late: bool) -> None:
    ways = list(itertools.product(range(-40, 41), range(41)))
    assert Ran(ways, p, late).at == literally(ways, p, late).seen


@pytest.mark.parametrize("clock", ["whole-ms", "late-longer"])
def test_steps_too_many_are_those_that_the_timers_make(
    clock: Literal["whole-ms", "late-longer"],
) -> None:
    ways = [(n, m) for n in range(60) for m in range(n + 1)]
    longer, shorter = np.array(ways).T
    controller = FlashcutController(clock=clock)
    for p in (1, 3, 20, 41):
        extra = steps_too_many(longer, shorter, np.full(len(ways), p), controller)
        made = Ran(ways, p, clock == "late-longer").steps
        assert (made[:, 1] - shorter).tolist() == extra.tolist()
        assert made[:, 0].tolist() == longer.tolist()


def test_a_diagonal_in_both_readings() -> None:
    assert Ran([(5263, 5263)], 20, False).steps[0].tolist() == [5263, 5263, 0]
    assert Ran([(5263, 5263)], 20, True).steps[0].tolist() == [5263, 5526, 0]  # X leads
    # At 3:2 the readings differ too: ⌊30·21/(30+1)⌋ steps of 20, against ⌊20·21/20⌋.
    assert Ran([(30, 20)], 20, False).steps[0].tolist() == [30, 20, 0]
    assert Ran([(30, 20)], 20, True).steps[0].tolist() == [30, 21, 0]


def test_the_longest_displacements_do_not_overflow() -> None:
    """2³¹ steps at 2³¹ ms: the order of the first samples, by whole numbers without limit."""
    most = (1 << 31) - 1
    for late, m in itertools.product((False, True), (1, most - 1)):
        every, short = most + 1, most * most // m + 1
        if late:
            every, short = (most + 1) * m, most * most
        zeros = np.zeros(1, np.int64)
        target = np.array([[most * STEP, m * STEP, 0.0]])
        moves = Moves(zeros + XY, target, zeros + most, zeros)
        rules = Rules(np.zeros(3), np.full(3, STEP), 0.5, False, late)
        counters = Counters(np.zeros(3, np.int64), np.zeros(3), np.zeros(10, np.int64))
        issued = Issued(
            np.empty((50, 3)),
            *np.empty((3, 50), np.int64),
            zeros.copy(),
            np.zeros((1, 3), np.int64),
        )
        assert timers_fill(moves, 0, rules, counters, issued) == (0, 50)
        times = sorted({k * every for k in range(1, 60)} | {k * short for k in range(1, 60)})[:50]
        wanted = [(time // every, time // short) for time in times]
        assert np.rint(issued.commanded[:, :2] / STEP).tolist() == [list(pair) for pair in wanted]
        assert issued.since_ms.tolist() == [time // (m if late else 1) for time in times]


@pytest.mark.parametrize("late", [False, True])
def test_samples_know_their_milliseconds(late: bool) -> None:
    """Multiples of the half period and a millisecond for the longer axis, of its own for the other
    one, up to the last step of the longer one, whatever room there is."""
    draw = random.Random(7)
    for _ in range(60):
        ways = [(draw.randint(-30, 30), draw.randint(-30, 30)) for _ in range(4)]
        p = draw.randint(1, 12)
        wanted = list[tuple[int, int]]()
        for move, (nx, ny) in enumerate(ways):
            n, m = max(abs(nx), abs(ny)), min(abs(nx), abs(ny))
            short = Fraction(0)
            if m:
                short = Fraction(p * n, m) if late else Fraction(p * n // m + 1)
            times = {Fraction(k * (p + 1)) for k in range(1, n + 1)}
            times |= {j * short for j in range(1, 400) if m and j * short <= n * (p + 1)}
            wanted += [(move, math.floor(time)) for time in sorted(times)]
        for room in (1, 7, 1 << 12):
            assert Ran(ways, p, late, room).times == wanted
