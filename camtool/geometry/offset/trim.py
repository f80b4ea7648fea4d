"""Stage 2: elements without the ends that are too near to the source, if cheaply told."""

from __future__ import annotations

import numpy as np

from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.offset.marks import at_most, marks_of
from camtool.geometry.offset.options import OffsetOptions
from camtool.geometry.offset.raw import RawOffset
from camtool.geometry.polylines import Floats, Polylines, Segments

TRIM_ROUNDS = 12
"""How often the ends of an element are moved on, at most."""

TRIM_STEP_SHARE = 0.02
"""An end that moves on by less than this share of the distance is left where it is."""


def trim_raw(
    raw: RawOffset, lines: Polylines, distance_mm: float, options: OffsetOptions
) -> RawOffset:
    """The raw offset of the paths without what is surely too near at both ends of each element.

    The distance from the source changes by no more than the way along an element: where it falls
    short by s, all is too near for the length s from there. The distance from some points of the
    source is no less than that, and will do. What goes could never be kept, and what is kept is
    not cut by it: this only saves cuts, which would grow with the square of the number of
    elements where the distance is large against them.
    """
    elements = raw.elements
    marks = marks_of(lines)
    lengths = segment_lengths(elements)
    low, high = np.zeros(len(elements)), np.ones(len(elements))
    for end, forth in ((low, 1.0), (high, -1.0)):
        moving = np.flatnonzero(low < high)
        for _ in range(TRIM_ROUNDS):
            distance = at_most(point_at(elements, moving, end[moving]), marks)
            step = distance_mm - options.validity_eps_mm - distance
            on = step > TRIM_STEP_SHARE * distance_mm
            moving = moving[on]
            end[moving] += forth * step[on] / lengths[moving]
            moving = moving[low[moving] < high[moving]]
    keep = np.flatnonzero(low < high)
    trimmed = _between(elements, low, high)[keep]
    return RawOffset(trimmed, raw.source[keep], raw.join[keep])


def _between(elements: Segments, low: Floats, high: Floats) -> Segments:
    """The part of each element between two fractions; elements that are whole stay the same."""
    rows = np.arange(len(elements))
    start, end = point_at(elements, rows, low), point_at(elements, rows, high)
    bulge = np.tan(0.25 * elements.sweep * (high - low))
    whole = (low == 0.0) & (high == 1.0)
    return Segments.between(start, end, np.where(whole, elements.bulge, bulge))
