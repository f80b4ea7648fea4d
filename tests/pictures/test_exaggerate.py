"""Deviations drawn many times as large: nearest points by brute force, and the whole picture."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.geometry.distance import points_to_segments
from camtool.geometry.measure import point_at
from camtool.geometry.polylines import Polylines, Segments
from camtool.pictures.content import content_of
from camtool.pictures.draw import draw
from camtool.pictures.options import PictureOptions
from camtool.pictures.scene import Scene
from camtool.pictures.trace import exaggerated, nearest_points
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.verification.cuts import cut_moves
from tests.oracles import svg_page
from tests.pictures.conftest import SCENES, circle, line

COORDINATES = st.floats(-5.0, 5.0).map(lambda x: round(x, 1) + 0.0)
VERTEX = st.tuples(COORDINATES, COORDINATES, st.sampled_from([0.0, 0.3, -0.7, -1.0, 1.0]))
RING = Segments.of(Polylines.of([circle(2.5, 2.5, 2.0)]))


@given(
    st.lists(VERTEX, min_size=2, max_size=6, unique_by=lambda v: v[:2]),
    st.lists(st.tuples(COORDINATES, COORDINATES), min_size=1, max_size=8),
)
def test_the_nearest_point_is_on_the_path_and_no_other_is_nearer(
    vertices: list[tuple[float, ...]], places: list[tuple[float, float]]
) -> None:
    segments = Segments.of(line(*vertices))
    points = np.array(places)
    foot = nearest_points(points, segments)
    away = np.hypot(*(points - foot).T)
    assert points_to_segments(foot, segments).min(axis=1).max() < 1e-6
    shares = np.linspace(0.0, 1.0, 101)
    for row in range(len(segments)):
        along = point_at(segments, np.full(101, row), shares)
        for point, distance in zip(points, away, strict=True):
            assert distance <= np.hypot(*(along - point).T).min() + 1e-6


def test_cuts_that_are_the_toolpath_s_own_lines_have_nearest_points() -> None:
    path = ToolpathBuilder().rapid(0, 0, -1).line(4, 0, feed=1).line(4, 3, feed=1).finish()
    wanted = cut_moves(path, flat_cuts=False).segments
    foot = nearest_points(np.array([[1.0, 0.5], [4.2, 2.0]]), wanted)
    assert foot.tolist() == [[1.0, 0.0], [4.0, 2.0]]
    alone = ToolpathBuilder().rapid(0, 0, -1).line(4, 0, feed=1).finish()
    foot = nearest_points(np.array([[1.0, 0.5]]), cut_moves(alone, flat_cuts=False).segments)
    assert foot.tolist() == [[1.0, 0.0]]


def test_the_deviation_grows_by_the_factor_and_points_on_the_path_stay() -> None:
    points = np.array([[4.51, 2.5], [2.5, 0.49], [4.5, 2.5]])
    moved = exaggerated(points, RING, 50.0)
    assert moved == pytest.approx(np.array([[5.0, 2.5], [2.5, 0.0], [4.5, 2.5]]))
    assert exaggerated(points, RING, 1.0) == pytest.approx(points)


def test_without_a_wanted_path_nothing_moves() -> None:
    points = np.array([[4.51, 2.5]])
    assert exaggerated(points, RING[np.zeros(0, dtype=int)], 50.0).tolist() == points.tolist()


def result() -> Scene:
    """A circle with errors, compared with the true circle."""
    return replace(SCENES["result"], wanted=RING)


def test_the_picture_says_the_factor_and_keeps_the_true_error_on_its_scale() -> None:
    usual, ten = draw(result()), draw(result(), options=PictureOptions(exaggerate=10.0))
    assert usual == draw(SCENES["result"])
    labels = {g.get("aria-label") for g in svg_page.parse(ten).iter()}
    assert "the path is drawn with its deviation from the wanted one × 10" in labels
    assert {"predicted path, error × 10", "wanted path"} <= labels
    assert content_of(result(), PictureOptions(exaggerate=10.0)).trace.top_um == pytest.approx(
        content_of(result()).trace.top_um
    )


def test_the_drawn_path_is_ten_times_as_far_away() -> None:
    one = content_of(result()).trace
    ten = content_of(result(), PictureOptions(exaggerate=10.0)).trace
    radii = [np.hypot(*(t.points[t.cutting] - 2.5).T) - 2.0 for t in (one, ten)]
    assert radii[1] == pytest.approx(10.0 * radii[0])


@pytest.mark.parametrize("times", [0.0, 0.5, -1.0, 1e7, math.nan, math.inf])
def test_senseless_factors_are_refused(times: float) -> None:
    with pytest.raises(OptionError, match="times as large"):
        PictureOptions(exaggerate=times)
