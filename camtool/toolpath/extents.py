"""How far a toolpath reaches, exact with its arcs."""

from __future__ import annotations

import numpy as np

from camtool.toolpath.moves import Floats, Kind, Toolpath


def toolpath_extents(toolpath: Toolpath, *, cuts: bool = False) -> Floats:
    """(3, 2) mm: lowest and highest X, Y and Z that any move reaches, the start included; with
    `cuts` those that moves at a feed reach.

    An arc reaches centre ± radius where its sweep passes the direction of an axis.
    """
    points = np.concatenate([toolpath.start[None, :], toolpath.end])
    if cuts and toolpath.is_feed.any():
        rows = toolpath.is_feed
        points = np.concatenate([toolpath.starts[rows], toolpath.end[rows]])
    low, high = points.min(axis=0), points.max(axis=0)
    tops = _arc_extremes(toolpath)
    if len(tops):
        low[:2] = np.minimum(low[:2], tops.min(axis=0))
        high[:2] = np.maximum(high[:2], tops.max(axis=0))
    return np.column_stack([low, high])


def _arc_extremes(toolpath: Toolpath) -> Floats:
    """(J, 2) the points of arcs that lie straight right, above, left or below of the centre."""
    arcs = np.flatnonzero(toolpath.is_arc)
    centre, begin = toolpath.centre[arcs], toolpath.starts[arcs, :2]
    arm = begin - centre
    radius = np.hypot(arm[:, 0], arm[:, 1])
    sign = np.where(toolpath.kind[arcs] == Kind.ARC_CW, -1.0, 1.0)
    sweep = np.abs(toolpath.sweeps()[arcs])
    compass = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    from_start = np.arctan2(compass[:, 1], compass[:, 0]) - np.arctan2(arm[:, 1:], arm[:, :1])
    turn = np.mod(sign[:, None] * from_start, 2.0 * np.pi)
    arc, which = np.nonzero(turn <= sweep[:, None])
    return np.asarray(centre[arc] + radius[arc, None] * compass[which])
