"""Pictures as values: SVG text, or the bytes of a file by its name; and a page's close-ups."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from camtool.pictures.beside import draw_beside, render_beside
from camtool.pictures.draw import draw, render
from camtool.pictures.options import AS_USUAL, PictureOptions
from camtool.pictures.overlay import Overlay, draw_overlay, render_overlay
from camtool.pictures.scene import Scene
from camtool.records import replace
from camtool.units import UM_PER_MM


@dataclass(frozen=True, eq=False, repr=False)
class Picture:
    """A picture of `scene` (several: beside each other, at one scale) with these options; equal
    values give equal bytes."""

    scene: Scene | Overlay | tuple[Scene, ...]
    options: PictureOptions = AS_USUAL

    @property
    def svg(self) -> str:
        """The picture as SVG text; OptionError for options that make no picture."""
        if isinstance(self.scene, tuple):
            return draw_beside(self.scene, self.options)
        if isinstance(self.scene, Overlay):
            return draw_overlay(self.scene, self.options)
        return draw(self.scene, self.options)

    def render(self, name: str) -> bytes:
        """Return the bytes of a file with this name: .svg, .png, or .html, the viewer's page of
        one scene, without options.

        OutputError for other extensions, OptionError for options that do not fit."""
        if isinstance(self.scene, tuple):
            return render_beside(self.scene, name, self.options)
        if isinstance(self.scene, Overlay):
            return render_overlay(self.scene, name, self.options)
        return render(self.scene, name, self.options)

    def save(self, file: str | Path) -> None:
        """Write the picture to a file, in the format of its extension; raises as `render` does."""
        Path(file).write_bytes(self.render(str(file)))

    def __repr__(self) -> str:
        scenes = self.scene if isinstance(self.scene, tuple) else (self.scene,)
        titles = " and ".join(scene.title for scene in scenes if scene.title)
        return f"<Picture of {titles}>" if titles else "<Picture>"

    def _repr_svg_(self) -> str:
        return self.svg


ERRORS_ACROSS = 16.0
"""Width of a close-up in largest errors: it shows single steps and the line that they follow."""

MIN_SHARE = 0.02
"""Least width of a close-up as a share of the predicted path, whose points are no finer."""


def closeups(scene: Scene, options: PictureOptions) -> Iterator[tuple[str, PictureOptions]]:
    """Yield the caption and the options of each close-up of a scene: the place of the largest
    error, and the worst circle.

    There are none where nothing was predicted. Size and ground are those of `options`, the rest is
    as usual."""
    usual = PictureOptions(size_px=options.size_px, dark=options.dark)
    points, errors = scene.trace_points, scene.trace_error_mm
    if points is not None and errors is not None and scene.worst and len(points):
        size = float(np.ptp(points, axis=0).max())
        largest = float(errors[scene.trace_cutting].max(initial=0.0))
        side = max(ERRORS_ACROSS * largest, MIN_SHARE * size)
        if 0.0 < side < 0.5 * size:
            x, y = scene.worst[0]
            shown = (x - 0.5 * side, y - 0.5 * side, side, side)
            yield f"The largest error, near ({x:.3f}, {y:.3f}) mm", replace(usual, crop_mm=shown)
    errors_mm = [one.circular_mm for one in scene.rounds if math.isfinite(one.circular_mm)]
    if errors_mm:
        worst = max(errors_mm)
        number = next(k for k, one in enumerate(scene.rounds, 1) if one.circular_mm == worst)
        caption = (
            f"Circle {number}, that of the largest circular error, {worst * UM_PER_MM:.2f} µm"
        )
        yield caption, replace(usual, polar=number)


LAID = frozenset({"drawing", "stock", "pins", "zero"})
"""The layers of a picture that shows how the stock lies on the machine."""


def on_stock(
    scene: Scene, swept_mm: tuple[float, float, float, float] | None = None
) -> tuple[Scene, PictureOptions] | None:
    """Return a scene of the drawing on its stock and the options to draw it; None without a
    drawing.

    It shows part zero, pins, the line about which the part is turned over, and `swept_mm`, the box
    that tools and holders pass over."""
    if scene.drawing is None:
        return None
    laid = Scene(
        drawing=scene.drawing,
        stock_mm=scene.stock_mm,
        swept_mm=swept_mm,
        pins=scene.pins,
        flips=scene.flips,
    )
    return laid, PictureOptions(layers=LAID)
