"""The parallel-port machine's PC: whole programs against its twin, and at the edges."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from camtool_postprocessors.flashcut import controller
from hypothesis import given
from hypothesis import strategies as st

from camtool.machine.model import Machine
from camtool.simulation.motion import Effects, Options
from camtool.tables import read_table
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.controllers import play
from tests.oracles.flashcut_run import Pc, half_period, run_rows
from tests.oracles.motion_rows import RowMotion, rows_of
from tests.targets import build_machine, simulate

TARGET = Path(__file__).parents[3] / "postprocessors" / "flashcut" / "machine.toml"
STEP = 0.0019


def machine(*settings: str) -> Machine:
    return build_machine(read_table(TARGET), str(TARGET), settings=settings)


def rows(toolpath: Toolpath, *settings: str, chunk_steps: int = 1 << 16) -> list[RowMotion]:
    return rows_of(simulate(toolpath, machine(*settings), Options(chunk_steps=chunk_steps)))


OPTIONS = {
    "half_period_ms": st.sampled_from([1, 3, 4, 7]),
    "single_axis_half_period_ms": st.sampled_from([1, 3, 9]),
    "clock": st.sampled_from(["whole-ms", "late-longer"]),
    "half_periods_per_step": st.sampled_from([1, 2]),
    "rounding": st.sampled_from(["nearest", "truncate"]),
    "goes_on_from": st.sampled_from(["programmed", "reached"]),
    "chords_per_turn": st.sampled_from([4, 7, 36]),
}


@st.composite
def jobs(draw: st.DrawFn) -> Toolpath:
    """Small moves of every kind, on whole micrometres."""
    b = ToolpathBuilder()
    micron = st.integers(-60, 60).map(lambda number: number / 1000.0)
    feeds = st.sampled_from([2.0, 5.0, 9.0, 14.1])
    for b.block in range(draw(st.integers(1, 5))):
        kind = draw(
            st.sampled_from(["rapid", "line", "line", "z", "arc", "still", "dwell", "home"])
        )
        x, y, z = b.position
        if kind == "rapid":
            b.rapid(draw(micron), draw(micron))
        elif kind == "line":
            b.line(draw(micron), draw(micron), feed=draw(feeds))
        elif kind == "z":
            b.line(z=draw(micron), feed=draw(feeds))
        elif kind == "arc":
            i, j = draw(micron), draw(micron.filter(lambda number: number != 0.0))
            end = draw(st.sampled_from([(x, y), (x + 2 * i, y + 2 * j), (x + i - j, y + j + i)]))
            b.arc(*end, centre=(x + i, y + j), ccw=draw(st.booleans()), feed=draw(feeds))
        elif kind == "still":
            b.line(x, y, feed=3.0)
        elif kind == "dwell":
            b.event(Kind.DWELL, 0.5)
        else:
            home = draw(st.sampled_from([Kind.HOME_XY, Kind.HOME_Z]))
            b.event(home)
            if home == Kind.HOME_XY:
                b.set_position(0.01, -0.02, z)
            else:
                b.set_position(x, y, 0.03)
    return b.event(Kind.END).line(9.0, 9.0, feed=1.0).finish()


@given(jobs(), st.fixed_dictionaries(OPTIONS), st.sampled_from([1, 17, 1 << 16]))
def test_programs_are_what_the_twin_makes_of_them(
    toolpath: Toolpath, options: dict[str, Any], chunk_steps: int
) -> None:
    settings = [f"controller.{key}={value}" for key, value in options.items()]
    settings.append("controller.machine_zero_mm=[0.01, -0.02, 0.03]")
    pc = Pc(
        (STEP, STEP, STEP),
        late=options["clock"] == "late-longer",
        truncates=options["rounding"] == "truncate",
        sees=options["goes_on_from"] == "reached",
    )
    shortest = options["half_period_ms"], options["single_axis_half_period_ms"]
    parts = options["half_periods_per_step"]
    per_turn = options["chords_per_turn"]
    row, seconds = run_rows(toolpath, pc, shortest, parts, per_turn, (0.01, -0.02, 0.03))
    found = rows(toolpath, *settings, chunk_steps=chunk_steps)
    assert len(found) == len(toolpath) - 1  # up to the end
    steps = np.array(pc.seen, dtype=np.int64).reshape(-1, 3)
    for index, one in enumerate(found):
        mine = steps[np.array(row, dtype=np.int64) == index] if row else steps
        assert one.commanded.tolist() == (mine * STEP).tolist()
        assert one.duration_s - one.compensation_s == pytest.approx(seconds[index], abs=1e-9)
        assert one.iterations == len(mine)
        assert one.ended
    assert (
        sum(one.steps.sum() for one in found)
        == np.abs(np.diff(steps, axis=0, prepend=[[0] * 3])).sum()
    )


@given(jobs())
def test_slides_have_play_and_compensation_of_whole_steps(toolpath: Toolpath) -> None:
    found = rows(toolpath, "axes.z.backlash_mm=0.01", "axes.z.compensation_mm=0.011")
    steps = np.concatenate([one.commanded for one in found]) / STEP
    slide = np.concatenate([one.slide for one in found])
    reversals = np.sum([one.reversals for one in found], axis=0)
    counts = [348, 161, 6]
    for axis, (play_mm, count) in enumerate(zip([0.654, 0.302, 0.01], counts, strict=True)):
        at = [0, *np.rint(steps[:, axis]).astype(int).tolist()]
        wanted, turns = play(at, 0.00188, 0.0, play_mm, count, 1)
        assert slide[:, axis] == pytest.approx(wanted[1:], abs=1e-9)
        assert reversals[axis] == turns


def test_compensation_takes_the_time_of_its_steps() -> None:
    path = ToolpathBuilder().line(1.0, 0.5, feed=14.1).line(0.0, 0.0, feed=1.4).finish()
    there, back = rows(path, "controller.half_period_ms=3")
    assert (there.compensation_s, there.reversals.tolist()) == (0.0, [0, 0, 0])
    assert back.reversals.tolist() == [1, 1, 0]
    assert back.compensation_s == pytest.approx((348 + 161) * 0.082)  # P = 40 at F1.4
    assert back.duration_s == pytest.approx((526 + 348 + 161) * 0.082)
    bare = rows_of(simulate(path, machine(), Options(effects=Effects(compensation=False))))
    assert sum(one.compensation_s for one in bare) == 0.0


def test_compensation_of_a_z_with_steps_of_its_own() -> None:
    path = ToolpathBuilder().line(z=-0.38, feed=5.7).finish()
    (found,) = rows(
        path,
        "controller.half_period_ms=3",
        "axes.z.coded_step_mm=0.0038",
        "axes.z.compensation_mm=0.038",
    )
    assert found.compensation_s == pytest.approx(10 * 0.040)  # 3.8 µm at F5.7
    assert found.duration_s == pytest.approx(110 * 0.040)


@pytest.mark.parametrize("quarters", [1, 2, 3, 4])
def test_arcs_of_whole_chords_have_no_further_one(quarters: int) -> None:
    rng = np.random.default_rng(quarters)
    path = ToolpathBuilder()
    for x, y in rng.uniform(-9.0, 9.0, (500, 2)).tolist():
        here, spoke = complex(*path.position[:2]), complex(x, y)
        centre = here - spoke
        end = here if quarters == 4 else centre + spoke * 1j**quarters
        path.arc(end.real, end.imag, centre=(centre.real, centre.imag), ccw=True, feed=3.0)
    table = controller.MoveTable.of(path.finish(), machine())
    assert set(table.chords.tolist()) == {18 * quarters}


@pytest.mark.parametrize("parts", [1, 2])
@pytest.mark.parametrize("feed", [0.1, 1.4, 2.0, 2.71, 3.0, 5.0, 8.0, 12.0, 14.1, 1000.0])
def test_half_periods_of_feeds(feed: float, parts: int) -> None:
    path = ToolpathBuilder().line(0.19, 0.0, feed=feed).finish()
    one = f"controller.half_periods_per_step={parts}"
    (found,) = rows(path, "controller.half_period_ms=3", one)
    wanted = half_period(feed, STEP, 3, parts)
    assert found.duration_s == pytest.approx(100 * parts * (wanted + 1) / 1000.0)
    (same,) = rows(path, "controller.half_period_ms=20", one)
    assert same.duration_s == pytest.approx(found.duration_s)  # one axis alone: 3 ms as shipped
    alone = "controller.single_axis_half_period_ms=20"
    (slow,) = rows(path, "controller.half_period_ms=40", alone, one)
    assert slow.duration_s == pytest.approx(100 * parts * (max(wanted, 20) + 1) / 1000.0)
    (both,) = rows(ToolpathBuilder().line(0.19, 0.02, feed=feed).finish(), one)
    assert both.duration_s == pytest.approx(100 * parts * (max(wanted, 20) + 1) / 1000.0)


def test_rapids_have_the_shortest_half_period() -> None:
    half = "controller.half_period_ms=6"
    path = ToolpathBuilder().rapid(0.19, 0.0).rapid(0.38, 0.1).rapid(z=0.19).event(Kind.HOME_Z)
    alone, both, z, home = rows(path.finish(), half)
    assert alone.duration_s == pytest.approx(100 * 0.008)
    assert both.duration_s == pytest.approx(100 * 0.014)
    assert z.duration_s == home.duration_s == pytest.approx(100 * 0.008)
    (shorter,) = rows(ToolpathBuilder().rapid(0.19, 0.0).finish(), "controller.half_period_ms=1")
    assert shorter.duration_s == pytest.approx(100 * 0.004)  # no longer than for two


def test_what_was_too_much_stays_or_is_seen() -> None:
    path = ToolpathBuilder().line(1.9, 0.95, feed=1.0)
    for x, y in ((1.9, 0.0), (0.0, 0.95), (0.0, 0.0)):
        path.line(x, y, feed=14.1)
    once = rows(path.finish(), "controller.half_period_ms=20")
    # 1000 × 500 steps: at F1.0 P = 56 and ⌊1000·57 / (112 + 1)⌋ = 504, at P = 20 ⌊21000/41⌋ = 512.
    assert [np.rint(one.commanded[-1] / STEP).tolist()[:2] for one in once] == [
        [1000, 504],
        [1000, 4],
        [0, 516],
        [0, 16],
    ]
    seen = rows(path.finish(), "controller.half_period_ms=20", "controller.goes_on_from=reached")
    assert [np.rint(one.commanded[-1] / STEP).tolist()[:2] for one in seen] == [
        [1000, 504],
        [1000, 0],
        [0, 512],
        [0, 0],
    ]


def test_full_circles_close_in_all_four_quarters() -> None:
    for ccw in (True, False):
        path = ToolpathBuilder().arc(0.0, 0.0, centre=(-0.5, 0.0), ccw=ccw, feed=3.0).finish()
        (found,) = rows(path, "controller.chords_per_turn=360")
        assert found.commanded[-1].tolist() == [0.0, 0.0, 0.0]
        radius = np.hypot(found.commanded[:, 0] + 0.5, found.commanded[:, 1])
        # Chords of a degree round by half a step each, and miss the circle by no more together.
        assert radius.min() > 0.5 - 20 * STEP
        assert radius.max() < 0.5 + 20 * STEP
        above = found.commanded[len(found.commanded) // 4, 1]
        assert above > 0.4 if ccw else above < -0.4


def test_chords_can_be_seen() -> None:
    path = ToolpathBuilder().arc(0.0, 0.0, centre=(-5.0, 0.0), ccw=True, feed=3.0).finish()
    for chords in (8, 72):
        (found,) = rows(
            path, f"controller.chords_per_turn={chords}", "controller.goes_on_from=reached"
        )
        least = np.hypot(found.commanded[:, 0] + 5.0, found.commanded[:, 1]).min()
        sagitta = 5.0 * (1.0 - math.cos(math.pi / chords))
        # The shorter axis is up to 1/20 of a chord ahead of the longer one.
        assert least == pytest.approx(5.0 - sagitta, abs=0.06 * 10.0 * math.pi / chords)


def test_small_chords_that_are_truncated_lead_nowhere() -> None:
    path = ToolpathBuilder().arc(0.0, 0.0, centre=(-0.1, 0.0), ccw=True, feed=3.0).finish()
    (found,) = rows(path, "controller.chords_per_turn=1000", "controller.rounding=truncate")
    assert len(found.commanded) == 0  # chords of 0.63 µm: no step at all
    assert (found.duration_s, found.ended) == (0.0, True)
