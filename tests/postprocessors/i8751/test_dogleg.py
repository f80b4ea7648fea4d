"""Lines as records: the dog-leg's formula, and lines cut so that it stays near."""

import math

import numpy as np
import pytest
from camtool_postprocessors.i8751.dogleg import FREE, StepLine, elbows, reaches
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles.corte_recto import farthest, walk

STEPS = st.integers(-400, 400)


def places_of(pieces: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Every place that the motors stand at, record after record."""
    x, y = 0, 0
    places = []
    for dx, dy in pieces:
        places += [(x + px, y + py) for px, py in walk(dx, dy)]
        x, y = x + dx, y + dy
    return places


def formula_mm(dx: int, dy: int, step_mm: tuple[float, float]) -> float:
    """sx·sy·b·(a − b) / L."""
    length = math.hypot(dx * step_mm[0], dy * step_mm[1])
    return step_mm[0] * step_mm[1] * float(elbows(np.array([[dx, dy]]))[0]) / length


@pytest.mark.parametrize(
    ("steps", "strays"),
    [((100, 50), 22.36), ((100, 41), 22.38), ((100, 100), 0), ((300, 100), 63.25)],
)
def test_known_elbows(steps: tuple[int, int], strays: float) -> None:
    assert formula_mm(*steps, (1.0, 1.0)) == pytest.approx(strays, abs=0.005)


@given(dx=STEPS, dy=STEPS, x_mm=st.floats(0.5, 2.0), y_mm=st.floats(0.5, 2.0))
def test_the_elbow_is_the_farthest_place(dx: int, dy: int, x_mm: float, y_mm: float) -> None:
    if not (dx or dy):
        return
    strays = farthest(walk(dx, dy), (dx, dy), (x_mm, y_mm))
    assert strays == pytest.approx(formula_mm(dx, dy, (x_mm, y_mm)), abs=1e-9)


@given(
    dx=STEPS,
    dy=STEPS,
    x_mm=st.floats(0.5, 2.0),
    y_mm=st.floats(0.5, 2.0),
    above=st.floats(0.0, 20.0),
    most=st.sampled_from([1, 7, 100, 65535]),
)
def test_cut_lines_stay_within_the_tolerance(
    dx: int, dy: int, x_mm: float, y_mm: float, above: float, most: int
) -> None:
    if not (dx or dy):
        return
    step_mm = (x_mm, y_mm)
    tolerance = 0.5 * max(step_mm) + above
    reach = int(reaches(np.array([[dx, dy]]), step_mm, tolerance)[0])
    pieces = StepLine(dx, dy, reach).pieces(most)
    assert (sum(x for x, _ in pieces), sum(y for _, y in pieces)) == (dx, dy)
    assert all((x or y) and max(abs(x), abs(y)) <= most for x, y in pieces)
    assert farthest(places_of(pieces), (dx, dy), step_mm) <= tolerance * (1.0 + 1e-9)


@given(dx=STEPS, dy=STEPS, tolerance=st.floats(1.0, 20.0))
def test_no_more_records_than_the_formula_says(dx: int, dy: int, tolerance: float) -> None:
    if not (dx or dy):
        return
    reach = int(reaches(np.array([[dx, dy]]), (1.0, 1.0), tolerance)[0])
    # Whole steps take at most one step from each reach.
    near = tolerance - 0.5
    wanted = math.ceil((formula_mm(dx, dy, (1.0, 1.0)) / near + 1.0) / 2.0)
    assert len(StepLine(dx, dy, reach).pieces(65535)) <= max(1, wanted)


@pytest.mark.parametrize("steps", [(500, 0), (0, -500), (-500, 500), (500, 200)])
def test_a_line_that_nothing_binds_is_one_record(steps: tuple[int, int]) -> None:
    assert StepLine(*steps).pieces(65535) == [steps]


def test_steps_beyond_two_bytes_are_split() -> None:
    assert StepLine(200_000, 0, FREE).pieces(65535) == [(65535, 0)] * 3 + [(3395, 0)]
    assert StepLine(-70_000, 70_000, FREE).pieces(65535) == [(-65535, 65535), (-4465, 4465)]


def test_the_finest_tolerance_is_a_bresenham_line() -> None:
    """Half a step: the path is that of single steps, some of them joined to one record."""
    reach = int(reaches(np.array([[1000, 410]]), (1.0, 1.0), 0.5)[0])
    pieces = StepLine(1000, 410, reach).pieces(65535)
    assert farthest(places_of(pieces), (1000, 410), (1.0, 1.0)) <= 0.5
    assert len(pieces) <= 411


def test_both_ways_look_alike_in_every_octant() -> None:
    reach = int(reaches(np.array([[300, 120]]), (1.0, 1.0), 5.0)[0])
    first = StepLine(300, 120, reach).pieces(65535)
    for right in (1, -1):
        for up in (1, -1):
            mirrored = [(right * x, up * y) for x, y in first]
            assert StepLine(300 * right, 120 * up, reach).pieces(65535) == mirrored
            turned = [(up * y, right * x) for x, y in first]
            assert StepLine(120 * up, 300 * right, reach).pieces(65535) == turned
