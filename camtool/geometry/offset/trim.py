"""Stage 2: elements without the ends that are too near to the source."""

from __future__ import annotations

import numpy as np

from camtool.geometry.measure import point_at
from camtool.geometry.offset.curves import curve_rows_of
from camtool.geometry.offset.near import Near
from camtool.geometry.offset.raw import RawOffset
from camtool.geometry.offset.way import Way
from camtool.geometry.polylines import Floats, Segments

TRIM_SPARE = 10.0
"""Ends stay that are too near by so many times `validity_eps_mm`: the tips that are left beyond
the last cut are then judged to be invalid."""


def trim_raw(raw: RawOffset, near: Near, way: Way) -> RawOffset:
    """The raw offset without what is surely too near at both ends of each element.

    What goes could never be kept, and what is kept is not cut by it: this only saves cuts, which
    would grow with the square of the number of elements where the distance is large against them.
    """
    from camtool.kernels.offset_near import trimmed_ends

    spare = TRIM_SPARE * way.options.validity_eps_mm
    ends = trimmed_ends(curve_rows_of(raw.elements), near.arrays, (way.distance_mm, spare))
    low, high = ends.T
    keep = np.flatnonzero(low < high)
    trimmed = _between(raw.elements[keep], low[keep], high[keep])
    return RawOffset(trimmed, raw.source[keep], raw.join[keep], raw.kites)


def _between(elements: Segments, low: Floats, high: Floats) -> Segments:
    """The part of each element between two fractions; elements that are whole stay the same."""
    cut = np.flatnonzero((low != 0.0) | (high != 1.0))
    start, end, bulge = elements.start.copy(), elements.end.copy(), elements.bulge.copy()
    start[cut] = point_at(elements, cut, low[cut])
    end[cut] = point_at(elements, cut, high[cut])
    bulge[cut] = np.tan(0.25 * elements.sweep[cut] * (high - low)[cut])
    return Segments.between(start, end, bulge)
