"""What the thesis on the parallel-port machine measured, and what its model gives.

Lnnn are lines of the thesis. Where the model does not give what was measured, the test says by
how much, so that nobody takes it for explained: docs/controllers/flashcut.md has the table.
"""

import itertools
from pathlib import Path

import numpy as np
import pytest

from camtool.arrays import Floats
from camtool.kernels.lattice import to_steps
from camtool.simulation.motion import Chunk
from camtool.tables import read_table
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from tests.targets import build_machine, simulate

TARGET = Path(__file__).parents[3] / "postprocessors" / "flashcut" / "machine.toml"
F3, F6, F10, F20, F40 = 14.25, 8.14, 5.18, 2.714, 1.39
"""Feeds, mm/min, of half periods of 3, 6, 10, 20 and 40 ms."""
CLOCKS = ["whole-ms", "late-longer"]


def run(toolpath: Toolpath, *settings: str) -> list[Chunk]:
    """The motion with the window's own half period (3 ms, L1404), unless a setting says more."""
    own = ["controller.half_period_ms=3", *settings]
    machine = build_machine(read_table(TARGET), str(TARGET), settings=own)
    return list(simulate(toolpath, machine))


def seconds(chunks: list[Chunk]) -> float:
    return float(sum(chunk.ledger.duration_s.sum() for chunk in chunks))


def steps(chunks: list[Chunk]) -> list[int]:
    total = np.sum([chunk.ledger.steps.sum(axis=0) for chunk in chunks], axis=0)
    return [int(number) for number in total]


def slides(chunks: list[Chunk]) -> Floats:
    return np.concatenate([chunk.slide for chunk in chunks])


def rectangle(width: float, height: float, feed: float = F3) -> ToolpathBuilder:
    path = ToolpathBuilder()
    for x, y in ((width, 0.0), (width, height), (0.0, height), (0.0, 0.0)):
        path.line(x, y, feed=feed)
    return path


def circle(x: float, y: float, ccw: bool, feed: float) -> Toolpath:
    """Ø 10 about part zero, from (x, y) on."""
    start = ToolpathBuilder((x, y, 0.0))
    return start.arc(x, y, centre=(0.0, 0.0), ccw=ccw, feed=feed).finish()


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize(
    ("half_period", "y_steps"),
    [(20, 2763), (30, 2719), (40, 2697)],  # Tabla 3.8, L1210-1214
)
def test_the_shorter_axis_of_table_3_8(half_period: int, y_steps: int, clock: str) -> None:
    line = ToolpathBuilder().line(10.0, 5.0, feed=F3).finish()
    settings = (f"controller.half_period_ms={half_period}", f"controller.clock={clock}")
    assert steps(run(line, *settings)) == [5263, y_steps, 0]  # 5263 and 2632 by theory, L1208


def test_lengths_in_steps() -> None:
    assert to_steps([10.0, 5.0, 0.34527], 0.0019).tolist() == [5263, 2632, 182]  # L1208, L1147


def test_the_oscilloscope() -> None:
    """X fires every 3 + 1 ms, Y every 6 ms, at a half period of 3 ms (L1188)."""
    (chunk,) = run(ToolpathBuilder().line(10.0, 5.0, feed=F3).finish())
    moved = np.diff(chunk.commanded[:, :2], axis=0, prepend=0.0) > 0.0
    wanted = [(t % 4 == 0, t % 6 == 0) for t in range(1, 241) if t % 4 == 0 or t % 6 == 0]
    assert moved[: len(wanted)].tolist() == [list(pair) for pair in wanted]


@pytest.mark.parametrize(
    ("width", "height", "measured_s"),
    [(10.0, 10.0, 173), (10.0, 5.0, 130), (3.0, 10.0, 113)],  # Tabla 4.1, L1583-1587
)
def test_times_of_table_4_1(width: float, height: float, measured_s: int) -> None:
    """To 0.6 s: with 348 and 161 steps of compensation once each, and two half periods a step."""
    found = run(rectangle(width, height).finish())
    assert seconds(found) == pytest.approx(measured_s, abs=0.6)
    path = rectangle(width, height, feed=100.0).finish()  # faster than 3 ms allow
    once = seconds(run(path, "controller.half_periods_per_step=1"))
    assert once == pytest.approx(seconds(found) / 2.0)  # which is why there are two


@pytest.mark.parametrize(
    ("feed", "measured_s"),
    [(F20, 658), (F40, 1300)],  # Tabla 4.2, L1616-1620
)
def test_times_of_the_circles_of_table_4_2(feed: float, measured_s: int) -> None:
    """Start and way round are in a lost figure: the measured time lies among those of all
    quarters, none of which is 4 % off."""
    starts = [(5.0, 0.0), (0.0, 5.0), (-5.0, 0.0), (0.0, -5.0)]
    times = [
        seconds(run(circle(x, y, ccw, feed), f"controller.start_direction={sign}"))
        for (x, y), ccw, sign in itertools.product(starts, (True, False), "+-")
    ]
    assert min(times) < measured_s < max(times)
    assert times == pytest.approx([measured_s] * len(times), rel=0.04)


def crossed() -> Toolpath:
    """The rectangle of 10 × 5 with both diagonals; the way between them is in a lost figure."""
    path = rectangle(10.0, 5.0).line(10.0, 5.0, feed=F40)
    return path.line(10.0, 0.0, feed=F3).line(0.0, 5.0, feed=F40).finish()


def test_time_of_the_rectangle_with_diagonals() -> None:
    """16 min 56 s (Tabla 4.2, L1618). Compensation as slow as the diagonals makes it 83 s too
    long, at 3 ms it is 8 s; but at 3 ms the circles would be too short."""
    fast = "controller.compensation_half_period_ms=3"
    assert seconds(run(crossed())) == pytest.approx(1016 + 83, abs=1.0)
    assert seconds(run(crossed(), fast)) == pytest.approx(1016 + 8, abs=1.0)
    for feed, measured_s, short_s in ((F20, 658, 22), (F40, 1300, 68)):
        times = seconds(run(circle(0.0, 5.0, True, feed), fast))
        assert times == pytest.approx(measured_s - short_s, abs=1.0)


def test_how_far_the_second_diagonal_misses() -> None:
    """A to B is 0.233 mm (L1593-1598), which points are in a lost figure. Where nobody sees what
    is too much, both diagonals add up: 2 · 65 steps; where it is seen, one remains."""
    stays, seen = run(crossed()), run(crossed(), "controller.goes_on_from=reached")
    assert stays[-1].commanded[-1, 1] - 5.0 == pytest.approx(130 * 0.0019, abs=0.001)
    assert pytest.approx(0.233, abs=0.012) == 130 * 0.00188
    assert seen[-1].commanded[-1, 1] - 5.0 == pytest.approx(65 * 0.0019, abs=0.001)


UNCOMPENSATED = ("axes.x.compensation_mm=0", "axes.y.compensation_mm=0")


def test_the_rectangle_that_does_not_close_without_compensation() -> None:
    """0.675 and 0.321 mm were measured on it (L1158-1160). The play by two lines, 0.654 and 0.302
    (L1172), is what the model gives; 21 and 19 µm remain unexplained."""
    gap = slides(run(rectangle(10.0, 5.0).finish(), *UNCOMPENSATED))[-1]
    assert gap.tolist() == pytest.approx([0.654, 0.302, 0.0], abs=1e-6)
    assert (np.array([0.675, 0.321, 0.0]) - gap).tolist() == pytest.approx([0.021, 0.019, 0.0])
    closed = slides(run(rectangle(10.0, 5.0).finish()))[-1]
    assert np.abs(closed).max() < 0.001


def test_backlash_in_theory_and_as_measured() -> None:
    """182 steps (345.27 µm, L1147) against 348 and 161 (L1172): with the first, X lacks 0.312 mm
    at each reversal and Y has 0.040 too much."""
    assert pytest.approx(0.654, abs=0.0005) == 348 * 0.00188
    assert pytest.approx(0.302, abs=0.001) == 161 * 0.00188
    theory = ("axes.x.compensation_mm=0.3458", "axes.y.compensation_mm=0.3458")
    at = slides(run(rectangle(10.0, 5.0).finish(), *theory))[-1]
    assert at.tolist() == pytest.approx([0.654 - 182 * 0.00188, 0.302 - 182 * 0.00188, 0.0])
    assert at.tolist() == pytest.approx([0.312, -0.040, 0.0], abs=0.001)


def test_the_second_of_two_parallel_lines_is_shorter_by_the_play() -> None:
    """L1165: up to the first line in its own direction, then back along the second."""
    for axis, play_mm in ((0, 0.654), (1, 0.302)):
        path, here = ToolpathBuilder(), np.zeros(2)
        for along, across in ((2.0, 0.0), (7.0, 0.0), (0.0, 0.5), (-7.0, 0.0)):
            here[axis] += along
            here[1 - axis] += across
            path.line(*here.tolist(), feed=F3)
        chunks = run(path.finish(), *UNCOMPENSATED)
        row = np.concatenate([chunk.row for chunk in chunks])
        at = slides(chunks)[:, axis]
        ends = [at[np.flatnonzero(row == line)[-1]] for line in range(4)]
        first, second = ends[1] - ends[0], ends[1] - ends[3]
        assert first - second == pytest.approx(play_mm, abs=0.00188)


@pytest.mark.parametrize(
    ("nominal", "predicted", "measured"),
    # L1557-1579; the step that is coded is not the real one, L1674
    [(10.0, 9.894, 9.897), (5.0, 4.948, 4.906), (3.0, 2.969, 2.902)],
)
def test_sizes_by_the_step_that_is_coded(
    nominal: float, predicted: float, measured: float
) -> None:
    at = slides(run(rectangle(nominal, nominal).finish()))
    assert np.ptp(at, axis=0)[:2].tolist() == pytest.approx([predicted, predicted], abs=0.002)
    assert -0.004 < predicted - measured < 0.068  # which the thesis does not explain


@pytest.mark.parametrize(
    ("feed", "horizontal", "vertical"),
    [(F40, 9.083, 9.178), (F20, 9.004, 9.123)],  # L1601-1612
)
def test_the_circles_that_came_out_small_stay_unexplained(
    feed: float, horizontal: float, vertical: float
) -> None:
    """No count of chords makes them as small as they were measured."""
    sizes = []
    for chords in (36, 72, 360, 1800):
        found = run(circle(5.0, 0.0, True, feed), f"controller.chords_per_turn={chords}")
        sizes += np.ptp(slides(found), axis=0)[:2].tolist()
    assert min(sizes) > 9.85
    assert max(sizes) < 10.0
    assert min(sizes) - max(horizontal, vertical) > 0.65


def test_joystick_speeds() -> None:
    """3, 6 and 10 ms (L1261), and the feeds of the examples (L1004, L1020)."""
    line = [
        ToolpathBuilder().line(1.9, 0.0, feed=feed).finish() for feed in (F3, F6, F10, 3.0, 8.0)
    ]
    times = [seconds(run(path)) for path in line]
    assert times == pytest.approx([1000 * 2 * (p + 1) / 1000 for p in (3, 6, 10, 18, 6)])
