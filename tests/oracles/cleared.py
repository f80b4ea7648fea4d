"""The slow, obvious twin of camtool.stock.rapids: points of the rapid's disc, one by one."""

from __future__ import annotations

import math

from camtool.toolpath.moves import Kind, Move, Toolpath
from tests.oracles.lowering import sweep_of

Point = tuple[float, float, float]


def point_of(move: Move, share: float) -> Point:
    """The point of a line or arc at `share` of its way, by trigonometry."""
    (x0, y0, z0), (x1, y1, z1) = move.start, move.end
    z = z0 + share * (z1 - z0)
    if move.centre is None:
        return x0 + share * (x1 - x0), y0 + share * (y1 - y0), z
    cx, cy = move.centre
    radius, angle = math.dist((x0, y0), (cx, cy)), math.atan2(y0 - cy, x0 - cx)
    turn = angle + share * sweep_of(move)
    return cx + radius * math.cos(turn), cy + radius * math.sin(turn), z


def most_uncut(toolpath: Toolpath, row: int, radius: float, parts: int = 60) -> float:
    """Estimate the distance of the worst point of a rapid's disc from all that earlier cuts have
    cleared to its depth; below 0 if it lies inside by so much."""
    moves = list(toolpath)
    dust = [
        point_of(move, k / parts)
        for move in moves[:row]
        if move.kind in (Kind.LINE, Kind.ARC_CW, Kind.ARC_CCW)
        for k in range(parts + 1)
    ]
    worst = -math.inf
    for k in range(parts + 1):
        x, y, z = point_of(moves[row], k / parts)
        if z >= 0.0:
            continue
        near = [(a, b) for a, b, c in dust if c <= z + 1e-9 and c < 0.0]
        for step in range(12):
            turn = step * math.tau / 12
            px, py = x + radius * math.cos(turn), y + radius * math.sin(turn)
            least = min((math.dist((px, py), one) for one in near), default=math.inf)
            worst = max(worst, least - radius)
    return worst
