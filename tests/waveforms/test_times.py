"""Times of samples: those of the pulses, of the planned trapezoids and of the ledgers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.kernels.lattice import to_steps
from camtool.simulation.motion import Options
from camtool.simulation.pulses import OUTPUTS
from camtool.simulation.speed_plan import SpeedPlan
from camtool.simulation.timing import TimedChunk
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.waveforms.columns import Speeds, TimeColumns
from tests.strategies import examples
from tests.waveforms.programs import BENCHES, Bench, paths, signals

ROUTER = Bench("matlab-router", (), 0.1, 600.0, arcs=False)
LINUXCNC = Bench("linuxcnc", (), 0.01, 600.0)
ALL = {**BENCHES, "linuxcnc": LINUXCNC, "matlab-router": ROUTER}
"""All targets."""


def joined(chunks: list[TimedChunk], name: str) -> Floats:
    return np.concatenate([np.zeros(0), *(getattr(each, name) for each in chunks)])


def runs(path: Toolpath, target: LoadedTarget, chunk_steps: int = 1 << 16) -> list[TimedChunk]:
    return list(target.timed(path, Options(chunk_steps=chunk_steps)))


@pytest.mark.parametrize("name", ["pic-mmh", "valcnc", "i8751", "flashcut"])
@examples(25, 1000)
@given(data=st.data())
def test_samples_are_at_the_times_of_the_pulses(name: str, data: st.DataObject) -> None:
    """Each sample is a pulse; flashcut's last state of a step is at the sample's millisecond."""
    target = ALL[name].target()
    path = data.draw(paths(ALL[name]))
    timed = list(target.timed(path, OUTPUTS))
    coded = [axis.coded_step_mm for axis in target.machine.axes]
    places = np.concatenate([path.start[None, :], *(each.chunk.commanded for each in timed)])
    at_s = joined(timed, "at_s")
    pulses = list(signals(path, target).pulses())
    for axis in range(3):
        steps = np.diff(to_steps(places[:, axis], coded[axis]))
        own_s = np.repeat(at_s, np.abs(steps))
        pulse_s = np.concatenate(
            [part.at_s[(part.moves[:, axis] != 0) & ~part.is_added] for part in pulses]
        )
        states = max(len(pulse_s) // max(len(own_s), 1), 1)
        np.testing.assert_allclose(own_s, pulse_s[states - 1 :: states], atol=1e-9, rtol=1e-12)


@examples(15, 500)
@given(data=st.data())
def test_steps_of_grbl_are_near_its_pulses(data: st.DataObject) -> None:
    """Trapezoids without segments: the same but for the slow ends of each move."""
    target = ALL["grbl"].target()
    path = data.draw(paths(ALL["grbl"], reach=400))
    timed = runs(path, target)
    count = sum(len(each.at_s) for each in timed)
    pulses = list(signals(path, target).pulses())
    last = max((float(part.at_s[-1]) for part in pulses if len(part.at_s)), default=0.0)
    if count:
        assert joined(timed, "at_s")[-1] == pytest.approx(last, abs=0.02 * len(path), rel=0.003)


@pytest.mark.parametrize("name", ALL)
@examples(20, 500)
@given(data=st.data())
def test_times_ascend_and_chunks_change_none(name: str, data: st.DataObject) -> None:
    target = ALL[name].target()
    path = data.draw(paths(ALL[name], reach=60))
    whole, parts = runs(path, target), runs(path, target, chunk_steps=7)
    seconds = sum(float(each.chunk.ledger.duration_s.sum()) for each in whole)
    for column in ("at_s", "begin_s", "end_s"):
        at_s = joined(whole, column)
        assert (np.diff(at_s) >= -1e-9).all()
        assert not len(at_s) or (at_s[0] >= 0.0 and at_s[-1] <= seconds + 1e-6)
        np.testing.assert_allclose(joined(parts, column), at_s, atol=1e-8, rtol=1e-12)


class Recorder(TimeColumns):
    """Keeps every speed that is entered."""

    def __init__(self) -> None:
        super().__init__(0.0, 1e9, 1, 4)
        self.parts: list[tuple[Floats, Floats]] = []

    def add(self, begin_s: Floats, end_s: Floats, values: Floats, row: np.ndarray) -> None:
        self.parts.append((end_s - begin_s, values))
        super().add(begin_s, end_s, values, row)


@pytest.mark.parametrize("name", ALL)
@examples(20, 500)
@given(data=st.data())
def test_speeds_add_up_to_the_way(name: str, data: st.DataObject) -> None:
    """The speeds of the axes times their durations are the way, and together they last as long as
    the program; along the path they are at most its length."""
    target = ALL[name].target()
    path = data.draw(paths(ALL[name], reach=60))
    recorder, model = Recorder(), target.model
    speeds = Speeds(
        recorder, path.start, model.samples_per_speed, model.speed_period_s(target.machine)
    )
    way = np.zeros(3)
    seconds, last, length = 0.0, path.start, 0.0
    for timed in target.timed(path, Options(chunk_steps=50)):
        speeds.add(timed)
        seconds += float(timed.chunk.ledger.duration_s.sum())
        points = np.concatenate([last[None, :], timed.chunk.commanded])
        length += float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
        last = points[-1]
    speeds.finish(seconds)
    along, lasting = 0.0, 0.0
    for duration_s, values in recorder.parts:
        way += (duration_s[:, None] * values[:, 1:]).sum(axis=0)
        along += float((duration_s * values[:, 0]).sum())
        lasting += float(duration_s.sum())
    np.testing.assert_allclose(way, last - path.start, atol=1e-6)
    assert along <= length + 1e-6
    assert lasting == pytest.approx(seconds, abs=1e-4)


def test_a_line_of_linuxcnc_is_a_trapezoid() -> None:
    """100 mm at 600 mm/min with 300 mm/s², of which the last move before a stop uses half: at each
    moment where the formula says."""
    settings = tuple(f"axes.{axis}.acceleration_mm_s2=300" for axis in "xyz")
    target = load_target("linuxcnc", settings=settings)
    path = ToolpathBuilder().line(x=100.0, feed=600.0).event(Kind.END).finish()
    timed = runs(path, target)
    place, at_s = np.concatenate([each.chunk.commanded[:, 0] for each in timed]), timed[0].at_s
    speed, acceleration = 10.0, 150.0
    ramp_s = speed / acceleration
    steady = ramp_s * speed / 2.0 + speed * (at_s - ramp_s)
    wanted = np.where(at_s < ramp_s, 0.5 * acceleration * at_s**2, steady)
    before_stop = at_s < 100.0 / speed
    np.testing.assert_allclose(place[before_stop], wanted[before_stop], atol=0.05)
    columns = TimeColumns(0.0, 20.0, 100, 4)
    period_s = target.model.speed_period_s(target.machine)
    speeds = Speeds(columns, path.start, 1, period_s)
    for each in timed:
        speeds.add(each)
    speeds.finish(20.0)
    assert columns.largest[0].value == pytest.approx(speed, rel=0.002)
    assert columns.high[0, 25] == pytest.approx(speed, rel=0.002)
    assert columns.low[0, 60] == columns.high[0, 60] == 0.0


@given(
    lengths=st.lists(st.floats(1e-3, 100.0), min_size=1, max_size=6),
    shares=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=5),
)
def test_moments_of_a_plan_are_its_times(lengths: list[float], shares: list[float]) -> None:
    """At its end a block has taken all of its time; on the way times ascend, and a step of the
    formula for speeds agrees with the difference of two moments."""
    count = len(lengths)
    plan = SpeedPlan(
        np.array(lengths), np.full(count, 20.0), np.full(count, 50.0), np.full(count, 5.0)
    )
    squares = plan.squares(4)
    every = np.arange(count)
    np.testing.assert_allclose(
        plan.moments_s(squares, every, plan.length_mm), plan.seconds(squares), rtol=1e-9
    )
    for k in range(count):
        ways = np.sort(shares) * lengths[k]
        moments = plan.moments_s(squares, np.full(len(ways), k), ways)
        assert (np.diff(moments) >= -1e-12).all()
        # No way is faster than the highest speed, nor slower than the slowest of its ends.
        assert (np.diff(ways) <= 20.0 * np.diff(moments) + 1e-9).all()
