"""The Matlab router as a machine: orders, times, coasting, and what its thesis says of them.

Lnnnn are lines of the thesis. What it measured of parts is in no number: it has none.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from camtool_postprocessors.matlab_router import controller
from camtool_postprocessors.matlab_router.controller import TEXT_KID, TEXT_KPD, lines_of
from camtool_postprocessors.matlab_router.dialect import MatlabRouterController
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import MachineError, ProgramError
from camtool.machine.model import Machine, controller_of
from camtool.simulation.motion import IDEAL, Chunk, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.postprocessors.matlab_router.parts import ROOT, STAR, STAR_LXY, STAR_VELXY
from tests.targets import model_of, simulate

TICK_S = 0.005
COUNTS_PER_MM = 25600.0
SETTLE_S = 12 * 0.062


def quantised(path: Toolpath, machine: Machine) -> Toolpath:
    return model_of(machine).quantised(path, machine)


def router(*settings: str) -> Machine:
    """The machine with settings of its controller ("slaves=text"), home at part zero."""
    full = ["controller.machine_zero_mm=[0, 0, 0]"]
    full += [text if text.startswith("axes") else f"controller.{text}" for text in settings]
    return load_target("matlab-router", settings=full).machine


def read(name: str, *settings: str) -> tuple[Toolpath, Machine]:
    """A golden program as the dialect reads it."""
    target = load_target("matlab-router", settings=settings)
    data = (ROOT / "tests" / "golden" / f"{name}.m").read_bytes()
    return target.target.read(data, target.machine), target.machine


def line(x: float = 0.0, y: float = 0.0, z: float = 0.0, *, counts: int = 480) -> Toolpath:
    """Make a line from zero at a speed along it."""
    return ToolpathBuilder().line(x, y, z, feed=counts * 0.46875).finish()


def motion(path: Toolpath, machine: Machine, chunk_steps: int = 1 << 16) -> list[Chunk]:
    return list(simulate(path, machine, Options(chunk_steps=chunk_steps)))


def places(chunks: list[Chunk]) -> np.ndarray:
    return np.concatenate([chunk.commanded for chunk in chunks])


def seconds(chunks: list[Chunk], rows: int) -> np.ndarray:
    """(rows,) s of each row."""
    found = np.zeros(rows)
    for chunk in chunks:
        np.add.at(found, chunk.ledger.row, chunk.ledger.duration_s)
    return found


def unended(chunks: list[Chunk]) -> list[int]:
    return [row for c in chunks for row in c.ledger.row[~c.ledger.ended].tolist()]


def test_the_star_s_arrays_are_what_the_slaves_get() -> None:
    """lxy and velxy as printed, L3196-3228: what the reader tells gives each number back."""
    path, machine = read("matlab-router-star-thesis", "dialect.grid_mm=0.1")
    orders = lines_of(quantised(path, machine), len(path), machine).orders[-10:]
    assert orders[:, 3:5].T.tolist() == STAR_VELXY
    assert (2 * orders[:, :2]).T.tolist() == [[d // 2 * 2 for d in row] for row in STAR_LXY]


def test_the_star_s_drift_by_odd_distances() -> None:
    """Each odd tenth is lost (L5589-5600); the sums over the star, in units."""
    path = ToolpathBuilder().rapid(*(value / 10 for value in STAR[0]))
    for point, *speed in zip(STAR[1:], *STAR_VELXY, strict=True):
        path.line(point[0] / 10, point[1] / 10, feed=math.hypot(*speed) * 0.46875)
    toolpath, machine = path.finish(), router()
    orders = lines_of(quantised(toolpath, machine), len(toolpath), machine).orders[1:]
    done = np.sign(orders[:, 3:5]) * 2 * orders[:, :2]
    drift = (done - np.diff(np.array(STAR), axis=0)).cumsum(axis=0)
    assert drift[:, 0].tolist() == [-1, -1, 0, 0, 0, 1, 1, 1, 1, 2]
    assert drift[:, 1].tolist() == [-1, 0, -1, -1, -2, -3, -3, -3, -2, -2]


@given(st.lists(st.tuples(st.integers(1, 2000), st.integers(1, 2000)), min_size=20, max_size=60))
def test_all_speeds_of_the_gui_come_back(ways: list[tuple[int, int]]) -> None:
    path, at, wanted = ToolpathBuilder(), np.zeros(2), []
    for number, (a, b) in enumerate(ways):
        sign = -1 if number % 2 else 1
        major = max(a, b)
        speed = tuple(math.floor(480 * d / major + 0.5) for d in (a, b))
        wanted.append([sign * v for v in speed])
        at = at + sign * np.array([a, b])
        path.line(*(at / 10), feed=math.hypot(*speed) * 0.46875)
    toolpath, machine = path.finish(), router()
    inside = np.abs(toolpath.end).max() < 3276.7
    if inside:
        with pytest.MonkeyPatch.context() as patch:
            for at_once in (4096, 7):
                patch.setattr(controller, "LINES_AT_ONCE", at_once)
                orders = lines_of(quantised(toolpath, machine), len(toolpath), machine).orders
                assert orders[:, 3:5].tolist() == wanted


def test_a_bent_line_is_one_order_and_does_not_stop() -> None:
    """Two rows of one block: one axis arrives earlier, the other goes on (L4855-4929)."""
    b = ToolpathBuilder()
    b.block = 1
    b.line(4.0, 4.0, feed=480 * 0.46875 * math.sqrt(2)).line(4.0, 10.0, feed=225)
    path, machine = b.finish(), router()
    orders = lines_of(path, 2, machine).orders
    assert orders[:, :8].tolist() == [[20, 50, 0, 480, 480, 0, 0, 1]]
    assert orders[:, 9:].tolist() == [[1, 102_400]]
    chunks = motion(path, machine)
    row, y = np.concatenate([c.row for c in chunks]), places(chunks)[:, 1]
    parted = int(np.argmax(row == 1))
    assert 4.0 < y[parted] < 4.02
    assert (np.diff(y[parted - 50 : parted + 50]) * COUNTS_PER_MM > 400).all()
    took = seconds(chunks, 2)
    assert took[0] == pytest.approx(4.0 / 3.75, abs=0.1)
    assert took.sum() == pytest.approx(10.0 / 3.75 + SETTLE_S, abs=0.1)


def test_chunks_are_five_turns_each_also_those_of_z() -> None:
    """L5589-5729: the counter is not cleared, so chunks of 5120 and of 5954 (L6169-6171) both end
    after five turns; the first and the last differ by the phase."""
    quick = "time_constant_s=[0.00001, 0.00001, 0.00001]"
    for axis, phase, counts in (("x", 0, 49), ("x", 300, 49), ("z", 0, 49), ("z", 300, 49)):
        machine = router(quick, f"home_phase_counts=[{phase}, {phase}, {phase}]")
        way = {axis: 10.0 if axis == "x" else -10.0}
        path = ToolpathBuilder().line(**way, feed=234.375).finish()
        end = places(motion(path, machine))[-1]
        done = abs(end["xyz".index(axis)]) * COUNTS_PER_MM
        whole, last = (5126, 5119) if axis == "x" else (5960, 5119)
        assert done == pytest.approx(whole - phase + (counts - 1) * 5120 + last, abs=2)


def test_ten_millimetres_of_plunge_take_what_the_listing_says() -> None:
    """MOVIMIENTO_X(100, 500), L6544: 10 mm at 500 counts in 5 ms, which are 3.906 mm/s."""
    chunks = motion(line(z=-10.0, counts=500), router())
    assert seconds(chunks, 1)[0] == pytest.approx(10.0 / 3.90625 + SETTLE_S, abs=0.1)


def test_speeds_are_counts_in_five_milliseconds() -> None:
    """480 (L4458-4460) is 3.75 mm/s, whatever the gain of the motor is."""
    for axis in range(3):
        way = [0.0, 0.0, 0.0]
        way[axis] = 20.0 if axis < 2 else -20.0
        chunks = motion(line(*way), router())
        speed = np.abs(np.diff(places(chunks)[200:900, axis]))
        assert speed.mean() / TICK_S == pytest.approx(3.75, rel=1e-3)
        assert seconds(chunks, 1)[0] == pytest.approx(20.0 / 3.75 + SETTLE_S, abs=0.1)


def test_the_star_takes_its_ideal_time_and_a_little() -> None:
    """78.83 s at 480 counts; each line less what it coasts, more what it accelerates."""
    path, machine = read("matlab-router-star-thesis", "dialect.grid_mm=0.1")
    took = seconds(motion(path, machine), len(path))
    cut = took[path.is_feed & (path.feed != 234.375)].sum() - SETTLE_S
    assert 78.83 - 1.0 < cut < 78.83 + 1.0


@pytest.mark.parametrize(
    ("stop_s", "most_mm", "rms_mm"),
    # The same other simulation: 0.26 and 0.11 mm; with stops of half a second 0.62 and 0.27.
    [(0.0062, 0.25, 0.09), (0.5, 0.67, 0.30)],
)
def test_the_star_s_shape(stop_s: float, most_mm: float, rms_mm: float) -> None:
    """Distances to the lines as executed, from where the first point was really reached."""
    settings = ("dialect.grid_mm=0.1", f"controller.turnaround_s={stop_s}")
    path, machine = read("matlab-router-star-thesis", *settings)
    chunks = motion(path, machine)
    row, at = np.concatenate([c.row for c in chunks]), places(chunks)[:, :2]
    cut = np.flatnonzero(path.is_feed & (path.feed != 234.375))
    at = at - (at[row < cut[0]][-1] - path.end[cut[0] - 1, :2])
    errors = []
    for index in cut:
        begin, way = path.starts[index, :2], (path.end - path.starts)[index, :2]
        out = at[row == index] - begin
        share = np.clip(out @ way / (way @ way), 0.0, 1.0)
        errors.append(np.hypot(*(out - share[:, None] * way).T))
    error = np.concatenate(errors)
    assert error.max() == pytest.approx(most_mm, abs=0.01)
    assert math.sqrt((error**2).mean()) == pytest.approx(rms_mm, abs=0.01)


@pytest.mark.parametrize(
    ("way", "counts", "wanted_mm"),
    [
        # Worked out from the listing beforehand by another simulation, with polls of 50 us.
        ((20, 0), 480, 0.226),
        ((-20, 0), 480, 0.187),
        ((0, 20), 480, 0.229),
        ((0, -20), 480, 0.190),
        ((20, 0), 100, 0.09),
    ],
)
def test_axes_coast_past_the_end(way: tuple[int, int], counts: int, wanted_mm: float) -> None:
    end = places(motion(line(*map(float, way), counts=counts), router()))[-1, :2]
    past = float(np.linalg.norm(end) - np.linalg.norm(way))
    assert past == pytest.approx(wanted_mm, abs=0.004)


def test_friction_shortens_the_coasting() -> None:
    """From ω₀ with friction f: τ (ω₀ − A f ln(1 + ω₀ / (A f)))."""
    a_f, tau = 8.896 * 70.0 / 50.0 * 20.0, 12.2
    chunks = motion(line(20.0), router("friction_percent=[20, 0, 0]"))
    x = places(chunks)[:, 0] * COUNTS_PER_MM
    after = int(np.flatnonzero(np.diff(x) > 300)[-1]) + 2
    speed = float(x[after] - x[after - 1])
    # The mean over a tick lies in its middle; the speed at its end is lower.
    now = (speed + a_f) * math.exp(-0.5 / tau) - a_f
    left = tau * (now - a_f * math.log1p(now / a_f))
    assert x[-1] - x[after] == pytest.approx(left, rel=0.03)
    assert x[-1] / COUNTS_PER_MM - 20.0 < 0.12


def test_the_motors_follow_from_table_4_1() -> None:
    """L2872-2880: K = ωn²/Ki, 1/τ = 2 ζ ωn − Kp K with ωn = 22.63 and ζ = 0.707."""
    record = controller_of(router(), MatlabRouterController)
    table = {0: (3.5099, 0.1069), 1: (5.6304, 0.1732), 2: (3.2509, 0.10074)}
    for axis, (ki, kp) in table.items():
        k = 22.63**2 / ki
        alpha = 2 * 0.707 * 22.63 - kp * k
        assert record.time_constant_s[axis] == pytest.approx(1 / alpha, abs=6e-5)
        assert record.plant_gain[axis] == pytest.approx(k / alpha, rel=1e-3)
        # The digital gains, in thousandths: Kid = T Ki, Kpd = Kp − Kid / 2 (Z is off by 0.03).
        assert TEXT_KID[axis] == pytest.approx(5 * ki, abs=0.06)
        assert TEXT_KPD[axis] == pytest.approx(1000 * kp - 2.5 * ki, abs=0.03)


def speeds_at_300(axis: int, machine: Machine) -> np.ndarray:
    """Counts in each tick of the two seconds after a step to 300 counts = 3515 rpm (L3715)."""
    assert pytest.approx(3515, abs=1) == 300 * 200 * 60 / 1024
    way = [0.0, 0.0, 0.0]
    way[axis] = 20.0 if axis < 2 else -20.0
    found = places(motion(line(*way, counts=300), machine))
    return np.asarray(np.abs(np.diff(found[:400, axis])) * COUNTS_PER_MM)


def settled_ms(speed: np.ndarray) -> float:
    """When it is within 2 % for good."""
    return 1000 * TICK_S * (int(np.flatnonzero(np.abs(speed - 300) > 6)[-1]) + 1)


@pytest.mark.parametrize("axis", range(3))
def test_the_text_s_loop_settles_as_designed(axis: int) -> None:
    """ts = 250 ms, overshoot 4.3 % (below 5 %: L2860, L2872-2880); sampling adds to the latter."""
    speed = speeds_at_300(axis, router("slaves=text"))
    assert settled_ms(speed) == pytest.approx(250, abs=7)
    assert speed.max() / 300 == pytest.approx(1.05, abs=0.01)
    assert np.abs(speed[100:] - 300).max() <= 1.5


@pytest.mark.parametrize(
    ("axis", "wn", "zeta"), [(0, 28.7, 0.727), (1, 22.63, 0.707), (2, 29.8, 0.729)]
)
def test_the_listing_s_gains_are_those_of_y(axis: int, wn: float, zeta: float) -> None:
    """28 and 159 on all axes (L5104-5106): Y settles as designed, X and Z sooner, by 4/(ζ ωn)."""
    speed = speeds_at_300(axis, router())
    assert settled_ms(speed) == pytest.approx(4000 / (zeta * wn), abs=10)
    assert speed.max() / 300 == pytest.approx(1.055, abs=0.01)
    assert np.abs(speed[100:] - 300).max() <= 2.5


def test_homing_is_even_and_ends_on_zero() -> None:
    path = ToolpathBuilder().line(20.0, 10.0, feed=225).event(Kind.HOME_XY).finish()
    chunks = motion(path, router())
    row, at = np.concatenate([c.row for c in chunks]), places(chunks)
    assert at[-1].tolist() == [0.0, 0.0, 0.0]
    way = np.diff(at[row == 1], axis=0)
    assert way[:100, 0] * COUNTS_PER_MM == pytest.approx(np.full(100, -700), abs=1)  # L5741
    assert way[:100, 1] * COUNTS_PER_MM == pytest.approx(np.full(100, -550), abs=1)  # L6275
    assert seconds(chunks, 2)[1] == pytest.approx(20.2 / 5.46875 + SETTLE_S, abs=0.1)


def test_the_listing_s_lines_begin_where_the_axis_is_the_text_s_do_not() -> None:
    """Squares outwards along X: what each line goes too far stays, or is taken back."""
    b = ToolpathBuilder()
    for _ in range(10):
        x = b.position[0]
        b.line(x + 2.0, 0.0, feed=225).line(x + 2.0, 2.0, feed=225).line(x + 2.0, 0.0, feed=225)
    path = b.finish()
    off = {}
    for slaves in ("listing", "text"):
        off[slaves] = float(places(motion(path, router(f"slaves={slaves}")))[-1, 0]) - 20.0
    # A line leaves the whole turns of its coasting: five of 0.04 mm at 480 counts.
    assert off["text"] == pytest.approx(0.227, abs=0.01)
    assert off["listing"] == pytest.approx(0.227 + 9 * 0.2, abs=0.01)


def test_chunks_of_any_size_say_the_same() -> None:
    path, machine = read("matlab-router-star")
    whole, parts = motion(path, machine), motion(path, machine, 501)
    assert places(whole).tolist() == places(parts).tolist()
    assert seconds(whole, len(path)) == pytest.approx(seconds(parts, len(path)))
    for name in ("steps", "reversals", "iterations"):
        sums = [
            sum(getattr(c.ledger, name).sum(axis=0) for c in found) for found in (whole, parts)
        ]
        assert np.array_equal(*sums)
    for found in (whole, parts):
        rows = np.concatenate([c.ledger.row for c in found])
        assert sorted(set(rows.tolist())) == list(range(len(path)))
        assert all((np.diff(c.ledger.row) > 0).all() for c in found)
        assert all(len(c.row) <= 1 << 16 and set(c.row) <= set(c.ledger.row) for c in found)


def test_steps_and_samples_agree() -> None:
    path, machine = read("matlab-router-star")
    chunks = motion(path, machine)
    at = np.concatenate([np.zeros((1, 3)), places(chunks)])
    way = np.abs(np.diff(at, axis=0)).sum(axis=0) * COUNTS_PER_MM
    assert sum(c.ledger.steps.sum(axis=0) for c in chunks) == pytest.approx(way, abs=0.5)
    samples = sum(len(c.row) for c in chunks)
    # The numbers of the job, 30 ms and 40 of 1 ms, take time before anything moves (L4294-4360).
    assert seconds(chunks, len(path)).sum() == pytest.approx(samples * TICK_S + 0.07, abs=TICK_S)


def test_play_acts_on_where_the_motor_is() -> None:
    machine = router("start_play=preloaded", "axes.x.backlash_mm=0.3")
    path = ToolpathBuilder().line(10.0, feed=225).line(0.0, feed=225).finish()
    chunks = motion(path, machine)
    slide, at = np.concatenate([c.slide for c in chunks]), places(chunks)
    turn = int(at[:, 0].argmax())
    assert np.array_equal(slide[: turn + 1], at[: turn + 1])
    assert slide[-1, 0] - at[-1, 0] == pytest.approx(0.3)
    ideal = list(simulate(path, machine, Options(effects=IDEAL)))
    assert np.array_equal(np.concatenate([c.slide for c in ideal]), at)


@pytest.mark.parametrize("text", ["listing", "text"])
def test_a_speed_of_0_never_gets_there(text: str) -> None:
    """L5589-5729: bounded here, told as not ended; the next line goes on from there."""
    path = ToolpathBuilder().line(10.0, feed=225).line(10.0, 4.0, feed=0.1).finish()
    chunks = motion(path, router(f"slaves={text}"))
    assert unended(chunks) == [1]
    assert np.abs(places(chunks)[-1, 1]) < 0.01
    assert seconds(chunks, 2)[1] < 5.0


def test_a_tenth_of_a_millimetre_runs_away() -> None:
    """distance / 2 − 1 in an unsigned int16 is 65535 (L5589-5600): given up after two seconds."""
    chunks = motion(line(0.1), router())
    assert unended(chunks) == [0]
    assert 2.0 < places(chunks)[-1, 0] < 10.0


def test_rows_without_motion_are_accounted_for() -> None:
    b = ToolpathBuilder().event(Kind.SPINDLE_CW, 1000).event(Kind.DWELL, 0.5)
    b.line(1.0, feed=225).event(Kind.SPINDLE_OFF).event(Kind.END).line(5.0, feed=225)
    path = b.finish()
    chunks = motion(path, router())
    took = seconds(chunks, len(path))
    assert took[[0, 1, 3, 4, 5]].tolist() == [0.0, 0.5, 0.0, 0.0, 0.0]
    assert places(chunks)[-1, 0] == pytest.approx(1.2, abs=0.1)
    assert motion(ToolpathBuilder().finish(), router()) == []
    (still,) = motion(ToolpathBuilder().event(Kind.DWELL, 0.5).finish(), router())
    assert still.ledger.duration_s.tolist() == [0.5]


BAD = {
    "an arc": (ToolpathBuilder().arc(0, 0, centre=(5, 0), ccw=True, feed=99), "no arcs"),
    "far away": (ToolpathBuilder().line(3276.8, feed=99), "beyond all"),
    "no feed": (ToolpathBuilder().line(5.0, feed=math.nan), "without a feed"),
    "no seconds": (ToolpathBuilder().event(Kind.DWELL, -1.0), "without its seconds"),
    "zero": (ToolpathBuilder().line(5.0, feed=9).event(Kind.SET_ZERO), "set away"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_followed(name: str) -> None:
    builder, message = BAD[name]
    with pytest.raises(ProgramError, match=message):
        motion(builder.finish(), router())


def test_gains_of_the_listing_are_whole() -> None:
    with pytest.raises(MachineError, match="whole thousandths"):
        motion(line(1.0), router("kid=[17.5, 28.0, 28.0]"))
    assert places(motion(line(1.0), router("kid=[17.5, 28, 28]", "slaves=text"))).size
    with pytest.raises(MachineError, match="model"):
        controller_of(load_target("pic-mmh").machine, MatlabRouterController)


@pytest.mark.parametrize(
    "setting",
    [
        "slaves=none",
        "plant_gain=[0, 1, 1]",
        "plant_gain=[1e300, 1, 1]",
        "time_constant_s=[0, 1, 1]",
        "friction_percent=[61, 0, 0]",
        "kid=[-1, 28, 28]",
        "table_counts=1024",
        "chunk_counts=[100, 5120, 5120]",
        "home_counts=[0, 550, 500]",
        "home_phase_counts=[1024, 0, 0]",
        "turnaround_s=0.004",
        "start_lag_s=0.006",
        "number_pause_s=-1",
        "speed=1",
    ],
)
def test_bad_values_are_refused(setting: str) -> None:
    with pytest.raises(MachineError, match=r"controller"):
        router(setting)


def test_the_ends_of_the_ranges_are_bounded_too() -> None:
    """The strongest and quickest motor, and the weakest and slowest, which never arrives."""
    wild = router("plant_gain=[1000, 1000, 1000]", "time_constant_s=[1e-6, 1e-6, 1e-6]")
    assert np.isfinite(places(motion(line(20.0, 10.0), wild))).all()
    weak = router("plant_gain=[0.001, 1, 1]", "time_constant_s=[60, 1, 1]")
    chunks = motion(line(1.0), weak)
    assert unended(chunks) == [0]
    assert seconds(chunks, 1)[0] == pytest.approx(720 + 4 / 3.75 + 2, abs=0.1)


def test_what_is_said_of_the_model() -> None:
    machine = router("friction_percent=[1, 0, 0]", "slaves=text")
    assert any(
        "dry friction" in text
        for text in model_of(machine).assumptions(ToolpathBuilder().finish(), machine)
    )
    assert any(
        "text" in text
        for text in model_of(machine).assumptions(ToolpathBuilder().finish(), machine)
    )
    path, machine = read("matlab-router-star")
    at = places(motion(path, machine))
    apart = np.hypot(*np.diff(at[:, :2], axis=0).T)
    assert float(np.percentile(apart, 95)) <= 1.5 * model_of(machine).spacing_mm(path, machine)


def test_the_limits_of_the_format() -> None:
    """The farthest that an int16 of tenths can say, and the most counts: no overflow."""
    far = ToolpathBuilder().line(3276.6, feed=1023 * 0.46875).finish()
    lines = lines_of(quantised(far, router()), 1, router()).orders
    assert lines[0, :6].tolist() == [16383, 0, 0, 1023, 0, 0]
    fast = ToolpathBuilder().line(0.2, feed=1e300).finish()
    assert lines_of(fast, 1, router()).orders[0, 3] == 0xFFFF
    for a, b in pairwise((0.0, 0.3, 0.7, 1.0, 1.1)):  # 0.3, 0.4, 0.3, 0.1 mm
        way = ToolpathBuilder().line(b - a, feed=225).finish()
        chunks = lines_of(quantised(way, router()), 1, router()).orders[0, 0]
        assert chunks == {3: 1, 4: 2, 1: 65536}[round(10 * (b - a))]


def test_counts_beyond_32_bits_are_refused() -> None:
    machine = router("slaves=text", "axes.x.coded_step_mm=1e-6")
    path = ToolpathBuilder().line(3000.0, feed=225).finish()
    with pytest.raises(MachineError, match="more counts than 32 bits hold"):
        lines_of(quantised(path, machine), 1, machine)


def test_the_text_divides_distances() -> None:
    """Equation 4.49, L3077-3097."""
    wanted = {0.7: 1, 5.3: 10, 66.7: 100, 177.7: 1000}
    for way, parts in wanted.items():
        path, machine = line(way), router("slaves=text")
        (counts,) = lines_of(quantised(path, machine), 1, machine).orders[:, 0].tolist()
        assert counts % parts == 0
        assert 0 <= way * COUNTS_PER_MM - counts < parts + 1
