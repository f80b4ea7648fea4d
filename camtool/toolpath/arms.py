"""Arcs of a toolpath seen from their centres, and the points on them.

An arc whose ends lie at two distances of its centre (rounded coordinates) is taken as the spiral
between them; radius and, in a helix, Z change in proportion to the angle, so that both ends are
met.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.errors import PostError
from camtool.toolpath.moves import Floats, Ints, Toolpath

Bools = npt.NDArray[np.bool_]


class Arms:
    """The chosen arcs seen from their centres: radius at start and end mm, angle at the start and
    signed sweep rad, each (J,), for the rows `row` (J,)."""

    def __init__(self, toolpath: Toolpath, chosen: Bools) -> None:
        """PostError for an arc without a centre."""
        self.row = np.flatnonzero(chosen)
        self.centre = toolpath.centre[self.row]
        bad = ~np.isfinite(self.centre).all(axis=1)
        if bad.any():
            raise PostError("an arc without a centre", where=f"move {self.row[bad.argmax()]}")
        self.begin, self.end = toolpath.starts[self.row], toolpath.end[self.row]
        out, back = self.begin[:, :2] - self.centre, self.end[:, :2] - self.centre
        self.radius = np.hypot(out[:, 0], out[:, 1])
        self.end_radius = np.hypot(back[:, 0], back[:, 1])
        self.angle = np.arctan2(out[:, 1], out[:, 0])
        self.sweep = toolpath.sweeps()[self.row]

    def points(self, which: Ints, share: Floats) -> Floats:
        """(K, 3) mm: the points of the arcs `which` (K,) at `share` (K,) of their sweep."""
        angle = self.angle[which] + share * self.sweep[which]
        radius = self.radius[which] + share * (self.end_radius - self.radius)[which]
        rise = (self.end[:, 2] - self.begin[:, 2])[which]
        return np.column_stack(
            [
                self.centre[which, 0] + radius * np.cos(angle),
                self.centre[which, 1] + radius * np.sin(angle),
                self.begin[which, 2] + share * rise,
            ]
        )
