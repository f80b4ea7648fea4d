"""The Toolpath record, its builder and its iterator; how far it reaches, against very many points
of its arcs; tools that are mounted before it begins."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.simulation.rows import with_event_positions
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import (
    ROWS_AT_ONCE,
    Kind,
    PolarArcs,
    Toolpath,
    mounted_before,
    toolpath_extents,
)


def test_left_out_coordinates_stay() -> None:
    path = ToolpathBuilder((1.0, 2.0, 3.0)).rapid(z=5).line(4, feed=10).finish()
    assert path.end.tolist() == [[1, 2, 5], [4, 2, 5]]
    assert path.starts.tolist() == [[1, 2, 3], [1, 2, 5]]


def test_iterator_gives_what_was_built() -> None:
    builder = ToolpathBuilder()
    builder.source = "CUT/CIRCLE 2F"
    builder.line(1, 0, feed=2.0).arc(1, 0, centre=(0, 0), ccw=True, feed=3.0)
    builder.source = ""
    moves = list(builder.event(Kind.DWELL, 1.5).event(Kind.END).finish())
    assert [move.kind for move in moves] == [Kind.LINE, Kind.ARC_CCW, Kind.DWELL, Kind.END]
    assert moves[0].feed == 2.0
    assert moves[0].centre is None
    assert moves[1].centre == (0.0, 0.0)
    assert moves[1].source == "CUT/CIRCLE 2F"
    assert moves[2].value == 1.5
    assert moves[2].source == ""
    assert moves[3].end == (1.0, 0.0, 0.0)


def test_a_part_begins_where_the_rows_before_it_end() -> None:
    path = ToolpathBuilder((1.0, 0.0, 0.0)).line(2.0, feed=1.0).rapid(y=3.0).event(Kind.END)
    whole = path.finish()
    for low in range(4):
        for high in range(low, 4):
            part = whole.part(low, high)
            assert part.starts.tolist() == whole.starts[low:high].tolist()
            assert part.kind.tolist() == whole.kind[low:high].tolist()
            assert part.end.base is whole.end.base or part.end.base is whole.end


@pytest.mark.parametrize("count", [0, 1, ROWS_AT_ONCE, 2 * ROWS_AT_ONCE + 3])
def test_a_column_by_parts_is_that_of_the_whole(count: int) -> None:
    ends = np.random.default_rng(1).normal(size=(count, 3))
    none = np.full((count, 2), np.nan)
    path = Toolpath(
        np.zeros(count), ends, none, none[:, 0], none[:, 0], np.zeros(count), np.arange(count),
        start=np.ones(3),
    )  # fmt: skip
    ways = path.by_parts(lambda part: part.end - part.starts)
    assert np.array_equal(ways, path.end - path.starts)


def test_an_arc_with_z_is_a_helix() -> None:
    path = ToolpathBuilder((1.0, 0.0, 0.0)).arc(0, 1, -2.0, centre=(0, 0), ccw=True, feed=1.0)
    path.arc(0, 1, -3.0, centre=(0, 0), ccw=False, feed=1.0)
    quarter, turn = path.finish()
    assert (quarter.start, quarter.end) == ((1.0, 0.0, 0.0), (0.0, 1.0, -2.0))
    assert turn.end == (0.0, 1.0, -3.0)
    assert path.finish().sweeps() == pytest.approx([math.pi / 2, -2 * math.pi])
    points = PolarArcs(path.finish(), path.finish().is_arc).points(
        np.array([0, 1]), np.full(2, 0.5)
    )
    assert points == pytest.approx(
        np.array([[math.sqrt(0.5), math.sqrt(0.5), -1.0], [0.0, -1.0, -2.5]])
    )


def test_messages_keep_their_text() -> None:
    path = ToolpathBuilder().message("turn the part").finish()
    assert path.texts[int(path.value[0])] == "turn the part"


@given(st.floats(-math.pi, math.pi), st.floats(1e-3, 2 * math.pi - 1e-3), st.booleans())
def test_sweeps(begin: float, turn: float, ccw: bool) -> None:
    finish = begin + (turn if ccw else -turn)
    path = (
        ToolpathBuilder((math.cos(begin), math.sin(begin), 0.0))
        .arc(math.cos(finish), math.sin(finish), centre=(0, 0), ccw=ccw, feed=1)
        .finish()
    )
    assert path.sweeps()[0] == pytest.approx(turn if ccw else -turn, abs=1e-9)


@pytest.mark.parametrize("ccw", [True, False])
def test_an_arc_that_ends_where_it_starts_is_a_full_circle(ccw: bool) -> None:
    path = ToolpathBuilder((2.0, 1.0, 0.0)).arc(2, 1, centre=(0, 0), ccw=ccw, feed=1).finish()
    assert path.sweeps()[0] == pytest.approx(2 * math.pi if ccw else -2 * math.pi)


def test_an_empty_toolpath() -> None:
    path = ToolpathBuilder().finish()
    assert len(path) == 0
    assert path.starts.shape == (0, 3)
    assert path.sweeps().shape == (0,)
    assert list(path) == []


def test_columns_that_disagree_are_refused() -> None:
    path = ToolpathBuilder().rapid(1, 1).finish()
    columns = {name: getattr(path, name) for name in Toolpath.__dataclass_fields__}
    with pytest.raises(ValueError, match="column feed"):
        Toolpath(**{**columns, "feed": np.zeros(2)})
    with pytest.raises(ValueError, match="not finite"):
        Toolpath(**{**columns, "end": np.full((1, 3), np.nan)})


def test_arrays_are_read_only() -> None:
    path = ToolpathBuilder().rapid(1, 1).finish()
    with pytest.raises(ValueError, match="read-only"):
        path.end[0, 0] = 5.0


def test_rows_behind_the_end_do_not_run() -> None:
    b = ToolpathBuilder().line(1.0, 0.0, feed=1.0).event(Kind.END).line(2.0, 0.0, feed=1.0)
    path = b.event(Kind.END).finish()
    assert path.executed_rows == 2
    assert [move.kind for move in path.first(path.executed_rows)] == [Kind.LINE, Kind.END]
    assert ToolpathBuilder().line(1.0, 0.0, feed=1.0).finish().executed_rows == 1
    assert ToolpathBuilder().finish().executed_rows == 0


def test_nothing_reaches_only_its_start() -> None:
    path = ToolpathBuilder(start=(1.0, 2.0, 3.0)).finish()
    assert toolpath_extents(path).tolist() == [[1, 1], [2, 2], [3, 3]]


def test_moves_and_start_are_included() -> None:
    path = ToolpathBuilder().rapid(z=2.0).rapid(5, -1).line(z=-0.5, feed=1).event(Kind.END)
    assert toolpath_extents(path.finish()).tolist() == [[0, 5], [-1, 0], [-0.5, 2]]


@pytest.mark.parametrize("ccw", [True, False])
def test_a_full_circle_reaches_all_round(ccw: bool) -> None:
    path = ToolpathBuilder().rapid(3, 0).arc(3, 0, centre=(5, 0), ccw=ccw, feed=1).finish()
    assert toolpath_extents(path)[:2].tolist() == [[0, 7], [-2, 2]]


@pytest.mark.parametrize(("ccw", "box"), [(True, [[0, 1], [0, 1]]), (False, [[-1, 1], [-1, 1]])])
def test_a_quarter_reaches_to_its_ends_and_the_rest_all_round(
    ccw: bool, box: list[list[float]]
) -> None:
    path = ToolpathBuilder(start=(1, 0, 0)).arc(0, 1, centre=(0, 0), ccw=ccw, feed=1).finish()
    assert toolpath_extents(path)[:2].tolist() == box


@given(
    st.floats(-math.pi, math.pi),
    st.floats(0.01, 2.0 * math.pi - 0.01),
    st.floats(0.1, 9.0),
    st.booleans(),
)
def test_arcs_reach_as_far_as_very_many_of_their_points(
    begin: float, sweep: float, radius: float, ccw: bool
) -> None:
    centre = np.array([3.0, -2.0])
    angles = begin + np.linspace(0.0, sweep if ccw else -sweep, 5001)
    points = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    (x0, y0), (x1, y1) = points[0].tolist(), points[-1].tolist()
    path = ToolpathBuilder(start=(x0, y0, 0.0))
    path.arc(x1, y1, centre=(3.0, -2.0), ccw=ccw, feed=1.0)
    box = toolpath_extents(path.finish())[:2]
    assert box[:, 0] == pytest.approx(points.min(axis=0), abs=1e-5)
    assert box[:, 1] == pytest.approx(points.max(axis=0), abs=1e-5)


def test_changes_before_the_first_feed_are_made_by_hand() -> None:
    path = ToolpathBuilder().rapid(z=1.0).event(Kind.TOOL_CHANGE, 1).event(Kind.SPINDLE_CW, 9)
    path.rapid(1.0).line(z=-1.0, feed=9.0).event(Kind.TOOL_CHANGE, 2)
    assert mounted_before(path.finish()).tolist() == [False, True, False, False, False, False]
    assert mounted_before(ToolpathBuilder().finish()).tolist() == []


def test_each_row_begins_where_the_one_before_ended() -> None:
    path = ToolpathBuilder((1.0, 2.0, 3.0)).rapid(z=5).line(4, feed=10).line(y=7, feed=10).finish()
    rows = np.array([2, 0, 0, 1])
    assert path.starts_of(rows).tolist() == path.starts[rows].tolist()


def test_nothing_is_copied_where_nothing_changes() -> None:
    path = ToolpathBuilder().rapid(z=5).event(Kind.DWELL, 1.0).line(4, feed=10).finish()
    assert path.first(3) is path
    assert len(path.first(2)) == 2
    assert with_event_positions(path, np.zeros(3)) is path
    home = ToolpathBuilder().rapid(1, 1).event(Kind.HOME_XY).event(Kind.END).finish()
    assert with_event_positions(home, np.array([7.0, 8.0, 9.0])).end[:, :2].tolist() == [
        [1, 1],
        [7, 8],
        [7, 8],
    ]
