"""The palette and the map of errors."""

from itertools import pairwise

import pytest

from camtool.preview import colours


def test_the_map_grows_lighter_all_along() -> None:
    light = [colours.lightness(colour) for colour in colours.bin_colours()]
    assert len(light) == colours.BINS
    assert all(low < high for low, high in pairwise(light))


def test_the_map_stays_visible_on_paper() -> None:
    # WCAG contrast (1.05 / (L + 0.05)) above 2 even at the light end.
    assert all(1.05 / (colours.lightness(colour) + 0.05) > 2.0 for colour in colours.bin_colours())


def test_the_map_meets_its_anchors_and_mixes_between() -> None:
    assert colours.sequential(0.0) == "#0d0887"
    assert colours.sequential(1.0) == "#f8963c"
    assert colours.sequential(1.0 / 12.0) == "#2b0694"


@pytest.mark.parametrize("fraction", [-0.01, 1.01, float("nan")])
def test_outside_the_map_there_is_no_colour(fraction: float) -> None:
    with pytest.raises(ValueError, match="outside"):
        colours.sequential(fraction)


def test_layers_differ() -> None:
    assert len(set(colours.LAYERS)) == len(colours.LAYERS)
