"""Envelopes against the region that discs clear (shapely), sizes against known shapes, and zones
against a linear programme of scipy."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from camtool.arrays import Floats
from camtool.inspection.dimensions import Dimension, Kind
from camtool.inspection.features import (
    BoundDimension,
    CircleFeature,
    DistanceEnd,
    EdgeFeature,
    Feature,
)
from camtool.inspection.sizes import (
    MachinedSize,
    SweptSegments,
    cut_of,
    edge_at,
    envelope,
    minimise,
    rows_of,
    size_of,
    stations_of,
)
from tests.strategies import examples

WHOLE = np.array([[0.0, 2.0 * math.pi]])
HOLE = CircleFeature(0, (1.0, 2.0), 3.0, WHOLE)
EDGE = EdgeFeature(0, (0.0, 0.0), (8.0, 6.0))


def swept(points: Floats, radius: float, row: int = 0, z: float = -1.0) -> SweptSegments:
    count = len(points) - 1
    return SweptSegments(
        points[:-1], points[1:], np.full(count, radius), np.full(count, z), np.full(count, row)
    )


def joined(*paths: SweptSegments) -> SweptSegments:
    names = ("a", "b", "radius", "z", "row")
    return SweptSegments(
        *(np.concatenate([getattr(each, name) for each in paths]) for name in names)
    )


def ring(centre: tuple[float, float], radius: float, count: int = 2000) -> Floats:
    angle = np.linspace(0.0, 2.0 * math.pi, count + 1)
    return np.asarray(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def cleared(feature: Feature, side: int, path: SweptSegments) -> Floats:
    """(S,) where the normal of each station enters what the tool clears, by shapely."""
    lines = shapely.linestrings(np.stack([path.a, path.b], axis=1))
    region = shapely.union_all(shapely.buffer(lines, path.radius[0], quad_segs=256))
    stations = stations_of(feature, side)
    found = []
    for place, normal in zip(stations.places, stations.normals, strict=True):
        ray = shapely.LineString([place - normal, place + 5.0 * normal])
        hit = shapely.intersection(ray, region)
        points = shapely.get_coordinates(hit)
        found.append(((points - place) @ normal).min() if len(points) else math.inf)
    return np.array(found)


@examples(25)
@given(
    feature=st.sampled_from([HOLE, EDGE]),
    side=st.sampled_from([1, -1]),
    radius=st.floats(0.3, 1.5),
    wobble=st.floats(0.0, 0.4),
    seed=st.integers(0, 10_000),
)
def test_envelopes_are_the_edge_of_what_the_tool_clears(
    feature: Feature, side: int, radius: float, wobble: float, seed: int
) -> None:
    random = np.random.default_rng(seed)
    if isinstance(feature, CircleFeature):
        points = ring(feature.centre_mm, feature.radius_mm + side * radius, 90)
    else:
        at = np.linspace(0.0, 1.0, 40)[:, None]
        left = side * np.array([-feature.along[1], feature.along[0]])
        points = np.asarray(feature.start_mm) + at * 10.0 * feature.along + radius * left
    path = swept(points + random.uniform(-wobble, wobble, points.shape), radius)
    stations = stations_of(feature, side)
    mine = envelope(feature, stations, path, stations.measured[None])[0]
    theirs = cleared(feature, side, path)
    reached = np.isfinite(theirs)
    assert (np.isfinite(mine) == reached).all()
    # A chord of a disc of shapely lies up to r (1 − cos(π/1024)) inside of it; where the normal
    # only touches a disc, a little off is a lot.
    assert mine[reached] == pytest.approx(theirs[reached], abs=2e-3)
    assert np.median(np.abs(mine[reached] - theirs[reached])) < 1e-5


@examples(25)
@given(feature=st.sampled_from([HOLE, EDGE]), seed=st.integers(0, 10_000))
def test_at_each_depth_the_moves_count_that_reach_it(feature: Feature, seed: int) -> None:
    random = np.random.default_rng(seed)
    if isinstance(feature, CircleFeature):
        points = ring(feature.centre_mm, feature.radius_mm - 1.0, 60)
    else:
        left = np.array([-feature.along[1], feature.along[0]])
        points = feature.start_mm + np.linspace(0.0, 10.0, 40)[:, None] * feature.along + left
    passes = [
        swept(points + random.uniform(-0.1, 0.1, points.shape), 1.0, row, -random.integers(1, 5))
        for row in range(6)
    ]
    path = joined(*passes)
    path = path.of(random.uniform(size=len(path.a)) < 0.8)
    stations = stations_of(feature, -1 if isinstance(feature, CircleFeature) else 1)
    levels = np.array([math.inf, -2.0, -3.0, -3.5, -4.0])
    asked = random.uniform(size=(5, len(stations.places))) < 0.9
    found = envelope(feature, stations, path, asked, levels_mm=levels)
    for level, here, each in zip(levels, asked, found, strict=True):
        alone = envelope(feature, stations, path.of(path.z <= level), here[None])[0]
        assert each == pytest.approx(alone, abs=1e-12)


def test_sizes_of_all_depths_count() -> None:
    """Three passes about other centres, each as wide as it must be to be seen at its own depth
    alone: the middle one shows neither at the surface nor at the bottom."""
    wanted, slides = [], []
    for row, (z, grown, shift) in enumerate([(-1, 0.2, 0.0), (-2, 0.1, 0.04), (-3, 0.0, 0.0)]):
        wanted.append(swept(ring(HOLE.centre_mm, 2.0), 1.0, row, z))
        centre = HOLE.centre_mm[0] + shift, HOLE.centre_mm[1]
        slides.append(swept(ring(centre, 2.0 + grown), 1.0, row, z))
    cut = cut_of(HOLE, joined(*wanted))
    assert cut is not None
    assert cut.levels_mm.tolist() == [math.inf, -2.0, -3.0]
    lies = edge_at(HOLE, cut, rows_of(joined(*slides), cut, HOLE))

    def size(kind: Kind) -> MachinedSize:
        bound = BoundDimension(Dimension("d", kind, (), "test"), (HOLE,), (), np.zeros(2), 6.0)
        found = size_of(bound, [cut], [lies])
        assert found is not None
        return found

    assert size("position").high_mm == pytest.approx(0.08, abs=1e-4)
    assert size("position").fit_mm == pytest.approx(0.0, abs=1e-4)
    assert size("diameter").high_mm == pytest.approx(6.4, abs=1e-4)
    assert size("diameter").low_mm == pytest.approx(6.0, abs=1e-4)


def test_the_end_of_a_ramp_is_no_depth_of_its_own() -> None:
    """A helix of one turn for each millimetre, in twelve arcs each, and a last turn at depth."""
    turn = ring(HOLE.centre_mm, 2.0, 720)
    arcs = [swept(turn[60 * (k % 12) : 60 * (k % 12) + 61], 1.0, k, -k / 12.0) for k in range(36)]
    cut = cut_of(HOLE, joined(*arcs, swept(turn, 1.0, 36, -3.0)))
    assert cut is not None
    assert cut.levels_mm[-1] == -3.0
    assert (cut.seen.sum(axis=1) >= 0.5 * cut.seen[0].sum()).all()
    open_end = cut_of(HOLE, joined(*arcs))
    assert open_end is not None
    # Below −2.5 less than half of the circle is cut.
    assert -2.6 < open_end.levels_mm[-1] < -2.4


def test_many_depths_are_thinned_out_but_for_the_last() -> None:
    turn = ring(HOLE.centre_mm, 2.0, 90)
    cut = cut_of(HOLE, joined(*(swept(turn, 1.0, k, -0.01 * k) for k in range(1, 500))))
    assert cut is not None
    assert len(cut.levels_mm) == 200
    assert cut.levels_mm[-1] == pytest.approx(-4.99)


@pytest.mark.parametrize("tip", [0.0, 0.1, 0.5])
def test_what_tapers_is_no_wall(tip: float) -> None:
    """A chamfer, its tip so far behind the wall, whose radius is that at the surface."""
    wall = swept(ring(HOLE.centre_mm, 2.0), 1.0, 0, -3.0)
    chamfer = swept(ring(HOLE.centre_mm, 3.0 - tip), 0.5 + tip, 1, math.inf)
    cut = cut_of(HOLE, joined(wall, chamfer))
    assert cut is not None
    assert cut.rows.tolist() == [0]
    assert not cut.on_path
    alone = cut_of(HOLE, chamfer)
    assert (alone is None) == (tip > 0.0)  # along the circle it is a groove
    sign = cut_of(HOLE, swept(ring(HOLE.centre_mm, 2.4), 0.6, 1, math.inf))
    assert sign is not None
    assert sign.levels_mm.tolist() == [math.inf]


def measured(
    kind: Kind, feature: CircleFeature | EdgeFeature, wanted: SweptSegments, slides: SweptSegments
) -> float:
    cut = cut_of(feature, wanted)
    assert cut is not None
    bound = BoundDimension(Dimension("d", kind, (), "test"), (feature,), (), np.zeros(2), 0.0)
    size = size_of(bound, [cut], [edge_at(feature, cut, rows_of(slides, cut, feature))])
    assert size is not None
    return size.fit_mm


@examples(30)
@given(
    tool=st.floats(0.2, 1.4),
    grown=st.floats(-0.1, 0.1),
    shift=st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05)),
    inside=st.booleans(),
)
def test_circles_that_are_cut_too_large_and_elsewhere(
    tool: float, grown: float, shift: tuple[float, float], inside: bool
) -> None:
    path = HOLE.radius_mm - tool if inside else HOLE.radius_mm + tool
    wanted = swept(ring(HOLE.centre_mm, path), tool)
    centre = HOLE.centre_mm[0] + shift[0], HOLE.centre_mm[1] + shift[1]
    slides = swept(ring(centre, path + grown), tool)
    radius = HOLE.radius_mm + grown
    assert measured("diameter", HOLE, wanted, slides) == pytest.approx(2.0 * radius, abs=2e-5)
    assert measured("radius", HOLE, wanted, slides) == pytest.approx(radius, abs=1e-5)
    assert measured("roundness", HOLE, wanted, slides) == pytest.approx(0.0, abs=2e-5)
    off = 2.0 * math.hypot(*shift)
    assert measured("position", HOLE, wanted, slides) == pytest.approx(off, abs=2e-5)
    # A wider tool takes more from the hole's wall, and from the boss.
    wide = measured("diameter", HOLE, wanted, slides.wider(0.01))
    assert wide - 2.0 * radius == pytest.approx(0.02 if inside else -0.02, abs=4e-5)


def test_two_point_sizes_of_an_oval_hole() -> None:
    wanted = swept(ring(HOLE.centre_mm, 2.0), 1.0)
    oval = (ring((0.0, 0.0), 2.0) * (1.02, 0.99)) + HOLE.centre_mm
    cut = cut_of(HOLE, wanted)
    assert cut is not None
    bound = BoundDimension(Dimension("d", "diameter", (), "test"), (HOLE,), (), np.zeros(2), 6.0)
    size = size_of(bound, [cut], [edge_at(HOLE, cut, rows_of(swept(oval, 1.0), cut, HOLE))])
    assert size is not None
    assert size.high_mm == pytest.approx(6.08, abs=1e-3)
    assert size.low_mm == pytest.approx(5.96, abs=1e-3)
    # The deviations are 0.01 + 0.03 cos 2t mm of the radius, which no circle follows.
    assert measured("roundness", HOLE, wanted, swept(oval, 1.0)) == pytest.approx(0.06, abs=1e-3)


def test_the_path_itself_where_the_tool_runs_along_it() -> None:
    wanted = swept(ring(HOLE.centre_mm, 3.0), 0.5)
    slides = swept(ring(HOLE.centre_mm, 3.02), 0.5)
    assert measured("diameter", HOLE, wanted, slides) == pytest.approx(6.04, abs=1e-5)


def test_what_nothing_cuts_has_no_cut() -> None:
    assert cut_of(HOLE, swept(ring((50.0, 50.0), 2.0), 1.0)) is None


def test_widths_between_edges_that_move_apart() -> None:
    left, right = EdgeFeature(0, (0, 0), (0, 10)), EdgeFeature(0, (6, 10), (6, 0))
    paths = [np.array([(1.0, -3.0), (1.0, 13.0)]), np.array([(5.0, 13.0), (5.0, -3.0)])]
    slides = [np.array([(0.9, -3.0), (0.98, 13.0)]), np.array([(5.05, 13.0), (5.05, -3.0)])]
    cuts, lies = [], []
    for row, (feature, path, slide) in enumerate(zip((left, right), paths, slides, strict=True)):
        cut = cut_of(feature, swept(path, 1.0, row))
        assert cut is not None
        cuts.append(cut)
        lies.append(edge_at(feature, cut, rows_of(swept(slide, 1.0, row), cut, feature)))
    bound = BoundDimension(
        Dimension("d", "distance", (), "test"),
        (),
        (DistanceEnd(left, "edge"), DistanceEnd(right, "edge")),
        np.array([1.0, 0.0]),
        6.0,
    )
    size = size_of(bound, cuts, lies)
    assert size is not None
    # The left edge runs from x = −0.085 to −0.035 between y 0 and 10; the right one is at 6.05.
    assert size.fit_mm == pytest.approx(6.11, abs=1e-3)
    assert (size.low_mm, size.high_mm) == pytest.approx((6.085, 6.135), abs=1e-3)


@given(seed=st.integers(0, 100_000), count=st.integers(3, 60), unknowns=st.integers(1, 3))
def test_narrowest_zones_by_a_linear_programme(seed: int, count: int, unknowns: int) -> None:
    random = np.random.default_rng(seed)
    table = random.uniform(-1.0, 1.0, (count, unknowns))
    off = random.uniform(-0.1, 0.1, count)
    ones = np.ones((count, 1))
    rows = np.vstack([np.hstack([table, ones]), np.hstack([-table, ones])])
    bounds = np.concatenate([off, -off])
    goal = np.append(np.zeros(unknowns), 1.0)
    mine = minimise(goal, rows, bounds)
    theirs = linprog(goal, A_ub=-rows, b_ub=-bounds, bounds=(None, None))
    assert (rows @ mine >= bounds - 1e-9).all()
    assert mine[-1] == pytest.approx(theirs.fun, abs=1e-9)
