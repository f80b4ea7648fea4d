"""The slaves' kernel against the literal loop, against an integrator, and against closed forms."""

import math
import random

import numpy as np
import pytest
from camtool_postprocessors.matlab_router.steps import Account, Program, State, slaves_fill
from scipy.integrate import solve_ivp

from tests.oracles.matlab_slaves import Motor, Slave, TextSlave, run, table

pytestmark = pytest.mark.checked

X = (8.896, 12.2)


def filled(
    slaves: list[Slave],
    orders: list[list[tuple[int, int]]],
    pauses: list[float],
    lag: float = 0.08,
    chunk: int = 100_000,
    thin: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray, Account]:
    """Counts, rows and the account of the kernel for what the literal loop would run."""
    text = isinstance(slaves[0], TextSlave)
    axes = np.array(
        [
            [s.motor.gain, s.motor.tau, s.motor.friction, s.kid, s.kpd, s.chunk, s.phase, 500.0]
            for s in slaves
        ]
    )
    lines = np.array(
        [
            [d if text or d == 0 else ((d // 2 - 1) % 65536) + 1 for d, _ in order]
            + [v for _, v in order]
            + [row, row, 10_000, 0, 0]
            for row, order in enumerate(orders)
        ],
        dtype=np.int32,
    )
    whole = np.zeros(len(orders), np.bool_) if thin is None else thin
    program = Program(
        lines, np.array(pauses), axes, np.array(table(slaves[0].top)), lag, text, whole
    )
    motors, inside = np.zeros((3, 6)), np.zeros((3, 11), dtype=np.int64)
    for index, slave in enumerate(slaves):
        motors[index, 0] = inside[index, 0] = slave.count
        inside[index, 5] = slave.count if text else slave.conv
    state = State(motors, inside, np.zeros(3, dtype=np.int64), np.zeros(2))
    count = len(orders)
    account = Account(
        np.zeros(count),
        np.zeros((count, 3), np.int64),
        np.ones(count, np.bool_),
        np.zeros(count, np.int64),
    )
    found, rows, over = [], [], False
    while not over:
        out, row = np.empty((chunk, 3), np.int64), np.empty(chunk, np.int64)
        number, over = slaves_fill(program, state, account, out, row)
        found.append(out[:number])
        rows.append(row[:number])
    return np.concatenate(found), np.concatenate(rows), account


def same(slaves: list[Slave], orders: list[list[tuple[int, int]]], pauses: list[float]) -> None:
    """The kernel's counts are those of the literal loop, each of them; its times too, but for the
    rounding of a motor that is followed in thousands of pieces."""
    start = [slave.count for slave in slaves]
    found, rows, account = filled(slaves, orders, pauses)
    counts, begins = run(slaves, orders, pauses, 0.08)
    assert found.tolist() == counts
    steps = np.zeros_like(account.steps)
    np.add.at(steps, rows, np.abs(np.diff(found, axis=0, prepend=[start])))
    assert account.steps.tolist() == steps.tolist()
    assert account.ticks == pytest.approx(np.diff(begins), abs=1e-7)
    assert account.has_ended.all()


def three(**changes: float) -> list[Slave]:
    """Slaves X, Y, Z with the motors of table 4.1."""
    plants = [(8.896, 12.2), (5.599, 12.32), (9.767, 12.4)]
    chunks = [5120, 5120, 5954]
    return [
        Slave(Motor(*plant, **changes), chunk=chunk)
        for plant, chunk in zip(plants, chunks, strict=True)
    ]


def test_the_smallest_lines_in_all_directions() -> None:
    """Lines of one and two chunks, there and back, show the faults of the counter at reversals."""
    for a in (2, 4):
        for v in (480, 150) if a == 2 else (480,):
            orders = [
                [(a, v), (a, -v), (0, 0)],
                [(a, -v), (2, v), (0, 0)],
                [(2, v), (0, 0), (2, v)],
            ]
            same(three(), orders, [1.24, 1.24, 30.0])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4, 60))
def test_random_lines_slow(seed: int) -> None:
    test_random_lines(seed)


@pytest.mark.parametrize("seed", range(2))
def test_random_lines(seed: int) -> None:
    luck = random.Random(seed)
    slaves = three(friction=luck.choice([0.0, 0.0, 2.5, 20.0]))
    for slave in slaves:
        slave.phase = luck.randrange(1024)
        slave.posAnt = slave.conv
        # Chunks that end where the counter wraps, and where an axis is that still runs back.
        slave.chunk = luck.choice([slave.chunk, 5114, 5115, 5116, 6138, 3800])
        slave.kid, slave.kpd = luck.choice([(28, 159), (17, 98), (60, 40)])
    orders = []
    for _ in range(5):
        line = []
        for axis in range(3):
            distance = luck.choice([0, 2, 2, 4, 5, 7]) if axis < 2 else luck.choice([0, 0, 2])
            speed = luck.choice([-1, 1]) * luck.randint(60, 480)
            line.append((distance, speed))
        orders.append(line)
    same(slaves, orders, [luck.choice([1.0, 1.24, 3.7, 30.0]) for _ in orders])


def path_between_turns(counts: np.ndarray) -> list[list[int]]:
    """The first of the counts, those at which an axis turns, and the last."""
    kept, ways = [counts[0]], np.zeros(3, dtype=np.int64)
    for count, before in zip(counts[1:], counts[:-1], strict=True):
        move = np.sign(count - before)
        if (move * ways < 0).any():
            kept.append(before)
            ways = move
        ways = np.where(ways == 0, move, ways)
    return [*(each.tolist() for each in kept), counts[-1].tolist()]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("chunk", [100_000, 37])
def test_rows_that_nobody_samples(seed: int, chunk: int) -> None:
    """Lines without their samples take the same ticks and steps, end at the same places and
    turn at the same counts, also long ones of one axis, whose ticks are run together."""
    luck = random.Random(seed)
    orders = []
    for _ in range(6):
        distances = [luck.choice([0, 0, 6, 40, 300]) for _ in range(3)]
        distances[luck.randrange(3)] = luck.choice([4, 60, 500])
        speeds = [luck.choice([-1, 1]) * luck.randint(60, 480) for _ in range(3)]
        orders.append(list(zip(distances, speeds, strict=True)))
    pauses = [luck.choice([1.0, 1.24, 30.0]) for _ in orders]
    friction = luck.choice([0.0, 2.5])
    counts, rows, every = filled(three(friction=friction), orders, pauses)
    thin = np.array([luck.random() < 0.7 for _ in orders])
    some, some_rows, account = filled(three(friction=friction), orders, pauses, 0.08, chunk, thin)
    assert np.array_equal(account.steps, every.steps)
    assert np.array_equal(account.ticks, every.ticks)
    assert np.array_equal(account.has_ended, every.has_ended)
    assert np.array_equal(account.samples, every.samples)
    assert account.samples.tolist() == np.bincount(rows, minlength=len(orders)).tolist()
    for row, is_thin in enumerate(thin.tolist()):
        own, kept = counts[rows == row], some[some_rows == row]
        assert kept[-1].tolist() == own[-1].tolist()
        if is_thin:
            assert len(kept) <= len(own) / 5 + 10
            before = counts[rows < row][-1:] if row else np.zeros((1, 3), dtype=np.int64)
            whole = path_between_turns(np.concatenate([before, own]))
            assert path_between_turns(np.concatenate([before, kept])) == whole
        else:
            assert kept.tolist() == own.tolist()


@pytest.mark.parametrize("seed", range(3))
def test_random_lines_of_the_text(seed: int) -> None:
    """The reference's roots and the loop's sums are floats, taken in two orders: a count may fall
    to one side or the other of a tick."""
    luck = random.Random(seed)
    slaves: list[Slave] = [
        TextSlave(slave.motor, kid=luck.choice([17, 28]), kpd=luck.choice([98, 159]))
        for slave in three(friction=luck.choice([0.0, 5.0]))
    ]
    orders = [
        [
            (luck.choice([0, 1500, 8000]), luck.choice([-1, 1]) * luck.randint(60, 480))
            for _ in "XYZ"
        ]
        for _ in range(5)
    ]
    pauses = [luck.choice([1.0, 1.24, -1.24, 30.0]) for _ in orders]
    found, _, account = filled(slaves, orders, pauses)
    counts, begins = run(slaves, orders, pauses, 0.08)
    assert np.abs(found - np.array(counts)).max() <= 1
    assert account.ticks == pytest.approx(np.diff(begins), abs=1e-6)


def test_chunks_of_the_run_change_nothing() -> None:
    orders = [[(6, 480), (4, -320), (0, 0)], [(2, -480), (4, 480), (2, 500)]]
    whole, rows, account = filled(three(), orders, [1.24, 20.0])
    parts, part_rows, part_account = filled(three(), orders, [1.24, 20.0], chunk=7)
    assert whole.tolist() == parts.tolist()
    assert rows.tolist() == part_rows.tolist()
    assert account.ticks.tolist() == part_account.ticks.tolist()


def open_loop(count: int, gain: float = 680 / 70, tau: float = 0.067 / 0.005) -> np.ndarray:
    """Counts at ticks 0 … of a motor that gets 100 % from the first tick on."""
    slave = Slave(Motor(gain, tau), kid=1000, kpd=0)
    still = Slave(Motor(gain, tau))
    found, _, _ = filled([slave, still, still], [[(400, 1023), (0, 0), (0, 0)]], [1.0])
    return np.asarray(found[:count, 0])


def test_the_step_response_is_the_integrated_one() -> None:
    """G(s) = 9.715 / (0.067 s + 1) (eq. 4.33, L2704-2757) by a Runge-Kutta of order 8. The drive
    comes with the interrupt behind the master's word: one tick later."""
    gain, tau = 680 / 70, 0.067 / 0.005
    found = open_loop(200)
    solved = solve_ivp(
        lambda _, y: [y[1], (100.0 * gain - y[1]) / tau],
        (0.0, 199.0),
        [0.0, 0.0],
        method="DOP853",
        t_eval=np.arange(200.0),
        rtol=1e-12,
        atol=1e-9,
    )
    assert np.abs(found - np.floor(solved.y[0] + 1e-6)).max() <= 0
    # 680 counts in 5 ms at 70 % (L2704), here at 100 %.
    assert np.diff(found)[-10:].mean() == pytest.approx(100.0 * 680 / 70, abs=0.2)


def test_the_motor_is_the_thesis_s_pulse_transfer_function() -> None:
    """145 / (s + 14.88), eq. 4.33, becomes 0.6986 / (z − 0.9283), eq. 4.34, L2757: the
    zero-order hold, not Tustin as is said."""
    found = open_loop(150, 145.0 / 14.88, 200.0 / 14.88)
    speeds = np.diff(found.astype(np.float64))
    # Counts are whole: fit ω⁺ = q ω + b · 100 over the whole response.
    rows = np.column_stack([speeds[1:-1], np.full(len(speeds) - 2, 100.0)])
    (q, b), *_ = np.linalg.lstsq(rows, speeds[2:], rcond=None)
    assert q == pytest.approx(0.9283, abs=1e-4)
    assert b == pytest.approx(0.6986, abs=1e-3)


def test_coasting_ends_where_the_time_constant_says() -> None:
    """After the last count nothing drives: the way left is ω τ."""
    found, _, _ = filled(three(), [[(40, 480), (0, 0), (0, 0)]], [200.0])
    speed = np.diff(found[:, 0])
    last = int(np.flatnonzero(speed > 0.5 * speed.max())[-1])
    coast = np.diff(found[last:, 0].astype(np.float64))
    q = math.exp(-1.0 / 12.2)
    assert coast[1:8] / coast[:7] == pytest.approx(np.full(7, q), abs=0.01)
    assert found[-1, 0] - found[last + 1, 0] == pytest.approx(coast[0] * q / (1.0 - q), abs=15)


def test_a_loop_that_never_gets_there_is_given_up() -> None:
    slaves = three()
    slaves[0].motor.friction = 100.0
    axes = np.array([[8.9, 12.2, 100.0, 28, 159, 5120, 0, 500.0]] * 3)
    lines = np.array([[1, 0, 0, 480, 0, 0, 0, 0, 50, 0, 0]], dtype=np.int32)
    program = Program(
        lines, np.array([2.0]), axes, np.array(table(480)), 0.0, False, np.zeros(1, np.bool_)
    )
    state = State(
        np.zeros((3, 6)), np.zeros((3, 11), np.int64), np.zeros(3, np.int64), np.zeros(2)
    )
    account = Account(
        np.zeros(1), np.zeros((1, 3), np.int64), np.ones(1, np.bool_), np.zeros(1, np.int64)
    )
    out, row = np.empty((1000, 3), np.int64), np.empty(1000, np.int64)
    number, over = slaves_fill(program, state, account, out, row)
    assert (number, over, bool(account.has_ended[0])) == (53, True, False)
    assert out[:number].tolist() == [[0, 0, 0]] * number
