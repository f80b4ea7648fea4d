"""The palette and the map of errors."""

from itertools import combinations, pairwise

import numpy as np
import pytest

from camtool.pictures import colours


def lightness(colour: str) -> float:
    """Relative luminance 0 … 1 of "#rrggbb" (WCAG 2.1)."""
    channels = [int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("dark", [False, True])
def test_the_map_grows_lighter_all_along(dark: bool) -> None:
    light = [lightness(colour) for colour in colours.bin_colours(dark=dark)]
    assert len(light) == colours.BINS
    assert all(low < high for low, high in pairwise(light))


def test_the_map_stays_visible_on_paper() -> None:
    # WCAG contrast (1.05 / (L + 0.05)) above 2 even at the light end.
    assert all(1.05 / (lightness(colour) + 0.05) > 2.0 for colour in colours.bin_colours())


def test_the_map_meets_its_anchors_and_mixes_between() -> None:
    assert colours.sequential(0.0) == "#0d0887"
    assert colours.sequential(1.0) == "#f8963c"
    assert colours.sequential(1.0 / 12.0) == "#2b0694"


@pytest.mark.parametrize("fraction", [-0.01, 1.01, float("nan")])
def test_outside_the_map_there_is_no_colour(fraction: float) -> None:
    with pytest.raises(ValueError, match="outside"):
        colours.sequential(fraction)


def test_layers_differ() -> None:
    assert len(set(colours.LAYER_COLOURS)) == len(colours.LAYER_COLOURS)


def test_the_dark_map_stays_visible_on_its_ground() -> None:
    ground = lightness(painted(colours.PLOT)) + 0.05
    for colour in colours.bin_colours(dark=True):
        assert (lightness(colour) + 0.05) / ground > 2.8


@pytest.mark.parametrize("name", ["INK", "QUIET", "FEED", "RAPID", "PLUNGE", "GAP", *range(7)])
def test_lines_and_letters_are_seen_on_the_dark_ground(name: str | int) -> None:
    colour = colours.LAYER_COLOURS[name] if isinstance(name, int) else getattr(colours, name)
    ground = lightness(painted(colours.PLOT)) + 0.05
    assert (lightness(painted(colour)) + 0.05) / ground > 4.0


def test_layers_differ_on_the_dark_ground_too() -> None:
    assert len({painted(colour) for colour in colours.LAYER_COLOURS}) == len(colours.LAYER_COLOURS)


@pytest.mark.parametrize("dark", [False, True])
def test_layers_differ_for_the_red_and_the_green_blind(dark: bool) -> None:
    layers = [painted(colour) if dark else colour for colour in colours.LAYER_COLOURS]
    for matrix in BLIND.values():
        seen = [np.clip(matrix @ linear(colour), 0.0, 1.0) for colour in layers]
        for one, other in combinations(seen, 2):
            assert np.abs(one ** (1 / 2.2) - other ** (1 / 2.2)).max() > 0.1


BLIND = {
    "protan": np.array(
        [[0.1523, 1.0526, -0.2049], [0.1145, 0.7863, 0.0992], [-0.0039, -0.0481, 1.0520]]
    ),
    "deutan": np.array(
        [[0.3673, 0.8606, -0.2280], [0.2801, 0.6725, 0.0474], [-0.0118, 0.0429, 0.9689]]
    ),
}
"""Machado, Oliveira and Fernandes 2009, severity 1, for linear RGB."""


def linear(colour: str) -> np.ndarray:
    channels = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return channels**2.2


def painted(colour: str) -> str:
    """Return the colour that replaces this one in the dark palette."""
    return colours.darkened(f'fill="{colour}"')[6:-1]


def test_names_that_look_like_colours_are_left_alone() -> None:
    assert colours.darkened("<title>#ffffff</title>") == "<title>#ffffff</title>"


def test_every_colour_of_the_palette_has_one_on_dark_ground() -> None:
    own = {name: value for name, value in vars(colours).items() if name.isupper()}
    names = {name: value for name, value in own.items() if str(value).startswith("#")}
    assert "STOCK" in names
    missing = [name for name, value in names.items() if not colours.on_dark(value)]
    missing += [each for each in colours.LAYER_COLOURS if not colours.on_dark(each)]
    assert missing == []
