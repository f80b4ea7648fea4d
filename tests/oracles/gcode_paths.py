"""How far a row strays from the move it was made of, by dense points: slow and plain."""

from __future__ import annotations

import math

import numpy as np

from camtool.toolpath.moves import Kind, Move, Toolpath

POINTS = 64


def distance_mm(move: Move, points: np.ndarray) -> np.ndarray:
    """(K,) distance of points (K, 2) from a line or an arc in XY."""
    start, end = np.array(move.start[:2]), np.array(move.end[:2])
    if move.centre is None:
        along = end - start
        length = float(along @ along)
        part = np.clip((points - start) @ along / length, 0.0, 1.0) if length else 0.0
        return np.asarray(np.linalg.norm(points - start - np.outer(part, along), axis=1))
    centre = np.array(move.centre)
    arm = points - centre
    sign = 1.0 if move.kind == Kind.ARC_CCW else -1.0
    first = math.atan2(*(start - centre)[::-1])
    full = move.start[:2] == move.end[:2]
    sweep = math.tau if full else (sign * (math.atan2(*(end - centre)[::-1]) - first)) % math.tau
    turn = (sign * (np.arctan2(arm[:, 1], arm[:, 0]) - first)) % math.tau
    radial = np.abs(np.hypot(*arm.T) - math.dist(start, centre))
    ends = np.minimum(np.linalg.norm(points - start, axis=1), np.linalg.norm(points - end, axis=1))
    return np.asarray(np.where(turn <= sweep, radial, ends))


def points_of(path: Toolpath, row: int, start: np.ndarray) -> np.ndarray:
    """(POINTS, 2) points evenly along a row in XY; radius and angle of an arc run evenly."""
    parts = np.linspace(0.0, 1.0, POINTS)[:, None]
    if not path.is_arc[row]:
        return np.asarray(start[:2] + parts * (path.end[row, :2] - start[:2]))
    centre, sweep = path.centre[row], float(path.sweeps()[row])
    out = start[:2] - centre
    r1, r2 = math.hypot(*out), math.dist(path.end[row, :2], centre)
    angle = math.atan2(out[1], out[0]) + sweep * parts
    return np.asarray(
        centre + (r1 + (r2 - r1) * parts) * np.hstack([np.cos(angle), np.sin(angle)])
    )


def farthest_mm(move: Move, path: Toolpath, row: int, start: np.ndarray) -> float:
    """The largest distance of a row of `path` (which begins at `start`) from `move`, in XY."""
    return float(distance_mm(move, points_of(path, row, start)).max())
