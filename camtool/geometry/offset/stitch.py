"""Stages 5 and 6: kept slices joined to loops, and loops made clean paths."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from camtool.geometry.measure import path_lengths, signed_areas
from camtool.geometry.offset.curves import curve_rows_of
from camtool.geometry.offset.options import OffsetOptions
from camtool.geometry.offset.slices import Slices
from camtool.geometry.polylines import Bools, Ints, Polylines, Segments


def without_doubles(slices: Slices, elements: Segments, options: OffsetOptions) -> Slices:
    """The slices without repetitions, and without pairs that run the same way to and fro.

    Such a pair encloses nothing: it is where the offset falls apart, or collapses to a line.
    """
    from camtool.kernels.offset_nodes import doubles_left

    middle = 0.5 * (slices.t0 + slices.t1)
    eps = 2.0 * options.node_eps_mm
    return slices[doubles_left(curve_rows_of(elements), slices.element, middle, slices.ends, eps)]


def without_dead_ends(slices: Slices) -> Slices:
    """The slices that others lead to and lead on from."""
    from camtool.kernels.offset_nodes import leading_on

    return slices[leading_on(*slices.ends)]


def trace_loops(slices: Slices, elements: Segments) -> list[Ints]:
    """Rows of the slices of each loop, in order; no loop passes a node twice.

    At a node where several slices leave, the leftmost one is taken: the region that is far
    enough from the source is on the left, and so it falls into parts that only touch. Each loop
    begins with its first slice, and they come in the order of these.
    """
    from camtool.kernels.offset_loops import traced

    rows, begins = traced(curve_rows_of(elements), slices.element, slices.span, slices.ends)
    loops = [rows[low:high] for low, high in pairwise(begins.tolist())]
    rolled = (np.roll(loop, -int(loop.argmin())) for loop in loops)
    return sorted(rolled, key=lambda loop: int(loop[0]))


def paths_of(
    runs: Sequence[Ints], closed: Bools, slices: Slices, elements: Segments, options: OffsetOptions
) -> Polylines:
    """Clean paths of runs of slices that follow each other; slices of one element become one.

    Segments up to `sliver_eps_mm` go. A path of which nothing is left goes, and so does a closed
    one whose mean width, area over half the length, is no more than that.
    """
    from camtool.kernels.offset_loops import written

    eps = options.sliver_eps_mm
    begins = np.concatenate([[0], np.cumsum([len(run) for run in runs])]).astype(np.int64)
    rows = np.concatenate([np.empty(0, dtype=np.int64), *runs])
    columns = (slices.element, slices.span, slices.from_node, slices.to_node)
    vertices, offsets = written(columns, slices.nodes, elements.sweep, (rows, begins, closed), eps)
    there = np.diff(offsets) > 0
    lines = Polylines(vertices, np.concatenate([[0], offsets[1:][there]]), closed[there])
    wide = np.abs(signed_areas(lines)) > 0.5 * eps * path_lengths(lines)
    keep = wide | ~lines.closed
    return lines if keep.all() else lines.select(np.flatnonzero(keep))
