"""The ValCNC controller as a whole: against a literal run, and by the figures of its thesis."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from camtool.errors import MachineError, ProgramError
from camtool.machine.model import Machine
from camtool.simulation.motion import IDEAL, Effects, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.motion_rows import RowMotion, assert_same_rows, rows_of
from tests.oracles.valcnc_run import Valcnc, table_8
from tests.targets import model_of, simulate, verify

pytestmark = pytest.mark.checked

ROOT = Path(__file__).parents[3]
STEP_MM = 0.04
"""8 mm a turn by 200 steps (L1643)."""

Point = tuple[float, float]


def machine(*settings: str) -> Machine:
    return load_target("valcnc", settings=settings).machine


def run(toolpath: Toolpath, made: Machine, **options: Any) -> list[RowMotion]:
    return rows_of(simulate(toolpath, made, Options(**options)))


def steps_of(row: RowMotion) -> list[tuple[int, int, int]]:
    return [(x, y, z) for x, y, z in np.rint(row.commanded / STEP_MM).astype(int).tolist()]


def line_of(x: float, y: float, z: float = 0.0) -> Toolpath:
    return ToolpathBuilder().line(x, y, z, feed=14400.0).finish()


def test_table_8() -> None:
    """7 steps in X and 3 in Y (L1239-1250), a pass every 166.667 µs (L1336)."""
    (row,) = run(line_of(7 * STEP_MM, 3 * STEP_MM), machine())
    assert steps_of(row) == [(x, y, 0) for x, y, _ in table_8()]
    assert row.iterations == 7
    assert row.duration_s == pytest.approx(7 * 166.667e-6, rel=1e-5)
    assert row.steps.tolist() == [7, 3, 0]


OPTIONS: list[tuple[tuple[str, ...], dict[str, Any]]] = [
    ((), {}),
    (("controller.rounding=truncated",), {"truncated": True}),
    (("controller.counting=differences",), {"differences": True}),
    (
        ("controller.counting=differences", "controller.rounding=truncated"),
        {"differences": True, "truncated": True},
    ),
    (("controller.arc_segments=7",), {"segments": 7}),
    (
        ("controller.arc_end=programmed", "controller.arc_segment_mm=0.5"),
        {"forced_end": True, "segment_mm": 0.5},
    ),
]


def random_program(rng: np.random.Generator) -> Toolpath:
    """Lines in all directions, Z alone and along, arcs of every sweep, one after the other."""
    path = ToolpathBuilder()
    for _ in range(12):
        how = int(rng.integers(5))
        x, y, z = (rng.integers(-4000, 4000, 3) / 1000.0).tolist()
        if how == 0:
            path.line(x, y, feed=1.0)
        elif how == 1:
            path.rapid(z=z)
        elif how == 2:
            path.rapid(x, y, z)
        else:
            _random_arc(rng, path)
    return path.finish()


def _random_arc(rng: np.random.Generator, path: ToolpathBuilder) -> None:
    """An arc as programs write it: end, I and J with four decimals."""
    x, y, _ = path.position
    radius, turn = float(rng.uniform(0.1, 3.0)), float(rng.uniform(0.0, 6.28))
    sweep = float(rng.choice([rng.uniform(0.01, 6.2), 2.0 * math.pi, 0.5 * math.pi]))
    ccw = bool(rng.integers(2))
    i, j = round(-radius * math.cos(turn), 4), round(-radius * math.sin(turn), 4)
    angle = turn + (sweep if ccw else -sweep)
    end = (x + i + radius * math.cos(angle), y + j + radius * math.sin(angle))
    to = (x, y) if sweep == 2.0 * math.pi else (round(end[0], 4), round(end[1], 4))
    if abs(math.dist(to, (x, y)) - 2.0 * math.hypot(i, j)) > 1e-3:
        path.arc(*to, centre=(x + i, y + j), ccw=ccw, feed=1.0)


@pytest.mark.parametrize(("settings", "how"), OPTIONS, ids=str)
def test_random_programs_equal_the_literal_run(
    settings: tuple[str, ...], how: dict[str, Any]
) -> None:
    made = machine(*settings)
    rng = np.random.default_rng(4550)
    arcs = 0
    for _ in range(40):
        toolpath = random_program(rng)
        twin = Valcnc((STEP_MM,) * 3, **how)
        for move, row in zip(toolpath, run(toolpath, made), strict=True):
            if move.centre is None:
                wanted = twin.line(move.end)
            else:
                arcs += 1
                wanted = twin.arc(
                    move.end[:2],
                    move.centre[0] - move.start[0],
                    move.centre[1] - move.start[1],
                    ccw=move.kind == Kind.ARC_CCW,
                    full=move.start[:2] == move.end[:2],
                )
            assert steps_of(row) == wanted
            assert row.iterations == len(wanted)
            assert row.duration_s == pytest.approx(len(wanted) / 6000.0)
            assert row.ended
    assert arcs > 100


def arc(start: Point, end: Point, centre: Point, *, ccw: bool) -> Toolpath:
    path = ToolpathBuilder((*start, 0.0)).arc(*end, centre=centre, ccw=ccw, feed=1.0)
    return path.finish()


def swept(row: RowMotion, centre: Point, start: Point) -> float:
    """Degrees that a motion turns about a centre, counter-clockwise positive."""
    points = np.concatenate([[[*start, 0.0]], row.commanded])
    angle = np.unwrap(np.arctan2(points[:, 1] - centre[1], points[:, 0] - centre[0]))
    return math.degrees(angle[-1] - angle[0])


@pytest.mark.parametrize(
    ("start", "end", "ccw", "degrees"),
    [
        ((10, 0), (0, 10), True, 90),
        ((10, 0), (0, 10), False, -270),
        ((0, 10), (10, 0), False, -90),  # i = 0, Consideración 1 (L1310): all four cases
        ((0, 10), (10, 0), True, 270),
        ((0, -10), (10, 0), True, 90),
        ((0, -10), (10, 0), False, -270),
        ((10, 0), (-10, 0), True, 180),
        ((10, 0), (-10, 0), False, -180),
        ((10, 0), (10, 0), True, 360),  # α = 0 by L1284-1288, 2π by L1326
        ((10, 0), (10, 0), False, -360),
        ((-6, 8), (6, 8), True, 286.26),  # reflex, Consideración 2 (L1319-1328)
        ((-6, 8), (6, 8), False, -73.74),
    ],
)
def test_arcs_of_every_kind(start: Point, end: Point, ccw: bool, degrees: float) -> None:
    (row,) = run(arc(start, end, (0.0, 0.0), ccw=ccw), machine())
    assert swept(row, (0.0, 0.0), start) == pytest.approx(degrees, abs=0.3)
    assert row.commanded[-1, :2] == pytest.approx(end)
    radii = np.hypot(row.commanded[:, 0], row.commanded[:, 1])
    assert np.abs(radii - 10.0).max() < 1.5 * STEP_MM


@pytest.mark.parametrize(
    ("radius", "pieces", "sagitta_mm"),
    [
        (10, 8, 0.048),
        (10, 16, 0.012),
        (10, 32, 0.003),
        (50, 16, 0.060),
        (50, 32, 0.015),
        (50, 64, 0.004),
    ],
)
def test_chords_stray_by_their_sagitta(radius: int, pieces: int, sagitta_mm: float) -> None:
    """R·(1 − cos(β/2)) of a quarter in N pieces; on steps so fine that they do not matter."""
    assert radius * (1.0 - math.cos(math.pi / 4.0 / pieces)) == pytest.approx(sagitta_mm, abs=5e-4)
    fine = [f"axes.{axis}.coded_step_mm=0.0002" for axis in "xyz"]
    path = arc((radius, 0), (0, radius), (0, 0), ccw=True)
    (row,) = run(path, machine(f"controller.arc_segments={pieces}", *fine))
    inside = radius - np.hypot(row.commanded[:, 0], row.commanded[:, 1])
    assert inside.max() == pytest.approx(sagitta_mm, abs=5.5e-4)


def test_arcs_are_cut_by_their_length_or_into_as_many_pieces_as_said() -> None:
    path = arc((10, 0), (0, 10), (0, 0), ccw=True)
    (one,) = run(path, machine("controller.arc_segments=1"))
    straight = rows_of(
        simulate(ToolpathBuilder((10.0, 0.0, 0.0)).line(0, 10, feed=1).finish(), machine())
    )
    assert steps_of(one) == steps_of(straight[0])
    (long,) = run(path, machine("controller.arc_segment_mm=15.8"))
    assert steps_of(long) == steps_of(one)
    (two,) = run(path, machine("controller.arc_segment_mm=15.7"))
    (said,) = run(path, machine("controller.arc_segments=2"))
    assert steps_of(two) == steps_of(said) != steps_of(one)


def test_an_arc_near_half_a_turn_ends_beside_its_end_and_the_next_row_starts_there() -> None:
    """A chord of 1.9998 on a diameter of 2 gives 178.4° (L1284-1288)."""
    path = ToolpathBuilder((8.0, 0.0, 0.0)).arc(-7.9984, 0, centre=(0, 0), ccw=True, feed=1)
    path.line(-7.9984, -4.0, feed=1)
    curve, line = run(path.finish(), machine())
    miss = 8.0 * 2.0 * math.acos(0.9999)
    assert math.dist(curve.commanded[-1, :2], (-7.9984, 0.0)) == pytest.approx(miss, abs=STEP_MM)
    assert line.commanded[-1, :2] == pytest.approx([-8.0, -4.0])
    assert np.abs(np.diff(np.concatenate([curve.commanded, line.commanded]), axis=0)).max() < 0.05
    forced, _ = run(path.finish(), machine("controller.arc_end=programmed"))
    assert forced.commanded[-1, :2] == pytest.approx([-8.0, 0.0])


def test_differences_of_coordinates_drift() -> None:
    """A third of a step a time is nothing each time; coordinates by themselves do not drift."""
    path = ToolpathBuilder()
    for k in range(1, 301):
        path.line(k * STEP_MM / 3.0, 0.0, feed=1.0)
    assert sum(row.steps[0] for row in run(path.finish(), machine())) == 100
    lost = run(path.finish(), machine("controller.counting=differences"))
    assert sum(row.steps[0] for row in lost) == 0
    whole = run(path.finish(), machine("controller.rounding=truncated"))
    assert sum(row.steps[0] for row in whole) == 100


@pytest.mark.parametrize("rounding", ["nearest", "truncated"])
def test_held_moves_end_where_the_steps_do(rounding: str) -> None:
    made = machine(f"controller.rounding={rounding}", "controller.arc_end=programmed")
    rng = np.random.default_rng(7)
    for _ in range(30):
        toolpath = random_program(rng)
        kept = model_of(made).quantised(toolpath, made)
        rows = run(toolpath, made)
        at = np.zeros(3)
        for end, row in zip(kept.end, rows, strict=True):
            at = row.commanded[-1] if len(row.commanded) else at
            assert end == pytest.approx(at, abs=1e-9)
        assert np.abs(np.abs(kept.sweeps()) - np.abs(toolpath.sweeps())).max() < 2.0


def test_an_arc_below_a_step_is_no_circle() -> None:
    made = machine("controller.rounding=truncated")
    path = arc((5.01, 0.001), (5.01, 0.021), (0.0, 0.011), ccw=True)
    kept = model_of(made).quantised(path, made)
    assert not kept.is_arc.any()
    assert len(run(path, made)[0].commanded) == 0


def test_z_alone_before_after_and_together() -> None:
    """Z is in no count (L1234); `dialect.z_order` says when it moves along with X or Y."""
    data = b"G01X0.875Y0.375Z0.5"
    wanted = {
        "before": [(0, 0, 1), (7, 3, 4)],
        "after": [(1, 0, 0), (7, 3, 4)],
        "together": [(1, 0, 0), (7, 3, 4)],
    }
    for order, (first, last) in wanted.items():
        target = load_target("valcnc", settings=[f"dialect.z_order={order}"])
        decoded = target.target.read(data, target.machine)
        rows = run(decoded, target.machine)
        places = [place for row in rows for place in steps_of(row)]
        scale = 25
        assert (places[0], places[-1]) == (first, tuple(scale * k for k in last))
        assert sum(row.duration_s for row in rows) == pytest.approx(
            scale * (7 if order == "together" else 7 + 4) / 6000.0
        )


READINGS = {
    "z": [8.05, 16.09, 24.21, 32.20, 40.29, 48.44, 56.52, 64.57, 72.61, 80.60],
    "y": [8.09, 16.19, 24.23, 32.28, 40.36, 48.48, 56.60, 64.71, 72.75, 80.86],
    "x": [8.08, 16.19, 24.23, 32.29, 40.35, 48.41, 56.53, 64.61, 72.70, 80.76],
}
"""Tablas 14, 15 and 16 (L1649-1682): mm after so many turns in +."""


@pytest.mark.parametrize(
    ("axis", "lead_mm", "error_mm", "worst_mm"),
    [("x", 8.076, 0.076, 0.046), ("y", 8.086, 0.086, 0.070), ("z", 8.060, 0.064, 0.100)],
)
def test_the_effective_leads_of_tables_14_to_16(
    axis: str, lead_mm: float, error_mm: float, worst_mm: float
) -> None:
    """The stated errors (L1658, L1673, L1688) are means of |turn − 8|; what the machine file
    makes of them is the lead, and what stays is 0.1 mm at most at each of the ten turns."""
    readings = np.array(READINGS[axis])
    assert np.abs(np.diff(readings, prepend=0.0) - 8.0).mean() == pytest.approx(error_mm)
    made = machine()
    at = "xyz".index(axis)
    assert 200 * list(made.axes)[at].real_step_mm == pytest.approx(lead_mm)
    path = ToolpathBuilder()
    for turn in range(1, 11):
        path.rapid(**{axis: 8.0 * turn})
    rows = run(path.finish(), made)
    assert [row.steps[at] for row in rows] == [200] * 10
    predicted = np.array([row.slide[-1, at] for row in rows])
    assert predicted == pytest.approx(lead_mm * np.arange(1, 11))
    assert np.abs(predicted - readings).max() == pytest.approx(worst_mm, abs=5e-4)
    assert predicted[-1] == pytest.approx(readings[-1])


def test_table_15_disagrees_with_its_own_readings() -> None:
    """Its last two errors are printed as 0.14 and 0.10; the readings give 0.04 and 0.11, and the
    stated 0.086 is the mean of those (L1673)."""
    turns = np.abs(np.diff(np.array(READINGS["y"]), prepend=0.0) - 8.0)
    assert turns[-2:] == pytest.approx([0.04, 0.11])
    printed = [0.09, 0.10, 0.04, 0.05, 0.08, 0.12, 0.12, 0.11, 0.14, 0.10]
    assert np.mean(printed) == pytest.approx(0.095)
    assert turns.mean() == pytest.approx(0.086)


def test_a_square_of_50_mm() -> None:
    """50 · 8.076 / 8 and 50 · 8.086 / 8; calibrated leads bring it within a step."""
    path = ToolpathBuilder().rapid(z=1.0).rapid(5.0, 5.0).line(z=-1.0, feed=14400.0)
    for x, y in ((55.0, 5.0), (55.0, 55.0), (5.0, 55.0), (5.0, 5.0)):
        path.line(x, y, feed=14400.0)
    wanted = path.rapid(z=1.0).finish()
    sizes = {}
    calibrated = [f"axes.{axis}.coded_step_mm={step}" for axis, step in LEADS.items()]
    for name, settings in (("nominal", []), ("calibrated", calibrated)):
        target = load_target("valcnc", settings=settings)
        program = target.target.write(wanted, target.machine)
        decoded = target.target.read(program.data, target.machine)
        report = verify(decoded, target.machine, wanted=wanted).report
        sizes[name] = [one.predicted_mm for one in report.dimensions[:2]]
    assert sizes["nominal"] == pytest.approx([50.475, 50.5375], abs=1e-6)
    assert sizes["calibrated"] == pytest.approx([50.0, 50.0], abs=STEP_MM)


LEADS = {"x": 0.04038, "y": 0.04043, "z": 0.0403}


@pytest.mark.parametrize("size", [1, 13, 1000])
def test_the_size_of_chunks_does_not_matter(size: int) -> None:
    toolpath = random_program(np.random.default_rng(3))
    made = machine("axes.x.backlash_mm=0.1", "axes.y.compensation_mm=0.08")
    whole, parts = run(toolpath, made), run(toolpath, made, chunk_steps=size)
    assert max(row.parts for row in parts) > 1 or size == 1000
    assert_same_rows(whole, parts)
    chunks = simulate(toolpath, made, Options(chunk_steps=size))
    assert all(len(chunk.row) <= size for chunk in chunks)


@pytest.mark.parametrize("counting", ["coordinates", "differences"])
def test_a_long_arc_is_made_a_block_of_pieces_at_a_time(counting: str) -> None:
    """25,000 pieces in two blocks: the slow loop makes the same."""
    made = machine("controller.arc_segment_mm=0.05", f"controller.counting={counting}")
    (row,) = run(arc((200, 0), (200, 0), (0, 0), ccw=False), made)
    twin = Valcnc((STEP_MM,) * 3, segment_mm=0.05, differences=counting == "differences")
    twin.at, twin.coordinate = (5000, 0, 0), (200.0, 0.0, 0.0)
    assert steps_of(row) == twin.arc((200.0, 0.0), -200.0, 0.0, ccw=False, full=True)


def test_effects_can_be_left_out() -> None:
    path = ToolpathBuilder().line(10, 5, feed=1).line(2, 1, feed=1).finish()
    made = machine("axes.x.backlash_mm=0.1")
    for row in run(path, made, effects=IDEAL):
        assert np.array_equal(row.slide, row.commanded)
    out, back = run(path, made, effects=Effects(scale=False))
    assert out.slide == pytest.approx(out.commanded)
    assert back.slide[-1, 0] == pytest.approx(2.1)
    _, scaled = run(path, made)
    assert scaled.slide[-1, 0] == pytest.approx(2.0 * 1.0095 + 0.1)


def test_steps_of_a_compensation_take_their_time() -> None:
    made = machine("axes.x.compensation_mm=0.12")
    path = ToolpathBuilder().line(4, 0, feed=1).line(0, 0, feed=1).finish()
    out, back = run(path, made)
    assert (out.compensation_s, back.compensation_s) == (0.0, pytest.approx(3 / 6000.0))
    assert back.duration_s == pytest.approx(103 / 6000.0)


def test_waits_and_rows_that_do_not_move() -> None:
    path = ToolpathBuilder().event(Kind.SET_ZERO).line(0, 0, feed=1).event(Kind.DWELL, 3.0)
    path.rapid(0.01).message("hello").line(0.4, feed=1).event(Kind.END).rapid(9)
    rows = run(path.finish(), machine())
    assert [len(row.commanded) for row in rows] == [0, 0, 0, 0, 0, 10, 0]
    assert [row.duration_s for row in rows] == pytest.approx([0, 0, 3, 0, 0, 10 / 6000, 0])
    assert rows_of(simulate(ToolpathBuilder().finish(), machine())) == []


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda b: b.arc(1, 0, centre=(0, 0), ccw=True, feed=9), "an arc about its own start"),
        (lambda b: b.arc(1, 0, centre=(0.4, 0), ccw=True, feed=9), "longer than its diameter"),
        (lambda b: b.arc(1, 0, centre=(math.nan, 0), ccw=True, feed=9), "without a centre"),
        (
            lambda b: b.arc(1, 0, centre=(0.5, 1e9), ccw=True, feed=9),
            "farther than the controller can count",
        ),
        (lambda b: b.arc(1, 0, 1, centre=(0.5, 0), ccw=True, feed=9), "Z moves along"),
        (lambda b: b.event(Kind.HOME_Z), "cannot return to machine zero"),
        (lambda b: b.event(Kind.DWELL, math.nan), "a dwell without its seconds"),
        (lambda b: b.rapid(1e9), "beyond all"),
    ],
)
def test_what_cannot_be_followed_is_named(build, words: str) -> None:
    b = ToolpathBuilder()
    b.block = 6
    path = build(b).finish()
    for start in (lambda: list(simulate(path, machine())), lambda: held(path)):
        with pytest.raises(ProgramError, match=words) as caught:
            start()
        assert "block 7" in str(caught.value)
    assert len(run(build(ToolpathBuilder().event(Kind.END)).finish(), machine())) == 1


def held(path: Toolpath) -> Toolpath:
    return model_of(machine()).quantised(path, machine())


def test_on_axes_of_unequal_steps_arcs_are_refused() -> None:
    made = machine("axes.x.coded_step_mm=0.04038")
    with pytest.raises(ProgramError, match="an ellipse"):
        simulate(arc((1, 0), (0, 1), (0, 0), ccw=True), made)


def test_the_limits_of_the_format() -> None:
    """99999 units are 800 m: a quarter of that radius, and a line back, 40 million passes."""
    target = load_target("valcnc", settings=["controller.arc_segment_mm=5"])
    data = b"G02X99999Y99999Z0I99999J0\nG00X0Y0Z0"
    decoded = target.target.read(data, target.machine)
    steps, last = np.zeros((2, 3), dtype=np.int64), 0.0
    for chunk in simulate(decoded, target.machine):
        np.add.at(steps, chunk.ledger.row, chunk.ledger.steps)
        assert len(chunk.row) <= 1 << 16
        last = chunk.commanded[-1]
    assert steps[:, :2].tolist() == [[19_999_800, 19_999_800]] * 2
    assert last.tolist() == [0.0, 0.0, 0.0]


def test_wrong_options_are_named() -> None:
    for setting in ("step_rate_hz=0", "arc_segment_mm=0", "arc_segments=0", "rounding=up"):
        with pytest.raises(MachineError, match=setting.partition("=")[0]):
            machine(f"controller.{setting}")


def test_it_says_where_the_rounding_to_steps_is_open() -> None:
    """3.5 mm are 87.5 steps; a PIC's binary fraction of it may be less. Whole steps are open to a
    controller that cuts off decimals."""
    path = ToolpathBuilder().line(3.5, 0.0, feed=1.0).line(3.5, 3.48, feed=1.0)
    path = path.line(1.01, 2.0, feed=1.0).finish()

    def said(*settings: str) -> list[str]:
        made = machine(*settings)
        return [
            each for each in model_of(made).assumptions(path, made) if "coordinates lie" in each
        ]

    assert [each.split()[0] for each in said()] == ["2"]
    assert [each.split()[0] for each in said("controller.rounding=truncated")] == ["2"]
    whole = ToolpathBuilder().line(4.0, 2.0, feed=1.0).finish()
    assert not any("lie" in one for one in model_of(machine()).assumptions(whole, machine()))


def test_what_it_says_of_itself() -> None:
    model = model_of(machine())
    assert model.interpolation(ToolpathBuilder().finish(), machine(), Options()) == "counter"
    assert model.spacing_mm(line_of(1, 1), machine()) == STEP_MM
    assert any("6000" in one for one in model.assumptions(ToolpathBuilder().finish(), machine()))
    assert any("0.2 mm" in one for one in model.assumptions(ToolpathBuilder().finish(), machine()))
    assert any(
        "7 pieces" in one
        for one in model.assumptions(
            ToolpathBuilder().finish(), machine("controller.arc_segments=7")
        )
    )
