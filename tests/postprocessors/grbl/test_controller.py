"""grbl from the program to the slides: positions, counts and times."""

import math

import numpy as np
import pytest

from camtool.errors import MachineError, ProgramError
from camtool.findings import Severity
from camtool.machine.model import Machine
from camtool.simulation.motion import CHUNK_STEPS, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.gcode_machines import grbl_machine
from tests.oracles.grbl_run import F, chord_ends, nearest_step, number_as_read, ticks
from tests.oracles.motion_rows import RowMotion, rows_of
from tests.targets import simulate

STEP = 0.004


def run(path: Toolpath, machine: Machine, chunk_steps: int = CHUNK_STEPS) -> list[RowMotion]:
    return rows_of(simulate(path, machine, Options(chunk_steps=chunk_steps)))


def awake(*settings: str) -> Machine:
    """grbl whose stops hold nothing."""
    return grbl_machine("controller.idle_delay_ms=255", *settings)


def seconds(path: Toolpath, machine: Machine) -> list[float]:
    return [row.duration_s for row in run(path, machine)]


def part() -> Toolpath:
    """Lines in all directions, arcs, helices, events, moves below a step and of none."""
    builder = ToolpathBuilder()
    builder.event(Kind.SPINDLE_CW, 1000.0).rapid(0.0, 0.0, 5.0).rapid(3.0, 1.002, 5.0)
    builder.line(3.0, 1.002, -0.5, feed=60.0).line(3.001, 1.003, -0.5, feed=100.0)
    builder.line(3.001, 1.003, -0.5, feed=100.0).arc(
        2.0, 2.002, -0.5, centre=(2.0, 1.002), ccw=True, feed=300.0
    )
    builder.arc(2.0, 2.002, -1.0, centre=(2.5, 2.002), ccw=False, feed=200.0)
    builder.message("half way").line(-1.234, 0.567, -0.25, feed=500.0)
    builder.event(Kind.DWELL, 0.21).line(-1.234, 0.617, -0.3, feed=20.0)
    builder.rapid(-1.234, 0.617, 5.0).set_position(0.0, 0.0, 5.0).event(Kind.HOME_XY)
    return builder.event(Kind.END).rapid(50.0, 50.0, 5.0).finish()


def literal(path: Toolpath) -> list[list[tuple[int, ...]]]:
    """The step events of each row of a program in three decimals."""
    rows = []
    at_mm = tuple(number_as_read(f"{v:.3f}") for v in path.start)
    at = [nearest_step(v, F(1.0 / STEP)) for v in at_mm]
    for move in path:
        events: list[tuple[int, ...]] = []
        end = tuple(number_as_read(f"{v:.3f}") for v in move.end)
        targets = []
        if move.centre is not None:
            i, j = (
                number_as_read(f"{c - s:.3f}")
                for c, s in zip(move.centre, move.start[:2], strict=True)
            )
            targets = chord_ends(at_mm, end, (i, j), move.kind == Kind.ARC_CW, 0.002)
        elif move.kind in (Kind.RAPID, Kind.LINE, Kind.HOME_XY):
            targets = [end]
        for target in targets:
            goal = [nearest_step(v, F(1.0 / STEP)) for v in target]
            way = (goal[0] - at[0], goal[1] - at[1], goal[2] - at[2])
            events += [tuple(a + s for a, s in zip(at, tick, strict=True)) for tick in ticks(way)]
            at, at_mm = goal, end
        rows.append(events)
        if move.kind == Kind.END:
            break
    return rows


@pytest.mark.parametrize("chunk_steps", [1, 7, 1000, 1 << 16])
def test_motion_is_that_of_the_loop(chunk_steps: int) -> None:
    wanted = literal(part())
    found = run(part(), grbl_machine(), chunk_steps=chunk_steps)
    assert len(found) == len(wanted) == 15
    before = np.zeros((1, 3))
    for row, events in zip(found, wanted, strict=True):
        steps = np.array(events, dtype=np.float64).reshape(-1, 3)
        assert (row.commanded == steps * STEP).all()
        assert (row.slide == row.commanded).all()
        assert row.iterations == len(events)
        taken = np.abs(np.diff(np.concatenate([before, steps]), axis=0)).sum(axis=0)
        assert row.steps.tolist() == taken.tolist()
        before = steps[-1:] if len(steps) else before
        assert row.ended
        assert row.compensation_s == 0.0


def test_times_do_not_depend_on_chunks() -> None:
    whole, split = (run(part(), grbl_machine(), chunk_steps=k) for k in (1 << 16, 11))
    for one, other in zip(whole, split, strict=True):
        assert other.duration_s == pytest.approx(one.duration_s, abs=1e-12)


def test_rounding_does_not_add_up() -> None:
    builder = ToolpathBuilder()
    for k in range(1, 1001):
        builder.line(round(k * 0.001, 3), 0.0, 0.0, feed=100.0)
    rows = run(builder.finish(), grbl_machine())
    assert rows[-2].commanded[-1, 0] == pytest.approx(1.0, abs=1e-12)
    assert sum(int(row.steps[0]) for row in rows) == 250
    assert sum(len(row.commanded) == 0 for row in rows) == 750


def test_one_trapezoid() -> None:
    """100 mm at 500 mm/min, 10 mm/s²: d/v + v/a."""
    path = ToolpathBuilder().rapid(100.0, 0.0, 0.0).finish()
    v = 500.0 / 60.0
    assert seconds(path, awake()) == pytest.approx([100.0 / v + v / 10.0])


def test_one_triangle() -> None:
    """2 mm is too short to reach 500 mm/min: 2 √(d/a)."""
    path = ToolpathBuilder().rapid(2.0, 0.0, 0.0).finish()
    assert seconds(path, awake()) == pytest.approx([2.0 * math.sqrt(2.0 / 10.0)])


def test_two_axes_share_the_limits() -> None:
    """At 45° each axis may have its own 500 mm/min and 10 mm/s²."""
    path = ToolpathBuilder().rapid(100.0, 100.0, 0.0).finish()
    v, a, d = 500.0 / 60.0 * math.sqrt(2.0), 10.0 * math.sqrt(2.0), 100.0 * math.sqrt(2.0)
    assert seconds(path, awake()) == pytest.approx([d / v + v / a])


def test_a_rectangle() -> None:
    """Corners of 90°: v² = a √2 · δ s/(1 − s), s = sin 45°, for a √2 is what both axes give."""
    builder = ToolpathBuilder()
    for x, y in ((40.0, 0.0), (40.0, 20.0), (0.0, 20.0), (0.0, 0.0)):
        builder.line(x, y, 0.0, feed=300.0)
    machine = awake()
    s = math.sqrt(0.5)
    corner = math.sqrt(10.0 * math.sqrt(2.0) * 0.01 * s / (1.0 - s))
    v, a = 5.0, 10.0

    def side(d: float, first: float, last: float) -> float:
        ramps = (2.0 * v**2 - first**2 - last**2) / (2.0 * a)
        return (2.0 * v - first - last) / a + (d - ramps) / v

    wanted = [side(40, 0, corner), side(20, corner, corner), side(40, corner, corner)]
    assert seconds(builder.finish(), machine) == pytest.approx([*wanted, side(20, corner, 0)])


def circle(radius: float, feed: float = 400.0) -> Toolpath:
    builder = ToolpathBuilder((radius, 0.0, 0.0))
    return builder.arc(radius, 0.0, 0.0, centre=(0.0, 0.0), ccw=True, feed=feed).finish()


def test_a_circle_takes_its_polygon() -> None:
    """⌊π r / √(δ(2r − δ))⌋ chords of 2 r sin(π/n); they slow nothing down at this feed. Away
    from the axis the first and last chords may ramp a little faster than 10 mm/s²."""
    n = int(math.pi * 10.0 / math.sqrt(0.002 * (20.0 - 0.002)))
    v = 400.0 / 60.0
    way = n * 20.0 * math.sin(math.pi / n)
    fine = ("axes.x.coded_step_mm=0.0001", "axes.y.coded_step_mm=0.0001")
    found = seconds(circle(10.0), awake(*fine))[0]
    assert found == pytest.approx(way / v + v / 10.0, rel=2e-4)


def test_the_buffer_bounds_the_speed_on_short_chords() -> None:
    """With chords of c mm and 15 blocks in the buffer, all but the one under way must suffice to
    stop: v ≤ √(2 a · 14 c)."""
    machine = grbl_machine("controller.arc_tolerance_mm=0.00005", "axes.x.coded_step_mm=0.0001",
                           "axes.y.coded_step_mm=0.0001")  # fmt: skip
    n = int(math.pi * 10.0 / math.sqrt(0.00005 * (20.0 - 0.00005)))
    chord = 20.0 * math.sin(math.pi / n)
    a = 10.0  # along an axis; 14.1 at 45°
    slow, fast = (math.sqrt(2.0 * k * a * 14.0 * chord) for k in (1.0, math.sqrt(2.0)))
    found = 20.0 * math.pi / seconds(circle(10.0, feed=480.0), machine)[0]
    assert fast < 8.0
    assert 0.9 * slow < found < fast


def test_fourteen_blocks_must_suffice_to_stop() -> None:
    """Many lines of 0.1 mm straight on: each is entered at v² = 2 a · 1.4 mm."""
    builder = ToolpathBuilder()
    for k in range(1, 201):
        builder.line(0.1 * k, 0.0, 0.0, feed=500.0)
    entry = math.sqrt(2.0 * 10.0 * 14 * 0.1)
    peak = math.sqrt(entry**2 + 10.0 * 0.1)
    found = seconds(builder.finish(), grbl_machine())[100]
    assert found == pytest.approx(2.0 * (peak - entry) / 10.0)


def test_a_row_that_ends_with_a_chunk_is_not_in_the_next() -> None:
    path = ToolpathBuilder().rapid(0.04, 0.0, 0.0).rapid(0.0, 0.0, 0.0).finish()
    assert [row.parts for row in run(path, grbl_machine(), chunk_steps=10)] == [1, 1]
    assert [row.parts for row in run(path, grbl_machine(), chunk_steps=6)] == [2, 3]


@pytest.mark.parametrize("tolerance", [0.002, 0.02])
def test_chords_lie_inside_by_their_sagitta_and_the_drift(tolerance: float) -> None:
    """r (1 − cos(θ/2)), and what twelve turns by the short series lose: a turn shortens the
    radius by the factor √(1 − θ⁴/12 + θ⁶/36), about 1 − θ⁴/24."""
    fine = [f"axes.{axis}.coded_step_mm=0.00005" for axis in "xy"]
    machine = grbl_machine(f"controller.arc_tolerance_mm={tolerance}", *fine)
    points = run(circle(10.0), machine)[0].commanded
    radius = np.hypot(points[:, 0], points[:, 1])
    n = int(math.pi * 10.0 / math.sqrt(tolerance * (20.0 - tolerance)))
    theta = 2.0 * math.pi / n
    sagitta = 10.0 * (1.0 - math.cos(0.5 * theta))
    drift = 12.0 * 10.0 * theta**4 / 24.0
    assert 0.95 * tolerance < sagitta < 1.05 * tolerance
    assert 10.0 - radius.min() == pytest.approx(sagitta + drift, abs=0.0001)
    assert radius.max() < 10.0001


def test_events_bring_the_machine_to_rest() -> None:
    v, a = 5.0, 10.0
    one = ToolpathBuilder().line(5.0, 0.0, 0.0, feed=300.0).line(10.0, 0.0, 0.0, feed=300.0)
    passing = sum(seconds(one.finish(), awake()))
    assert passing == pytest.approx(10.0 / v + v / a)
    for kind in (Kind.SPINDLE_CW, Kind.SPINDLE_CCW, Kind.COOLANT_FLOOD, Kind.TOOL_CHANGE):
        two = ToolpathBuilder().line(5.0, 0.0, 0.0, feed=300.0).event(kind, 1.0)
        found = seconds(two.line(10.0, 0.0, 0.0, feed=300.0).finish(), awake())
        assert sum(found) == pytest.approx(10.0 / v + 2.0 * v / a)


def test_a_message_stops_nothing() -> None:
    two = ToolpathBuilder().line(5.0, 0.0, 0.0, feed=300.0).message("on we go")
    path = two.line(10.0, 0.0, 0.0, feed=300.0).finish()
    assert sum(seconds(path, awake())) == pytest.approx(10.0 / 5.0 + 0.5)


@pytest.mark.parametrize(("said", "taken"), [(2.0, 2.0), (0.21, 0.25), (0.0, 0.0), (0.001, 0.05)])
def test_dwells_are_whole_twentieths(said: float, taken: float) -> None:
    path = ToolpathBuilder().event(Kind.DWELL, said).finish()
    assert seconds(path, grbl_machine()) == pytest.approx([taken])


def test_a_way_back_starts_from_rest() -> None:
    path = ToolpathBuilder().rapid(2.0, 0.0, 0.0).rapid(0.0, 0.0, 0.0).finish()
    assert seconds(path, awake()) == pytest.approx([2.0 * math.sqrt(0.2)] * 2)


def test_play_shows_at_reversals() -> None:
    machine = grbl_machine("axes.x.backlash_mm=0.1")
    path = ToolpathBuilder().rapid(2.0, 0.0, 0.0).rapid(0.0, 0.0, 0.0).finish()
    out, back = run(path, machine)
    assert (out.slide == out.commanded).all()
    assert back.slide[-1, 0] == pytest.approx(0.1)
    assert back.reversals.tolist() == [1, 0, 0]


def test_radius_0_and_no_rows() -> None:
    path = ToolpathBuilder().arc(0.0, 0.0, 0.0, centre=(0.0, 0.0), ccw=True, feed=100.0).finish()
    (row,) = run(path, grbl_machine())
    assert len(row.commanded) == 0
    assert row.duration_s == 0.0
    assert run(ToolpathBuilder().finish(), grbl_machine()) == []


def test_positions_at_the_limit() -> None:
    far = ToolpathBuilder().rapid(2.147e6, 0.0, 0.0).finish()
    chunk = next(iter(simulate(far, grbl_machine())))
    assert chunk.commanded[0, 0] == pytest.approx(STEP)
    with pytest.raises(ProgramError, match="count"):
        list(simulate(ToolpathBuilder().rapid(2.148e6, 0.0, 0.0).finish(), grbl_machine()))


def test_a_compensation_is_refused() -> None:
    path = ToolpathBuilder().rapid(1.0, 0.0, 0.0).finish()
    with pytest.raises(MachineError, match="does not compensate backlash"):
        simulate(path, grbl_machine("axes.y.compensation_mm=0.01"))


def test_a_feed_is_needed() -> None:
    path = ToolpathBuilder().line(1.0, 0.0, 0.0, feed=float("nan")).finish()
    with pytest.raises(ProgramError, match="without a feed"):
        simulate(path, grbl_machine())


@pytest.mark.parametrize("idle_ms", [0, 1, 25, 254])
def test_each_stop_holds_what_comes_next(idle_ms: int) -> None:
    """A stop stands after the last block before a wait, however many waits follow, and none where
    nothing moved."""
    builder = ToolpathBuilder().event(Kind.SPINDLE_CW, 1000.0).rapid(1.0, 0.0, 0.0)
    builder.line(2.0, 1.0, 0.0, feed=100.0).event(Kind.SPINDLE_OFF).event(Kind.DWELL, 0.1)
    builder.event(Kind.DWELL, 0.1).line(2.0, 3.0, 0.0, feed=100.0).message("on")
    path = builder.line(2.0, 3.0, 0.0, feed=100.0).event(Kind.END).finish()
    held = grbl_machine(f"controller.idle_delay_ms={idle_ms}")
    longer = np.array(seconds(path, held)) - seconds(path, awake())
    assert longer == pytest.approx([0, 0, idle_ms / 1000, 0, 0, 0, idle_ms / 1000, 0, 0, 0])
    assert seconds(ToolpathBuilder().event(Kind.END).finish(), held) == [0.0]


@pytest.mark.parametrize(
    ("firmware", "dwell_s"), [("grbl", 0.15), ("grblHAL", 0.15), ("FluidNC", 0.111)]
)
def test_dwells_and_stops_of_each_firmware(firmware: str, dwell_s: float) -> None:
    """FluidNC counts whole ms, the others 50 ms; only grbl waits at a stop ($1 = 25 ms)."""
    builder = ToolpathBuilder().rapid(1.0, 0.0, 0.0).event(Kind.DWELL, 0.1119)
    path = builder.rapid(0.0, 0.0, 0.0).finish()
    found = seconds(path, grbl_machine(f"controller.firmware={firmware}"))
    assert found[1] == pytest.approx(dwell_s)
    idle_s = 0.025 if firmware == "grbl" else 0.0
    assert np.array(found)[[0, 2]] - np.array(seconds(path, awake()))[[0, 2]] == pytest.approx(
        idle_s
    )


@pytest.mark.parametrize("feed", [1.0, 3.0, 5.0])
def test_no_step_takes_longer_than_the_timer_s_longest_tick(feed: float) -> None:
    """65535 · 8 cycles of 16 MHz a step, along an axis and aslant."""
    path = ToolpathBuilder().line(1.0, 0.0, 0.0, feed=feed).line(2.0, 0.5, 0.0, feed=feed).finish()
    assert seconds(path, awake()) == pytest.approx([250 * 65535 * 8 / 16e6] * 2, rel=0.002)
    fine = awake("controller.least_step_hz=3.815")
    assert seconds(path, fine)[0] == pytest.approx(60.0 / max(feed, 0.9156), rel=0.001)


def test_a_feed_that_is_too_slow_is_found() -> None:
    """7.32 mm/min are 30.518 steps of 0.004 mm a second; √2 of it at 45°."""
    target = load_target("grbl")
    read = target.target.read
    (found,) = read(b"G1 X1 F5\nX2 Y1 F9\nM2\n", target.machine).findings
    assert (found.code, found.severity) == (ProgramCode.FEED_TOO_SLOW, Severity.WARNING)
    assert found.message.startswith("2 cuts are slower")
    assert (found.measured, found.limit) == (5.0, pytest.approx(7.324, abs=1e-3))
    assert read(b"G1 X1 F7.33\nX2 Y1 F10.36\nG2 X0 I-1 F7.33\nM2\n", target.machine).findings == ()
    faster = load_target("grbl", settings=["controller.least_step_hz=1"]).machine
    assert read(b"G1 X1 F5\nM2\n", faster).findings == ()
