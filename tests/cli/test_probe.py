"""`camtool probe`: the top of a blank that lies aslant, by the probe of a virtual grbl; and the
program that follows it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import ezdxf
import numpy as np
import pytest

from camtool.target.registry import load_target
from camtool.toolpath.surface import surface_of_text
from tests.commands import run_camtool
from tests.sending.test_ends import hosted

PROGRAM = b"""G21 G90
M3 S1000
G0 X2 Y1 Z3
G1 Z-0.2 F100
X22 Y1
G3 X22 Y11 I0 J5
G1 X2
G0 Z3
M5
M30
"""
SPEED = 200.0
SLOPES = "probe_slope_x=0.01", "probe_slope_y=-0.02"


@contextmanager
def blank(*choices: str) -> Iterator[str]:
    """The port of a grbl whose blank begins 0.5 mm below its place, with a fast clock."""
    with hosted(load_target("grbl").twin(["probe_mm=-0.5", *choices]), SPEED) as port:
        yield port


@pytest.fixture
def program(tmp_path: Path) -> Path:
    file = tmp_path / "part.nc"
    file.write_bytes(PROGRAM)
    return file


def run(*words: str) -> tuple[int, str]:
    done = run_camtool(*words)
    return done.returncode, done.stderr


def test_the_surface_is_that_of_the_blank(program: Path) -> None:
    with blank(*SLOPES) as port:
        code, said = run("probe", str(program), "-t", "grbl", "--port", port, "--yes")
    assert code == 0, said
    surface = surface_of_text(program.with_suffix(".surface.csv").read_text(), "")
    assert surface.x == pytest.approx([2.0, 10.333, 18.667, 27.0], abs=1e-2)
    assert surface.y == pytest.approx([1.0, 11.0])
    wanted = -0.5 + 0.01 * surface.x[None, :] - 0.02 * surface.y[:, None]
    assert surface.z == pytest.approx(wanted, abs=0.006)  # a step is 4 µm
    out = program.with_name("follows.nc")
    words = ["convert", str(program), "--from", "grbl", "--to", "grbl", "-o", str(out)]
    code, said = run(*words, "--surface", str(program.with_suffix(".surface.csv")))
    assert code == 0, said
    target = load_target("grbl")
    decoded = target.target.read(out.read_bytes(), target.machine)
    cuts = decoded.end[decoded.is_feed][1:]
    assert cuts[:, 2] == pytest.approx(-0.2 - 0.5 + cuts[:, :2] @ [0.01, -0.02], abs=0.01)


def test_holes_are_not_probed(program: Path, tmp_path: Path) -> None:
    drawing = ezdxf.new(units=4)
    drawing.modelspace().add_circle((10.5, 1.0), 2.0)
    drawing.saveas(tmp_path / "holes.dxf")
    with blank() as port:
        words = ["probe", str(program), "-t", "grbl", "--port", port, "--yes", "--step", "5"]
        code, said = run(*words, "--holes", str(tmp_path / "holes.dxf"))
    assert code == 0, said
    text = program.with_suffix(".surface.csv").read_text()
    surface = surface_of_text(text, "")
    count = int(said.split(" points")[0].split()[-1])
    beside = np.hypot(surface.x[None, :] - 10.5, surface.y[:, None] - 1.0) > 3.0
    assert 0 < count == beside.sum() < surface.z.size
    assert surface.z == pytest.approx(np.full(surface.z.shape, -0.5), abs=0.006)


def test_clamps_are_not_probed_nor_run_into(program: Path, tmp_path: Path) -> None:
    job = tmp_path / "job.toml"
    table = '[[keep_out]]\nname = "clamp"\nx = "9..12mm"\ny = "0..3mm"\nz = "..{top}mm"\n'
    with blank() as port:
        words = ["probe", str(program), "-t", "grbl", "--port", port, "--yes", "--step", "5"]
        words += ["--job", str(job), "--json"]
        job.write_text(table.format(top=4))
        code, said = run(*words)
        assert code == 2, said
        assert "leads through 'clamp', whose top is at Z4" in said
        assert not program.with_suffix(".surface.csv").exists()
        job.write_text(table.format(top=1.5))
        code, said = run(*words)
    assert code == 0, said
    surface = surface_of_text(program.with_suffix(".surface.csv").read_text(), "")
    left_out = [(x, y) for x in surface.x for y in surface.y if 8 <= x <= 13 and -1 <= y <= 4]
    assert len(left_out) == 1
    count = int(said.split(" points")[0].split()[-1])
    assert count == surface.z.size - len(left_out)


def test_a_blank_that_is_not_reached_is_said(program: Path) -> None:
    with blank() as port:
        words = ["probe", str(program), "-t", "grbl", "--port", port, "--yes"]
        code, said = run(*words, "--lowest", "-0.3mm")
    assert code == 1, said
    assert "did not touch" in said
    assert not program.with_suffix(".surface.csv").exists()


def test_a_machine_without_a_probe_says_so(tmp_path: Path) -> None:
    file = tmp_path / "part.pic"
    file.write_bytes(b"G01X00100.00Y00000.00F08;")
    code, said = run("probe", str(file), "-t", "pic-mmh", "--port", "/dev/null", "--yes")
    assert code == 2
    assert "no command to probe" in said


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--step", "1e-300"], "--step"),
        (["--step", "0.05"], "points"),
        (["--clear", "1e308"], "--clear"),
        (["--feed", "1e308"], "--feed"),
        (["--feed", "0.01"], "--feed"),
        (["--margin", "1e308"], "--margin"),
        (["--lowest", "3mm"], "--lowest"),
    ],
)
def test_numbers_out_of_range_are_refused(program: Path, words: list[str], named: str) -> None:
    code, said = run("probe", str(program), "-t", "grbl", "--port", "/dev/null", "--yes", *words)
    assert code == 2, said
    assert named in said.partition("camtool: error: ")[2]
