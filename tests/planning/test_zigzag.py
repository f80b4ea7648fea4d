"""Zig-zag pockets: strokes at an angle, all cleared, the walls followed at last."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.geometry.measure import length, signed_area
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline
from camtool.planning.clearing import Scan, strokes_of, zigzag_paths
from tests.oracles.contours import CIRCLE, DUMBBELL, SQUARE
from tests.oracles.swept import at_depth, complaints, gouges
from tests.planning.pocket_cases import SHAPES, cross, region_of, runs_of, shapes, work_of
from tests.strategies import examples


def wrong(paths: list[Polyline], diameter_mm: float, step_over: float, angle: float) -> list[str]:
    """Return the faults that the oracle finds in the zigzag pocket of the paths."""
    work = work_of(paths, diameter_mm, pattern="zigzag", step_over=step_over, angle_rad=angle)
    if not work.items:
        return []
    return complaints(runs_of(work), region_of(paths), 0.5 * diameter_mm, -1.0)


@pytest.mark.parametrize(
    ("shape", "step_over", "angle"),
    [
        ("square", 1.0, 0.0),
        ("square", 0.4, 0.7),
        ("island off the middle", 0.7, 0.3),
        ("dumbbell", 0.6, 0.5 * math.pi),
        ("keyhole", 1.0, -2.0),
    ],
)
def test_all_within_reach_is_cleared(shape: str, step_over: float, angle: float) -> None:
    assert wrong(SHAPES[shape], 1.3, step_over, angle) == []


@pytest.mark.slow
@pytest.mark.parametrize("step_over", [0.2, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("angle", [0.0, 0.4, 0.5 * math.pi])
@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape(shape: str, angle: float, step_over: float) -> None:
    assert wrong(SHAPES[shape], 1.1, step_over, angle) == []


@examples(4, 150)
@given(
    paths=shapes(),
    diameter_mm=st.floats(0.2, 3.0),
    step_over=st.floats(0.2, 1.0),
    angle=st.floats(-4.0, 4.0),
)
def test_random_shapes(
    paths: list[Polyline], diameter_mm: float, step_over: float, angle: float
) -> None:
    assume(not cross(paths))
    assert wrong(paths, diameter_mm, step_over, angle) == []


@pytest.mark.parametrize("angle", [0.0, 0.6, -1.2, 0.5 * math.pi])
def test_strokes_lie_at_the_angle_no_farther_apart_than_the_step(angle: float) -> None:
    strokes = strokes_of(region_of([CIRCLE]), Scan(0.9, 1.0, angle))
    along = strokes.ends[:, 1] - strokes.ends[:, 0]
    across = np.array([-math.sin(angle), math.cos(angle)])
    assert np.abs(along @ across).max() < 1e-9
    heights = strokes.ends[:, 0] @ across
    assert len(strokes) == math.ceil(20.0 / 0.9)
    assert np.diff(heights) == pytest.approx([20.0 / len(strokes)] * (len(strokes) - 1))
    assert np.hypot(*np.moveaxis(strokes.ends, 2, 0)) == pytest.approx(10.0)


def test_an_island_divides_strokes() -> None:
    strokes = strokes_of(region_of(SHAPES["annulus"]), Scan(0.5, 1.0, 0.0))
    middle = strokes.row == strokes.row[len(strokes) // 2]
    assert middle.sum() == 2


def test_the_walls_come_last_and_whole() -> None:
    (run,) = runs_of(work_of([SQUARE], 1.0, pattern="zigzag", step_over=0.5))
    (way,) = at_depth([run], -1.0)
    wall = Polyline(way.vertices[-5:], closed=False)
    assert length(wall) == pytest.approx(36.0, abs=9.0)
    last = Polyline(way.vertices[-6:-1], closed=True)
    assert abs(signed_area(last)) == pytest.approx(81.0)


def test_a_convex_pocket_is_one_way_to_and_fro() -> None:
    region = offset_shape(region_of([SQUARE]), 0.5)
    (way,) = zigzag_paths(region, Scan(0.5, 0.5, 0.0))
    strokes = 18
    links = strokes - 1
    straight = 17 * (9.0 - 0.5) / 17
    assert len(way) >= 2 * strokes + 5
    expected = strokes * 8.5 + links * straight / links * 1.0
    assert length(Polyline(way)) == pytest.approx(expected + 36.0, rel=0.05)


def test_links_never_leave_the_region() -> None:
    work = work_of([DUMBBELL], 1.5, pattern="zigzag", step_over=0.4, angle_rad=1.5)
    runs = runs_of(work)
    assert len(runs) == 1
    assert gouges(runs, region_of([DUMBBELL]), 0.75) == []
