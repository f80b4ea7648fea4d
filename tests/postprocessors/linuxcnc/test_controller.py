"""LinuxCNC from the program to the slides, and against LinuxCNC itself."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from camtool_postprocessors.linuxcnc.controller import LinuxcncSamples, halve_arcs, merge_rows
from camtool_postprocessors.linuxcnc.steps import merge_lines
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.errors import MachineError, ProgramError
from camtool.machine.model import Machine
from camtool.simulation.motion import CHUNK_STEPS, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.gcode_machines import linuxcnc_machine
from tests.oracles.linuxcnc_run import MEASURED, MODES, Measured, Modes, merge, off_line
from tests.oracles.motion_rows import RowMotion, rows_of
from tests.targets import model_of, simulate

pytestmark = pytest.mark.checked

PERIOD = 0.001
V, A = 30.48, 508.0


def said(path: Toolpath, machine: Machine) -> tuple[str, ...]:
    return model_of(machine).assumptions(path, machine)


def run(path: Toolpath, machine: Machine, chunk_steps: int = CHUNK_STEPS) -> list[RowMotion]:
    return rows_of(simulate(path, machine, Options(chunk_steps=chunk_steps)))


def read(program: str, machine: Machine) -> Toolpath:
    path: Toolpath = load_target("linuxcnc").target.read(program.encode(), machine)
    return path


def total(path: Toolpath, machine: Machine) -> float:
    return sum(row.duration_s for row in run(path, machine))


def in_mode(mode: str, tolerance_mm: float = 0.01, *settings: str) -> Machine:
    said = (f"dialect.path={mode}", f"dialect.blend_tolerance_mm={tolerance_mm or 0.01}")
    return linuxcnc_machine(*said, *settings)


def from_rest(d: float, v: float, a: float) -> float:
    """A trapezoid or triangle, to the nearest period, and two to come to rest."""
    peak = min(v, math.sqrt(a * d))
    seconds = d / peak + peak / a if peak == v else 2.0 * math.sqrt(d / a)
    return (round(seconds / PERIOD) + 2) * PERIOD


@pytest.mark.parametrize("case", MEASURED, ids=lambda case: case.name)
def test_linuxcnc_itself(case: Measured) -> None:
    """Times within six periods or 1.1 %, corners of lines within 0.2 µm (the trace was
    sampled)."""
    machine = in_mode(case.mode, case.tolerance_mm)
    path = load_target("linuxcnc").target.read(
        f"G21 G17 G90 G94\n{case.program}M2\n".encode(), machine
    )
    rows = run(path, machine)
    seconds = sum(row.duration_s for row in rows)
    assert abs(seconds - PERIOD * case.periods) < max(0.0065, 0.011 * seconds)
    left = [
        1000.0 * float(np.linalg.norm(row.commanded[-1] - end))
        for row, end in zip(rows, path.end, strict=True)
        if len(row.commanded)
    ]
    for found, wanted in zip(left, case.corners_um, strict=False):
        assert found == pytest.approx(wanted, abs=0.2)


@pytest.mark.parametrize("passed_mm", [(0.0, 0.0), (700.0, 700.0 + 6e-11), (700.0 + 6e-11, 700.0)])
def test_no_place_is_lost_on_blends_far_into_a_program(
    passed_mm: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A blend replaces all of a line of 1 µm. Behind 6,000 moves the sums of the lengths of rows
    and of moves differed in their last bits, and that line began before its own start."""

    class Later(LinuxcncSamples):
        def __init__(self, *given: Any) -> None:
            super().__init__(*given[:-1], passed_mm)

    monkeypatch.setattr("camtool_postprocessors.linuxcnc.controller.LinuxcncSamples", Later)
    program = """G17 G21 G90 G91.1 G94 G64 P0.01
        G1 X0.461 Y1.550 F500
        G3 X0.450 Y1.539 I0.000 J-0.011
        X0.467 Y1.533 I0.010 J0.000
        G1 X0.468 Y1.534
        G3 X0.461 Y1.550 I-0.007 J0.006
        X0.450 Y1.539 I0.000 J-0.011
        M2
    """
    machine = load_target("linuxcnc").machine
    rows = run(read(program, machine), machine)
    assert all(np.isfinite(row.commanded).all() for row in rows)


@pytest.mark.parametrize("case", MODES, ids=lambda case: case.program)
@pytest.mark.parametrize("own", ["blend", "exact-path", "exact-stop"])
def test_the_program_s_own_modes_are_what_linuxcnc_obeys(case: Modes, own: str) -> None:
    """Whatever the machine file says."""
    machine = in_mode(own, 0.07)
    rows = run(read(f"G21 G17 G90 G94\n{case.program}M2\n", machine), machine)
    points = [tuple(p) for p in np.concatenate([row.commanded for row in rows]).tolist()]
    for corner, wanted in case.corners_um.items():
        beside = min(
            off_line(a, b, (*corner, 0.0)) for a, b in itertools.pairwise(points)
            if a != b
        )  # fmt: skip
        assert 1000.0 * beside == pytest.approx(wanted, abs=0.3)


def test_where_the_program_says_nothing_the_machine_file_does() -> None:
    path = read("F900\nG1 X5\nY5\nM2\n", in_mode("blend"))
    assert total(path, in_mode("exact-stop")) > total(path, in_mode("blend", 0.5)) + 0.01
    modal = read("F900\nG64 P0.5 G1 X5\nY5\nM2\n", in_mode("blend"))
    assert total(modal, in_mode("exact-stop")) == total(path, in_mode("blend", 0.5))
    assert [*said(modal, in_mode("exact-stop"))][:1] == [
        "corners are blended within 0.5 mm (G64 P), as the speed needs"
    ]
    assert "(G61.1)" in said(path, in_mode("exact-stop"))[0]


def test_one_trapezoid_and_one_triangle() -> None:
    long = ToolpathBuilder().line(10.0, 0.0, 0.0, feed=600.0).finish()
    short = ToolpathBuilder().rapid(0.5, 0.0, 0.0).finish()
    machine = in_mode("exact-path")
    assert total(long, machine) == pytest.approx(from_rest(10.0, 10.0, A))
    assert total(short, machine) == pytest.approx(from_rest(0.5, V, A))


def test_a_rectangle_with_stops() -> None:
    builder = ToolpathBuilder()
    for x, y in ((40.0, 0.0), (40.0, 20.0), (0.0, 20.0), (0.0, 0.0)):
        builder.line(x, y, 0.0, feed=600.0)
    sides = [row.duration_s for row in run(builder.finish(), in_mode("exact-stop"))]
    assert sides == pytest.approx([from_rest(d, 10.0, A) for d in (40, 20, 40, 20)])


@pytest.mark.parametrize("radius", [0.2, 0.5, 2.0])
def test_turning_bounds_the_speed_of_a_circle(radius: float) -> None:
    """v² = √¾ a r, half of the acceleration along the way."""
    builder = ToolpathBuilder((radius, 0.0, 0.0))
    builder.arc(radius, 0.0, 0.0, centre=(0.0, 0.0), ccw=True, feed=1828.8)
    v = min(V, math.sqrt(math.sqrt(0.75) * A * radius))
    wanted = from_rest(2.0 * math.pi * radius, v, 0.5 * A)
    assert total(builder.finish(), in_mode("exact-path")) == pytest.approx(wanted)


@pytest.mark.parametrize("turn_deg", [60.0, 90.0, 120.0, 170.0])
def test_a_blend_is_an_arc_that_touches_both_lines(turn_deg: float) -> None:
    """All samples lie on the lines or on the circle of R = d tan θ, and T is the tolerance."""
    turn = math.radians(turn_deg)
    end = (10.0 + 10.0 * math.cos(turn), 10.0 * math.sin(turn), 0.0)
    path = ToolpathBuilder().line(10.0, 0.0, 0.0, feed=1800.0).line(*end, feed=1800.0).finish()
    tolerance = 0.2
    rows = run(path, in_mode("blend", tolerance))
    theta = 0.5 * (math.pi - turn)
    d = tolerance * math.cos(theta) / (1.0 - math.sin(theta))
    radius = d * math.tan(theta)
    inward = np.array([-math.sin(0.5 * turn), math.cos(0.5 * turn), 0.0])
    centre = np.array([10.0, 0.0, 0.0]) + radius / math.sin(theta) * inward
    assert np.linalg.norm(rows[0].commanded[-1] - (10.0, 0.0, 0.0)) == pytest.approx(tolerance)
    points = np.concatenate([row.commanded for row in rows])
    off = [min(off_line((0, 0, 0), (10, 0, 0), p), off_line((10, 0, 0), end, p)) for p in points]
    on_blend = np.array(off) > 1e-9
    assert on_blend.sum() > 10
    ring = np.linalg.norm(points[on_blend] - centre, axis=1)
    assert np.abs(ring - radius).max() < 1e-9
    assert max(off) < tolerance


def test_a_slight_bend_is_blended_as_wide_as_its_speed_needs() -> None:
    """20°, at 30 mm/s: R = v² / (a/2) / turn, narrower than 0.2 mm would allow."""
    turn = math.radians(20.0)
    path = ToolpathBuilder().line(10.0, 0.0, 0.0, feed=1800.0)
    path.line(10.0 + 10.0 * math.cos(turn), 10.0 * math.sin(turn), 0.0, feed=1800.0)
    row, _ = run(path.finish(), in_mode("blend", 0.2))
    radius = 30.0**2 / (0.5 * A) / turn
    wanted = radius * (1.0 / math.sin(0.5 * (math.pi - turn)) - 1.0)
    assert math.dist(row.commanded[-1], (10.0, 0.0, 0.0)) == pytest.approx(wanted)
    assert wanted < 0.16


def test_blends_take_no_more_than_half_a_line() -> None:
    """The tolerance is more than what moves of 0.28 mm can give."""
    builder = ToolpathBuilder()
    for k in range(1, 9):
        builder.line(0.2 * k, 0.2 * (k % 2), 0.0, feed=1800.0)
    path = builder.finish()
    rows = run(path, in_mode("blend", 0.06))
    ends = np.array([row.commanded[-1] for row in rows])
    left = np.linalg.norm(ends - path.end, axis=1).tolist()
    side = 0.2 * math.sqrt(2.0)
    assert left[:-1] == pytest.approx([0.5 * side * (math.sqrt(2.0) - 1.0)] * 7)
    assert left[-1] == 0.0


@pytest.mark.parametrize("mode", ["exact-path", "exact-stop"])
def test_exact_modes_stay_on_the_path(mode: str) -> None:
    builder = ToolpathBuilder().line(1.0, 0.0, -1.0, feed=100.0)
    builder.arc(0.0, 1.0, -1.0, centre=(0.0, 0.0), ccw=True, feed=100.0)
    path = builder.line(0.0, 3.0, 0.0, feed=100.0).finish()
    line, arc, last = run(path, in_mode(mode))
    assert (line.commanded[:, 1] == 0.0).all()
    assert np.abs(np.hypot(arc.commanded[:, 0], arc.commanded[:, 1]) - 1.0).max() < 1e-12
    assert (last.commanded[-1] == path.end[-1]).all()


def test_no_blend_between_rapids_and_feeds_or_across_waits() -> None:
    builder = ToolpathBuilder().rapid(5.0, 0.0, 0.0).line(5.0, 5.0, 0.0, feed=600.0)
    builder.event(Kind.DWELL, 0.5).line(0.0, 5.0, 0.0, feed=600.0)
    path = builder.message("a comment").line(0.0, 0.0, 0.0, feed=600.0).finish()
    rows = run(path, in_mode("blend", 0.1))
    left = [float(np.linalg.norm(rows[k].commanded[-1] - path.end[k])) for k in (0, 1, 3, 5)]
    assert left == pytest.approx([0.0, 0.0, 0.1, 0.0])
    assert rows[2].duration_s == 0.5


def _bend(turn: float, *, arc: bool) -> Toolpath:
    """10 mm at 10 mm/s, then at an angle 10 mm more, straight or on an arc of 10 mm."""
    builder = ToolpathBuilder().line(10.0, 0.0, 0.0, feed=600.0)
    cos, sin = math.cos(turn), math.sin(turn)
    if not arc:
        return builder.line(10.0 + 10.0 * cos, 10.0 * sin, 0.0, feed=600.0).finish()
    centre = (10.0 - 10.0 * sin, 10.0 * cos)
    end = (centre[0] + 10.0 * cos, centre[1] + 10.0 * sin)
    return builder.arc(*end, 0.0, centre=centre, ccw=True, feed=600.0).finish()


@pytest.mark.parametrize("arc", [False, True])
def test_a_small_bend_is_no_corner(arc: bool) -> None:
    """A tenth of the acceleration in a period, (v/T + a) · turn < a/10; half beside an arc."""
    limit = 0.1 * A / (10.0 / PERIOD + A) * (0.5 if arc else 1.0)
    machine = in_mode("exact-path")
    passed, stopped = (run(_bend(share * limit, arc=arc), machine) for share in (0.95, 1.05))
    assert passed[0].duration_s < stopped[0].duration_s - 0.005
    assert stopped[0].duration_s == pytest.approx(from_rest(10.0, 10.0, A))


@pytest.mark.parametrize(
    "kind", [Kind.DWELL, Kind.SPINDLE_CW, Kind.SPINDLE_CCW, Kind.SPINDLE_OFF, Kind.TOOL_CHANGE]
)
def test_events_bring_the_machine_to_rest(kind: Kind) -> None:
    path = ToolpathBuilder().line(5.0, 0.0, 0.0, feed=600.0).event(kind, 0.0)
    found = [row.duration_s for row in run(path.line(10.0, 0.0, 0.0, feed=600.0).finish(),
                                           in_mode("exact-path"))]  # fmt: skip
    assert found == pytest.approx([from_rest(5.0, 10.0, A), 0.0, from_rest(5.0, 10.0, A)])


def test_what_is_merged() -> None:
    """Not across feeds, arcs, rapids or events; moves of no length do not part lines, and arcs
    that hardly bow out are lines."""
    builder = ToolpathBuilder().rapid(0.5, 0.0, 0.0).line(1.0, 0.0, 0.0, feed=100.0)
    builder.line(1.0, 0.0, 0.0, feed=100.0).line(2.0, 0.0, 0.0, feed=100.0)
    builder.line(3.0, 0.0, 0.0, feed=200.0).message("here").line(4.0, 0.0, 0.0, feed=200.0)
    builder.arc(4.2, 0.0, 0.0, centre=(4.1, -0.1), ccw=False, feed=200.0)
    builder.line(5.0, 0.0, 0.0, feed=200.0).line(6.0, 0.0, 0.0, feed=200.0)
    path = builder.arc(6.2, 0.0, 0.0, centre=(6.1, -5.0), ccw=False, feed=200.0).finish()
    some, origin = halve_arcs(path, np.full(11, 0.01))
    assert origin.tolist() == [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 10]
    some, chain = merge_rows(some, np.full(12, 0.01))
    assert chain.tolist() == [0, 1, 1, 1, 2, 3, 4, 5, 6, 6, 6, 6]
    assert some.is_arc.tolist() == [False] * 7 + [True] + [False] * 4
    assert merge_rows(path, np.zeros(11))[1].tolist() == list(range(11))


def test_an_arc_that_is_a_line_bows_out_by_less_than_the_tolerance() -> None:
    """Its middle counts: a chain that would leave it farther away is cut before it."""
    bow = 0.008
    radius = (0.5**2 + bow**2) / (2.0 * bow)
    builder = ToolpathBuilder()
    for k in range(4):  # waves, each on the same side
        middle = (k + 0.5, bow - radius)
        builder.arc(k + 1.0, 0.0, 0.0, centre=middle, ccw=False, feed=100.0)
    path = builder.finish()
    assert halve_arcs(path, np.full(4, 0.0079))[0] is path
    some, origin = halve_arcs(path, np.full(4, 0.0081))
    assert not some.is_arc.any()
    assert origin.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert merge_rows(some, np.full(8, 0.0081))[1].tolist() == [0] * 8


def test_a_line_begins_in_the_middle_of_an_arc() -> None:
    """The middle of the arc still lies on the line before it, and its end does not, so that the
    corner is in the middle of its row."""
    builder = ToolpathBuilder((0.0, 1.0, 0.0))
    for angle in (0.02, 0.30, 0.42):
        end = (math.sin(angle), math.cos(angle), 0.0)
        builder.arc(*end, centre=(0.0, 0.0), ccw=False, feed=100.0)
    path = builder.finish()
    some, _ = halve_arcs(path, np.full(3, 0.01))
    assert merge_rows(some, np.full(6, 0.01))[1].tolist() == [0, 0, 0, 1, 1, 1]
    rows = run(path, in_mode("blend", 0.01))
    assert [row.ended for row in rows] == [True] * 3
    corner = np.array([math.sin(0.16), math.cos(0.16), 0.0])
    near = np.linalg.norm(np.concatenate([row.commanded for row in rows]) - corner, axis=1).min()
    assert near < 0.011  # a blend of two lines that meet there; the start of its row is 0.14 away


def test_moves_that_overlap_come_no_nearer_to_the_corner_than_the_tolerance() -> None:
    """A plunge and an arc lie in no plane: both accelerate by half, and the second begins while
    the first comes to rest."""
    builder = ToolpathBuilder((0.0, 0.0, 1.0)).line(0.0, 0.0, -1.0, feed=600.0)
    path = builder.arc(-10.0, 0.0, -1.0, centre=(-5.0, 0.0), ccw=True, feed=600.0).finish()
    stopped = total(path, in_mode("exact-path"))
    for tolerance in (0.01, 0.05):
        rows = run(path, in_mode("blend", tolerance))
        points = np.concatenate([row.commanded for row in rows])
        beside = np.hypot(*(points - (0.0, 0.0, -1.0)).T[[0, 2]])
        near = np.hypot(beside, points[:, 1]).min()
        # Halfway B = P - d1/4 t1 + d2/4 t2, with d1 = 2 T / cos 45°, and d2 a little less, since
        # an arc needs some of its acceleration for turning.
        assert 0.8 * tolerance < near <= tolerance
    # Half of the acceleration, twice the ramps; less what overlaps.
    slow = sum(row.duration_s for row in run(path, in_mode("blend", 0.001)))
    assert slow > stopped


def test_straight_back_is_a_stop() -> None:
    path = ToolpathBuilder().line(5.0, 0.0, 0.0, feed=600.0).line(0.0, 0.0, 0.0, feed=600.0)
    rows = run(path.finish(), in_mode("blend", 0.1))
    assert (rows[0].commanded[-1] == (5.0, 0.0, 0.0)).all()
    assert rows[0].duration_s == pytest.approx(from_rest(5.0, 10.0, A))


@given(st.integers(0, 2**32 - 1), st.floats(0.0005, 0.3))
def test_lines_are_merged_as_the_list_does(seed: int, tolerance: float) -> None:
    rng = np.random.default_rng(seed)
    count = 80
    way: Floats = np.column_stack(
        [rng.uniform(0.0, 1.0, count + 1), rng.normal(0.0, 0.05, (count + 1, 2))]
    )
    way[rng.random(count + 1) < 0.1] = 0.0
    points: Floats = np.round(np.cumsum(way, axis=0), 3).astype(np.float64)
    apart = rng.random(count) < 0.05
    chain, moved = np.empty(count, dtype=np.int64), np.empty((count, 3))
    merge_lines(points, apart, np.full(count, tolerance), chain, moved)
    listed = [tuple(point) for point in points.tolist()]
    assert chain.tolist() == merge(listed, apart.tolist(), tolerance)
    for number in range(int(chain[-1]) + 1):
        rows = np.flatnonzero(chain == number)
        base, end = listed[rows[0]], listed[rows[-1] + 1]
        assert (moved[rows[-1]] == end).all()
        if base == end:
            continue
        along = [0.0]
        for row in rows:
            assert off_line(base, end, tuple(moved[row])) < 1e-12
            assert off_line(base, end, listed[row + 1]) <= tolerance
            along.append(math.dist(base, moved[row]))
        assert (np.diff(along) >= -1e-12).all()


def test_a_chain_takes_a_hundred_and_one_points() -> None:
    points: Floats = np.zeros((300, 3))
    points[:, 0] = np.arange(300)
    chain, moved = np.empty(299, dtype=np.int64), np.empty((299, 3))
    merge_lines(points, np.zeros(299, dtype=np.bool_), np.full(299, 0.01), chain, moved)
    assert np.bincount(chain).tolist() == [101, 101, 97]


def test_merged_lines_leave_the_path_within_the_tolerance() -> None:
    builder = ToolpathBuilder()
    for k in range(1, 40):
        builder.line(0.1 * k, 0.008 * (k % 2), 0.0, feed=600.0)
    path = builder.finish()
    points = np.concatenate([row.commanded for row in run(path, in_mode("blend", 0.01))])
    assert 0.0 < np.ptp(points[:, 1]) <= 0.01
    sharp = np.concatenate([row.commanded for row in run(path, in_mode("exact-path"))])
    assert np.ptp(sharp[:, 1]) == pytest.approx(0.008)
    assert total(path, in_mode("blend", 0.01)) < 0.5 * total(path, in_mode("exact-path"))


def test_chunks_change_nothing() -> None:
    case = next(case for case in MEASURED if case.name == "arcs")
    machine = in_mode("blend", 0.05, "axes.x.backlash_mm=0.05")
    path = read(f"{case.program}M2\n", machine)
    whole = run(path, machine)
    for one, other in zip(whole, run(path, machine, chunk_steps=13), strict=True):
        assert (one.commanded == other.commanded).all()
        assert (one.slide == other.slide).all()
        assert one.steps.tolist() == other.steps.tolist()
        assert other.duration_s == pytest.approx(one.duration_s)


def test_backlash_is_compensated_at_reversals() -> None:
    machine = in_mode("exact-path", 0.01, "axes.x.backlash_mm=0.1", "axes.x.compensation_mm=0.1")
    path = ToolpathBuilder().rapid(2.0, 0.0, 0.0).rapid(0.0, 0.0, 0.0).finish()
    out, back = run(path, machine)
    assert out.slide[-1, 0] == pytest.approx(2.0)
    assert back.slide[-1, 0] == pytest.approx(0.0, abs=1e-12)
    assert back.reversals.tolist() == [1, 0, 0]
    assert back.compensation_s == 0.0


def test_counts_homing_and_the_end() -> None:
    builder = (
        ToolpathBuilder().rapid(1.0, 2.0, 3.0).set_position(0.0, 0.0, 3.0).event(Kind.HOME_XY)
    )
    path = builder.event(Kind.END).rapid(9.0, 9.0, 9.0).finish()
    rows = run(path, in_mode("exact-path"))
    assert len(rows) == 3
    assert [row.steps.tolist() for row in rows] == [[200, 400, 600], [200, 400, 0], [0, 0, 0]]
    assert (rows[1].commanded[-1] == (0.0, 0.0, 3.0)).all()


def test_rows_that_do_not_move() -> None:
    builder = ToolpathBuilder().line(0.0, 0.0, 0.0, feed=100.0)
    builder.arc(0.0, 0.0, 0.0, centre=(0.0, 0.0), ccw=True, feed=100.0)
    for path in (builder.finish(), ToolpathBuilder().finish()):
        assert total(path, in_mode("blend")) == 0.0


def test_what_cannot_be_followed() -> None:
    far = ToolpathBuilder().rapid(1e10, 0.0, 0.0).finish()
    with pytest.raises(ProgramError, match="count"):
        simulate(far, in_mode("blend"))
    still = ToolpathBuilder().line(1.0, 0.0, 0.0, feed=float("inf")).finish()
    with pytest.raises(ProgramError, match="without a feed"):
        simulate(still, in_mode("blend"))


def test_the_path_mode_must_be_said() -> None:
    with pytest.raises(MachineError, match=r"\[dialect\], key path: Invalid value 'round'"):
        in_mode("round")
