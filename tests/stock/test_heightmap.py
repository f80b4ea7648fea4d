"""Height maps of the stock, against the slow twin, the tree of moves, and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.planning.job import Job, Operation, Tool
from camtool.planning.link import tool_note
from camtool.records import replace
from camtool.stock.cut import cut_box
from camtool.stock.cutters import CutterProfile, cutter_profile
from camtool.stock.heightmap import MAX_CELLS, NO_MOVE, HeightMap, add_moves, cell_for, height_map
from camtool.stock.heights import stock_tree
from camtool.stock.moves import SAGITTA_MM, StockMoves, stock_moves_of_toolpath
from camtool.stock.slides import tools_of_rows
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.wanted import OperationNote, Operations
from tests.oracles import stock_heights as slow
from tests.stock.cuts import CUTTERS, moves_of
from tests.strategies import examples

pytestmark = pytest.mark.checked

BOX = (0.0, 0.0, 10.0, 10.0)
EDGE_MM = 1e-9
"""Cells nearer than this to the rim of a tool may fall on either side of it."""


def chains(seed: int, count: int) -> StockMoves:
    """Moves that begin where the one before ended, several of one tool in a row: level, up, down,
    straight down, of no length, along the rows and along the columns; now and then a jump."""
    rng = np.random.default_rng(seed)
    step = rng.normal(0.0, 1.5, (count, 3)) * [1.0, 1.0, 0.3]
    step[rng.random(count) < 0.4, 2] = 0.0
    step[rng.random(count) < 0.15, 0] = 0.0
    step[rng.random(count) < 0.15, 1] = 0.0
    ends = np.cumsum(step, axis=0) % [10.0, 10.0, 1e9] * [1.0, 1.0, 0.0]
    ends[:, 2] = -1.0 + 0.5 * np.cumsum(step[:, 2]).clip(-2.0, 3.0)
    starts = np.concatenate([[[5.0, 5.0, -0.5]], ends[:-1]])
    jump = rng.random(count) < 0.1
    starts[jump, :2] = rng.uniform(0.0, 10.0, (int(jump.sum()), 2))
    tool = np.repeat(rng.integers(0, len(CUTTERS), count), 6)[:count]
    return moves_of(starts, ends, tool)


def centres(found: HeightMap) -> Floats:
    x, y = np.meshgrid(found.x, found.y)
    return np.column_stack([x.ravel(), y.ravel()])


def on_rim(moves: StockMoves, points: Floats) -> np.ndarray:
    """Mask of the points that lie on the rim of a tool at an end, or beside a move."""
    near = np.zeros(len(points), dtype=bool)
    for a, b, tool in zip(moves.start, moves.end, moves.tool.tolist(), strict=True):
        along = b[:2] - a[:2]
        square = float(along @ along)
        t = 0.0 if square == 0.0 else ((points - a[:2]) @ along / square).clip(0.0, 1.0)
        foot = a[:2] + np.multiply.outer(t, along) if square else a[:2]
        apart = np.hypot(*(points - foot).T)
        near |= np.abs(apart - moves.cutters[tool].radius_mm) < EDGE_MM
    return near


@examples(15)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 12))
def test_cells_are_as_high_as_the_slow_twin_says(seed: int, count: int) -> None:
    moves = chains(seed, count)
    found = height_map(moves, BOX, 0.9, owners=True)
    points = centres(found)
    wanted = slow.heights(moves, points)
    clear = ~on_rim(moves, points)
    assert clear.mean() > 0.9
    assert found.heights.ravel()[clear] == pytest.approx(wanted[clear], abs=1e-6)
    assert found.owner is not None
    for place, row, z in zip(
        points[clear].tolist(),
        found.owner.ravel()[clear].tolist(),
        wanted[clear].tolist(),
        strict=True,
    ):
        assert z == 0.0 if row == NO_MOVE else abs(slow.height(moves, row, *place) - z) < 1e-6


@examples(25)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 400))
def test_cells_are_as_high_as_the_tree_says(seed: int, count: int) -> None:
    moves = chains(seed, count)
    found = height_map(moves, BOX, 0.13)
    exact, _ = stock_tree(moves).heights(centres(found))
    off = np.abs(found.heights.ravel() - exact) > 1e-6
    assert off.sum() <= on_rim(moves, centres(found)[off]).sum()


@pytest.mark.parametrize("slope", [1e-4, -1e-3, 0.01, -0.05, 0.3, -1.0, 4.0])
@pytest.mark.parametrize("flat", [0.2, 1.2, 1.95])
def test_a_bull_nose_may_slope_as_it_likes(slope: float, flat: float) -> None:
    start = np.array([[3.0, 4.0, -2.5 + max(-slope, 0.0)]])
    end = start + np.array([[2.4, 0.7, 2.5 * slope]])
    moves = moves_of(start, end, 0, CutterProfile(2.0, flat, corner_mm=2.0 - flat))
    found = height_map(moves, BOX, 0.083)
    exact, _ = stock_tree(moves).heights(centres(found))
    off = found.heights.ravel() - exact
    assert off.min() > -1e-6
    assert off.max() < 1e-6


@examples(10)
@given(seed=st.integers(0, 10_000), count=st.integers(2, 60), part=st.integers(1, 59))
def test_maps_add_up(seed: int, count: int, part: int) -> None:
    moves = chains(seed, count)
    whole = height_map(moves, BOX, 0.1, owners=True)
    begun = height_map(moves.select(slice(0, part)), BOX, 0.1, owners=True)
    add_moves(begun, moves.select(slice(part, None)), first=part)
    assert np.abs(begun.heights - whole.heights).max() < 1e-6
    assert whole.owner is not None
    assert begun.owner is not None
    # Moves that leave the same height may be told apart by the last bit of it.
    assert (begun.owner == whole.owner).mean() > 0.9
    again = height_map(moves, BOX, 0.1, owners=True)
    assert again.heights.tobytes() == whole.heights.tobytes()
    bare = height_map(moves, BOX, 0.1)
    assert bare.owner is None
    assert bare.heights.tobytes() == whole.heights.tobytes()


def test_a_pocket_has_its_depth_and_its_walls() -> None:
    # A 3 mm flat tool round a square: 8 × 8 mm to the walls, 2 mm deep.
    corners = [(2.5, 2.5, -2.0), (7.5, 2.5, -2.0), (7.5, 7.5, -2.0), (2.5, 7.5, -2.0)]
    moves = moves_of(corners, [*corners[1:], corners[0]], 0, CutterProfile(1.5, 1.5))
    found = height_map(moves, BOX, 0.1)
    points = np.array(
        [[5.0, 1.05], [5.0, 0.95], [1.05, 5.0], [0.95, 5.0], [5.0, 5.0], [11.0, 5.0]]
    )
    assert found.at(points) == pytest.approx([-2.0, 0.0, -2.0, 0.0, 0.0, math.nan], nan_ok=True)
    # Round corners, and an island of 2 × 2 mm that no pass reaches.
    square = 8.0**2 - (4.0 - math.pi) * 1.5**2 - 2.0**2
    assert (found.heights < 0.0).sum() * 0.01 == pytest.approx(square, rel=2e-3)
    assert {*np.unique(found.heights).tolist()} == {-2.0, 0.0}


def test_scallops_between_two_passes_of_a_ball() -> None:
    ball = CutterProfile(1.5, 0.0, corner_mm=1.5)
    starts, ends = [(0.0, 4.0, -1.0), (0.0, 5.0, -1.0)], [(10.0, 4.0, -1.0), (10.0, 5.0, -1.0)]
    found = height_map(moves_of(starts, ends, 0, ball), (0.0, 0.05, 10.0, 10.05), 0.1)
    ridge = 1.5 - math.sqrt(1.5**2 - 0.25)
    assert found.at(np.array([[5.0, 4.5], [5.0, 4.0]])) == pytest.approx(
        [-1.0 + ridge, -1.0], abs=1e-6
    )


def test_moves_above_the_stock_and_points_cut_nothing() -> None:
    moves = moves_of([(1.0, 1.0, 0.5)], [(9.0, 9.0, 0.0)], 0, CutterProfile(1.5, 1.5))
    assert not height_map(moves, BOX, 0.5).heights.any()
    point = moves_of([(1.0, 1.0, -1.0)], [(9.0, 9.0, -1.0)], 0, CutterProfile(0.0, 0.0))
    assert not height_map(point, BOX, 0.5).heights.any()


def test_a_map_has_a_bound() -> None:
    moves = moves_of([(1.0, 1.0, -1.0)], [(9.0, 9.0, -1.0)], 0)
    with pytest.raises(ValueError, match="16000000"):
        height_map(moves, BOX, 1e-3)
    assert cell_for(BOX, 10_000) == pytest.approx(0.1)
    assert (10.0 / cell_for(BOX, MAX_CELLS)) ** 2 == pytest.approx(MAX_CELLS)


# Moves of a toolpath.


def test_arcs_become_chords_within_their_sagitta() -> None:
    path = (
        ToolpathBuilder()
        .rapid(10.0, 0.0, 1.0)
        .line(10.0, 0.0, -1.0, feed=100.0)
        .arc(-10.0, 0.0, centre=(0.0, 0.0), feed=100.0, ccw=True)
        .arc(-10.0, 0.0, -3.0, centre=(-9.0, 0.0), feed=100.0, ccw=False)
        .event(Kind.END)
        .line(50.0, 50.0, -1.0, feed=100.0)
        .finish()
    )
    moves = stock_moves_of_toolpath(path, np.zeros(len(path), dtype=np.int64), CUTTERS)
    assert moves.beside_mm == SAGITTA_MM
    assert (moves.start[1:] == moves.end[:-1]).all()
    assert (np.diff(moves.row) >= 0).all()
    assert moves.rapid.tolist() == (moves.row == 0).tolist()
    assert moves.row.max() == 3  # what stands behind the end of the program never runs
    big = moves.row == 2
    middle = 0.5 * (moves.start + moves.end)[big]
    off = 10.0 - np.hypot(middle[:, 0], middle[:, 1])
    assert off.max() <= SAGITTA_MM < 4.0 * off.max()
    assert (middle[:, 1] > 0.0).all()
    helix = moves.end[moves.row == 3]
    assert np.hypot(helix[:, 0] + 9.0, helix[:, 1]) == pytest.approx(1.0)
    assert np.diff(helix[:, 2]) == pytest.approx(np.full(len(helix) - 1, -2.0 / len(helix)))
    assert helix[-1].tolist() == [-10.0, 0.0, -3.0]


MILL = Tool(3.0, number=1)
BIT = Tool(6.0, kind="v", tip_angle_rad=1.0, number=2, tip_diameter_mm=0.2)
BOTH = Job((Operation(tool=MILL), Operation(tool=BIT)))


def two_tools(*, plan: bool, changes: bool) -> Toolpath:
    builder = ToolpathBuilder().rapid(z=5.0)
    for tool in (MILL, BIT):
        if plan:
            builder.operation(
                OperationNote("profile", "", tool_note(Operation(tool=tool)), 1.0, 1.0, 1.0)
            )
        if changes and tool is BIT:
            builder.event(Kind.TOOL_CHANGE, float(tool.number or 0))
        builder.line(1.0, 1.0, -1.0, feed=100.0).line(2.0, 2.0, 1.0, feed=100.0)
    return builder.finish()


def test_the_first_tool_needs_no_change() -> None:
    planned = tools_of_rows(two_tools(plan=True, changes=False), None)
    assert planned.cutters == (cutter_profile(MILL), cutter_profile(BIT))
    assert planned.index.tolist() == [0, 0, 0, 1, 1]
    changed = tools_of_rows(two_tools(plan=False, changes=True), BOTH)
    assert changed.cutters == planned.cutters
    assert changed.index.tolist() == [0, 0, 0, 1, 1, 1]


def test_a_program_for_one_of_the_tools_of_a_job() -> None:
    bare = two_tools(plan=False, changes=False)
    with pytest.raises(OptionError, match="--tool-diameter"):
        tools_of_rows(bare, BOTH)
    of_bit = Operations(
        (OperationNote("profile", "", tool_note(Operation(tool=BIT)), 1.0, 1.0, 1.0),),
        np.zeros(1, dtype=np.int64),
    )
    assert tools_of_rows(bare, BOTH, of_bit).cutters == (cutter_profile(BIT),)


def test_the_box_of_cuts_holds_a_cone_as_wide_as_its_depth() -> None:
    bit = cutter_profile(replace(BIT, diameter_mm=0.0))  # only its cone is known
    moves = moves_of([(1.0, 2.0, -1.0)], [(9.0, 2.0, -2.0)], 0, bit)
    wide = 0.1 + 2.0 * math.tan(0.5)
    assert cut_box(moves) == pytest.approx((1.0 - wide, 2.0 - wide, 9.0 + wide, 2.0 + wide))
    box = (-3.0, -3.0, 13.0, 7.0)
    found = height_map(moves, box, 0.05)
    rows, columns = np.nonzero(found.heights < 0.0)
    assert cut_box(moves)[2] == pytest.approx(found.x[columns.max()], abs=0.06)
    assert cut_box(moves)[0] <= found.x[columns.min()]
    assert cut_box(moves)[1] <= found.y[rows.min()]
    above = moves_of([(1.0, 2.0, 1.0)], [(9.0, 2.0, 2.0)], 0, CutterProfile(1.5, 1.5))
    assert cut_box(above) == (-0.5, 0.5, 10.5, 3.5)
