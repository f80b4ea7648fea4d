"""The smallest features of a drawing, and what is counted of it."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import GeometryError
from camtool.geometry.distance import approach
from camtool.geometry.drawing import Branch, Drawing, Gap, Healing, Mark, SelfCrossing, Units
from camtool.geometry.facts import (
    drawing_extents,
    drawing_facts,
    narrowest_wall,
    shortest_segment,
    smallest_contour,
    smallest_radius,
)
from camtool.geometry.polylines import Polyline, Polylines, Segments
from tests.drawings import drawing_of
from tests.paths import moved
from tests.strategies import contours, examples, polylines


def path(*points: tuple[float, ...], closed: bool = True) -> Polyline:
    return Polyline(np.array([(*p, 0.0)[:3] for p in points], dtype=np.float64), closed)


def circle(x: float, y: float, radius: float) -> Polyline:
    return path((x - radius, y, 1), (x + radius, y, 1))


@examples(20, 2000)
@given(
    st.lists(st.tuples(contours(), st.floats(-30, 30), st.floats(-30, 30)), min_size=2, max_size=6)
)
def test_the_narrowest_wall_equals_all_pairs(rows: list[tuple[Polyline, float, float]]) -> None:
    paths = [moved(p, x, y) for p, x, y in rows]
    wall = narrowest_wall(Polylines.of(paths))
    assert wall is not None
    pairs = {
        (i, j): approach(paths[i], paths[j]).distance
        for i in range(len(paths))
        for j in range(i + 1, len(paths))
    }
    least = min(pairs.values())
    assert wall.size_mm == pytest.approx(least, rel=1e-9, abs=1e-6)
    assert pairs[wall.paths] == pytest.approx(least, rel=1e-9, abs=1e-6)


def test_two_circles_are_nearest_between_their_centres() -> None:
    wall = narrowest_wall(Polylines.of([circle(0, 0, 1), circle(3, 4, 2)]))
    assert wall is not None
    assert wall.size_mm == pytest.approx(2.0)
    assert wall.paths == (0, 1)
    x, y = wall.at_mm
    assert min(math.dist((x, y), p) for p in ((0.6, 0.8), (1.8, 2.4))) < 1e-9


def test_open_paths_make_no_wall() -> None:
    stroke = path((0, 0), (5, 0), closed=False)
    assert narrowest_wall(Polylines.of([circle(0, 0, 1), stroke])) is None
    assert narrowest_wall(Polylines.of([])) is None


def test_contours_that_cross_have_no_wall_between_them() -> None:
    wall = narrowest_wall(Polylines.of([circle(0, 0, 5), path((3, -9), (4, -9), (4, 9), (3, 9))]))
    assert wall is not None
    assert wall.size_mm == 0.0


@given(st.lists(polylines(), min_size=1, max_size=6))
def test_the_smallest_of_each_kind(paths: list[Polyline]) -> None:
    lines = Polylines.of(paths)
    segments = Segments.of(lines)
    short = shortest_segment(segments)
    assert short is not None
    rows = [(p, s) for p in range(len(paths)) for s in Segments.of(paths[p]).radius]
    radius = smallest_radius(segments)
    finite = [s for _, s in rows if math.isfinite(s)]
    assert (radius is None) == (not finite)
    if radius is not None:
        assert radius.size_mm == min(finite)
        assert (radius.paths[0], radius.size_mm) in rows
    contour = smallest_contour(lines)
    assert (contour is None) == (not lines.closed.any())


def test_the_smallest_contour_is_told_with_its_place() -> None:
    found = smallest_contour(Polylines.of([circle(0, 0, 5), path((8, 0), (9, 0), (9, 7), (8, 7))]))
    assert found is not None
    assert (found.size_mm, found.at_mm, found.paths) == (1.0, (8.5, 3.5), (1,))


def full() -> Drawing:
    paths = [circle(0, 0, 1), circle(5, 0, 2), path((9, 0), (12, 4), closed=False)]
    return Drawing(
        Polylines.of(paths),
        ("A", "A", "B"),
        ("#ff0000", "", ""),
        ("CIRCLE 1", "CIRCLE 2", "LINE 3"),
        "t.dxf",
        Units("mm", 1.0, "in a test"),
        gaps=(Gap((1.0, 2.0), 0.5, "B"),),
        closed_gaps=(Gap((3.0, 2.0), 0.005, "A"),),
        marks=(Mark((20.0, -7.0), "holes", "", "POINT 9"),),
        healing=Healing(1, 2.0, 3, 4.0, 5, 6, (Branch((0, 0), 3, "A"),),
                        (SelfCrossing((1, 1), 0, "A"),)),
        line_types=("DASHED", "", ""),
    )  # fmt: skip


def test_facts_are_ready_for_json() -> None:
    facts = json.loads(json.dumps(drawing_facts(full())))
    assert (facts["closed"], facts["open"], facts["marks"]) == (2, 1, 1)
    assert (facts["lines"], facts["arcs"]) == (1, 4)
    assert facts["layers"]["A"] == {"closed": 2, "open": 0, "marks": 0}
    assert facts["layers"]["holes"] == {"closed": 0, "open": 0, "marks": 1}
    assert facts["colours"] == {"": 2, "#ff0000": 1}
    assert facts["line_types"] == {"": 2, "DASHED": 1}
    assert facts["smallest_radius_mm"] == pytest.approx(1.0)
    assert facts["smallest"]["radius"]["paths"] == [0]
    assert facts["smallest"]["contour"]["size_mm"] == pytest.approx(2.0)
    assert facts["smallest"]["contour"]["at_mm"] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert facts["smallest"]["distance"]["size_mm"] == pytest.approx(2.0)
    assert facts["smallest"]["segment"]["size_mm"] == pytest.approx(math.pi)
    ends = [(end["at_mm"], end["path"], end["layer"]) for end in facts["open_ends"]]
    assert ends == [([9, 0], 2, "B"), ([12, 4], 2, "B")]
    assert facts["gaps"] == [{"at_mm": [1, 2], "size_mm": 0.5, "layer": "B"}]
    assert facts["closed_gaps"] == [{"at_mm": [3, 2], "size_mm": 0.005, "layer": "A"}]
    assert facts["duplicates"] == {"count": 1, "length_mm": 2.0}
    assert facts["overlaps"] == {"count": 3, "length_mm": 4.0}
    assert (facts["tiny_merged"], facts["arcs_recognised"]) == (5, 6)
    assert facts["branches"] == [{"at_mm": [0, 0], "ends": 3, "layer": "A"}]
    assert facts["crossings"] == [{"at_mm": [1, 1], "path": 0, "layer": "A"}]


def test_extents_hold_marks_too() -> None:
    assert drawing_extents(full()).tolist() == [[-1.0, 20.0], [-7.0, 4.0]]
    with pytest.raises(GeometryError, match="nothing"):
        drawing_extents(drawing_of([]))


def test_a_drawing_without_paths_has_facts() -> None:
    facts = drawing_facts(drawing_of([]))
    assert facts["length_mm"] == 0.0
    assert set(facts["smallest"].values()) == {None}


def test_line_types_fit_the_paths() -> None:
    assert drawing_of([circle(0, 0, 1)]).line_types == ("",)
    with pytest.raises(ValueError, match="line_types"):
        Drawing(Polylines.of([]), (), (), (), "", Units("mm", 1.0, ""), line_types=("a",))
