"""`camtool servo`: from a measured step to a machine file, and from there to gains."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from camtool.calibration.servo import respond
from camtool.machine.servo import MotorModel
from tests.cli.conftest import Run


def write_step(file: Path, motor: MotorModel, drives: list[float]) -> None:
    drive = np.repeat(drives, 200)
    time_s = 0.005 * np.arange(len(drive))
    speed, _ = respond(motor, time_s, drive, 0.005)
    rows = zip(time_s.tolist(), np.round(speed).tolist(), drive.tolist(), strict=True)
    file.write_text("time_s,speed,drive\n" + "".join(f"{t},{s},{d}\n" for t, s, d in rows))


def test_a_step_becomes_a_machine_and_its_gains(camtool: Run, tmp_path: Path) -> None:
    write_step(tmp_path / "step.csv", MotorModel(9.0, 0.05, 10.0, 0.004), [70.0, 40.0])
    arguments = ("step.csv", "-t", "matlab-router", "--axis", "y", "-o", "mine.toml")
    done = camtool("servo", "identify", *arguments)
    assert done.returncode == 0, done.stderr
    assert b"friction" in done.stdout
    assert b"note: the dead time of 4.0 ms is in no key" in done.stderr
    table = tomllib.loads((tmp_path / "mine.toml").read_text())
    assert table["extends"] == "matlab-router"
    keys = table["controller"]
    assert keys["plant_gain"] == pytest.approx([8.896, 9.0 * 60 / 70, 9.767], rel=1e-3)
    assert keys["time_constant_s"] == pytest.approx([0.061, 0.05, 0.062], rel=5e-3)
    assert keys["friction_percent"] == pytest.approx([0.0, 10.0, 0.0], abs=0.1)
    assert keys["kid"] == [28.0] * 3
    again = ("--machine", "mine.toml", "--settling", "200ms", "--axis", "y")
    done = camtool("servo", "design", *again, "-o", "tuned.toml", "--json", "-")
    assert done.returncode == 0, done.stderr
    (axis,) = json.loads(done.stdout)["axes"]
    assert axis["ki"] == pytest.approx((4 / 0.707 / 0.2) ** 2 * 0.05 / 9.0, rel=1e-2)
    tuned = tomllib.loads((tmp_path / "tuned.toml").read_text())["controller"]
    assert tuned["kid"] == [28.0, axis["stored_kid"], 28.0]
    assert tuned["plant_gain"] == keys["plant_gain"]
    shown = camtool("targets", "matlab-router", "--machine", "tuned.toml", "--json")
    assert shown.returncode == 0, shown.stderr
    assert json.loads(shown.stdout)["controller"]["kid"] == tuned["kid"]


def test_the_thesis_table_of_gains(camtool: Run) -> None:
    done = camtool("servo", "design", "-t", "matlab-router", "--settling", "250ms")
    assert done.returncode == 0, done.stderr
    text = done.stdout.decode()
    assert "y     22.63   5.6347   0.1735  0.028174  0.159373  28, 159" in text
    assert "250 ms, 6.2 %" in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("design", "-t", "grbl", "--settling", "250ms"), "grbl has no speed loops"),
        (("design", "-t", "matlab-router", "--settling", "9s"), "is too slow for a motor"),
        (("design", "-t", "matlab-router", "--settling", "nan"), "nan"),
        (("identify", "no.csv", "-t", "matlab-router", "--axis", "x"), "no.csv"),
        (("identify", "bad.csv", "-t", "matlab-router", "--axis", "x"), "line 4, column 2"),
    ],
)
def test_what_cannot_be_is_said_in_a_line(
    camtool: Run, tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    rows = "".join(f"{k},{k},70\n" for k in range(9))
    (tmp_path / "bad.csv").write_text(
        "time_s,speed,drive\n0,0,70\n" + rows.replace("1,", "1,x", 1)
    )
    done = camtool("servo", *arguments)
    assert done.returncode == 2
    assert message in done.stderr.decode()
    assert b"Traceback" not in done.stderr


def test_nothing_is_written_over(camtool: Run, tmp_path: Path) -> None:
    write_step(tmp_path / "step.csv", MotorModel(9.0, 0.05), [70.0])
    (tmp_path / "mine.toml").write_text("kept")
    arguments = ("step.csv", "-t", "matlab-router", "--axis", "x", "-o", "mine.toml")
    done = camtool("servo", "identify", *arguments)
    assert done.returncode == 2
    assert (tmp_path / "mine.toml").read_text() == "kept"
