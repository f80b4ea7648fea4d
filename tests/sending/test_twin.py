"""`camtool twin` on real pseudo-terminals and TCP ports, with the simplest of feeders."""

from __future__ import annotations

import csv
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import serial

from camtool.cli.twin import parse_address, parse_speed
from camtool.errors import OptionError
from tests.feeding import logo, made, motion
from tests.waiting import HANG_S

BANNER = b"Grbl 1.1h ['$' for help]\r\n"


@contextmanager
def running(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """`camtool twin` as a process, and what it says one can open."""
    command = [sys.executable, "-m", "camtool", "twin", *arguments]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as it:
        assert it.stdout is not None
        try:
            yield it, it.stdout.readline().strip()
        finally:
            it.terminate()


def feed_grbl(port: serial.SerialBase, program: bytes) -> None:
    assert BANNER in port.read_until(BANNER)
    for line in program.splitlines():
        if line.strip():
            port.write(line + b"\n")
            answer = port.read_until(b"\r\n")
            answer = port.read_until(b"\r\n") if answer.startswith(b"[") else answer
            assert answer == b"ok\r\n", line


def traced(file: Path) -> list[list[float]]:
    with file.open(newline="") as rows:
        return [[float(value) for value in row] for row in list(csv.reader(rows))[1:]]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
def test_the_logo_over_a_pseudo_terminal(tmp_path: Path) -> None:
    program, file = logo("grbl"), tmp_path / "slides.csv"
    wanted = motion(program, made("grbl")[1])
    with running("grbl", "--speed", "max", "--once", "--trace", str(file)) as (it, name):
        with serial.Serial(name, 115200, timeout=HANG_S) as port:
            feed_grbl(port, program)
        assert it.wait(HANG_S) == 0
    rows = traced(file)
    assert [row[2:5] for row in rows] == wanted.commanded.tolist()
    assert [row[5:] for row in rows] == wanted.slide.tolist()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
def test_a_program_of_echoes_over_a_pseudo_terminal(tmp_path: Path) -> None:
    block, file = b"G01X00014.00Y00007.00F08;", tmp_path / "slides.csv"
    outputs = len(motion(block, made("pic-mmh")[1]))
    with running("pic-mmh", "--speed", "max", "--once", "--trace", str(file)) as (it, name):
        with serial.Serial(name, 9600, timeout=HANG_S) as port:
            port.write(block)
            assert port.read(len(block)) == block
            assert len(port.read(outputs)) == outputs
        assert it.wait(HANG_S) == 0
    assert len(traced(file)) == outputs


def test_tcp_is_on_loopback_and_serves_one_client_after_another() -> None:
    with running("grbl", "--tcp", "0", "--speed", "max") as (_, name):
        assert name.startswith("socket://127.0.0.1:")
        for place in (b"1.000", b"2.000"):
            with serial.serial_for_url(name, timeout=HANG_S) as port:
                feed_grbl(port, b"G1X%sF500\nG4P0.01\n" % place)
                port.write(b"?")
                assert b"MPos:" + place in port.read_until(b"\r\n")


def test_a_plug_that_is_pulled_ends_it() -> None:
    with running("grbl", "--tcp", "0", "--fault", "unplug=100ms") as (it, _):
        assert it.wait(HANG_S) == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["flashcut"], "parallel port"),
        (["grbl", "--assume", "homing=perhaps"], "homing=off|on"),
        (["grbl", "--fault", "loud"], "is no fault"),
        (["grbl", "--speed", "0"], "no factor"),
        (["grbl", "--tcp", "x"], "no port"),
        (["nobody"], "unknown target"),
    ],
)
def test_wrong_use_is_one_line(arguments: list[str], words: str) -> None:
    made_of = [sys.executable, "-m", "camtool", "twin", *arguments]
    result = subprocess.run(made_of, capture_output=True, text=True, timeout=HANG_S)
    assert result.returncode == 2
    assert words in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_values_of_flags() -> None:
    assert (parse_speed("max"), parse_speed("2.5")) == (None, 2.5)
    assert parse_address("5007") == ("127.0.0.1", 5007)
    assert parse_address("[::1]:7") == ("::1", 7)
    for wrong in ("nan", "-1", "inf", "fast"):
        with pytest.raises(OptionError):
            parse_speed(wrong)
