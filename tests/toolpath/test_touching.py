"""Places to touch off: the top of the stock is whole there, as shapely sees the cuts before."""

from __future__ import annotations

import math

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.touching import CLEARANCE_MM, untouched_place
from camtool.toolpath.wanted import OperationNote, ToolNote
from tests.strategies import examples

PLACES = st.tuples(st.floats(-5.0, 30.0), st.floats(-5.0, 20.0))


def note(diameter_mm: float) -> OperationNote:
    tool = ToolNote(1, "mill", diameter_mm=diameter_mm)
    return OperationNote("profile", "", tool, 100.0, 50.0, 1.0)


Line = tuple[tuple[float, float], tuple[float, float]]


def cut_lines(lines: list[Line], diameter: float) -> Toolpath:
    """Lines that are cut 1 mm deep, a change of tools, and one more cut."""
    path = ToolpathBuilder().rapid(z=5)
    path.operation(note(diameter))
    for (x, y), (u, v) in lines:
        path.rapid(x, y).line(z=-1, feed=50).line(u, v, feed=100).rapid(z=5)
    path.operation(note(3.0))
    path.event(Kind.TOOL_CHANGE, 2)
    path.rapid(10, 10).line(z=-1, feed=50).line(25, 12, feed=100).rapid(z=5)
    return path.finish()


@examples(60)
@given(st.lists(st.tuples(PLACES, PLACES), max_size=6), st.floats(0.5, 10.0))
def test_nothing_was_cut_at_the_place_before(lines: list[Line], diameter: float) -> None:
    path = cut_lines(lines, diameter)
    row = int(np.flatnonzero(path.kind == Kind.TOOL_CHANGE)[0])
    place = untouched_place(path, row)
    reach = 0.5 * diameter + CLEARANCE_MM
    cut = shapely.union_all(
        [shapely.buffer(shapely.linestrings(line), reach, quad_segs=64) for line in lines]
    )
    zero = shapely.points(0.0, 0.0)
    if place is None:
        assert cut.intersects(zero)
        return
    assert not shapely.buffer(cut, -1e-2).contains(shapely.points(*place))
    if cut.distance(zero) > 1e-6:
        assert place == (0.0, 0.0)


def test_after_a_circle_about_zero_another_place_is_found() -> None:
    """Of a circle the whole circumference counts; after the last cut nothing is touched."""
    path = ToolpathBuilder().rapid(z=5)
    path.operation(note(6.0))
    path.rapid(2, 0).line(z=-1, feed=50)
    path.arc(2, 0, centre=(0, 0), ccw=True, feed=100).rapid(z=5)
    path.operation(note(3.0))
    path.event(Kind.TOOL_CHANGE, 2)
    path.rapid(40, 0).line(z=-1, feed=50).rapid(z=5).event(Kind.TOOL_CHANGE, 3)
    made = path.finish()
    first, last = np.flatnonzero(made.kind == Kind.TOOL_CHANGE).tolist()
    place = untouched_place(made, first)
    assert place is not None
    assert 2.0 + 3.0 + CLEARANCE_MM <= math.hypot(*place) <= 40.0
    assert untouched_place(made, last) is None
