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


def test_axes_of_a_program(camtool: Run, samples: Path, tmp_path: Path) -> None:
    """A picture, a table and the figures of a posted program; a stretch has only its moves."""
    program = tmp_path / "logo.m"
    posted = camtool("post", samples / "logo.dxf", "-t", "matlab-router", "-o", program, "-q")
    assert posted.returncode == 0
    files = [tmp_path / name for name in ("a.svg", "a.csv", "a.json")]
    words = ("-o", files[0], "--csv", files[1], "--json", files[2], "--from", "10s")
    done = camtool("servo", "show", program, "-t", "matlab-router", *words, "--span", "6s")
    assert done.returncode == 0, done.stderr
    moves = json.loads(files[2].read_text())["moves"]
    assert all(10.0 <= move["at_s"] <= 16.0 for move in moves)
    assert {move["axis"] for move in moves} == {"X", "Y", "Z"}
    assert files[0].read_text().count("(rpm of the motor)</title>") == 3
    # No ticks while the numbers of a job are on their way.
    assert 1180 < len(files[1].read_text().splitlines()) <= 1202
    words = ("servo", "show", program, "-t", "matlab-router", "--span", "4s")
    shown = camtool(*words).stdout.decode()
    assert "rpm at" in shown
    assert "beside its place" in shown


def test_steps_of_the_thesis(camtool: Run) -> None:
    """Open loop at 60 and 70 % (L2704, figs. 5.2 to 5.4), speed loop at 3515 rpm (L3715)."""
    words = ("servo", "step", "-t", "matlab-router", "--json", "-")
    axes = json.loads(camtool(*words, "--drive", "70").stdout)["axes"]
    assert [each["end_counts"] for each in axes] == pytest.approx([622.7, 391.9, 683.7], abs=0.1)
    slower = json.loads(camtool(*words, "--drive", "60").stdout)["axes"]
    for each, other in zip(axes, slower, strict=True):
        assert other["end_rpm"] == pytest.approx(each["end_rpm"] * 6 / 7, rel=1e-6)
    closed = json.loads(camtool(*words, "--speed", "3515.625").stdout)["axes"]
    for each in closed:
        assert each["end_rpm"] == pytest.approx(3515.6, rel=0.005)
        assert 0.04 < each["overshoot"] < 0.06


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("step", "-t", "matlab-router"), "give --drive PERCENT or --speed RPM"),
        (("step", "-t", "grbl", "--drive", "3"), "grbl has no speed loops"),
        (("step", "-t", "matlab-router", "--drive", "3", "--dark"), "--dark: for pictures"),
        (("step", "-t", "matlab-router", "--drive", "3", "-o", "a.pdf"), "a picture is .svg or"),
        (("show", "a.m", "-t", "matlab-router", "--axes", "X"), "--axes: for pictures"),
        (("show", "a.m", "-t", "grbl"), "grbl has no speed loops"),
    ],
)
def test_what_steps_and_shows_refuse(
    camtool: Run, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    (tmp_path / "a.m").write_text("% nothing\n")
    done = camtool("servo", *words)
    assert done.returncode == 2
    assert message in done.stderr.decode()


def test_the_rows_of_validation(camtool: Run, samples: Path) -> None:
    """Figures 4.10, 4.12 and 5.8 to 5.13 as docs/validation.md has them."""
    motor = []
    for key, value in (("plant_gain", 9.714), ("time_constant_s", 0.067)):
        motor += ["--set", f"controller.{key}=[{value},{value},{value}]"]
    words = ("servo", "step", "-t", "matlab-router", *motor, "--axis", "x", "--json", "-")
    (open_loop,) = json.loads(camtool(*words, "--drive", "70").stdout)["axes"]
    (closed,) = json.loads(camtool(*words, "--speed", "7992").stdout)["axes"]
    assert open_loop["end_counts"] == pytest.approx(680.0, abs=0.05)
    assert open_loop["rise_s"] == pytest.approx(0.07)
    assert (open_loop["settling_s"], closed["settling_s"]) == pytest.approx((0.26, 0.195))
    assert closed["overshoot"] == pytest.approx(0.064, abs=0.001)
    show = ("servo", "show", samples / "servo-corner.m", "-t", "matlab-router", "--json", "-")
    for slaves, wanted in (("text", (0.265,) * 3), ("listing", (0.2, 0.35, 0.19))):
        moves = json.loads(camtool(*show, "--set", f"controller.slaves={slaves}").stdout)["moves"]
        ways = [move for move in moves if move["reference_rpm"] == pytest.approx(5859.375)]
        assert [move["settling_s"] for move in ways] == pytest.approx(wanted)
