"""The parts of the model of grbl against literal loops."""

import itertools

import numpy as np
import pytest
from camtool_postprocessors.grbl.controller import as_read, targets_of
from camtool_postprocessors.grbl.dialect import GrblController
from camtool_postprocessors.grbl.steps import step_lines_fill, steps_taken
from hypothesis import given
from hypothesis import strategies as st

from camtool.kernels.motion import entry_speeds
from camtool.simulation.speed_plan import SpeedPlan
from camtool.toolpath.builder import ToolpathBuilder
from tests.oracles.gcode_machines import grbl_machine
from tests.oracles.grbl_run import (
    chord_ends,
    number_as_read,
    ring_entries,
    seconds_by_steps,
    ticks,
)

pytestmark = pytest.mark.checked

RNG = np.random.default_rng(6)
STEP_MM = np.array([0.004, 0.005, 0.01])


@pytest.mark.parametrize("decimals", [3, 4, 5, 6])
def test_numbers_are_read_digit_by_digit(decimals: int) -> None:
    machine = grbl_machine(f"dialect.decimals={decimals}")
    near = np.arange(-3000, 3000) / 10.0**decimals
    far = np.round(RNG.uniform(-999.0, 999.0, 3000), decimals)
    values = np.concatenate([near, far])
    wanted = [number_as_read(f"{value:.{decimals}f}") for value in values]
    assert (as_read(values, machine) == np.array(wanted, dtype=np.float32)).all()


def test_reading_by_digits_is_not_rounding() -> None:
    """Were it, the emulation would decide nothing."""
    values = np.arange(20_000) / 1000.0
    assert (as_read(values, grbl_machine()) != values.astype(np.float32)).sum() > 1000


def test_numbers_with_other_decimals_are_the_nearest_floats() -> None:
    values = np.array([25.4 / 3.0, -0.12345])
    assert (as_read(values, grbl_machine()) == values.astype(np.float32)).all()


@pytest.mark.parametrize("ccw", [True, False])
@pytest.mark.parametrize("rise", [0.0, -0.7])
@pytest.mark.parametrize("firmware", ["grbl", "grblHAL", "FluidNC"])
def test_chords_are_those_of_the_loop(ccw: bool, rise: float, firmware: str) -> None:
    machine = grbl_machine(f"controller.firmware={firmware}")
    real = np.float64 if firmware == "grblHAL" else np.float32
    controller = machine.controller
    assert isinstance(controller, GrblController)
    for radius in (0.0005, 0.0015, 0.01, 0.3, 1.0, 7.7, 60.0):
        for share in (0.0, 0.01, 0.3, 0.9):
            x, y, z = np.round(RNG.uniform(-20.0, 20.0, 3), 3).tolist()
            cx, cy = round(x + radius, 4), y
            angle = np.pi + 2.0 * np.pi * share * (1 if ccw else -1)
            ex = x if share == 0.0 else round(cx + radius * np.cos(angle), 3)
            ey = y if share == 0.0 else round(cy + radius * np.sin(angle), 3)
            builder = ToolpathBuilder((x, y, z))
            path = builder.arc(ex, ey, z + rise, centre=(cx, cy), ccw=ccw, feed=100.0).finish()
            targets = targets_of(path, np.arange(len(path)), machine, controller)
            begin, end = as_read(path.start, machine), as_read(path.end[0], machine)
            offset = as_read(path.centre[0] - path.start[:2], machine)
            wanted = chord_ends(tuple(begin), tuple(end), tuple(offset), not ccw, 0.002, real=real)
            assert targets.mm.tolist() == [[float(v) for v in point] for point in wanted]


@pytest.mark.parametrize(("firmware", "chords"), [("grbl", 1), ("FluidNC", 1), ("grblHAL", 45)])
def test_a_small_circle_far_from_zero_is_lost_in_32_bits(firmware: str, chords: int) -> None:
    """At 50 mm the last place of a float is 4 nm, which at a radius of 0.8 mm is more than the
    5e-7 rad below which an arc is a full circle."""
    machine = grbl_machine(f"controller.firmware={firmware}")
    assert isinstance(machine.controller, GrblController)
    builder = ToolpathBuilder((50.0, 16.667, 0.0))
    path = builder.arc(50.0, 16.667, centre=(49.893, 15.842), ccw=True, feed=100.0).finish()
    targets = targets_of(path, np.arange(len(path)), machine, machine.controller)
    assert len(targets.mm) == chords


def test_bresenham_exhaustive() -> None:
    """All blocks of up to five steps an axis, from each of their events on, in one go."""
    ranges = (range(-5, 6), range(6), range(-2, 3))
    ways = [way for way in itertools.product(*ranges) if any(way)]
    seen = [ticks(way) for way in ways]
    way = np.array(ways, dtype=np.int64)
    start = np.cumsum(way, axis=0) - way
    flat = np.array([p for block in seen for p in block]) + np.repeat(
        start, [len(block) for block in seen], axis=0
    )
    for first, block in enumerate(seen[:200]):
        for event in range(len(block)):
            low = sum(map(len, seen[:first])) + event
            out = np.empty((min(40, len(flat) - low), 3))
            step_lines_fill((start, way), (first, event), STEP_MM, out)
            assert (out == flat[low : low + len(out)] * STEP_MM).all()


@given(
    st.tuples(*[st.integers(-60, 60)] * 3).filter(any),
    st.lists(st.integers(0, 3), min_size=60, max_size=60),
)
def test_smoothing_moves_no_event(way: tuple[int, int, int], levels: list[int]) -> None:
    smooth, plain = ticks(way, levels), ticks(way)
    assert smooth == plain
    events = np.arange(1, len(plain) + 1)
    assert (steps_taken(np.array([way] * len(plain)), events) == np.array(plain)).all()


def test_long_blocks_go_on_where_they_were_left() -> None:
    way = np.array([[70_001, -69_999, 3]], dtype=np.int64)
    start = np.zeros((1, 3), dtype=np.int64)
    whole, part = np.empty((70_001, 3)), np.empty((999, 3))
    step_lines_fill((start, way), (0, 0), STEP_MM, whole)
    for event in (0, 1, 12_345, 69_002):
        step_lines_fill((start, way), (0, event), STEP_MM, part)
        assert (part == whole[event : event + 999]).all()
    assert (whole[-1] == way[0] * STEP_MM).all()


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(3, 20))
def test_entry_speeds_are_those_of_the_ring(seed: int, count: int, places: int) -> None:
    rng = np.random.default_rng(seed)
    gain = rng.exponential(1.0, count)
    limit = rng.choice([0.0, 0.5, 2.0, np.inf], count) * rng.uniform(0.5, 2.0, count)
    limit[0] = 0.0
    entry = np.empty(count)
    entry_speeds(gain, limit, places - 1, 0.0, entry)
    assert entry.tolist() == ring_entries(gain.tolist(), limit.tolist(), places)


@given(st.integers(0, 2**32 - 1))
def test_seconds_are_the_integral(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = 12
    plan = SpeedPlan(
        rng.exponential(1.0, count),
        rng.uniform(0.5, 3.0, count),
        rng.uniform(1.0, 10.0, count),
        rng.uniform(0.0, 3.0, count) * (np.arange(count) > 0),
    )
    squares = plan.squares(5)
    entry = np.sqrt(squares)
    for k, seconds in enumerate(plan.seconds(squares)):
        ends = (float(entry[k]), float(entry[k + 1]))
        columns = (plan.length_mm, plan.speed_mm_s, plan.acceleration_mm_s2)
        d, v, a = (float(column[k]) for column in columns)
        assert seconds == pytest.approx(seconds_by_steps(d, v, a, ends, 4000), rel=2e-3)
        assert max(ends) <= v * (1.0 + 1e-12)
        assert abs(ends[1] ** 2 - ends[0] ** 2) <= 2.0 * a * d * (1.0 + 1e-9)
