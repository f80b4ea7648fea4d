"""A path told by the length along it: places, directions, and pieces cut out of it exactly.

A piece of a line or an arc keeps to it: with the bulge b of the whole, the part f of it has

    bulge = tan(f · atan b),

because the bulge is tan(sweep/4) and the part f of the length has the part f of the sweep.
Lengths may run below 0 and beyond the whole of a closed path: that is further round.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.geometry.frames import Frames
from camtool.geometry.measure import point_at, segment_lengths
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

    @property
    def total_mm(self) -> float:
        """The length of the path."""
        return float(self.reach[-1])

    def at(self, lengths: Floats) -> Floats:
        """(J, 2) the places at these lengths (J,) mm."""
        row, part = self._where(lengths)
        return point_at(self.segments, row, part)

    def directions(self, lengths: Floats) -> Floats:
        """(J, 2) the unit tangents at these lengths (J,) mm; at a vertex, of what follows it."""
        row, part = self._where(lengths)
        return Frames.of(self.segments[row]).tangent_at(part)

    def piece(self, begin: float, end: float) -> Floats:
        """(k, 3) x, y, bulge from one length to another, backwards when `end` is the lower one.

        Vertices nearer than POSITION_EPS_MM to an end are that end. The last bulge is 0.
        """
        if end < begin:
            return _reversed(self.piece(end, begin))
        rows, low, high = self._spans(begin, end)
        sweep = np.arctan(self.segments.bulge[rows])
        bulge = np.tan((high - low) * sweep)
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

    def _where(self, lengths: Floats) -> tuple[Ints, Floats]:
        """The segment of each length and the part of it; ends of open paths reach no further."""
        inside = np.mod(lengths, self.total_mm) if self.path.closed else lengths
        row = np.searchsorted(self.reach, inside, side="right") - 1
        row = np.clip(row, 0, len(self.segments) - 1)
        part = (inside - self.reach[row]) / (self.reach[row + 1] - self.reach[row])
        return row, np.clip(part, 0.0, 1.0)


def _reversed(vertices: Floats) -> Floats:
    """Vertices (k, 3) of an open path the other way."""
    back = vertices[::-1].copy()
    back[:, 2] = 0.0
    back[:-1, 2] = 0.0 - vertices[-2::-1, 2]
    return back
