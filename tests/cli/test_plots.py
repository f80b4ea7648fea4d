"""`--plot` of `post` and `verify`: its files, and what is refused."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.cli.conftest import Run


def test_plots_of_a_posted_drawing(camtool: Run, samples: Path, tmp_path: Path) -> None:
    """Both plots; the error's note has the figure of the report."""
    speed, error, report = (tmp_path / name for name in ("speed.png", "error.svg", "r.json"))
    words = ("--plot", "speed", speed, "--plot", "error", error, "--json", report, "--dark")
    done = camtool("post", samples / "logo.dxf", "-t", "grbl", "-o", tmp_path / "a.nc", *words)
    assert done.returncode == 0
    assert speed.read_bytes().startswith(b"\x89PNG")
    largest = json.loads(report.read_text())["error_um"]["total"]["max"]
    assert f"largest {largest:.5g} µm at " in error.read_text()


def test_a_stretch_of_a_program(camtool: Run, tmp_path: Path) -> None:
    program, picture = tmp_path / "a.nc", tmp_path / "a.svg"
    program.write_text("G21 G90\nG1 X10 F600\nG4 P2\nG1 X20\nM2\n")
    words = ("--plot", "position", picture, "--plot-from", "500ms", "--plot-span", "2s")
    assert camtool("verify", program, "-t", "linuxcnc", *words).returncode == 0
    assert re.search(r"2 s from 0\.5 s on, of [\d.]+ s", picture.read_text())


def test_no_plot_of_a_program_with_errors(camtool: Run, samples: Path, tmp_path: Path) -> None:
    """Nothing is written, as of all other files."""
    picture, program = tmp_path / "a.svg", tmp_path / "a.nc"
    words = ("-t", "grbl", "--max-error", "1um", "--plot", "error", picture, "-o", program)
    done = camtool("post", samples / "logo.dxf", *words)
    assert done.returncode == 1
    assert not picture.exists()
    assert not program.exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--plot", "speed", "a.jpg"), "'a.jpg' ends in none of .svg and .png"),
        (("--plot", "jerk", "a.svg"), "'jerk' is not one of"),
        (("--plot-from", "1s"), "--plot-from and --plot-span are of plots: add --plot"),
        (("--plot", "speed", "a.svg", "--crop", "0,0,1,1"), "--crop: plots over time do not have"),
        (("--plot", "speed", "a.svg", "--compare", "mechanics"), "--plot is of a single variant"),
        (("--plot", "speed", "a.svg", "--plot-from", "1h"), "from 3600 s on there is nothing"),
        (("--plot", "speed", "a.nc"), "ends in none of"),
    ],
)
def test_what_verify_refuses(
    camtool: Run, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    program = tmp_path / "a.nc"
    program.write_text("G21 G90\nG1 X10 F600\nM2\n")
    done = camtool("verify", program, "-t", "grbl", *words)
    assert done.returncode == 2
    assert message in done.stderr.decode()
    assert not (tmp_path / "a.svg").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--no-verify",), "--plot needs the simulated machine; drop --no-verify"),
        (("--split", "tool"), "--plot is of one program; drop --split"),
    ],
)
def test_what_post_refuses(
    camtool: Run, samples: Path, words: tuple[str, ...], message: str
) -> None:
    done = camtool("post", samples / "logo.dxf", "-t", "grbl", "--plot", "speed", "a.svg", *words)
    assert done.returncode == 2
    assert message in done.stderr.decode()
