"""A full circle and what became of it, as a polar plot shows it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Round:
    """A circle (x, y) mm of this radius mm and direction, with its bins (B, 9) as
    `camtool.kernels.circle_bins` fills them; circular error G, radial errors F max, F min and
    their mean D, and the reversal values B of X and Y, mm, NaN where nobody knows. `partner` is
    the number, from 1, of the same circle gone round the other way, `both_circular_mm` the
    bi-directional circular error G(b) of the two."""

    centre_mm: tuple[float, float]
    radius_mm: float
    ccw: bool
    bins: Floats
    circular_mm: float
    radial_mm: tuple[float, float, float]
    reversal_mm: tuple[float, float]
    partner: int | None = None
    both_circular_mm: float = math.nan

    def errors(self) -> Floats:
        """(B, 3) mm: least, mean and largest radial error of each bin; NaN where nothing was."""
        seen = self.bins[:, 0] > 0.0
        found = np.full((len(self.bins), 3), np.nan)
        bins = self.bins[seen]
        mean = bins[:, 1:3] / bins[:, :1]
        # The mean of points along an arc of angle w lies at sin(w/2)/(w/2) of the radius.
        half = np.pi / len(self.bins)
        found[seen, 0] = np.sqrt(bins[:, 3])
        found[seen, 1] = np.hypot(mean[:, 0], mean[:, 1]) * (half / np.sin(half))
        found[seen, 2] = np.sqrt(bins[:, 6])
        return found - self.radius_mm
