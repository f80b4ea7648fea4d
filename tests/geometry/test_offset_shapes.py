"""Offsets of whole shapes with islands, and mitred corners, judged by slow, obvious oracles."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st

from camtool.errors import GeometryError, OptionError
from camtool.geometry.measure import path_lengths, signed_areas
from camtool.geometry.nesting import Nesting, oriented
from camtool.geometry.offset import offset_each, offset_shape
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    begin_at,
    reverse,
    reverse_lines,
    rotate,
)
from tests.oracles.contours import (
    CIRCLE,
    DUMBBELL,
    ELL,
    FILLETED,
    KEYHOLE,
    LENS,
    OBLONG,
    RANDOM,
    SLOT,
    SPIKE,
    SQUARE,
    closed,
    comb,
    gear,
    opened,
    spiral,
    star,
)
from tests.oracles.offset import distance_complaints
from tests.oracles.offset_shapes import shape_complaints
from tests.paths import mirrored, moved, offset, scaled
from tests.strategies import contours, examples

pytestmark = pytest.mark.checked

FRAME = closed((-20, -20), (40, -20), (40, 40), (-20, 40))
PLATE = [FRAME, CIRCLE, moved(SQUARE, 15, -5), moved(SLOT, 5, 20), closed((-2, 0, 1), (2, 0, 1))]
PAIR = [SQUARE, moved(SQUARE, 12, 0)]
RINGS = [scaled(CIRCLE, k) for k in (4.0, 3.0, 2.0, 1.0)]
DISC = closed((-1, 0, 1), (1, 0, 1))
TOUCHING = [SQUARE, moved(SQUARE, 10, 3)]
AT_CORNERS = [SQUARE, moved(SQUARE, 10, 10)]
HOLE_AT_EDGE = [OBLONG, closed((5, 0), (8, 3), (5, 6), (2, 3))]
WASHER = [CIRCLE, closed((-5, 1, 1), (3, 1, 1))]

# name, paths in any sense, distance, how many outer ones and holes: the reason
SHAPES: list[tuple[str, list[Polyline], float, tuple[int, int]]] = [
    ("plate in", PLATE, 0.5, (2, 3)),
    ("plate out", PLATE, -0.5, (2, 3)),
    ("plate in, holes merge", PLATE, 3.0, (1, 2)),  # and the island is gone
    ("plate out, island meets its hole", PLATE, -4.5, (1, 2)),
    ("plate in, to collapse", PLATE, 9.0, (2, 0)),
    ("plate in, gone", PLATE, 15.0, (0, 0)),
    ("two apart", PAIR, -0.9, (2, 0)),
    ("two, just touching", PAIR, -1.0, (1, 0)),  # the two runs to and fro go
    ("two merge", PAIR, -1.5, (1, 0)),
    ("two shrink", PAIR, 2.0, (2, 0)),
    ("rings in", RINGS, 2.0, (2, 2)),
    ("rings in, bands exactly closed", RINGS, 5.0, (0, 0)),
    ("rings out, gaps exactly closed", RINGS, -5.0, (1, 1)),
    ("rings out", RINGS, -2.0, (2, 2)),
    ("two along one line, in", TOUCHING, 1.0, (2, 0)),
    ("two along one line, out", TOUCHING, -1.0, (1, 0)),
    ("two at one corner, in", AT_CORNERS, 1.0, (2, 0)),
    ("two at one corner, out", AT_CORNERS, -1.0, (1, 0)),
    ("hole touches the edge, in", HOLE_AT_EDGE, 0.5, (1, 0)),
    ("hole touches the edge, out", HOLE_AT_EDGE, -0.5, (1, 1)),
    ("washer in", WASHER, 1.0, (1, 1)),
    ("washer in, thin side gone", WASHER, 2.6, (1, 0)),
    ("washer out, hole gone", WASHER, -4.5, (1, 0)),
]

# What failed once grows here: name, paths, distance, counts.
PAST_FAILURES: list[tuple[str, list[Polyline], float, tuple[int, int]]] = []


def shape(paths: list[Polyline]) -> Polylines:
    return oriented(Nesting(Polylines.of(paths)))


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def outer_and_holes(lines: Polylines) -> tuple[int, int]:
    areas = signed_areas(lines)
    return int((areas > 0.0).sum()), int((areas < 0.0).sum())


@pytest.mark.parametrize(
    ("paths", "d", "counts"),
    [pytest.param(*case[1:], id=case[0]) for case in SHAPES + PAST_FAILURES],
)
def test_shapes(paths: list[Polyline], d: float, counts: tuple[int, int]) -> None:
    lines = shape(paths)
    results = offset_shape(lines, d)
    assert outer_and_holes(results) == counts
    assert shape_complaints(list(results), list(lines), d, rng()) == []


@pytest.mark.parametrize(
    ("paths", "d"), [pytest.param(*case[1:3], id=case[0]) for case in SHAPES + PAST_FAILURES]
)
def test_changed_shapes_change_nothing_else(paths: list[Polyline], d: float) -> None:
    lines = shape(paths)
    wanted = offset_shape(lines, d)
    areas, lengths = np.sort(signed_areas(wanted)), np.sort(path_lengths(wanted))
    changed = [
        ("other order", lines.select(range(len(lines) - 1, -1, -1)), 1.0),
        ("turned", shape([rotate(p, 0.5 * math.pi) for p in paths]), 1.0),
        ("mirrored", shape([mirrored(p) for p in paths]), 1.0),
        ("scaled", shape([scaled(p, 0.1) for p in paths]), 0.1),
        ("moved", shape([moved(p, 4321.0, -987.0) for p in paths]), 1.0),
    ]
    most = max(len(p) for p in paths)
    changed += [(f"from {i}", shape([begin_at(p, i) for p in paths]), 1.0) for i in range(1, most)]
    for name, source, factor in changed:
        got = offset_shape(source, d * factor)
        assert len(got) == len(wanted), name
        assert np.allclose(np.sort(signed_areas(got)), areas * factor**2, atol=1e-5), name
        assert np.allclose(np.sort(path_lengths(got)), lengths * factor, atol=1e-5), name


def test_what_is_left_out_is_the_offset_of_the_rest() -> None:
    # The region shrunk has the boundary of the rest grown, travelled the other way.
    for _, paths, d, _ in SHAPES:
        lines = shape(paths)
        one, other = (
            offset_shape(lines, d),
            reverse_lines(offset_shape(reverse_lines(lines), -d)),
        )
        assert np.array_equal(one.offsets, other.offsets)
        assert np.array_equal(one.vertices, other.vertices)


def test_single_paths_are_shapes_of_one() -> None:
    for p in (ELL, KEYHOLE, reverse(SLOT)):
        for d in (0.7, -0.7):
            one, other = Polylines.of(offset(p, d)), offset_shape(Polylines.of([p]), d)
            assert np.array_equal(one.vertices, other.vertices)


def test_loops_come_in_the_order_of_their_sources() -> None:
    lines = shape(PLATE)
    for d in (0.5, -0.5):
        results = offset_shape(lines, d)
        again = offset_shape(lines, d)
        assert np.array_equal(results.vertices, again.vertices)
        areas = np.abs(signed_areas(results))
        assert list(np.argsort(areas)) == list(np.argsort(np.abs(signed_areas(lines))))
        starts = [p.start for p in results]
        first = [p.start for p in lines]
        assert [math.dist(a, b) < 1.0 for a, b in zip(starts, first, strict=True)] == [True] * 5


def test_open_paths_and_joins_unknown_are_refused() -> None:
    with pytest.raises(GeometryError, match="open"):
        offset_shape(Polylines.of([SQUARE, opened((0, 0), (1, 1))]), 1.0)
    with pytest.raises(GeometryError, match="finite"):
        offset_shape(Polylines.of([SQUARE]), math.nan)
    with pytest.raises(OptionError, match="bevel"):
        offset(SQUARE, 1.0, joins="bevel")
    for bad in (0.99, math.inf, math.nan):
        with pytest.raises(OptionError, match="mitre"):
            offset(SQUARE, 1.0, joins="mitre", mitre_limit=bad)


def test_no_distance_gives_the_shape_itself() -> None:
    lines = shape(PLATE)
    assert offset_shape(lines, 0.0) is lines
    assert len(offset_shape(Polylines.of([]), 1.0)) == 0


# --- corners ---

CORNERED = {
    "square": SQUARE,
    "ell": ELL,
    "slot": SLOT,
    "filleted": FILLETED,
    "keyhole": KEYHOLE,
    "lens": LENS,
    "star": star(7, 5.0, 10.0),
    "gear": gear(9, 7.0, 10.0),
    "spike": SPIKE,
    "dumbbell": DUMBBELL,
    "comb": comb(5),
    "spiral": spiral(2),
    "cusp": closed((0, 0, 1), (10, 0), (0, 0.0005)),
}


@pytest.mark.parametrize("name", CORNERED)
@pytest.mark.parametrize("limit", [1.2, 5.0])
def test_mitres(name: str, limit: float) -> None:
    p = CORNERED[name]
    for d in (0.3, -0.3, 1.1, -1.1, -3.0):
        results = offset(p, d, joins="mitre", mitre_limit=limit)
        assert shape_complaints(results, [p], d, rng(), limit) == [], d


@pytest.mark.parametrize("case", SHAPES, ids=[case[0] for case in SHAPES])
def test_mitres_of_shapes(case: tuple[str, list[Polyline], float, tuple[int, int]]) -> None:
    lines, d = shape(case[1]), case[2]
    results = offset_shape(lines, d, joins="mitre", mitre_limit=1.5)
    assert shape_complaints(list(results), list(lines), d, rng(), 1.5) == []


def test_a_square_grows_to_a_square() -> None:
    for joins in ("mitre", "sharp"):
        (result,) = offset(SQUARE, -2.0, joins=joins)
        assert len(result) == 4
        assert np.abs(result.vertices[:, :2] - 5.0) == pytest.approx(7.0, abs=1e-12)
    (cut,) = offset(SQUARE, -2.0, joins="mitre", mitre_limit=1.0)
    assert len(cut) == 8
    # Cut off where an arc would be, a corner lacks the triangle from there to its tip.
    assert Polylines.of([cut]).vertices.shape == (8, 3)
    assert signed_areas(Polylines.of([cut]))[0] == pytest.approx(
        196.0 - 4.0 * (2.0 * math.sqrt(2.0) - 2.0) ** 2, abs=1e-9
    )


def test_sharp_is_a_mitre_without_limit() -> None:
    thin = closed((0, 0), (20, 0), (0, 2))  # 5.7° at (20, 0)
    (sharp,) = offset(thin, -1.0, joins="sharp")
    (mitred,) = offset(thin, -1.0, joins="mitre", mitre_limit=2.0)
    assert len(sharp) == 3
    assert len(mitred) == 4
    tip = 1.0 / math.sin(0.5 * math.atan(0.1))
    assert sharp.vertices[:, 0].max() == pytest.approx(20.0 + tip * math.cos(0.5 * math.atan(0.1)))
    assert shape_complaints([sharp], [thin], -1.0, rng(), 100.0) == []


def test_mitres_are_where_lines_and_arcs_meet() -> None:
    # A half disc: at both corners the tangent of the arc goes on, and so does the line.
    half = closed((-10, 0), (10, 0, 1))
    (result,) = offset(half, -1.0, joins="sharp")
    assert np.count_nonzero(result.vertices[:, 2]) == 1
    assert len(result) == 4
    corners = result.vertices[:, :2][np.abs(result.vertices[:, 1] + 1.0) < 1e-9]
    assert sorted(np.abs(corners[:, 0])) == pytest.approx([11.0, 11.0], abs=1e-9)


# --- at random ---


@st.composite
def shapes(
    draw: st.DrawFn, kinds: tuple[str, ...] = ("star", "cells")
) -> tuple[list[Polyline], float]:
    """A frame with random holes, some with islands, side by side so that they merge early."""
    seed, across = draw(st.integers(0, 2**32 - 1)), draw(st.integers(1, 3))
    generator = np.random.default_rng(seed)
    made: list[Polyline] = []
    for i in range(across):
        for j in range(draw(st.integers(1, 2))):
            drawn = RANDOM[draw(st.sampled_from(kinds))](generator)
            assume(drawn is not None)
            assert drawn is not None
            p, _ = drawn
            low, high = p.vertices[:, :2].min(axis=0), p.vertices[:, :2].max(axis=0)
            size = float((high - low).max())
            p = scaled(moved(p, *(-0.5 * (low + high))), 7.0 / size)
            place = (12.0 * i + 6.0, 12.0 * j + 6.0)
            made.append(moved(p, *place))
            if draw(st.booleans()):
                # Inside what it is a small copy of, if it is star-shaped; else it may cross it.
                made.append(moved(scaled(p, 0.35), *place))
    frame = closed((-1, -1), (12 * across + 1, -1), (12 * across + 1, 25), (-1, 25))
    return [frame, *made], 12.0


def apart(paths: list[Polyline]) -> bool:
    """True if no two paths meet."""
    from camtool.geometry.intersect import self_crossings

    return len(self_crossings(Segments.of(Polylines.of(paths)))) == 0


@examples(12, nightly=1500)
@given(shapes(tuple(RANDOM)), st.floats(0.005, 0.4), st.sampled_from([1.0, -1.0]))
def test_random_shapes(source: tuple[list[Polyline], float], share: float, sign: float) -> None:
    paths, size = source
    assume(apart(paths))
    lines, d = shape(paths), sign * share * size
    assert shape_complaints(list(offset_shape(lines, d)), list(lines), d, rng()) == []


@examples(8)
@given(shapes(), st.floats(0.005, 0.2), st.sampled_from([1.0, -1.0]), st.floats(1.0, 4.0))
def test_random_mitres(
    source: tuple[list[Polyline], float], share: float, sign: float, limit: float
) -> None:
    paths, size = source
    assume(apart(paths))
    lines, d = shape(paths), sign * share * size
    results = offset_shape(lines, d, joins="mitre", mitre_limit=limit)
    assert shape_complaints(list(results), list(lines), d, rng(), limit) == []


@examples(10)
@given(st.integers(0, 2**32 - 1))
def test_contours_that_cross_each_other(seed: int) -> None:
    generator = np.random.default_rng(seed)
    paths = []
    while len(paths) < 4:
        drawn = RANDOM["star"](generator)
        if drawn is not None:
            p = scaled(drawn[0], 10.0 / drawn[1])
            paths.append(moved(p, *generator.uniform(-8.0, 8.0, 2)))
    for d in generator.uniform(-3.0, 3.0, 4):
        results = offset_shape(Polylines.of(paths), float(d))
        assert results.closed.all()
        points = [r for p in results for r in distance_from_all(p, paths, abs(d))]
        assert points == []


@examples(60)
@given(
    st.lists(
        st.tuples(st.floats(0.0, 6.0), st.floats(0.0, 6.0), st.floats(0.5, 3.0)),
        min_size=2,
        max_size=12,
    ),
    st.floats(0.05, 0.8),
)
@example(
    discs=[
        (3.145, 5.19, 3.19),
        (5.222, 6.443, 3.211),
        (4.753, 3.998, 3.374),
        (5.968, 0.491, 2.497),
        (3.088, 4.094, 1.57),
    ],
    d=0.3,
)
def test_discs_that_cross_grow_as_one(discs: list[tuple[float, float, float]], d: float) -> None:
    """Grown discs are larger discs: no gap between some is left where another covers it."""
    held = [
        sum(math.hypot(x - u, y - v) + r < s for u, v, s in discs) == 1 for x, y, r in discs
    ]  # one within another is its hole, within two it is an island
    discs = [disc for disc, hole in zip(discs, held, strict=True) if not hole]
    lines = Polylines.of([moved(scaled(DISC, r), x, y) for x, y, r in discs])
    grown = [shapely.Point(x, y).buffer(r + d, quad_segs=500) for x, y, r in discs]
    loops = offset_shape(lines, -d)
    found = float(signed_areas(loops).sum())
    for x, y, r in discs:
        away = np.hypot(*(loops.vertices[:, :2] - (x, y)).T)
        assert away.min() > r + d - 10 * POSITION_EPS_MM
    assert found == pytest.approx(shapely.union_all(grown).area, rel=1e-4, abs=1e-3)


def distance_from_all(result: Polyline, paths: list[Polyline], d: float) -> list[str]:
    """Complaints about points of a result that are too near to any of the paths."""
    return [
        complaint
        for p in paths
        for complaint in distance_complaints([result], p, d)
        if "near" in complaint
    ]


def test_results_are_clean() -> None:
    lines = shape([gear(60, 9.0, 10.0), scaled(gear(41, 9.0, 10.0), 0.5)])
    for d in np.linspace(-1.0, 1.0, 41):
        results = offset_shape(lines, float(d))
        step = Segments.of(results)
        if len(step):
            assert np.hypot(*(step.end - step.start).T).min() > POSITION_EPS_MM


def test_many_teeth() -> None:
    # Each at once merges, collapses or falls apart; the counts are known.
    teeth = 1500
    p = comb(teeth)
    assert len(offset(p, 0.5)) == 1
    assert len(offset(p, 1.0)) == teeth - 2
    assert len(offset(p, -0.5)) == 1
    (around,) = offset(p, -3.0)
    assert len(around) == 3 * teeth + 5  # over each tooth a line and two arcs that meet the next
    wound = spiral(300)
    (band,) = offset(wound, 0.5)
    assert len(band) == len(wound) + 0
    assert len(offset(wound, 1.0)) == 0


def test_a_circle_of_chords_to_its_middle() -> None:
    # All shifted chords pass one point, and beyond it all of them cross.
    chords = 300
    angle = 2.0 * np.pi * np.arange(chords) / chords
    p = Polyline(np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]), True)
    apothem = math.cos(math.pi / chords)
    assert len(offset(p, apothem)) == 0
    assert len(offset(p, apothem + 1e-4)) == 0
    (left,) = offset(p, apothem - 0.01)
    assert len(left) == chords


@pytest.mark.slow
@pytest.mark.parametrize("kind", RANDOM)
def test_thousands_of_mitres(kind: str) -> None:
    generator = np.random.default_rng(3)
    judged = 0
    while judged < (40 if kind == "gear" else 300):
        drawn = RANDOM[kind](generator)
        if drawn is None:
            continue
        judged += 1
        # Three points about a centre may turn CW.
        (p,), size = shape([drawn[0]]), drawn[1]
        limit = float(generator.choice([1.0, 1.3, 2.0, 6.0]))
        for share in 10.0 ** generator.uniform(-3, -0.3, 2):
            for d in (size * share, -size * share):
                results = offset(p, d, joins="mitre", mitre_limit=limit)
                found = shape_complaints(results, [p], d, generator, limit)
                assert found == [], f"{p.vertices.tolist()} at {d}, {limit}"


@examples(40)
@given(
    st.lists(
        st.tuples(
            st.one_of(contours(), st.sampled_from([SQUARE, SLOT, comb(3)])),
            st.tuples(st.integers(-4, 4), st.integers(-4, 4)),
            st.booleans(),
        ),
        max_size=8,
    ),
    st.floats(-3.0, 3.0),
    st.sampled_from(["round", "mitre", "sharp"]),
)
def test_paths_are_offset_each_as_if_it_were_alone(
    drawn: list[tuple[Polyline, tuple[int, int], bool]], distance: float, joins: str
) -> None:
    # Some far apart, some that cross, hold or double each other.
    paths = []
    for path, (x, y), turned in drawn:
        there = moved(path, 9.0 * x, 9.0 * y)
        paths.append(reverse(there) if turned else there)
    found, of = offset_each(Polylines.of(paths), distance, joins=joins)
    wanted = [offset_shape(Polylines.of([path]), distance, joins=joins) for path in paths]
    assert of.tolist() == [k for k, each in enumerate(wanted) for _ in each]
    for one, other in zip(found, (path for each in wanted for path in each), strict=True):
        assert one.vertices.tolist() == other.vertices.tolist()


def test_a_path_that_touches_itself_is_offset_each_as_by_itself() -> None:
    eight = closed((0, 0), (4, 0), (2, 2), (4, 4), (0, 4), (2, 2))
    paths = [SQUARE, moved(eight, 40.0, 0.0), moved(SQUARE, 0.0, 40.0), moved(eight, 5.0, 3.0)]
    for distance in (-0.4, 0.4):
        found, of = offset_each(Polylines.of(paths), distance)
        for k, path in enumerate(paths):
            wanted = offset_shape(Polylines.of([path]), distance)
            mine = found.select(np.flatnonzero(of == k).tolist())
            assert mine.vertices.tolist() == wanted.vertices.tolist()
