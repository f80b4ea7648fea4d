"""Random polylines with bulges for hypothesis.

polylines()       anything that is a polyline: it may cross itself
contours()        closed, star-shaped about (0, 0), never crossing itself
open_contours()   the same with one segment left out
"""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from camtool.geometry.polylines import Polyline

GRID_MM = 1e-3
"""Random points lie on a grid, so that two of them are equal or clearly apart."""


SHARE = {"default": 0.3, "checked": 0.2, "nightly": 30.0}[
    os.environ.get("HYPOTHESIS_PROFILE", "default")
]
"""The part of the examples that a property asks for: by day few (they are the same in every run),
fewer with checked kernels, and many at night."""
MIN_EXAMPLES = 5


def scaled(number: int) -> int:
    """Return how many examples are tried where a property asks for this number. Of few, all are:
    the first one is always the simplest."""
    return max(min(number, MIN_EXAMPLES), math.ceil(number * SHARE))


def examples(number: int, nightly: int | None = None, **more: Any) -> settings:
    """Return the settings of a property: a number of examples, scaled for the kind of run, or
    what it says for the night where each costs much."""
    at_night = SHARE > 1.0 and nightly is not None
    return settings(max_examples=nightly if at_night else scaled(number), **more)


def coordinates(reach_mm: float = 20.0) -> st.SearchStrategy[float]:
    """Numbers in mm on the grid, within ± reach_mm."""
    steps = round(reach_mm / GRID_MM)
    return st.integers(-steps, steps).map(lambda step: step * GRID_MM)


def bulges() -> st.SearchStrategy[float]:
    """0, half circles, quarter circles and anything between; shallow ones too."""
    quarter = math.tan(math.pi / 8.0)
    special = st.sampled_from([0.0, 1.0, -1.0, quarter, -quarter, 1e-4, -1e-6])
    return st.one_of(st.just(0.0), special, st.floats(-1.0, 1.0).map(_no_speck))


@st.composite
def polylines(
    draw: st.DrawFn, closed: bool | None = None, max_points: int = 8, reach_mm: float = 20.0
) -> Polyline:
    """Any polyline of 2 to `max_points` points; closed or open, or as it comes (None)."""
    points = draw(
        st.lists(
            st.tuples(coordinates(reach_mm), coordinates(reach_mm)),
            min_size=2,
            max_size=max_points,
            unique=True,
        )
    )
    bends = draw(st.lists(bulges(), min_size=len(points), max_size=len(points)))
    ring = draw(st.booleans()) if closed is None else closed
    return Polyline(np.column_stack([points, bends]), ring)


@st.composite
def contours(draw: st.DrawFn, max_points: int = 12, clockwise: bool | None = None) -> Polyline:
    """A closed contour about (0, 0), 1 to 10 mm from it, that never crosses itself.

    Each segment stays in its own wedge: seen from (0, 0), no wedge is as wide as 180°, and each
    arc leaves its chord by less than the chord's angle with either side of the wedge.
    """
    count = draw(st.integers(3, max_points))
    jitter = draw(st.lists(st.floats(0.0, 0.4), min_size=count, max_size=count))
    angles = (np.arange(count) + np.array(jitter)) * (2.0 * math.pi / count)
    radii = np.array(draw(st.lists(st.floats(1.0, 10.0), min_size=count, max_size=count)))
    points = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    parts = draw(
        st.lists(
            st.one_of(st.just(0.0), st.floats(-0.9, 0.9).map(_no_speck)),
            min_size=count,
            max_size=count,
        )
    )
    bends = [_bulge(points[i], points[(i + 1) % count], part) for i, part in enumerate(parts)]
    path = Polyline(np.column_stack([points, bends]), True)
    if draw(st.booleans()) if clockwise is None else clockwise:
        return Polyline(path.vertices * np.array([-1.0, 1.0, -1.0]), True)
    return path


@st.composite
def open_contours(draw: st.DrawFn, max_points: int = 12) -> Polyline:
    """An open path that never crosses itself."""
    return Polyline(draw(contours(max_points)).vertices, False)


def _bulge(start: np.ndarray, end: np.ndarray, part: float) -> float:
    """The largest bulge that keeps to the wedge of (0, 0), start, end, times `part`.

    An arc leaves its chord at both ends by sweep/2 = 2·atan(bulge).
    """
    chord = end - start
    length = math.hypot(*chord)
    at_start = math.acos(_cosine(-start @ chord, math.hypot(*start) * length))
    at_end = math.acos(_cosine(end @ chord, math.hypot(*end) * length))
    inward, outward = min(at_start, at_end), math.pi - max(at_start, at_end)
    # Travel is CCW about (0, 0): a positive bulge lies on the right, outward.
    room = outward if part > 0.0 else inward
    return part * min(1.0, math.tan(0.5 * min(room, 0.5 * math.pi)))


def _cosine(dot: float, lengths: float) -> float:
    return max(-1.0, min(1.0, dot / lengths))


def _no_speck(number: float) -> float:
    """Numbers so small that their square is 0 are no bulges of any drawing."""
    return number if abs(number) >= 1e-9 else 0.0
