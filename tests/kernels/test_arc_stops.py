"""Where arcs stop by each reading, against the literal controller."""

import math

import numpy as np
import pytest
from camtool_postprocessors.pic_mmh import steps as loops
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles import arc_ends as oracle
from tests.strategies import examples

pytestmark = pytest.mark.checked


def stop(
    start: tuple[int, int], end: tuple[int, int], clockwise: bool, rounded: bool, reading: str
) -> oracle.Stop:
    leg = np.zeros((1, loops.LEG_COLUMNS), dtype=np.int64)
    leg[0, loops.KIND], leg[0, loops.CW], leg[0, loops.STOP] = loops.ARC, clockwise, -1
    leg[0, [loops.A, loops.B, loops.END_X, loops.END_Y]] = (*start, *end)
    out = np.zeros((1, loops.STOP_COLUMNS), dtype=np.int64)
    loops.arc_stops(leg, (loops.DSM, rounded, loops.READINGS[reading]), out)
    samples, x, y, met = out[0].tolist()
    return oracle.Stop(samples, (x, y), bool(met))


def error_of(start: tuple[int, int], rounded: bool) -> int:
    square = start[0] ** 2 + start[1] ** 2
    return square - math.floor(math.sqrt(square) + 0.5) ** 2 if rounded else 0


@pytest.mark.parametrize("reading", oracle.READINGS)
@pytest.mark.parametrize("rounded", [False, True])
@examples(150)
@given(
    x=st.integers(-120, 120),
    y=st.integers(-120, 120),
    angle=st.floats(0.0, 2.0 * math.pi),
    off=st.sampled_from([0.0, 0.0, 0.7, -1.0, 1.5]),
    clockwise=st.booleans(),
)
def test_the_stops_are_those_of_the_literal_controller(
    reading: str, rounded: bool, x: int, y: int, angle: float, off: float, clockwise: bool
) -> None:
    if abs(x) + abs(y) < 4:
        x += 7
    radius = math.hypot(x, y) + off
    end = round(radius * math.cos(angle)), round(radius * math.sin(angle))
    wanted = oracle.stop((x, y), end, clockwise, error_of((x, y), rounded), reading)
    assert stop((x, y), end, clockwise, rounded, reading) == wanted


@pytest.mark.parametrize("clockwise", [False, True])
def test_a_full_circle_ends_at_its_start_by_every_reading(clockwise: bool) -> None:
    for start in ((30, 0), (0, -41), (17, 23), (-200, 5)):
        stops = {stop(start, start, clockwise, False, name) for name in oracle.READINGS}
        assert len(stops) == 1
        (only,) = stops
        assert only.met
        assert only.samples > 5 * math.hypot(*start)


def test_large_arcs_go_on_from_block_to_block() -> None:
    """More positions than are looked at in one go."""
    start, end = (9000, 1234), (-8999, -1240)
    for name in oracle.READINGS:
        wanted = oracle.stop(start, end, False, 0, name)
        assert stop(start, end, False, False, name) == wanted
