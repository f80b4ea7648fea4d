"""The PIC controller as a whole: against a literal run, and row by row by hand."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from camtool.errors import MachineError, ProgramError
from camtool.machine.model import Machine
from camtool.simulation.motion import IDEAL, Options
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles import motion_rows
from tests.oracles.motion_rows import RowMotion
from tests.oracles.pic_mmh_run import LiteralRun
from tests.targets import simulate, verify

STEP = 0.00014
HZ = 0.8 / 60.0 / STEP
"""Steps a second at F08: 95.24."""

MakeMachine = Callable[..., Machine]


def rows_of(
    toolpath: Toolpath, machine: Machine, options: Options | None = None
) -> list[RowMotion]:
    """Return the record of each row of the simulation."""
    return motion_rows.rows_of(simulate(toolpath, machine, options))


def steps_of(row: RowMotion, z_step_mm: float = STEP) -> np.ndarray:
    """(K, 3) steps commanded in a row."""
    return np.rint(row.commanded / [STEP, STEP, z_step_mm]).astype(np.int64)


def random_program(rng: np.random.Generator) -> Toolpath:
    """Lines, arcs, Z moves, rapids and dwells on hundredths of a micrometre, R up to 60 steps.

    Ends of arcs are taken on their simulated paths, so that they are met.
    """
    path = ToolpathBuilder()
    for _ in range(12):
        choice = int(rng.integers(5))
        feed = float(rng.integers(1, 14)) / 10.0
        if choice == 0:
            path.line(*hundredths(rng, 2), feed=feed)
        elif choice == 1:
            path.rapid(*hundredths(rng, 3))
        elif choice == 2:
            path.line(*hundredths(rng, 3), feed=feed)
        elif choice == 3:
            path.event(Kind.DWELL, float(rng.integers(0, 100)))
        else:
            cx, cy = hundredths(rng, 2)
            x, y, _ = path.position
            ccw = bool(rng.integers(2))
            # An end on an axis of the circle or a whole turn; "met" is what the test asserts.
            end = (x, y) if rng.integers(2) else (2 * cx - x, 2 * cy - y)
            path.arc(round(end[0], 5), round(end[1], 5), centre=(cx, cy), ccw=ccw, feed=feed)
    return path.finish()


def hundredths(rng: np.random.Generator, count: int) -> list[float]:
    return [int(n) / 100_000 for n in rng.integers(-600, 601, count)]


SETTINGS = [
    (),
    ("controller.arcs=stairs", "controller.time_base=iteration"),
    ("controller.arcs=dda", "controller.time_base=iteration"),
    ("controller.arcs=dda", "controller.start_play=centred", "controller.start_direction=-"),
    ("controller.initial_error=rounded-radius", "axes.x.real_step_mm=0.000139509"),
    ("controller.initial_error=rounded-radius", "axes.z.coded_step_mm=0.0002"),
]


@pytest.mark.parametrize("settings", SETTINGS, ids=" ".join)
def test_random_programs_equal_the_literal_run(
    make_machine: MakeMachine, settings: tuple[str, ...]
) -> None:
    """Samples, slides, times, passes, steps and reversals of every row."""
    # By the strictest reading: the literal machine runs on until an arc stands on its end.
    equal = "controller.arc_end=equal"
    small = (equal, "axes.x.backlash_mm=0.0033", "axes.x.compensation_mm=0.00412")
    machine = make_machine(
        *small, "axes.y.backlash_mm=0.002", "axes.z.backlash_mm=0.001", *settings
    )
    rng = np.random.default_rng(60)
    arcs = 0
    for _ in range(40):
        toolpath = random_program(rng)
        literal = LiteralRun(toolpath, machine)
        for move, row in zip(toolpath, rows_of(toolpath, machine), strict=True):
            if not row.ended:
                break  # the literal machine would never come back
            want = literal.row(move)
            arcs += toolpath.is_arc[move.index]
            got = steps_of(row, machine.axes.z.coded_step_mm)
            assert np.array_equal(got, np.array(want.commanded, dtype=np.int64).reshape(-1, 3))
            off = np.abs(row.slide - np.array(want.slide).reshape(-1, 3))
            assert off.max(initial=0.0) <= 1e-15
            assert row.iterations == want.passes
            assert row.duration_s == pytest.approx(want.seconds, rel=1e-12)
            assert row.steps.tolist() == list(want.steps)
            assert row.reversals.tolist() == list(want.reversals)
    assert arcs > 20


@pytest.mark.parametrize("reading", ["equal", "final-quadrant", "nearest"])
@pytest.mark.parametrize("size", [1, 3, 50, 4096])
def test_the_size_of_chunks_does_not_matter(
    make_machine: MakeMachine, size: int, reading: str
) -> None:
    machine = make_machine(f"controller.arc_end={reading}")
    path = ToolpathBuilder().rapid(0.01, 0.003, 0.002).line(-0.002, 0.01, feed=0.8)
    path.arc(-0.002, 0.01, centre=(0.005, 0.004), ccw=True, feed=0.4).rapid(0.14, 0, 0)
    path.arc(0, 0.14028, centre=(0, 0), ccw=True, feed=0.4)
    toolpath = path.finish()
    chunks = list(simulate(toolpath, machine, Options(chunk_steps=size)))
    assert all(len(chunk.commanded) <= size for chunk in chunks)
    whole, parts = rows_of(toolpath, machine), motion_rows.rows_of(chunks)
    assert whole[-1].ended == (reading != "equal")
    motion_rows.assert_same_rows(whole, parts)


def test_lines_end_on_their_step_and_stay_within_one(machine: Machine) -> None:
    """Each axis lags the true line by 0 to 1 steps: the distance is below max(a, b)/L steps."""
    rng = np.random.default_rng(61)
    for _ in range(60):
        end = rng.integers(-40_000, 40_000, 2) / 100_000
        toolpath = ToolpathBuilder().line(*end.tolist(), feed=0.8).finish()
        points = steps_of(rows_of(toolpath, machine)[0])[:, :2]
        goal = np.array([math.copysign(math.floor(abs(v) / STEP + 0.5 + 1e-6), v) for v in end])
        assert np.array_equal(points[-1], goal)
        length = np.hypot(*goal)
        away = np.abs(points[:, 0] * goal[1] - points[:, 1] * goal[0]) / length
        assert away.max() < 1.0


def quarter(machine: Machine, ccw: bool, radius: int) -> RowMotion:
    """A quarter from the top on whole steps."""
    r = radius * STEP
    end = (-r, 0.0) if ccw else (r, 0.0)
    path = ToolpathBuilder((0.0, r, 0.0)).arc(*end, centre=(0, 0), ccw=ccw, feed=0.8)
    return rows_of(path.finish(), machine)[0]


@pytest.mark.parametrize("radius", [1, 2, 30, 214, 7143])
def test_quarters_end_on_their_step_and_are_mirrored(machine: Machine, radius: int) -> None:
    right, left = quarter(machine, False, radius), quarter(machine, True, radius)
    assert right.ended
    points = steps_of(right)[:, :2]
    assert points[-1].tolist() == [radius, 0]
    assert np.abs(np.hypot(points[:, 0], points[:, 1]) - radius).max() < 0.5
    assert np.array_equal(steps_of(left)[:, :2], points * [-1, 1])
    assert right.duration_s == pytest.approx(
        (len(points) + 1271) / HZ  # Y goes down: a compensation of 178 µm
    )


def test_circles_have_every_symmetry_of_the_square(machine: Machine) -> None:
    """DSM, stairs and the DDA alike: a turned start gives the turned path."""
    start = np.array([17, -29])
    for method in ("dsm", "stairs", "dda"):
        paths = []
        for turns in range(4):
            turned = np.linalg.matrix_power(np.array([[0, -1], [1, 0]]), turns)
            x, y = (turned @ start * STEP).tolist()
            path = ToolpathBuilder((x, y, 0.0)).arc(x, y, centre=(0, 0), ccw=True, feed=0.8)
            row = rows_of(path.finish(), machine, Options(method))[0]
            paths.append(steps_of(row)[:, :2] @ turned)
        assert all(np.array_equal(path, paths[0]) for path in paths[1:])
        assert len(paths[0]) > 100


def test_there_by_cw_and_back_by_ccw(machine: Machine) -> None:
    r = 1000 * STEP
    path = ToolpathBuilder((0.0, r, 0.0)).arc(r, 0, centre=(0, 0), ccw=False, feed=0.8)
    path.arc(0, r, centre=(0, 0), ccw=True, feed=0.8)
    there, back = rows_of(path.finish(), machine)
    assert steps_of(back)[-1].tolist() == [0, 1000, 0]
    assert there.reversals.tolist() == [0, 1, 0]
    assert back.reversals.tolist() == [1, 1, 0]
    assert len(steps_of(there)) == len(steps_of(back))


def test_times_by_hand(make_machine: MakeMachine) -> None:
    """F08 is 95.24 Hz; an axis line of n steps has n events and n + 1 passes."""
    path = ToolpathBuilder().line(0.014, 0, feed=0.8).line(0.028, 0.014, feed=0.4)
    path.rapid(0.042, 0.014).event(Kind.DWELL, 7.0).event(Kind.SPINDLE_CW, 3000.0)
    toolpath = path.finish()
    assert pytest.approx(95.238, abs=0.001) == HZ
    by_event = [row.duration_s for row in rows_of(toolpath, make_machine())]
    assert by_event == pytest.approx([100 / HZ, 200 / HZ, 100 / 166.0, 7.0, 0.0])
    slow = make_machine("controller.time_base=iteration")
    line, diagonal, rapid, *_ = rows_of(toolpath, slow)
    assert line.duration_s == pytest.approx(101 / HZ)
    assert line.iterations == 101
    assert diagonal.duration_s == pytest.approx(2 * diagonal.iterations / HZ)
    assert diagonal.iterations == pytest.approx(100 * math.sqrt(2.0), abs=1.0)
    assert rapid.duration_s == pytest.approx(101 / 166.0)


def test_the_link_holds_what_is_faster(make_machine: MakeMachine) -> None:
    """From F14 on the times are those of 166 steps a second, in chunks and on the way."""
    machine = make_machine()
    for feed, hertz in ((1.3, 1.3 / (60.0 * STEP)), (1.4, 166.0), (9.9, 166.0)):
        path = ToolpathBuilder().line(101 * STEP, 0.0, feed=feed).line(z=-50 * STEP, feed=feed)
        toolpath = path.finish()
        flat, deep = rows_of(toolpath, machine)
        assert flat.duration_s == pytest.approx(101 / hertz)
        assert deep.duration_s == pytest.approx(50 / hertz)
        assert verify(toolpath, machine).report.time_s == pytest.approx(151 / hertz)


def test_a_reversal_takes_the_compensation_at_the_same_rate(machine: Machine) -> None:
    """204 µm are 1457 steps of 140 nm; the slide then is too far by 204 − 192.5 µm."""
    path = ToolpathBuilder().line(0.14, 0, feed=0.8).line(0, 0, feed=0.8).line(0.14, 0, feed=0.8)
    out, back, again = rows_of(path.finish(), machine)
    assert out.reversals.tolist() == [0, 0, 0]
    assert back.reversals.tolist() == [1, 0, 0]
    assert back.steps.tolist() == [1000, 0, 0]
    assert back.duration_s == pytest.approx((1000 + 1457) / HZ)
    assert out.slide[-1, 0] == pytest.approx(0.14)
    assert back.slide[-1, 0] == pytest.approx(-(1457 * STEP - 0.1925))
    assert again.slide[-1, 0] == pytest.approx(0.14)


def test_play_without_compensation(make_machine: MakeMachine) -> None:
    machine = make_machine("axes.x.compensation_mm=0.0")
    path = ToolpathBuilder().line(0.28, 0, feed=0.8).line(0, 0, feed=0.8)
    _, back = rows_of(path.finish(), machine)
    assert back.slide[:, 0] == pytest.approx(
        np.minimum(0.28, steps_of(back)[:, 0] * STEP + 0.1925)
    )


def test_ideal_slides_are_where_they_are_commanded(make_machine: MakeMachine) -> None:
    machine = make_machine("axes.x.real_step_mm=0.000139509", "axes.y.real_step_mm=0.0002")
    path = ToolpathBuilder().line(0.1, 0.03, 0.01, feed=0.8).line(0, 0, feed=0.8)
    path.arc(0, 0, centre=(-0.02, 0.01), ccw=True, feed=0.8)
    for row in rows_of(path.finish(), machine, Options(effects=IDEAL)):
        assert np.array_equal(row.slide, row.commanded)
        assert row.duration_s == pytest.approx(len(row.commanded) / HZ)
    real = rows_of(path.finish(), machine)[0]
    assert real.slide == pytest.approx(steps_of(real) * [0.000139509, 0.0002, STEP])


def test_z_follows_xy(machine: Machine) -> None:
    row = rows_of(ToolpathBuilder().line(0.0014, 0.0007, -0.0028, feed=0.8).finish(), machine)[0]
    points = steps_of(row)
    xy = points[points[:, 2] == 0]
    assert xy[-1].tolist() == [10, 5, 0]
    assert points[len(xy) :].tolist() == [[10, 5, -k] for k in range(1, 21)]
    assert row.reversals.tolist() == [0, 0, 1]


def test_homing_goes_to_machine_zero_at_the_rapid_rate(make_machine: MakeMachine) -> None:
    machine = make_machine("controller.machine_zero_mm=[0.014, 0.0, 0.0028]")
    path = ToolpathBuilder().event(Kind.HOME_Z).event(Kind.HOME_XY).set_position(0.014, 0, 0.0028)
    path.line(0.028, 0, feed=0.8)
    up, over, on = rows_of(path.finish(), machine)
    assert steps_of(up)[-1].tolist() == [0, 0, 20]
    assert up.duration_s == pytest.approx(20 / 166.0)
    assert steps_of(over)[-1].tolist() == [100, 0, 20]
    assert over.duration_s == pytest.approx(100 / 166.0)
    assert len(steps_of(on)) == 100


def test_nothing_runs_behind_the_end(machine: Machine) -> None:
    path = ToolpathBuilder().line(0.001, 0, feed=0.8).event(Kind.END).line(0, 0, feed=0.8)
    assert len(rows_of(path.finish(), machine)) == 2


def test_rows_that_do_not_move_have_no_samples(machine: Machine) -> None:
    path = ToolpathBuilder().event(Kind.SET_ZERO).line(0, 0, feed=0.8).message("hello").rapid(0, 0)
    for row in rows_of(path.finish(), machine):
        assert len(row.commanded) == 0
        assert row.ended
        assert row.duration_s == 0.0


@pytest.mark.parametrize("feed", [math.nan, 0.0, -1.0, math.inf])
@pytest.mark.parametrize("is_arc", [True, False])
def test_a_move_without_a_feed_names_its_block(
    machine: Machine, feed: float, is_arc: bool
) -> None:
    path = ToolpathBuilder().line(1e-3, 0, feed=0.8)
    path.block = 6
    if is_arc:
        path.arc(1e-3, 0, centre=(0, 0), ccw=True, feed=feed)
    else:
        path.line(0, 0, -0.001, feed=feed)
    with pytest.raises(ProgramError, match=r"block 7: .*feed"):
        list(simulate(path.finish(), machine))


def test_rows_that_cannot_be_followed(machine: Machine, make_machine: MakeMachine) -> None:
    cases = [
        (ToolpathBuilder().event(Kind.DWELL), "move 0: a dwell"),
        (ToolpathBuilder().event(Kind.DWELL, -1.0), "move 0: a dwell"),
        (ToolpathBuilder().rapid(1e-3).event(Kind.SET_ZERO), "move 1: part zero"),
        (ToolpathBuilder().rapid(1e9), "move 0: a position"),
        (ToolpathBuilder().arc(1, 0, centre=(math.nan, 0), ccw=True, feed=1), "without a centre"),
    ]
    for path, message in cases:
        with pytest.raises(ProgramError, match=message):
            list(simulate(path.finish(), machine))
    with pytest.raises(MachineError, match="coded_step_mm"):
        simulate(ToolpathBuilder().finish(), make_machine("axes.x.coded_step_mm=0.0002"))
