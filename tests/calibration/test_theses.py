"""The tables of the theses as measurements; Lnnn are lines of their texts."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from camtool.calibration.calibrate import Calibration, calibrate, scatters, to_text
from camtool.calibration.measurements import read_measurements
from camtool.target.registry import load_target

MEASURED = Path(__file__).parents[2] / "samples" / "measured"


def calibrated(name: str, target: str, *settings: str) -> Calibration:
    machine = load_target(target, settings=settings).machine
    return calibrate(read_measurements(MEASURED / name), machine)


def value(result: Calibration, what: str, axis: str = "", region: str = "") -> float:
    estimate = result.estimate(what, axis, region)
    assert estimate is not None, (what, axis, region)
    return estimate.value


@pytest.mark.parametrize(
    ("axis", "table", "by_total", "steps_mm", "scatter_mm", "last_mm"),
    [
        ("x", 0, 8.076, 24.767, 0.022, 80.76),  # Tabla 16, L1676-1682
        ("y", 1, 8.086, 24.741, 0.032, 80.86),  # Tabla 15, L1662-1668
        ("z", 2, 8.060, 24.795, 0.043, 80.60),  # Tabla 14, L1649-1655
    ],
)
def test_the_ten_turns_of_valcnc(
    axis: str, table: int, by_total: float, steps_mm: float, scatter_mm: float, last_mm: float
) -> None:
    result = calibrated("valcnc-steps.toml", "valcnc")
    step = value(result, "step", axis)
    assert 1.0 / step == pytest.approx(steps_mm, abs=0.0005)
    # The slope of a line through the origin, as a sum: Σ n·m / Σ n².
    said = tomllib.loads((MEASURED / "valcnc-steps.toml").read_text())["steps"][table]
    nominal, read = np.array(said["nominal_mm"]), np.array(said["forward_mm"])
    assert read[-1] == last_mm
    assert read[-1] / 10.0 == pytest.approx(by_total)
    assert step == pytest.approx(0.04 * (nominal @ read) / (nominal @ nominal), rel=1e-12)
    off = [
        each.residual_mm for each in result.fitted if each.reading.coupon == f"steps {table + 1}"
    ]
    assert off == pytest.approx((read - nominal * step / 0.04).tolist(), abs=1e-9)
    assert np.std(off) == pytest.approx(scatter_mm, abs=0.0005)
    assert not any(each.outlier for each in result.fitted)


def test_valcnc_says_nothing_of_play() -> None:
    result = calibrated("valcnc-steps.toml", "valcnc")
    held = {each.name: each.why for each in result.not_estimated}
    assert held == dict.fromkeys(
        ("play of x", "play of y", "play of z", "squareness"), "no reading depends on it"
    )


def test_the_two_lines_of_the_pic_machine() -> None:
    result = calibrated("pic-mmh-lines.toml", "pic-mmh")
    regions = [("x", "H1", 0.190), ("x", "H2", 0.201), ("x", "H3", 0.187)]  # L2353-2423
    regions += [("y", "V1", 0.152), ("y", "V2", 0.180), ("y", "V3", 0.173)]
    for axis, region, play in regions:
        assert value(result, "play", axis, region) == pytest.approx(play, abs=1e-12)
    # Printed as 0.1925 and 0.1685 (L2370-2373), which are not the means of the figures.
    assert value(result, "play", "x") == pytest.approx((0.190 + 0.201 + 0.187) / 3.0)
    assert value(result, "play", "y") == pytest.approx((0.152 + 0.180 + 0.173) / 3.0)
    assert round(value(result, "play", "x"), 5) == 0.19267
    assert round(value(result, "play", "y"), 5) == 0.16833
    # The lengths of the first lines: 2.509, 2.503, 2.502 for 2.5; 1.205, 1.203, 1.199 for 1.2.
    assert value(result, "step", "x") == pytest.approx(
        0.00014 * np.mean([2.509, 2.503, 2.502]) / 2.5
    )
    assert value(result, "step", "y") == pytest.approx(
        0.00014 * np.mean([1.205, 1.203, 1.199]) / 1.2
    )


def test_the_squares_of_the_pic_machine_with_their_signs() -> None:
    result = calibrated("pic-mmh-squares.toml", "pic-mmh")
    held = [each.name for each in result.not_estimated]
    assert held == [
        "scale of x",
        "scale of y",
        "squareness",
    ]  # one size: not distinguished from play
    # Dx = 2.5 − (B − C): what is left is the mean of 2.5 − Dx, with its sign. The thesis's
    # |2.5 − D| gives 11.67 (printed 11.5) and 9.67 µm (9.5) (L2457-2488), right for X alone.
    added = {"x": 1375 * 0.00014, "y": 1204 * 0.00014}  # whole steps of 0.1925 and 0.1685
    left_x = value(result, "play", "x") - added["x"]
    left_y = value(result, "play", "y") - added["y"]
    assert left_x * 1000.0 == pytest.approx((11 + 16 + 3) / 3.0, abs=1e-6)
    assert left_y * 1000.0 == pytest.approx((-19 + 3 + 6) / 3.0, abs=1e-6)
    assert result.spread_mm == pytest.approx(0.0107, abs=0.0001)


def test_the_circles_of_the_pic_machine() -> None:
    result = calibrated("pic-mmh-circles.toml", "pic-mmh")
    assert len(result.fitted) == 24
    # A lead of 0.5 mm would make the step 139.509 nm (28 × 128 steps): 0.35 % less than coded.
    assert value(result, "step", "x") == pytest.approx(0.00014 * (1.0 - 0.0074), rel=2e-3)
    assert value(result, "step", "y") == pytest.approx(0.00014 * (1.0 - 0.0044), rel=2e-3)
    # Most of what Tabla 15 calls scatter, 35, 23 and 21 µm (L2624-2630), is squareness.
    plain = [
        each.reading.measured_mm - each.reading.measure.radius_mm * 2 for each in result.fitted
    ]  # type: ignore[attr-defined]
    within = [np.std(plain[k : k + 8], ddof=1) for k in (0, 8, 16)]
    assert [round(float(each), 4) for each in within] == [0.0352, 0.0225, 0.0206]
    assert result.spread_mm is not None
    assert result.spread_mm < 0.012
    lean = result.estimate("squareness")
    assert lean is not None
    assert lean.uncertainty is not None
    assert lean.value > 3.0 * lean.uncertainty


def test_the_two_lines_of_the_parallel_port_machine() -> None:
    result = calibrated("flashcut-lines.toml", "flashcut")
    assert value(result, "play", "x") == pytest.approx(0.654)  # L1172
    assert value(result, "play", "y") == pytest.approx(0.302)
    assert all(each.uncertainty is None for each in result.estimates)
    assert result.spread_mm is None
    # 348 and 161 steps (L1172): of 1.88 µm, which is what a step really moves (L622).
    from camtool.calibration.calibrate import compensations

    machine = load_target("flashcut").machine
    steps = {axis: count for axis, _, count in compensations(result, machine)}
    assert steps == {"x": 348, "y": 161}


def test_the_scatter_of_circles_is_that_of_table_15() -> None:
    """σ of 0.035, 0.022 and 0.020 mm, and 3σ of 105 µm for the largest circle (L2528-2594,
    L2624-2630, where it is printed as nm)."""
    result = calibrated("pic-mmh-circles.toml", "pic-mmh")
    found = {each.nominal: each for each in scatters(result)}
    assert list(found) == ["Ø 6 mm", "Ø 4 mm", "Ø 2 mm"]
    for nominal, mean, sigma in (
        ("Ø 6 mm", 5.958, 0.035),
        ("Ø 4 mm", 3.982, 0.022),
        ("Ø 2 mm", 1.991, 0.020),
    ):
        assert found[nominal].count == 8
        assert found[nominal].mean_mm == pytest.approx(mean, abs=0.001)
        assert found[nominal].sigma_mm == pytest.approx(sigma, abs=0.001)
    machine = load_target("pic-mmh").machine
    assert "Ø 6 mm                  8  5.9581  35.2 µm  105.7 µm" in to_text(result, machine)


def test_lengths_that_were_measured_once_have_no_scatter() -> None:
    assert scatters(calibrated("valcnc-steps.toml", "valcnc")) == []
