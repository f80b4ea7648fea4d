"""How long the controller takes, against figures of the thesis and against a literal run."""

import itertools

import numpy as np
import pytest
from camtool_postprocessors.i8751.pulses import (
    DELAY_PERIODS,
    RAMP_PULSES,
    RAMP_RELOAD,
    Firmware,
    PulseTimes,
)

from camtool.errors import MachineError
from tests.oracles.i8751_run import CRYSTAL_HZ, Reading, listing_periods, record
from tests.postprocessors.i8751.machines import loaded


def firmware(*settings: str) -> Firmware:
    return loaded(*settings).machine.dialect


def alone(steps: int, *settings: str) -> float:
    return float(PulseTimes(firmware(*settings)).alone_s(np.array([steps]))[0])


def legs(steps: list[list[int]], *settings: str) -> np.ndarray:
    return PulseTimes(firmware(*settings)).legs_s(np.array(steps)).sum(axis=1)


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
    """Worked out by hand from the delays and rates of the thesis."""
    assert alone(steps) == pytest.approx(coded, rel=0.004)
    assert alone(steps, "cruise=declared") == pytest.approx(declared, rel=0.004)


def test_the_ramp_of_the_thesis() -> None:
    periods = PulseTimes(firmware()).periods_s
    assert periods[0] == pytest.approx(0.125, abs=5e-6)  # 8 Hz: L3150-3183
    assert periods[1] == pytest.approx(0.12254, abs=2e-4)  # the next, X = EDH: L3213-3236
    assert len(periods) - 1 == 45  # L3199-3203
    assert 1.0 / periods[-1] == pytest.approx(104.4, abs=0.05)  # X = 11H: L3241-3245
    declared = PulseTimes(firmware("cruise=declared")).periods_s
    assert declared[-1] == pytest.approx(0.01428, abs=6e-6)  # 70 Hz: L3187-3191
    assert np.diff(declared) == pytest.approx(-0.00246, abs=2e-6)  # 110.72 / 45 ms: L3205-3213
    assert declared[1] == pytest.approx(0.12254, abs=6e-6)


def reload(seconds: float) -> float:
    """X for a delay of so many seconds, by the equation of the thesis (L3156-3174)."""
    each, always = DELAY_PERIODS["thesis"]
    return (seconds * CRYSTAL_HZ - always) / each


def test_the_reloads_of_the_thesis() -> None:
    """8 Hz gives X = 241.996, where L3171-3180 prints 241.90: F2H either way."""
    assert reload(0.125) == pytest.approx(241.996, abs=5e-4)
    assert Firmware().start_reload == round(reload(0.125)) == 0xF2
    assert reload(0.12254) == pytest.approx(237.2, abs=0.01)  # EDH: L3213-3236
    assert 0xF2 - round(reload(0.12254)) == RAMP_RELOAD
    assert Firmware().start_reload - RAMP_PULSES * RAMP_RELOAD == 0x11  # L3241-3245
    assert round(reload(1.0 / 70.0)) == 26  # what 70 Hz would have needed


def test_the_listing_cycle_by_cycle() -> None:
    for x in (1, 0x11, 0xF2, 0xFF):
        assert listing_periods(x) == 6120 * x + 8196
    periods = PulseTimes(firmware("delay=counted")).periods_s
    assert periods[0] == listing_periods(0xF2) / CRYSTAL_HZ
    assert periods[-1] == listing_periods(0x11) / CRYSTAL_HZ
    assert periods[[0, -1]] == pytest.approx([0.12410, 0.009353], abs=6e-6)


READINGS = [
    (("high_byte='255'",), Reading(bursts=True)),
    (("first_pulse=repeats",), Reading(repeats=True)),
    (("cruise=declared",), Reading(declared=True)),
    (("delay=counted",), Reading(counted=True)),
    (("start_reload=246",), Reading(start=246)),
    (("start_reload=9",), Reading(start=9)),
    (("elbow=flows",), Reading(flows=True)),
    ((), Reading()),
    (
        ("high_byte='255'", "first_pulse=repeats", "cruise=declared", "delay=counted"),
        Reading(bursts=True, repeats=True, declared=True, counted=True),
    ),
    (
        ("high_byte='255'", "first_pulse=repeats", "elbow=flows"),
        Reading(bursts=True, repeats=True, flows=True),
    ),
]


@pytest.mark.parametrize(("settings", "reading"), READINGS, ids=str)
def test_every_reading_takes_the_time_of_its_pulses(
    settings: tuple[str, ...], reading: Reading
) -> None:
    counts = [0, 1, -2, 88, 89, 90, -91, 254, 255, 256, 345, 509, 510, 511, 1000]
    pairs = [list(pair) for pair in itertools.product(counts, repeat=2)]
    wanted = [record((0, 0, 0), (x, y, 0), reading).seconds for x, y in pairs]
    np.testing.assert_allclose(legs(pairs, *settings), wanted, rtol=1e-12)
    for count in counts:
        wanted_s = record((0, 0, 0), (0, 0, count), reading).seconds
        assert alone(count, *settings) == pytest.approx(wanted_s, rel=1e-12)


def test_counted_cycles_are_a_little_faster() -> None:
    assert alone(1, "delay=counted") / alone(1) == pytest.approx(0.1241 / 0.125, rel=1e-3)
    assert 0.97 < alone(1000, "delay=counted") / alone(1000) < 0.99


def test_bursts_of_255() -> None:
    assert alone(510, "high_byte='255'") == pytest.approx(2 * 7.75, rel=0.004)
    assert alone(255, "high_byte='255'") == pytest.approx(7.75, rel=0.004)


def test_dog_legs() -> None:
    steps = [[100, 0], [0, -100], [-100, 100], [300, -100]]
    ramps = legs(steps)
    np.testing.assert_allclose(ramps[:3], 6.27, rtol=0.004)
    assert ramps[3] == pytest.approx(6.27 + 7.22, rel=0.004)
    assert legs(steps, "elbow=flows")[3] == pytest.approx(alone(300))


def test_wrong_options_are_named() -> None:
    with pytest.raises(MachineError, match="start_reload"):
        loaded("start_reload=0")
