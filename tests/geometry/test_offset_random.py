"""Parallel offsets of random contours, and of paths there and back, by slow, obvious oracles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.geometry.measure import Frames, length, point_at, signed_area
from camtool.geometry.polylines import Polyline, Segments, begin_at, reverse, rotate
from tests.oracles.contours import RANDOM, is_simple
from tests.oracles.offset import complaints, distance, distance_complaints
from tests.paths import mirrored, offset, there_and_back
from tests.strategies import examples

pytestmark = pytest.mark.checked

SIZES = st.floats(-1.0, 2.0).map(lambda power: 10.0**power)
"""0.1 to 100 mm."""


@st.composite
def contours(draw: st.DrawFn) -> tuple[Polyline, float]:
    """A simple star-shaped contour with lines and arcs, CCW, and its size in mm."""
    count = draw(st.integers(2, 12))
    size = draw(SIZES)
    steps = draw(st.lists(st.floats(0.2, 1.0), min_size=count, max_size=count))
    radii = draw(st.lists(st.floats(0.2, 1.0), min_size=count, max_size=count))
    most = draw(st.sampled_from([0.1, 0.4, 1.0]))
    bulges = st.one_of(st.just(0.0), st.floats(-most, most), st.sampled_from([-most, most]))
    bulge = draw(st.lists(bulges, min_size=count, max_size=count))
    angle = 2.0 * math.pi * np.cumsum(steps) / sum(steps)
    x, y = size * np.array(radii) * np.array([np.cos(angle), np.sin(angle)])
    p = Polyline(np.column_stack([x, y, np.where(np.abs(bulge) < 1e-6, 0.0, bulge)]), True)
    assume(is_simple(p))
    return p, size


SHARES = st.one_of(st.floats(1e-3, 0.1), st.floats(0.1, 0.9))
"""Distance as a share of the size: from small to where most collapse."""


@examples(40, 2000)
@given(contours(), SHARES, st.sampled_from([1.0, -1.0]))
def test_contours(source: tuple[Polyline, float], share: float, sign: float) -> None:
    p, size = source
    d = sign * share * size
    assert complaints(offset(p, d), p, d, np.random.default_rng(0)) == []


@examples(60)
@given(contours(), SHARES, st.floats(0.0, 6.3), st.integers(0, 11))
def test_changed_contours(
    source: tuple[Polyline, float], share: float, angle: float, start: int
) -> None:
    p, size = source
    d = share * size
    results = offset(p, d)
    wanted = sum(signed_area(each) for each in results)
    slack = 1e-6 * (1.0 + sum(length(each) for each in results))
    changed = [
        (offset(reverse(p), -d), -1.0),
        (offset(mirrored(p), -d), -1.0),
        (offset(rotate(p, angle), d), 1.0),
        (offset(begin_at(p, start % len(p)), d), 1.0),
    ]
    for results, sign in changed:
        assert sum(signed_area(each) for each in results) == pytest.approx(
            sign * wanted, abs=slack
        )


@examples(40)
@given(contours(), SHARES, st.floats(0.1, 0.9))
def test_in_two_steps_as_in_one(source: tuple[Polyline, float], share: float, part: float) -> None:
    # Farther than d1 + d2 from a path is farther than d2 from what is d1 from it.
    p, size = source
    once = offset(p, -share * size)
    first = offset(p, -part * share * size)
    outer = max(first, key=signed_area)
    twice = offset(outer, -(1.0 - part) * share * size)
    largest = [max(signed_area(each) for each in some) for some in (once, twice)]
    assert largest[1] == pytest.approx(largest[0], rel=1e-6)


@examples(60)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_paths_that_may_cross_themselves(seed: int, closed: bool) -> None:
    rng = np.random.default_rng(seed)
    p, d = random_path(rng, closed)
    for signed in (d, -d):
        results = offset(p, signed)
        assert distance_complaints(results, p, signed) == []
        assert all(each.closed for each in results)
        if not closed:
            assert missing(results, p, signed) == []


def random_path(rng: np.random.Generator, closed: bool) -> tuple[Polyline, float]:
    """Any vertices at all, on a grid now and then, and a distance; there and back, so that its
    left is both of its sides, or closed."""
    count = int(rng.integers(2, 14))
    size = 10.0 ** rng.uniform(-1.0, 2.0)
    points = rng.uniform(-1.0, 1.0, (count, 2))
    if rng.random() < 0.3:
        points = np.round(3.0 * points + 0.05 * np.arange(count)[:, None] * (count > 6)) / 3.0
    bulge = rng.uniform(-1.0, 1.0, count) * rng.choice([0.0, 0.2, 1.0])
    if rng.random() < 0.2:
        bulge = np.round(bulge)
    try:
        p = Polyline(np.column_stack([size * points, bulge]), closed)
        p = p if closed else there_and_back(p)
    except ValueError:
        return random_path(rng, closed)
    return p, float(size * 10.0 ** rng.uniform(-3.0, 0.0))


def missing(results: list[Polyline], p: Polyline, d: float) -> list[str]:
    """Points beside the source that belong to its offset and are not in the results.

    Beside a point of a segment, one side's normal leads to the offset if nothing is nearer; a
    little farther on must be farther by that, else it is a place where two sides just touch.
    """
    if d < 0.0:
        p, d = reverse(p), -d
    segments = Segments.of(p)
    rows, t = np.repeat(np.arange(len(segments)), 20), np.tile((np.arange(20) + 0.5) / 20, len(p))
    normal = Frames.of(segments)[rows].tangent_at(t) @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    foot = point_at(segments, rows, t)
    beyond = 1e-4 * d
    slack = 1e-10 * (1.0 + np.abs(p.vertices[:, :2]).max())
    far = distance(foot + d * normal, p) >= d - slack
    far &= distance(foot + (d + beyond) * normal, p) >= d + beyond - slack
    points = (foot + d * normal)[far]
    apart = np.full(len(points), np.inf)
    for each in results:
        apart = np.minimum(apart, distance(points, each))
    return [f"nothing at {point}" for point in points[apart > 3e-6]]


@pytest.mark.slow
@pytest.mark.parametrize("kind", RANDOM)
@pytest.mark.parametrize("seed", range(2))
def test_thousands(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    judged = 0
    # A gear has hundreds of segments, and judging it is quadratic.
    while judged < (50 if kind == "gear" else 250):
        shape = RANDOM[kind](rng)
        if shape is None:
            continue
        p, size = shape
        judged += 1
        shares = [0.25, -0.25, 0.5, -0.5] if kind == "cells" else 10.0 ** rng.uniform(-3, -0.1, 2)
        for d in (size * share * sign for share in shares for sign in (1.0, -1.0)):
            found = complaints(offset(p, d), p, d, rng)
            assert found == [], f"{p.vertices.tolist()} at {d}"


@pytest.mark.slow
@pytest.mark.parametrize("closed", [False, True])
def test_thousands_of_paths_that_may_cross_themselves(closed: bool) -> None:
    for seed in range(2000):
        rng = np.random.default_rng(seed)
        p, d = random_path(rng, closed)
        results = offset(p, d)
        assert distance_complaints(results, p, d) == [], f"seed {seed}"
        assert closed or missing(results, p, d) == [], f"seed {seed}"


@pytest.mark.slow
def test_thousands_with_vertices_a_hair_off() -> None:
    # Coincidences that rounding has spoilt, by 1e-12 to 3e-5 mm.
    rng = np.random.default_rng(7)
    judged = 0
    while judged < 400:
        shape = RANDOM["cells"](rng)
        if shape is None:
            continue
        vertices = shape[0].vertices.copy()
        vertices[:, :2] += rng.normal(size=(len(vertices), 2)) * 10.0 ** rng.uniform(-12.0, -4.5)
        p = Polyline(vertices, closed=True)
        if not is_simple(p):
            continue
        judged += 1
        for d in (0.25, 0.5, -0.5, 1.0, -1.0):
            found = complaints(offset(p, d), p, d, rng)
            assert found == [], f"{p.vertices.tolist()} at {d}"
