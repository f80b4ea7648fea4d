"""A controller that follows the path: samples, steps, time, reversals, play."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError, ProgramError
from camtool.machine.model import Machine
from camtool.simulation import path as path_model
from camtool.simulation import samples
from camtool.simulation.motion import IDEAL, Chunk, Options
from camtool.simulation.samples import PathSamples, move_lengths, sample_spacing_mm
from camtool.toolpath import moves
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath, toolpath_extents
from tests.oracles.motion_rows import rows_of
from tests.oracles.path_machine import STEP, Slide, both, dense_path, length_of, path_machine
from tests.strategies import examples
from tests.targets import model_of, simulate

FREE = "controller.grid=none"


@st.composite
def jobs(draw: st.DrawFn) -> Toolpath:
    """Moves whose ends lie on the grid: lines, rapids, arcs about centres on it, events."""
    b = ToolpathBuilder()
    cell = st.integers(-40, 40).map(lambda number: number * 0.05)
    for number in range(draw(st.integers(1, 6))):
        b.block = number
        kind = draw(st.sampled_from(["rapid", "line", "arc", "dwell"]))
        if kind == "dwell":
            b.event(Kind.DWELL, 0.25)
        elif kind == "arc":
            x, y, _ = b.position
            a, c = draw(st.sampled_from([(3, 4), (4, 3), (5, 0), (0, 5), (-3, 4), (-5, 0)]))
            p, q = draw(st.sampled_from([(5, 0), (0, -5), (-4, -3), (3, -4), (a, c)]))
            scale = draw(st.integers(1, 20)) * 0.02
            centre = (x - a * scale, y - c * scale)
            end = (centre[0] + p * scale, centre[1] + q * scale) if (p, q) != (a, c) else (x, y)
            z = draw(st.none() | cell)
            b.arc(*end, z, centre=centre, ccw=draw(st.booleans()), feed=60.0)
        elif kind == "rapid":
            b.rapid(draw(cell), draw(cell), draw(cell))
        else:
            b.line(draw(cell), draw(cell), draw(cell), feed=30.0)
    return b.finish()


@st.composite
def machines(draw: st.DrawFn) -> Machine:
    """Made-up machines: steps, play, scale and rates of each axis, limits said or not."""
    changes = [f"controller.grid={draw(st.sampled_from(['steps', 'none']))}"]
    changes.append(f"controller.start_play={draw(st.sampled_from(['preloaded', 'centred']))}")
    changes.append(f"controller.start_direction={draw(st.sampled_from('+-'))}")
    for axis in "xyz":
        step = draw(st.sampled_from([0.001, 0.0125, 0.04, 0.00333]))
        changes.append(f"axes.{axis}.coded_step_mm={step}")
        changes.append(f"axes.{axis}.real_step_mm={step * draw(st.floats(0.9, 1.1))}")
        changes.append(f"axes.{axis}.backlash_mm={draw(st.sampled_from([0.0, 0.03, 0.5]))}")
        if draw(st.booleans()):
            changes.append(f"axes.{axis}.max_rate_mm_min={draw(st.floats(1.0, 1000.0))}")
    if draw(st.booleans()):
        changes.append(f"limits.rapid_mm_min={draw(st.floats(1.0, 5000.0))}")
    return path_machine(*changes)


def quantised(toolpath: Toolpath, machine: Machine) -> Toolpath:
    return model_of(machine).quantised(toolpath, machine)


def gathered(chunks: list[Chunk]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row, commanded and slide of all samples."""
    return (
        np.concatenate([c.row for c in chunks]),
        np.concatenate([c.commanded for c in chunks]),
        np.concatenate([c.slide for c in chunks]),
    )


def total(chunks: list[Chunk], name: str) -> np.ndarray:
    """(3,) the sum of a column of the ledgers."""
    return sum((getattr(c.ledger, name).sum(axis=0) for c in chunks), np.zeros(3, dtype=np.int64))


def square(side: float = 1.0) -> Toolpath:
    b = ToolpathBuilder()
    for x, y in ((side, 0), (side, side), (0, side), (0, 0)):
        b.line(x, y, feed=60.0)
    return b.finish()


@examples(20)  # chunks of one sample are slow
@given(jobs(), st.sampled_from([1, 7, 65536]))
def test_every_row_gives_its_chunks_in_order(toolpath: Toolpath, chunk_steps: int) -> None:
    chunks = list(simulate(toolpath, path_machine(), Options(chunk_steps=chunk_steps)))
    rows = rows_of(chunks)
    assert len(rows) == len(toolpath)
    assert all(row.ended for row in rows)
    assert all(len(c.commanded) <= chunk_steps for c in chunks)


@given(jobs())
def test_ends_are_met_and_samples_are_no_wider_than_a_step(toolpath: Toolpath) -> None:
    machine = path_machine(FREE)
    row, commanded, _ = gathered(list(simulate(toolpath, machine)))
    for index, move in enumerate(toolpath):
        mine = commanded[row == index]
        if move.centre is None and move.start == move.end:
            assert len(mine) == 0
            continue
        assert mine[-1].tolist() == list(move.end)
        apart = np.linalg.norm(np.diff([move.start, *mine.tolist()], axis=0), axis=1)
        assert apart.max() <= sample_spacing_mm(toolpath, machine) * (1.0 + samples.SPACING_EPS)
        assert len(mine) <= length_of(toolpath, index) / STEP + 5


@given(jobs())
def test_samples_lie_on_the_moves(toolpath: Toolpath) -> None:
    row, commanded, _ = gathered(list(simulate(toolpath, path_machine(FREE))))
    moves = list(toolpath)
    for index, point in zip(row.tolist(), commanded.tolist(), strict=True):
        move = moves[index]
        if move.centre is not None:
            radius = math.dist(move.start[:2], move.centre)
            assert math.dist(point[:2], move.centre) == pytest.approx(radius, abs=1e-9)
        else:
            around = math.dist(move.start, point) + math.dist(point, move.end)
            assert around == pytest.approx(math.dist(move.start, move.end), abs=1e-9)


@given(jobs())
def test_extents_are_exact(toolpath: Toolpath) -> None:
    _, commanded, _ = gathered(list(simulate(toolpath, path_machine(FREE))))
    points = np.concatenate([toolpath.start[None, :], commanded])
    reach = np.column_stack([points.min(axis=0), points.max(axis=0)])
    assert reach == pytest.approx(toolpath_extents(toolpath), abs=1e-12)


@examples(20)
@given(jobs(), st.sampled_from([1, 10, 65536]))
def test_chunks_do_not_matter(toolpath: Toolpath, chunk_steps: int) -> None:
    machine = path_machine(*both("backlash_mm", 0.03), *both("compensation_mm", 0.02))
    whole = list(simulate(toolpath, machine))
    parts = list(simulate(toolpath, machine, Options(chunk_steps=chunk_steps)))
    for one, other in zip(gathered(whole), gathered(parts), strict=True):
        assert np.array_equal(one, other)
    for one, many in zip(rows_of(whole), rows_of(parts), strict=True):
        assert np.array_equal(one.steps, many.steps)
        assert np.array_equal(one.reversals, many.reversals)
        assert many.duration_s == pytest.approx(one.duration_s)


@given(
    jobs(),
    st.sampled_from([0.0, 0.01, 0.3]),
    st.sampled_from([0.0, 0.01, 0.2]),
    st.sampled_from(["preloaded", "centred"]),
)
def test_slides_and_reversals_are_those_of_one_axis_at_a_time(
    toolpath: Toolpath, play: float, compensation: float, convention: str
) -> None:
    machine = path_machine(
        f"controller.start_play={convention}",
        *both("backlash_mm", play),
        *both("compensation_mm", compensation),
    )
    chunks = list(simulate(toolpath, machine))
    _, commanded, slide = gathered(chunks)
    counted = total(chunks, "reversals")
    for axis in (0, 1):
        twin = Slide(0.0, play, compensation, centred=convention == "centred")
        wanted = [twin.go(to) for to in commanded[:, axis].tolist()]
        assert slide[:, axis] == pytest.approx(np.array(wanted), abs=1e-12)
        assert counted[axis] == twin.reversals


@given(jobs())
def test_reversals_and_steps_are_those_of_a_dense_path(toolpath: Toolpath) -> None:
    chunks = list(simulate(toolpath, path_machine()))
    points = np.array([point for _, point in dense_path(toolpath)])
    for axis in range(3) if len(points) else ():
        twin = Slide(0.0, 0.0, 0.0, centred=False)
        for to in points[:, axis].tolist():
            twin.go(to)
        assert total(chunks, "reversals")[axis] == twin.reversals
        counted = int(total(chunks, "steps")[axis])
        way = np.abs(np.diff(points[:, axis], prepend=0.0)).sum() / STEP
        assert counted == pytest.approx(way, abs=1.0 + 2.0 * len(toolpath))


def test_the_steps_of_a_square_are_exact() -> None:
    chunks = list(simulate(square(), path_machine()))
    assert total(chunks, "steps").tolist() == [400, 400, 0]
    rows = rows_of(chunks)
    assert [r.reversals.tolist() for r in rows] == [[0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert [r.iterations for r in rows] == [0, 0, 0, 0]


def test_a_circle_from_its_right_end_reverses_where_it_turns() -> None:
    b = ToolpathBuilder((2.0, 0.0, 0.0)).arc(2, 0, centre=(0, 0), ccw=True, feed=60)
    (row,) = rows_of(simulate(b.finish(), path_machine()))
    # X: engaged to +, turns at once, then at the left; Y: at the top and at the bottom.
    assert row.reversals.tolist() == [2, 2, 0]
    assert row.steps.tolist() == [1600, 1600, 0]


def test_the_wrong_way_round_a_spiral_of_rounded_coordinates_reverses_no_axis() -> None:
    """Its radius grows by half a step, so that X first grows by a hair."""
    b = ToolpathBuilder((2.0, 0.0, 0.0)).arc(0, 2.0025, centre=(0, 0), ccw=True, feed=60)
    (row,) = rows_of(simulate(b.finish(), path_machine(FREE, "controller.start_direction=-")))
    assert row.reversals.tolist() == [0, 1, 0]


def test_ideal_slides_are_the_commanded_positions_to_the_bit() -> None:
    machine = path_machine(*both("backlash_mm", 0.1), "axes.x.real_step_mm=0.006")
    for chunk in simulate(square(0.7313), machine, Options(effects=IDEAL)):
        assert np.array_equal(chunk.slide, chunk.commanded)
    assert any((c.slide != c.commanded).any() for c in simulate(square(), machine))


def test_a_real_step_scales_the_slides() -> None:
    machine = path_machine("axes.x.real_step_mm=0.0051")
    for chunk in simulate(square(), machine):
        assert chunk.slide[:, 0] == pytest.approx(chunk.commanded[:, 0] * 1.02, abs=1e-12)
        assert np.array_equal(chunk.slide[:, 1], chunk.commanded[:, 1])


def seconds(toolpath: Toolpath, *settings: str) -> list[float]:
    return [row.duration_s for row in rows_of(simulate(toolpath, path_machine(*settings)))]


def test_a_helix_takes_its_length_and_is_no_faster_than_z() -> None:
    helix = ToolpathBuilder((1.0, 0.0, 0.0)).arc(1, 0, -3.0, centre=(0, 0), ccw=True, feed=60.0)
    (found,) = seconds(helix.finish())
    assert found == pytest.approx(math.hypot(2.0 * math.pi, 3.0))
    (slow,) = seconds(helix.finish(), "axes.z.max_rate_mm_min=10")
    assert slow == pytest.approx(18.0)


def test_time_is_way_over_feed() -> None:
    b = ToolpathBuilder().line(3, 4, feed=60).rapid(3, 4, 2)
    b.arc(3, 4, centre=(3, 5), ccw=True, feed=30).event(Kind.DWELL, 1.5)
    toolpath = b.finish()
    arc = 2 * math.pi / 0.5
    assert seconds(toolpath) == pytest.approx([5.0, 0.0, arc, 1.5], abs=1e-9)
    found = seconds(toolpath, "limits.rapid_mm_min=600")
    assert found == pytest.approx([5.0, 0.2, arc, 1.5])
    found = seconds(toolpath, "limits.rapid_mm_min=600", "axes.z.max_rate_mm_min=60")
    assert found == pytest.approx([5.0, 2.0, arc, 1.5])
    found = seconds(toolpath, "axes.x.max_rate_mm_min=20", "limits.rapid_mm_min=600")
    assert found == pytest.approx([9.0, 0.2, arc, 1.5])


def test_homing_goes_to_machine_zero_and_on_from_there() -> None:
    b = ToolpathBuilder().line(1, 1, 1, feed=60)
    b.event(Kind.HOME_Z).event(Kind.HOME_XY).line(2, 3, 4, feed=60)
    machine = path_machine("controller.machine_zero_mm=[-1.0, -2.0, 5]")
    assert [r.commanded[-1].tolist() for r in rows_of(simulate(b.finish(), machine))] == [
        [1, 1, 1],
        [1, 1, 5],
        [-1, -2, 5],
        [2, 3, 4],
    ]


def test_nothing_runs_behind_the_end() -> None:
    b = ToolpathBuilder().line(1, feed=60).event(Kind.END).line(2, feed=math.nan)
    assert len(rows_of(simulate(b.finish(), path_machine()))) == 2
    assert list(simulate(ToolpathBuilder().finish(), path_machine())) == []


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda b: b.line(1, feed=math.nan), "without a feed"),
        (lambda b: b.line(1, feed=0.0), "without a feed"),
        (lambda b: b.line(1, feed=-2.0), "without a feed"),
        (lambda b: b.arc(1, 0, centre=(math.nan, 0), ccw=True, feed=1.0), "without a centre"),
        (lambda b: b.event(Kind.DWELL, -1.0), "without its seconds"),
        (lambda b: b.event(Kind.DWELL), "without its seconds"),
        (lambda b: b.rapid(1e12), "beyond all"),
        (lambda b: b.rapid(1).event(Kind.SET_ZERO), "part zero"),
    ],
)
def test_what_cannot_be_followed_is_named(build, words: str) -> None:
    b = ToolpathBuilder()
    b.block = 6
    with pytest.raises(ProgramError, match=words) as caught:
        list(simulate(build(b).finish(), path_machine()))
    assert "block 7" in str(caught.value)


def test_it_has_no_interpolators() -> None:
    with pytest.raises(OptionError, match="no interpolators"):
        simulate(square(), path_machine(), Options("dda"))


@given(jobs())
def test_followed_ends_lie_on_the_grid_and_near(toolpath: Toolpath) -> None:
    shifted = ToolpathBuilder((0.0013, 0.0, 0.0))
    for move in toolpath:
        if move.centre is None and move.kind == Kind.LINE:
            shifted.line(*(value + 0.0013 for value in move.end), feed=10.0)
    given_ = shifted.finish()
    made = quantised(given_, path_machine())
    steps = made.end / STEP
    assert steps == pytest.approx(np.round(steps), abs=1e-9)
    if len(given_):
        assert np.abs(made.end - given_.end).max() <= 0.5 * STEP + 1e-12
    free = quantised(given_, path_machine(FREE))
    assert np.array_equal(free.end, given_.end)


@pytest.mark.parametrize("ccw", [True, False])
@pytest.mark.parametrize("missing", [1e-4, 1e-3, 0.002])
def test_rounding_turns_no_arc_inside_out(missing: float, ccw: bool) -> None:
    """Arcs shorter than a step, and circles that lack less than a step."""
    for turn in np.linspace(0.0, 6.2, 23):
        for sweep in (missing, 2 * math.pi - missing):
            end = turn + (sweep if ccw else -sweep)
            b = ToolpathBuilder((math.cos(turn), math.sin(turn), 0.0))
            b.arc(math.cos(end), math.sin(end), centre=(0, 0), ccw=ccw, feed=10)
            b.event(Kind.DWELL, 0.0)
            made = quantised(b.finish(), path_machine())
            assert move_lengths(made)[0] == pytest.approx(sweep, abs=2 * math.pi * STEP)
            assert np.array_equal(made.end[0], made.end[1])


def test_long_programs_are_sampled_more_coarsely(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(samples, "MAX_SAMPLES", 100)
    b = ToolpathBuilder((3.0, 0.0, 0.0)).arc(3, 0, centre=(0, 0.0), ccw=True, feed=60)
    toolpath = b.line(-3, 1, feed=60).finish()
    machine = path_machine(*both("backlash_mm", 0.1))
    wide = sample_spacing_mm(toolpath, machine)
    assert wide == pytest.approx(move_lengths(toolpath).sum() / 100)
    coarse = rows_of(simulate(toolpath, machine))
    monkeypatch.undo()
    fine = rows_of(simulate(toolpath, machine))
    assert 100 <= sum(len(c.commanded) for c in coarse) <= 110
    assert sum(len(c.commanded) for c in fine) > 3000
    for name in ("steps", "reversals"):
        for one, other in zip(coarse, fine, strict=True):
            assert getattr(one, name).tolist() == getattr(other, name).tolist()
    for one, other in zip(coarse, fine, strict=True):
        assert one.slide[-1] == pytest.approx(other.slide[-1], abs=1e-12)
    for reach in (np.min, np.max):
        assert reach(coarse[0].slide, axis=0) == pytest.approx(reach(fine[0].slide, axis=0))


@given(jobs(), st.integers(1, 40))
def test_any_window_holds_the_same_samples(toolpath: Toolpath, size: int) -> None:
    samples = PathSamples(toolpath, 0.05)
    total = int(samples.first[-1])
    rows, points = samples.window(0, total)
    for low in range(0, total, size):
        row, point = samples.window(low, min(low + size, total))
        assert np.array_equal(row, rows[low : low + size])
        assert np.array_equal(point, points[low : low + size])
    owner = np.repeat(np.arange(len(toolpath)), np.diff(samples.first))
    assert np.array_equal(rows, owner)


@given(jobs(), machines(), st.integers(1, 5))
def test_how_many_rows_are_sampled_together_changes_nothing(
    toolpath: Toolpath, machine: Machine, at_once: int
) -> None:
    wanted = rows_of(simulate(toolpath, machine))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(moves, "ROWS_AT_ONCE", at_once)
        patch.setattr(path_model, "ROWS_AT_ONCE", at_once)
        found = rows_of(simulate(toolpath, machine))
    for one, other in zip(found, wanted, strict=True):
        assert np.array_equal(one.commanded, other.commanded)
        assert np.array_equal(one.slide, other.slide)
        assert one.duration_s == other.duration_s
        assert one.steps.tolist() == other.steps.tolist()
        assert one.reversals.tolist() == other.reversals.tolist()


@given(
    st.floats(0.2, 20.0),
    st.floats(0.0, 6.28),
    st.floats(0.01, 6.28),
    st.booleans(),
    st.sampled_from([STEP, 0.0125]),
)
def test_arcs_on_the_grid_stay_within_a_step_of_what_was_programmed(
    radius: float, turn: float, sweep: float, ccw: bool, y_step: float
) -> None:
    end = turn + (sweep if ccw else -sweep)
    b = ToolpathBuilder((radius * math.cos(turn), radius * math.sin(turn), 0.0))
    b.arc(radius * math.cos(end), radius * math.sin(end), centre=(0, 0), ccw=ccw, feed=10)
    machine = path_machine(f"axes.y.coded_step_mm={y_step}", f"axes.x.coded_step_mm={STEP}")
    _, commanded, _ = gathered(list(simulate(b.finish(), machine)))
    apart = np.abs(np.hypot(commanded[:, 0], commanded[:, 1]) - radius)
    assert max(apart, default=0.0) <= 1.5 * math.hypot(STEP, y_step)
    made = quantised(b.finish(), machine)
    start = math.dist(made.start[:2], made.centre[0])
    chord = math.dist(made.start[:2], made.end[0, :2])
    if made.is_arc[0] and chord >= max(radius * 1.01, 3 * y_step):
        assert math.dist(made.end[0, :2], made.centre[0]) == pytest.approx(start, abs=1e-9)


def test_ends_that_the_program_put_at_two_radii_stay() -> None:
    b = ToolpathBuilder((1.0, 0.0, 0.0)).arc(0, 1.1, centre=(0, 0), ccw=True, feed=10)
    assert quantised(b.finish(), path_machine()).centre[0].tolist() == [0.0, 0.0]
    (chunk,) = simulate(b.finish(), path_machine())
    angle = np.arctan2(chunk.commanded[:, 1], chunk.commanded[:, 0])
    radius = np.hypot(chunk.commanded[:, 0], chunk.commanded[:, 1])
    assert radius == pytest.approx(1.0 + 0.1 * angle / (0.5 * math.pi))


@given(jobs(), machines())
def test_any_machine_keeps_its_slides_within_its_play(
    toolpath: Toolpath, machine: Machine
) -> None:
    chunks = list(simulate(toolpath, machine, Options(chunk_steps=500)))
    made = quantised(toolpath, machine)
    seconds = np.zeros(len(toolpath))
    for chunk in chunks:
        seconds[chunk.ledger.row] += chunk.ledger.duration_s
        for index, axis in enumerate(machine.axes):
            motor = chunk.commanded[:, index] * (axis.real_step_mm / axis.coded_step_mm)
            lag = chunk.slide[:, index] - motor
            assert np.abs(lag).max(initial=0.0) <= axis.backlash_mm + 1e-12
    feeds, straight = made.is_feed, made.is_motion & ~made.is_arc
    least = 60.0 * move_lengths(made)[feeds] / made.feed[feeds]
    assert (seconds[feeds] >= least - 1e-9).all()
    for index, axis in enumerate(machine.axes):
        if axis.max_rate_mm_min is not None and len(made):
            way = np.abs(made.end - made.starts)[straight, index]
            assert (seconds[straight] >= 60.0 * way / axis.max_rate_mm_min - 1e-9).all()
