"""The first use of a controller of machines of any size: what is said, and that it helps."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.cli.conftest import ROOT, Run

GRBL = ("-t", "grbl", "--no-verify", "-o", "a.nc")


def _drawn(path: Path, width: float, height: float) -> Path:
    path.write_text(f"0,0\n{width},0\n{width},{height}\n0,{height}\n0,0\n")
    return path


def test_a_feed_above_the_placeholder_is_lowered_with_a_warning(
    camtool: Run, tmp_path: Path
) -> None:
    drawing = _drawn(tmp_path / "a.csv", 30, 20)
    done = camtool("post", drawing, *GRBL, "--feed", "800")
    assert done.returncode == 0, done.stderr
    (line,) = (row for row in done.stderr.decode().splitlines() if "FEED_ABOVE_LIMIT" in row)
    assert line.startswith("camtool: warning ")
    named = "--set axes.x.max_rate_mm_min=800 --set axes.y.max_rate_mm_min=800"
    assert named in line
    assert b" F500" in (tmp_path / "a.nc").read_bytes()
    done = camtool("post", drawing, *GRBL, "--feed", "800", *named.split())
    assert b"FEED_ABOVE_LIMIT" not in done.stderr
    assert b" F800" in (tmp_path / "a.nc").read_bytes()


def test_what_is_advised_against_too_little_travel_helps(camtool: Run, tmp_path: Path) -> None:
    drawing = _drawn(tmp_path / "a.csv", 300, 150)
    done = camtool("post", drawing, *GRBL, "--origin", "lower-left")
    assert done.returncode == 1
    assert b"--origin lower-left" not in done.stderr
    assert b"--set axes.x.travel_mm=300" in done.stderr
    assert b"camtool init NAME -t grbl" in done.stderr
    done = camtool("post", drawing, *GRBL, "--set", "axes.x.travel_mm=300")
    assert done.returncode == 0, done.stderr
    done = camtool("post", drawing, *GRBL, "--depth", "198", "--set", "axes.x.travel_mm=300")
    assert done.returncode == 1
    assert b"lower safe_z or the depth" in done.stderr
    assert b"lower-left" not in done.stderr


@pytest.mark.parametrize("target", ["grbl", "linuxcnc"])
def test_numbers_of_no_machine_are_called_placeholders(
    camtool: Run, tmp_path: Path, target: str
) -> None:
    drawing = _drawn(tmp_path / "a.csv", 30, 20)
    post = ("post", drawing, "-t", target, "-o", "a.nc")
    every = b"machine    travel, rates, accelerations and backlash are placeholders: camtool init"
    assert every in camtool(*post).stderr
    done = camtool(*post, "--set", "axes.x.backlash_mm=0.1")
    assert every in done.stderr
    axes = "".join(f"[axes.{axis}]\ntravel_mm = 300\nmax_rate_mm_min = 1000\n" for axis in "xyz")
    (tmp_path / "mine.toml").write_text(f'extends = "{target}"\n{axes}')
    some = b"accelerations and backlash are placeholders: give them in your machine's file"
    assert some in camtool(*post, "--machine", "mine.toml").stderr
    fast = [f"--set=axes.{axis}.acceleration_mm_s2=30" for axis in "xyz"]
    one = b"backlash is a placeholder: camtool coupon lines"
    assert one in camtool(*post, "--machine", "mine.toml", *fast).stderr
    tight = [f"--set=axes.{axis}.backlash_mm=0.01" for axis in "xyz"]
    done = camtool(*post, "--machine", "mine.toml", *fast, *tight)
    assert b"placeholder" not in done.stderr
    assert (
        b"placeholders" not in camtool("post", drawing, "-t", "pic-mmh", "--fit", "3x2mm").stderr
    )


@pytest.mark.parametrize("target", ["grbl", "linuxcnc", "pic-mmh", "i8751", "valcnc"])
def test_a_new_machine_file_asks_for_the_backlash_of_every_axis(camtool: Run, target: str) -> None:
    text = camtool("targets", "new", "mine", "--extends", target, "-o", "-").stdout.decode()
    for axis in "xyz":
        table = text.split(f"\n[axes.{axis}]")[1].split("\n[")[0]
        assert table.count("backlash_mm =") == 1
    if target in ("grbl", "linuxcnc"):
        rows = [row[2:] if row.startswith("# backlash_mm") else row for row in text.splitlines()]
        assert tomllib.loads("\n".join(rows))["axes"]["x"]["backlash_mm"] == 0.0


def test_a_drawing_is_shown_as_it_is_though_there_is_a_machine(
    camtool: Run, tmp_path: Path
) -> None:
    _drawn(tmp_path / "a.csv", 30, 20)
    (tmp_path / "camtool.toml").write_text('target = "grbl"\n')

    def groups(*flags: str) -> set[str]:
        assert camtool("preview", *flags, "-o", "a.svg").returncode == 0
        return set(re.findall(r'<g id="([a-z]+)"', (tmp_path / "a.svg").read_text()))

    assert "drawing" in groups("a.csv")
    assert "feeds" not in groups("a.csv")
    for flags in (("-t", "grbl"), ("--depth", "1mm"), ("--set", "axes.x.travel_mm=300")):
        assert "feeds" in groups("a.csv", *flags)
    assert "feeds" in groups("a.csv", "--simulate")
    assert camtool("post", "a.csv", "-o", "a.nc").returncode == 0
    assert "feeds" in groups("a.nc")


def test_a_checkout_that_is_not_built_says_so(camtool: Run, tmp_path: Path) -> None:
    _drawn(tmp_path / "a.csv", 3, 2)
    left_out = shutil.ignore_patterns("*.so", "*.pyd", "__pycache__")
    shutil.copytree(ROOT / "camtool", tmp_path / "camtool", ignore=left_out)
    line = [sys.executable, "-m", "camtool", "post", "a.csv", "-t", "grbl", "-o", "a.nc"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "the kernels of this checkout are not compiled" in done.stderr
    assert "pip install --editable ." in done.stderr
    assert "fault" not in done.stderr
