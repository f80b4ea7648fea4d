"""Rapids below the stock top: against points, one by one, and by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.rapids import RapidThroughStock, Reach, low_rapids, rapids_through_stock
from tests.oracles.cleared import most_uncut
from tests.waiting import no_chewing

RADIUS_MM = 0.5
NEAR_MM = 0.12
"""What the oracle's points may miss: their spacing, the tolerance, and pieces of slopes."""


def through(
    path: ToolpathBuilder | Toolpath,
    radius: float = RADIUS_MM,
    solid: tuple[float, float, float, float] | None = None,
) -> list[RapidThroughStock]:
    made = path.finish() if isinstance(path, ToolpathBuilder) else path
    radii = np.full(len(made), radius)
    return rapids_through_stock(made, Reach(radii, radii, solid))


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
    cuts, sweeps = np.full(5, 0.5), np.full(5, 0.5)
    assert rapids_through_stock(path, Reach(cuts, sweeps)) == []
    assert [one.row for one in rapids_through_stock(path, Reach(cuts, 2 * sweeps))] == [4]


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
    assert low_rapids(path.finish()) == [3, 6]


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


@pytest.mark.parametrize("tolerance", [0.001, 0.05])
def test_the_tolerance_is_what_may_stick_out(tolerance: float) -> None:
    path = down().line(5.0, 0.0, feed=1).rapid(1.0).rapid(1.0, 0.02).finish()
    radii = np.full(len(path), 0.5)
    found = rapids_through_stock(path, Reach(radii, radii), tolerance)
    assert [one.row for one in found] == ([5] if tolerance < 0.02 else [])
