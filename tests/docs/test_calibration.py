"""The commands of docs/calibration.md work as they are written, one after the other."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

from camtool.calibration.calibrate import Calibration, calibrate
from camtool.calibration.measurements import read_measurements
from camtool.cli.main import cli
from camtool.errors import InputError
from camtool.target.registry import load_target

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "calibration.md").read_text(encoding="utf-8")
BLOCKS = "".join(re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL))
COMMANDS = re.findall(r"^ *camtool (.+)$", BLOCKS, re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty folder in which the commands have run."""
    place = tmp_path_factory.mktemp("calibration")
    (place / "samples").symlink_to(ROOT / "samples")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        for command in COMMANDS:
            assert not cli.main(shlex.split(command), standalone_mode=False), command
    return place


def figure(folder: Path, name: str) -> float:
    return float(json.loads((folder / name).read_text())["error_um"]["total"]["max"])


def test_every_file_is_made(folder: Path) -> None:
    assert len(COMMANDS) == 9
    for name in ("coupon.dxf", "lengths.toml", "coupon.pic", "coupon.png", "my-mmh.toml"):
        assert (folder / name).stat().st_size > 200
    with pytest.raises(InputError, match="nothing was measured"):
        read_measurements(folder / "lengths.toml")


def test_the_error_is_seen_and_falls(folder: Path) -> None:
    coded, measured, mended = (
        figure(folder, f"{name}.json") for name in ("as-coded", "as-measured", "mended")
    )
    assert coded < 40.0
    assert measured == pytest.approx(753.5, abs=25.0)
    assert mended < 40.0


def test_the_table_says_what_the_commands_find(folder: Path) -> None:
    report = json.loads((folder / "my-mmh.json").read_text())
    found = {(e["what"], e["axis"], e["region"]): e for e in report["estimates"]}
    assert f"backlash {1000 * found['play', 'x', '']['value']:.2f} and" in PAGE
    assert f"{1000 * found['play', 'y', '']['value']:.2f} µm (printed" in PAGE
    x, y = found["step", "x", ""], found["step", "y", ""]
    assert f"steps of {1e6 * x['value']:.2f} and {1e6 * y['value']:.2f} nm" in PAGE
    assert f"± {1e6 * x['uncertainty']:.2f} and {1e6 * y['uncertainty']:.2f}" in PAGE


def found_in(name: str, target: str) -> Calibration:
    said = read_measurements(ROOT / "samples" / "measured" / name)
    return calibrate(said, load_target(target).machine)


def test_the_table_says_what_the_other_samples_give() -> None:
    squares = found_in("pic-mmh-squares.toml", "pic-mmh")
    left = [
        1000.0 * (value_of(squares, "play", axis) - steps * 0.00014)
        for axis, steps in (("x", 1375), ("y", 1204))
    ]
    assert f"X {left[0]:.1f} µm, Y −{-left[1]:.1f} µm" in PAGE
    circles = found_in("pic-mmh-circles.toml", "pic-mmh")
    lean = circles.estimate("squareness")
    assert lean is not None
    assert lean.uncertainty is not None
    assert f"squareness {1e3 * lean.value:.1f} ± {1e3 * lean.uncertainty:.1f} mrad" in PAGE
    steps = [1e6 * value_of(circles, "step", axis) for axis in "xy"]
    assert f"steps of {steps[0]:.2f} and {steps[1]:.2f} nm" in PAGE
    plays = [1e3 * value_of(circles, "play", axis) for axis in "xy"]
    assert f"backlash {plays[0]:.0f} and {plays[1]:.0f} µm" in PAGE
    assert circles.spread_mm is not None
    assert f"residuals of {1000.0 * circles.spread_mm:.0f} µm" in PAGE


def value_of(result: Calibration, what: str, axis: str) -> float:
    estimate = result.estimate(what, axis)
    assert estimate is not None
    return estimate.value
