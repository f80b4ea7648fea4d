"""Circular errors against closed formulas, and which moves make a full circle."""

import math

import numpy as np
import pytest

from camtool.kernels.judging import ANGLE_BINS, bin_directions, empty_bins
from camtool.toolpath.builder import ToolpathBuilder
from camtool.verification.circles import (
    NO_FIGURES,
    FullCircle,
    circle_figures,
    full_circles,
    least_squares_centre,
)
from camtool.verification.cuts import cut_moves
from tests.oracles.dense_moves import circle, cut
from tests.oracles.kernel_doors import fill_bins_

GAP_MM = 0.005
RADIUS = 1.5
UNIT = FullCircle((2.0, 1.0), RADIUS, True, -0.02, 0, 0)


def ring(count: int, turns: float = 1.0) -> np.ndarray:
    angle = np.linspace(0.0, turns * 2.0 * math.pi, count, endpoint=False)
    return np.column_stack([2.0 + RADIUS * np.cos(angle), 1.0 + RADIUS * np.sin(angle)])


def figures(points: np.ndarray, parts: int = 1):
    bins = empty_bins(1)[0]
    for part in np.array_split(points, parts):
        x, y = np.ascontiguousarray(part.T)
        fill_bins_(x, y, np.array(UNIT.centre_mm), bin_directions(), bins)
    return circle_figures(bins, UNIT.radius_mm)


def test_a_perfect_circle_has_no_error() -> None:
    found = figures(ring(5000))
    assert found.circular_mm == pytest.approx(0.0, abs=1e-9)
    assert found.radial_max_mm == pytest.approx(0.0, abs=1e-12)
    assert found.radial_min_mm == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("count", [300, 1440, 5000, 200_000])
def test_the_mean_radius_is_no_smaller_than_the_least(count: int) -> None:
    """Points of a bin lie on an arc, whose mean point lies within it."""
    found = figures(ring(count))
    assert found.radial_mean_mm == pytest.approx(0.0, abs=1e-11 * RADIUS + 1e-12)


def test_a_moved_circle_has_radial_errors_but_stays_round() -> None:
    found = figures(ring(20_000) + np.array([0.003, -0.004]))
    assert found.radial_max_mm == pytest.approx(0.005, rel=1e-3)
    assert found.radial_min_mm == pytest.approx(-0.005, rel=1e-3)
    assert found.circular_mm <= 0.009 * 0.005
    assert found.radial_mean_mm == pytest.approx(0.0, abs=1e-5)


def test_what_does_not_go_round_the_centre_has_no_circular_error() -> None:
    """As play makes of a circle when it is as large as the radius."""
    near, past = (
        figures(ring(20_000) + np.array([share * RADIUS, 0.0])) for share in (0.99, 1.01)
    )
    assert near.circular_mm < 0.009 * 0.99 * RADIUS
    assert math.isnan(past.circular_mm)
    assert past.radial_max_mm == pytest.approx(1.01 * RADIUS, rel=1e-6)
    assert past.radial_min_mm == pytest.approx(-0.99 * RADIUS, rel=1e-6)


def test_an_ellipse() -> None:
    a, b = RADIUS + 0.010, RADIUS - 0.004
    stretched = (ring(50_000) - [2.0, 1.0]) * [a / RADIUS, b / RADIUS] + [2.0, 1.0]
    found = figures(stretched, parts=7)
    assert found.circular_mm == pytest.approx(0.014, rel=1e-3)
    assert found.radial_max_mm == pytest.approx(0.010, rel=1e-6)
    assert found.radial_min_mm == pytest.approx(-0.004, rel=1e-6)


def with_play(play: float) -> np.ndarray:
    """The ring after play in X, centred, in the second turn: the literal play operator."""
    slide_x = 2.0 + RADIUS
    followed = []
    for x, y in ring(80_000, turns=2.0):
        slide_x = min(max(slide_x, x - play / 2), x + play / 2)
        followed.append((slide_x, y))
    return np.array(followed[40_000:])


@pytest.mark.parametrize("play", [0.002, 0.02, 0.2])
def test_play_gives_the_analytic_circular_error(play: float) -> None:
    """Centred play b in X: going right the slide lags b/2 to the left, and at 0° it stands at
    R − b/2 (least radius) until the motor has come back by b, at x = R − b. There, with
    y² = R² − (R − b)², the radius is largest. The path is symmetric about the centre, so the
    least-squares centre is the programmed one."""
    found = figures(with_play(play), parts=3)
    least = RADIUS - play / 2
    largest = math.sqrt(least**2 + RADIUS**2 - (RADIUS - play) ** 2)
    assert found.radial_min_mm == pytest.approx(least - RADIUS, rel=1e-3)
    assert found.radial_max_mm == pytest.approx(largest - RADIUS, rel=1e-3)
    assert found.circular_mm == pytest.approx(largest - least, rel=2e-3)


def test_parts_in_any_order_give_the_same() -> None:
    points = with_play(0.05)
    whole = figures(points)
    mixed = figures(np.random.default_rng(1).permutation(points), parts=11)
    for name in ("circular_mm", "radial_max_mm", "radial_min_mm", "radial_mean_mm"):
        assert getattr(mixed, name) == pytest.approx(getattr(whole, name), abs=1e-12)


def test_too_few_angles_have_no_figures() -> None:
    assert figures(np.empty((0, 2))) == NO_FIGURES
    assert figures(ring(2)) == NO_FIGURES
    assert figures(ring(ANGLE_BINS)) != NO_FIGURES


def test_the_least_squares_centre_is_the_minimum() -> None:
    rng = np.random.default_rng(3)
    angle = rng.uniform(0, 2 * math.pi, 300)
    points = np.column_stack([np.cos(angle), np.sin(angle)]) * rng.normal(1.0, 0.05, (300, 1))
    points += [0.3, -0.2]

    def spread(centre: np.ndarray) -> float:
        radius = np.hypot(*(points - centre).T)
        return float(((radius - radius.mean()) ** 2).sum())

    centre = least_squares_centre(points)
    for turn in np.linspace(0, 2 * math.pi, 12):
        nearby = centre + 1e-4 * np.array([math.cos(turn), math.sin(turn)])
        assert spread(centre) < spread(nearby)


def found_in(b: ToolpathBuilder) -> list[FullCircle]:
    return full_circles(cut_moves(b.finish(), flat_cuts=False), GAP_MM)


@pytest.mark.parametrize("ccw", [True, False])
def test_a_full_circle_in_one_arc(ccw: bool) -> None:
    (one,) = found_in(circle(ToolpathBuilder(), 2.0, 1.0, 0.5, ccw=ccw))
    assert one == FullCircle((2.0, 1.0), 0.5, ccw, -0.02, 3, 3)


@pytest.mark.parametrize("parts", [2, 3, 4])
def test_a_full_circle_in_several_arcs(parts: int) -> None:
    b = cut(ToolpathBuilder(), 1.5, 1.0).line(2.5, 1.0, feed=1)
    for k in range(1, parts + 1):
        turn = 2.0 * math.pi * k / parts
        end = (2.0 + 0.5 * math.cos(turn), 1.0 + 0.5 * math.sin(turn)) if k < parts else (2.5, 1.0)
        b.arc(*end, centre=(2.0, 1.0), ccw=True, feed=1)
    (one,) = found_in(b)
    assert (one.first_row, one.last_row) == (4, 3 + parts)


def test_a_circle_whose_rest_a_line_mends() -> None:
    b = cut(ToolpathBuilder(), 2.5, 1.0)
    turn = 2.0 * math.pi - 0.5 * GAP_MM / 0.5
    b.arc(2.0 + 0.5 * math.cos(turn), 1.0 + 0.5 * math.sin(turn), centre=(2, 1), ccw=True, feed=1)
    b.line(2.5, 1.0, feed=1)
    assert len(found_in(b)) == 1


def test_arcs_that_are_no_full_circle() -> None:
    b = cut(ToolpathBuilder(), 2.5, 1.0).arc(1.5, 1.0, centre=(2.0, 1.0), ccw=True, feed=1)
    assert found_in(b) == []
    b.arc(2.5, 1.0, centre=(2.0, 1.0), ccw=False, feed=1)  # back again the same way
    assert found_in(b) == []
    cut(b, 2.5, 1.0).arc(1.5, 1.0, centre=(2.0, 1.0), ccw=True, feed=1)
    b.arc(2.5, 1.0, centre=(2.0, 1.1), ccw=True, feed=1)  # another centre
    assert found_in(b) == []
    cut(b, 2.5, 1.0).arc(1.5, 1.0, centre=(2.0, 1.0), ccw=True, feed=1)
    b.line(1.5, 1.2, feed=1).line(1.5, 1.0, feed=1)  # lines between
    b.arc(2.5, 1.0, centre=(2.0, 1.0), ccw=True, feed=1)
    assert found_in(b) == []


def test_without_arcs_there_is_no_circle() -> None:
    assert found_in(cut(ToolpathBuilder(), 0, 0).line(1, 1, feed=1)) == []
