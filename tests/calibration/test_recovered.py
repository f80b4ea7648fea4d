"""What a machine was given is found again from the coupons that its mechanics cut."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.calibration.calibrate import Calibration, calibrate
from camtool.calibration.coupons import KINDS, CouponSheet, Kind, sheet
from camtool.calibration.measurements import (
    Added,
    CircleCoupon,
    Coupon,
    LinesCoupon,
    Measurements,
    RegionsOf,
    SquareCoupon,
    StepsCoupon,
)
from camtool.machine.model import CORRELATED_KEYS, Machine
from camtool.target.registry import load_target
from tests.oracles import measured
from tests.strategies import examples

RECORDS: dict[str, type[Coupon]] = {
    "lines": LinesCoupon, "squares": SquareCoupon, "circles": CircleCoupon, "steps": StepsCoupon
}  # fmt: skip
PLAYS = st.floats(0.0, 0.2)
SCALES = st.floats(0.98, 1.02)


def machine_of(
    scale: tuple[float, float], play: tuple[float, float], added: tuple[float, float], lean: float
) -> Machine:
    """A machine with these faults; its file says none of them."""
    settings = [f"mechanics.squareness_rad={lean}"]
    for axis, k, lost, more in zip("xy", scale, play, added, strict=True):
        settings += [
            f"axes.{axis}.coded_step_mm=0.001",
            f"axes.{axis}.real_step_mm={0.001 * k}",
            f"axes.{axis}.backlash_mm={lost}",
            f"axes.{axis}.compensation_mm={more}",
        ]
    return load_target("grbl", settings=settings).machine


def guess(machine: Machine, kind: Kind) -> Machine:
    """Return the machine as known before the calibration: coded steps, compensation, and its
    squareness, where the coupon does not tell it, as rulers along X lean with it."""
    added = (machine.axes.x.compensation_mm, machine.axes.y.compensation_mm)
    lean = 0.0 if kind in TELLS_SQUARENESS else machine.mechanics.squareness_rad
    return machine_of((1.0, 1.0), (0.0, 0.0), added, lean)


def found(
    drawn: CouponSheet,
    machine: Machine,
    *,
    sigma_mm: float = 0.0,
    seed: int = 0,
    backwards: bool = False,
) -> Calibration:
    """The calibration from readings of the sheet as the machine cuts it, with scatter."""
    random = np.random.default_rng(seed)

    def scattered(value: object) -> object:
        if isinstance(value, list):
            return [scattered(each) for each in value]
        return float(value) + sigma_mm * random.standard_normal()  # type: ignore[arg-type]

    coupons = []
    for number, table in enumerate(measured.readings(drawn, machine, backwards=backwards)):
        read = {
            key: scattered(value)
            if key in ("first_mm", "second_mm", "dx_mm", "dy_mm", "diagonals_mm",
                       "diameters_mm", "forward_mm", "backward_mm")
            else value
            for key, value in table.items()
        }  # fmt: skip
        record = msgspec.convert(read, RECORDS[drawn.kind])
        coupons.append((f"{drawn.kind} {number + 1}", record))
    said = Measurements("m.toml", "grbl", sigma_mm or None, Added(), RegionsOf(), tuple(coupons))
    return calibrate(said, guess(machine, drawn.kind))


FAULTS = st.builds(
    machine_of,
    st.tuples(SCALES, SCALES),
    st.tuples(PLAYS, PLAYS),
    st.tuples(st.sampled_from([0.0, 0.05, 0.1]), st.sampled_from([0.0, 0.05, 0.1])),
    st.floats(-0.02, 0.02),
)
TELLS_SQUARENESS = {"squares", "circles"}


@pytest.mark.parametrize(
    ("kind", "backwards"), [*((kind, False) for kind in KINDS), ("squares", True)]
)
@examples(15)
@given(machine=FAULTS)
def test_exact_readings_give_the_machine_back(
    kind: Kind, backwards: bool, machine: Machine
) -> None:
    drawn = sheet(kind, (60.0, 40.0), (1, 1), machine)
    result = found(drawn, machine, backwards=backwards)
    near = 2e-6 if kind == "circles" else 1e-9  # chords of the oracle's circle
    for axis, truth in (("x", machine.axes.x), ("y", machine.axes.y)):
        step, play = result.estimate("step", axis), result.estimate("play", axis)
        assert step is not None
        assert play is not None
        assert step.value == pytest.approx(truth.real_step_mm, rel=near)
        assert play.value == pytest.approx(truth.backlash_mm, abs=10.0 * near)
    lean = result.estimate("squareness")
    assert (lean is not None) == (kind in TELLS_SQUARENESS)
    if lean is not None:
        assert lean.value == pytest.approx(machine.mechanics.squareness_rad, abs=near)
    assert max(abs(each.residual_mm) for each in result.fitted) < 100.0 * near


@pytest.mark.parametrize("kind", KINDS)
def test_scattered_readings_give_it_within_the_uncertainty(kind: Kind) -> None:
    """Over many draws the estimates scatter as much as the uncertainties say."""
    machine = machine_of((1.004, 0.997), (0.12, 0.03), (0.1, 0.1), 0.004)
    drawn = sheet(kind, (60.0, 40.0), (1, 1), machine)
    off = []
    for seed in range(30):
        result = found(drawn, machine, sigma_mm=0.002, seed=seed)
        for each in result.estimates:
            assert each.uncertainty is not None
            truth = {
                "step": lambda axis: getattr(machine.axes, axis).real_step_mm,
                "play": lambda axis: getattr(machine.axes, axis).backlash_mm,
                "squareness": lambda _: machine.mechanics.squareness_rad,
            }[each.what](each.axis)
            off.append((each.value - truth) / each.uncertainty)
    assert 0.75 < math.sqrt(np.mean(np.square(off))) < 1.1  # s is never below the instrument's
    assert abs(np.mean(off)) < 0.2
    assert max(map(abs, off)) < 4.5


def truth_of(machine: Machine, key: str) -> float:
    """The value to which this key of `[uncertainty]` belongs; scale as a part of one."""
    axis, _, name = key.rpartition(".")
    if name == "squareness_rad":
        return machine.mechanics.squareness_rad
    record = getattr(machine.axes, axis)
    return float(record.backlash_mm if name == "backlash_mm" else record.real_step_mm)


def found_at(result: Calibration, key: str) -> float:
    axis, _, name = key.rpartition(".")
    what = {"backlash_mm": "play", "scale": "step", "squareness_rad": "squareness"}[name]
    estimate = result.estimate(what, axis)
    assert estimate is not None
    return estimate.value


@pytest.mark.parametrize("kind", KINDS)
def test_the_covariance_is_that_of_many_calibrations(kind: Kind) -> None:
    """The covariance of the values over many draws is the one that each calibration states."""
    machine = machine_of((1.004, 0.997), (0.12, 0.03), (0.1, 0.1), 0.004)
    drawn = sheet(kind, (60.0, 40.0), (1, 1), machine)
    rows, squares = [], []
    for seed in range(150):
        result = found(drawn, machine, sigma_mm=0.002, seed=seed)
        known = result.known
        keys = [key for key in CORRELATED_KEYS if known.standard(key)]
        assert ("squareness_rad" in keys) == (kind in TELLS_SQUARENESS)
        assert (known.x.compensation_mm, known.y.compensation_mm) == (0.0, 0.0)
        assert known.tool_diameter_mm is None
        off = np.array([found_at(result, key) - truth_of(machine, key) for key in keys])
        for k, key in enumerate(keys):
            if key.endswith("scale"):
                off[k] /= truth_of(machine, key)
        off /= [known.standard(key) for key in keys]
        rows.append(off)
        said = known.correlation(keys)
        squares.append(float(off @ np.linalg.solve(said, off)) / len(keys))
    assert 0.75 < np.mean(squares) < 1.1
    assert np.abs(np.corrcoef(np.array(rows).T) - said).max() < 4.0 / math.sqrt(len(rows))
