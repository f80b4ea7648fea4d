"""How long the controller takes, against figures worked out by hand from the thesis."""

import numpy as np
import pytest
from camtool_postprocessors._i8751_options import Dialect, dialect_of
from camtool_postprocessors._i8751_times import StepTimes

from tests.postprocessors.i8751_machines import loaded


def dialect(*settings: str) -> Dialect:
    return dialect_of(loaded(*settings).machine)


@pytest.mark.parametrize(
    ("steps", "coded", "declared"),
    [
        (0, 0.0, 0.0),
        (1, 0.125, 0.125),
        (89, 11.125, 11.125),
        (90, 6.17, 6.38),
        (100, 6.27, 6.52),
        (200, 7.22, 7.95),
        (255, 7.75, 8.74),
        (1000, 14.9, 19.4),
        (65535, 633.0, 941.0),
    ],
)
def test_one_motor(steps: int, coded: float, declared: float) -> None:
    count = np.array([steps])
    assert StepTimes(dialect()).seconds(count)[0] == pytest.approx(coded, rel=0.004)
    other = StepTimes(dialect("cruise=declared")).seconds(count)[0]
    assert other == pytest.approx(declared, rel=0.004)


def test_counted_cycles_are_a_little_faster() -> None:
    count = np.array([1, 1000])
    ratio = StepTimes(dialect("delay=counted")).seconds(count) / StepTimes(dialect()).seconds(
        count
    )
    assert ratio[0] == pytest.approx(0.1241 / 0.125, rel=1e-3)
    assert 0.97 < ratio[1] < 0.99


def test_bursts_of_255() -> None:
    times = StepTimes(dialect("high_byte='255'"))
    assert times.seconds(np.array([510]))[0] == pytest.approx(2 * 7.75, rel=0.004)
    assert times.seconds(np.array([255]))[0] == pytest.approx(7.75, rel=0.004)


def test_dog_legs() -> None:
    steps = np.array([[100, 0], [0, -100], [-100, 100], [300, -100]])
    ramps = StepTimes(dialect()).dog_leg_seconds(steps)
    np.testing.assert_allclose(ramps[:3], 6.27, rtol=0.004)
    assert ramps[3] == pytest.approx(6.27 + 7.22, rel=0.004)
    flows = StepTimes(dialect("elbow=flows"))
    assert flows.dog_leg_seconds(steps)[3] == pytest.approx(flows.seconds(np.array([300]))[0])


def test_a_slower_start() -> None:
    time = StepTimes(dialect("start_reload=246")).seconds(np.array([8]))[0]
    assert time == pytest.approx(8 * (6156 * 246 + 10272) / 12e6)
