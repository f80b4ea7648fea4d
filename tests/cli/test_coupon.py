"""`camtool coupon`: drawings that every machine can cut, in the order in which they are drawn."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from camtool.calibration.coupons import KINDS
from camtool.target.registry import load_target, target_names
from tests.cli.conftest import Run

ENGRAVE = ("--kind", "engrave", "--start", "longest-line", "--gap", "0")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("target", [*target_names()])
def test_every_machine_can_cut_it(
    camtool: Run, samples: Path, tmp_path: Path, kind: str, target: str
) -> None:
    machine = ("--machine", samples / "i8751-sample.toml") if target == "i8751" else ()
    size = ("--size", "40x30mm") if target in ("i8751", "grbl", "linuxcnc", "valcnc") else ()
    drawn = camtool("coupon", kind, "-t", target, *machine, *size)
    assert drawn.returncode == 0, drawn.stderr
    posted = camtool(
        "post", "coupon.dxf", "-t", target, *machine, *ENGRAVE, "--no-verify", "-o", "p"
    )
    assert posted.returncode == 0, posted.stderr
    assert b"error" not in posted.stderr
    assert b"GAP_OPEN" not in posted.stderr
    assert (tmp_path / "p").stat().st_size > 100


@pytest.mark.parametrize("target", ["pic-mmh", "flashcut", "grbl"])
def test_lines_are_cut_as_they_are_drawn(camtool: Run, tmp_path: Path, target: str) -> None:
    """The line that is called the first one is cut first."""
    file = tmp_path / "lines.toml"
    camtool("coupon", "lines", "-t", target, "--measurements", file)
    done = camtool("post", "coupon.dxf", "-t", target, *ENGRAVE, "--no-verify", "-o", "p")
    assert done.returncode == 0, done.stderr
    loaded = load_target(target)
    path = loaded.target.read((tmp_path / "p").read_bytes(), loaded.machine)
    for table in tomllib.loads(file.read_text())["lines"]:
        axis = "xy".index(table["axis"])
        other = path.end[:, 1 - axis]
        way = np.diff(path.end[:, axis], prepend=0.0)
        # The line on the side of part zero goes towards +, the other one back: whole or in halves.
        nominal = table["nominal_mm"]
        share = np.abs(way)[:, None] / np.array([nominal, 0.5 * nominal])
        long = np.flatnonzero(np.isclose(share, 1.0, atol=1e-3).any(axis=1))
        there = [row for row in long if way[row] > 0.0 and other[row] == other[row - 1]]
        back = [row for row in long if way[row] < 0.0 and other[row] == other[row - 1]]
        assert sum(way[there]) == pytest.approx(nominal, abs=2e-3)
        assert sum(way[back]) == pytest.approx(-nominal, abs=2e-3)
        assert max(other[there]) < min(other[back])


def test_svg_stdout_and_size(camtool: Run, tmp_path: Path) -> None:
    done = camtool("coupon", "squares", "--size", "2x1.5in", "-o", "a.svg")
    assert done.returncode == 0, done.stderr
    assert b'width="50.8mm" height="38.1mm"' in (tmp_path / "a.svg").read_bytes()
    piped = camtool("coupon", "squares", "-o", "-", "-q")
    assert piped.stdout.endswith(b"EOF\n")
    assert piped.stderr == b""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("triangles",), b"is not one of"),
        (("lines", "-o", "a.png"), b"neither .dxf nor .svg"),
        (("lines", "--size", "40"), b"write it like 40x30mm"),
        (("lines", "--size", "40x30furlong"), b"unknown unit"),
        (("lines", "--size", "0x30"), b"has no area"),
        (("lines", "--regions", "3"), b"write it like 3x2"),
        (("lines", "--regions", "30x1"), b"give 1 to 9"),
        (("steps", "--regions", "3x1"), b"leave --regions out"),
        (("lines", "-t", "pic-mmh", "--size", "0.5x0.5mm"), b"do not fit"),
        (("lines", "-t", "i8751"), b"key is missing"),
        (("lines", "-o", "no/a.dxf"), b"does not exist"),
    ],
)
def test_wrong_use_says_what_to_do(
    camtool: Run, tmp_path: Path, arguments: tuple[str, ...], words: bytes
) -> None:
    done = camtool("coupon", *arguments)
    assert done.returncode == 2
    assert words in done.stderr, done.stderr
    assert not list(tmp_path.iterdir())


def test_filled_in_measurements_are_not_overwritten(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text("mine")
    done = camtool("coupon", "lines", "--measurements", "m.toml")
    assert done.returncode == 2
    assert b"exists already" in done.stderr
    assert (tmp_path / "m.toml").read_text() == "mine"
    assert not (tmp_path / "coupon.dxf").exists()
