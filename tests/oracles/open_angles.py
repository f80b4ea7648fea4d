"""The engagement of `camtool.kernels.engagement`, written out literally: no grid, each place of a
move against every earlier one, intervals as lists. To the same bits."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from camtool.arrays import Bools, Floats

RECENT, FINEST, FINEST_TURN = 100.0, 1.0 / 16.0, 1e-3
NO_ANGLE, LEVEL_MM, WAITING = 1e-7, 1e-6, 128
Interval = tuple[float, float]


def hypot(x: float, y: float) -> float:
    """The one of C: that of `math` rounds otherwise."""
    return float(np.hypot(x, y))


class Cleared:
    """The moves that have cut so far, (x, y, x, y, radius, highest z, way) each."""

    def __init__(self, box: Floats, *, from_right: bool = False) -> None:
        self.box, self.from_right = box.tolist(), from_right
        self.cuts: list[tuple[float, ...]] = []
        self.reach, self.x, self.y, self.travelled = 0.0, 0.0, 0.0, 0.0

    @classmethod
    def like(cls, _: Floats, reach_mm: float, box: Floats, *, from_right: bool = False) -> Cleared:
        """With the arguments of the kernel's."""
        made = cls(box, from_right=from_right)
        made.reach = reach_mm
        return made

    def add(self, moves: Floats) -> None:
        for move in moves.tolist():
            self._go_to(move)
            self._add(move)

    def judge(
        self, moves: Floats, cuts: Bools, thick: float, enough: float, fine: float, *,
        adds: bool = True, coarse_rad: float = math.inf, known_rad: float = math.inf,
    ) -> Floats:  # fmt: skip
        bound, greatest = np.zeros(len(moves)), known_rad
        for number, (move, is_cut) in enumerate(zip(moves.tolist(), cuts, strict=True)):
            if not is_cut:
                continue
            self._go_to(move)
            least = greatest if greatest < math.inf else enough
            bound[number] = self._greatest(move, thick, enough, fine, coarse_rad, least)
            if greatest >= 0.0:
                greatest = max(greatest, bound[number])
            if adds:
                self._add(move)
        return bound

    def _go_to(self, move: list[float]) -> None:
        if move[0] != self.x or move[1] != self.y:
            self.travelled += 4.0 * self.reach
            self.x, self.y = move[0], move[1]

    def _add(self, move: list[float]) -> None:
        self.travelled += hypot(move[2] - move[0], move[3] - move[1])
        self.x, self.y = move[2], move[3]
        self.cuts.append((*move[:5], move[6], self.travelled))

    def _greatest(
        self,
        move: list[float],
        thick: float,
        enough: float,
        fine: float,
        coarse: float,
        least: float,
    ) -> float:
        length = hypot(move[2] - move[0], move[3] - move[1])
        if length == 0.0:
            return self._all_round(move, thick)
        best, waiting = 0.0, [(0.0, length)]
        while waiting:
            low, high = waiting.pop()
            half = 0.5 * (high - low)
            bound = self._bound(move, length, low, high, thick)
            if bound <= best:
                continue
            is_finest = half <= FINEST * thick and turn_of(move, length, half) <= FINEST_TURN
            if bound <= least or is_finest or len(waiting) + 2 > WAITING:
                best = bound
                continue
            value = self.open_angle(move, length, low + half, thick, thick)
            if bound - value <= (coarse if bound <= enough else fine) < math.inf:
                best = bound
                continue
            if value > enough and fine == math.inf:
                return value
            waiting += [(low, low + half), (low + half, high)]
        return best

    def try_moves(
        self, moves: Floats, thick: float, limit: float, *, coarse_rad: float = math.inf
    ) -> tuple[float, int, float]:
        before, greatest, place = self.__dict__.copy(), 0.0, (len(moves), 0.0)
        self.cuts = self.cuts.copy()
        for number, move in enumerate(moves.tolist()):
            self._go_to(move)
            bound = self._greatest(move, thick, limit, math.inf, math.inf, limit)
            if bound > limit:
                length = hypot(move[2] - move[0], move[3] - move[1])
                first = self._first_above(move, length, (0.0, length), thick, limit)
                greatest, place = bound, (number, (first or 0.0) / (length or 1.0))
                break
            if coarse_rad < math.inf and bound > greatest:
                near = self._greatest(move, thick, limit, math.inf, coarse_rad, greatest)
                bound = min(bound, near)
            greatest = max(greatest, bound)
            self._add(move)
        self.__dict__.update(before)
        return greatest, *place

    def _first_above(
        self,
        move: list[float],
        length: float,
        stretch: tuple[float, float],
        thick: float,
        limit: float,
    ) -> float | None:
        """Return the first place of a stretch that may exceed a limit: where one begins that
        cannot be halved, or the middle of one."""
        low, high = stretch
        half = 0.5 * (high - low)
        if length > 0.0:
            bound = self._bound(move, length, low, high, thick)
            if bound <= limit:
                return None
        if length == 0.0 or (
            half <= FINEST * thick and turn_of(move, length, half) <= FINEST_TURN
        ):
            return low
        is_above = self.open_angle(move, length, low + half, thick, thick) > limit
        first = self._first_above(move, length, (low, low + half), thick, limit)
        if first is not None:
            return first
        if is_above:
            return low + half
        return self._first_above(move, length, (low + half, high), thick, limit)

    def _all_round(self, move: list[float], thick: float) -> float:
        angle = 0.0
        for side in (-1.0, 1.0):
            aside = [*move[:2], move[0] + side, move[1], *move[4:7], 0.0, 0.0]
            angle += self.open_angle(aside, 1.0, 0.0, 2.0 * thick, thick)
        return angle

    def _bound(
        self, move: list[float], length: float, low: float, high: float, thick: float
    ) -> float:
        """The bound of the engagement in a stretch of a move: at most half of the circle."""
        half = 0.5 * (high - low)
        turn = turn_of(move, length, half)
        angle = self.open_angle(move, length, low + half, thick - half, thick, half, turn)
        return min(angle, math.pi)

    def open_angle(
        self,
        move: list[float],
        length: float,
        middle: float,
        grow: float,
        thick: float,
        before: float = 0.0,
        wider: float = 0.0,
    ) -> float:
        """The open angle at a place of a move, of a front that is wider by an angle at both ends;
        the last of the way is that to a place that lies `before`."""
        ex, ey = (move[2] - move[0]) / length, (move[3] - move[1]) / length
        x, y = move[0] + middle * ex, move[1] + middle * ey
        askew = move[7] + middle / length * (move[8] - move[7])
        c, s = math.cos(askew), math.sin(askew)
        turn = math.atan2(s * ex + c * ey, c * ex - s * ey)
        recent = self.travelled + middle - before - RECENT * thick
        front = min(0.5 * math.pi + wider, math.pi)
        arcs, radius = [(-front, front)], move[4]
        for cosine, about in (
            ((self.box[2] - grow - x) / radius, -turn),
            ((self.box[3] - grow - y) / radius, 0.5 * math.pi - turn),
            ((x - self.box[0] - grow) / radius, math.pi - turn),
            ((y - self.box[1] - grow) / radius, -0.5 * math.pi - turn),
        ):
            if cosine < 1.0:
                half = math.pi if cosine <= -1.0 else math.acos(cosine)
                arcs = without(arcs, about - half, about + half)
        direction = (c * ex - s * ey, s * ex + c * ey)
        for ax, ay, bx, by, wide, top, way in self.cuts:
            if top > move[5] + LEVEL_MM:
                continue
            wide += grow - thick if way > recent else grow
            if wide > 0.0:
                ends = (ax, ay, bx, by)
                for one, other in cleared_by(ends, (x, y), wide, radius, direction):
                    arcs = without(arcs, one, other)
        angle = 0.0
        for one, other in arcs:
            angle += other - one
        if self.from_right and arcs:
            angle = arcs[-1][1] + front
        return angle if angle > NO_ANGLE else 0.0


def turn_of(move: list[float], length: float, part: float) -> float:
    """The angle by which the tool turns on a part of a move."""
    return part / length * abs(move[8] - move[7])


def cleared_by(
    ends: tuple[float, ...], place: Interval, wide: float, r: float, direction: Interval
) -> Iterator[Interval]:
    """Yield the intervals of the angles of a circle of radius r about a place that are nearer than
    `wide` to a move: those in the discs at its ends, and beside it."""
    (ax, ay, bx, by), (x, y), (dx, dy) = ends, place, direction
    length = hypot(bx - ax, by - ay)
    for gx, gy in [(ax - x, ay - y), (bx - x, by - y)][: 1 if length == 0.0 else 2]:
        gap = hypot(gx, gy)
        if gap >= wide + r or gap + wide <= r:
            continue
        if gap + r <= wide:
            yield -math.pi, math.pi
            continue
        cosine = (gap * gap + r * r - wide * wide) / (2.0 * gap * r)
        half = math.pi if cosine <= -1.0 else math.acos(min(cosine, 1.0))
        middle = math.atan2(dx * gy - dy * gx, dx * gx + dy * gy)
        yield middle - half, middle + half
    if length == 0.0:
        return
    ex, ey = (bx - ax) / length, (by - ay) / length
    along, across = (x - ax) * ex + (y - ay) * ey, (y - ay) * ex - (x - ax) * ey
    c0, c1 = -along / r, (length - along) / r
    s0, s1 = (-wide - across) / r, (wide - across) / r
    if c0 >= 1.0 or c1 <= -1.0 or s0 >= 1.0 or s1 <= -1.0:
        return
    low = 0.0 if c1 >= 1.0 else math.acos(c1)
    high = math.pi if c0 <= -1.0 else math.acos(c0)
    first = -0.5 * math.pi if s0 <= -1.0 else math.asin(s0)
    last = 0.5 * math.pi if s1 >= 1.0 else math.asin(s1)
    turn = math.atan2(ey, ex) - math.atan2(dy, dx)
    for one, other in ((low, high), (-high, -low)):
        for sine, sine_end in ((first, last), (math.pi - last, math.pi - first)):
            for round_rad in (0.0, 2.0 * math.pi):
                begin, end = max(one, sine - round_rad), min(other, sine_end - round_rad)
                if begin < end:
                    yield begin + turn, end + turn


def without(arcs: list[Interval], low: float, high: float) -> list[Interval]:
    """Return intervals less one, which may be given in any whole turn."""
    shift = math.remainder(low, 2.0 * math.pi) - low
    for turn in (-1.0, 0.0, 1.0):
        one = low + shift + turn * 2.0 * math.pi
        other = high + shift + turn * 2.0 * math.pi
        rest = list[Interval]()
        for begin, end in arcs:
            if other <= begin or one >= end:
                rest.append((begin, end))
                continue
            if one > begin:
                rest.append((begin, one))
            if other < end:
                rest.append((other, end))
        arcs = rest
    return arcs
