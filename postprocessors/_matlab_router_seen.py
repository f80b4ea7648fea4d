"""What the reader noticed in the jobs, counted, and told as one finding each."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.machine.model import Machine

from ._matlab_router_job import Executed, ReadJob
from ._matlab_router_options import FIXED_Y_UNITS, UNIT_MM, UNITS_PER_MM, Dialect

FEED_GUARD: Final = 1e-6
"""A speed that is above its limit by less than this (in counts) is at the limit."""

TRAVEL_GUARD: Final = 1e-6
"""A position that is beyond the travel by less than this (in units) is at its end."""


@dataclass
class Worst:
    """How many are beyond a limit, by how much at most, and where the first is."""

    count: int = 0
    most: float = 0.0
    first: str = ""

    def add(self, count: int, most: float, place: str) -> None:
        """So many more, which begin at `place`."""
        if count:
            self.first = self.first or place
            self.count += count
            self.most = max(self.most, most)

    def finding(
        self, code: Code, severity: Severity, message: str, *, unit: str = "mm"
    ) -> list[Finding]:
        """The finding, `{count}` and `{most}` filled in; none when nothing was beyond."""
        if not self.count:
            return []
        text = message.format(count=self.count, most=self.most)
        return [Finding(code, severity, text, where=self.first, measured=self.most, unit=unit)]


@dataclass
class Seen:
    """What was noticed in all jobs."""

    machine: Machine
    dialect: Dialect
    odd: Worst = field(default_factory=Worst)
    empty: Worst = field(default_factory=Worst)
    fast: Worst = field(default_factory=Worst)
    outside: Worst = field(default_factory=Worst)
    fixed_y: Worst = field(default_factory=Worst)
    bent: Worst = field(default_factory=Worst)

    def add(self, job: ReadJob, done: Executed) -> None:
        """What one job has in it that the machine does otherwise, or cannot do."""
        place = f"job {job.number}"
        odd = int((job.length % 2).sum() + (job.first % 2).sum())
        if self.dialect.odd == "truncated" and odd:
            drift = done.points - done.asked
            if self.dialect.master_y == "fixed":
                drift[:, 1] -= drift[0, 1]
            self.odd.add(odd, float(np.abs(drift).max()) * UNIT_MM, place)
        if self.dialect.master_y == "fixed" and int(job.first[1]) != FIXED_Y_UNITS:
            off = abs(int(job.first[1]) - FIXED_Y_UNITS) * UNIT_MM
            self.fixed_y.add(1, off, place)
        empty = (np.diff(done.points, axis=0) == 0).all(axis=1)
        line = int(np.argmax(empty)) + 1
        self.empty.add(int(empty.sum()), 0.0, f"{place}, line {line}")
        self._fast(job, place)
        self._outside(done, place)

    def _fast(self, job: ReadJob, place: str) -> None:
        limit = self.machine.max_feed_mm_min / self.machine.feed.unit_mm_min
        speed = np.where(job.length > 0, np.abs(job.speed), 0)
        fast = speed > limit + FEED_GUARD
        line = int(np.argmax(fast.any(axis=0))) + 1
        most = float(speed.max()) * self.machine.feed.unit_mm_min
        self.fast.add(int(fast.sum()), most, f"{place}, line {line}")

    def _outside(self, done: Executed, place: str) -> None:
        axes = self.machine.axes
        for axis, travel in enumerate((axes.x.travel_mm, axes.y.travel_mm)):
            at = done.points[:, axis]
            bad = at < 0
            if travel is not None:
                bad = bad | (at > travel * UNITS_PER_MM + TRAVEL_GUARD)
            most = float(np.abs(at).max()) * UNIT_MM
            line = max(1, int(np.argmax(bad)))
            self.outside.add(int(bad.sum()), most, f"{place}, line {line}")

    def findings(self) -> list[Finding]:
        """One finding for each kind that was noticed."""
        start_mm = FIXED_Y_UNITS * UNIT_MM
        return [
            *self.outside.finding(
                Code.OUT_OF_TRAVEL,
                Severity.ERROR,
                "points outside of the machine's area: {count}, up to {most:.1f} mm from home",
            ),
            *self.fast.finding(
                Code.FEED_ABOVE_LIMIT,
                Severity.ERROR,
                "speeds above the limit of an axis: {count}, up to {most:.4g} mm/min",
                unit="mm_min",
            ),
            *self.odd.finding(
                Code.EXECUTED_OTHERWISE,
                Severity.WARNING,
                "odd distances are cut short by 0.1 mm each, because the slaves run chunks of"
                " 0.2 mm: {count}; places are off by {most:.1f} mm at most; use"
                " --set dialect.grid_mm=0.2",
            ),
            *self.fixed_y.finding(
                Code.EXECUTED_OTHERWISE,
                Severity.WARNING,
                f"jobs that begin at Y {start_mm:g} mm, whatever the program says: {{count}};"
                " for a master that obeys: --set dialect.master_y=sent",
            ),
            *self.bent.finding(
                Code.EXECUTED_OTHERWISE,
                Severity.WARNING,
                "lines that are bent by their speeds, because one axis arrives first: {count}, by"
                " {most:.2f} mm at most",
            ),
            *self.empty.finding(Code.MOVE_COLLAPSED, Severity.INFO, "lines of no length: {count}"),
        ]
