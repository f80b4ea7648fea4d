"""Where closed contours may begin: by rule, or at a place."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.geometry.measure import length, signed_area
from camtool.geometry.polylines import Polyline, begin_at, reverse
from camtool.planning.contours import START_SNAP_MM, with_starts
from tests.oracles.arcs import chain_distances, chain_points
from tests.strategies import contours

OBLONG = Polyline(np.array([[0, 0, 0], [9, 0, 0], [9, 4, 0], [0, 4, 0.0]]), True)
QUARTER = math.tan(math.pi / 8.0)
# The oblong grown by a tool of 1 mm: round at the corners.
AROUND = Polyline(
    np.array(
        [
            [0, -1, 0],
            [9, -1, QUARTER],
            [10, 0, 0],
            [10, 4, QUARTER],
            [9, 5, 0],
            [0, 5, QUARTER],
            [-1, 4, 0],
            [-1, 0, QUARTER],
        ]
    ),
    True,
)
ROUND = Polyline(np.array([[0, 0, 1.0], [10, 0, 1.0]]), True)


def begins(path: Polyline, rule: str | tuple[float, float], radius: float = 0.0) -> list[list]:
    made, starts = with_starts(path, rule, radius)
    return made.vertices[starts, :2].tolist()


def test_any_vertex_will_do_for_the_nearest_and_for_open_paths() -> None:
    for path, rule in (
        (OBLONG, "nearest"),
        (Polyline(OBLONG.vertices), "corner"),
        (Polyline(OBLONG.vertices), "longest-line"),
        (Polyline(OBLONG.vertices), (3.0, 0.0)),
        (ROUND, "corner"),
    ):
        made, starts = with_starts(path, rule, 0.0)
        assert made is path
        assert len(starts) == 0


def test_the_middle_of_the_longest_line() -> None:
    assert begins(OBLONG, "longest-line") == [[4.5, 0.0]]
    assert begins(begin_at(OBLONG, 2), "longest-line") == [[4.5, 4.0]]
    # A longer arc is no line; but without lines it has to do.
    slot = Polyline(np.array([[0, 0, 0], [5, 0, 1.0], [5, 8, 0], [0, 8, 1.0]]), True)
    assert begins(slot, "longest-line") == [[2.5, 0.0]]
    assert begins(ROUND, "longest-line")[0] == pytest.approx([5.0, -5.0])


def test_corners_sharp_or_rounded_by_the_tool() -> None:
    assert begins(OBLONG, "corner") == OBLONG.vertices[:, :2].tolist()
    assert begins(AROUND, "corner", 1.0) == AROUND.vertices[1::2, :2].tolist()
    # Arcs of another radius are drawn so.
    assert begins(AROUND, "corner", 0.9) == []
    # A way there and back is a relief, and its tip no place to begin.
    relief = Polyline(
        np.array([[0, 0, 0], [9, 0, 0], [9, 4, 0], [9.5, 4.5, 0], [9, 4, 0], [0, 4, 0.0]]), True
    )
    assert [9.5, 4.5] not in begins(relief, "corner")
    assert [9.0, 4.0] in begins(relief, "corner")


def test_a_place_by_hand_is_the_nearest_one() -> None:
    assert begins(OBLONG, (3.0, -1.0)) == [[3.0, 0.0]]
    assert begins(OBLONG, (20.0, 1.0)) == [[9.0, 1.0]]
    assert begins(OBLONG, (-4.0, -4.0)) == [[0.0, 0.0]]
    assert begins(ROUND, (5.0, 30.0))[0] == pytest.approx([5.0, 5.0])


def test_a_start_very_near_to_a_vertex_is_that_vertex() -> None:
    for off, count in ((0.9 * START_SNAP_MM, 4), (1.1 * START_SNAP_MM, 5)):
        for place in ((9.0 - off, 0.0), (9.0, off), (off, 0.0), (0.0, off)):
            made, (start,) = with_starts(OBLONG, place, 0.0)
            assert len(made) == count
            assert 0 <= start < count
            if count == 4:
                assert made is OBLONG


@given(contours(), st.floats(-15.0, 15.0), st.floats(-15.0, 15.0))
def test_one_more_vertex_changes_nothing(path: Polyline, x: float, y: float) -> None:
    made, (start,) = with_starts(path, (x, y), 0.0)
    assert len(made) - len(path) in (0, 1)
    assert length(made) == pytest.approx(length(path), rel=1e-9)
    assert signed_area(made) == pytest.approx(signed_area(path), rel=1e-9)
    ring = np.concatenate([path.vertices, path.vertices[:1]])
    rows = np.concatenate([made.vertices, made.vertices[:1]])
    whole = {(*a, *b[:2]) for a, b in pairwise(ring.tolist())}
    for a, b in pairwise(rows.tolist()):
        if (*a, *b[:2]) not in whole:  # of shallow arcs, the twin knows no better
            assert chain_distances(chain_points(np.array([a, b]), 7), ring).max() <= 1e-7
    least = chain_distances(np.array([[x, y]]), ring)[0]
    assert math.dist(made.vertices[start, :2], (x, y)) <= least + START_SNAP_MM


@given(contours())
def test_rules_do_not_ask_which_way_round(path: Polyline) -> None:
    sizes = np.sort(np.hypot(*np.diff(np.vstack([path.vertices, path.vertices[:1]])[:, :2].T)))
    assume(np.diff(sizes).min() > 1e-6)  # one line is the longest
    for rule in ("longest-line", "corner"):
        there, back = begins(path, rule), begins(reverse(path), rule)
        assert np.array(sorted(there)) == pytest.approx(np.array(sorted(back)), abs=1e-9)
