"""`camtool convert`: programs from one machine to another."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Run

MACHINES = {"i8751": ("i8751-sample.toml",)}
HOW = {"matlab-router": ["controller.machine_zero_mm=[0,0,9.98]"]}  # its Z falls 10 mm, always
FAST = [f"axes.{axis}.max_rate_mm_min=20000.0" for axis in "xyz"]  # valcnc cuts at one speed
NAMES = ("flashcut", "grbl", "i8751", "linuxcnc", "matlab-router", "pic-mmh", "valcnc")
RESOLUTION_MM = {"matlab-router": 0.2, "i8751": 0.2}
COUPON = "G21 G90 G17\nG0 X2 Y2 Z1\nG1 Z-0.02 F0.8\nX6\nG3 X6 Y6 I0 J2\nG1 X2\nY2\nG0 Z1\nM2\n"


def machine_flags(name: str, samples: Path, before: str = "--") -> list[str | Path]:
    files = [
        part for file in MACHINES.get(name, ()) for part in (f"{before}machine", samples / file)
    ]
    return [*files, *(part for value in HOW.get(name, ()) for part in (f"{before}set", value))]


@pytest.fixture
def coupon(tmp_path: Path) -> Path:
    file = tmp_path / "coupon.nc"
    file.write_text(COUPON)
    return file


@pytest.mark.parametrize("name", NAMES)
def test_from_grbl_to_each_and_back(
    camtool: Run, coupon: Path, samples: Path, tmp_path: Path, name: str
) -> None:
    there = tmp_path / "there.prg"
    done = camtool(
        "convert",
        coupon,
        "--from",
        "grbl",
        "--to",
        name,
        *machine_flags(name, samples),
        "-o",
        there,
    )
    assert done.returncode == 0, done.stderr
    back = camtool(
        *("convert", there, "--from", name, "--to", "grbl", "-o", "back.nc", "--json", "-"),
        *machine_flags(name, samples, "--from-"),
        *(part for value in FAST for part in ("--set", value)),
    )
    assert back.returncode == 0, back.stderr
    size = json.loads(back.stdout)["extents_mm"]
    slack = RESOLUTION_MM.get(name, 0.02)
    assert size["x"] == pytest.approx([0.0, 8.0], abs=slack)
    assert size["y"] == pytest.approx([0.0, 6.0], abs=slack)


def test_a_feed_can_take_the_place_of_one_that_is_too_fast(camtool: Run) -> None:
    program = COUPON.replace("F0.8", "F400").encode()
    common = ("convert", "-", "--from", "grbl", "--to", "pic-mmh")
    slowed = camtool(*common, stdin=program)
    assert slowed.returncode == 0, slowed.stderr
    assert b"F13;" in slowed.stdout
    assert b"5 cuts of up to 400 mm/min are written at 1.3944" in slowed.stderr
    done = camtool(*common, "--feed", "1.2", stdin=program)
    assert done.returncode == 0, done.stderr
    assert b"F12;" in done.stdout


def test_the_new_program_takes_the_name_of_the_old_one(camtool: Run, coupon: Path) -> None:
    done = camtool("convert", coupon, "--from", "grbl", "--to", "pic-mmh")
    assert done.returncode == 0, done.stderr
    assert (coupon.parent / "coupon.pic").read_bytes().startswith(b"G54;")
    piped = camtool("convert", "-", "--from", "grbl", "--to", "pic-mmh", stdin=COUPON.encode())
    assert piped.stdout == (coupon.parent / "coupon.pic").read_bytes()


def test_a_program_is_not_overwritten_by_its_own_translation(camtool: Run, coupon: Path) -> None:
    done = camtool("convert", coupon, "--from", "grbl", "--to", "flashcut")
    assert done.returncode == 2
    assert b"is the input itself" in done.stderr
    assert coupon.read_text() == COUPON


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"G0 X1\nG1 X2 Yx F1\n", [b"<stdin>", b"block 2"]),
        (b"", [b"<stdin>", b"empty"]),
        (b"G0 X1 Y1\nG91\nG38.2 Z-1 F1\n", [b"block 3"]),
    ],
)
def test_what_cannot_be_read_is_an_error_with_its_place(
    camtool: Run, text: bytes, words: list[bytes]
) -> None:
    done = camtool("convert", "-", "--from", "grbl", "--to", "pic-mmh", stdin=text)
    assert done.returncode == 2
    assert not done.stdout
    for word in words:
        assert word in done.stderr


def test_homing_becomes_a_rapid_for_another_machine(camtool: Run, tmp_path: Path) -> None:
    program = b"G54;\nG90;\nG28X0Y0;\nG01X01000.00Y01000.00F08;\nM30;\n"
    done = camtool("convert", "-", "--from", "pic-mmh", "--to", "linuxcnc", stdin=program)
    assert done.returncode == 0, done.stderr
    assert b"G28" not in done.stdout
    assert b"X1" in done.stdout
