"""The look of a picture: its size, its part of the plane, its palette, its layers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from camtool.errors import OptionError
from camtool.records import FrozenRecord

MIN_PX, MAX_PX = 16, 20_000

SVG_WIDTH_PX, PNG_WIDTH_PX = 1000, 1200

POINTS_OF_A_PAGE = 400_000
"""At most this many points of the slides' path go to the viewer: enough for the ends of 200,000
moves and the largest error within each."""

VIEWS = ("plan", "iso", "bottom", "front", "side", "top", "leftover", "gouge")
"""Views: the moves from above; the stock after the program, aslant, from the front, from the right
and from above; and, by colour, where it is higher or lower than wanted."""

MIN_TIMES, MAX_TIMES = 1.0, 1e6
"""Least and greatest factor by which errors may be exaggerated."""


@dataclass(frozen=True, repr=False, eq=False)
class PictureOptions(FrozenRecord):
    """Options of a picture.

    `view`: one of VIEWS, the plane picture of moves or a picture of the stock. `size_px` is the
    width, None: as usual. `crop_mm` (x, y, width, height): only this part of the plane, with more
    beside or above it where it is very long or very high. `dark`: on a dark ground. `exaggerate`:
    the factor by which the distance of the predicted path from the wanted one is drawn larger.
    `polar`: the plot of the radial errors of this circle, from 1, in place of the picture.
    `layers`: the names of the layers to show, None: the usual ones.

    OptionError for a size or a part that makes no picture, a factor out of range, and a part, a
    factor or layers with `polar` or a view of the stock."""

    size_px: int | None = None
    crop_mm: tuple[float, float, float, float] | None = None
    dark: bool = False
    exaggerate: float = 1.0
    layers: frozenset[str] | None = None
    polar: int | None = None
    view: str = "plan"

    def __post_init__(self) -> None:
        if self.size_px is not None:
            check_width(self.size_px)
        if not MIN_TIMES <= self.exaggerate <= MAX_TIMES:
            raise OptionError(
                f"errors cannot be drawn {self.exaggerate:g} times as large",
                mend=f"take {MIN_TIMES:g} to {MAX_TIMES:g}",
            )
        crop = self.crop_mm
        if crop is not None and not (
            all(map(math.isfinite, crop)) and crop[2] > 0.0 and crop[3] > 0.0
        ):
            raise OptionError(
                f"a part of {crop[2]:g} × {crop[3]:g} mm cannot be shown",
                mend="give X,Y,WIDTH,HEIGHT, the last two above 0",
            )
        if self.polar is not None and (crop, self.exaggerate, self.layers) != (None, 1.0, None):
            raise OptionError(
                "a circle is plotted alone: without crop and layers, and with a factor of its own",
                mend="drop polar, or crop_mm, exaggerate and layers",
            )
        if self.view not in VIEWS:
            raise OptionError(f"unknown view {self.view!r}", mend=f"use one of {', '.join(VIEWS)}")
        if self.view != "plan" and (self.exaggerate, self.layers, self.polar) != (1.0, None, None):
            raise OptionError(
                f"the view {self.view} shows the stock alone",
                mend="drop view, or exaggerate, layers and polar",
            )


AS_USUAL = PictureOptions()


def check_width(width_px: int) -> None:
    """Raise OptionError for a width out of range."""
    if not MIN_PX <= width_px <= MAX_PX:
        raise OptionError(
            f"a picture cannot be {width_px} pixels wide", mend=f"take {MIN_PX} to {MAX_PX}"
        )


def points_for(pictures: Sequence[str]) -> int | None:
    """Return the number of points of the slides' path to keep for pictures with these file names:
    0 without pictures, None for the default number."""
    if any(name.lower().endswith(".html") for name in pictures):
        return POINTS_OF_A_PAGE
    return None if pictures else 0
