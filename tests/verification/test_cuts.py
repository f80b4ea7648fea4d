"""Which rows cut, what contours they form, and the lines and arcs they become."""

import math

import numpy as np
import pytest

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind
from camtool.verification.cuts import MAX_SAMPLES, cut_moves, cutting_rows, is_flat, sample_cuts
from tests.oracles.dense_moves import circle, cut, dense_distance, points_of, square


def rows(builder: ToolpathBuilder, *, flat_cuts: bool = False) -> list[int]:
    return np.flatnonzero(cutting_rows(builder.finish(), flat_cuts=flat_cuts)).tolist()


def test_feed_moves_below_the_stock_top_cut_and_nothing_else_does() -> None:
    b = ToolpathBuilder()
    b.rapid(z=0.2)  # 0 air
    b.line(1, 0, feed=1)  # 1 at feed, but in the air
    b.line(z=-0.1, feed=1)  # 2 plunge
    b.line(2, 0, feed=1)  # 3 cuts
    b.arc(3, 0, centre=(2.5, 0), ccw=True, feed=1)  # 4 cuts
    b.line(3, 0, feed=1)  # 5 stands still
    b.event(Kind.DWELL, 1.0)  # 6
    b.line(4, 0, 0.2, feed=1)  # 7 a ramp out of the stock cuts
    b.line(5, 0, 0.0, feed=1)  # 8 ends on the stock top
    b.line(6, 0, -0.1, feed=1)  # 9 a ramp into the stock cuts
    b.rapid(z=0.2)  # 10
    assert rows(b) == [3, 4, 7, 9]


def test_without_any_z_feed_moves_cut_only_when_that_is_asked_for() -> None:
    b = ToolpathBuilder().rapid(1, 1).line(2, 1, feed=1).line(2, 1, feed=1)
    assert is_flat(b.finish())
    assert rows(b) == []
    assert rows(b, flat_cuts=True) == [1]
    assert not is_flat(b.rapid(z=0.1).finish())
    assert rows(b, flat_cuts=True) == []


def test_nothing_behind_the_end_of_the_program_cuts() -> None:
    b = cut(ToolpathBuilder(), 1, 1).line(2, 1, feed=1)
    b.event(Kind.END).line(3, 1, feed=1)
    assert rows(b) == [3]


def test_contours_end_at_air_moves_and_homing_but_not_at_plunges_and_events() -> None:
    b = cut(ToolpathBuilder(), 0, 0).line(1, 0, feed=1)
    b.event(Kind.DWELL, 1.0).line(1, 0, feed=1).line(1, 1, feed=1)  # one contour
    b.line(z=-0.04, feed=1).line(0, 0, feed=1)  # plunge: another pass
    b.event(Kind.HOME_Z).line(0, 1, feed=1)  # homing: a second one
    b.rapid(z=0.2).rapid(0, 0).line(z=-0.1, feed=1).line(0, 1, feed=1)  # a third one
    cuts = cut_moves(b.finish(), flat_cuts=False)
    assert cuts.contour[cuts.rows].tolist() == [0, 0, 0, 1, 2]
    assert cuts.contour_count == 3
    begin, finish = cuts.contour_ends()
    assert begin.tolist() == [3, 10, 14]
    assert finish.tolist() == [8, 10, 14]


def test_closed_contours() -> None:
    b = square(ToolpathBuilder(), 0, 0, 1)
    cut(b, 5, 5).line(6, 5, feed=1).line(5, 5.004, feed=1)
    cuts = cut_moves(b.finish(), flat_cuts=False)
    assert cuts.is_closed(1e-6).tolist() == [True, False]
    assert cuts.is_closed(0.005).tolist() == [True, True]


@pytest.mark.parametrize("ccw", [True, False])
@pytest.mark.parametrize("sweep", [0.01, 1.0, math.pi, 3.2, 5.0, 6.2, 2.0 * math.pi])
def test_arcs_become_segments_on_the_true_circle(sweep: float, ccw: bool) -> None:
    turn = sweep if ccw else -sweep
    b = cut(ToolpathBuilder(), 3.0, 1.0)
    end = (1.0 + 2.0 * math.cos(turn), 1.0 + 2.0 * math.sin(turn))
    b.arc(*(end if sweep < 6.28 else (3.0, 1.0)), centre=(1.0, 1.0), ccw=ccw, feed=1)
    toolpath = b.finish()
    cuts = cut_moves(toolpath, flat_cuts=False)
    assert len(cuts.segments) == (2 if sweep > math.pi else 1)
    assert np.abs(cuts.segments.bulge).max() <= 1.0
    assert np.allclose(cuts.segments.radius, 2.0, rtol=0, atol=1e-9)
    assert cuts.segments.sweep.sum() == pytest.approx(turn)
    cloud = np.array(points_of(list(toolpath)[-1], 4000))
    samples = sample_cuts(cuts, 0.05)
    worst = max(dense_distance(point, cloud) for point in samples.points)
    assert worst < 2.0 * sweep / 4000


def test_an_arc_that_misses_its_end_keeps_the_radius_of_its_start() -> None:
    b = cut(ToolpathBuilder(), 2.0, 0.0).arc(0.0, 1.5, centre=(0.0, 0.0), ccw=True, feed=1)
    segments = cut_moves(b.finish(), flat_cuts=False).segments
    assert segments.radius.tolist() == pytest.approx([2.0])
    assert segments.end[0].tolist() == pytest.approx([0.0, 2.0])


def test_rows_own_their_segments() -> None:
    b = circle(square(ToolpathBuilder(), 0, 0, 1), 5, 5, 1)
    cuts = cut_moves(b.finish(), flat_cuts=False)
    assert cuts.row.tolist() == [3, 4, 5, 6, 11, 11]
    for row in cuts.rows:
        owned = cuts.row[cuts.first[row] : cuts.first[row + 1]]
        assert set(owned.tolist()) == {row}
    assert cuts.z.min() == -0.02
    assert cuts.z.max() == -0.02


def test_samples_include_both_ends_and_stay_bounded() -> None:
    b = cut(ToolpathBuilder(), 0, 0).line(10_000, 0, feed=1).line(10_000, 0.001, feed=1)
    cuts = cut_moves(b.finish(), flat_cuts=False)
    samples = sample_cuts(cuts, 0.001)
    assert MAX_SAMPLES <= len(samples.points) <= MAX_SAMPLES + 10
    for segment in (0, 1):
        own = samples.points[samples.segment == segment]
        assert own[0].tolist() == pytest.approx(cuts.segments.start[segment].tolist())
        assert own[-1].tolist() == pytest.approx(cuts.segments.end[segment].tolist())
        assert len(own) >= 5


def test_lines_that_follow_one_another_are_the_toolpath_s_own_points() -> None:
    lines = cut(ToolpathBuilder(), 0, 0).line(1, 2, feed=1).line(3, 4, feed=1)
    path = lines.finish()
    cuts = cut_moves(path, flat_cuts=False)
    assert cuts.segments.end.tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert np.shares_memory(cuts.segments.start, path.end)
    apart = cut_moves(lines.event(Kind.DWELL, 1.0).line(5, 4, feed=1).finish(), flat_cuts=False)
    assert apart.segments.start.tolist() == [[0.0, 0.0], [1.0, 2.0], [3.0, 4.0]]
    assert not np.shares_memory(apart.segments.start, path.end)


def test_an_empty_toolpath_has_no_cuts() -> None:
    cuts = cut_moves(ToolpathBuilder().finish(), flat_cuts=True)
    assert len(cuts.segments) == 0
    assert cuts.contour_count == 0
    assert len(sample_cuts(cuts, 0.01).points) == 0
