"""Lines cut into pieces whose dog-legs stay near the line.

A record of dx, dy steps is no straight line: both motors step together min(|dx|, |dy|) times, a
diagonal, and then the motor with more steps goes on alone (L4683-4705, "corte recto"):

        E ———————— B        a = max(|dx|, |dy|) steps, b = min, d = a − b; steps of sx, sy mm
       /      . ·           L = length of AB in mm
      /  . ·                E is the elbow, here for |dx| > |dy|: the diagonal, then along X
    A ·

Both legs run towards B, so the feet of all their points lie on AB, and the elbow is the point
that is farthest from it. A point that is M diagonal and D single steps from A is at
(M + D, M) steps, and its distance from AB is the cross product over the length:

    e(M, D) = sx·sy·|(M + D)·b − M·a| / L = sx·sy·|D·b − M·d| / L

so the elbow (M = b, D = 0) strays by e = sx·sy·b·(a − b) / L; with sx = sy = 1 this is
L·t(1−t)/(1+t²), t = b/a, at most 0.2071·L (at 22.5°), and 0 along the axes and the diagonals.

To stay within a tolerance, the line is walked as runs of diagonal and of single steps, each as
long as |D·b − M·d| ≤ reach = tolerance·L/(sx·sy) allows; one record is a diagonal run and the
single run after it. Both ends and the elbow of every record are then within the tolerance of the
line itself, not only of their own chord, and nothing is rounded in between. A run of at least
one step is always possible: otherwise reach + value < d and reach − value < b, so 2·reach < a,
but tolerance ≥ half of the coarser step gives 2·reach ≥ a.

The diagonal runs lower D·b − M·d by b·d in all: the first one by the reach, each further one by
twice the reach. So n records need a reach of b·d / (2n − 1), or n = (e / tolerance + 1) / 2
rounded up. With n known, the line is walked again with that smaller reach, which leaves it as
many records, but of more equal length and nearer to the line."""

from __future__ import annotations

from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Ints

FREE: Final = -1
"""A reach without limit: rapids may take any dog-leg."""


def reaches(steps: Ints, step_mm: tuple[float, float], tolerance_mm: float) -> Ints:
    """Return (N,) the reach of each line of (N, 2) steps: the greatest |D·b − M·d| at which a
    record's end stays within the tolerance of the line.

    It is at least a // 2, since rounding ends to whole steps can already cost that much."""
    length = np.hypot(steps[:, 0] * step_mm[0], steps[:, 1] * step_mm[1])
    reach = np.floor(tolerance_mm * length / (step_mm[0] * step_mm[1])).astype(np.int64)
    return np.asarray(np.maximum(reach, np.abs(steps).max(axis=1, initial=0) // 2))


def elbows(steps: Ints) -> Ints:
    """Return (N,) b·d of lines of (N, 2) steps: the part of the reach that the elbow of a single
    record takes."""
    size = np.abs(steps)
    shorter = size.min(axis=1, initial=np.iinfo(np.int64).max)
    return np.asarray(shorter * (size.max(axis=1, initial=0) - shorter))


class StepLine(Struct, frozen=True):
    """A line of dx, dy steps; `reach` as `reaches` gives it, or FREE."""

    dx: int
    dy: int
    reach: int = FREE

    def pieces(self, max_steps: int) -> list[tuple[int, int]]:
        """Split the line into records and return the steps (dx, dy) of each, in order.

        Their sum is the whole line; no record has more than `max_steps` steps along an axis."""
        long, shorter = max(abs(self.dx), abs(self.dy)), min(abs(self.dx), abs(self.dy))
        x_is_long = abs(self.dx) >= abs(self.dy)
        right, y_sense = (1 if self.dx >= 0 else -1), (1 if self.dy >= 0 else -1)
        pieces = []
        for diagonal, single in self._even_runs(shorter, long - shorter, max_steps):
            long_steps = diagonal + single
            x, y = (long_steps, diagonal) if x_is_long else (diagonal, long_steps)
            pieces.append((right * x, y_sense * y))
        return pieces

    def _even_runs(self, diagonals: int, singles: int, max_steps: int) -> list[tuple[int, int]]:
        """Return the fewest records that are found, moved as close to the line as that number of
        records allows."""
        if self.reach == FREE:
            return _runs(diagonals, singles, diagonals * singles, max_steps)
        runs = _runs(diagonals, singles, self.reach, max_steps)
        # Rounding to whole steps loses up to one step, b or d, of each reach.
        waste = (diagonals + singles) // 2
        reach = diagonals * singles // (2 * len(runs) - 1) + waste
        if reach >= self.reach:
            return runs
        nearer = _runs(diagonals, singles, reach, max_steps)
        return nearer if len(nearer) <= len(runs) else runs


def _runs(diagonals: int, singles: int, reach: int, max_steps: int) -> list[tuple[int, int]]:
    """Return the line as records of (diagonal steps, single steps), each run as long as the reach
    allows."""
    # Comparisons, not `min`: long lines have hundreds of records, and this is half of the time.
    value, diagonals_left, singles_left = 0, diagonals, singles
    runs = []
    while diagonals_left or singles_left:
        run = diagonals_left if diagonals_left < max_steps else max_steps
        if singles:
            bound = (reach + value) // singles
            run = bound if bound < run else run
            value -= run * singles
        room = max_steps - run
        single = singles_left if singles_left < room else room
        if diagonals:
            bound = (reach - value) // diagonals
            single = bound if bound < single else single
            value += single * diagonals
        diagonals_left -= run
        singles_left -= single
        runs.append((run, single))
    return runs
