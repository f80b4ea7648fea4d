"""`camtool touch`: what virtual machines with a part under their probe say of it, and where their
part zero is then."""

from __future__ import annotations

import json
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from camtool_postprocessors.grbl.twin import GrblTwin
from camtool_postprocessors.linuxcnc.twin import LinuxcncTwin

from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.twin import Clock, PseudoTerminal, serve
from camtool.target.registry import load_target
from camtool.target.twin import Twin
from tests.commands import run_camtool
from tests.sending.test_ends import hosted

SPEED = 200.0
NEAR = 0.006
"""A step of grbl's is 4 µm."""

BLOCK = ("probe_mm=1", "probe_block=6,4,26,14", "probe_radius=1.5")


@contextmanager
def part(*choices: str, name: str = "grbl") -> Iterator[tuple[Twin, str]]:
    """A machine whose tool stands at 0, and its port."""
    twin = load_target(name).twin(choices)
    with hosted(twin, SPEED) as port:
        yield twin, port


def run(port: str, *words: str, name: str = "grbl") -> tuple[int, dict[str, Any], str]:
    """Touch; the exit code, what was measured, and what was said."""
    line = ["touch", *words, "-t", name, "--port", port, "--yes", "--json"]
    done = run_camtool(*line)
    return done.returncode, json.loads(done.stdout or "{}"), done.stderr


def zero_of(twin: Twin) -> list[float]:
    """Where part zero is on the machine, as the twin says."""
    if isinstance(twin, LinuxcncTwin):
        return list(map(float, twin._zero))
    assert isinstance(twin, GrblTwin)
    return list(map(float, twin._memory.frames[0]))


BOTH = pytest.mark.parametrize("name", ["grbl", "linuxcnc"])


@BOTH
def test_a_plate_gives_z(name: str) -> None:
    with part("probe_mm=-3", name=name) as (twin, port):
        words = ["plate", "--thickness", "1.6mm", "--back", "0.5mm"]
        code, measured, said = run(port, *words, name=name)
    assert code == 0, said
    assert measured["top_z_mm"] == pytest.approx(-3.0, abs=NEAR)
    assert measured["z_mm"] == pytest.approx(-4.6, abs=NEAR)
    assert zero_of(twin)[2] == pytest.approx(-4.6, abs=NEAR)
    assert twin.slides.commanded_mm == pytest.approx([0.0, 0.0, 0.0], abs=NEAR)


def test_an_edge_gives_its_axis_and_the_coordinate_that_is_wanted() -> None:
    with part(*BLOCK, "probe_block=6,-5,26,5") as (twin, port):
        words = ["edge", "X2.5", "--towards", "x+", "--tool-diameter", "3mm"]
        code, measured, said = run(port, *words)
    assert code == 0, said
    assert measured["x_mm"] == pytest.approx(6.0, abs=NEAR)
    assert zero_of(twin) == pytest.approx([3.5, 0.0, 0.0], abs=NEAR)


def test_an_edge_without_a_zero_changes_nothing() -> None:
    with part(*BLOCK, "probe_block=6,-5,26,5") as (twin, port):
        words = ["edge", "--towards", "x+", "--tool-diameter", "3mm", "--keep-zero"]
        code, measured, _ = run(port, *words)
    assert (code, measured["zero"]) == (0, False)
    assert zero_of(twin) == [0.0, 0.0, 0.0]
    assert not any(b"G10" in line for line in twin.decoded)


@pytest.mark.parametrize(("sx", "sy"), [(1, 1), (-1, 1), (1, -1), (-1, -1)])
def test_each_outside_corner(sx: int, sy: int) -> None:
    x, y = sorted((sx * 6.0, sx * 26.0)), sorted((sy * 4.0, sy * 14.0))
    block = f"probe_block={x[0]},{y[0]},{x[1]},{y[1]}"
    way = f"x{'+' if sx > 0 else '-'}y{'+' if sy > 0 else '-'}"
    with part("probe_mm=1", block, "probe_radius=1.5") as (twin, port):
        words = ["corner", "--towards", way, "--tool-diameter", "3mm", "--along", "9mm"]
        code, measured, said = run(port, *words)
    assert code == 0, said
    assert [measured["x_mm"], measured["y_mm"]] == pytest.approx([sx * 6.0, sy * 4.0], abs=NEAR)
    assert zero_of(twin)[:2] == pytest.approx([sx * 6.0, sy * 4.0], abs=NEAR)
    assert twin.slides.commanded_mm == pytest.approx([0.0, 0.0, 0.0], abs=NEAR)


def test_an_inside_corner() -> None:
    # A bore so wide that its wall is flat within the tolerance would be one way; two walls of a
    # block that is turned by 90° about its corner are another: the tool stands in their angle.
    with part("probe_mm=1", "probe_bore=0,0,12", "probe_radius=1") as (_, port):
        words = ["corner", "--inside", "--towards", "x+y-", "--tool-diameter", "2mm"]
        code, measured, said = run(port, *words)
    assert code == 0, said
    assert [measured["x_mm"], measured["y_mm"]] == pytest.approx([6.0, -6.0], abs=NEAR)


@BOTH
def test_a_bore_gives_its_centre_and_diameter(name: str) -> None:
    hole = ("probe_mm=1", "probe_bore=1.25,-0.8,12", "probe_radius=1")
    with part(*hole, name=name) as (twin, port):
        words = ["bore", "--tool-diameter", "2mm", "--reach", "20mm"]
        code, measured, said = run(port, *words, name=name)
    assert code == 0, said
    assert measured["diameter_mm"] == pytest.approx(12.0, abs=2 * NEAR)
    assert [measured["x_mm"], measured["y_mm"]] == pytest.approx([1.25, -0.8], abs=NEAR)
    assert zero_of(twin)[:2] == pytest.approx([1.25, -0.8], abs=NEAR)
    assert twin.slides.commanded_mm[:2] == pytest.approx([1.25, -0.8], abs=NEAR)


@BOTH
def test_a_boss_gives_its_centre_and_diameter(name: str) -> None:
    boss = ("probe_mm=-2", "probe_round=0.7,-1.1,10", "probe_radius=1.5")
    with part(*boss, name=name) as (twin, port):
        words = ["boss", "X100", "Y50", "--tool-diameter", "3mm", "--size", "11mm"]
        words += ["--depth", "4mm", "--reach", "12mm"]
        code, measured, said = run(port, *words, name=name)
    assert code == 0, said
    assert measured["diameter_mm"] == pytest.approx(10.0, abs=2 * NEAR)
    assert [measured["x_mm"], measured["y_mm"]] == pytest.approx([0.7, -1.1], abs=NEAR)
    assert zero_of(twin)[:2] == pytest.approx([-99.3, -51.1], abs=NEAR)
    assert twin.slides.commanded_mm == pytest.approx([0.7, -1.1, 0.0], abs=NEAR)


@pytest.mark.parametrize("towards", ["y+", "x+"])
@pytest.mark.parametrize("along", [12.0, -12.0])
def test_the_angle_of_a_side(towards: str, along: float) -> None:
    block = "probe_block=-60,5,60,20" if towards == "y+" else "probe_block=5,-60,20,60"
    with part("probe_mm=1", block, "probe_turn_deg=1.5") as (twin, port):
        words = ["skew", "--towards", towards, "--along", f"{along}mm"]
        code, measured, said = run(port, *words)
    assert code == 0, said
    assert measured["angle_deg"] == pytest.approx(1.5, abs=0.04)
    assert re.search(r"--turn -?1\.\d+", said)
    assert zero_of(twin) == [0.0, 0.0, 0.0]


@BOTH
def test_nothing_that_is_touched_is_said_and_the_tool_goes_back(name: str) -> None:
    with part("probe_mm=-30", name=name) as (twin, port):
        words = ["plate", "--thickness", "1mm", "--reach", "5mm"]
        code, measured, said = run(port, *words, name=name)
    assert code == 1
    assert "nothing was touched between Z0.000 and -5.000" in measured["why"]
    assert "did not touch" in said
    assert twin.slides.commanded_mm == pytest.approx([0.0, 0.0, 0.0], abs=NEAR)
    assert zero_of(twin) == [0.0, 0.0, 0.0]


@BOTH
def test_a_probe_that_touches_before_it_moves(name: str) -> None:
    with part("probe_mm=1", name=name) as (twin, port):
        code, _, said = run(port, "plate", "--thickness", "1mm", name=name)
    assert code == 1
    assert "touches already" in said
    assert not twin.decoded


def test_a_touch_on_the_way_stops_there() -> None:
    wall = ("probe_mm=1", "probe_block=-2,3,40,9", "probe_radius=1.5")
    with part(*wall) as (twin, port):
        words = ["corner", "--towards", "x+y+", "--tool-diameter", "3mm", "--along", "8mm"]
        code, _, said = run(port, *words)
    assert code == 1
    assert "touched on its way" in said
    assert twin.slides.commanded_mm[1] < 2.0
    assert zero_of(twin) == [0.0, 0.0, 0.0]


def test_too_near_is_said() -> None:
    with part("probe_mm=-0.4") as (twin, port):
        code, _, said = run(port, "plate", "--thickness", "1mm")
    assert code == 1
    assert "nearer than the 1 mm" in said
    assert twin.slides.commanded_mm[2] == pytest.approx(0.0, abs=NEAR)


def test_the_journal_has_each_touch(tmp_path: Path) -> None:
    file = tmp_path / "touch.journal"
    with part("probe_mm=-3") as (_, port):
        words = ["plate", "--thickness", "1mm", "--journal", str(file)]
        assert run(port, *words)[0] == 0
    with part("probe_mm=-30") as (_, port):
        assert run(port, *words)[0] == 1
    rows = [json.loads(row) for row in file.read_text().splitlines()]
    first, second = rows[:5], rows[5:]
    assert [set(row) & {"touch", "zero", "end"} for row in first] == [
        set(), {"touch"}, {"touch"}, {"zero"}, {"end"}
    ]  # fmt: skip
    assert first[2]["at"][2] == pytest.approx(-3.0, abs=NEAR)
    assert first[4]["z_mm"] == pytest.approx(-4.0, abs=NEAR)
    assert second[-1]["end"] == "failed"
    assert "nothing was touched" in second[-1]["why"]


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["plate"], "--thickness"),
        (["edge", "--tool-diameter", "3mm"], "--towards"),
        (["edge", "--towards", "x+"], "--tool-diameter"),
        (["edge", "--towards", "x+y+", "--tool-diameter", "3mm"], "--towards"),
        (["corner", "--towards", "z+", "--tool-diameter", "3mm"], "--towards"),
        (["boss", "--tool-diameter", "3mm", "--depth", "3mm"], "--size"),
        (["plate", "X1", "--thickness", "1mm"], "has no X"),
        (["plate", "--thickness", "1mm", "--reach", "0"], "--reach"),
        (["skew", "--towards", "x+", "--along", "0"], "--along"),
        (["corner", "--towards", "x+y+", "--along", "-3", "--tool-diameter", "3"], "--along"),
        (["plate", "--thickness", "1e308"], "--thickness"),
        (["plate", "--thickness", "1mm", "--reach", "1e300"], "--reach"),
        (["plate", "--thickness", "1mm", "--feed", "1e300"], "--feed"),
        (["plate", "--thickness", "1mm", "--slow", "1e-9"], "--slow"),
        (["plate", "Z1e300", "--thickness", "1mm"], "Z1e+300"),
        (["bore", "--tool-diameter", "1e100"], "--tool-diameter"),
    ],
)
def test_what_is_missing_is_said_before_the_port_is_opened(words: list[str], named: str) -> None:
    code, _, said = run("/dev/null/no", *words)
    assert code == 2
    assert named in said


# Faults of the line, in conversations without a port.


class Deaf(GrblTwin):
    """A grbl whose reports of its probe come otherwise."""

    report: str | None = None

    def _probe_report(self) -> str:
        return super()._probe_report() if self.report is None else self.report


@pytest.mark.parametrize(
    ("report", "why"),
    [
        ("", "its report is lost"),
        ("[PRB:0.000,0.000,-3", "it cannot have meant"),
        ("[PRB:0.000,7.000,-3.000:1]\r\n", "touched at Y7.000"),
        ("[PRB:0.000,0.000,-83.000:1]\r\n", "touched at Z-83.000"),
        ("[PRB:0.000,0.000,-3.000:1]\r\n[PRB:0.000,0.000,-3.000:1]\r\n", ""),
    ],
)
def test_a_report_that_is_lost_or_garbled_sets_no_zero(report: str, why: str) -> None:
    loaded = load_target("grbl")
    settings = loaded.target.twin_kind().settings(probe_mm=-3.0)
    twin = Deaf(loaded.machine, settings)
    twin.report = report
    with hosted(twin, SPEED) as port:
        code, measured, said = run(port, "plate", "--thickness", "1mm")
    assert code == (1 if why else 0), said
    assert why in measured["why"]
    assert zero_of(twin)[2] == pytest.approx(0.0 if why else -4.0, abs=NEAR)


def test_a_port_that_vanishes_sets_no_zero() -> None:
    twin = load_target("grbl").twin(["probe_mm=-9"])
    port, wired = PseudoTerminal(), WiredTwin(twin, Faults.of("unplug=60s"))

    def host() -> None:
        serve(wired, port, Clock(20.0))
        port.close()

    thread = threading.Thread(target=host)
    thread.start()
    code, measured, said = run(port.name, "plate", "--thickness", "1mm", "--feed", "5")
    thread.join()
    assert code == 1, said
    assert "the port is gone" in measured["why"] or "does not answer" in measured["why"]
    assert zero_of(twin) == [0.0, 0.0, 0.0]
