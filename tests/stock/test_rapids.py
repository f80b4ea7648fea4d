"""Rapids below the stock top: against points, one by one, and by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.findings import Severity
from camtool.records import replace
from camtool.stock.cutters import CutterProfile
from camtool.stock.moves import StockMoves, stock_moves_of_toolpath
from camtool.stock.rapids import (
    RapidThroughStock,
    low_rapids,
    rapid_findings,
    rapids_through_stock,
)
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.cleared import most_uncut
from tests.oracles.deep_moves import Shop, everything
from tests.oracles.lowering import sweep_of
from tests.oracles.stock import Cutter
from tests.oracles.stock import Move as Needle
from tests.oracles.stock import Stock as Needles
from tests.waiting import no_chewing

RADIUS_MM = 0.5
NEAR_MM = 0.12
"""What the oracle's points may miss: their spacing, the tolerance, and pieces of slopes."""


def flat(*radii: float) -> tuple[CutterProfile, ...]:
    return tuple(CutterProfile(radius, radius) for radius in radii)


def moves_of(
    path: ToolpathBuilder | Toolpath, cutters: tuple[CutterProfile, ...], first: int | None = None
) -> StockMoves:
    """The moves of a path, of the first cutter; from a row on of the second."""
    made = path.finish() if isinstance(path, ToolpathBuilder) else path
    tool = (np.arange(len(made)) >= (len(made) if first is None else first)).astype(np.int64)
    return stock_moves_of_toolpath(made, tool, cutters)


def through(
    path: ToolpathBuilder | Toolpath,
    radius: float = RADIUS_MM,
    solid: tuple[float, float, float, float] | None = None,
) -> list[RapidThroughStock]:
    return rapids_through_stock(moves_of(path, flat(radius)), solid)


def rows(path: ToolpathBuilder, radius: float = RADIUS_MM) -> list[int]:
    return [found.row for found in through(path, radius)]


def down(x: float = 0.0, y: float = 0.0, z: float = -1.0) -> ToolpathBuilder:
    return ToolpathBuilder().rapid(z=5).rapid(x, y).line(z=z, feed=1)


def pocket() -> ToolpathBuilder:
    """Rows 0 to 4 of y, 0.4 apart, 5 long, 1 deep; the tool ends at (5, 1.6)."""
    path = down()
    for number in range(5):
        path.line(5.0 if number % 2 == 0 else 0.0, 0.4 * number, feed=1)
        if number < 4:
            path.line(None, 0.4 * (number + 1), feed=1)
    return path


NUMBER = st.integers(0, 8).map(lambda number: 0.5 * number)
HEIGHT = st.sampled_from([0.0, -0.5, -1.0])


@st.composite
def toolpaths(draw: st.DrawFn) -> Toolpath:
    """Cuts in a small place, one rapid last."""
    path = ToolpathBuilder().rapid(z=1).rapid(draw(NUMBER), draw(NUMBER))
    path.line(z=draw(HEIGHT), feed=1)
    for _ in range(draw(st.integers(1, 8))):
        x, y, z = draw(NUMBER), draw(NUMBER), draw(st.none() | HEIGHT)
        if draw(st.booleans()):
            path.line(x, y, z, feed=1)
        else:
            centre = (path.position[0] + 1.0, path.position[1])
            turn = draw(st.sampled_from([0.5, 1.0, 1.5, 2.0])) * math.pi
            end = (centre[0] - math.cos(turn), centre[1] - math.sin(turn))
            path.arc(*end, z, centre=centre, ccw=True, feed=1)
    return path.rapid(draw(NUMBER), draw(NUMBER), draw(st.none() | HEIGHT)).finish()


@given(toolpaths())
def test_what_is_found_is_what_points_say(path: Toolpath) -> None:
    last = len(path) - 1
    flat = (path.starts[last, :2] != path.end[last, :2]).any()
    if path.starts[last, 2] != path.end[last, 2] and not flat:
        return
    worst = most_uncut(path, last, RADIUS_MM) if flat else -math.inf
    found = [one.row for one in through(path)]
    if worst > NEAR_MM:
        assert found == [last]
    level = path.starts[last, 2] == path.end[last, 2]
    if worst < -NEAR_MM and level:
        assert found == []


def test_rapids_within_a_pocket_are_fine() -> None:
    assert rows(pocket().rapid(0.0, 0.0).rapid(5.0, 0.0).rapid(z=5.0)) == []
    assert rows(pocket().rapid(z=5).rapid(2.5, 0.8).rapid(z=-1.0).rapid(3.0)) == []


def test_rapids_out_of_a_pocket_are_found_where_they_leave_it() -> None:
    (found,) = through(pocket().rapid(6.0, 1.6))
    assert (found.row, found.z_mm) == (12, -1.0)
    assert 5.5 < found.at_mm[0] < 6.5
    assert rows(pocket().rapid(5.005, 1.6)) == []
    assert rows(pocket().rapid(5.02, 1.6)) == [12]


def test_rapids_deeper_than_the_pocket_are_found() -> None:
    assert rows(pocket().rapid(z=5).rapid(2.5, 0.8).rapid(z=-1.1)) == [14]
    assert rows(pocket().rapid(2.5, 0.8, -1.1)) == [12]
    assert rows(pocket().rapid(2.5, 0.8, -0.9)) == []


def test_the_tool_counts_not_its_middle() -> None:
    slot = down().line(5.0, 0.0, feed=1)
    assert rows(slot.rapid(0.0, 0.0)) == []
    assert rows(slot.rapid(0.0, 0.3)) == [5]


def test_a_wider_tool_does_not_fit_where_another_has_been() -> None:
    path = down().line(5.0, 0.0, feed=1).rapid(0.0, 0.0).finish()
    assert rapids_through_stock(moves_of(path, flat(0.5))) == []
    (found,) = rapids_through_stock(moves_of(path, flat(0.5, 1.0), 4))
    assert found.row == 4
    assert 0.5 < abs(found.at_mm[1]) < 1.0 or found.at_mm[0] < -0.5


def test_ramps_clear_where_they_are_deep_enough() -> None:
    ramp = down(z=0.0).line(10.0, 0.0, -2.0, feed=1)
    assert rows(ramp.rapid(z=-1.0).rapid(5.0)) == []
    assert rows(ramp.rapid(4.0)) == [6]


def test_a_rapid_that_rises_out_of_the_stock_counts_below_its_top_alone() -> None:
    slot = down().line(5.0, 0.0, feed=1)
    assert rows(slot.rapid(0.0, 0.0, 4.0)) == []
    assert rows(down().line(5.0, 0.0, feed=1).rapid(5.0, 2.0, 4.0)) == [4]
    assert rows(down().line(5.0, 0.0, feed=1).rapid(5.0, 0.1, 40.0)) == []


def test_retracts_and_pecks_are_fine_and_plunging_rapids_are_not() -> None:
    path = down().rapid(z=1).rapid(z=-0.9).line(z=-2, feed=1).rapid(z=-0.5).rapid(z=-1.9)
    assert rows(path.rapid(z=5)) == []
    assert rows(path.rapid(z=-2.1)) == [9]
    assert rows(ToolpathBuilder().rapid(z=5).rapid(z=-0.1)) == [1]
    assert rows(ToolpathBuilder().rapid(z=5).rapid(z=0.0).rapid(5.0)) == []


def test_a_peck_beside_its_hole_is_found() -> None:
    assert rows(down().rapid(z=5).rapid(0.3).rapid(z=-0.5)) == [5]


def test_a_tool_of_no_width_clears_its_line() -> None:
    slot = down().line(5.0, 0.0, feed=1)
    assert rows(slot.rapid(1.0), 0.0) == []
    assert rows(slot.rapid(1.0, 0.02), 0.0) == [5]


def test_beside_the_stock_is_air() -> None:
    path = ToolpathBuilder().rapid(z=-1.0).rapid(5.0, 0.0).finish()
    assert [one.row for one in through(path, solid=(0.0, 0.6, 9.0, 9.0))] == []
    assert [one.row for one in through(path, solid=(0.0, 0.4, 9.0, 9.0))] == [0, 1]


def test_rapids_below_the_stock_top_whatever_the_tool() -> None:
    """They go along, or straight down to where no feed has been; up they may go."""
    path = ToolpathBuilder().rapid(z=0.2).rapid(1, 1).line(z=-1, feed=1).rapid(2, 1)
    path.rapid(z=0.2).rapid(3, 1).rapid(z=-1.0).line(z=-2, feed=1).rapid(z=0.2).rapid(z=-1.9)
    assert [one.row for one in low_rapids(path.finish())] == [3, 6]


@pytest.mark.parametrize("size", [5.0, 20.0])
def test_no_rapid_of_a_whole_part_is_found_but_the_one_added(size: float) -> None:
    cutters = flat(0.15 * size)
    whole = everything(size, 1.0, 100.0)
    assert rapids_through_stock(moves_of(whole, cutters)) == []
    made = Shop(size, 1.0, 100.0)
    made.pocket(2.0 * size, 2.0 * size)
    middle = made.path.position[:2]
    made.path.rapid(2.0 * size, 2.0 * size)
    assert rapids_through_stock(moves_of(made.path, cutters)) == []
    assert [one.row for one in low_rapids(made.path.finish())] == [len(made.path.finish()) - 1]
    made.path.rapid(*middle).line(z=-3.0, feed=9).rapid(4.0 * size, 2.0 * size)
    (found,) = rapids_through_stock(moves_of(made.path, cutters))
    assert (found.row, found.z_mm) == (len(made.path.finish()) - 1, -3.0)


def test_nothing_is_nothing() -> None:
    assert through(ToolpathBuilder()) == []


def test_thousands_of_pecks_are_not_chewed() -> None:
    path = ToolpathBuilder().rapid(z=5)
    for hole in range(5000):
        path.rapid(float(hole), 0.0)
        for peck in range(1, 6):
            path.line(z=-float(peck), feed=1).rapid(z=1.0).rapid(z=0.1 - peck)
        path.rapid(z=1.0)
    with no_chewing():
        assert through(path) == []


def test_a_v_bit_runs_in_its_groove_and_no_cylinder_does() -> None:
    path = down().line(5.0, 0.0, feed=1).rapid(0.0, 0.0).finish()
    bit, mill = CutterProfile(1.5, 0.0, rise=1.0), CutterProfile(1.0, 1.0)
    assert rapids_through_stock(moves_of(path, (bit,))) == []
    (found,) = rapids_through_stock(moves_of(path, (bit, mill), 4))
    assert (found.row, found.z_mm) == (4, -1.0)
    assert rapids_through_stock(moves_of(path, (mill, bit), 4)) == []
    blunt = CutterProfile(1.5, 0.0, rise=0.9)
    (found,) = rapids_through_stock(moves_of(path, (mill, blunt), 4))
    assert -0.1 < found.z_mm < 0.0


def test_the_place_and_the_depth_are_those_of_the_deepest_contact() -> None:
    path = down().line(5.0, 0.0, feed=1).rapid(z=-0.5).rapid(5.0, 3.0, -0.8)
    (found,) = through(path)
    assert found.z_mm == pytest.approx(-0.8, abs=0.02)
    assert 2.4 < found.at_mm[1] < 3.5


def test_many_rapids_are_counted() -> None:
    path = down(1.0, 1.0).line(1.0, 50.0, feed=1)
    for y in range(25):
        path.rapid(30.0, 2.0 * y + 1.0).rapid(1.0, 2.0 * y + 1.0)
    made = path.finish()
    listed = list(rapid_findings(made, moves_of(made, flat(0.5)), None, 0.01))
    assert len(listed) == 10
    assert {(one.code, one.severity) for one in listed} == {
        (ProgramCode.RAPID_IN_STOCK, Severity.ERROR)
    }
    assert listed[0].where.startswith("move 4 at X ")
    assert listed[0].message == "a rapid runs through the stock, 1 mm below its top"
    assert listed[-1].message.endswith("; and 40 more rapids")


SHAPES = (
    (Cutter(0.5), CutterProfile(0.5, 0.5)),
    (Cutter(1.0), CutterProfile(1.0, 1.0)),
    (Cutter(0.8, 0.5, 0.1), CutterProfile(0.8, 0.1, rise=2.0)),
)
ROOM_MM, CELL_MM = 0.04, 0.04
"""Needles are this far apart, and miss as much: their spacing, and the tolerance."""


@given(toolpaths(), st.data())
def test_rapids_of_several_tools_are_found_as_needles_say(
    path: Toolpath, data: st.DataObject
) -> None:
    """Needles of the feeds alone; the rapid's own tool, slimmer by the room, must lower some of
    them, or wider by it none."""
    tool = data.draw(st.lists(st.integers(0, 2), min_size=len(path), max_size=len(path)))
    moves = stock_moves_of_toolpath(path, np.array(tool), tuple(one for _, one in SHAPES))
    last, starts = len(path) - 1, path.starts
    if (starts[last, :2] == path.end[last, :2]).all() and path.end[last, 2] >= starts[last, 2]:
        return
    deep = []
    for room in (ROOM_MM, -ROOM_MM):
        wood = Needles((-2.0, -2.0), (7.0, 6.0), CELL_MM)
        for row, move in enumerate(path):
            if move.kind is Kind.RAPID and row < last:
                continue
            cutter = SHAPES[tool[row]][0]
            wide = replace(cutter, radius=cutter.radius + (-room if row == last else room))
            if cutter.slope:  # the cone begins as much farther out
                wide = replace(wide, tip=wide.tip + (-room if row == last else room))
            sweep = 0.0 if move.centre is None else sweep_of(move)
            chip = wood.cut(
                Needle(False, move.start, move.end, row, move.centre, sweep), wide
            ).chip
        deep.append(chip)
    found = last in [one.row for one in rapids_through_stock(moves)]
    if deep[0] > 0.02:
        assert found
    if deep[1] <= 0.0:
        assert not found


@pytest.mark.parametrize("tolerance", [0.001, 0.05])
def test_the_tolerance_is_what_may_stick_out(tolerance: float) -> None:
    path = down().line(5.0, 0.0, feed=1).rapid(1.0).rapid(1.0, 0.02).finish()
    found = rapids_through_stock(moves_of(path, flat(0.5)), None, tolerance)
    assert [one.row for one in found] == ([5] if tolerance < 0.02 else [])
