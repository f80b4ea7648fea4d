"""`camtool signals`: files of a whole run and of a stretch, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.cli.conftest import Run

LINE = "M03\nG01 X10.0 Y5.0 F14.1\nM30\n"
AT_3_MS = ("-t", "flashcut", "--set", "controller.half_period_ms=3")


@pytest.fixture
def line(tmp_path: Path) -> Path:
    file = tmp_path / "line.nc"
    file.write_text(LINE)
    return file


def test_counts_of_a_run(camtool: Run, line: Path) -> None:
    """The table of the thesis' line: 5263 steps along X; Y has as many as its timer gives."""
    counts = camtool("signals", str(line), *AT_3_MS).stdout.decode()
    assert "X: 5,263 steps; 2 ms at least between two changes" in counts
    assert "Y: 3,508 steps; 3 ms at least" in counts
    assert "Z: 0 steps\n" in counts
    assert counts.endswith("time: 42.104 s\n")


def test_the_oscillogram_of_the_thesis(camtool: Run, line: Path, tmp_path: Path) -> None:
    """X is high and low for 4 ms, Y for 6 (L1188), on all terminals of both motors."""
    picture = tmp_path / "scope.svg"
    stretch = ("--from", "20s", "--span", "60ms", "--motors", "X,Y")
    camtool("signals", str(line), *AT_3_MS, "-o", str(picture), *stretch)
    svg = picture.read_text()
    for terminal in "ABCD":
        assert f"<title>X {terminal}: 4 / 4 ms</title>" in svg
        assert f"<title>Y {terminal}: 6 / 6 ms</title>" in svg
    assert "spindle" not in svg
    dark = tmp_path / "dark.svg"
    camtool("signals", str(line), *AT_3_MS, "-o", str(dark), *stretch, "--dark")
    assert dark.read_text() != svg
    assert re.sub('"#[0-9a-f]{6}"', "", dark.read_text()) == re.sub('"#[0-9a-f]{6}"', "", svg)


def test_several_files_at_once(camtool: Run, line: Path, tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("a.vcd", "a.csv", "a.png")]
    outputs = [word for file in files for word in ("-o", str(file))]
    assert camtool("signals", str(line), *AT_3_MS, *outputs).returncode == 0
    assert files[0].read_text().startswith("$comment line.nc $end\n$timescale 1 ms $end\n")
    assert files[1].read_text().startswith("time_ms,0x378,0xBC00,x,y,z,spindle,block\n0,0,0,")
    assert files[2].read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (("--from", "43s", "-o", "a.csv"), "the program ends after 42.104 s; from 43 s on"),
        (("--from", "43s", "-o", "a.vcd"), "give less than 42.104"),
        (("--from", "-1s", "-o", "a.vcd"), "a stretch from -1 s on is none"),
        (
            ("--from", "1e300", "-o", "a.vcd"),
            "a stretch from 1e+300 s on is none; give 0 to 1e+09",
        ),
        (("--span", "1e300", "-o", "a.csv"), "a stretch of 1e+300 s is none"),
        (("--span", "0s", "-o", "a.svg"), "a stretch of 0 s is none; give more than 0"),
        (("-o", "a.svg", "--span", "42s"), "changes are more than a picture shows, 20,000"),
        (("-o", "a.svg", "--motors", "X,W"), "there is no motor 'W'; use X, Y, Z, spindle"),
        (("-o", "a.txt"), "ends in none of .vcd, .csv, .svg, .png"),
        (("-o", "nowhere/a.vcd"), "does not exist; make it first"),
        (("--span", "1s"), "--from and --span are for files"),
        (("-o", "a.vcd", "--motors", "X"), "are for pictures"),
        (("-o", "a.vcd", "-o", "a.vcd"), "is asked for twice"),
    ],
)
def test_what_cannot_be(
    camtool: Run, line: Path, tmp_path: Path, flags: tuple[str, ...], message: str
) -> None:
    result = camtool("signals", str(line), *AT_3_MS, *flags)
    assert result.returncode == 2
    assert message in result.stderr.decode()
    assert [file.name for file in tmp_path.iterdir()] == ["line.nc"]


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("linuxcnc", "linuxcnc has no signals: its program has no steps"),
        ("matlab-router", "matlab-router has no signals: its slaves turn DC motors"),
    ],
)
def test_targets_without_steps(camtool: Run, tmp_path: Path, target: str, message: str) -> None:
    program = tmp_path / "a.txt"
    program.write_text("G21\n")
    result = camtool("signals", str(program), "-t", target, "-o", str(tmp_path / "a.vcd"))
    assert result.returncode == 2
    assert message in result.stderr.decode()


def test_a_machine_on_the_exact_path_has_none(camtool: Run, line: Path) -> None:
    result = camtool("signals", str(line), "-t", "flashcut", "--set", "controller={model='path'}")
    assert "signals need the model of the real controller" in result.stderr.decode()


def test_an_arc_without_an_end_has_none(camtool: Run, tmp_path: Path) -> None:
    """By the reading "equal" the arc goes round for ever."""
    program = tmp_path / "a.pic"
    program.write_text("G00X00010.00Y00000.00;G02X00000.00Y-00010.30I00000.00J00000.20F08;M30;")
    flags = ("-t", "pic-mmh", "--set", "controller.arc_end=equal", "-o", str(tmp_path / "a.vcd"))
    result = camtool("signals", str(program), *flags)
    assert result.returncode == 2
    assert "block 2: the controller never finds the end of this arc" in result.stderr.decode()
    assert not (tmp_path / "a.vcd").exists()
