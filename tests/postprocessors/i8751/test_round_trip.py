"""What is written reads back as the same moves, exact in steps, and stays near what was wanted."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import PostError
from camtool.target.registry import LoadedTarget
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program
from tests.oracles.corte_recto import farthest, walk
from tests.postprocessors.i8751.machines import OPTIONS, STEP_MM, loaded
from tests.strategies import examples

FORMATS = ("packets", "listing", "hex")
TOLERANCE_MM = 0.05

TARGETS = {
    (form, option): loaded(f"format={form}", *([option] if option else []))
    for form in FORMATS
    for option in ("", *OPTIONS)
}


@dataclass
class Wanted:
    """A toolpath on whole steps, and its row, kind and place (steps) for each of its moves."""

    path: ToolpathBuilder = field(default_factory=ToolpathBuilder)
    places: list[tuple[int, int, int]] = field(default_factory=list)
    seconds: int = 0

    def finish(self) -> Toolpath:
        return self.path.finish()


STEPS = st.one_of(st.integers(-3, 3), st.integers(-700, 700), st.integers(-70_000, 70_000))
ROW = st.one_of(
    st.tuples(st.just("rapid"), STEPS, STEPS, st.just(0)),
    st.tuples(st.just("line"), STEPS, STEPS, st.just(0)),
    st.tuples(st.sampled_from(["rapid", "line"]), st.just(0), st.just(0), STEPS),
    st.tuples(st.sampled_from(["rapid", "line"]), STEPS, STEPS, STEPS),
    st.tuples(st.just("dwell"), st.integers(0, 900), st.just(0), st.just(0)),
    st.tuples(st.just("text"), st.just(0), st.just(0), st.just(0)),
)


@st.composite
def wanted(draw: st.DrawFn, dwells: bool = True) -> Wanted:
    """Rows between whole steps; off the grid by less than half a step."""
    off = draw(st.floats(-0.49, 0.49)) * STEP_MM
    result = Wanted()
    x, y, z = 0, 0, 0
    for name, dx, dy, dz in draw(st.lists(ROW, min_size=1, max_size=8)):
        if name == "dwell":
            if dwells:
                result.path.event(Kind.DWELL, dx)
                result.seconds += dx
            continue
        if name == "text":
            result.path.message("END\n; X+1.0 54 <- A")
            continue
        x, y, z = x + dx, y + dy, z + dz
        ends = (x * STEP_MM + off, y * STEP_MM + off, z * STEP_MM + off)
        if name == "rapid":
            result.path.rapid(*ends)
        else:
            result.path.line(*ends, feed=30.0)
        result.places.append((x, y, z))
    if draw(st.booleans()):
        result.path.event(Kind.END)
    return result


def steps_of(path: Toolpath) -> np.ndarray:
    """(N, 3) ends in steps, which must be whole."""
    exact = path.end / STEP_MM
    steps = np.rint(exact)
    assert np.abs(exact - steps).max(initial=0.0) < 1e-6
    return steps.astype(np.int64)


def write_and_read(target: LoadedTarget, path: Toolpath) -> tuple[Program, Toolpath] | None:
    try:
        program = target.target.write(path, target.machine)
    except PostError as error:
        if "nothing moves" not in str(error):
            raise
        return None
    return program, target.target.read(program.data, target.machine)


def check_places(given_path: Toolpath, program: Program, read: Toolpath, places: list) -> None:
    """The last block of each move ends on its place; a move without a block moved nowhere."""
    ends = steps_of(read)
    rows = np.flatnonzero(given_path.is_motion)
    owner = program.row_of_block[read.block]
    before = (0, 0, 0)
    for row, place in zip(rows.tolist(), places, strict=True):
        own = np.flatnonzero((owner == row) & read.is_motion)
        if len(own):
            assert tuple(ends[own[-1]]) == place
        else:
            assert place == before
        before = place


@pytest.mark.parametrize("form", FORMATS)
@given(made=wanted())
@examples(40, 10_000)
def test_every_place_comes_back(form: str, made: Wanted) -> None:
    path = made.finish()
    both = write_and_read(TARGETS[form, ""], path)
    if both is None:
        return
    program, read = both
    check_places(path, program, read, made.places)
    assert np.nansum(read.value[read.kind == Kind.DWELL]) == made.seconds
    assert read.kind[-1] == Kind.END
    assert (np.diff(read.block) >= 0).all()
    assert read.block[-1] == len(program.row_of_block) - 1


@given(made=wanted(dwells=False), option=st.sampled_from(OPTIONS), form=st.sampled_from(FORMATS))
@examples(100, 10_000)
def test_with_every_other_reading_of_the_thesis(made: Wanted, option: str, form: str) -> None:
    path = made.finish()
    both = write_and_read(TARGETS[form, option], path)
    if both is None:
        return
    program, read = both
    if option == "z_alone=with-step":
        xy = np.diff(steps_of(read)[read.is_motion], axis=0, prepend=np.zeros((1, 3)))
        blocks = read.block[read.is_motion]
        moved = {int(block) for block in blocks[xy[:, :2].any(axis=1)]}
        assert moved == set(blocks.tolist())
        assert tuple(steps_of(read)[-1]) == made.places[-1]
    else:
        check_places(path, program, read, made.places)


@given(made=wanted())
@examples(20, 2000)
def test_the_formats_say_the_same(made: Wanted) -> None:
    path = made.finish()
    both = [write_and_read(TARGETS[form, ""], path) for form in FORMATS]
    if both[0] is None:
        return
    reads = [one[1] for one in both if one is not None]
    for read in reads[1:]:
        for column in ("kind", "end", "feed", "value", "block"):
            np.testing.assert_array_equal(getattr(read, column), getattr(reads[0], column))


@given(dx=st.integers(-900, 900), dy=st.integers(-900, 900))
def test_the_dog_legs_of_a_cut_stay_within_the_tolerance(dx: int, dy: int) -> None:
    target = TARGETS["packets", ""]
    path = ToolpathBuilder().line(z=-1, feed=30).line(dx * STEP_MM, dy * STEP_MM, feed=30)
    if not (dx or dy):
        return
    read = target.target.read(
        target.target.write(path.finish(), target.machine).data, target.machine
    )
    x, y = 0, 0
    places = []
    for end in steps_of(read)[1:-1]:
        places += [(x + px, y + py) for px, py in walk(int(end[0]) - x, int(end[1]) - y)]
        x, y = int(end[0]), int(end[1])
    strays = farthest(places, (dx, dy), (STEP_MM, STEP_MM))
    assert strays <= TOLERANCE_MM * (1.0 + 1e-9)


@given(radius=st.floats(0.5, 20.0), turn=st.floats(0.1, 2.0 * math.pi), ccw=st.booleans())
def test_arcs_are_followed_to_their_end(radius: float, turn: float, ccw: bool) -> None:
    target = TARGETS["packets", ""]
    sweep = turn if ccw else -turn
    end = (radius * math.cos(sweep) - radius, radius * math.sin(sweep))
    path = ToolpathBuilder().line(z=-1, feed=30)
    path.arc(*end, centre=(-radius, 0.0), ccw=ccw, feed=30)
    read = target.target.read(
        target.target.write(path.finish(), target.machine).data, target.machine
    )
    away = np.hypot(read.end[1:, 0] + radius, read.end[1:, 1]) - radius
    # Chord (0.01), dog-leg, and half a step in X and in Y.
    assert np.abs(away).max() <= 0.01 + TOLERANCE_MM + math.sqrt(0.5) * STEP_MM
    assert np.abs(read.end[-1, :2] - end).max() <= 0.5 * STEP_MM * (1.0 + 1e-9)


def test_kinds_come_back_from_a_planned_path() -> None:
    path = ToolpathBuilder().rapid(z=1).rapid(1, 2).line(z=-0.5, feed=30).line(1, 5, feed=30)
    path.rapid(z=1).rapid(0, 0).event(Kind.END)
    target = loaded("long_runs=true")
    toolpath = path.finish()
    read = target.target.read(target.target.write(toolpath, target.machine).data, target.machine)
    np.testing.assert_array_equal(read.kind, toolpath.kind)
    np.testing.assert_array_equal(read.end, toolpath.end)


def test_a_flat_program_is_lines() -> None:
    target = TARGETS["packets", ""]
    path = ToolpathBuilder().rapid(1, 2).line(1, 5, feed=30).finish()
    read = target.target.read(target.target.write(path, target.machine).data, target.machine)
    assert read.kind.tolist() == [Kind.LINE, Kind.LINE, Kind.END]
