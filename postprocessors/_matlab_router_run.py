"""How the axes run the lines of a job: both start together, each stops by itself."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.toolpath.moves import Floats, Ints

from ._matlab_router_options import UNITS_PER_MM

Bools = npt.NDArray[np.bool_]

MOST_OFF = 8.0
"""Counts in 5 ms by which the speed of an axis may differ from what its distance asks for (the
GUI's own differ by half a count, and by some when distances are cut short)."""


class Run:
    """Lines of points (n+1, 2) units at speeds (n, 2) counts in 5 ms, as the axes run them.

    Both start together, each stops by itself (L4855-4929). With distances d and speeds v they
    take t = d/v; the earlier one, at t₁, leaves the other alone until t₂:

        the line bends at t₁ · v, by (1 − t₁/t₂) of the distance of the later axis.

    A line becomes two ways when it bends by more than the tolerance, or when a speed is off by
    more than `MOST_OFF` from that of its distance: from the ways and the speed along them the
    speeds of the axes can be told again. `end` (m, 2) units, `speed` (m,) counts in 5 ms of both
    axes together, `line` (m,) its index; `bent` counts the lines beyond the tolerance.
    """

    def __init__(self, points: Ints, speed: Ints, tolerance_mm: float) -> None:
        way = np.diff(points, axis=0).astype(np.float64)
        distance = np.abs(way)
        moving = distance > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            took = np.where(moving, distance / speed, 0.0)
            last = took.max(axis=1)
            both = moving.all(axis=1)
            share = np.where(both, took.min(axis=1) / last, 1.0)
        along = np.hypot(*np.where(moving, speed, 0).T.astype(np.float64))
        lag = np.where(both, _lag(distance, took, share), 0.0)
        bent = lag > tolerance_mm * UNITS_PER_MM
        self.bent = int(bent.sum())
        self.most_bend = float(lag.max(initial=0.0))
        self.first_bent = int(np.argmax(bent)) if self.bent else 0
        keep = moving.any(axis=1)
        parted = bent | (both & (_off(distance, speed, along) > MOST_OFF))
        times = np.where(keep, np.where(parted, 2, 1), 0)
        self.line = np.repeat(np.arange(len(way)), times)
        self.end = points[1:][self.line].astype(np.float64)
        self.speed = along[self.line]
        if parted.any():
            self._bend(points, way, speed, took, parted, times)

    def _bend(
        self,
        points: Ints,
        way: Floats,
        speed: Ints,
        took: Floats,
        bent: Bools,
        times: Ints,
    ) -> None:
        """Rows of bent lines: to the bend with both axes, then with the later one alone."""
        rows = np.flatnonzero(bent)
        first = (np.cumsum(times) - times)[rows]
        soon = took[rows].min(axis=1)[:, None]
        part = np.minimum(soon * speed[rows], np.abs(way[rows]))
        self.end[first] = points[:-1][rows] + np.sign(way[rows]) * part
        self.speed[first] = np.hypot(*speed[rows].T)
        later = took[rows].argmax(axis=1)
        self.speed[first + 1] = speed[rows, later]


def _lag(distance: Floats, took: Floats, share: Floats) -> Floats:
    """(n,) units by which a line bends: what is left of the later axis, seen across the line."""
    later = took.argmax(axis=1)
    left = distance[np.arange(len(distance)), later] * (1.0 - share)
    other = distance[np.arange(len(distance)), 1 - later]
    length = np.hypot(*distance.T)
    return np.asarray(left * other / np.where(length > 0.0, length, 1.0))


def _off(distance: Floats, speed: Ints, along: Floats) -> Floats:
    """(n,) counts by which the speeds are off those that would go straight."""
    length = np.hypot(*distance.T)
    straight = distance * (along / np.where(length > 0.0, length, 1.0))[:, None]
    return np.asarray(np.abs(speed - straight).max(axis=1))
