"""Lines and arcs told from their start, so that both share one formula and need no centre.

With the unit tangent and the left normal n at the start, the signed curvature k (left positive, 0
for lines) and q = p − start,

    k |q|² − 2 n·q = 0          on the whole line or circle,

which stays exact when a shallow arc has its centre a kilometre away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.measure import segment_lengths
from camtool.geometry.polylines import Bools, Floats, Ints, Segments


@dataclass(frozen=True, eq=False)
class Frames:
    """Segments told from their start: `start`, `end`, `tangent`, `normal` (K, 2), `curvature`
    1/mm (left positive), `length` mm and `sweep` rad (K,)."""

    start: Floats
    end: Floats
    tangent: Floats
    normal: Floats
    curvature: Floats
    length: Floats
    sweep: Floats

    @classmethod
    def of(cls, segments: Segments) -> Frames:
        """One frame for each segment."""
        chord = segments.end - segments.start
        size = np.hypot(chord[:, 0], chord[:, 1])
        unit = chord / size[:, None]
        # The tangent is the chord turned by −sweep/2, and b = tan(sweep/4).
        square = segments.bulge**2
        cosine = (1.0 - square) / (1.0 + square)
        sine = 2.0 * segments.bulge / (1.0 + square)
        tangent = cosine[:, None] * unit - sine[:, None] * turned(unit)
        return cls(
            start=segments.start,
            end=segments.end,
            tangent=tangent,
            normal=turned(tangent),
            curvature=4.0 * segments.bulge / (size * (1.0 + square)),
            length=segment_lengths(segments),
            sweep=segments.sweep,
        )

    def __getitem__(self, rows: Bools | Ints) -> Frames:
        """The chosen rows."""
        return Frames(**{name: column[rows] for name, column in vars(self).items()})

    def tangent_at(self, t: Floats) -> Floats:
        """(K, 2) unit tangent at the fraction t (K,) of each length."""
        turn = t * self.sweep
        cosine, sine = np.cos(turn)[:, None], np.sin(turn)[:, None]
        return np.asarray(cosine * self.tangent + sine * self.normal)

    def gap(self, points: Floats) -> Floats:
        """(K,) distance of each point (K, 2) from the whole line or circle, mm.

        With g = k|q|² − 2 n·q the distance from the centre squared is (1 + k g)/k².
        """
        q = points - self.start
        g = self.curvature * dot(q, q) - 2.0 * dot(self.normal, q)
        return np.asarray(np.abs(g) / (1.0 + np.sqrt(np.maximum(1.0 + self.curvature * g, 0.0))))

    def along(self, points: Floats) -> Floats:
        """(K,) length along the curve from its start to each point (K, 2) on it, mm.

        Negative before the start. The chord to the point makes half the swept angle with the
        tangent; points before the start show as half angles beyond the middle of what remains.
        """
        q = points - self.start
        side = np.where(self.curvature < 0.0, -1.0, 1.0)
        half = np.arctan2(side * dot(self.normal, q), dot(self.tangent, q))
        limit = 0.5 * np.pi + 0.25 * np.abs(self.sweep)
        before = (half > limit) | (half < -0.5 * np.pi)
        half = np.where(before, np.pi - np.abs(half), np.abs(half))
        chord = np.hypot(q[:, 0], q[:, 1])
        on_line = (self.curvature == 0.0) | (half == 0.0)
        stretch = np.where(on_line, 1.0, half / np.sin(np.where(on_line, 1.0, half)))
        return np.where(before, -chord, chord) * stretch


def turned(vectors: Floats) -> Floats:
    """Vectors (K, 2) turned by +90°."""
    return np.column_stack([-vectors[:, 1], vectors[:, 0]])


def dot(a: Floats, b: Floats) -> Floats:
    """(K,) inner products of vectors (K, 2)."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])
