"""Every arc that the writer sends must end on the real controller, where it was meant to."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from camtool.errors import PostError
from camtool.findings import Code, Severity
from camtool.kernels.lattice import to_steps
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Move, Toolpath
from camtool.toolpath.program import Program
from tests.oracles import arc_ends
from tests.oracles import pic_mmh_program as oracle
from tests.oracles.motion_rows import RowMotion, each_row, rows_of
from tests.targets import simulate, verify

pytestmark = pytest.mark.checked

STEP_MM = 0.00014
SEED = 20240607
EQUAL = ["controller.arc_end=equal"]


def random_path(rng: np.random.Generator, count: int, low_mm: float, high_mm: float) -> Toolpath:
    """`count` arcs and `count` lines in random order, each beginning where the last one ended:
    radii log-uniform, sweeps from less than a step to full circles, both ways round."""
    path = ToolpathBuilder()
    kinds = rng.permutation(np.repeat([True, False], count))
    for number, is_arc in enumerate(kinds):
        path.source = f"row {number}"
        x, y, _ = path.position
        if not is_arc:
            size = math.exp(rng.uniform(math.log(1e-5), math.log(0.5)))
            away = rng.normal(size=2) * size
            if max(abs(x), abs(y)) > 30.0:
                away = -0.5 * np.array([x, y])
            path.line(x + away[0], y + away[1], feed=0.8)
            continue
        radius = math.exp(rng.uniform(math.log(low_mm), math.log(high_mm)))
        angle, ccw = rng.uniform(-math.pi, math.pi), bool(rng.integers(2))
        cx, cy = x - radius * math.cos(angle), y - radius * math.sin(angle)
        sweep = rng.choice(
            [
                rng.uniform(0.0, 2.0 * math.pi),
                math.exp(rng.uniform(math.log(1e-4), 0.0)),
                2.0 * math.pi - math.exp(rng.uniform(math.log(1e-4), 0.0)),
                2.0 * math.pi,
            ],
            p=[0.6, 0.2, 0.1, 0.1],
        )
        to = angle + (sweep if ccw else -sweep)
        full = sweep == 2.0 * math.pi
        ex, ey = (x, y) if full else (cx + radius * math.cos(to), cy + radius * math.sin(to))
        path.arc(ex, ey, centre=(cx, cy), ccw=ccw, feed=0.8)
    return path.finish()


def last_of_rows(target: LoadedTarget, program: Program) -> Iterator[tuple[int, RowMotion]]:
    """Each block's motion as the simulated controller makes it from the bytes: the row of the
    wanted toolpath, and what it did."""
    decoded = target.target.read(program.data, target.machine)
    motion = each_row(simulate(decoded, target.machine, Options(effects=IDEAL)))
    for number, row in enumerate(motion):
        yield int(program.row_of_block[decoded.block[number]]), row


def check_ends(target: LoadedTarget, wanted: Toolpath, within_steps: float) -> Program:
    """Write, simulate, and compare each row: it ends, on time, where it was meant to, and no
    sample of an arc is farther than `within_steps` from the wanted circle. Gives the program."""
    program: Program = target.target.write(wanted, target.machine)
    unit_mm = 0.000015 if target.machine.dialect.form == "example" else 0.0005
    allowed = unit_mm + 0.5 * STEP_MM + 1e-9
    at = np.zeros((len(wanted) + 1, 3))
    iterations = np.zeros(len(wanted))
    row = -1
    position = np.zeros(3)
    for now, motion in last_of_rows(target, program):
        assert motion.ended, f"row {now} never ends"
        at[row + 1 : now + 1] = position  # rows without blocks leave the tool where it is
        row = max(row, now)
        if len(motion.commanded):
            position = motion.commanded[-1]
            if wanted.is_arc[now]:
                iterations[now] += motion.iterations
                out = motion.commanded[:, :2] - wanted.centre[now]
                radius = math.dist(wanted.end[now, :2], wanted.centre[now])
                stray = np.abs(np.hypot(out[:, 0], out[:, 1]) - radius).max()
                assert stray < within_steps * STEP_MM, f"row {now} strays by {stray} mm"
    at[row + 1 :] = position
    np.testing.assert_array_less(np.abs(at[1 : len(wanted) + 1] - wanted.end), allowed)
    length = np.abs(wanted.sweeps()) * np.hypot(*(wanted.end[:, :2] - wanted.centre).T) / STEP_MM
    arcs = wanted.is_arc
    assert (iterations[arcs] <= 1.1 * length[arcs] + 5.0 * within_steps).all(), (
        "an arc goes round twice"
    )
    return program


@pytest.mark.parametrize("count", [800, pytest.param(10_000, marks=pytest.mark.slow)])
def test_many_arcs_and_lines_end_where_they_were_programmed_to(count: int) -> None:
    target = load_target("pic-mmh", settings=EQUAL)
    wanted = random_path(np.random.default_rng(SEED), count, 0.05, 3.0)
    program = check_ends(target, wanted, within_steps=4.0)
    sent = program.row_of_block[program.row_of_block >= 0]
    assert wanted.is_arc[np.unique(sent)].sum() > 0.9 * count
    assert program.data.count(b"G02") > 0.4 * count
    assert program.data.count(b"G03") > 0.4 * count


def test_hundreds_in_the_annex_form() -> None:
    target = load_target("pic-mmh", settings=["dialect.form=annex", *EQUAL])
    wanted = random_path(np.random.default_rng(SEED), 400, 0.05, 3.0)
    program = check_ends(target, wanted, within_steps=25.0)
    assert program.data.count(b"G02") + program.data.count(b"G03") > 240


@pytest.mark.parametrize("form", ["example", "annex"])
def test_arcs_of_a_few_steps(form: str) -> None:
    target = load_target("pic-mmh", settings=[f"dialect.form={form}", *EQUAL])
    wanted = random_path(np.random.default_rng(SEED), 1_000, 0.0001, 0.02)
    check_ends(target, wanted, within_steps=4.0 if form == "example" else 25.0)


@pytest.mark.parametrize("form", ["example", "annex"])
def test_the_literal_controller_ends_every_block(form: str) -> None:
    target = load_target("pic-mmh", settings=[f"dialect.form={form}"])
    wanted = random_path(np.random.default_rng(SEED + 1), 250, 0.002, 0.08)
    program = target.target.write(wanted, target.machine)
    ran = oracle.run(program.data, form)
    assert len(ran) > 250
    for motion in ran:
        assert motion.met, motion.block
    assert ran[-1].end == tuple(to_steps(wanted.end[-1, :2], STEP_MM).tolist()) or form == "annex"


def check_readings(seed: int, count: int, largest_mm: float, form: str) -> None:
    """Each arc block of random paths stops on its own end by every reading of the thesis and with
    both starts of D, by the literal controller."""
    target = load_target("pic-mmh", settings=[f"dialect.form={form}"])
    wanted = random_path(np.random.default_rng(seed), count, 0.001, largest_mm)
    program = target.target.write(wanted, target.machine)
    blocks = oracle.arcs(program.data, form)
    assert len(blocks) > 0.4 * count
    for block, start, end in blocks:
        clockwise = block.startswith("G02")
        square = start[0] ** 2 + start[1] ** 2
        rounded = square - math.floor(math.sqrt(square) + 0.5) ** 2
        stops = [
            arc_ends.stop(start, end, clockwise, error, reading)
            for error in (0, rounded)
            for reading in arc_ends.READINGS
        ]
        assert all(stop.met for stop in stops), (block, stops)
        samples = [stop.samples for stop in stops]
        assert max(samples) - min(samples) <= 16, (block, stops)
        assert len(set(samples[:3])) == len(set(samples[3:])) == 1


@pytest.mark.parametrize("form", ["example", "annex"])
def test_arcs_end_by_every_reading_and_both_starts_of_d(form: str) -> None:
    check_readings(SEED + 2, 400, 0.03, form)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["example", "annex"])
def test_thousands_of_arcs_end_by_every_reading_and_both_starts_of_d(form: str) -> None:
    check_readings(SEED + 3, 5_000, 0.1, form)


@pytest.mark.parametrize(
    ("reading", "error"), [("final-quadrant", "zero"), ("nearest", "rounded-radius")]
)
def test_large_arcs_end_by_every_reading(reading: str, error: str) -> None:
    """Written for any machine, simulated on one of these: as on the strictest, step for step."""
    writer = load_target("pic-mmh", settings=EQUAL)
    wanted = random_path(np.random.default_rng(SEED + 4), 300, 0.05, 3.0)
    program: Program = writer.target.write(wanted, writer.machine)
    options = [f"controller.arc_end={reading}", f"controller.initial_error={error}"]
    other = load_target("pic-mmh", settings=options)
    assert other.target.write(wanted, other.machine).data == program.data
    for now, motion in last_of_rows(other, program):
        assert motion.ended, f"row {now} never ends"
    decoded = other.target.read(program.data, other.machine)
    assert not other.model.findings(decoded, other.machine, Options())


def format_block(move: Move) -> str:
    """Write a flat move as a block, wherever its arc would end."""
    code = ("G00", "G01", "G02", "G03")[move.kind]
    numbers = [*zip("XY", move.end[:2], strict=True)]
    if move.centre:
        numbers += zip("IJ", move.centre, strict=True)
    words = [f"{name}{'-' if mm < 0.0 else ''}{abs(mm) * 1000.0:08.2f}" for name, mm in numbers]
    return f"{code}{''.join(words)}F{round((move.feed or 0.0) * 10.0):02d};"


def foreign(rng: np.random.Generator, count: int) -> bytes:
    """A program of lines and arcs whose numbers nobody has planned."""
    path = ToolpathBuilder()
    for _ in range(count):
        path.line(*rng.uniform(-1, 1, 2), feed=0.8)
        x, y, _z = path.position
        angle = rng.uniform(0.0, 6.0)
        to, radius = angle + rng.uniform(0.5, 5.0), rng.uniform(0.02, 0.2)
        cx, cy = x - radius * math.cos(angle), y - radius * math.sin(angle)
        end = cx + radius * math.cos(to), cy + radius * math.sin(to)
        path.arc(*end, centre=(cx, cy), ccw=True, feed=1)
    blocks = [format_block(move) for move in path.finish()]
    return "\n".join(["G54;", *blocks, "M30;"]).encode()


def test_a_foreign_program_is_told_what_each_reading_does_to_it() -> None:
    target = load_target("pic-mmh")
    data = foreign(np.random.default_rng(SEED), 40)
    decoded = target.target.read(data, target.machine)
    (told,) = target.model.findings(decoded, target.machine, Options())
    assert (told.code, told.severity) == (ProgramCode.ARC_END_UNSURE, Severity.WARNING)
    fates = [
        {arc_ends.stop(start, end, False, 0, reading).met for reading in arc_ends.READINGS}
        for _, start, end in oracle.arcs(data, "example")
    ]
    missed = sum(
        not arc_ends.stop(start, end, False, 0, "equal").met
        for _, start, end in oracle.arcs(data, "example")
    )
    assert f"by equal {missed} run on" in told.message
    assert 10 < missed < 30
    assert told.measured is not None
    assert told.measured >= sum(fate != {True} for fate in fates)


@pytest.mark.parametrize(
    ("reading", "error"),
    [
        ("equal", "zero"),
        ("equal", "rounded-radius"),
        ("final-quadrant", "rounded-radius"),
        ("nearest", "zero"),
    ],
)
def test_foreign_arcs_run_as_the_reading_says(reading: str, error: str) -> None:
    """Step for step where each arc stops, the next one from there; judged on the way or not."""
    settings = [f"controller.arc_end={reading}", f"controller.initial_error={error}"]
    target = load_target("pic-mmh", settings=settings)
    data = foreign(np.random.default_rng(SEED + 5), 25)
    decoded = target.target.read(data, target.machine)
    at, endless = (0, 0), 0
    for row, motion in enumerate(
        each_row(simulate(decoded, target.machine, Options(effects=IDEAL)))
    ):
        end = tuple(to_steps(decoded.end[row, :2], STEP_MM).tolist())
        if decoded.is_arc[row]:
            cx, cy = to_steps(decoded.centre[row], STEP_MM).tolist()
            start, goal = (at[0] - cx, at[1] - cy), (end[0] - cx, end[1] - cy)
            square = start[0] ** 2 + start[1] ** 2
            rounded = square - math.floor(math.sqrt(square) + 0.5) ** 2
            used = rounded if error == "rounded-radius" else 0
            stop = arc_ends.stop(start, goal, False, used, reading)
            assert motion.iterations == stop.samples
            last = to_steps(motion.commanded[-1, :2], STEP_MM).tolist()
            assert (last[0] - cx, last[1] - cy) == stop.at
            assert motion.ended == (stop.met or reading != "equal")
            endless += not motion.ended
            end = end if reading == "equal" else (stop.at[0] + cx, stop.at[1] + cy)
        at = (int(end[0]), int(end[1]))
    assert (endless > 5) == (reading == "equal")
    report = verify(decoded, target.machine).report
    assert report.steps.iterations > 0
    unended = [each for each in report.findings if each.code == "ARC_MISSES_END"]
    assert bool(unended) == (reading == "equal")


def test_arcs_of_other_origin_do_miss_their_ends() -> None:
    # The ground of all this: formatted without planning, nearly half of all arcs never end.
    rng = np.random.default_rng(SEED)
    missed = 0
    for _ in range(200):
        path = ToolpathBuilder().line(*rng.uniform(-1, 1, 2), feed=0.8)
        x, y, _z = path.position
        angle = rng.uniform(0.0, 6.0)
        to = angle + rng.uniform(0.5, 5.0)
        cx, cy = x - 0.05 * math.cos(angle), y - 0.05 * math.sin(angle)
        path.arc(
            cx + 0.05 * math.cos(to), cy + 0.05 * math.sin(to), centre=(cx, cy), ccw=True, feed=1
        )
        blocks = [format_block(move) for move in path.finish()]
        missed += not oracle.run("\n".join(blocks).encode(), "example")[-1].met
    assert 60 < missed < 120


@pytest.mark.parametrize("ccw", [False, True])
@pytest.mark.parametrize("start", [(0.0, 0.0), (0.123456, -0.05), (0.00007, 0.00007)])
@pytest.mark.parametrize("radius", [0.001, 0.0137, 0.15, 1.0])
def test_full_circles_turn_once(ccw: bool, start: tuple[float, float], radius: float) -> None:
    target = load_target("pic-mmh", settings=EQUAL)
    for angle in np.linspace(0.0, 6.0, 7):
        path = ToolpathBuilder().line(*start, feed=1)
        centre = (start[0] + radius * math.cos(angle), start[1] + radius * math.sin(angle))
        wanted = path.arc(*start, centre=centre, ccw=ccw, feed=1).finish()
        check_ends(target, wanted, within_steps=4.0)
        program = target.target.write(wanted, target.machine)
        decoded = target.target.read(program.data, target.machine)
        turned = sum(decoded.sweeps())
        behind = np.arange(len(decoded)) > int(decoded.is_arc.argmax())
        mends = behind & decoded.is_feed & ~decoded.is_arc
        for row in np.flatnonzero(mends).tolist():
            arms = np.array([decoded.starts[row, :2], decoded.end[row, :2]]) - centre
            cross = arms[0, 0] * arms[1, 1] - arms[0, 1] * arms[1, 0]
            turned += math.atan2(cross, float(arms[0] @ arms[1]))
        assert abs(abs(turned) - 2.0 * math.pi) < 4.0 * STEP_MM / radius
        assert (turned > 0.0) == ccw


def mend_of(path: ToolpathBuilder) -> tuple[list[str], dict[Code, str]]:
    target = load_target("pic-mmh")
    program = target.target.write(path.finish(), target.machine)
    blocks = program.data.decode("ascii").splitlines()[2:-1]
    return blocks, {finding.code: finding.message for finding in program.findings}


def test_an_arc_of_no_step_is_nothing_and_no_full_circle() -> None:
    path = ToolpathBuilder().line(0.0126, 0, feed=1)
    blocks, found = mend_of(path.arc(0.0126, 0.00001, centre=(0, 0), ccw=True, feed=1))
    assert blocks == ["G01X00012.60Y00000.00F10;"]
    assert ProgramCode.MOVE_COLLAPSED in found


def test_an_arc_that_lacks_less_than_a_step_is_a_full_circle() -> None:
    path = ToolpathBuilder().line(0.0126, 0, feed=1)
    blocks, found = mend_of(path.arc(0.0126, -0.00001, centre=(0, 0), ccw=True, feed=1))
    assert blocks[1] == "G03X00012.60Y00000.00I00000.00J00000.00F10;"
    assert len(blocks) == 2
    assert ProgramCode.ARC_MENDED not in found


def test_an_arc_about_its_own_start_is_written_as_lines() -> None:
    path = ToolpathBuilder().arc(0.0002, 0, centre=(0.0001, 0), ccw=True, feed=1)
    blocks, found = mend_of(path)
    assert all(block.startswith("G01") for block in blocks)
    assert blocks[-1] == "G01X00000.20Y00000.00F10;"
    assert "1 arc too small" in found[ProgramCode.MOVE_COLLAPSED]


def test_mends_are_counted_once_and_go_on_the_same_way() -> None:
    rng = np.random.default_rng(SEED)
    wanted = random_path(rng, 600, 0.1, 0.5)
    target = load_target("pic-mmh")
    program = target.target.write(wanted, target.machine)
    (finding,) = [f for f in program.findings if f.code == ProgramCode.ARC_MENDED]
    decoded = target.target.read(program.data, target.machine)
    rows = program.row_of_block[decoded.block]
    mends = [
        index
        for index in range(1, len(decoded))
        if rows[index] == rows[index - 1] and decoded.is_arc[index - 1]
    ]
    assert finding.message.startswith(f"{len(mends)} arcs")
    rest = decoded.end[mends] - decoded.end[np.array(mends) - 1]
    assert finding.measured is not None
    assert abs(np.hypot(rest[:, 0], rest[:, 1]).max() * 1000.0 - finding.measured) < 0.2
    # The price of a mend would be a reversal: with and without the lines there are as many.
    motion = rows_of(simulate(decoded, target.machine, Options(effects=IDEAL)))
    turned_round = sum(int(motion[index].reversals.sum()) for index in mends)
    assert turned_round <= len(mends) // 50


def test_the_other_initial_error_ends_too() -> None:
    target = load_target("pic-mmh", settings=["controller.initial_error=rounded-radius", *EQUAL])
    check_ends(target, random_path(np.random.default_rng(SEED), 500, 0.01, 0.5), 4.0)


def test_arcs_end_with_another_step() -> None:
    step = "0.000139509"
    settings = [f"axes.{axis}.coded_step_mm={step}" for axis in "xyz"]
    target = load_target("pic-mmh", settings=[*settings, *EQUAL])
    wanted = random_path(np.random.default_rng(SEED), 500, 0.01, 0.5)
    program = target.target.write(wanted, target.machine)
    assert all(motion.ended for _, motion in last_of_rows(target, program))


def test_an_arc_written_as_lines_may_not_leave_the_digits() -> None:
    target = load_target("pic-mmh", settings=["dialect.form=annex"])
    path = ToolpathBuilder().line(99.999, 0, feed=1)
    path.arc(99.999, 0.0014, centre=(99.999, 0.0007), ccw=True, feed=1)
    with pytest.raises(PostError, match="five digits"):
        target.target.write(path.finish(), target.machine)


def test_an_arc_up_or_down_is_split() -> None:
    path = ToolpathBuilder().rapid(1, 0, 0)
    path.position = (1.0, 0.0, 0.5)
    wanted = path.arc(-1, 0, centre=(0, 0), ccw=True, feed=1)
    blocks, found = mend_of(wanted)
    assert [block[:4] for block in blocks[:3]] == ["G00X", "G01Z", "G03X"]
    assert ProgramCode.MOVE_SPLIT in found
    assert Kind.ARC_CCW in wanted.finish().kind
