"""The stock between set-ups: columns of material that both faces cut, against literal ones."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.findings import Finding
from camtool.geometry.polylines import Polyline
from camtool.geometry.turn import Turn
from camtool.planning.job import Job, JobSetup, Operation, Stock, Tabs, Tool
from camtool.planning.plan import planned
from camtool.records import replace
from camtool.stock.before import SetupCut, StockBefore, least_remaining, stock_before
from camtool.stock.checks import stock_findings, stock_request
from camtool.stock.heightmap import height_map
from camtool.stock.heights import stock_tree
from camtool.stock.moves import StockMoves, stock_moves_of_toolpath
from camtool.stock.rapids import rapids_through_stock
from camtool.stock.slides import tools_of_rows
from tests.drawings import drawing_of
from tests.oracles import stock_heights as slow
from tests.oracles.path_machine import path_machine
from tests.stock.cuts import moves_of
from tests.stock.test_heights import random_moves
from tests.stock.test_pieces import box
from tests.strategies import examples

THICK = 4.0
TURNS: dict[str, Callable[[Floats], Floats]] = {
    "same": lambda p: p,
    "y": lambda p: np.column_stack([9.0 - p[:, 0], p[:, 1]]),
    "x": lambda p: np.column_stack([p[:, 0], 11.0 - p[:, 1]]),
}
MAPS = {"same": Turn(), "y": Turn.about("y", 4.5), "x": Turn.about("x", 5.5)}


def literal_column(cuts: list[tuple[StockMoves, str]], points: Floats) -> tuple[Floats, Floats]:
    """Return floor and top (J,) over points, each set-up by itself and by the slow twin."""
    floor, top = np.full(len(points), -np.inf), np.zeros(len(points))
    for moves, turn in cuts:
        z = np.array(slow.heights(moves, TURNS[turn](points)))
        if turn == "same":
            top = np.minimum(top, z)
        else:
            floor = np.maximum(floor, np.where(z < 0.0, -THICK - z, -np.inf))
    return floor, top


@examples(15)
@given(
    seed=st.integers(0, 10_000),
    turns=st.lists(st.sampled_from(sorted(TURNS)), min_size=1, max_size=3),
    size=st.floats(1e-3, 2.0),
)
def test_columns_are_the_literal_ones_and_bounds_hold(
    seed: int, turns: list[str], size: float
) -> None:
    cuts = [(random_moves(seed + k, 12), turn) for k, turn in enumerate(turns)]
    made = [SetupCut.of(turn, moves, MAPS[turn]) for moves, turn in cuts]
    before = StockBefore(
        tuple(each for each in made if each.name == "same"),
        tuple(each for each in made if each.name != "same"),
        THICK,
    )
    rng = np.random.default_rng(seed)
    squares = np.column_stack([rng.uniform(0.0, 10.0, (15, 2)), np.full(15, size)])
    low = before.least_floors(squares), before.least_tops(squares)
    high = before.greatest_floors(squares), before.greatest_tops(squares)
    for _ in range(4):
        points = squares[:, :2] + rng.uniform(-size, size, (15, 2))
        floor, top = literal_column(cuts, points)
        assert before.floors(points) == pytest.approx(floor, abs=2e-8)
        assert before.tops(points) == pytest.approx(top, abs=2e-8)
        for values, least, most in zip((floor, top), low, high, strict=True):
            assert (least <= values + 2e-8).all()
            assert (values <= most + 2e-8).all()


@examples(8)
@given(seed=st.integers(0, 10_000), turn=st.sampled_from(sorted(TURNS)))
def test_a_map_shows_what_is_left(seed: int, turn: str) -> None:
    """Cell by cell, of two programs from either face, against the literal columns."""
    first, own = random_moves(seed, 12), random_moves(seed + 1, 12)
    cut = SetupCut.of(turn, first, MAPS[turn])
    above, below = ((cut,), ()) if turn == "same" else ((), (cut,))
    drawn = height_map(own, (0.0, 0.0, 10.0, 11.0), 0.37)
    left = StockBefore(above, below, THICK).shown_in(drawn)
    points = np.stack(np.meshgrid(drawn.x, drawn.y), axis=-1).reshape(-1, 2)
    floor, top = literal_column([(first, turn)], points)
    z = np.minimum(np.minimum(slow.heights(own, points), 0.0), top)
    wanted = np.where(floor >= z, -THICK, z).reshape(left.heights.shape)
    # A cell at a wall may fall on its other side.
    assert (np.abs(left.heights - wanted) < 1e-4).mean() > 0.99


@examples(40)
@given(a=st.sampled_from(sorted(MAPS)), b=st.sampled_from(sorted(MAPS)), x=st.floats(-9.0, 9.0))
def test_turns_are_undone_and_follow_each_other(a: str, b: str, x: float) -> None:
    points = np.array([[x, 3.0], [1.0, x]])
    both = MAPS[a].then(MAPS[b])
    assert both.points(points) == pytest.approx(TURNS[b](TURNS[a](points)))
    assert both.back.points(both.points(points)) == pytest.approx(points)
    assert both.is_over == ((a != "same") != (b != "same"))
    left, low, right, high = both.box((0.0, 1.0, 2.0, 5.0))
    corners = both.points(np.array([[0.0, 1.0], [2.0, 1.0], [0.0, 5.0], [2.0, 5.0]]))
    assert [left, low] == pytest.approx(corners.min(axis=0).tolist())
    assert [right, high] == pytest.approx(corners.max(axis=0).tolist())


def slot(y: float, z: float, x: tuple[float, float] = (2.0, 8.0), radius: int = 0) -> StockMoves:
    """A level cut along X at a height, with a flat tool of 3 mm."""
    return moves_of(np.array([[x[0], y, z]]), np.array([[x[1], y, z]]), np.array([radius]))


def from_below(moves: StockMoves, turn: Turn = MAPS["x"]) -> StockBefore:
    return StockBefore((), (SetupCut.of("first", moves, turn),), THICK)


@pytest.mark.parametrize(("deep", "other"), [(1.5, 1.0), (2.5, 1.2), (2.5, 2.0)])
def test_the_least_thickness_is_what_both_leave(deep: float, other: float) -> None:
    """Crossed over y = 5.5 by hand: both slots lie there."""
    found = least_remaining(
        stock_tree(slot(5.5, -deep)), from_below(slot(5.5, -other)), (0.0, 0.0, 10.0, 11.0)
    )
    assert found.low == pytest.approx(deep + other - THICK, abs=1e-9)
    assert found.high == pytest.approx(deep + other - THICK, abs=2e-3)
    # What goes through by itself is meant.
    through = least_remaining(
        stock_tree(slot(5.5, -4.2)), from_below(slot(5.5, -other)), (0.0, 0.0, 10.0, 11.0)
    )
    assert through.low == -np.inf


def test_a_rapid_through_what_another_set_up_has_cleared_is_fine() -> None:
    """Lines of rapids at a height, in a slot of the same tool from the other face."""
    rapid = replace(slot(5.5, -2.0), rapid=np.array([True]))
    for before, count in (
        (None, 1),
        (from_below(slot(5.5, -4.1)), 0),  # gone
        (from_below(slot(5.5, -1.9)), 1),  # a floor of 0.1 mm above the tip, and more, is left
        (from_below(slot(5.5, -4.1, (2.0, 5.0))), 1),  # gone in the half of it
        (from_below(slot(3.5, -4.1)), 1),  # gone beside it
        (StockBefore((SetupCut.of("", slot(5.5, -2.0), Turn()),), (), THICK), 0),
        (StockBefore((SetupCut.of("", slot(5.5, -1.8), Turn()),), (), THICK), 1),
        (
            StockBefore(
                (SetupCut.of("", slot(5.5, -1.0), Turn()),),
                from_below(slot(5.5, -3.0)).below,
                THICK,
            ),
            0,
        ),
    ):
        found = rapids_through_stock(rapid, (0.0, 0.0, 10.0, 11.0), 0.01, before)
        assert len(found) == count


PLATE, WINDOW = box(0, 0, 60, 40), box(15, 10, 20, 16)
TOOL = Tool(3.0)
SHEET = Stock(THICK, (-5.0, -5.0), (70.0, 50.0))


def second(first: Operation, last: Operation, *, flip: str | None = "y") -> list[Finding]:
    """The findings of the second of two set-ups; WINDOW and PLATE are on layers IN and OUT."""
    job = Job(
        (replace(first, name="first"), replace(last, name="last")),
        stock=SHEET,
        setups=(JobSetup("one", ("first",)), JobSetup("two", ("last",), flip=flip)),
    )
    drawing, machine = drawing_of([PLATE, WINDOW], ["OUT", "IN"]), path_machine()
    one, two = (planned(drawing, job.setup(name), machine) for name in ("one", "two"))
    before = stock_before(two.job, [(one.job, one.toolpath)])
    tools = tools_of_rows(two.toolpath, two.job)
    moves = stock_moves_of_toolpath(two.toolpath, tools.index, tools.cutters)
    request = stock_request(two.steps, two.job, 0.01, before=before)
    return list(stock_findings(two.toolpath, moves, request, 0.01))


def codes(found: list[Finding], *names: str) -> list[str]:
    return [each.code.name for each in found if each.code.name in names]


@pytest.mark.parametrize("flip", ["x", "y", None])
@pytest.mark.parametrize(("deep", "is_loose"), [(1.9, False), (2.1, True)])
def test_a_window_that_both_faces_cut_half_comes_loose_in_the_second(
    flip: str | None, deep: float, is_loose: bool
) -> None:
    half = Operation(tool=TOOL, depth_mm=deep, side="inside", layers=("IN",))
    if flip is None:
        is_loose = False  # from the same face it only cuts again what is gone
    found = second(half, half, flip=flip)
    pieces = [each for each in found if each.code.name == "LOOSE_PIECE"]
    assert len(pieces) == is_loose
    path = shapely.box(15, 10, 35, 26).buffer(-1.5, join_style="mitre")
    piece = path.buffer(-1.5, join_style="mitre")
    for each in pieces:
        assert each.measured == pytest.approx(piece.area, rel=0.02)
        x, y = map(float, re.findall(r"X ([\d.]+) Y ([\d.]+)", str(each.where))[0])
        wanted = {"y": (60.0 - 25.0, 18.0), "x": (25.0, 40.0 - 18.0)}[str(flip)]
        assert [x, y] == pytest.approx(wanted, abs=0.1)


def test_from_the_same_face_a_second_set_up_goes_on_where_the_first_ended() -> None:
    """The lower half of the window, in passes that would be too deep in whole stock."""
    half = Operation("pocket", tool=TOOL, depth_mm=2.0, layers=("IN",))
    rest = replace(half, depth_mm=3.5, step_down_mm=1.75)
    assert codes(second(half, rest, flip=None), "MATERIAL_LEFT", "PASS_TOO_DEEP") == []
    # What the first cut deeper than the second may is no gouge of the second.
    shallow = replace(half, depth_mm=1.0)
    assert codes(second(rest, shallow, flip=None), "CUT_TOO_DEEP") == []


def test_a_tab_over_a_pocket_of_the_other_face_holds_nothing() -> None:
    around = Operation(tool=TOOL, depth_mm=4.2, side="outside", layers=("OUT",), tabs=Tabs(4))
    pocket = Operation("pocket", tool=TOOL, depth_mm=1.0, layers=("IN",))
    assert codes(second(pocket, around), "TAB_MISSING", "TAB_THIN", "LOOSE_PIECE") == []
    under = Operation(tool=Tool(6.0), depth_mm=0.8, side="outside", layers=("OUT",))
    found = second(under, around)
    tabs = [each for each in found if each.code.name == "TAB_MISSING"]
    assert len(tabs) == 4
    # 0.8 mm of stock, of which the tabs of 0.5 mm end 0.2 mm below: none is left.
    assert {round(each.measured or 0.0, 6) for each in tabs} == {0.0}


def test_a_part_that_is_loose_before_its_second_set_up_is_told() -> None:
    around = Operation(tool=TOOL, depth_mm=4.2, side="outside", layers=("OUT",))
    pocket = Operation("pocket", tool=TOOL, depth_mm=1.0, layers=("IN",))
    (finding,) = [e for e in second(around, pocket) if e.code.name == "LOOSE_PIECE"]
    assert "has come loose in a set-up before" in finding.message
    assert finding.measured == pytest.approx(60.0 * 40.0, rel=0.01)
    held = replace(around, tabs=Tabs(4))
    assert codes(second(held, pocket), "LOOSE_PIECE") == []
    assert codes(second(pocket, around), "LOOSE_PIECE") == []


def test_a_shank_has_room_where_the_other_face_is_cut_through() -> None:
    """A shank as wide as twice the tool, over a slot that a tool as wide as it has cut."""
    wide = Polyline(np.array([[10.0, 20.0, 0.0], [50.0, 20.0, 0.0]]), closed=False)
    tool = Tool(2.0, cutting_length_mm=1.0, shank_diameter_mm=4.0)
    job = Job(
        (
            Operation("engrave", "first", tool=Tool(5.0), depth_mm=4.2),
            Operation("engrave", "last", tool=tool, depth_mm=3.0),
        ),
        stock=SHEET,
        setups=(JobSetup("one", ("first",)), JobSetup("two", ("last",), flip="y")),
    )
    drawing, machine = drawing_of([wide], ["L"]), path_machine()
    one, two = (planned(drawing, job.setup(name), machine) for name in ("one", "two"))
    tools = tools_of_rows(two.toolpath, two.job)
    moves = stock_moves_of_toolpath(two.toolpath, tools.index, tools.cutters)
    for earlier, count in (([(one.job, one.toolpath)], 0), ([], 1)):
        before = stock_before(two.job, earlier)
        request = stock_request(two.steps, two.job, 0.01, before=before)
        found = list(stock_findings(two.toolpath, moves, request, 0.01))
        assert len(codes(found, "TOOL_IN_STOCK")) == count


@examples(10)
@given(seed=st.integers(0, 10_000))
def test_a_stock_turned_over_shows_the_columns_from_below(seed: int) -> None:
    cuts = [(random_moves(seed, 12), "same"), (random_moves(seed + 1, 12), "x")]
    above, below = (SetupCut.of(turn, moves, MAPS[turn]) for moves, turn in cuts)
    before = StockBefore((above,), (below,), THICK)
    whole = height_map(above.moves.select(slice(0)), (0.0, 0.0, 10.0, 10.0), 0.5)
    seen = before.turned_over(before.shown_in(whole))
    x, y = np.meshgrid(seen.x, seen.y)
    floor, top = literal_column(cuts, np.column_stack([x.ravel(), -y.ravel()]))
    depths = np.where(np.isfinite(floor), -THICK - floor, 0.0)
    wanted = np.where(np.maximum(floor, -THICK) >= top, -THICK, depths)
    off = np.abs(seen.heights.ravel() - wanted) > 1e-5
    assert off.mean() < 0.01  # cells on the rim of a tool
