"""The parallel-port machine's program, a millisecond at a time, in plain Python.

Written from the rules alone (the thesis's L1085-1145 and L1200-1218): a loop that looks at a
clock, one timer for each axis, lists that grow. Nothing here is shared with `camtool`'s kernels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from camtool.records import replace
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.lowering import sweep_of

Point = tuple[float, float, float]


@dataclass
class Pc:
    """The program; `steps` issued so far on each axis, `said_mm` where the program is.

    `late`: the longer axis alone is a millisecond late, the shorter one exact. `whole` makes whole
    steps of a quotient. `sees`: displacements are counted from what the steps have led to.
    """

    q_mm: Point
    late: bool = False
    truncates: bool = False
    sees: bool = False
    steps: list[int] = field(default_factory=lambda: [0, 0, 0])
    said_mm: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    seen: list[tuple[int, int, int]] = field(default_factory=list)
    spent_ms: int = 0

    def displaced(self, axis: int, to_mm: float, *, sensor: bool = False) -> int:
        """Whole steps of one axis, with their sign."""
        here = self.said_mm[axis]
        if self.sees or sensor:
            here = self.steps[axis] * self.q_mm[axis]
        self.said_mm[axis] = to_mm
        way = (to_mm - here) / self.q_mm[axis]
        # Decimals are no binary fractions: a millionth of a step is no difference.
        size = abs(way) + 1e-6
        whole = math.floor(size) if self.truncates else math.floor(size + 0.5)
        return int(math.copysign(whole, way)) if whole else 0

    def xyh(self, x_mm: float, y_mm: float, p: int) -> None:
        """The routine for X and Y."""
        nx, ny = self.displaced(0, x_mm), self.displaced(1, y_mm)
        self.timers(((0, nx), (1, ny)), p)

    def one(self, axis: int, to_mm: float, p: int, *, sensor: bool = False) -> None:
        """The routine for one axis."""
        self.timers(((axis, self.displaced(axis, to_mm, sensor=sensor)),), p)

    def timers(self, ways: Sequence[tuple[int, int]], p: int) -> None:
        """Look at the clock until the counter of the longest way is full."""
        limit = max(abs(n) for _, n in ways)
        leading = next(axis for axis, n in ways if abs(n) == limit)
        periods = {axis: Fraction(p * limit, abs(n)) for axis, n in ways if n}
        senses = {axis: (1 if n > 0 else -1) for axis, n in ways}
        counter = 0
        if self.late:
            counter = self._late(periods, senses, leading, limit, p)
        else:
            fired = dict.fromkeys(periods, 0)
            now = 0
            while counter < limit:
                now += 1
                any_fired = False
                for axis, period in periods.items():
                    if now - fired[axis] > period:
                        fired[axis] = now
                        self.steps[axis] += senses[axis]
                        counter += axis == leading
                        any_fired = True
                if any_fired:
                    self.seen.append((self.steps[0], self.steps[1], self.steps[2]))
        self.spent_ms += counter * (p + 1)

    def _late(
        self,
        periods: dict[int, Fraction],
        senses: dict[int, int],
        leading: int,
        limit: int,
        p: int,
    ) -> int:
        """The other reading of the clock: all times of all steps, sorted."""
        times: dict[Fraction, list[int]] = {}
        for k in range(1, limit + 1):
            times.setdefault(Fraction(k * (p + 1)), []).append(leading)
        for axis, period in periods.items():
            k = 1
            while axis != leading and k * period <= limit * (p + 1):
                times.setdefault(k * period, []).append(axis)
                k += 1
        for time in sorted(times):
            for axis in times[time]:
                self.steps[axis] += senses[axis]
            self.seen.append((self.steps[0], self.steps[1], self.steps[2]))
        return limit


def half_period(feed_mm_min: float, q_mm: float, shortest: int, parts: int) -> int:
    """The half period whose steps, each `parts` of it and each of them a millisecond late, come
    nearest to a feed; the longer of two that are as near."""
    wanted_ms = q_mm / feed_mm_min * 60_000.0 / parts
    p = shortest
    while abs(p + 2 - wanted_ms) <= abs(p + 1 - wanted_ms):
        p += 1
    return p


def chord_ends(
    start: tuple[float, float],
    end: tuple[float, float],
    centre: tuple[float, float],
    sweep: float,
    per_turn: int,
) -> list[tuple[float, float]]:
    """Ends of the chords of an arc of this signed sweep, the programmed end last."""
    count = 1
    while count * 2.0 * math.pi / per_turn < abs(sweep) - 1e-7:
        count += 1
    radius = math.hypot(start[0] - centre[0], start[1] - centre[1])
    begin = math.atan2(start[1] - centre[1], start[0] - centre[0])
    angles = [begin + k * sweep / count for k in range(1, count)]
    points = [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles]
    return [*points, end]


def run_rows(
    toolpath: Toolpath, pc: Pc, shortest: tuple[int, int], parts: int, per_turn: int, home: Point
) -> tuple[list[int], list[float]]:
    """The row of each sample that `pc` has seen, and the seconds of each row up to the end.
    `shortest`: half periods of moves of both axes, and of one alone."""
    both, one = shortest[0], min(shortest)
    rows: list[int] = []
    seconds: list[float] = []
    x, y, z = toolpath.start.tolist()
    at: Point = (x, y, z)
    for index, row in enumerate(toolpath):
        move = replace(row, start=at)  # homing leads elsewhere than its row says
        before, waited = pc.spent_ms, 0.0
        way = [abs(b - a) / q for a, b, q in zip(at, move.end, pc.q_mm, strict=True)]
        alone = move.centre is None and min(way[:2]) < 0.5 - 1e-7
        p_xy, p_z = one if alone else both, one
        if move.feed is not None:
            p_xy = half_period(move.feed, max(pc.q_mm[:2]), p_xy, parts)
            p_z = half_period(move.feed, pc.q_mm[2], one, parts)
        if move.kind == Kind.DWELL:
            waited = move.value or 0.0
        elif move.kind == Kind.HOME_XY:
            pc.one(1, home[1], one, sensor=True)
            pc.one(0, home[0], one, sensor=True)
            at = home[0], home[1], at[2]
        elif move.kind == Kind.HOME_Z:
            pc.one(2, home[2], one, sensor=True)
            at = at[0], at[1], home[2]
        elif move.kind <= Kind.ARC_CCW:
            ends = [move.end[:2]]
            if move.centre is not None:
                sweep = sweep_of(move)
                ends = chord_ends(move.start[:2], move.end[:2], move.centre, sweep, per_turn)
            if move.centre is not None or move.end[:2] != at[:2] or move.end[2] == at[2]:
                for x, y in ends:
                    pc.xyh(x, y, p_xy)
            if move.end[2] != at[2]:
                pc.one(2, move.end[2], p_z)
            at = move.end
        rows += [index] * (len(pc.seen) - len(rows))
        seconds.append((pc.spent_ms - before) * parts / 1000.0 + waited)
        if move.kind == Kind.END:
            break
    return rows, seconds
