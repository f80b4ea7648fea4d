"""The literal oracle of camtool.kernels.offsets: every point asked of every segment, at once."""

from __future__ import annotations

import numpy as np

from camtool.arrays import Bools, Floats
from camtool.geometry.polylines import Segments


def inside(points: Floats, ring: Segments) -> Bools:
    """(P,) true for the points (P, 2) within a closed path, points on a chord moved by a hair."""
    points = points[:, None, :]
    chord = ring.end - ring.start
    x, y = points[..., 0] - ring.start[:, 0], points[..., 1] - ring.start[:, 1]
    side = chord[:, 0] * y - chord[:, 1] * x
    upward = ring.end[:, 1] > ring.start[:, 1]
    spans = (ring.start[:, 1] > points[..., 1]) != (ring.end[:, 1] > points[..., 1])
    crosses = spans & np.where(upward, side > 0.0, side < 0.0)
    hair = np.where(chord[:, 1] == 0.0, chord[:, 0], -chord[:, 1])
    on_left = np.where(side == 0.0, hair, side) > 0.0
    from_end = points - ring.end
    power = 4.0 * ring.bulge * (x * from_end[..., 0] + y * from_end[..., 1])
    power -= 2.0 * (1.0 - ring.bulge**2) * side
    in_circle = np.sign(ring.bulge) * power < 0.0
    beside = in_circle & (on_left == (ring.bulge < 0.0))
    odd = np.logical_xor.reduce(crosses ^ beside, axis=1)
    return np.asarray(odd)
