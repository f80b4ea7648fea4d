"""What a page shows of a verified part besides the whole: its worst place, and a circle's plot."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from camtool.preview.options import Options
from camtool.preview.scene import Scene
from camtool.units import UM_PER_MM

ERRORS_ACROSS = 16.0
"""A close-up is so many times the largest error wide: steps show, and what they are a step of."""

LEAST_SHARE = 0.02
"""It is no smaller than this share of the predicted path: its points are not finer."""


def closeups(scene: Scene, options: Options) -> Iterator[tuple[str, Options]]:
    """Caption and looks of each close-up; none where nothing was predicted. Size and ground are
    those of `options`, the rest is as usual."""
    plain = Options(size_px=options.size_px, dark=options.dark)
    points, errors = scene.trace_points, scene.trace_error_mm
    if points is not None and errors is not None and scene.worst and len(points):
        size = float(np.ptp(points, axis=0).max())
        largest = float(errors[scene.trace_cutting].max(initial=0.0))
        side = max(ERRORS_ACROSS * largest, LEAST_SHARE * size)
        if 0.0 < side < 0.5 * size:
            x, y = scene.worst[0]
            shown = (x - 0.5 * side, y - 0.5 * side, side, side)
            yield f"The largest error, near ({x:.3f}, {y:.3f}) mm", replace(plain, crop_mm=shown)
    known = [one.circular_mm for one in scene.rounds if math.isfinite(one.circular_mm)]
    if known:
        worst = max(known)
        number = next(k for k, one in enumerate(scene.rounds, 1) if one.circular_mm == worst)
        said = f"Circle {number}, that of the largest circular error, {worst * UM_PER_MM:.2f} µm"
        yield said, replace(plain, polar=number)
