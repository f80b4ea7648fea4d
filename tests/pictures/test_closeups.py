"""Close-ups: the worst place with its surroundings, and the circle that came out worst."""

import math

import numpy as np
import pytest

from camtool.kernels.judging import empty_bins
from camtool.pictures.options import PictureOptions
from camtool.pictures.picture import ERRORS_ACROSS, MIN_SHARE, closeups
from camtool.pictures.scene import Round, Scene
from camtool.records import replace

LENGTH_MM = 10.0


def bent(error_mm: float) -> Scene:
    """A path along X with an error at (4, 0), and a larger one where nothing is cut."""
    x = np.linspace(0.0, LENGTH_MM, 101)
    error = np.zeros(101)
    error[40], error[80] = error_mm, 5.0
    return Scene(
        trace_points=np.column_stack([x, np.zeros(101)]),
        trace_error_mm=error,
        trace_cutting=np.arange(101) != 80,
        worst=((4.0, 0.0), (1.0, 0.0)),
    )


def circle(circular_mm: float) -> Round:
    flat = (0.0, 0.0, 0.0)
    return Round((0.0, 0.0), 1.0, True, empty_bins(1)[0], circular_mm, flat, (0.0, 0.0))


@pytest.mark.parametrize(
    ("error_mm", "side"), [(0.05, 0.05 * ERRORS_ACROSS), (1e-4, MIN_SHARE * LENGTH_MM)]
)
def test_the_worst_place_lies_in_the_middle(error_mm: float, side: float) -> None:
    asked = PictureOptions(size_px=500, dark=True, exaggerate=9.0)
    ((caption, looks),) = closeups(bent(error_mm), asked)
    assert caption == "The largest error, near (4.000, 0.000) mm"
    assert looks.crop_mm == pytest.approx((4.0 - side / 2, -side / 2, side, side))
    assert (looks.size_px, looks.dark, looks.exaggerate) == (500, True, 1.0)


def test_an_error_as_large_as_the_part_needs_no_close_up() -> None:
    assert list(closeups(bent(0.4), PictureOptions())) == []


def test_what_was_not_judged_has_none() -> None:
    assert list(closeups(Scene(), PictureOptions())) == []
    assert list(closeups(replace(bent(0.05), worst=()), PictureOptions())) == []


def test_the_circle_is_the_worst_of_those_that_are_known() -> None:
    rounds = tuple(map(circle, (0.01, math.nan, 0.03, 0.02)))
    ((caption, looks),) = closeups(Scene(rounds=rounds), PictureOptions())
    assert looks.polar == 3
    assert caption == "Circle 3, that of the largest circular error, 30.00 µm"
    assert list(closeups(Scene(rounds=(circle(math.nan),)), PictureOptions())) == []
