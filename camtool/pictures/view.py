"""The window in mm, the box of the page that shows it, and round numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats

PAGE = 1000.0
"""Width of an ordinary picture in units of the page, in which widths of lines and heights of
letters are given."""

ORDINARY_PX = (1000, 1200)
"""Pictures between these widths have a page of `PAGE` units.

The page of a smaller or larger picture is scaled by the square root of its size: letters grow with
the picture, but less than it does."""

MIN_PAGE = 560.0
"""Least width of a page in units: head, legend and numbers need it."""

MARGIN = 36.0

LOOK_AROUND = 2.0
"""Part zero and rapids are shown too, unless the window becomes more than this many times
larger."""

PADDING = 0.06
"""Room around the part, as a share of its larger side."""

MIN_WINDOW_MM = 1e-3
"""A part smaller than this, such as a point, gets a window of this size."""

EMPTY_WINDOW_MM = 10.0
"""Width of the window of a picture with nothing in it."""

WIDEST, TALLEST = 0.34, 0.88
"""Least and greatest height of the plot, as a share of its width."""

CROP_SHAPES = (0.2, 2.0)
"""The same where a part of the plane is asked for: within these it keeps its own shape."""

ROUND_STEPS = (1.0, 2.0, 5.0, 10.0)


class PageBox(Struct, frozen=True):
    """A rectangle with sides parallel to the axes; on the page `top` < `bottom`."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def width(self) -> float:
        return self.right - self.left

    @property
    def height(self) -> float:
        return self.bottom - self.top


class View(Struct, frozen=True):
    """`scale` page units per mm; `centre` (x, y) mm is shown in the middle of `box`."""

    box: PageBox
    scale: float
    centre: tuple[float, float]

    def page(self, x: float, y: float) -> tuple[float, float]:
        """Return the place on the page of a point in mm: Y is up in mm and down on the page."""
        across = (self.box.left + self.box.right) / 2.0
        middle_y = (self.box.top + self.box.bottom) / 2.0
        return (
            across + (x - self.centre[0]) * self.scale,
            middle_y - (y - self.centre[1]) * self.scale,
        )

    def matrix(self) -> str:
        """Return the SVG transform that maps mm to the page as `page` does."""
        x, y = self.page(0.0, 0.0)
        return f"matrix({self.scale:.9g} 0 0 {-self.scale:.9g} {x:.9g} {y:.9g})"

    def mm(self, units: float) -> float:
        """Return a length on the page, such as a line width, in mm; four digits are enough."""
        return float(f"{units / self.scale:.4g}")

    @property
    def x_range(self) -> tuple[float, float]:
        """Lowest and highest X that the view shows, mm."""
        half = self.box.width / self.scale / 2.0
        return self.centre[0] - half, self.centre[0] + half

    @property
    def y_range(self) -> tuple[float, float]:
        """Lowest and highest Y that the view shows, mm."""
        half = self.box.height / self.scale / 2.0
        return self.centre[1] - half, self.centre[1] + half

    def shows(self, x: float, y: float) -> bool:
        """Return True if the view shows a point in mm."""
        (x0, x1), (y0, y1) = self.x_range, self.y_range
        return x0 <= x <= x1 and y0 <= y <= y1


def page_width(size_px: int) -> float:
    """Return the width, in units of the page, of a picture that is `size_px` wide."""
    low, high = ORDINARY_PX
    if low <= size_px <= high:
        return PAGE
    width = PAGE * math.sqrt(size_px / (low if size_px < low else high))
    return max(float(round(width)), MIN_PAGE)


def union(boxes: Iterable[Floats | None]) -> Floats | None:
    """Return the extents [[xmin, xmax], [ymin, ymax]] of all boxes that are not None."""
    present = [box for box in boxes if box is not None]
    if not present:
        return None
    stacked = np.stack(present)
    return np.column_stack([stacked[:, :, 0].min(axis=0), stacked[:, :, 1].max(axis=0)])


def points_box(points: Floats) -> Floats | None:
    """Return the extents (2, 2), [[xmin, xmax], [ymin, ymax]], of points (P, 2); None without
    any."""
    if not len(points):
        return None
    return np.column_stack([points.min(axis=0), points.max(axis=0)])


def window(part: Floats | None, surroundings: Floats | None) -> Floats:
    """Return the window to show, mm: the part with its surroundings, or the part alone if these
    reach far away from it."""
    joined = union([part, surroundings])
    if joined is None:
        half = EMPTY_WINDOW_MM / 2.0
        return np.array([[-half, half], [-half / 2.0, half / 2.0]])
    if part is not None and _larger(part) > 0.0 and _larger(joined) > LOOK_AROUND * _larger(part):
        joined = part
    size = max(_larger(joined), MIN_WINDOW_MM)
    pad = PADDING * size if _larger(joined) > 0.0 else 0.5 * size
    return np.asarray(joined + np.array([-pad, pad]))


def fit(
    shown: Floats,
    left: float,
    top: float,
    right: float,
    shapes: tuple[float, float] = (WIDEST, TALLEST),
) -> View:
    """Return the view that shows a window in a box from `left` to `right`.

    The box has the shape of the window; `shapes` are the least and the greatest height, as a share
    of the width."""
    sizes = shown[:, 1] - shown[:, 0]
    left, top, right = float(math.ceil(left)), float(math.ceil(top)), float(math.floor(right))
    width = right - left
    height = width * min(max(float(sizes[1] / sizes[0]), shapes[0]), shapes[1])
    scale = min(width / float(sizes[0]), height / float(sizes[1]))
    middle = shown.mean(axis=1)
    # The matrix is written with nine digits.
    return View(
        PageBox(left, top, right, top + round(height)),
        float(f"{scale:.9g}"),
        (float(middle[0]), float(middle[1])),
    )


def _larger(box: Floats) -> float:
    return float(np.max(box[:, 1] - box[:, 0]))


def round_step(min_step: float) -> float:
    """Return the smallest of 1, 2, 5 × 10ⁿ that is not below `min_step`."""
    power = 10.0 ** math.floor(math.log10(min_step))
    return next(step * power for step in ROUND_STEPS if step * power >= min_step)


def round_length(max_length: float) -> float:
    """Return the largest of 1, 2, 5 × 10ⁿ that is not above `max_length`."""
    power = 10.0 ** math.floor(math.log10(max_length))
    return max(step * power for step in ROUND_STEPS if step * power <= max_length)


def decimals_of(step: float) -> int:
    """Return the number of decimals that multiples of a round step need."""
    return max(0, -math.floor(math.log10(step)))


def multiples(low: float, high: float, step: float) -> list[float]:
    """Return the multiples of `step` from low to high."""
    return [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
