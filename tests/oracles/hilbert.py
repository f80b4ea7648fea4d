"""Hilbert's curve by the definition of its quarters, one level after the other."""

import numpy as np

from camtool.arrays import Floats, Ints


def hilbert_places(points: Floats, levels: int) -> Ints:
    """Return (K,) where the curve comes to points (K, 2) in the square of size 1."""
    x, y = np.minimum(points * 2.0**levels, 2.0**levels - 1.0).astype(np.int64).T
    place = np.zeros(len(points), dtype=np.int64)
    for level in reversed(range(levels)):
        right, above = (x >> level) & 1, (y >> level) & 1
        place = 4 * place + (3 * right ^ above)
        mirror = -(right & ~above & 1)
        x, y = x ^ mirror, y ^ mirror
        x, y = np.where(above == 1, x, y), np.where(above == 1, y, x)
    return place
