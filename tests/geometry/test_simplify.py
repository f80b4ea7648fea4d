"""Exploded arcs become arcs again, and nothing else does."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.distance import points_to_segments
from camtool.geometry.measure import sample, segment_lengths
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.geometry.simplify import NOISE_MM, recognise_arcs, rounding_noise, without_tiny
from camtool.kernels.fits import MAX_TURN_RAD, circle_of, find_runs
from tests.oracles import arcs
from tests.oracles.recognise import explode, least_squares_circle, turns_about

pytestmark = pytest.mark.checked

TOLERANCE_MM = 0.0005


def path_of(points, closed=False):
    return Polyline(np.column_stack([points, np.zeros(len(points))]), closed)


def regular(sides, radius=1.0):
    angle = 2.0 * math.pi * np.arange(sides) / sides
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def off(points, path):
    rows = path.vertices
    if path.closed:
        rows = np.concatenate([rows, rows[:1]])
    return arcs.chain_distances(points, rows).max()


def chain_of(steps, tangent):
    """An open chain (n, 3) of lines and arcs: (kind, length, radius, way, turn at the joint)."""
    here, heading, rows = 0j, 0.0, []
    for is_arc, length, radius, way, turn in steps:
        heading += 0.0 if tangent else turn
        if is_arc:
            sweep = way * min(max(length / radius, 0.5), 3.0)
            chord = 2.0 * radius * math.sin(0.5 * abs(sweep))
            rows.append((here.real, here.imag, math.tan(0.25 * sweep)))
            here += chord * complex(math.cos(heading + 0.5 * sweep), math.sin(heading + sweep / 2))
            heading += sweep
        else:
            rows.append((here.real, here.imag, 0.0))
            here += length * complex(math.cos(heading), math.sin(heading))
    return np.array([*rows, (here.real, here.imag, 0.0)])


step = st.tuples(
    st.booleans(),
    st.floats(2.0, 20.0),
    st.sampled_from([1.0, 1.7, 2.9, 4.4, 7.3, 11.0]),
    st.sampled_from([-1.0, 1.0]),
    st.floats(0.6, 1.5),
)


def distinct(steps):
    """Neighbouring arcs differ in radius or side: otherwise they are one arc."""
    return all(not (a[0] and b[0] and a[2] == b[2] and a[3] == b[3]) for a, b in pairwise(steps))


chains = st.lists(step, min_size=1, max_size=6).filter(distinct)


@given(chains, st.booleans(), st.floats(0.03, 0.36))
def test_exact_chains_are_found_again(steps, tangent, most_turn):
    chain = chain_of(steps, tangent)
    found, count = recognise_arcs(path_of(explode(chain, most_turn)), TOLERANCE_MM)
    assert count == sum(is_arc for is_arc, *_ in steps)
    assert found.vertices == pytest.approx(chain, abs=1e-6)


@given(chains, st.booleans(), st.floats(0.03, 0.36), st.sampled_from([4, 5, 6]))
def test_rounded_chains_stay_within_the_tolerance(steps, tangent, most_turn, decimals):
    points = explode(chain_of(steps, tangent), most_turn, decimals)
    found, count = recognise_arcs(path_of(points), TOLERANCE_MM)
    assert off(points, found) <= TOLERANCE_MM
    assert (count > 0) == any(is_arc for is_arc, *_ in steps)


def is_found_again(rng, decimals):
    """True if the arcs of a random chain are recognised in its rounded chords, end for end."""
    count = rng.integers(1, 7)
    radii = rng.permutation([1.0, 1.7, 2.9, 4.4, 7.3, 11.0])
    steps = [
        (rng.random() < 0.6, rng.uniform(2.0, 20.0), radii[k], rng.choice([-1.0, 1.0]), 1.0)
        for k in range(count)
    ]
    chain = chain_of(steps, rng.random() < 0.5)
    points = explode(chain, rng.uniform(0.03, 0.36), decimals)
    found, _ = recognise_arcs(path_of(points), TOLERANCE_MM)
    wanted = chain[chain[:, 2] != 0.0]
    made = found.vertices[found.vertices[:, 2] != 0.0]
    if len(made) != len(wanted):
        return False
    ends = np.abs(made[:, :2] - wanted[:, :2]) <= 2.0 * 10.0**-decimals
    return bool(ends.all() and (np.abs(made[:, 2] - wanted[:, 2]) <= 1e-2).all())


@pytest.mark.parametrize("decimals", [4, 5, 6])
def test_rounded_chains_are_found_again(decimals):
    # Rounding may by chance put a point of the next piece on the circle: then arcs meet one
    # chord further on.
    rng = np.random.default_rng(decimals)
    assert sum(is_found_again(rng, decimals) for _ in range(200)) >= 190


@given(chains, st.floats(-math.pi, math.pi), st.booleans(), st.booleans(), st.floats(0.1, 40.0))
def test_moved_mirrored_and_reversed_chains_give_the_same_arcs(steps, turn, mirror, back, scale):
    points = explode(chain_of(steps, False), 0.2)
    turned = points @ np.array(
        [[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]]
    )
    moved = scale * turned * [1.0, -1.0 if mirror else 1.0] + [3.0, -8.0]
    moved = moved[::-1] if back else moved
    assert recognise_arcs(path_of(moved), TOLERANCE_MM)[1] == sum(is_arc for is_arc, *_ in steps)


def noisy(seed, noise):
    rng = np.random.default_rng(seed)
    points = explode(np.array([[0, 0, 0], [9, 0, 0.6], [9, 7, 0], [0, 7.0, 0]]), 0.05)
    return points + noise * rng.uniform(-1.0, 1.0, points.shape)


@given(st.integers(0, 10**6), st.sampled_from([1e-5, 1e-4, 1e-3]))
def test_noise_that_is_no_rounding_moves_no_point_by_more(seed, noise):
    points = noisy(seed, noise)
    found, _ = recognise_arcs(path_of(points), 4.0 * noise)
    assert off(points, found) <= 4.0 * noise


def test_noise_that_is_no_rounding_hides_hardly_an_arc():
    # Noise may look smooth by chance: then part of the arc, or all of it, stays chords.
    whole = 0
    for seed in range(300):
        found, count = recognise_arcs(path_of(noisy(seed, 1e-4)), 4e-4)
        whole += count == 1 and len(found) == 3
    assert whole >= 285


@pytest.mark.parametrize("sides", range(3, 16))
def test_polygons_stay_polygons(sides):
    path = path_of(regular(sides, 10.0), True)
    assert recognise_arcs(path, 0.01) == (path, 0)


@pytest.mark.parametrize("sides", [16, 17, 24, 64, 999])
@pytest.mark.parametrize("way", [1, -1])
def test_many_sides_are_a_circle(sides, way):
    points = regular(sides, 5.0)[::way] + np.array([7.0, 1.0])
    found, count = recognise_arcs(path_of(points, True), TOLERANCE_MM)
    assert count == 1
    assert found.closed
    assert found.vertices[:, 2].tolist() == [way, way]
    assert np.hypot(*(found.vertices[0] - found.vertices[1])[:2]) == pytest.approx(10.0)
    assert off(points, found) <= TOLERANCE_MM


def slot(decimals=None):
    rows = np.array([[0, -2, 0], [10, -2, 1], [10, 2, 0], [0, 2, 1], [0, -2.0, 0]])
    return explode(rows, 0.15, decimals)[:-1]


@pytest.mark.parametrize("decimals", [None, 3, 4, 6])
def test_a_slot_from_every_start(decimals):
    points = slot(decimals)
    for first in range(len(points)):
        path = path_of(np.roll(points, first, axis=0), True)
        found, count = recognise_arcs(path, 0.002)
        assert (count, len(found)) == (2, 4)
        assert off(points, found) <= 0.002
        assert sorted(np.abs(found.vertices[:, 2]).round(3)) == [0.0, 0.0, 1.0, 1.0]


def test_short_first_and_last_chords_belong_to_the_arc():
    angle = np.concatenate([[0.0, 0.03], np.arange(0.13, 2.0, 0.1), [1.95]])
    found, count = recognise_arcs(
        path_of(5.0 * np.column_stack([np.cos(angle), np.sin(angle)])), TOLERANCE_MM
    )
    assert (count, len(found)) == (1, 1)


def test_arcs_and_lines_that_are_there_stay():
    rows = np.array([[0, 0, 0.5], [4, 0, 0], [4, 1, 0], [5, 1, -1], [7, 1, 0], [9.0, 1, 0]])
    path = Polyline(rows, True)
    assert recognise_arcs(path, 0.01) == (path, 0)
    exploded = explode(np.array([[9, 1, 0.3], [9.0, 6, 0]]), 0.1)
    longer = np.concatenate([rows[:-1], np.column_stack([exploded, np.zeros(len(exploded))])])
    found, count = recognise_arcs(Polyline(longer), TOLERANCE_MM)
    assert count == 1
    assert found.vertices[:5].tolist() == rows[:5].tolist()
    assert found.vertices[5:] == pytest.approx(np.array([[9, 1, 0.3], [9, 6, 0.0]]))


def test_more_than_a_half_circle_is_two_arcs_that_count_once():
    angle = np.linspace(0.0, 5.5, 80)
    points = 3.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    found, count = recognise_arcs(path_of(points), TOLERANCE_MM)
    assert (count, len(found)) == (1, 2)
    assert 4.0 * np.arctan(found.vertices[:, 2]).sum() == pytest.approx(5.5)
    assert off(points, found) <= 1e-9


def test_splines_and_ellipses_stay_chords():
    t = np.linspace(0.0, 2.0 * math.pi, 200)[:-1]
    ellipse = path_of(np.column_stack([10.0 * np.cos(t), 5.0 * np.sin(t)]), True)
    assert recognise_arcs(ellipse, 0.01)[1] == 0
    t = np.linspace(1.0, 20.0, 400)
    spiral = path_of(np.column_stack([t * np.cos(t), t * np.sin(t)]))
    assert recognise_arcs(spiral, 0.01)[1] == 0


@given(st.integers(0, 10**6), st.sampled_from([2, 3, 4]), st.floats(1e-4, 0.1))
def test_whatever_becomes_an_arc_stays_within_the_tolerance(seed, decimals, tolerance):
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 9.0, 300)
    wobble = rng.uniform(0.0, 3.0, 3)
    points = np.column_stack(
        [8.0 * np.cos(t) + wobble[0] * np.sin(wobble[1] * t), 6.0 * np.sin(t) + wobble[2] * t]
    )
    points = np.round(points, decimals)
    points = points[np.append(True, np.hypot(*np.diff(points, axis=0).T) > 1e-6)]
    found, _ = recognise_arcs(path_of(points), tolerance)
    assert off(points, found) <= tolerance + 1e-12
    assert found.start.tolist() == points[0].tolist()
    assert found.end.tolist() == points[-1].tolist()


@given(st.integers(0, 10**6))
def test_runs_are_what_the_rules_say(seed):
    rng = np.random.default_rng(seed)
    chain = chain_of([(True, 6.0, r, 1.0, 0.9) for r in rng.uniform(1.0, 9.0, 3)], False)
    points = explode(chain, 0.2, 4)
    for low, high, *circle in find_runs(points, 0.75e-4, TOLERANCE_MM):
        run = points[int(low) : int(high) + 1]
        centre, radius = least_squares_circle(run)
        assert circle[:3] == pytest.approx([*centre, radius], abs=1e-6)
        turned = turns_about(run, centre)
        assert np.abs(turned).max() <= MAX_TURN_RAD
        assert turned.sum() == pytest.approx(circle[3], abs=1e-6)
        assert len(set(np.sign(turned))) == 1
        assert np.abs(np.hypot(*(run - centre).T) - radius).max() <= TOLERANCE_MM


def test_the_circle_of_points_on_a_line_is_infinite():
    assert circle_of(np.array([[0.0, 0], [1, 0], [2, 0]]), 0, 2)[2] == math.inf


def test_rounding_is_seen():
    points = np.random.default_rng(1).uniform(-50.0, 50.0, (40, 2))
    assert rounding_noise(points) == NOISE_MM
    for decimals in (1, 3, 6):
        noise = rounding_noise(np.round(points, decimals))
        assert noise == pytest.approx(0.75 * 10.0**-decimals)


def test_straight_chords_stay():
    along = path_of(np.column_stack([np.arange(50.0), np.zeros(50)]))
    assert recognise_arcs(along, 0.01) == (along, 0)
    short = path_of(regular(4))
    assert recognise_arcs(short, 0.01) == (short, 0)


# Segments too short to matter: merged, and no point of the path moved by more than the limit.

LIMIT = 0.01


def path(*points: tuple[float, ...], closed: bool = False) -> Polyline:
    return Polyline(np.array([(*p, 0.0)[:3] for p in points], dtype=np.float64), closed)


def merged(one: Polyline) -> tuple[list[list[float]], int]:
    found = without_tiny(Polylines.of([one]), LIMIT)
    return found.lines[0].vertices.tolist(), found.count


def test_a_speck_between_lines_goes_and_the_corner_stays() -> None:
    found, count = merged(path((0, 0), (5, 0), (5, 0.004), (5, 3)))
    assert (found, count) == ([[0, 0, 0], [5, 0, 0], [5, 3, 0]], 1)


def test_arcs_beside_a_speck_stay_as_they_are() -> None:
    before = path((0, 0, 0.5), (5, 0), (5, 0.004), (5, 3))
    assert merged(before) == ([[0, 0, 0.5], [5, 0, 0], [5, 3, 0]], 1)
    after = path((0, 0), (5, 0), (5, 0.004, 0.5), (5, 3))
    assert merged(after) == ([[0, 0, 0], [5, 0.004, 0.5], [5, 3, 0]], 1)
    both = path((0, 0, 0.5), (5, 0), (5, 0.004, 0.5), (5, 3))
    assert merged(both) == (both.vertices.tolist(), 0)


def test_ends_of_open_paths_stay() -> None:
    found, count = merged(path((0, 0), (0.004, 0), (5, 0), (5, 0.004)))
    assert (found, count) == ([[0, 0, 0], [5, 0.004, 0]], 2)


def test_a_path_of_specks_stays() -> None:
    speck = path((0, 0), (0.003, 0), (0.003, 0.003), closed=True)
    assert merged(speck)[1] == 0


def test_a_curve_of_very_short_chords_keeps_its_shape() -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 5001)[:-1]
    circle = Polyline(np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]), True)
    found, count = merged(circle)
    assert len(found) == 5000 - count
    assert 600 < len(found) < 900
    assert np.hypot(*np.array(found)[:, :2].T).min() > 1.0 - 1e-12


STEPS = st.sampled_from([0.002, 0.004, 0.007, 0.3, 1.0])


@st.composite
def strokes(draw: st.DrawFn) -> Polyline:
    """Long and very short steps in all directions."""
    points = [(0.0, 0.0)]
    for _ in range(draw(st.integers(2, 14))):
        angle, step = draw(st.floats(0.0, 6.28)), draw(STEPS)
        x, y = points[-1]
        points.append((x + step * math.cos(angle), y + step * math.sin(angle)))
    bulges = [draw(st.sampled_from([0.0, 0.0, 0.5, -0.2])) for _ in points]
    steps = np.diff(np.array([*points, points[0]]), axis=0)
    closed = draw(st.booleans()) and bool(np.hypot(*steps[-1]) > 1e-5)
    return Polyline(np.column_stack([points, bulges]), closed)


@given(strokes())
def test_nothing_moves_by_more_than_the_limit(one: Polyline) -> None:
    found = without_tiny(Polylines.of([one]), LIMIT)
    (after,) = found.lines
    assert found.count == len(one) - len(after)
    for here, there in ((one, after), (after, one)):
        points = np.concatenate([sample(here, 0.003), here.vertices[:, :2]])
        assert points_to_segments(points, Segments.of(there)).min(axis=1).max() <= LIMIT + 1e-9
    if not one.closed:
        assert after.start.tolist() == one.start.tolist()
        assert after.end.tolist() == one.end.tolist()
    arcs = segment_lengths(Segments.of(one)) > LIMIT
    long_arcs = {tuple(row) for row in Segments.of(one).end[arcs & Segments.of(one).is_arc]}
    assert long_arcs <= {tuple(row) for row in after.vertices[:, :2]}
