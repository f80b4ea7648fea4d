"""The machine file of a calibration is one that --machine reads, and says what was measured."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import pytest

from camtool.calibration.calibrate import Calibration, calibrate
from camtool.calibration.machine_file import machine_file
from camtool.calibration.measurements import read_measurements
from camtool.machine.model import CORRELATED_KEYS, Machine, Uncertainty
from camtool.tables import read_table
from camtool.target.registry import load_target

MEASURED = Path(__file__).parents[2] / "samples" / "measured"


def made(
    tmp_path: Path, file: Path, target: str, own_file: Path | None = None
) -> tuple[Calibration, str, Machine]:
    """(calibration, text of its machine file, the machine that this file gives)."""
    said = read_measurements(file)
    machine = load_target(target, machine_file=own_file).machine
    result = calibrate(said, machine)
    own: dict[str, Any] = read_table(own_file) if own_file else {"extends": target}
    text = machine_file(result, said, machine, own)
    place = tmp_path / "calibrated.toml"
    place.write_text(text, encoding="utf-8")
    return result, text, load_target(target, machine_file=place).machine


@pytest.mark.parametrize(
    ("name", "target"),
    [
        ("valcnc-steps.toml", "valcnc"),
        ("pic-mmh-lines.toml", "pic-mmh"),
        ("pic-mmh-squares.toml", "pic-mmh"),
        ("pic-mmh-circles.toml", "pic-mmh"),
        ("flashcut-lines.toml", "flashcut"),
    ],
)
def test_the_machine_has_the_numbers_that_were_found(
    tmp_path: Path, name: str, target: str
) -> None:
    result, _, machine = made(tmp_path, MEASURED / name, target)
    checked = 0
    for axis in ("x", "y", "z"):
        record = getattr(machine.axes, axis)
        for what, value in (("step", record.real_step_mm), ("play", record.backlash_mm)):
            estimate = result.estimate(what, axis)
            if estimate is None:
                before = getattr(load_target(target).machine.axes, axis)
                assert value == (before.real_step_mm if what == "step" else before.backlash_mm)
                continue
            checked += 1
            near = 0.02 * (estimate.uncertainty or 1e-9)
            assert value == pytest.approx(estimate.value, abs=near)
    lean = result.estimate("squareness")
    if lean is not None:
        checked += 1
        assert machine.mechanics.squareness_rad == pytest.approx(lean.value, abs=1e-4)
    assert checked >= 2


def test_the_play_by_region_becomes_the_map(tmp_path: Path) -> None:
    _, text, machine = made(tmp_path, MEASURED / "pic-mmh-lines.toml", "pic-mmh")
    assert machine.play_map.use
    assert machine.play_map.x is not None
    assert machine.play_map.y is not None
    assert machine.play_map.x.play_mm == ((0.19, 0.201, 0.187),)
    assert machine.play_map.y.play_mm == ((0.152,), (0.18,), (0.173,))
    assert machine.play_map.x.x_mm == (0.0, 3.333, 6.667, 10.0)
    assert "± 0.0034" in text


def test_play_measured_as_a_whole_ends_an_older_map(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text('extends = "pic-mmh"\n[play_map]\nuse = true\n')
    _, text, machine = made(tmp_path, MEASURED / "pic-mmh-squares.toml", "pic-mmh", own)
    assert not machine.play_map.use
    assert "use = false    # the play of" in text


def test_numbers_of_the_own_file_stay(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(
        'extends = "pic-mmh"\n'
        '[target]\nname = "mine"\ntitle = "the \\"old\\" one \\u007f"\n'
        "[limits]\nmax_reversals = 7\n[axes.x]\ntravel_mm = 9.5\nbacklash_mm = 0.5\n"
        "[controller]\nmachine_zero_mm = [0.0, 1.0, 2.0]\n"
    )
    result, _, machine = made(tmp_path, MEASURED / "pic-mmh-squares.toml", "pic-mmh", own)
    assert machine.target.name == "mine"
    assert machine.target.title == 'the "old" one \x7f'
    assert machine.limits.max_reversals == 7
    assert machine.axes.x.travel_mm == 9.5
    assert machine.controller.machine_zero_mm == (0.0, 1.0, 2.0)
    play = result.estimate("play", "x")
    assert play is not None
    assert play.before == 0.5
    assert machine.axes.x.backlash_mm == pytest.approx(play.value, abs=2e-4)


def test_each_number_says_how_sure_it_is_and_where_it_comes_from(tmp_path: Path) -> None:
    hostile = tmp_path / "a\nb#.toml"
    hostile.write_text((MEASURED / "valcnc-steps.toml").read_text())
    _, text, machine = made(tmp_path, hostile, "valcnc")
    assert "± 9e-06, 10 readings of a?b#.toml; 0.04038 before" in text
    assert str(tmp_path) not in text
    assert machine.axes.x.real_step_mm == pytest.approx(0.0403768, abs=1e-6)


def test_no_play_is_written_as_none(tmp_path: Path) -> None:
    file = tmp_path / "m.toml"
    file.write_text('[[lines]]\naxis = "x"\nnominal_mm = 5.0\nshorter_by_mm = -0.002\n'
                    'uncertainty_mm = 0.001\n')  # fmt: skip
    result, _, machine = made(tmp_path, file, "grbl")
    play = result.estimate("play", "x")
    assert play is not None
    assert play.value < 0.0
    assert machine.axes.x.backlash_mm == 0.0


@pytest.mark.parametrize("name", ["valcnc-steps", "pic-mmh-lines", "pic-mmh-circles"])
def test_how_well_the_values_are_known_goes_into_the_machine(tmp_path: Path, name: str) -> None:
    target = name.rpartition("-")[0]
    result, _, machine = made(tmp_path, MEASURED / f"{name}.toml", target)
    count = 0
    for key in CORRELATED_KEYS:
        known, said = result.known.standard(key), machine.uncertainty.standard(key)
        if known is not None:
            count += 1
            assert said == pytest.approx(known, rel=0.006)
    assert count == {"valcnc-steps": 2, "pic-mmh-lines": 4, "pic-mmh-circles": 7}[name]
    assert machine.uncertainty.correlations == result.known.correlations
    assert bool(result.known.correlations) == (name == "pic-mmh-circles")


def test_a_cell_is_less_well_known_than_the_mean_of_all_cells(tmp_path: Path) -> None:
    result, _, _ = made(tmp_path, MEASURED / "pic-mmh-lines.toml", "pic-mmh")
    cells = [result.estimate("play", "x", name) for name in ("H1", "H2", "H3")]
    mean = result.estimate("play", "x")
    assert mean is not None
    assert mean.uncertainty is not None
    each = [cell.uncertainty for cell in cells if cell is not None and cell.uncertainty]
    assert len(each) == 3
    assert result.known.x.backlash_mm == pytest.approx(math.sqrt(sum(u * u for u in each) / 3.0))
    assert result.known.x.backlash_mm == pytest.approx(math.sqrt(3.0) * mean.uncertainty)


def test_one_reading_of_each_value_says_nothing_of_how_well_it_is_known(tmp_path: Path) -> None:
    result, text, machine = made(tmp_path, MEASURED / "flashcut-lines.toml", "flashcut")
    assert result.known == Uncertainty()
    assert "[uncertainty" not in text
    assert machine.uncertainty == load_target("flashcut").machine.uncertainty


def test_what_an_older_file_says_of_what_was_measured_again_holds_no_more(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(
        'extends = "valcnc"\n[uncertainty]\nprocess_mm = 0.05\ntool_diameter_mm = 0.01\n'
        'correlations = [["x.scale", "y.backlash_mm", 0.5], '
        '["tool_diameter_mm", "y.backlash_mm", 0.25]]\n'
        "[uncertainty.x]\nscale = 0.05\n[uncertainty.y]\nbacklash_mm = 0.07\n"
    )
    result, _, machine = made(tmp_path, MEASURED / "valcnc-steps.toml", "valcnc", own)
    said = machine.uncertainty
    assert said.x.scale == pytest.approx(result.known.x.scale, rel=0.006)
    assert (said.process_mm, said.y.backlash_mm) == (0.05, 0.07)
    assert said.correlations == (("tool_diameter_mm", "y.backlash_mm", 0.25),)


def test_a_value_without_uncertainty_takes_the_older_one_away(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(
        'extends = "flashcut"\n[uncertainty]\ncorrelations = [["x.scale", "x.backlash_mm", 0.5]]'
        "\n[uncertainty.x]\nscale = 0.05\nbacklash_mm = 0.01\n"
    )
    _, text, _ = made(tmp_path, MEASURED / "flashcut-lines.toml", "flashcut", own)
    assert tomllib.loads(text)["uncertainty"] == {"x": {"scale": 0.05}}
