"""The i8751 controller as a whole: against a literal run, and by the figures of its thesis."""

import itertools
import math
import re

import numpy as np
import pytest

from camtool.errors import ProgramError
from camtool.machine.model import Machine
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.corte_recto import walk
from tests.oracles.i8751_run import Reading, record
from tests.oracles.motion_rows import RowMotion, assert_same_rows, rows_of
from tests.postprocessors.i8751.machines import ROOT, SAMPLE, STEP_MM, loaded
from tests.targets import model_of, simulate, verify


def machine(*settings: str) -> Machine:
    """The sample machine with options of [dialect]."""
    return loaded(*settings).machine


def changed(*settings: str) -> Machine:
    """The sample machine with any values changed."""
    return load_target("i8751", machine_file=SAMPLE, settings=settings).machine


def run(toolpath: Toolpath, made: Machine, **options: object) -> list[RowMotion]:
    return rows_of(simulate(toolpath, made, Options(**options)))  # type: ignore[arg-type]


def steps_of(row: RowMotion) -> list[tuple[int, int, int]]:
    return [(x, y, z) for x, y, z in np.rint(row.commanded / STEP_MM).astype(int).tolist()]


def in_steps(*moves: tuple[int, int, int], feed: float = 50.0) -> Toolpath:
    """Lines to the given places in steps."""
    path = ToolpathBuilder()
    for x, y, z in moves:
        path.line(x * STEP_MM, y * STEP_MM, z * STEP_MM, feed=feed)
    return path.finish()


def random_moves(rng: np.random.Generator, count: int) -> list[tuple[int, int, int]]:
    """Places in steps; some moves are long, some have equal steps, some none at all."""
    places = [(0, 0, 0)]
    for _ in range(count):
        reach = int(rng.choice([3, 60, 400]))
        x, y, z = rng.integers(-reach, reach + 1, 3).tolist()
        how = int(rng.integers(6))
        x, y, z = [(x, y, 0), (x, 0, 0), (0, 0, z), (x, y, z), (x, -x, 0), (0, 0, 0)][how]
        at = places[-1]
        places.append((at[0] + x, at[1] + y, at[2] + z))
    return places[1:]


READINGS = [
    ((), Reading()),
    (("high_byte='255'", "first_pulse=repeats"), Reading(bursts=True, repeats=True)),
    (("cruise=declared", "delay=counted", "elbow=flows"), None),
]


@pytest.mark.parametrize(("settings", "reading"), READINGS, ids=str)
def test_random_programs_equal_the_literal_run(
    settings: tuple[str, ...], reading: Reading | None
) -> None:
    how = reading or Reading(declared=True, counted=True, flows=True)
    made = machine(*settings)
    rng = np.random.default_rng(8751)
    for _ in range(30):
        moves = random_moves(rng, 8)
        at = (0, 0, 0)
        for row, to in zip(run(in_steps(*moves), made), moves, strict=True):
            x, y, z = (b - a for a, b in zip(at, to, strict=True))
            wanted = record(at, (x, y, z), how)
            assert steps_of(row) == wanted.places
            assert row.duration_s == pytest.approx(wanted.seconds, rel=1e-12)
            assert row.steps.tolist() == [abs(x), abs(y), abs(z)]
            assert row.iterations == len(wanted.places)
            assert row.ended
            at = to


def test_every_small_record() -> None:
    """All senses, from all sides: the places of the literal walk."""
    ways = list(itertools.product(range(-9, 10), repeat=2))
    places = np.cumsum(ways, axis=0)
    path = in_steps(*((int(x), int(y), 0) for x, y in places))
    rows = run(path, machine())
    for (dx, dy), (x, y), row in zip(ways, places.tolist(), rows, strict=True):
        wanted = [(x - dx + px, y - dy + py, 0) for px, py in walk(dx, dy)]
        assert steps_of(row) == wanted


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_the_size_of_chunks_does_not_matter(size: int) -> None:
    moves = random_moves(np.random.default_rng(1), 40)
    made = machine()
    whole, parts = run(in_steps(*moves), made), run(in_steps(*moves), made, chunk_steps=size)
    assert max(row.parts for row in parts) > 1 or size == 1000
    assert_same_rows(whole, parts)
    chunks = simulate(in_steps(*moves), made, Options(chunk_steps=size))
    assert all(len(chunk.row) <= size for chunk in chunks)


@pytest.mark.parametrize(
    ("dx", "dy", "steps"),
    [(100, 50, 22.36), (100, 41, 22.38), (100, 100, 0.0), (300, 100, 63.25), (100, 0, 0.0)],
)
def test_the_error_of_the_dog_leg(dx: int, dy: int, steps: float) -> None:
    """e = b·(a − b)/√(a² + b²), by the rule of L416-426 and L4683-4705; the verifier sees it."""
    assert dy * (dx - dy) / math.hypot(dx, dy) == pytest.approx(steps, abs=0.005)
    for x, y in ((dx, dy), (-dy, dx), (dy, -dx), (-dx, -dy)):
        found = verify(in_steps((0, 0, -1), (x, y, -1)), machine()).report
        assert found.error_um.interpolation.max == pytest.approx(
            1e3 * STEP_MM * dy * (dx - dy) / math.hypot(dx, dy), abs=1e-6
        )


def test_no_line_strays_by_more_than_a_fifth_of_it() -> None:
    """At most (√2 − 1)/2 = 0.2071 of its length, at 22.5°."""
    slopes = range(0, 1001, 2)
    rows = run(in_steps(*(to for dy in slopes for to in ((1000, dy, 0), (0, 0, 0)))), machine())
    strays = {}
    for dy, row in zip(slopes, rows[::2], strict=True):
        x, y, square = row.commanded[:, 0], row.commanded[:, 1], 1000**2 + dy**2
        strays[dy] = np.abs(x * dy - y * 1000).max() / square / STEP_MM
    worst = max(strays, key=lambda dy: strays[dy])
    assert strays[worst] == pytest.approx((math.sqrt(2.0) - 1.0) / 2.0, rel=1e-6)
    assert math.degrees(math.atan2(worst, 1000)) == pytest.approx(22.5, abs=0.03)


def test_there_and_back_are_two_paths() -> None:
    """The elbow lies left of the travel out and left of the travel back."""
    out, back = run(in_steps((300, 100, 0), (0, 0, 0)), machine())
    side = [(row.commanded[:, 1] * 300 - row.commanded[:, 0] * 100) for row in (out, back)]
    assert side[0].max() > 0.0 > side[1].min()
    assert side[0].min() == pytest.approx(0.0, abs=1e-9)
    assert side[1].max() == pytest.approx(0.0, abs=1e-9)


def test_elbows_are_samples_and_axes_take_turns() -> None:
    (row,) = run(in_steps((3, -1, 2)), machine())
    assert steps_of(row) == [(1, -1, 0), (2, -1, 0), (3, -1, 0), (3, -1, 1), (3, -1, 2)]
    assert row.reversals.tolist() == [0, 1, 0]


@pytest.mark.parametrize(
    ("steps", "coded_s", "declared_s"),
    [(89, 11.125, 11.125), (90, 6.17, 6.38), (200, 7.22, 7.95), (1000, 14.9, 19.4)],
)
def test_the_times_of_ramps(steps: int, coded_s: float, declared_s: float) -> None:
    """Below 90 steps all at 8 Hz (L3095-3111, L3150-3183); 45 up and 45 down (L3197-3245); the
    cruise at 104.4 Hz as coded (L3241-3245), or at 70 (L3187-3191)."""
    path = in_steps((steps, 0, 0), (steps, 0, -steps))
    for settings, wanted in (((), coded_s), (("cruise=declared",), declared_s)):
        x, z = run(path, machine(*settings))
        assert x.duration_s == pytest.approx(wanted, rel=0.004)
        assert z.duration_s == x.duration_s


def test_an_elbow_ramps_anew_or_flows() -> None:
    path = in_steps((300, 100, 0))
    assert run(path, machine())[0].duration_s == pytest.approx(6.27 + 7.22, rel=0.004)
    (flows,) = run(path, machine("elbow=flows"))
    (along,) = run(in_steps((300, 0, 0)), machine())
    assert flows.duration_s == pytest.approx(along.duration_s)


def test_feeds_that_are_read_are_those_of_the_motion() -> None:
    target = loaded("first_pulse=repeats", "high_byte='255'")
    program = target.target.write(in_steps((0, 0, -130), (700, 200, -130)), target.machine)
    decoded = target.target.read(program.data, target.machine)
    assert decoded.is_feed.sum() > 5
    for move, row in zip(decoded, run(decoded, target.machine), strict=True):
        if move.feed is not None:
            length = math.dist(move.start, move.end)
            assert row.duration_s == pytest.approx(60.0 * length / move.feed)


def test_waits_and_rows_that_do_not_move() -> None:
    path = ToolpathBuilder().event(Kind.SET_ZERO).event(Kind.DWELL, 3.0)
    path.line(STEP_MM, feed=9).line(STEP_MM, feed=9).event(Kind.DWELL, 2.0).message("hello")
    path.event(Kind.END).line(5 * STEP_MM, feed=9)
    rows = run(path.finish(), machine())
    assert [row.duration_s for row in rows] == pytest.approx([0, 3, 0.125, 0, 2, 0, 0], rel=1e-3)
    assert [len(row.commanded) for row in rows] == [0, 0, 1, 0, 0, 0, 0]
    assert rows_of(simulate(ToolpathBuilder().finish(), machine())) == []


def test_play_and_scale_act_behind_the_controller() -> None:
    made = machine()
    played = changed("axes.x.backlash_mm=0.05", "axes.y.real_step_mm=0.0126")
    path = in_steps((100, 40, 0), (60, 0, 0))
    out, back = run(path, played)
    assert out.slide[:, 0] == pytest.approx(out.commanded[:, 0])
    assert out.slide[:, 1] == pytest.approx(out.commanded[:, 1] * 1.008)
    assert back.slide[-1, 0] == pytest.approx(60 * STEP_MM + 0.05)
    assert back.reversals.tolist() == [1, 1, 0]
    for row, plain in zip(run(path, played, effects=IDEAL), run(path, made), strict=True):
        assert np.array_equal(row.slide, plain.commanded)


def test_compensation_that_a_machine_file_asks_for_takes_time() -> None:
    made = changed("axes.x.compensation_mm=0.05")
    out, back = run(in_steps((50, 0, 0), (0, 0, 0)), made)
    assert out.compensation_s == 0.0
    assert back.compensation_s == pytest.approx(4 * 0.125, rel=1e-4)
    assert back.duration_s == pytest.approx(out.duration_s + back.compensation_s)


def test_held_moves_end_on_whole_steps() -> None:
    path = ToolpathBuilder().line(1.0004, -0.5071, feed=9).line(1.0063, -0.5, feed=9).finish()
    made = machine()
    kept = model_of(made).quantised(path, made)
    assert kept.end / STEP_MM == pytest.approx(np.array([[80, -41, 0], [81, -40, 0]]))
    last = run(path, made)[-1]
    assert np.array_equal(last.commanded[-1], kept.end[-1])


def test_steps_of_their_own_for_each_axis() -> None:
    made = changed("axes.y.coded_step_mm=0.01", "axes.z.coded_step_mm=0.005")
    (row,) = run(ToolpathBuilder().line(0.05, 0.02, -0.01, feed=9).finish(), made)
    assert row.steps.tolist() == [4, 2, 2]
    assert row.commanded[1].tolist() == pytest.approx([0.025, 0.02, 0.0])
    assert row.commanded[-1].tolist() == pytest.approx([0.05, 0.02, -0.01])


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda b: b.arc(1, 0, centre=(0.5, 0), ccw=True, feed=9), "no arcs; write them as lines"),
        (lambda b: b.event(Kind.HOME_XY), "cannot return to machine zero"),
        (lambda b: b.event(Kind.DWELL, -1.0), "a dwell without its seconds"),
        (lambda b: b.event(Kind.DWELL), "a dwell without its seconds"),
        (lambda b: b.rapid(1e9), "beyond all"),
        (lambda b: b.rapid(1).event(Kind.SET_ZERO), "part zero"),
        (lambda b: b.set_position(1, 1, 0).event(Kind.DWELL, 1.0), "an event that moves"),
    ],
)
def test_what_cannot_be_followed_is_named(build, words: str) -> None:
    b = ToolpathBuilder()
    b.block = 6
    path = build(b).finish()
    with pytest.raises(ProgramError, match=words) as caught:
        list(simulate(path, machine()))
    assert "block 7" in str(caught.value)
    with pytest.raises(ProgramError, match=words):
        model_of(machine()).quantised(path, machine())
    # Behind the end nothing is run, and nothing asked.
    ended = ToolpathBuilder().event(Kind.END)
    assert len(run(build(ended).finish(), machine())) == 1


def test_the_longest_record_and_many_short_ones() -> None:
    (row,) = run(in_steps((65535, -65535, 0)), machine())
    assert row.steps.tolist() == [65535, 65535, 0]
    assert row.duration_s == pytest.approx(633.0, rel=0.004)
    count = 100_000
    ends = np.column_stack([2 * np.arange(1, count + 1), np.arange(count) % 2, np.zeros(count)])
    moves = Toolpath(
        kind=np.full(count, Kind.LINE),
        end=ends * STEP_MM,
        centre=np.full((count, 2), np.nan),
        feed=np.full(count, 9.0),
        value=np.full(count, np.nan),
        source=np.full(count, -1),
        block=np.arange(count),
        start=np.zeros(3),
    )
    chunks = list(simulate(moves, machine()))
    assert len(chunks) < 20
    assert sum(int(chunk.ledger.steps[:, 0].sum()) for chunk in chunks) == 2 * count
    last = np.concatenate(
        [chunk.commanded[np.diff(chunk.row, append=-1) != 0] for chunk in chunks]
    )
    assert last == pytest.approx(moves.end)


@pytest.mark.parametrize(
    ("column", "settings"),
    [(1, ()), (2, ("delay=counted",)), (3, ("cruise=declared",)), (4, ("high_byte='255'",))],
)
def test_the_table_of_the_page(column: int, settings: tuple[str, ...]) -> None:
    """The times of ramps there are those of the simulation."""
    page = (ROOT / "docs" / "controllers" / "i8751.md").read_text(encoding="utf-8")
    lines = re.findall(r"^\|( \d+ \|(?: \d+\.\d+ \|){4})$", page, re.MULTILINE)
    table = [[float(cell) for cell in line.rstrip(" |").split("|")] for line in lines]
    assert len(table) == 7
    for row in table:
        (moved,) = run(in_steps((int(row[0]), 0, 0)), machine(*settings))
        assert moved.duration_s == pytest.approx(row[column], abs=0.051 if row[0] > 1e4 else 6e-4)


def test_what_it_says_of_itself() -> None:
    model = model_of(machine())
    assert model.interpolation(ToolpathBuilder().finish(), machine(), Options()) == "dog-leg"
    assert model.spacing_mm(in_steps((1, 0, 0)), machine()) == STEP_MM
    said = " ".join(
        model.assumptions(
            ToolpathBuilder().finish(), machine("cruise=declared", "elbow=flows", "delay=counted")
        )
    )
    assert "8.06 Hz" in said
    assert "70.0 Hz" in said
    assert "a dog-leg has a ramp" in said
    assert "104.4 Hz" in " ".join(model.assumptions(ToolpathBuilder().finish(), machine()))
