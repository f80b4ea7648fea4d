"""Fitted chains of arcs against dense samples of the true curves."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st

from camtool.errors import GeometryError
from camtool.geometry.curves import BezierCurve, EllipseCurve, FunctionCurve, SplineCurve
from camtool.geometry.fit import MIN_STEPS, arc_vertices, curve_nodes, fit_curve, fit_path
from camtool.geometry.measure import sample
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines
from camtool.records import replace
from tests.drawings import drawing_of
from tests.oracles import arcs

TOLERANCE_MM = 0.0005
JOINT_ANGLE_RAD = 1e-3
"""A joint that is no corner turns by less (a line for an arc flatter than 1e-7 mm turns a bit)."""

coordinate = st.floats(-5.0, 5.0, allow_subnormal=False)
controls = st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=4)


def _check(curve, fit, tolerance):
    """Measured independently: both directions, ends, bulges."""
    t = np.linspace(curve.breaks[0], curve.breaks[-1], 1237)
    true = curve.point(t)
    off = arcs.chain_distances(true, fit.vertices)
    assert off.max() <= tolerance * (1.0 + 1e-3) + POSITION_EPS_MM
    assert off.max() <= fit.max_mm * (1.0 + 1e-3) + POSITION_EPS_MM
    fine = shapely.LineString(curve.point(np.linspace(curve.breaks[0], curve.breaks[-1], 10007)))
    back = shapely.distance(shapely.points(arcs.chain_points(fit.vertices, 7)), fine)
    assert back.max() <= 2.0 * tolerance + 1e-6
    assert np.abs(fit.vertices[:, 2]).max() <= 1.0
    assert np.allclose(fit.vertices[0, :2], true[0], atol=1e-12)
    assert np.allclose(fit.vertices[-1, :2], true[-1], atol=1e-12)
    assert fit.rms_mm <= fit.max_mm


def _smooth(fit, curve, tips=()):
    """All joints away from the curve's own corners, and from its `tips`, turn by nothing."""
    nodes = curve_nodes(curve, TOLERANCE_MM, MIN_STEPS)
    sharp = np.array([*nodes.point[nodes.corner], *tips])
    inner = fit.vertices[1:-1, :2]
    away = np.array([np.hypot(*(sharp - p).T).min() > 1e-5 for p in inner], dtype=bool)
    chords = np.hypot(*np.diff(fit.vertices[:, :2], axis=0).T)
    long = np.minimum(chords[:-1], chords[1:]) > 1e-3
    turned = arcs.kinks(fit.vertices)[away & long]
    # A straight curve may fold back; a fold that it has not would be off by more than _check lets.
    turned = turned[turned < math.pi - JOINT_ANGLE_RAD]
    assert turned.max(initial=0.0) <= JOINT_ANGLE_RAD


@given(controls)
@example([(2.0, 2.0), (2.0, 1.6875), (2.0, 0.0), (2.0, 2.0)])  # folds back on itself
def test_random_beziers(control):
    curve = BezierCurve(np.array(control))
    fit = fit_curve(curve, TOLERANCE_MM)
    assume(len(fit.vertices) > 1)
    _check(curve, fit, TOLERANCE_MM)
    _smooth(fit, curve)


@given(
    st.floats(0.01, 20.0),
    st.floats(0.001, 1.0),
    st.floats(-4.0, 4.0),
    st.floats(-7.0, 7.0),
    st.floats(-6.28, 6.28),
)
# Found before: an arc shorter than two positions are apart, and a tip too sharp for its measure.
@example(0.01171875, 0.0078125, 0.0, 0.0, 0.0078125)
@example(0.5, 0.001, 0.0, 0.0, 1.0)
@example(0.01, 0.001, 0.0, 2.0, 2.0)
def test_random_ellipses(size, ratio, turn, start, sweep):
    assume(abs(sweep) > 1e-3)
    major = size * np.array([math.cos(turn), math.sin(turn)])
    minor = ratio * np.array([-major[1], major[0]])
    curve = EllipseCurve(np.array([3.0, -2.0]), major, minor, start, start + sweep)
    fit = fit_curve(curve, TOLERANCE_MM)
    if len(fit.vertices) == 1:
        points = curve.point(np.linspace(start, start + sweep, 99))
        assert np.hypot(*(points - fit.vertices[0, :2]).T).max() <= POSITION_EPS_MM
        return
    _check(curve, fit, TOLERANCE_MM)
    # Tips rounder than two positions are apart are corners to all that measures.
    pointed = size * ratio**2 < POSITION_EPS_MM
    _smooth(fit, curve, curve.centre + np.array([major, -major]) if pointed else ())


def test_an_ellipse_of_ten_to_one_needs_few_arcs():
    curve = EllipseCurve(np.zeros(2), np.array([2.0, 0.0]), np.array([0.0, 0.2]))
    fit = fit_curve(curve, TOLERANCE_MM)
    _check(curve, fit, TOLERANCE_MM)
    assert len(fit.vertices) - 1 <= 44
    assert fit.max_mm > 0.5 * TOLERANCE_MM  # nothing of the tolerance is given away
    path = Polyline(fit.vertices[:-1], closed=True)
    assert len(path) == len(fit.vertices) - 1


@pytest.mark.parametrize("start", [0.0, 1.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_an_ellipse_of_equal_axes_is_two_half_circles(start, way):
    major, minor = np.array([2.0, 1.0]), np.array([-1.0, 2.0])
    fit = fit_curve(
        EllipseCurve(np.ones(2), major, minor, start, start + way * 2.0 * math.pi), TOLERANCE_MM
    )
    assert fit.vertices[:, 2] == pytest.approx([way, way, 0.0], abs=1e-12)
    assert fit.max_mm < 1e-12


def test_a_quarter_circle_as_bezier_is_one_arc():
    k = 0.5522847498307936  # 4/3 (√2 − 1), largest error 2.7e-4 of the radius
    fit = fit_curve(BezierCurve(np.array([[1, 0], [1, k], [k, 1], [0, 1.0]])), TOLERANCE_MM)
    assert fit.vertices[:, 2] == pytest.approx([math.tan(math.pi / 8.0), 0.0])
    assert fit.max_mm == pytest.approx(2.725e-4, rel=1e-3)


STRAIGHT = [
    [[0, 0], [1, 1], [2, 2], [3, 3]],
    [[0, 0], [0, 0], [3, 3], [3, 3]],
    [[0, 0], [0, 0], [0, 0], [3, 3]],
    [[0, 0], [2.5, 2.5], [2.6, 2.6], [3, 3]],
    [[0, 0], [1.5, 1.5], [3, 3]],
]


@pytest.mark.parametrize("control", STRAIGHT)
def test_a_straight_bezier_is_one_line(control):
    fit = fit_curve(BezierCurve(np.array(control, dtype=float)), TOLERANCE_MM)
    assert fit.vertices.tolist() == [[0.0, 0.0, 0.0], [3.0, 3.0, 0.0]]
    assert fit.max_mm < 1e-12


def test_a_straight_bezier_that_turns_back_keeps_its_overshoot():
    curve = BezierCurve(np.array([[0, 0], [6, 6], [-3, -3], [3, 3.0]]))
    fit = fit_curve(curve, TOLERANCE_MM)
    assert len(fit.vertices) == 4
    assert not fit.vertices[:, 2].any()
    furthest = curve.point(np.linspace(0.0, 1.0, 100001)).max()
    assert fit.vertices[:, 0].max() == pytest.approx(furthest, abs=1e-6)


def test_a_point_is_one_vertex():
    fit = fit_curve(BezierCurve(np.full((4, 2), 7.0)), TOLERANCE_MM)
    assert fit.vertices.tolist() == [[7.0, 7.0, 0.0]]
    assert fit.max_mm == 0.0


ODD = {
    "cusp": [[0, 0], [1, 1], [0, 1], [1, 0]],
    "near cusp": [[0, 0], [1.0001, 1], [0, 1], [1, 0]],
    "loop": [[0, 0], [3, 1], [-2, 1], [1, 0]],
    "inflexion": [[0, 0], [3, 0], [0, 1], [3, 1]],
    "zero handle": [[0, 0], [0, 0], [1, 2], [3, 0]],
    "zero handle at the end": [[0, 0], [1, 2], [3, 0], [3, 0]],
    "two zero handles at one end": [[0, 0], [0, 0], [0, 0], [3, 1]],
    "tiny handle across": [[0, 0], [0, 1e-5], [3, 1], [3, 0]],
    "closed": [[0, 0], [3, 2], [-3, 2], [0, 0]],
    "almost straight": [[0, 0], [1, 1e-6], [2, -1e-6], [3, 0]],
    "almost a point": [[0, 0], [1e-6, 2e-6], [3e-6, 0], [4e-6, 1e-6]],
}


@pytest.mark.parametrize("name", ODD)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_odd_beziers(name, scale):
    curve = BezierCurve(scale * np.array(ODD[name], dtype=float))
    fit = fit_curve(curve, TOLERANCE_MM)
    if len(fit.vertices) == 1:
        assert np.ptp(curve.control, axis=0).max() < 1e-5
        return
    _check(curve, fit, TOLERANCE_MM)
    _smooth(fit, curve)


def test_a_cusp_is_kept_as_a_corner():
    curve = BezierCurve(np.array([[0, 0], [1, 1], [0, 1], [1, 0.0]]))
    fit = fit_curve(curve, TOLERANCE_MM)
    sharp = int(np.argmax(arcs.kinks(fit.vertices))) + 1
    assert arcs.kinks(fit.vertices)[sharp - 1] == pytest.approx(math.pi, abs=3e-3)
    assert fit.vertices[sharp, :2] == pytest.approx([0.5, 0.75], abs=2e-6)


def test_reversing_a_curve_changes_neither_its_error_nor_its_arcs_much():
    control = np.array([[0, 0], [3, 1], [-2, 1], [1, 0.0]])
    there = fit_curve(BezierCurve(control), TOLERANCE_MM)
    back = fit_curve(BezierCurve(control[::-1]), TOLERANCE_MM)
    assert abs(len(there.vertices) - len(back.vertices)) <= 2
    assert there.length_mm == pytest.approx(back.length_mm, rel=1e-4)


@pytest.mark.parametrize("factor", [0.125, 8.0, 1024.0])
def test_scaling_curve_and_tolerance_scales_the_fit(factor):
    control = np.array([[0, 0], [3, 1], [-2, 1.5], [1, 0.0]])
    one = fit_curve(BezierCurve(control), TOLERANCE_MM)
    other = fit_curve(BezierCurve(factor * control), factor * TOLERANCE_MM)
    assert len(other.vertices) == len(one.vertices)
    assert other.vertices[:, :2] == pytest.approx(factor * one.vertices[:, :2], rel=1e-9)
    assert other.vertices[:, 2] == pytest.approx(one.vertices[:, 2], rel=1e-9)
    assert other.max_mm == pytest.approx(factor * one.max_mm, rel=1e-6)


def test_a_finer_tolerance_costs_arcs_with_its_cube_root():
    curve = EllipseCurve(np.zeros(2), np.array([2.0, 0.0]), np.array([0.0, 1.0]))
    counts = [len(fit_curve(curve, tolerance).vertices) for tolerance in (1e-2, 1e-5)]
    assert 5.0 <= counts[1] / counts[0] <= 10.0  # ∛1000 = 10, less the rounding up


def test_a_spiral_of_many_turns():
    curve = FunctionCurve(
        lambda t: np.column_stack([t * np.cos(t), t * np.sin(t)]),
        lambda t: np.column_stack([np.cos(t) - t * np.sin(t), np.sin(t) + t * np.cos(t)]),
        np.array([0.0, 30.0]),
    )
    fit = fit_curve(curve, 0.01)
    _check(curve, fit, 0.01)
    assert len(fit.vertices) < 80


def test_a_corner_at_a_break_stays_sharp_and_a_smooth_break_costs_nothing():
    def corner(t):
        return np.column_stack([t, np.abs(t) * t**2 + np.abs(t)])

    def slope(t):
        return np.column_stack([np.ones_like(t), (3.0 * t**2 + 1.0) * np.sign(t)])

    fit = fit_curve(FunctionCurve(corner, slope, np.array([-1.0, 0.0, 1.0])), TOLERANCE_MM)
    assert [0.0, 0.0] in fit.vertices[:, :2].tolist()
    circle = FunctionCurve(
        lambda t: np.column_stack([np.cos(t), np.sin(t)]),
        lambda t: np.column_stack([-np.sin(t), np.cos(t)]),
        np.linspace(0.0, math.pi, 17),
    )
    assert len(fit_curve(circle, TOLERANCE_MM).vertices) == 2


def test_splines_agree_with_ezdxf():
    from ezdxf.math import BSpline

    rng = np.random.default_rng(7)
    for degree in (1, 2, 3, 5):
        for weights in (None, rng.uniform(0.3, 3.0, 9).tolist()):
            control = rng.uniform(-3.0, 3.0, (9, 2))
            theirs = BSpline(control, order=degree + 1, weights=weights)
            ours = SplineCurve(degree, np.array(theirs.knots()), control, weights)
            t = np.linspace(0.0, theirs.max_t, 50)
            wanted = np.array([list(point)[:2] for point in theirs.points(t)])
            assert ours.point(t) == pytest.approx(wanted, abs=1e-9)
            slopes = np.array([list(row[1])[:2] for row in theirs.derivatives(t[1:-1], 1)])
            assert ours.tangent(t[1:-1]) == pytest.approx(slopes, abs=1e-6)


def test_a_spline_of_degree_one_is_its_polygon():
    control = np.array([[0, 0], [1, 0], [1, 2], [4, 2.0]])
    fit = fit_curve(SplineCurve(1, np.array([0, 0, 1, 2, 3, 3.0]), control), TOLERANCE_MM)
    assert fit.vertices[:, :2] == pytest.approx(control)
    assert not fit.vertices[:, 2].any()


def test_a_spline_with_a_knot_of_full_multiplicity_keeps_its_corner():
    control = np.array([[0, 0], [1, 2], [2, 2], [3, 0], [4, 2], [5, 2], [6, 0.0]])
    knots = np.array([0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2.0])
    curve = SplineCurve(3, knots, control)
    fit = fit_curve(curve, TOLERANCE_MM)
    _check(curve, fit, TOLERANCE_MM)
    corner = np.flatnonzero(np.hypot(*(fit.vertices[:, :2] - [3.0, 0.0]).T) < 1e-9)
    assert len(corner) == 1
    assert arcs.kinks(fit.vertices)[corner[0] - 1] > 1.0


@given(
    st.floats(0.01, 100.0),
    st.floats(-10.0, 10.0),
    st.floats(-2.0 * math.pi, 2.0 * math.pi).filter(lambda sweep: abs(sweep) > 1e-3),
)
def test_arc_vertices_lie_on_their_circle(radius, start, sweep):
    centre = np.array([1.0, -2.0])
    rows = arc_vertices(centre, radius, start, sweep)
    assert np.abs(rows[:, 2]).max() <= 1.0
    assert 4.0 * np.arctan(rows[:, 2]).sum() == pytest.approx(sweep)
    inner = arcs.chain_points(rows, 5) - centre
    assert np.hypot(*inner.T) == pytest.approx(radius, rel=1e-6)
    ends = np.array([start, start + sweep])
    wanted = centre + radius * np.column_stack([np.cos(ends), np.sin(ends)])
    assert rows[[0, -1], :2] == pytest.approx(wanted, rel=1e-9, abs=1e-9)


def test_a_full_circle_ends_exactly_where_it_begins():
    rows = arc_vertices(np.array([0.1, 0.2]), 0.15, 0.3, 2.0 * math.pi)
    assert rows[0, :2].tolist() == rows[-1, :2].tolist()
    assert rows[:, 2] == pytest.approx([1.0, 1.0, 0.0], abs=1e-15)


def test_overall_weighs_by_length():
    small = fit_curve(BezierCurve(np.array([[0, 0], [1, 1], [2, 0.0]])), 0.01)
    large = fit_curve(BezierCurve(np.array([[0, 0], [90, 90], [200, 0.0]])), 0.001)
    paths = Polylines.of([Polyline(small.vertices), Polyline(large.vertices)])
    off = np.concatenate([small.off_mm, large.off_mm])
    both = replace(drawing_of(list(paths)), off_mm=off).fit
    assert both.max_mm == small.max_mm
    assert large.rms_mm < both.rms_mm < 2.0 * large.rms_mm
    assert drawing_of(list(paths)).fit.max_mm == 0.0


@pytest.mark.parametrize("tolerance", [0.0, -1.0, math.nan, math.inf, 1e-9])
def test_a_tolerance_must_be_one(tolerance):
    with pytest.raises(GeometryError):
        fit_curve(BezierCurve(np.zeros((4, 2))), tolerance)


def test_numbers_that_are_no_curve():
    with pytest.raises(GeometryError):
        fit_curve(BezierCurve(np.array([[0, 0], [1, math.nan], [2, 0.0]])), 0.001)
    with pytest.raises(GeometryError):
        BezierCurve(np.zeros((5, 2)))
    for degree, knots, weights in (
        (3, [0, 0, 1, 1], None),
        (1, [0, 0, 1, 1], [1.0, -1.0]),
        (1, [1, 1, 0, 0], None),
        (1, [0, 0, 0, 0], None),
        (2, [0, 0, 1, 1], None),
        (1, [0, 0, 1], None),
    ):
        with pytest.raises(GeometryError):
            SplineCurve(degree, np.array(knots, dtype=float), np.zeros((2, 2)), weights)


@given(
    st.lists(st.tuples(st.floats(0.01, 4.0), st.integers(-300, 300)), min_size=1, max_size=20),
    st.floats(1e-4, 0.05),
)
def test_a_smooth_path_is_fitted_with_no_more_arcs(
    pieces: list[tuple[float, int]], tolerance: float
) -> None:
    """The path is a chain of tangent arcs and lines of these lengths and sweeps, rad / 100."""
    rows, at, heading = [], 0j, 0.0
    for size, hundredths in pieces:
        sweep = 0.01 * hundredths
        chord = size if sweep == 0.0 else 2.0 * size / sweep * math.sin(0.5 * sweep)
        rows.append([at.real, at.imag, math.tan(0.25 * sweep)])
        at += chord * complex(math.cos(heading + 0.5 * sweep), math.sin(heading + 0.5 * sweep))
        heading += sweep
    path = Polyline(np.array([*rows, [at.real, at.imag, 0.0]]))
    fit = fit_path(path, tolerance)
    assert len(fit.vertices) <= len(path.vertices) + 2
    assert np.array_equal(fit.vertices[[0, -1], :2], path.vertices[[0, -1], :2])
    assert arcs.chain_distances(sample(path, 0.01), fit.vertices).max() <= tolerance
    assert arcs.kinks(fit.vertices).max(initial=0.0) <= JOINT_ANGLE_RAD
