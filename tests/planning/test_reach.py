"""What a round tool cannot reach: areas and places by hand, and against regions of chords."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import GeometryError
from camtool.geometry.distance import nearest
from camtool.geometry.measure import signed_areas
from camtool.geometry.polylines import Polyline, Polylines, reverse, rotate
from camtool.planning import reach
from camtool.planning.reach import Unreached, opened, unreached
from tests.oracles import swept
from tests.oracles.contours import (
    CIRCLE,
    DUMBBELL,
    ELL,
    FILLETED,
    NOTCH,
    RANDOM,
    SQUARE,
    closed,
    comb,
    star,
)
from tests.oracles.contours import opened as open_path
from tests.paths import mirrored, scaled
from tests.planning.pocket_cases import LETTER_B, region_of, shapes
from tests.strategies import examples

FOOT = 1.0 - 0.25 * math.pi
"""Area at the foot of a square corner that a disc of radius 1 leaves."""


def total(paths: list[Polyline], radius: float) -> float:
    return sum(piece.area_mm2 for piece in unreached(region_of(paths), radius))


def with_all_feet(region: Polylines, radius: float) -> list[Unreached]:
    """The pieces, those at the bluntest corners too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reach, "MIN_FOOT_SHARE", 0.0)
        return unreached(region, radius)


def test_feet_of_square_corners() -> None:
    pieces = unreached(region_of([SQUARE]), 2.0)
    assert [piece.area_mm2 for piece in pieces] == pytest.approx([4.0 * FOOT] * 4)
    corners = sorted((round(x, 9), round(y, 9)) for x, y in (piece.at_mm for piece in pieces))
    assert corners == [(0.0, 0.0), (0.0, 10.0), (10.0, 0.0), (10.0, 10.0)]


@pytest.mark.parametrize(
    ("path", "radius", "areas"),
    [
        (CIRCLE, 9.9, []),
        (FILLETED, 2.0, []),
        (ELL, 1.0, [FOOT] * 5),
        # A half disc stands on one side: two thin feet more.
        (NOTCH, 1.0, [FOOT] * 4 + [0.047267] * 2),
        # The neck 2 mm wide and 10 mm long, less what discs reach into it from both sides.
        (DUMBBELL, 1.5, [18.95229352] + [2.25 * FOOT] * 8),
        # The teeth 1 mm wide stay, less what the disc reaches into them, and two free corners.
        (comb(3), 0.8, [6.1136245] * 2 + [5.88016572] + [0.64 * FOOT] * 2),
        (SQUARE, 8.0, [100.0]),
    ],
    ids=["circle", "filleted", "ell", "notch", "neck", "comb", "too large"],
)
def test_areas(path: Polyline, radius: float, areas: list[float]) -> None:
    found = [piece.area_mm2 for piece in unreached(region_of([path]), radius)]
    assert len(found) == len(areas)
    assert found == sorted(found, reverse=True)
    exact = signed_areas(region_of([path])).sum()
    exact -= signed_areas(opened(region_of([path]), radius)).sum()
    assert sum(found) == pytest.approx(exact, abs=1e-9)
    assert found == pytest.approx(areas, abs=1e-6)


def test_a_band_narrower_than_the_tool_is_one_piece_with_a_hole() -> None:
    (piece,) = unreached(region_of([CIRCLE, scaled(CIRCLE, 0.7)]), 2.0)
    assert piece.area_mm2 == pytest.approx(math.pi * (100.0 - 49.0))
    assert len(piece.outline) == 2


def test_the_outside_of_a_part_is_a_region_too() -> None:
    hole_of_all = Polylines.of([reverse(ELL)])
    (piece,) = unreached(hole_of_all, 1.5)
    assert piece.area_mm2 == pytest.approx(2.25 * FOOT)
    assert piece.at_mm == pytest.approx((4.0, 4.0))


def test_blunt_corners_are_left_out() -> None:
    many = [star(30, 9.0, 10.0)]
    blunt = [closed(*[(10 * math.cos(a), 10 * math.sin(a)) for a in np.arange(0, 6.2, 0.1)])]
    assert len(unreached(region_of(many), 0.5)) == 30
    assert unreached(region_of(blunt), 1.0) == []
    assert len(with_all_feet(region_of(blunt), 1.0)) >= 60


def test_a_disc_that_comes_away_beside_a_corner() -> None:
    # Failed once: the disc parts from the wall 5.5 µm before a corner, and the needle was lost.
    needle = closed(
        (5.82421875, 0.0, 0.033203125),
        (2.71520298, 2.93729004),
        *[(2.0 * math.cos(a), 2.0 * math.sin(a)) for a in np.arange(2, 9) * 0.2 * math.pi],
        (0.830584035, -1.84315702),
        (16.7561731, -9.72734737),
    )
    region = region_of([needle])
    pieces = unreached(region, 2.0)
    exact = float(signed_areas(region).sum() - signed_areas(opened(region, 2.0)).sum())
    assert sum(piece.area_mm2 for piece in pieces) == pytest.approx(exact, abs=1e-6)
    assert pieces[0].at_mm == pytest.approx((16.7561731, -9.72734737))


def test_a_disc_that_comes_away_beside_an_island() -> None:
    # Failed once: the disc slips round the island so flatly that its ends were 5 µm apart.
    plate = closed(
        (-2.0, 0.0),
        (-1.0, math.sqrt(3.0)),
        (1.0, math.sqrt(3.0)),
        (14.82852027, -2.26163364),
        (0.47967713, -2.98118749),
        (-3.0, -5.19615242),
    )
    first = closed((0.63125, 0.0), (0.584375, 0.02706329), (0.584375, -0.02706329))
    second = closed(
        (-0.33, -0.51961524),
        (-0.3, -0.48961524),
        (-0.27252253, -0.5379751),
        (-0.41450964, -0.74325358),
    )
    region, radius = region_of([plate, first, second]), 1.4189939360740422
    exact = float(signed_areas(region).sum() - signed_areas(opened(region, radius)).sum())
    found = sum(piece.area_mm2 for piece in with_all_feet(region, radius))
    assert found == pytest.approx(exact, abs=1e-5)


def test_nothing_is_out_of_reach_of_a_point() -> None:
    assert unreached(region_of([SQUARE]), 0.0) == []


def test_open_paths_have_no_inside() -> None:
    with pytest.raises(GeometryError, match="open"):
        unreached(Polylines.of([open_path((0, 0), (1, 0), (1, 1))]), 0.1)


@examples(40)
@given(paths=shapes(), radius=st.floats(0.03, 3.0))
def test_pieces_are_the_region_less_the_opened_one(paths: list[Polyline], radius: float) -> None:
    region = region_of(paths)
    exact = float(signed_areas(region).sum() - signed_areas(opened(region, radius)).sum())
    pieces = with_all_feet(region, radius)
    # Feet of corners that hardly turn are thinner than the error of two offsets.
    slack = 1e-5 * (len(region.vertices) * radius + 1.0)
    assert sum(piece.area_mm2 for piece in pieces) == pytest.approx(exact, abs=slack)


@examples(5)
@given(paths=shapes(), radius=st.floats(0.2, 2.0))
def test_pieces_are_where_chords_say(paths: list[Polyline], radius: float) -> None:
    region = region_of(paths)
    area = swept.area_of(region)
    left = shapely.difference(area, swept.opened(area, radius, swept.FINE_CHORD_RAD))
    pieces = with_all_feet(region, radius)
    ours = shapely.union_all([swept.area_of(piece.outline) for piece in pieces])
    apart = shapely.symmetric_difference(left, ours).area
    assert apart <= 1e-3 * area.area


@pytest.mark.parametrize("kind", RANDOM)
def test_turned_mirrored_and_scaled(kind: str) -> None:
    rng = np.random.default_rng(4)
    made = [made for made in (RANDOM[kind](rng) for _ in range(12)) if made is not None]
    assert made
    for path, size in made:
        radius = 0.07 * size
        area = total([path], radius)
        assert total([rotate(path, 1.0)], radius) == pytest.approx(area, abs=1e-6 * size**2)
        assert total([mirrored(path)], radius) == pytest.approx(area, abs=1e-6 * size**2)
        larger = total([scaled(path, 3.0)], 3.0 * radius)
        assert larger == pytest.approx(9.0 * area, abs=1e-5 * size**2)


def test_a_letter() -> None:
    pieces = unreached(region_of(LETTER_B), 0.9)
    assert all(piece.area_mm2 < 0.9 for piece in pieces)
    assert 4 <= len(pieces) <= 12


def test_many_pieces_are_looked_at_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each piece by itself would index all that is reached anew: quadratic in a halftone."""
    calls = []

    def counted(*arguments: object) -> object:
        calls.append(arguments)
        return nearest(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(reach, "nearest", counted)
    found, times = {}, {}
    for count in (2, 12):
        squares = [
            Polyline(np.array([(x, 0, 0), (x + 4, 0, 0), (x + 4, 4, 0), (x, 4, 0.0)]), True)
            for x in range(0, 5 * count, 5)
        ]
        calls.clear()
        pieces = unreached(Polylines.of(squares), 1.0)
        found[count], times[count] = len(pieces), len(calls)
        # The corners: of each, the vertex farthest from what is reached.
        corners = {(float(x), float(y)) for each in squares for x, y, _ in each.vertices.tolist()}
        assert {(round(x, 6), round(y, 6)) for x, y in (p.at_mm for p in pieces)} == corners
    assert found == {2: 8, 12: 48}
    assert times[12] == times[2]
