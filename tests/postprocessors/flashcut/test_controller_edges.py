"""The parallel-port machine's PC at the edges: moves that are none, limits, bad input."""

import math
from pathlib import Path

import numpy as np
import pytest

from camtool.errors import MachineError, ProgramError
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine
from camtool.simulation.motion import IDEAL, Options
from camtool.tables import read_table
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.motion_rows import RowMotion, rows_of
from tests.targets import build_machine, model_of, simulate

TARGET = Path(__file__).parents[3] / "postprocessors" / "flashcut" / "machine.toml"
STEP = 0.0019


def machine(*settings: str) -> Machine:
    return build_machine(read_table(TARGET), str(TARGET), settings=settings)


def rows(toolpath: Toolpath, *settings: str) -> list[RowMotion]:
    return rows_of(simulate(toolpath, machine(*settings)))


def test_rows_that_move_nothing_have_no_samples() -> None:
    path = ToolpathBuilder().event(Kind.SET_ZERO).line(0.0, 0.0, feed=3.0).rapid()
    path.line(0.0009, 0.0, feed=3.0)
    path.event(Kind.SPINDLE_CW).message("stop").event(Kind.TOOL_CHANGE, 1)
    found = rows(path.finish())
    assert len(found) == 7
    assert all(len(one.commanded) == 0 and one.duration_s == 0.0 and one.ended for one in found)
    assert rows(ToolpathBuilder().finish()) == []


def test_an_arc_about_its_own_start_is_a_line_to_its_end() -> None:
    path = ToolpathBuilder().arc(0.19, 0.0, centre=(0.0, 0.0), ccw=True, feed=3.0)
    path.arc(0.19, 0.0, centre=(0.19, 0.0), ccw=True, feed=3.0)
    arc, nothing = rows(path.finish())
    assert arc.commanded[-1].tolist() == [100 * STEP, 0.0, 0.0]
    assert len(nothing.commanded) == 0


def test_homing_goes_by_its_sensors_whatever_was_too_much() -> None:
    path = ToolpathBuilder().line(1.9, 0.95, feed=14.1).event(Kind.HOME_XY).set_position(0, 0, 0)
    path.line(0.19, 0.0, feed=14.1)
    line, home, after = rows(path.finish(), "controller.half_period_ms=3")
    assert np.rint(line.commanded[-1] / STEP).tolist() == [1000, 571, 0]  # instead of 500
    assert home.steps.tolist() == [1000, 571, 0]
    assert (home.commanded[:571, 0] == 1000 * STEP).all()  # Y first, L1229
    assert home.duration_s - home.compensation_s == pytest.approx(1571 * 0.008)
    assert after.commanded[-1].tolist() == [100 * STEP, 0.0, 0.0]


def test_programs_at_the_limits_of_the_format() -> None:
    path = ToolpathBuilder().rapid(9999.999, -9999.999).rapid(-9999.999, 9999.999).finish()
    steps = to_steps(9999.999, STEP).item()
    samples = 0
    total = np.zeros(3, np.int64)
    for chunk in simulate(path, machine(), Options(effects=IDEAL)):
        samples += len(chunk.row)
        total += chunk.ledger.steps.sum(axis=0)
    # Diagonals of one length: both timers fire together.
    assert samples == steps + to_steps(2 * 9999.999, STEP).item()
    assert total.tolist() == [samples, samples, 0]


BAD = {
    "no feed": (ToolpathBuilder().line(1.0, 0.0, feed=0.0), "without a feed above 0"),
    "nan": (ToolpathBuilder().line(1.0, 0.0, feed=math.nan), "without a feed above 0"),
    "endless feed": (ToolpathBuilder().line(1.0, 0.0, feed=math.inf), "without a feed above 0"),
    "crawling": (ToolpathBuilder().line(1.0, 0.0, feed=1e-9), "is too slow for the timers"),
    "far": (ToolpathBuilder().rapid(1.1e6, 0.0), "beyond all"),
    "starts far": (ToolpathBuilder((1.1e6, 0.0, 0.0)).rapid(1.0, 0.0), "beyond all"),
    "wide": (ToolpathBuilder().arc(1.0, 0.0, centre=(1e7, 1e7), ccw=True, feed=1.0), "beyond all"),
    "no centre": (
        ToolpathBuilder().arc(1.0, 0.0, centre=(math.nan, 0.0), ccw=True, feed=1.0),
        "without a centre",
    ),
    "timeless": (ToolpathBuilder().event(Kind.DWELL), "without its seconds"),
    "zero": (ToolpathBuilder().rapid(1.0, 0.0).event(Kind.SET_ZERO), "away from part zero"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_programs_are_refused_with_their_place(name: str) -> None:
    path, message = BAD[name]
    path.block = 7
    with pytest.raises(ProgramError, match=message) as caught:
        rows(path.finish())
    assert caught.value.where is not None


def test_what_follows_the_end_is_not_looked_at() -> None:
    path = ToolpathBuilder().line(0.19, 0.0, feed=3.0).event(Kind.END).line(1.0, 0.0, feed=0.0)
    assert len(rows(path.finish())) == 2


@pytest.mark.parametrize(
    "setting",
    [
        "half_period_ms=0",
        "half_period_ms=2.5",
        "half_periods_per_step=3",
        "clock=exact",
        "rounding=up",
        "goes_on_from=home",
        "chords_per_turn=3",
        "tolerance_mm=1",
    ],
)
def test_bad_options_are_named(setting: str) -> None:
    with pytest.raises(MachineError, match=setting.partition("=")[0]):
        machine(f"controller.{setting}")


def test_another_controller_is_refused() -> None:
    with pytest.raises(MachineError, match="use one of flashcut, path"):
        machine("controller.model=grbl")


def test_held_are_the_lengths_that_the_program_says() -> None:
    path = ToolpathBuilder().line(0.1234, 0.0567, feed=3.0).event(Kind.HOME_XY).finish()
    made = machine("controller.machine_zero_mm=[1.0, 2.0, 3.0]")
    held = model_of(made).quantised(path, made)
    assert held.end.tolist() == [[0.1234, 0.0567, 0.0], [1.0, 2.0, 0.0]]


def test_the_assumptions_name_the_fastest_feed() -> None:
    made = machine("controller.half_period_ms=20")
    fastest, *others = model_of(made).assumptions(ToolpathBuilder().finish(), made)
    assert "2.71 or 14.2 mm/min" in fastest  # 1.9 µm in 42 and in 8 ms
    assert any("steps too many stay" in one for one in others)


def test_a_whole_program_of_short_rows_costs_few_chunks() -> None:
    path = ToolpathBuilder()
    for k in range(1, 40_001):
        path.line(k * 0.0019, 0.0, feed=14.1)
    chunks = list(simulate(path.finish(), machine()))
    assert len(chunks) == 3  # of 16,384 moves at most
    assert sum(len(chunk.row) for chunk in chunks) == 40_000
    assert np.concatenate([chunk.ledger.row for chunk in chunks]).tolist() == list(range(40_000))
