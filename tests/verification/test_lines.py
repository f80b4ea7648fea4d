"""Lines of whole steps in closed form, against the chunks of the same motion, step by step."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.kernels import judging as at
from camtool.kernels.lines import MIN_EVENTS
from camtool.machine.model import Machine
from camtool.simulation import step_lines
from camtool.simulation.motion import Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification import verify as verifying
from camtool.verification.case import Case, VerifyOptions
from camtool.verification.slides import SlideTrace, Tasks
from camtool.verification.verify import Verification, judge
from tests.oracles.gcode_machines import grbl_machine
from tests.postprocessors.i8751.machines import SAMPLE
from tests.targets import model_of, on, simulate
from tests.verification.test_steps import Recorded

PLAY = ("axes.x.backlash_mm=0.11", "axes.y.backlash_mm=0.07")
SCALE = ("axes.x.real_step_mm=0.00401", "axes.y.real_step_mm=0.003998")
SQUARE = ("mechanics.squareness_rad=0.0007",)
PLAIN = ("axes.x.real_step_mm=0.04", "axes.y.real_step_mm=0.04")
ADDED = ("axes.x.compensation_mm=0.16", "axes.y.compensation_mm=0.04")

SETTINGS: list[tuple[str, tuple[str, ...]]] = [
    ("grbl", ()),
    ("grbl", PLAY),
    ("grbl", (*PLAY, "controller.start_play=centred", "controller.start_direction=-")),
    ("grbl", SCALE),
    ("grbl", SQUARE),
    ("grbl", (*PLAY, *SCALE, *SQUARE)),
    ("grbl", ("axes.y.coded_step_mm=0.0025", *PLAY)),
    ("valcnc", ()),
    ("valcnc", PLAIN),
    ("valcnc", (*PLAIN, *PLAY, *ADDED)),
    ("i8751", ()),
    ("i8751", (*PLAY, *SQUARE)),
]


def machine_of(target: str, settings: tuple[str, ...]) -> Machine:
    """A machine of a target, with settings over its file, and room for long lines."""
    if target == "grbl":
        return grbl_machine(*settings)
    file = SAMPLE if target == "i8751" else None
    return load_target(target, machine_file=file, settings=settings).machine


def lines(rng: np.random.Generator, scale: float) -> list[tuple[float, float]]:
    """Corners of a path: anywhere, along the axes and diagonals, back the same way, nearly along
    an axis, and some short lines."""
    x, y = rng.uniform(0.0, scale, 2).tolist()
    corners = [(x, y)]
    for kind in rng.integers(8, size=9).tolist():
        x, y = corners[-1]
        if kind == 0:
            x = rng.uniform(0.0, scale)
        elif kind == 1:
            y = rng.uniform(0.0, scale)
        elif kind == 2:
            x, y = x + 0.3 * scale, y + 0.3 * scale * rng.choice([-1.0, 1.0])
        elif kind == 3 and len(corners) > 1:
            x, y = corners[-2]
        elif kind == 4:
            x, y = x + rng.uniform(0.3, 0.8) * scale, y + rng.uniform(-1e-4, 1e-4) * scale
        elif kind == 5:
            x, y = x + rng.uniform(-0.01, 0.01) * scale, y + rng.uniform(-0.01, 0.01) * scale
        else:
            x, y = rng.uniform(0.0, scale, 2).tolist()
        corners.append((round(x, 3), round(y, 3)))
    return corners


def path_of(corners: list[tuple[float, float]], rng: np.random.Generator, arcs: bool) -> Toolpath:
    """Cut along the corners; a slope, rapids in the air, and an arc where the target has them."""
    b = ToolpathBuilder().rapid(z=0.2).rapid(*corners[0]).line(z=-0.2, feed=100.0)
    for number, corner in enumerate(corners[1:]):
        if number == 4:
            b.rapid(z=0.2).rapid(*corners[0]).rapid(*corner).line(z=-0.2, feed=100.0)
        elif number == 6 and arcs:
            x, y = b.position[:2]
            b.arc(x, y, centre=(x + 1.0, y), ccw=True, feed=100.0)
        b.line(*corner, feed=100.0)
    b.line(corners[0][0], corners[0][1], -0.2 - rng.uniform(0.0, 0.3) * arcs, feed=100.0)
    return b.rapid(z=0.2).event(Kind.END).finish()


def both(
    path: Toolpath, machine: Machine, wanted: Toolpath | None, points: int
) -> list[Verification]:
    """Judged by lines, and by chunks."""
    options = Options()
    made = VerifyOptions(trace_points=points, shape=False)
    case = Case(path, on(machine), wanted, None, made)
    steps = model_of(machine).fused_run(path, machine, options)
    assert steps is not None
    return [judge(case, steps), judge(case, simulate(path, machine, options))]


def assert_same_trace(one: SlideTrace, other: SlideTrace) -> None:
    """Each row has its last place in both, and its largest error. Of equally large errors rounding
    decides which one is kept; where that is a row's last, it is there once."""
    assert set(one.row) == set(other.row)
    for row in set(other.row):
        mine, theirs = one.row == row, other.row == row
        last = pytest.approx(other.points[theirs][-1], rel=0.0, abs=1e-12)
        assert one.points[mine][-1] == last
        largest = pytest.approx(other.error_mm[theirs].max(), rel=1e-9, abs=1e-12)
        assert one.error_mm[mine].max() == largest
        assert abs(int(mine.sum()) - int(theirs.sum())) <= max(1, 0.02 * theirs.sum())


PLACES = [at.TOTAL_X, at.TOTAL_Y]


@pytest.mark.parametrize("points", [0, 400])
@pytest.mark.parametrize(("target", "settings"), SETTINGS, ids=str)
def test_lines_are_judged_as_their_steps(
    target: str, settings: tuple[str, ...], points: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verifying, "RowFigures", Recorded)
    rng = np.random.default_rng(7)
    machine = machine_of(target, settings)
    step = min(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    long_lines = 0
    for number in range(6):
        corners = lines(rng, 4_000 * step)
        path = path_of(corners, rng, arcs=target == "grbl")
        wanted = None
        if number % 3:
            # The lines that were drawn: a little beside those of the program, and turned.
            far = step * (0.4 if number % 3 == 1 else 3.0)
            moved = [(x + rng.uniform(-far, far), y + rng.uniform(-far, far)) for x, y in corners]
            wanted = path_of(moved, np.random.default_rng(1), arcs=target == "grbl")
        line, step_by_step = both(path, machine, wanted, points)
        one, other = line.rows, step_by_step.rows
        squares = other.columns[:, at.KNOWN] * other.columns[:, at.TOTAL_SQUARES]
        rounding = 1e-14 * other.columns[:, at.KNOWN]
        signed = one.columns[:, at.TOTAL_SUM] - other.columns[:, at.TOTAL_SUM]
        assert (np.abs(signed) <= 1e-11 * np.sqrt(squares) + rounding).all()
        for column in set(range(at.ROW_COLUMNS)) - {at.TOTAL_SUM, *PLACES}:
            expected = pytest.approx(other.columns[:, column], rel=1e-11, abs=1e-13, nan_ok=True)
            assert one.columns[:, column] == expected, column
        for name in ("iterations", "steps", "reversals", "cutting_reversals", "ended"):
            assert np.array_equal(getattr(one.books, name), getattr(other.books, name)), name
        assert one.books.seconds == pytest.approx(other.books.seconds)
        assert one.books.compensation_s == pytest.approx(other.books.compensation_s)
        for name in ("inner", "whole"):
            assert getattr(one, name).p95 == pytest.approx(getattr(other, name).p95, rel=1e-9), (
                name
            )
        assert_same_trace(line.trace, step_by_step.trace)
        long_lines += int((one.columns[:, at.SAMPLES] >= MIN_EVENTS).sum())
    assert long_lines > 20


@st.composite
def single_lines(draw: st.DrawFn) -> tuple[Machine, Toolpath, Toolpath]:
    """A machine with any play and scale; a line there, or there and back, of many steps of X, Y or
    Z, with a common divisor or none; and a wanted one that is shifted and turned a little."""
    step = 0.004
    play = [draw(st.one_of(st.just(0.0), st.floats(0.0, 0.2))) for _ in "xy"]
    scales = [draw(st.sampled_from([step, 0.00401, 0.003998])) for _ in "xy"]
    lean = draw(st.sampled_from([0.0, 0.0007, -0.002]))
    sense = draw(st.sampled_from("+-"))
    machine = grbl_machine(
        f"axes.x.backlash_mm={play[0]!r}",
        f"axes.y.backlash_mm={play[1]!r}",
        f"axes.x.real_step_mm={scales[0]}",
        f"axes.y.real_step_mm={scales[1]}",
        f"mechanics.squareness_rad={lean}",
        f"controller.start_direction={sense}",
    )
    divisor = draw(st.sampled_from([1, 1, 2, 64, 500]))
    most, small = draw(st.integers(1024, 4000)), draw(st.integers(0, 4000))
    ways = [most - most % divisor, min(small, most) // divisor * divisor]
    ways = [way * draw(st.sampled_from([-1, 1])) for way in draw(st.permutations(ways))]
    rise = draw(st.sampled_from([0, 0, 40, 6000]))
    begin = np.array([draw(st.integers(0, 5000)), draw(st.integers(0, 5000))])
    shift = np.array([draw(st.floats(-0.01, 0.01)) for _ in "xyxy"]).reshape(2, 2)
    paths = []
    for moved in (0.0 * shift, shift):
        (x, y), (end_x, end_y) = (begin + np.array([[0, 0], ways])) * step + moved
        b = ToolpathBuilder().rapid(z=0.2).rapid(x, y).line(z=-0.2, feed=100.0)
        b.line(end_x, end_y, -0.2 - 0.0025 * rise, feed=100.0)
        b.line(x, y, -0.2, feed=100.0)
        paths.append(b.rapid(z=0.2).event(Kind.END).finish())
    return machine, paths[0], paths[1]


@given(single_lines())
def test_any_line_is_judged_as_its_steps(line: tuple[Machine, Toolpath, Toolpath]) -> None:
    machine, path, wanted = line
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(verifying, "RowFigures", Recorded)
        by_lines, by_steps = both(path, machine, wanted, 0)
    one, other = by_lines.rows, by_steps.rows
    for column in set(range(at.ROW_COLUMNS)) - {at.TOTAL_SUM, *PLACES}:
        expected = pytest.approx(other.columns[:, column], rel=1e-10, abs=1e-12, nan_ok=True)
        assert one.columns[:, column] == expected, column
    for name in ("iterations", "steps", "reversals"):
        assert np.array_equal(getattr(one.books, name), getattr(other.books, name)), name
    for name in ("inner", "whole"):
        assert getattr(one, name).p95 == pytest.approx(getattr(other, name).p95, rel=0.009)


def test_what_a_drawing_adds_to_each_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sizes are larger than errors by how far the drawing may lie from the wanted move: the sum of
    their squares has that of the sizes, which is not the square of anything."""
    monkeypatch.setattr(verifying, "RowFigures", Recorded)
    task_of = Tasks.of
    monkeypatch.setattr(
        Tasks, "of", lambda *rows: task_of(*rows)._replace(off=np.full(rows[2] - rows[1], 0.0013))
    )
    rng = np.random.default_rng(3)
    for machine in (grbl_machine(), grbl_machine(*PLAY, *SCALE)):
        path = path_of(lines(rng, 20.0), rng, arcs=False)
        line, step_by_step = both(path, machine, None, 0)
        one, other = line.rows, step_by_step.rows
        expected = pytest.approx(other.columns[:, at.TOTAL_SQUARES], rel=1e-11)
        assert one.columns[:, at.TOTAL_SQUARES] == expected
        expected = pytest.approx(other.columns[:, at.TOTAL_MAX], rel=1e-11)
        assert one.columns[:, at.TOTAL_MAX] == expected
        assert one.whole.p95 == pytest.approx(other.whole.p95, rel=1e-9)
        assert one.whole.rms > 0.0013


def test_the_number_of_threads_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(verifying, "RowFigures", Recorded)
    monkeypatch.setattr(step_lines, "LINES_AT_ONCE", 3)
    rng = np.random.default_rng(11)
    machine = grbl_machine(*PLAY)
    path = path_of([*lines(rng, 20.0), *lines(rng, 20.0), *lines(rng, 20.0)], rng, arcs=False)
    found, used = [], []
    pool = step_lines.ThreadPoolExecutor

    def counted(threads: int) -> ThreadPoolExecutor:
        used.append(threads)
        return pool(threads)

    monkeypatch.setattr(step_lines, "ThreadPoolExecutor", counted)
    for threads in (1, 2, 5):
        monkeypatch.setenv("OMP_NUM_THREADS", str(threads))
        steps = model_of(machine).fused_run(path, machine, Options())
        assert steps is not None
        case = Case(path, on(machine), None, None, VerifyOptions(trace_points=400))
        one = judge(case, steps)
        columns = one.rows.columns.tobytes()
        found.append((one.report.to_json(), columns, one.trace.points.tobytes()))
    assert used == [2, 5]
    assert found[0] == found[1] == found[2]


def test_lines_of_thousands_of_millions_of_steps() -> None:
    """Lines of 1 m at 4 nm a step: 250 million steps each. One by one they would take minutes."""
    machine = grbl_machine(
        *(f"axes.{axis}.coded_step_mm=0.000004" for axis in "xy"),
        *(f"axes.{axis}.travel_mm=2000" for axis in "xy"),
    )
    b = ToolpathBuilder().rapid(z=0.2).line(z=-0.2, feed=100.0)
    for number in range(20):
        b.line(1000.0 - 37.0 * number, 900.0 * (number % 2) + 11.0, feed=100.0)
    path = b.finish()
    case = Case(path, on(machine), None, None, VerifyOptions(shape=False))
    steps = model_of(machine).fused_run(path, machine, Options())
    assert steps is not None
    report = judge(case, steps).report
    assert report.steps.iterations > 3_000_000_000
    assert report.error_um.interpolation.max == pytest.approx(0.002, rel=0.6)


def test_mechanics_that_differ_from_place_to_place_are_judged_by_chunks() -> None:
    machine = grbl_machine("axes.x.repeatability_mm=0.001")
    path = ToolpathBuilder().line(9.0, 2.0, feed=100.0).finish()
    assert model_of(machine).fused_run(path, machine, Options()) is None
