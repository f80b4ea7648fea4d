"""Programs in inches: every length is one, arcs hold, and readers find the same places again."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given

from camtool.errors import MachineError
from camtool.pipeline import post_drawing, verify_program
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.rs274 import interpreted, motions, motions_of, needs_rs274
from tests.postprocessors.gcode.parts import part, toolpaths
from tests.postprocessors.gcode.test_operations import DRAWING, JOB
from tests.postprocessors.golden import GOLDEN, compare_golden
from tests.strategies import examples

TARGETS = ("grbl", "linuxcnc")
LAST_MM = 25.4e-5
"""What the last decimal is worth."""


def inches(name: str, *more: str) -> LoadedTarget:
    return load_target(name, settings=["dialect.units=in", *more])


def lines_of(path: Toolpath, name: str, *more: str) -> list[str]:
    target = inches(name, *more)
    data: bytes = target.target.write(path, target.machine).data
    return data.decode("ascii").splitlines()


@pytest.mark.parametrize("name", TARGETS)
def test_program(name: str, bless: bool) -> None:
    target = inches(name, "dialect.strip_zeros=true")
    run = post_drawing(DRAWING, JOB, target, check=False)
    assert run.program is not None
    file = GOLDEN / f"{name}-inches{run.program.extension}"
    compare_golden(file, run.program.data, bless=bless)


def test_every_length_and_feed_is_in_inches() -> None:
    path = ToolpathBuilder().rapid(z=25.4).rapid(50.8, 0.0).line(z=-2.54, feed=254.0)
    path.arc(50.8, 25.4, centre=(50.8, 12.7), ccw=True, feed=508.0).event(Kind.DWELL, 2.0)
    lines = lines_of(path.rapid(z=25.4).event(Kind.END).finish(), "linuxcnc")
    assert "(inch and inch/min - part zero at X0 Y0 Z0)" in lines
    assert lines[-9:] == [
        "G17 G20 G40 G54 G80 G90 G91.1 G94",
        "G64 P0.0003937",
        "G0 Z1.00000",
        "X2.00000 Y0.00000",
        "G1 Z-0.10000 F10",
        "G3 X2.00000 Y1.00000 I0.00000 J0.50000 F20",
        "G4 P2",
        "G0 Z1.00000",
        "M2",
    ]


@pytest.mark.parametrize("name", TARGETS)
def test_operations_and_stops_speak_inches(name: str) -> None:
    run = post_drawing(DRAWING, JOB, inches(name), check=False)
    assert run.program is not None
    lines = run.program.data.decode().splitlines()
    assert "(tool 1 end mill 0.125 inch - 12000 rev/min)" in lines
    assert "(0.126 inch deep in 3 passes)" in lines
    assert any(line.startswith("(feed 11.811 plunge 3.5433 inch/min - ") for line in lines)
    metric = post_drawing(DRAWING, JOB, load_target(name), check=False)
    assert metric.program is not None
    times = [re.findall(r"takes .+\)", each.program.data.decode())
             for each in (run, metric) if each.program is not None]  # fmt: skip
    assert times[0] == times[1]
    assert len(times[0]) == 3
    if name == "grbl":
        assert "(or set its tip to Z 0.9843 inch here - then start)" in lines
    assert not any(" mm" in line for line in lines)


@pytest.mark.parametrize("name", TARGETS)
@examples(30, 2000)
@given(path=toolpaths())
def test_what_is_read_is_what_was_written(name: str, path: Toolpath) -> None:
    """Each move to half of the last decimal, as many moves, and feeds that are no higher."""
    target = inches(name)
    program = target.target.write(path, target.machine)
    read = target.target.read(program.data, target.machine)
    rows = program.row_of_block[read.block]
    ends = rows >= 0
    ends[:-1] &= rows[1:] != rows[:-1]  # the last of the pieces that an arc may become
    off = np.abs(read.end[ends] - path.end[rows[ends]])
    assert off.max(initial=0.0) <= 0.5 * LAST_MM * (1.0 + 1e-9)
    fed = ends & read.is_feed
    slower = path.feed[rows[fed]] - read.feed[fed]
    assert ((slower >= -1e-9) & (slower < 25.4e-3)).all()
    events = (read.kind > Kind.ARC_CCW) & (rows >= 0)
    assert read.kind[events].tolist() == path.kind[path.kind > Kind.ARC_CCW].tolist()


@pytest.mark.parametrize("name", TARGETS)
def test_such_programs_are_verified_and_hold_against_their_job(name: str) -> None:
    target = inches(name)
    run = post_drawing(DRAWING, JOB, target)
    metric = post_drawing(DRAWING, JOB, load_target(name))
    assert run.report is not None
    assert metric.report is not None
    assert not run.failed
    most, mm = run.report.error_um.total.max, metric.report.error_um.total.max
    assert most is not None
    assert mm is not None
    # A quarter of a micrometre may be one step of the machine more or less.
    assert most <= mm + 1000.0 * (LAST_MM + target.machine.axes.x.coded_step_mm)
    assert run.report.time_s == pytest.approx(metric.report.time_s, rel=1e-3)
    again = verify_program(run.data, target, source="a.nc", drawing=DRAWING, job=JOB)
    assert not again.failed
    there = verify_program(run.data, load_target(name), source="a.nc", drawing=DRAWING, job=JOB)
    assert not there.failed


@pytest.mark.parametrize("name", TARGETS)
def test_own_blocks_are_in_the_unit_of_the_program(name: str) -> None:
    lines = lines_of(part(), name, 'dialect.end_blocks=["G0 Z1.5"]')
    assert "G0 Z1.5" in lines
    with pytest.raises(MachineError, match="they leave the travel of Z"):
        inches(name, 'dialect.end_blocks=["G0 Z15"]')


class TestReferee:
    """LinuxCNC's interpreter finds the places that our readers find."""

    pytestmark = needs_rs274

    @pytest.mark.parametrize("name", TARGETS)
    @examples(15, 2000, suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(path=toolpaths())
    def test_random_programs(self, name: str, path: Toolpath, tmp_path: Path) -> None:
        target = inches(name)
        program = target.target.write(path, target.machine)
        theirs = motions(interpreted(program.data, tmp_path))
        ours = motions_of(target.target.read(program.data, target.machine))
        assert ours[:, 0].tolist() == theirs[:, 0].tolist()
        # rs274 prints four decimals of an inch.
        np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=0.51e-4 * 25.4)

    def test_a_job(self, tmp_path: Path) -> None:
        target = inches("linuxcnc")
        run = post_drawing(DRAWING, JOB, target, check=False)
        assert run.program is not None
        theirs = motions(interpreted(run.program.data, tmp_path))
        ours = motions_of(target.target.read(run.program.data, target.machine))
        np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=0.51e-4 * 25.4)
        assert re.search(rb"^G64 P0.00039", run.program.data, re.MULTILINE)
