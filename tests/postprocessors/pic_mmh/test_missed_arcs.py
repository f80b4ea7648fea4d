"""Arcs whose stop test is never met, arcs that cannot start, and how many of all there are."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from camtool_postprocessors.pic_mmh.controller import StepArc, arc_filler, arc_reach
from camtool_postprocessors.pic_mmh.dialect import Interpolator

from camtool.errors import OptionError
from camtool.machine.model import Machine
from camtool.simulation.motion import Options
from camtool.toolpath.builder import ToolpathBuilder
from tests.oracles.motion_rows import RowMotion, rows_of
from tests.targets import simulate

STEP = 0.00014


@pytest.fixture
def strict(make_machine: Callable[..., Machine]) -> Machine:
    """An arc ends on its end only."""
    return make_machine("controller.arc_end=equal")


def run(path: ToolpathBuilder, machine: Machine) -> list[RowMotion]:
    return rows_of(simulate(path.finish(), machine))


def steps_of(row: RowMotion) -> np.ndarray:
    return np.rint(row.commanded / STEP).astype(np.int64)


def reach(arc: StepArc, method: Interpolator = "dsm") -> tuple[int, bool, np.ndarray]:
    """Samples, whether the end is met, and the path of these samples."""
    samples, met = arc_reach(arc, arc_filler(arc, method, rounded=False))
    path = np.empty((samples, 2), dtype=np.int64)
    arc_filler(arc, method, rounded=False)(path)
    return samples, met, path


def rounded_arc(rng: np.random.Generator) -> StepArc:
    """Start, centre and end of a true arc, each rounded to steps by itself."""
    radius = rng.uniform(50.0, 20_000.0)
    begin, sweep = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.3, 6.0)
    clockwise = bool(rng.integers(2))
    centre = rng.uniform(-1000.0, 1000.0, 2)
    finish = begin - sweep if clockwise else begin + sweep
    corners = [
        np.rint(centre + radius * np.array([math.cos(a), math.sin(a)])) for a in (begin, finish)
    ]
    start, end = (corner - np.rint(centre) for corner in corners)
    return StepArc(int(start[0]), int(start[1]), clockwise, int(end[0]), int(end[1]))


def test_how_many_rounded_arcs_meet_their_end() -> None:
    """About 55 %; nearly all of the others pass at one step, none farther off than two."""
    rng = np.random.default_rng(70)
    results = []
    for _ in range(600):
        arc = rounded_arc(rng)
        _, met, path = reach(arc)
        results.append((met, float(np.hypot(*(path[-1] - (arc.end_x, arc.end_y))))))
    hit = np.mean([met for met, _ in results])
    distance = np.array([away for met, away in results if not met])
    assert 0.50 < hit < 0.62
    assert distance.min() >= 1.0
    assert np.mean(distance == 1.0) > 0.9
    assert distance.max() <= 2.0


@pytest.mark.parametrize("method", ["dsm", "dda", "stairs"])
def test_a_missed_arc_stops_in_its_sweep(method: Interpolator) -> None:
    rng = np.random.default_rng(71)
    missed = 0
    for _ in range(60):
        arc = rounded_arc(rng)
        _, met, path = reach(arc, method)
        if met:
            assert path[-1].tolist() == [arc.end_x, arc.end_y]
            continue
        missed += 1
        angle = np.unwrap(np.arctan2(path[:, 1], path[:, 0]))
        begin = math.atan2(arc.y, arc.x)
        turned = abs(angle[-1] - angle[0])
        sign = -1.0 if arc.clockwise else 1.0
        expected = sign * (math.atan2(arc.end_y, arc.end_x) - begin) % (2.0 * math.pi)
        assert turned == pytest.approx(expected, abs=0.1)
    assert missed > 5


def test_an_end_behind_the_start_is_reached_after_a_whole_turn() -> None:
    """Not met and one step behind the start: nearly a turn. One step before it: next to none."""
    behind, met, _ = reach(StepArc(1000, 3, False, 1001, 2))
    assert not met
    assert behind == pytest.approx(4 * math.sqrt(2.0) * 1000, abs=10)
    ahead, met, _ = reach(StepArc(1000, 3, False, 1001, 4))
    assert not met
    assert ahead <= 2


def test_the_next_row_goes_on_from_the_programmed_end(strict: Machine) -> None:
    """Without a compensation on the way, although the step there goes the other way."""
    path = ToolpathBuilder((0.14, 0.0, 0.0)).arc(0, 0.14028, centre=(0, 0), ccw=True, feed=0.8)
    path.line(-0.014, 0.14028, feed=0.8)
    arc, line = run(path, strict)
    assert not arc.ended
    assert steps_of(arc)[-1, :2].tolist() == [0, 1000]
    assert arc.reversals.tolist() == [1, 0, 0]
    points = steps_of(line)
    assert points[0].tolist() == [-1, 1002, 0]
    assert points[-1].tolist() == [-100, 1002, 0]
    assert line.ended
    assert line.reversals.tolist() == [0, 0, 0]
    assert line.steps.tolist() == [100, 0, 0]


def test_by_the_other_readings_it_goes_on_from_where_it_stopped(
    make_machine: Callable[..., Machine],
) -> None:
    """Here at (0, 1000), two steps short of the end; the line makes them too."""
    path = ToolpathBuilder((0.14, 0.0, 0.0)).arc(0, 0.14028, centre=(0, 0), ccw=True, feed=0.8)
    path.line(-0.014, 0.14028, feed=0.8)
    arc, line = run(path, make_machine("controller.arc_end=nearest"))
    assert arc.ended
    assert steps_of(arc)[-1, :2].tolist() == [0, 1000]
    assert steps_of(line)[-1].tolist() == [-100, 1002, 0]
    assert line.steps.tolist() == [100, 2, 0]
    assert line.reversals.tolist() == [0, 0, 0]


def test_an_arc_that_starts_at_its_centre_has_no_samples(machine: Machine) -> None:
    path = ToolpathBuilder().arc(0.01, 0.02, centre=(0, 0), ccw=True, feed=0.8)
    path.arc(0.01, 0.02, centre=(0.01, 0.02), ccw=False, feed=0.8).rapid(0.01, 0.02, 0.001)
    first, second, rapid = run(path, machine)
    for row in (first, second):
        assert (len(row.commanded), row.ended) == (0, False)
        assert row.duration_s == 0.0
    assert steps_of(rapid)[-1].tolist() == [71, 143, 7]
    assert len(rapid.commanded) == 7


def test_a_missed_arc_with_z_says_so(strict: Machine) -> None:
    whole = ToolpathBuilder((0.14, 0.0, 0.0)).arc(0, 0.14028, centre=(0, 0), ccw=True, feed=0.8)
    toolpath = whole.finish()
    end = toolpath.end.copy()
    end[0, 2] = 0.0014
    climbing = type(toolpath)(**{**vars(toolpath), "end": end})
    (row,) = rows_of(simulate(climbing, strict))
    assert not row.ended
    assert steps_of(row)[-1].tolist() == [0, 1002, 10]


@pytest.mark.parametrize("method", ["dsm", "dda", "stairs"])
@pytest.mark.parametrize("reach_mm", [99.99999, 0.00014, 0.00028])
def test_whole_circles_at_the_limits(
    machine: Machine, method: Interpolator, reach_mm: float
) -> None:
    """The largest coordinates of the format and the smallest radii: met, bounded, no crash."""
    path = ToolpathBuilder((-reach_mm, 0.0, 0.0))
    path.arc(-reach_mm, 0, centre=(0, 0), ccw=True, feed=0.8)
    radius = round(reach_mm / STEP)
    samples, ended = 0, True
    per_radius = {"dsm": 4 * math.sqrt(2.0), "dda": 6.0, "stairs": 8.0}[method]
    for chunk in simulate(path.finish(), machine, Options(method)):
        samples += len(chunk.commanded)
        ended = ended and bool(chunk.ledger.ended.all())
        assert len(chunk.commanded) <= 65536
    assert ended
    assert samples == pytest.approx(per_radius * radius, abs=0.01 * radius + 3)


def test_every_tiny_arc_comes_to_an_end() -> None:
    """All starts and ends within four steps, all methods: no hang, no crash."""
    span = range(-4, 5)
    places = [(x, y) for x in span for y in span]
    for method in ("dsm", "dda", "stairs"):
        for x, y in places:
            for ex, ey in places[::5]:
                if (x, y) != (0, 0):
                    samples, met, path = reach(StepArc(x, y, True, ex, ey), method)
                    assert samples < 120
                    assert not met or path[-1].tolist() == [ex, ey]


def test_options_are_checked_at_once(machine: Machine) -> None:
    with pytest.raises(OptionError, match="chunk_steps"):
        simulate(ToolpathBuilder().finish(), machine, Options(chunk_steps=0))
    with pytest.raises(OptionError, match="interpolator"):
        simulate(ToolpathBuilder().finish(), machine, Options("spline"))  # type: ignore[arg-type]
