"""A path told by the length along it: places, directions, and pieces cut out of it exactly.

A piece of a line or an arc keeps to it: with the bulge b of the whole, the part f of it has

    bulge = tan(f · atan b),

because the bulge is tan(sweep/4) and the part f of the length has the part f of the sweep.
Lengths may run below 0 and beyond the whole of a closed path: that is further round.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from camtool.geometry.distance import nearest
from camtool.geometry.measure import Frames, dot, point_at, segment_lengths, turned
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Ints, Polyline, Segments


@dataclass(frozen=True, eq=False)
class Along:
    """A path with the length `reach` (n+1,) mm from its start to the start of each segment, and
    to its end: `total_mm`."""

    path: Polyline
    segments: Segments
    reach: Floats

    @classmethod
    def of(cls, path: Polyline) -> Along:
        """The path, measured."""
        segments = Segments.of(path)
        reach = np.concatenate([[0.0], np.cumsum(segment_lengths(segments))])
        return cls(path, segments, reach)

    @cached_property
    def turns(self) -> Floats:
        """(n,) rad by which the path turns at the start of each segment, left positive; 0 at the
        start of an open one."""
        frames = Frames.of(self.segments)
        before = np.roll(frames.tangent_at(np.ones(len(self.segments))), 1, axis=0)
        cross = dot(turned(before), frames.tangent)
        turns = np.arctan2(cross, dot(before, frames.tangent))
        if not self.path.closed:
            turns[0] = 0.0
        return turns

    @property
    def total_mm(self) -> float:
        """The length of the path."""
        return float(self.reach[-1])

    def at(self, lengths: Floats) -> Floats:
        """(J, 2) the places at these lengths (J,) mm."""
        row, part = self._where(lengths, 0.0)
        return point_at(self.segments, row, part)

    def directions(self, lengths: Floats) -> Floats:
        """(J, 2) the unit tangents at these lengths (J,) mm; at a vertex, of what follows it."""
        row, part = self._where(lengths, POSITION_EPS_MM)
        return Frames.of(self.segments[row]).tangent_at(part)

    def arrivals(self, lengths: Floats) -> Floats:
        """(J, 2) the unit tangents at these lengths (J,) mm; at a vertex, of what leads to it."""
        row, part = self._where(lengths, -POSITION_EPS_MM)
        return Frames.of(self.segments[row]).tangent_at(part)

    def nearest_to(self, point: tuple[float, float]) -> float:
        """The length at which the path is nearest to a point (x, y) mm.

        Told from the start of an arc of the curvature k, with the point at x along the tangent
        and y along the left normal, the foot of the point is  atan2(k x, 1 − k y) / k  along.
        """
        where = np.array([point])
        found = nearest(where, self.segments)
        row = int(found.segment[0])
        frame = Frames.of(self.segments[found.segment])
        q = where - frame.start
        x, y = float(dot(q, frame.tangent)[0]), float(dot(q, frame.normal)[0])
        k, size = float(frame.curvature[0]), float(frame.length[0])
        foot = x if k == 0.0 else math.atan2(k * x, 1.0 - k * y) / k
        begin = float(self.reach[row])
        tries = begin + np.array([min(max(foot, 0.0), size), 0.0, size])
        apart = self.at(tries) - where
        return float(tries[np.hypot(apart[:, 0], apart[:, 1]).argmin()])

    def piece(self, begin: float, end: float) -> Floats:
        """(k, 3) x, y, bulge from one length to another, backwards when `end` is the lower one.

        Vertices nearer than POSITION_EPS_MM to an end are that end. The last bulge is 0.
        """
        if end < begin:
            return backwards(self.piece(end, begin))
        rows, low, high = self._spans(begin, end)
        whole = self.segments.bulge[rows]
        part = high - low
        bulge = np.where(part == 1.0, whole, np.tan(part * np.arctan(whole)))
        vertices = np.column_stack([point_at(self.segments, rows, low), bulge])
        last = point_at(self.segments, rows[-1:], high[-1:])
        return np.concatenate([vertices, np.column_stack([last, [0.0]])])

    def _spans(self, begin: float, end: float) -> tuple[Ints, Floats, Floats]:
        """The segments between two lengths in order, and the part of each where it begins and
        ends."""
        total, count = self.total_mm, len(self.segments)
        laps = (math.floor(begin / total), math.floor(end / total)) if self.path.closed else (0, 0)
        rows = np.arange(laps[0] * count, (laps[1] + 1) * count)
        lap, row = np.divmod(rows, count)
        start = lap * total + self.reach[row]
        length = self.reach[row + 1] - self.reach[row]
        keep = (start + length > begin + POSITION_EPS_MM) & (start < end - POSITION_EPS_MM)
        if not keep.any():  # shorter than POSITION_EPS_MM: a piece of the one there
            keep = np.arange(len(rows)) == np.searchsorted(start, begin, side="right") - 1
        start, length, row = start[keep], length[keep], row[keep]
        low = np.where(begin - start > POSITION_EPS_MM, (begin - start) / length, 0.0)
        high = np.where(start + length - end > POSITION_EPS_MM, (end - start) / length, 1.0)
        return row, low, high

    def _where(self, lengths: Floats, ahead_mm: float) -> tuple[Ints, Floats]:
        """The segment that is so far ahead of each length, and the part of it at the length.

        Ends of open paths reach no further.
        """
        inside = lengths
        if self.path.closed:
            inside = np.mod(lengths + ahead_mm, self.total_mm) - ahead_mm
        row = np.searchsorted(self.reach, inside + ahead_mm, side="right") - 1
        row = np.clip(row, 0, len(self.segments) - 1)
        part = (inside - self.reach[row]) / (self.reach[row + 1] - self.reach[row])
        return row, np.clip(part, 0.0, 1.0)


def backwards(vertices: Floats) -> Floats:
    """Vertices (k, 3) of x, y, bulge of an open path, travelled the other way."""
    back = vertices[::-1].copy()
    back[:-1, 2] = 0.0 - vertices[-2::-1, 2]
    back[-1:, 2] = 0.0
    return back
