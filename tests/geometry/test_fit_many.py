"""Fits of many random curves against dense samples, and their number of arcs against optima."""

from __future__ import annotations

import math

import numpy as np
import pytest

from camtool.errors import GeometryError
from camtool.geometry.curves import BezierCurve, EllipseCurve, FunctionCurve, SplineCurve
from camtool.geometry.fit import MIN_STEPS, curve_nodes, fit_curve
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.kernels.fits import (
    MAX_RADIUS_MM,
    MEASURE_STEPS,
    SINGLE_TURN_RAD,
    evaluate,
    samples_between,
    speed,
)
from tests.oracles import arcs
from tests.oracles.curves import dense_parameters, fewest_arcs, fewest_chords, sharp_points

pytestmark = pytest.mark.checked

TOLERANCE_MM = 0.0005
JOINT_ANGLE_RAD = 1e-3
KINDS = ("cubic", "skinny", "cusp", "spline", "ellipse", "odd")


def cusped(rng):
    """A cubic whose derivative vanishes inside: its hodograph is solved for the last point."""
    control, t = rng.uniform(-5.0, 5.0, (4, 2)), rng.uniform(0.1, 0.9)
    one, two = np.diff(control, axis=0)[:2]
    control[3] = control[2] - ((1.0 - t) ** 2 * one + 2.0 * t * (1.0 - t) * two) / t**2
    return control + rng.normal(size=(4, 2)) * 10.0 ** rng.uniform(-12.0, -2.0)


def spline(rng):
    degree = int(rng.integers(2, 6))
    count = degree + 1 + int(rng.integers(0, 7))
    inner = np.sort(rng.choice(rng.uniform(0.05, 0.95, 5), count - degree - 1))
    values, repeats = np.unique(inner, return_counts=True)
    inner = np.repeat(values, np.minimum(repeats, degree))
    count = degree + 1 + len(inner)
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    return SplineCurve(
        degree, knots, rng.uniform(-5.0, 5.0, (count, 2)), rng.uniform(0.2, 5.0, count)
    )


def ellipse(rng):
    size, ratio, turn = rng.uniform(0.01, 20.0), 10.0 ** rng.uniform(-3.5, 0.0), rng.uniform(0, 6)
    major = size * np.array([math.cos(turn), math.sin(turn)])
    minor = ratio * np.array([-major[1], major[0]])
    return EllipseCurve(rng.uniform(-5, 5, 2), major, minor, *rng.uniform(-6.0, 6.0, 2))


def random_curve(rng, kind):
    if kind == "spline":
        return spline(rng)
    if kind == "ellipse":
        return ellipse(rng)
    control = cusped(rng) if kind == "cusp" else rng.uniform(-5.0, 5.0, (4, 2))
    if kind == "skinny":
        control[:, 1] *= 10.0 ** rng.uniform(-7.0, -1.0)
    if kind == "odd":
        for here, there in [((1, 0),), ((2, 3), (1, 0)), ((3, 0),), ((2, 1),)][
            int(rng.integers(4))
        ]:
            control[here] = control[there]
    return BezierCurve(control)


def deviation(curve, fit, count=250):
    size = max(np.ptp(fit.vertices[:, :2], axis=0).max(), 1e-6)
    t = dense_parameters(curve, count, size / 250.0)
    return arcs.chain_distances(curve.point(t), fit.vertices).max()


def kinks_away_from_corners(curve, fit, tolerance):
    nodes = curve_nodes(curve, tolerance, MIN_STEPS)
    tips = sharp_points(curve, dense_parameters(curve, 250, np.inf), 1e-5)
    sharp = np.concatenate([nodes.point[nodes.corner], tips])
    inner = fit.vertices[1:-1, :2]
    gaps = np.abs(inner[:, None, :] - sharp[None]).max(axis=2).min(axis=1)
    chords = np.hypot(*np.diff(fit.vertices[:, :2], axis=0).T)
    # A vertex is given to POSITION_EPS_MM; over a chord this short that is an angle to see.
    long = np.minimum(chords[:-1], chords[1:]) > 3.0 * POSITION_EPS_MM / JOINT_ANGLE_RAD
    return arcs.kinks(fit.vertices)[(gaps > 1e-5) & long]


def check_many(seed, count):
    rng = np.random.default_rng(seed)
    for index in range(count):
        kind = KINDS[index % len(KINDS)]
        curve = random_curve(rng, kind)
        tolerance = TOLERANCE_MM if index % 4 else float(10.0 ** rng.uniform(-4.0, -1.0))
        fit = fit_curve(curve, tolerance)
        if len(fit.vertices) == 1:
            continue
        where = f"seed {seed}, curve {index}, {kind}, {tolerance} mm: {curve}"
        off = deviation(curve, fit)
        assert off <= tolerance, where
        assert off <= fit.max_mm * 1.01 + POSITION_EPS_MM, where
        kinks = kinks_away_from_corners(curve, fit, tolerance)
        kinks = kinks[kinks < math.pi - JOINT_ANGLE_RAD]  # straight curves may fold back
        assert kinks.max(initial=0.0) <= JOINT_ANGLE_RAD, where
        check_radii(fit.vertices)


def check_radii(vertices):
    """No arc is flatter than MAX_RADIUS_MM."""
    chord = np.hypot(*np.diff(vertices[:, :2], axis=0).T)
    bulge = np.abs(vertices[:-1, 2])
    assert (chord[bulge > 0.0] <= 4.0 * bulge[bulge > 0.0] * MAX_RADIUS_MM).all()


def test_many_curves_are_within_the_tolerance_and_smooth():
    check_many(0, 180)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 9))
def test_two_thousand_curves_are_within_the_tolerance_and_smooth(seed):
    check_many(seed, 250)


def share_of_fewest(seed, count, tolerance):
    """Arcs of all fits over the fewest, and the same of each curve that needs ten or more."""
    rng = np.random.default_rng(seed)
    ours, fewest = [], []
    for index in range(count):
        curve = random_curve(rng, KINDS[index % len(KINDS)])
        nodes = curve_nodes(curve, tolerance / 8.0, MIN_STEPS)
        if not 3 <= len(nodes) <= 400:
            continue
        limits = (tolerance, SINGLE_TURN_RAD)
        columns = (nodes.point, nodes.arrive, nodes.leave, nodes.corner)
        fewest.append(fewest_arcs(*columns, *limits))
        ours.append(len(fit_curve(curve, tolerance).vertices) - 1)
    assert len(ours) > count // 2
    above = [a / b for a, b in zip(ours, fewest, strict=True) if b >= 10]
    return sum(ours) / sum(fewest), np.array(above)


def test_few_arcs_are_used():
    total, shares = share_of_fewest(3, 8, 0.005)
    assert total <= 1.15
    assert shares.max() <= 1.3


@pytest.mark.slow
def test_few_arcs_are_used_on_more_curves():
    for seed in range(4, 8):
        total, shares = share_of_fewest(seed, 40, 0.005)
        assert total <= 1.15
        # A fit may be done again with less of the tolerance: then a few arcs more are used.
        assert np.quantile(shares, 0.9) <= 1.3
        assert shares.max() <= 1.5


def test_the_fewest_arcs_of_shapes_that_are_known():
    angle = np.linspace(0.0, math.pi, 41)
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    tangent = np.column_stack([-points[:, 1], points[:, 0]])
    ends = np.zeros(41, dtype=bool)
    ends[[0, -1]] = True
    assert fewest_arcs(points, tangent, tangent, ends, 1e-6, 0.0) == 1
    assert fewest_chords(points, 1.0 - math.cos(math.pi / 40.0) + 1e-9) == 20


def glyph_curves(count, seed=1):
    rng = np.random.default_rng(seed)
    return [
        BezierCurve(rng.uniform(0.0, 1.0, (3, 2)) * rng.uniform(5.0, 50.0)) for _ in range(count)
    ]


def test_arcs_are_far_fewer_than_chords():
    """The gain grows with the sixth root of size over tolerance only: arcs need their third root,
    chords their square root."""
    curves = glyph_curves(6)
    for tolerance, least in ((5e-4, 3.2), (5e-6, 6.5)):
        made = sum(
            len(fit.vertices) - 1 for fit in (fit_curve(curve, tolerance) for curve in curves)
        )
        chords = 0
        for curve in curves:
            t = np.linspace(0.0, 1.0, 60_000)
            chords += fewest_chords(curve.point(t), tolerance)
        assert chords / made >= least


@pytest.mark.parametrize("kind", KINDS)
def test_the_kernel_agrees_with_the_path_for_any_curve(kind):
    rng = np.random.default_rng(11)
    for _ in range(8):
        curve = random_curve(rng, kind)
        fast = fit_curve(curve, TOLERANCE_MM)
        slow = fit_curve(
            FunctionCurve(curve.point, curve.tangent, np.asarray(curve.breaks)), TOLERANCE_MM
        )
        assert fast.length_mm == pytest.approx(slow.length_mm, rel=1e-3, abs=1e-6)
        assert slow.max_mm <= TOLERANCE_MM
        assert len(fast.vertices) <= 1.2 * len(slow.vertices) + 2
        assert len(slow.vertices) <= 1.2 * len(fast.vertices) + 2


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_pieces_are_the_curve(degree):
    rng = np.random.default_rng(degree)
    knots = np.cumsum(rng.uniform(0.2, 1.0, 10 + degree))
    if degree > 1:
        knots[degree + 2] = knots[degree + 1]
    curve = SplineCurve(
        degree, knots, rng.uniform(-5.0, 5.0, (9, 2)) + 100.0, rng.uniform(0.2, 4.0, 9)
    )
    made, breaks = curve.pieces(), curve.breaks
    t = np.linspace(0.0, len(made.control), 301)
    piece = np.minimum(t.astype(int), len(breaks) - 2)
    width = np.diff(breaks)[piece]
    there = breaks[piece] + (t - piece) * width
    points = samples_between(made.control, t)[::MEASURE_STEPS]
    assert points + made.origin == pytest.approx(curve.point(there), abs=1e-12)
    slope = [evaluate(made.control, int(k), u)[2:] for k, u in zip(piece, t - piece, strict=True)]
    assert np.array(slope) / width[:, None] == pytest.approx(curve.tangent(there), rel=1e-9)
    assert speed(made.control, 0, 0.5) == pytest.approx(
        math.hypot(*evaluate(made.control, 0, 0.5)[2:])
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("change", ["reversed", "rotated", "mirrored", "scaled", "moved"])
def test_changed_curves_need_as_many_arcs(kind, change):
    rng = np.random.default_rng(5)
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])
    factor = 8.0 if change == "scaled" else 1.0
    for _ in range(6):
        curve = random_curve(rng, kind)
        rows = curve.pieces()
        points = rows.control[0, :, :2] / rows.control[0, :, 2:]
        if points.shape[0] not in (3, 4):
            continue
        other = {
            "reversed": points[::-1],
            "rotated": points @ turn,
            "mirrored": points * [1.0, -1.0],
            "scaled": factor * points,
            "moved": points + np.array([1000.0, -500.0]),
        }[change]
        one = fit_curve(BezierCurve(points), TOLERANCE_MM)
        two = fit_curve(BezierCurve(other), factor * TOLERANCE_MM)
        assert abs(len(one.vertices) - len(two.vertices)) <= 4 + len(one.vertices) // 8
        assert one.length_mm * factor == pytest.approx(two.length_mm, rel=1e-3, abs=1e-6)
        assert two.max_mm <= factor * TOLERANCE_MM


QUARTER = 0.5522847498307936


@pytest.mark.parametrize("decimals", [3, 4, 15])
def test_a_circle_of_four_beziers_in_one_spline_is_two_arcs(decimals):
    k = QUARTER
    x = [1, 1, k, 0, -k, -1, -1, -1, -k, 0, k, 1, 1]
    y = [0, k, 1, 1, 1, k, 0, -k, -1, -1, -1, -k, 0]
    control = np.round(np.column_stack([x, y]), decimals)
    knots = np.concatenate([[0], np.repeat([0.0, 1, 2, 3, 4], 3), [4]])
    fit = fit_curve(SplineCurve(3, knots, control), TOLERANCE_MM)
    assert len(fit.vertices) == 3
    assert np.abs(fit.vertices[:2, 2]) == pytest.approx(1.0, abs=1e-3)


def test_a_rational_arc_is_one_arc():
    half = math.radians(50.0)
    control = np.array([[math.cos(half), -math.sin(half)], [1.0 / math.cos(half), 0.0], [0, 0]])
    control[2] = control[0] * [1.0, -1.0]
    weights = np.array([1.0, math.cos(half), 1.0])
    curve = SplineCurve(2, np.array([0, 0, 0, 1, 1, 1.0]), 40.0 * control, weights)
    fit = fit_curve(curve, TOLERANCE_MM)
    assert fit.vertices[:, 2] == pytest.approx([math.tan(0.5 * half), 0.0], abs=1e-12)
    assert fit.max_mm < 1e-9


@pytest.mark.parametrize("rise", [1e-5, 1e-4, 2.5e-4, 1e-3])
def test_almost_straight_curves_become_lines_not_arcs_of_kilometres(rise):
    fit = fit_curve(BezierCurve(np.array([[0, 0], [50.0, 2.0 * rise], [100, 0]])), TOLERANCE_MM)
    check_radii(fit.vertices)
    assert not fit.vertices[:, 2].any()
    assert fit.max_mm <= TOLERANCE_MM
    if rise <= TOLERANCE_MM / 2.0:
        assert len(fit.vertices) == 2


def test_a_spline_that_falls_apart_is_refused():
    control = np.array([[0, 0], [1, 1], [2, 0], [5, 5], [6, 6], [7, 5.0]])
    knots = np.array([0, 0, 0, 1, 1, 1, 2, 2, 2.0])
    with pytest.raises(GeometryError):
        SplineCurve(2, knots, control)
    control[3] = control[2]
    assert fit_curve(SplineCurve(2, knots, control), TOLERANCE_MM).max_mm <= TOLERANCE_MM


def test_numbers_too_large_are_an_error():
    with pytest.raises(GeometryError):
        fit_curve(BezierCurve(np.array([[0, 0], [1e308, 1e308], [-1e308, 1e308]])), 0.001)
