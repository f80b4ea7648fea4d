"""What lies twice is taken off: the same points are covered before and after, each once."""

from __future__ import annotations

import math
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.distance import points_to_segments
from camtool.geometry.measure import path_lengths, sample
from camtool.geometry.overlaps import SAME_LINE_MM, Unlapped, without_overlaps
from camtool.geometry.polylines import Polyline, Polylines, Segments, reverse, rotate
from tests.paths import mirrored

WITHIN = SAME_LINE_MM
QUARTER = math.tan(math.pi / 8.0)


def path(*points: tuple[float, ...], closed: bool = False) -> Polyline:
    return Polyline(np.array([(*p, 0.0)[:3] for p in points], dtype=np.float64), closed)


def off(*paths: Polyline, groups: list[int] | None = None) -> Unlapped:
    lines = Polylines.of(paths)
    return without_overlaps(lines, np.array(groups or [0] * len(paths)), WITHIN)


def ends(lines: Polylines) -> list[list[list[float]]]:
    return [np.round(p.vertices, 9).tolist() for p in lines]


def test_a_line_on_a_longer_one_goes() -> None:
    found = off(path((2, 0), (5, 0)), path((0, 0), (10, 0)))
    assert found.source.tolist() == [1]
    assert (found.count, found.length_mm) == (1, pytest.approx(3.0))


def test_a_line_partly_on_a_longer_one_is_shortened_as_it_was_drawn() -> None:
    found = off(path((0, 0), (6, 0)), path((9, 0), (4, 0)))
    assert ends(found.lines) == [[[0, 0, 0], [6, 0, 0]], [[9, 0, 0], [6, 0, 0]]]
    assert (found.count, found.length_mm) == (1, pytest.approx(2.0))


def test_a_line_on_a_contour_is_shortened_and_the_contour_stays() -> None:
    square = path((0, 0), (10, 0), (10, 5), (0, 5), closed=True)
    found = off(square, path((-2, 0), (12, 0)))
    assert found.source.tolist() == [0, 1, 1]
    assert np.array_equal(found.lines[0].vertices, square.vertices)
    assert ends(found.lines)[1:] == [[[-2, 0, 0], [0, 0, 0]], [[10, 0, 0], [12, 0, 0]]]


def test_contours_that_share_an_edge_are_two_parts() -> None:
    one = path((0, 0), (5, 0), (5, 5), (0, 5), closed=True)
    two = path((5, 1), (9, 1), (9, 5), (5, 5), closed=True)
    stroke = path((5, 0), (5, 9), (6, 9))
    found = off(one, two, stroke)
    assert (len(found.lines), found.count) == (3, 0)


def test_arcs_on_a_circle_go() -> None:
    circle = path((0, 0, 1), (2, 0, 1), closed=True)
    quarter = path((1, -1, QUARTER), (2, 0))
    three_quarters = path((2, 0, -1), (0, 0, -QUARTER), (1, 1))
    found = off(quarter, circle, three_quarters)
    assert found.source.tolist() == [1]
    assert found.length_mm == pytest.approx(2.0 * math.pi)


@pytest.mark.parametrize("back", [False, True])
def test_an_arc_partly_on_another_is_shortened(back: bool) -> None:
    half = path((0, 0, 1), (2, 0))  # below, from 180° to 360°
    other = path((1, -1, 1), (1, 1))  # on the right, from 270° to 90°
    found = off(half, reverse(other) if back else other)
    assert found.count == 1
    assert found.length_mm == pytest.approx(0.5 * math.pi)
    assert path_lengths(found.lines).sum() == pytest.approx(1.5 * math.pi)


def test_an_arc_of_three_quarters_may_cover_both_ends_of_another() -> None:
    low = path((0, 1, 1), (0, -1, QUARTER), (1, 0))  # 90° to 360°
    high = path((1, 0, 1), (-1, 0, QUARTER), (0, -1))  # 0° to 270°
    found = off(low, high)
    assert path_lengths(found.lines).sum() == pytest.approx(2.0 * math.pi)
    assert found.count == 1


def test_groups_and_what_is_only_near_are_left_alone() -> None:
    assert off(path((0, 0), (9, 0)), path((2, 0), (5, 0)), groups=[0, 1]).count == 0
    assert off(path((0, 0), (9, 0)), path((2, 3e-4), (5, 3e-4))).count == 0
    assert off(path((0, 0), (9, 0)), path((2, 0), (5, 0.01))).count == 0
    assert off(path((0, 0), (9, 0)), path((9, 0), (12, 0))).count == 0
    assert off(path((0, 0, 1), (2, 0)), path((0, 0), (2, 0))).count == 0
    assert off(path((0, 0, 1), (2, 0)), path((-1e-3, 0, 1), (2.001, 0))).count == 0


def test_a_point_of_a_spike_is_no_overlap() -> None:
    # They are within the tolerance near their tip only, and leave each other after that.
    assert off(path((0, 0), (9, 0)), path((0, 0), (9, 1e-2))).count == 0


STRETCH = st.tuples(st.integers(0, 30), st.integers(1, 12))


@st.composite
def drawings(draw: st.DrawFn) -> list[Polyline]:
    """Lines on a few lines, arcs on a few circles, and contours that lie on both."""
    paths = []
    for _ in range(draw(st.integers(1, 10))):
        begin, size = draw(STRETCH)
        row = draw(st.integers(0, 1))
        paths.append(path((begin, 5.0 * row), (begin + size, 5.0 * row)))
    for _ in range(draw(st.integers(0, 8))):
        begin, size = draw(STRETCH)
        low, sweep = begin * math.pi / 12.0, min(size, 11) * math.pi / 12.0
        radius = draw(st.sampled_from([3.0, 3.5]))
        first, last = ((radius * math.cos(a), radius * math.sin(a)) for a in (low, low + sweep))
        paths.append(path((*first, math.tan(0.25 * sweep)), last))
    if draw(st.booleans()):
        paths.append(path((2, 0), (8, 0), (8, 5), (4, 5), closed=True))
    if draw(st.booleans()):
        paths.append(path((-3, 0, 1), (3, 0, 1), closed=True))
    return [reverse(p) if draw(st.booleans()) else p for p in paths]


def covered(points: np.ndarray, lines: Polylines) -> np.ndarray:
    """Count the paths (not segments) on which each point lies, by brute force."""
    counts = np.zeros(len(points), dtype=np.int64)
    for one in lines:
        counts += points_to_segments(points, Segments.of(one)).min(axis=1) <= 2.0 * WITHIN
    return counts


def is_loose(one: Polyline) -> bool:
    return not one.closed and len(one) == 1


@given(drawings(), st.sampled_from([0.0, 0.7, 2.0]), st.booleans())
def test_the_same_points_are_covered_and_none_twice(
    paths: list[Polyline], angle: float, mirror: bool
) -> None:
    paths = [rotate(mirrored(p) if mirror else p, angle) for p in paths]
    before = Polylines.of(paths)
    found = without_overlaps(before, np.zeros(len(paths), dtype=np.int64), WITHIN)
    points = np.concatenate([sample(p, 0.31) for p in paths])
    assert (covered(points, found.lines) > 0).all()
    after = np.concatenate([sample(p, 0.31) for p in found.lines])
    assert (covered(after, before) > 0).all()
    # Ends meet and lines cross; away from them a point of a loose path lies on nothing else.
    vertices = np.concatenate([p.vertices[:, :2] for p in found.lines])
    loose = Polylines.of(p for p in found.lines if is_loose(p))
    for one in loose:
        inner = sample(one, 0.0317)
        apart = np.hypot(*(inner[:, None, :] - vertices[None, :, :]).transpose(2, 0, 1))
        inner = inner[apart.min(axis=1) > 0.01]
        assert (covered(inner, found.lines) <= 1).mean() > 0.5 if len(inner) > 8 else True
    gone = path_lengths(before).sum() - path_lengths(found.lines).sum()
    assert found.length_mm == pytest.approx(gone, abs=1e-6)


@given(drawings(), st.integers(0, 10**6))
def test_the_order_of_drawing_changes_nothing(paths: list[Polyline], seed: int) -> None:
    random = Random(seed)
    other = [reverse(p) if random.random() < 0.5 else p for p in paths]
    random.shuffle(other)
    one, two = off(*paths), off(*other)
    assert sorted(np.round(path_lengths(one.lines), 6)) == pytest.approx(
        sorted(np.round(path_lengths(two.lines), 6))
    )
    assert (one.count, one.length_mm) == (two.count, pytest.approx(two.length_mm))


@given(st.lists(STRETCH, min_size=1, max_size=12))
def test_lines_on_one_line_cover_their_union_once(rows: list[tuple[int, int]]) -> None:
    found = off(*(path((begin, 0), (begin + size, 0)) for begin, size in rows))
    cells = {cell for begin, size in rows for cell in range(begin, begin + size)}
    assert path_lengths(found.lines).sum() == pytest.approx(len(cells))
