"""The coloured path of the slides."""

import math

import numpy as np
import pytest

from camtool.pictures.colours import BINS, bin_colours
from camtool.pictures.draw import draw
from camtool.pictures.scene import Scene
from camtool.pictures.trace import UM_PER_MM, bins_of, lines_by_step, trace_of
from tests.oracles import svg_page
from tests.pictures.conftest import ring_trace


def scene_of(points: list[tuple[float, float]], error: list[float], cutting: list[bool]) -> Scene:
    return Scene("", None, None, np.array(points), np.array(error), np.array(cutting))


def test_a_piece_has_the_colour_of_its_worse_end() -> None:
    trace = trace_of(scene_of([(0, 0), (1, 0), (2, 0)], [0.0, 0.006, -0.012], [True] * 3))
    assert trace is not None
    assert trace.top_um == 12.0
    assert bins_of(trace).tolist() == [BINS // 2, BINS - 1]


def test_only_what_cuts_is_drawn_and_counted() -> None:
    # A cut from (0, 0), a move through the air with a large error, another cut.
    trace = trace_of(
        scene_of(
            [(0, 0), (1, 0), (5, 5), (6, 5), (7, 5)],
            [math.nan, 0.001, 9.0, 0.001, 0.001],
            [False, True, False, True, True],
        )
    )
    assert trace is not None
    assert trace.top_um == pytest.approx(1.0)
    runs = [run.tolist() for group in lines_by_step(trace, 10.0) for run in group]
    assert runs == [[[0, 0], [1, 0]], [[5, 5], [6, 5], [7, 5]]]


def test_merging_points_hides_no_error() -> None:
    error = [0.001, 0.001, 0.02, 0.001, 0.001]
    points = [(0.0, 0.0), (1.0, 0.0), (1.0 + 1e-6, 0.0), (1.0 + 2e-6, 0.0), (2.0, 0.0)]
    trace = trace_of(scene_of(points, error, [True] * 5))
    assert trace is not None
    found = lines_by_step(trace, 10.0)
    assert [len(run) for run in found[BINS - 1]] == [3]
    assert sum(len(run) for group in found for run in group) < len(points)


def test_strokes_together_are_the_whole_path() -> None:
    points, error, cutting = ring_trace(3000)
    trace = trace_of(Scene("", None, None, points, error, cutting))
    assert trace is not None
    pieces = {
        (tuple(a), tuple(b))
        for group in lines_by_step(trace, 0.0)
        for run in group
        for a, b in zip(run[:-1].tolist(), run[1:].tolist(), strict=True)
    }
    chosen = np.flatnonzero(cutting[1:])
    wanted = {(tuple(points[k].tolist()), tuple(points[k + 1].tolist())) for k in chosen}
    assert pieces == wanted


def test_twenty_thousand_restless_points_stay_below_a_megabyte() -> None:
    points, error, cutting = ring_trace(20_000)
    svg = draw(Scene("ring", None, None, points, error, cutting))
    assert len(svg) < 1_000_000
    layer = svg_page.group(svg_page.parse(svg), "slide-path")
    assert layer is not None
    assert len(layer) <= BINS


def test_large_errors_are_drawn_over_small_ones(scenes: dict[str, Scene]) -> None:
    layer = svg_page.group(svg_page.parse(draw(scenes["result"])), "slide-path")
    assert layer is not None
    ranks = [bin_colours().index(path.attrib["stroke"]) for path in layer]
    assert ranks == sorted(ranks)
    assert ranks[-1] == BINS - 1


def test_errors_are_shown_in_um(scenes: dict[str, Scene]) -> None:
    trace = trace_of(scenes["huge error"])
    assert trace is not None
    assert trace.top_um == 12.5 * UM_PER_MM
    assert 'aria-label="12500"' in draw(scenes["huge error"])


@pytest.mark.parametrize("name", ["empty trace", "empty", "drawing"])
def test_no_trace(scenes: dict[str, Scene], name: str) -> None:
    assert trace_of(scenes[name]) is None


@pytest.mark.parametrize(
    ("points", "error", "cutting"),
    [
        (np.zeros((2, 2)), None, None),
        (None, np.zeros(2), None),
        (None, None, np.zeros(2, dtype=bool)),
        (np.zeros((2, 2)), np.zeros(3), None),
        (np.zeros((2, 3)), np.zeros(2), None),
        (np.zeros((2, 2)), np.zeros(2), np.zeros(3, dtype=bool)),
        (np.full((2, 2), np.nan), np.zeros(2), None),
        (np.zeros((2, 2)), np.full(2, np.inf), None),
    ],
)
def test_incomplete_traces_are_refused(
    points: np.ndarray | None, error: np.ndarray | None, cutting: np.ndarray | None
) -> None:
    with pytest.raises(ValueError, match="trace"):
        Scene("", None, None, points, error, cutting)


def test_one_point_is_no_path() -> None:
    assert "<svg" in draw(scene_of([(1.0, 1.0)], [0.001], [True]))
