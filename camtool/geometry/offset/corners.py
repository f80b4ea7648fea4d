"""The corners between the segments of closed paths, and what is put about the outer ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.frames import Frames, dot, turned
from camtool.geometry.offset.curves import next_rows
from camtool.geometry.offset.options import CUSP_EPS_RAD
from camtool.geometry.offset.way import Way
from camtool.geometry.polylines import Bools, Floats, Ints, Polylines, Segments


@dataclass(frozen=True, eq=False)
class Corners:
    """Row i is the corner after segment i: its `place`, the tangents `before` and `after` it
    (K, 2), and how far the path turns there, `turn` (K,) rad, left positive. `earlier` (K,) is
    the corner that the same segment begins at.

    Where a path turns straight back, rounding alone says whether it turns left or right. It is
    then taken to turn right: a join too much is invalid, or leads nowhere, and goes later.
    """

    place: Floats
    before: Floats
    after: Floats
    turn: Floats
    earlier: Ints

    @classmethod
    def of(cls, frames: Frames, lines: Polylines) -> Corners:
        """The corners of closed paths, whose segments are told by `frames`."""
        before = frames.tangent_at(np.ones(len(frames.length)))
        following = next_rows(lines)
        after = frames.tangent[following]
        turn = np.arctan2(dot(turned(before), after), dot(before, after))
        turn = np.where(turn >= np.pi - CUSP_EPS_RAD, turn - 2.0 * np.pi, turn)
        return cls(frames.end, before, after, turn, np.argsort(following, kind="stable"))

    def outer(self, way: Way) -> Bools:
        """(K,) true where the path turns right so much that the shifted segments part."""
        gap = 2.0 * way.distance_mm * np.sin(-0.5 * self.turn)
        return np.asarray(gap > way.options.node_eps_mm)


def arcs_about(corners: Corners, rows: Ints, way: Way) -> tuple[Ints, Segments]:
    """Arcs about the outer corners `rows`, and the corner of each; two where one is above π."""
    turn = corners.turn[rows]
    parts = np.where(turn < -np.pi, 2, 1)
    corner = np.repeat(rows, parts)
    second = np.concatenate([[False], corner[1:] == corner[:-1]])
    sweep = np.repeat(turn / parts, parts)
    normal, place = turned(corners.before[corner]), corners.place[corner]
    start = place + way.distance_mm * _rotated(normal, np.where(second, sweep, 0.0))
    middle = place + way.distance_mm * _rotated(normal, sweep)
    after = place + way.distance_mm * turned(corners.after[corner])
    last = np.repeat(parts, parts) == second + 1
    end = np.where(last[:, None], after, middle)
    return corner, Segments.between(start, end, np.tan(0.25 * sweep))


@dataclass(frozen=True, eq=False)
class Mitres:
    """`reach` (K,): how far the tangents go on beyond the shifted segments at each corner, mm, 0
    where there is no mitre; `cut` (K,) true where it is cut off; and the `kites` (J, 10) that
    they cover (camtool.kernels.offset_kites).

    At a corner where the path turns by 2h, the tangents of both shifted segments meet when they
    have gone on by d tan h, at d / cos h from the corner. Where that is more than the limit L
    allows, they end at a line across, L d from the corner: after d (L − cos h) / sin h.
    """

    reach: Floats
    cut: Bools
    kites: Floats

    @classmethod
    def about(cls, corners: Corners, rows: Ints, way: Way) -> Mitres:
        """Mitres at the outer corners `rows`."""
        half, d = -0.5 * corners.turn[rows], way.distance_mm
        is_cut = way.limit * np.cos(half) < 1.0
        reach, cut = np.zeros(len(corners.turn)), np.zeros(len(corners.turn), dtype=np.bool_)
        cut[rows] = is_cut
        cosine, sine = np.cos(half), np.sin(half)
        reach[rows] = d * np.where(is_cut, (way.limit - cosine) / sine, np.tan(half))
        before, after = turned(corners.before[rows]), turned(corners.after[rows])
        middle = _rotated(before, -half)
        far = np.where(is_cut, way.limit * d, np.inf)
        deep = np.full(len(rows), d)
        columns = [corners.place[rows], before, after, middle, deep, far]
        return cls(reach, cut, np.column_stack(columns))

    def lines(self, corners: Corners, is_arc: Bools, way: Way) -> tuple[Ints, Segments]:
        """The lines about the corners that are not parts of shifted lines, and the corner of
        each: on from an arc, across where the mitre is cut off, on to an arc.

        `is_arc` (K, 2) says whether the segments before and after each corner are arcs.
        """
        d, reach = way.distance_mm, self.reach[:, None]
        left = corners.place + d * turned(corners.before)
        right = corners.place + d * turned(corners.after)
        near, far = left + reach * corners.before, right - reach * corners.after
        there = self.reach > 0.0
        wanted = np.column_stack([there & is_arc[:, 0], self.cut, there & is_arc[:, 1]])
        start, end = np.stack([left, near, far], axis=1), np.stack([near, far, right], axis=1)
        wanted &= np.hypot(*np.moveaxis(end - start, 2, 0)) > way.options.node_eps_mm
        corner = np.nonzero(wanted)[0]
        return corner, Segments.between(start[wanted], end[wanted], np.zeros(len(corner)))


def _rotated(vectors: Floats, angle: Floats) -> Floats:
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.asarray(cosine * vectors + sine * turned(vectors))
