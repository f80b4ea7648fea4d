"""What is written for the Matlab router reads back as what was meant, to its grid of 0.2 mm."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.findings import Severity, worst
from camtool.pipeline import post_drawing
from camtool.planning.job import job_of
from camtool.target.registry import LoadedTarget
from tests.postprocessors.matlab_router.parts import (
    ROOT,
    Point,
    arrays,
    cut_points,
    router,
    strokes,
)
from tests.strategies import examples

GRID_MM = 0.2

NEAR_MM = 1e-9
"""Places of decimal tenths that should be one are nearer than this."""

on_grid = st.integers(1, 1000).map(lambda index: index * GRID_MM)
anywhere = st.floats(0.2, 200.0)
stroke = st.lists(st.tuples(on_grid, on_grid), min_size=2, max_size=9)
rough_stroke = st.lists(st.tuples(anywhere, anywhere), min_size=2, max_size=9)


def kept(points: list[Point]) -> list[Point]:
    """The points without those that repeat the one before."""
    return [p for index, p in enumerate(points) if index == 0 or p != points[index - 1]]


def check_exact(target: LoadedTarget, paths: list[list[Point]], feed: float) -> None:
    toolpath = strokes(*paths, feed=feed)
    program = target.target.write(toolpath, target.machine)
    read = target.target.read(program.data, target.machine)
    back = cut_points(read)
    # Very slow lines need so many pieces that a stroke becomes several jobs.
    longer = sum(finding.measured or 0 for finding in program.findings if finding.unit == "jobs")
    assert len(back) == len(paths) + longer
    found = [point for points in back for point in points]
    assert np.abs(np.array(found)[[0, -1]] - [paths[0][0], paths[-1][-1]]).max() < NEAR_MM
    # Each wanted vertex is there, in order; between two of them, pieces of one line.
    at = 0
    for point in (point for points in paths for point in points):
        while np.abs(np.array(found[at]) - point).max() >= NEAR_MM:
            at += 1
    assert worst(read.findings) < Severity.ERROR
    # A block of the program, by its map, ends where its move ends or on the way there.
    for row in np.flatnonzero(read.is_feed & (read.end[:, 2] < 0)).tolist():
        source = int(program.row_of_block[read.block[row]])
        if source >= 0:
            low = np.minimum(toolpath.starts[source], toolpath.end[source])
            high = np.maximum(toolpath.starts[source], toolpath.end[source])
            assert (read.end[row] >= low - NEAR_MM).all()
            assert (read.end[row] <= high + NEAR_MM).all()


@pytest.mark.parametrize("form", ["m", "stream"])
@examples(60, 10_000)
@given(paths=st.lists(stroke, min_size=1, max_size=4), counts=st.integers(1, 480))
def test_strokes_on_the_grid_come_back(form: str, paths: list[list[Point]], counts: int) -> None:
    paths = [points for points in map(kept, paths) if len(points) > 1]
    if paths:
        check_exact(router(f"format={form}"), paths, counts * 0.46875)


@given(points=rough_stroke, form=st.sampled_from(["m", "stream"]))
def test_any_stroke_comes_back_to_the_grid(points: list[Point], form: str) -> None:
    snapped = np.floor(np.array(points) / GRID_MM + 0.5) * GRID_MM
    if np.abs(np.diff(snapped, axis=0)).max() < GRID_MM / 2:
        return
    target = router(f"format={form}")
    read = target.target.read(
        target.target.write(strokes(points), target.machine).data, target.machine
    )
    (found,) = cut_points(read)
    for point in points:
        off = np.abs(np.array(found) - np.array(point)).max(axis=1).min()
        assert off <= GRID_MM / 2 + NEAR_MM


@given(stroke, st.integers(5, 480))
def test_a_program_written_again_keeps_its_vertices(points: list[Point], counts: int) -> None:
    """A decoded program can be written; every vertex of the first program is in the second."""
    target = router("speed=path")
    points = kept(points)
    if len(points) < 2:
        return
    first = target.target.write(strokes(points, feed=counts * 0.46875), target.machine).data
    again = target.target.write(target.target.read(first, target.machine), target.machine).data
    one, two = (
        {vertex for job in arrays(data) for vertex in zip(*job["xy"], strict=True)}
        for data in (first, again)
    )
    assert one <= two


@pytest.mark.parametrize("sample", ["star.csv", "logo.dxf", "coupon.dxf"])
@pytest.mark.parametrize("form", ["m", "stream"])
def test_samples_are_posted_and_verified(sample: str, form: str) -> None:
    from camtool.importers.read import read_drawing

    target = router(f"format={form}")
    posting = post_drawing(read_drawing(ROOT / "samples" / sample), job_of(), target)
    assert not posting.failed
    assert posting.verification is not None
    codes = {finding.code.name for finding in posting.findings}
    assert "PLACES_SNAPPED" in codes
    assert not codes & {"CONTOUR_MISSING", "EXTRA_CUT"}
