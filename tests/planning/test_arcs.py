"""Split arcs put together again."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.measure import length, segment_lengths
from camtool.geometry.polylines import Polyline, Polylines, Segments, reverse
from camtool.planning.paths import cuts as cuts_of_runs
from camtool.planning.paths import joints
from tests.oracles import passes
from tests.oracles.passes import Cut
from tests.strategies import polylines

pytestmark = pytest.mark.checked


def _arcs(sweeps: list[float], closed: bool = False, radius: float = 2.0) -> Polyline:
    """Arcs of one circle about (1, 1), degrees."""
    angles = np.radians(np.concatenate([[0.0], np.cumsum(sweeps)]))
    points = 1.0 + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    bulges = np.append(np.tan(np.radians(sweeps) / 4.0), 0.0)
    vertices = np.column_stack([points, bulges])
    return Polyline(vertices[:-1] if closed else vertices, closed)


def cuts(path: Polyline, rise: float = 0.0) -> list[Cut]:
    """The cuts of a run along the path that climbs evenly by `rise`."""
    vertices = np.insert(path.vertices, 2, 0.0, axis=1)
    if path.closed:
        vertices = np.concatenate([vertices, vertices[:1]])
    segments = Segments.of(path)
    share = np.cumsum(np.concatenate([[0.0], segment_lengths(segments)]))
    vertices[:, 2] = rise * share / share[-1]
    return cuts_of_run(vertices, np.full(len(vertices) - 1, 5.0))


def cuts_of_run(*runs: np.ndarray) -> list[Cut]:
    """The cuts of runs, each its vertices and then its feeds, all found together."""
    vertices, feeds = runs[::2], runs[1::2]
    first = np.concatenate([[0], np.cumsum([len(each) for each in vertices])])
    feed = np.concatenate([np.append(each, np.nan) for each in feeds])
    found = cuts_of_runs(np.concatenate(vertices), feed, first)
    return [
        Cut(tuple(end), None if np.isnan(centre[0]) else tuple(centre), ccw, each)
        for end, centre, ccw, each in zip(
            found.end.tolist(),
            found.centre.tolist(),
            found.ccw.tolist(),
            found.feed.tolist(),
            strict=True,
        )
    ]


@pytest.mark.parametrize("sweeps", [[180, 180], [120, 120, 120], [90, 180, 90], [20] * 18])
@pytest.mark.parametrize("turned", [False, True])
def test_a_circle_is_one_arc_that_ends_where_it_starts(sweeps: list[float], turned: bool) -> None:
    path = _arcs(sweeps, closed=True)
    path = reverse(path) if turned else path
    (cut,) = cuts(path)
    assert cut.end == (3.0, 1.0, 0.0)
    assert cut.centre == pytest.approx((1.0, 1.0))
    assert cut.ccw is not turned
    assert joints(Polylines.of([path])).all()


def test_parts_of_one_arc_are_one_and_others_stay() -> None:
    first = _arcs([90, 90, 45])
    other = Polyline(np.concatenate([first.vertices, [[9.0, 9.0, 0.0]]]))
    found = cuts(other)
    assert [cut.centre is None for cut in found] == [False, True]
    assert found[0].end == pytest.approx((*first.end, 0.0))


@pytest.mark.parametrize(
    "vertices",
    [
        [[0, 0, 1], [2, 0, -1], [4, 0, 0]],  # the other direction
        [[0, 0, 1], [2, 0, 1], [5, 0, 0]],  # another centre
        [[0, 0, 1], [4, 0, 1], [1, 0, 0]],  # another radius
        [[0, 0, 0], [2, 0, 0], [4, 0, 0]],  # lines stay as they are drawn
        [[0, 0, 0], [2, 0, 1], [4, 0, 0]],
    ],
)
def test_no_others_are_put_together(vertices: list[list[float]]) -> None:
    assert len(cuts(Polyline(np.array(vertices, dtype=float)))) == 2


def test_an_open_path_round_and_round_is_never_a_whole_circle_by_mistake() -> None:
    found = cuts(_arcs([150, 150, 59.999, 150, 150]))
    assert len(found) == 3
    ends = [(3.0, 1.0), *[cut.end[:2] for cut in found]]
    for start, end in pairwise(ends):
        assert math.dist(start, end) > 1e-3


def test_a_closed_path_is_not_merged_across_its_start() -> None:
    slot = Polyline(
        np.array([[2.0, 0, math.tan(math.pi / 8)], [1, 1, 0], [-9, 1, 0], [1, -1, 0.4]])
    )
    assert len(cuts(Polyline(slot.vertices, closed=True))) == 4


@given(polylines(), st.integers(1, 4))
def test_cuts_run_from_vertex_to_vertex_and_are_as_long_as_the_path(
    path: Polyline, parts: int
) -> None:
    split = _split(path, parts)
    found = cuts(split)
    assert len(found) <= len(split)
    assert found[-1].end == pytest.approx((*path.end, 0.0))
    at = tuple(path.start.tolist())
    total = 0.0
    for cut in found:
        total += _length(at, cut)
        at = cut.end[:2]
    assert total == pytest.approx(length(path), rel=1e-6)


def _length(start: tuple[float, ...], cut: Cut) -> float:
    if cut.centre is None:
        return math.dist(start, cut.end[:2])
    begin = math.atan2(start[1] - cut.centre[1], start[0] - cut.centre[0])
    end = math.atan2(cut.end[1] - cut.centre[1], cut.end[0] - cut.centre[0])
    turn = (end - begin) * (1.0 if cut.ccw else -1.0) % (2.0 * math.pi)
    return math.dist(start, cut.centre) * (turn if cut.end[:2] != start else 2.0 * math.pi)


def _split(path: Polyline, parts: int) -> Polyline:
    """Every clearly bent arc in as many equal parts."""
    rows: list[list[float]] = []
    vertices = path.vertices.tolist()
    for i in range(len(path)):
        (x0, y0, b), (x1, y1, _) = vertices[i], vertices[(i + 1) % len(vertices)]
        rows.append([x0, y0, b])
        if abs(b) < 0.05 or parts == 1:
            continue
        sweep = 4.0 * math.atan(b)
        height = (1.0 - b * b) / (4.0 * b)
        cx, cy = 0.5 * (x0 + x1) - height * (y1 - y0), 0.5 * (y0 + y1) + height * (x1 - x0)
        rows[-1][2] = math.tan(sweep / parts / 4.0)
        for k in range(1, parts):
            turn = k * sweep / parts
            cosine, sine = math.cos(turn), math.sin(turn)
            dx, dy = x0 - cx, y0 - cy
            rows.append([cx + cosine * dx - sine * dy, cy + sine * dx + cosine * dy, rows[-1][2]])
    if not path.closed:
        rows.append(vertices[-1])
    return Polyline(np.array(rows), path.closed)


def test_a_helix_is_one_arc_for_each_turn() -> None:
    once = _arcs([180, 180], closed=True).vertices
    vertices = np.insert(np.concatenate([once, once, once[:1]]), 2, 0.0, axis=1)
    vertices[:, 2] = [0.0, -1.0, -2.0, -3.0, -4.0]
    found = cuts_of_run(vertices, np.full(4, 5.0))
    assert [cut.end for cut in found] == [(3.0, 1.0, -2.0), (3.0, 1.0, -4.0)]


@pytest.mark.parametrize(
    ("z", "feed", "count"),
    [
        ([0.0, -1.0, -2.0], [5.0, 5.0], 1),
        ([0.0, -1.0, -1.0], [5.0, 5.0], 2),  # a ramp that ends on the way
        ([0.0, -1.0, -2.0], [5.0, 6.0], 2),  # two feeds
    ],
)
def test_arcs_of_other_slopes_and_feeds_stay(
    z: list[float], feed: list[float], count: int
) -> None:
    vertices = np.insert(_arcs([60, 60]).vertices, 2, z, axis=1)
    assert len(cuts_of_run(vertices, np.array(feed))) == count


@given(st.lists(st.tuples(polylines(), st.integers(1, 4), st.booleans()), max_size=5))
def test_many_runs_are_cut_as_each_by_itself(drawn: list[tuple[Polyline, int, bool]]) -> None:
    runs: list[np.ndarray] = []
    for path, parts, sinks in drawn:
        split = _split(path, parts)
        vertices = np.insert(split.vertices, 2, np.arange(len(split.vertices)) * -sinks, axis=1)
        feeds = np.where(np.arange(len(vertices) - 1) % 3 == 2, np.nan, 5.0)
        runs += [vertices, feeds]
    wanted = [cut for one in zip(runs[::2], runs[1::2], strict=True) for cut in passes.cuts(*one)]
    found = cuts_of_run(*runs) if runs else []
    assert len(found) == len(wanted)
    for one, other in zip(found, wanted, strict=True):
        assert (one.end, one.centre, one.ccw) == (other.end, other.centre, other.ccw)
        assert one.feed == pytest.approx(other.feed, nan_ok=True)


@given(st.lists(st.tuples(polylines(), st.integers(1, 3)), min_size=1, max_size=5))
def test_joints_of_many_paths_are_those_of_each(drawn: list[tuple[Polyline, int]]) -> None:
    paths = [_split(path, parts) for path, parts in drawn]
    found = np.split(joints(Polylines.of(paths)), np.cumsum([len(p.vertices) for p in paths]))
    for path, mine in zip(paths, found, strict=False):
        if not path.closed:
            assert mine.all()
            continue
        twice = np.concatenate([path.vertices, path.vertices, path.vertices[:1]])
        level = np.insert(twice, 2, 0.0, axis=1)
        count = len(path.vertices)
        same = [
            len(list(passes.cuts(level[k : k + 3], np.ones(2)))) == 1
            for k in range(count - 1, 2 * count - 1)
        ]
        split = ~np.array(same)
        assert mine.tolist() == (split if split.any() else ~split).tolist()
