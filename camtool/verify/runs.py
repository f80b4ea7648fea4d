"""Runs of neighbours in long columns, without loops over them.

A run is given by offsets: run g is items[offsets[g]:offsets[g+1]], never empty.
"""

from __future__ import annotations

import numpy as np

from camtool.geometry.polylines import Floats, Ints


def run_offsets(labels: Ints, longest: int) -> Ints:
    """Offsets (G+1,) of the runs of equal labels (J,), cut to at most `longest` items."""
    if len(labels) == 0:
        return np.zeros(1, dtype=np.int64)
    change = np.concatenate([[0], np.flatnonzero(np.diff(labels)) + 1])
    begun = np.repeat(change, np.diff(np.append(change, len(labels))))
    begin = np.flatnonzero((np.arange(len(labels)) - begun) % longest == 0)
    return np.append(begin, len(labels))


def run_peaks(values: Floats, offsets: Ints) -> Ints:
    """(G,) index of the first largest value in each run."""
    run = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    largest = np.maximum.reduceat(values, offsets[:-1])
    hits = np.flatnonzero(values == largest[run])
    return hits[np.flatnonzero(np.diff(run[hits], prepend=-1))]


def group_boxes(points: Floats, offsets: Ints) -> Floats:
    """(G, 4) xmin, ymin, xmax, ymax of each group of points (J, 2)."""
    low = np.minimum.reduceat(points, offsets[:-1], axis=0)
    high = np.maximum.reduceat(points, offsets[:-1], axis=0)
    return np.concatenate([low, high], axis=1)


def ranges(first: Ints, count: Ints) -> Ints:
    """first[0], first[0]+1, … (count[0] of them), first[1], …"""
    skipped = np.cumsum(count) - count
    return np.repeat(first - skipped, count) + np.arange(int(count.sum()))
