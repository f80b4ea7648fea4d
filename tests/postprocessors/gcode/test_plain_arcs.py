"""Arcs as flashcut and valcnc round them: kept, given another centre, or written as lines."""

import numpy as np
import pytest
from camtool_postprocessors.gcode.plain import ArcRules, PlainRows, WantedArcs, plain_rows

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

RULES = ArcRules(decimals=3, full_circles="whole", most_mm=9999.999)


def arc(end: tuple[float, float], centre: tuple[float, float], *, ccw: bool = True) -> Toolpath:
    return ToolpathBuilder().arc(*end, centre=centre, ccw=ccw, feed=1.0).finish()


def rows(path: Toolpath) -> PlainRows:
    return plain_rows(path, RULES)


def test_an_arc_on_whole_units_is_kept() -> None:
    found = rows(arc((2.0, 0.0), (1.0, 0.0)))
    assert found.end.tolist() == [[2000, 0, 0]]
    assert found.offset.tolist() == [[1000, 0]]
    assert (found.recentred, found.lines, found.flat, found.first) == (0, 0, 0, -1)


def test_another_centre_when_the_rounded_one_is_not_equally_far() -> None:
    """The rounded centre 1000 is 1000 and 1002 units from the ends 0 and 2002."""
    path = ToolpathBuilder().rapid(0.0004, 0.0)
    path.arc(2.0016, 0.0, centre=(1.0004, 0.0), ccw=True, feed=1.0)
    found = rows(path.finish())
    assert found.end.tolist() == [[0, 0, 0], [2002, 0, 0]]
    assert found.offset.tolist() == [[0, 0], [1001, 0]]
    assert (found.recentred, found.lines, found.first) == (1, 0, 1)


def test_radii_that_differ_by_a_unit_are_left_alone() -> None:
    found = rows(arc((2.001, 0.0), (1.0, 0.0)))
    assert found.offset.tolist() == [[1000, 0]]
    assert found.recentred == 0


def test_a_centre_on_the_other_side_of_the_chord_is_refused() -> None:
    """It is equally far from both ends, but the arc about it turns by 300° in place of 60°."""
    path = arc((1.0, 0.0), (0.5, 0.866))
    begin, stop = np.array([[0, 0]]), np.array([[1000, 0]])
    wanted = WantedArcs(path, np.array([0]), begin, stop, RULES)
    which = np.array([0])
    assert wanted.fits(which, np.array([[500.0, 866.0]])).tolist() == [True]
    assert wanted.fits(which, np.array([[500.0, -866.0]])).tolist() == [False]


def test_arcs_too_small_become_lines_and_flat_ones_a_line() -> None:
    small = rows(arc((0.006, 0.0), (0.003, 0.0)))
    assert set(small.kind.tolist()) == {int(Kind.LINE)}
    assert (small.lines, small.flat) == (1, 0)
    assert small.end[-1].tolist() == [6, 0, 0]
    assert not small.offset.any()
    flat = rows(arc((0.2, 0.0), (0.1, 20.0)))
    assert flat.kind.tolist() == [Kind.LINE]
    assert (flat.lines, flat.flat) == (0, 1)


@pytest.mark.parametrize("ccw", [True, False])
def test_a_centre_too_far_to_say_makes_lines(ccw: bool) -> None:
    y = 12_000.0 if ccw else -12_000.0
    found = rows(arc((20.0, 0.0), (10.0, y), ccw=ccw))
    assert set(found.kind.tolist()) == {int(Kind.LINE)}
    assert found.lines == 1
    assert len(found.kind) > 1


def test_a_nearly_full_circle_becomes_full() -> None:
    near = arc((0.0, 0.0003), (1.0, 0.0))
    assert 6.28 < near.sweeps()[0] < 2.0 * np.pi
    found = rows(near)
    assert found.end.tolist() == [[0, 0, 0]]
    assert found.offset.tolist() == [[1000, 0]]
    assert found.moves.tolist() == [True]


def test_or_two_halves() -> None:
    for end_y in (0.0, 0.0003):
        path = ToolpathBuilder().line(3.0, 0.0, feed=1.0)
        path.arc(3.0, end_y, centre=(2.0, 0.0), ccw=False, feed=1.0).line(4.0, 0.0, feed=1.0)
        found = plain_rows(path.finish(), ArcRules(3, "halves", 9999.999))
        assert found.row.tolist() == [0, 1, 1, 2]
        assert found.kind.tolist() == [Kind.LINE, Kind.ARC_CW, Kind.ARC_CW, Kind.LINE]
        assert found.end[1:3, :2].tolist() == [[1000, 0], [3000, 0]]
        assert found.offset.tolist() == [[0, 0], [-1000, 0], [1000, 0], [0, 0]]


def test_a_speck_of_an_arc_moves_nothing() -> None:
    found = rows(arc((0.0, -0.0003), (1.0, 0.0)))
    assert found.moves.tolist() == [False]


def test_no_arcs_at_all() -> None:
    found = rows(ToolpathBuilder().rapid(1.0, 2.0).event(Kind.END).finish())
    assert found.moves.tolist() == [True, False]
    assert len(rows(ToolpathBuilder().finish()).kind) == 0
