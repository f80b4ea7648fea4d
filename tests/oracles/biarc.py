"""Biarcs (two arcs that meet tangentially) and distances to arcs, for many at once.

Everything here works without centres, so an arc may be as flat as it likes: for a bulge of 0 each
formula becomes the one of the straight line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import BULGE_EPS, Bools, Floats


@dataclass(frozen=True, eq=False)
class Biarcs:
    """K biarcs: `joint` (K, 2) mm, bulges of both arcs `first`, `second` (K,), `valid` (K,)."""

    joint: Floats
    first: Floats
    second: Floats
    valid: Bools


def biarcs(start: Floats, leave: Floats, end: Floats, arrive: Floats) -> Biarcs:
    """The biarcs with equal handles from `start` to `end` (K, 2) mm, with unit tangents (K, 2).

    Handles of length d reach Q0 = start + d·leave and Q1 = end − d·arrive; the arcs meet in the
    middle of Q0Q1 when |Q1 − Q0| = 2d. With v = end − start, s = leave + arrive, c = leave·arrive:
        d²(2 − 2c) + 2d v·s − v·v = 0   ⇒   d = v·v / (v·s + √((v·s)² + 2(1 − c) v·v)).
    Invalid where no such d > 0 exists or an arc would be more than a half circle.
    """
    chord = end - start
    both = leave + arrive
    square = _dot(chord, chord)
    along = _dot(chord, both)
    root = np.sqrt(along**2 + 2.0 * np.maximum(1.0 - _dot(leave, arrive), 0.0) * square)
    below = along + root
    valid = (square > 0.0) & (below > 0.0)
    handle = np.divide(square, below, out=np.zeros_like(square), where=valid)
    joint = 0.5 * (start + end + handle[:, None] * (leave - arrive))
    first, good_first = _half_angle(leave, joint - start)
    second, good_second = _half_angle(end - joint, arrive)
    return Biarcs(joint, first, second, valid & good_first & good_second)


def arc_distances(points: Floats, start: Floats, end: Floats, bulge: Floats) -> Floats:
    """Distances (…,) mm from points (…, 2) to the arcs start, end (…, 2), bulge (…,), |b| ≤ 1.

    With w = p − start, u = end − start, n = u turned by +90°, the power of p over the circle and
    the vector from the centre, both times b, need no centre:
        b·power = b(w·w − w·u) − (1 − b²)/2 w·n,   q = b(w − u/2) − (1 − b²)/4 n,
        distance to the circle = |b·power| / (|q| + |u|(1 + b²)/4).
    Beside the arc (behind the normals at its ends) the nearer end counts.
    """
    w = points - start
    u = end - start
    n = np.stack([-u[..., 1], u[..., 0]], axis=-1)
    rest = 1.0 - bulge**2
    power = bulge * (_dot(w, w) - _dot(w, u)) - 0.5 * rest * _dot(w, n)
    q = bulge[..., None] * (w - 0.5 * u) - 0.25 * rest[..., None] * n
    length = np.hypot(u[..., 0], u[..., 1])
    below = np.hypot(q[..., 0], q[..., 1]) + 0.25 * length * (1.0 + bulge**2)
    to_circle = np.abs(power) / np.where(below > 0.0, below, 1.0)
    v = points - end
    twice = 2.0 * bulge[..., None] * n
    inside = (_dot(w, rest[..., None] * u - twice) >= 0.0) & (
        _dot(v, rest[..., None] * u + twice) <= 0.0
    )
    to_end = np.minimum(np.hypot(w[..., 0], w[..., 1]), np.hypot(v[..., 0], v[..., 1]))
    return np.where(inside & (length > 0.0), to_circle, to_end)


def _half_angle(from_: Floats, to: Floats) -> tuple[Floats, Bools]:
    """tan(α/2) = sin α / (1 + cos α) for the angle α between vectors (K, 2); where |α| ≤ 90°.

    An arc of sweep s leaves its chord's direction by s/2, so its bulge tan(s/4) is tan(α/2) with α
    between the tangent and the chord.
    """
    length = np.hypot(from_[:, 0], from_[:, 1]) * np.hypot(to[:, 0], to[:, 1])
    below = length + _dot(from_, to)
    good = (below > 0.0) & (length > 0.0)
    sine = from_[:, 0] * to[:, 1] - from_[:, 1] * to[:, 0]
    bulge = np.divide(sine, below, out=np.zeros_like(sine), where=good)
    good &= np.abs(bulge) <= 1.0 + BULGE_EPS
    return np.clip(bulge, -1.0, 1.0), good


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1])
