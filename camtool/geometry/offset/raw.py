"""Stage 1: every segment shifted to the left, and arcs or mitres about the outer corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.frames import Frames, turned
from camtool.geometry.offset.corners import Corners, Mitres, arcs_about
from camtool.geometry.offset.curves import next_rows
from camtool.geometry.offset.way import Way
from camtool.geometry.polylines import Bools, Floats, Ints, Polylines, Segments


@dataclass(frozen=True, eq=False)
class RawOffset:
    """`elements`: shifted segments and joins, in the order of travel. `source` (K,): the source
    segment of each, or the one before its corner; `join` (K,): true for what is put about a
    corner. `kites` (J, 10): what mitres cover (camtool.kernels.offset_kites)."""

    elements: Segments
    source: Ints
    join: Bools
    kites: Floats


def raw_offset(lines: Polylines, way: Way) -> RawOffset:
    """All of the offset to the left of closed paths, and much that is too near to them.

    An arc that bends left with a radius up to the distance has nothing there: every point beyond
    its centre is nearer to another of its points. Inner corners need no join: the elements
    beside them cross, there or elsewhere.
    """
    segments = Segments.of(lines)
    frames = Frames.of(segments)
    corners = Corners.of(frames, lines)
    mitred = corners.outer(way)
    rounded = mitred & way.is_round
    if way.both_sides:
        # About the ends of an open path only what is nearer than the distance counts.
        rounded[[len(segments) // 2 - 1, -1]] = mitred[[len(segments) // 2 - 1, -1]]
    mitres = Mitres.about(corners, np.flatnonzero(mitred & ~rounded), way)
    rows, shifted = _shifted(segments, frames, corners, mitres, way)
    about, arcs = arcs_about(corners, np.flatnonzero(rounded), way)
    beside = np.column_stack([segments.is_arc, segments.is_arc[next_rows(lines)]])
    along, across = mitres.lines(corners, beside, way)
    return _in_order([rows, about, along], [shifted, arcs, across], mitres.kites)


def _shifted(
    segments: Segments, frames: Frames, corners: Corners, mitres: Mitres, way: Way
) -> tuple[Ints, Segments]:
    """The segments at the distance, and the row of each; lines go on to the tips of mitres."""
    start = segments.start + way.distance_mm * frames.normal
    end = segments.end + way.distance_mm * turned(corners.before)
    left_over = 1.0 - way.distance_mm * frames.curvature
    apart = np.hypot(*(end - start).T)
    rows = np.flatnonzero((left_over > 0.0) & (apart > way.options.node_eps_mm))
    reach = np.where(segments.is_arc, 0.0, mitres.reach)
    reach_back = np.where(segments.is_arc, 0.0, mitres.reach[corners.earlier])
    end += reach[:, None] * corners.before
    start -= reach_back[:, None] * frames.tangent
    return rows, Segments.between(start[rows], end[rows], segments.bulge[rows])


def _in_order(sources: list[Ints], parts: list[Segments], kites: Floats) -> RawOffset:
    """Shifted segments and then joins, by their source."""
    source = np.concatenate(sources)
    order = np.argsort(source, kind="stable")
    elements = Segments.between(
        np.concatenate([part.start for part in parts])[order],
        np.concatenate([part.end for part in parts])[order],
        np.concatenate([part.bulge for part in parts])[order],
    )
    return RawOffset(elements, source[order], order >= len(sources[0]), kites)
