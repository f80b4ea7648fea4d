"""Least squares against numpy's own, parameters that are not determined, and outliers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from camtool.calibration.calibrate import Calibration, calibrate
from camtool.calibration.measurements import read_measurements
from camtool.target.registry import load_target


def calibrated(tmp_path: Path, text: str, *settings: str) -> Calibration:
    file = tmp_path / "m.toml"
    file.write_text(text)
    return calibrate(read_measurements(file), load_target("grbl", settings=settings).machine)


def ruler(forward: list[float], backward: list[float], more: str = "") -> str:
    nominal = [10.0 * (k + 1) for k in range(len(forward))]
    return (
        f'[[steps]]\naxis = "y"\nnominal_mm = {nominal}\nforward_mm = {forward}\n'
        f"backward_mm = {backward}\n{more}"
    )


FORWARD = [10.011, 20.019, 30.032, 40.041, 50.049]
BACKWARD = [10.108, 20.121, 30.129, 40.142, 50.151]


def test_a_ruler_is_a_straight_line_and_a_step(tmp_path: Path) -> None:
    result = calibrated(tmp_path, ruler(FORWARD, BACKWARD))
    nominal = 10.0 * np.arange(1, 6)
    matrix = np.column_stack([np.tile(nominal, 2), np.repeat([0.0, 1.0], 5)])
    read = np.array(FORWARD + BACKWARD)
    expected, squares, _, _ = np.linalg.lstsq(matrix, read, rcond=None)
    covariance = squares[0] / 8.0 * np.linalg.inv(matrix.T @ matrix)
    step, play = result.estimate("step", "y"), result.estimate("play", "y")
    assert step is not None
    assert play is not None
    assert step.value == pytest.approx(0.004 * expected[0], rel=1e-12)
    assert step.uncertainty == pytest.approx(0.004 * covariance[0, 0] ** 0.5)
    assert play.value == pytest.approx(expected[1], rel=1e-9)
    assert play.uncertainty == pytest.approx(covariance[1, 1] ** 0.5)
    assert (step.readings, play.readings) == (10, 5)
    assert result.freedom == 8
    assert result.spread_mm == pytest.approx((squares[0] / 8.0) ** 0.5)


@pytest.mark.parametrize(("instrument_mm", "times"), [(0.01, 1.0), (0.0001, None)])
def test_the_instrument_is_a_floor_of_the_uncertainty(
    tmp_path: Path, instrument_mm: float, times: float | None
) -> None:
    """Residuals are some 2 µm: a worse instrument decides, a better one cannot be believed."""
    said = calibrated(tmp_path, ruler(FORWARD, BACKWARD, f"uncertainty_mm = {instrument_mm}\n"))
    alone = calibrated(tmp_path, ruler(FORWARD, BACKWARD))
    one, other = said.estimate("play", "y"), alone.estimate("play", "y")
    assert one is not None
    assert other is not None
    assert other.uncertainty is not None
    assert other.uncertainty > 0.0
    if times is None:
        assert one.uncertainty == pytest.approx(other.uncertainty)
    else:
        nominal = 10.0 * np.arange(1, 6)
        matrix = np.column_stack([np.tile(nominal, 2), np.repeat([0.0, 1.0], 5)]) / instrument_mm
        assert one.uncertainty == pytest.approx(np.linalg.inv(matrix.T @ matrix)[1, 1] ** 0.5)


def test_the_compensation_that_was_active_is_part_of_the_play(tmp_path: Path) -> None:
    text = '[[lines]]\naxis = "x"\nnominal_mm = 20.0\nfirst_mm = 20.2\nshorter_by_mm = 0.03\n'
    without = calibrated(tmp_path, text).estimate("play", "x")
    said = "compensation_mm = { x = 0.101 }\n"
    by_file = calibrated(tmp_path, said + text).estimate("play", "x")
    by_coupon = calibrated(tmp_path, text + said).estimate("play", "x")
    machine = calibrated(tmp_path, text, "axes.x.compensation_mm=0.1").estimate("play", "x")
    assert without is not None
    assert by_file is not None
    assert by_coupon is not None
    assert machine is not None
    assert without.value == pytest.approx(0.03)
    # Whole steps of 4 µm, 1 % longer than coded: 0.100 commanded, 0.101 done.
    assert by_file.value == pytest.approx(0.03 + 0.1 * 1.01)
    assert by_coupon.value == pytest.approx(by_file.value)
    assert machine.value == pytest.approx(by_file.value)


@pytest.mark.parametrize(
    ("text", "held"),
    [
        (
            '[[lines]]\naxis = "x"\nnominal_mm = 5.0\nfirst_mm = 5.01\n',
            {"play of x": "no reading depends on it", "squareness": "no reading depends on it"},
        ),
        (
            "[[squares]]\nnominal_mm = [5.0, 4.0]\ndx_mm = 4.9\ndy_mm = 3.9\n",
            {
                "scale of x": "the readings cannot distinguish it from play of x",
                "scale of y": "the readings cannot distinguish it from play of y",
                "squareness": "no reading depends on it",
            },
        ),
        (
            "[[squares]]\nnominal_mm = [5.0, 5.0]\ndiagonals_mm = [7.08, 7.06]\n",
            {
                "scale of x": "the readings cannot distinguish it from play of x",
                "play of y": "the readings cannot distinguish it from play of x",
                "scale of y": "the readings cannot distinguish it from play of x",
            },
        ),
        (
            "[[squares]]\nnominal_mm = [5.0, 5.0]\ndx_mm = 4.9\n"
            "[[squares]]\nnominal_mm = [2.0, 2.0]\ndx_mm = 1.9\n",
            {"squareness": "no reading depends on it"},
        ),
    ],
)
def test_what_the_readings_cannot_tell_is_not_estimated(
    tmp_path: Path, text: str, held: dict[str, str]
) -> None:
    result = calibrated(tmp_path, text)
    found = {each.name: each.why for each in result.not_estimated}
    assert found == held
    assert not {each.name.replace("step", "scale") for each in result.estimates} & set(found)


def test_squareness_from_diagonals_alone(tmp_path: Path) -> None:
    """rising² − falling² = 4 a b tan q, whatever the plays are."""
    text = "[[squares]]\nnominal_mm = [5.0, 5.0]\ndiagonals_mm = [7.08, 7.06]\n"
    lean = calibrated(tmp_path, text).estimate("squareness")
    assert lean is not None
    assert lean.value == pytest.approx(
        (7.08 - 7.06) / (2.0 * 5.0 * 0.5**0.5 * 2.0) * 2.0, rel=0.01
    )


def test_an_outlier_is_named_and_it_alone(tmp_path: Path) -> None:
    wrong = [*FORWARD[:2], FORWARD[2] + 0.05, *FORWARD[3:]]
    result = calibrated(tmp_path, ruler(wrong, BACKWARD))
    assert [each.reading.name for each in result.fitted if each.outlier] == ["forward at 30 mm"]
    assert not any(each.outlier for each in calibrated(tmp_path, ruler(FORWARD, BACKWARD)).fitted)


def test_an_outlier_among_few_readings_needs_the_instrument(tmp_path: Path) -> None:
    few = ruler([10.01, 20.02, 30.08], [])
    few = few.replace("backward_mm = []\n", "")
    assert not any(each.outlier for each in calibrated(tmp_path, few).fitted)
    said = calibrated(tmp_path, few + "uncertainty_mm = 0.001\n")
    assert any(each.outlier for each in said.fitted)


def test_play_of_regions_and_a_coupon_without_one(tmp_path: Path) -> None:
    """A coupon that lies in no region counts for the mean of all."""
    lines = "".join(
        f'[[lines]]\naxis = "x"\nregion = "{name}"\nnominal_mm = 5.0\nshorter_by_mm = {play}\n'
        for name, play in (("A", 0.1), ("B", 0.2))
    )
    gap = "[[closures]]\nnominal_mm = [9.0, 9.0]\ngap_x_mm = 0.18\n"
    result = calibrated(tmp_path, lines + gap)
    # min (a − 0.1)² + (b − 0.2)² + ((a + b)/2 − 0.18)²: both move by 0.01.
    values = {each.region: each.value for each in result.estimates if each.what == "play"}
    assert values == pytest.approx({"A": 0.11, "B": 0.21, "": 0.16}, abs=0.0101)
    a, b = values["A"], values["B"]
    assert a - 0.1 == pytest.approx(b - 0.2, abs=1e-12)
    assert 2.0 * (a - 0.1) == pytest.approx(0.18 - 0.5 * (a + b), abs=1e-12)
