"""A block of stock, cut by a program as a machinist would watch it: heights on a grid.

Shares nothing with camtool: its own reader of G-code, its own lines and arcs, its own tools. A
grid point is a needle, not a cell: what a tool leaves at it is exact for lines at any slope and
for level arcs (sloping arcs are chords of `SAG_MM`). What needs micrometres beside the needles,
how near the tool comes to a wall, is told from points along its path and true distances.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.records import replace

Path = Sequence[tuple[float, float, float]]
"""A closed path: x, y, bulge of the side that leaves there (tan of a quarter of its sweep)."""

SAG_MM = 2e-3
"""How far the chords that stand for sloping arcs are from them."""

CELL_MM = 0.2
"""From one needle to the next."""

POINT_MM = 0.08
"""From one point along the tool's path to the next: a corner passed at 0.5 mm between two of them
is nearer by 1.6 µm."""

SLIVER_MM = 0.01
"""What is thinner stands beside a cut by rounding alone."""

WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")


@dataclass(frozen=True)
class Cutter:
    """A flat end mill; a V bit (`slope`, the tangent of half its angle) with a flat `tip`; mm."""

    radius: float
    slope: float = 0.0
    tip: float = 0.0

    def rise(self, apart: Floats) -> Floats:
        """Height of the tool's surface over its tip, so far from the axis; inf outside."""
        if self.slope == 0.0:
            return np.where(apart <= self.radius, 0.0, math.inf)
        cone = np.maximum(apart - self.tip, 0.0) / self.slope
        return np.where(apart <= self.radius, cone, math.inf)

    def radius_at(self, depth: Floats) -> Floats:
        """Radius of the cut at the surface with the tip at this depth."""
        if self.slope == 0.0:
            return np.where(depth > 0.0, self.radius, 0.0)
        wide = np.minimum(self.tip + depth * self.slope, self.radius)
        return np.where(depth > 0.0, wide, 0.0)


@dataclass(frozen=True)
class Move:
    """One move of a program: from `a` to `b` (x, y, z), round `centre` when it is an arc, by
    `sweep` (CCW positive); `line` of the program, from 1."""

    rapid: bool
    a: tuple[float, float, float]
    b: tuple[float, float, float]
    line: int
    centre: tuple[float, float] | None = None
    sweep: float = 0.0

    @property
    def length(self) -> float:
        """Length of the move, seen from above."""
        if self.centre is None:
            return math.hypot(self.b[0] - self.a[0], self.b[1] - self.a[1])
        return abs(self.sweep) * math.hypot(self.a[0] - self.centre[0], self.a[1] - self.centre[1])

    def at(self, part: Floats) -> Floats:
        """(J, 3) places at these parts of the way."""
        z = self.a[2] + part * (self.b[2] - self.a[2])
        if self.centre is None:
            x = self.a[0] + part * (self.b[0] - self.a[0])
            y = self.a[1] + part * (self.b[1] - self.a[1])
            return np.column_stack([x, y, z])
        cx, cy = self.centre
        angle = math.atan2(self.a[1] - cy, self.a[0] - cx) + part * self.sweep
        radius = math.hypot(self.a[0] - cx, self.a[1] - cy)
        return np.column_stack([cx + radius * np.cos(angle), cy + radius * np.sin(angle), z])

    def points(self, spacing: float) -> Floats:
        """(J, 3) places no farther apart than that, both ends among them."""
        count = max(1, math.ceil(self.length / spacing))
        return self.at(np.arange(count + 1) / count)


def moves_of(program: str) -> list[Move]:
    """The moves of a program in the G-code that LinuxCNC and grbl share: G0 to G3, absolute mm,
    arc centres from the start. Any other G-word that moves or means otherwise is refused."""
    place, mode, found = [0.0, 0.0, 0.0], 0, []
    for number, text in enumerate(program.splitlines(), 1):
        words = WORD.findall(re.sub(r"\(.*?\)|;.*", "", text).upper())
        codes = [float(value) for letter, value in words if letter == "G"]
        for code in codes:
            if code in (0, 1, 2, 3):
                mode = int(code)
            elif code not in (4, 17, 21, 40, 43, 49, 54, 61, 64, 80, 90, 91.1, 94):
                raise ValueError(f"line {number}: G{code:g} is not known here")
        if 4.0 in codes:
            continue
        said = {letter: float(value) for letter, value in words if letter in "XYZIJ"}
        if not said:
            continue
        a = (place[0], place[1], place[2])
        b = tuple(said.get(letter, old) for letter, old in zip("XYZ", a, strict=True))
        centre, sweep = None, 0.0
        if mode in (2, 3):
            centre = a[0] + said.get("I", 0.0), a[1] + said.get("J", 0.0)
            first = math.atan2(a[1] - centre[1], a[0] - centre[0])
            last = math.atan2(b[1] - centre[1], b[0] - centre[0])
            turn = (last - first) % math.tau if mode == 3 else (first - last) % math.tau
            if math.dist(a[:2], b[:2]) < 1e-9:
                turn = math.tau
            sweep = turn if mode == 3 else -turn
        found.append(Move(mode == 0, a, (b[0], b[1], b[2]), number, centre, sweep))
        place = list(b)
    return found


@dataclass
class Cut:
    """The cut of one move: the thickest chip it took at once, mm, and about where."""

    move: Move
    chip: float
    at: tuple[float, float]


@dataclass
class Stock:
    """Needles (ny, nx) that reach up to the stock top, z = 0, over a box of the plane."""

    low: tuple[float, float]
    high: tuple[float, float]
    cell: float = CELL_MM
    x: Floats = field(init=False)
    y: Floats = field(init=False)
    height: Floats = field(init=False)

    def __post_init__(self) -> None:
        # Off the round numbers that drawings are made of.
        self.x = np.arange(self.low[0] + 0.37 * self.cell, self.high[0], self.cell)
        self.y = np.arange(self.low[1] + 0.37 * self.cell, self.high[1], self.cell)
        self.height = np.zeros((len(self.y), len(self.x)))

    @property
    def points(self) -> Floats:
        """(ny · nx, 2) the places of the needles, row by row."""
        x, y = np.meshgrid(self.x, self.y)
        return np.column_stack([x.ravel(), y.ravel()])

    def cut(self, move: Move, cutter: Cutter, limit: float = math.inf) -> Cut:
        """Take away what the tool sweeps along a move.

        A chip thicker than `limit` counts only where a tool thinner by `SLIVER_MM` takes one:
        what the rounding of a program leaves beside a cut is no chip.
        """
        worst, where = 0.0, move.b[:2]
        for piece in _pieces(move):
            chip, at = self._cut_one(piece, cutter, limit)
            if chip > worst:
                worst, where = chip, at
        return Cut(move, worst, where)

    def at(self, points: Floats) -> Floats:
        """(J,) the height of the needle nearest to each point (J, 2)."""
        column = np.clip(np.rint((points[:, 0] - self.x[0]) / self.cell), 0, len(self.x) - 1)
        row = np.clip(np.rint((points[:, 1] - self.y[0]) / self.cell), 0, len(self.y) - 1)
        return np.asarray(self.height[row.astype(int), column.astype(int)])

    def _cut_one(
        self, move: Move, cutter: Cutter, limit: float
    ) -> tuple[float, tuple[float, float]]:
        if min(move.a[2], move.b[2]) >= 0.0:
            return 0.0, move.b[:2]
        low, high = _box(move)
        x0, x1 = np.searchsorted(self.x, [low[0] - cutter.radius, high[0] + cutter.radius])
        y0, y1 = np.searchsorted(self.y, [low[1] - cutter.radius, high[1] + cutter.radius])
        if x0 == x1 or y0 == y1:
            return 0.0, move.b[:2]
        here = self.height[y0:y1, x0:x1]
        x, y = self.x[x0:x1][None, :], self.y[y0:y1][:, None]
        left = _surface(move, cutter, x, y)
        chip = here - left
        if chip.max() > limit:
            thin = replace(cutter, radius=cutter.radius - SLIVER_MM)
            chip = here - _surface(move, thin, x, y)
        k = int(chip.argmax())
        here[:] = np.minimum(here, left)
        row, column = divmod(k, x1 - x0)
        return float(chip.flat[k]), (float(self.x[x0 + column]), float(self.y[y0 + row]))


def _pieces(move: Move) -> Iterator[Move]:
    """The move, or the chords of a sloping arc."""
    if move.centre is None or move.a[2] == move.b[2]:
        yield move
        return
    radius = math.dist(move.a[:2], move.centre)
    most = 2.0 * math.acos(max(1.0 - SAG_MM / radius, 0.0)) if radius > 0.0 else 1.0
    count = max(1, math.ceil(abs(move.sweep) / most))
    ends = move.at(np.arange(count + 1) / count).tolist()
    for a, b in pairwise(ends):
        yield Move(move.rapid, tuple(a), tuple(b), move.line)


def _box(move: Move) -> tuple[tuple[float, float], tuple[float, float]]:
    x, y = (move.a[0], move.b[0]), (move.a[1], move.b[1])
    if move.centre is not None:
        points = move.at(np.linspace(0.0, 1.0, 17))
        bulge = math.dist(move.a[:2], move.centre) * (1.0 - math.cos(move.sweep / 32.0))
        x, y = tuple(points[:, 0]), tuple(points[:, 1])
        return (min(x) - bulge, min(y) - bulge), (max(x) + bulge, max(y) + bulge)
    return (min(x), min(y)), (max(x), max(y))


def _surface(move: Move, cutter: Cutter, x: Floats, y: Floats) -> Floats:
    """The height to which a line, or a level arc, cuts each place; inf where it does not."""
    if move.centre is not None:
        return move.a[2] + cutter.rise(_from_arc(move, x, y))
    ax, ay, az = move.a
    dx, dy, dz = (b - a for a, b in zip(move.a, move.b, strict=True))
    size = math.hypot(dx, dy)
    if size == 0.0:
        return min(az, az + dz) + cutter.rise(np.hypot(x - ax, y - ay))
    along = ((x - ax) * dx + (y - ay) * dy) / size
    aside = np.abs((x - ax) * dy - (y - ay) * dx) / size
    if dz == 0.0:
        return az + cutter.rise(np.hypot(aside, along - np.clip(along, 0.0, size)))
    slope = dz / size
    if cutter.slope == 0.0:
        # Lowest where the disc still covers the place, towards the lower end.
        half = np.sqrt(np.maximum(cutter.radius**2 - aside**2, 0.0))
        reach = along + half if slope < 0.0 else along - half
        best = np.clip(reach, 0.0, size)
        touched = np.hypot(aside, along - best) <= cutter.radius * (1.0 + 1e-12)
        return np.where(touched, az + slope * best, math.inf)
    # z + slope s + (√(aside² + (along − s)²) − tip) / k is least where its derivative is 0, or at
    # an end, or where the flat tip ends to cover the place.
    steep = slope * cutter.slope
    off = -steep * aside / math.sqrt(1.0 - steep**2) if abs(steep) < 1.0 else math.inf
    tip = np.sqrt(np.maximum(cutter.tip**2 - aside**2, 0.0)) * (-1.0 if slope > 0.0 else 1.0)
    tries = [np.zeros_like(aside), np.full_like(aside, size), np.clip(along + tip, 0.0, size)]
    if math.isfinite(float(np.max(np.abs(off)))):
        tries.append(np.clip(along + off, 0.0, size))
    heights = [az + slope * s + cutter.rise(np.hypot(aside, along - s)) for s in tries]
    return np.minimum.reduce(heights)


def _from_arc(move: Move, x: Floats, y: Floats) -> Floats:
    """Distances of places from an arc."""
    assert move.centre is not None
    cx, cy = move.centre
    radius = math.dist(move.a[:2], move.centre)
    first = math.atan2(move.a[1] - cy, move.a[0] - cx)
    turned = np.arctan2(y - cy, x - cx) - first
    turned = np.mod(turned if move.sweep > 0.0 else -turned, math.tau)
    on = np.abs(np.hypot(x - cx, y - cy) - radius)
    ends = np.minimum(
        np.hypot(x - move.a[0], y - move.a[1]), np.hypot(x - move.b[0], y - move.b[1])
    )
    return np.where(turned <= abs(move.sweep), on, ends)


@dataclass(frozen=True)
class Walls:
    """Closed paths as sides: `a`, `b` (K, 2) ends, `centre` (K, 2) and `sweep` (K,) of arcs (0 of
    lines); `ring` (K,) the path of each."""

    a: Floats
    b: Floats
    centre: Floats
    sweep: Floats
    ring: Ints

    @classmethod
    def of(cls, paths: Sequence[Path]) -> Walls:
        """The sides of the paths."""
        rows = []
        for ring, path in enumerate(paths):
            for (ax, ay, bulge), (bx, by, _) in zip(path, [*path[1:], path[0]], strict=True):
                cx = cy = 0.0
                if bulge != 0.0:
                    k = (1.0 - bulge**2) / (4.0 * bulge)
                    cx, cy = 0.5 * (ax + bx) - k * (by - ay), 0.5 * (ay + by) + k * (bx - ax)
                rows.append((ax, ay, bx, by, cx, cy, 4.0 * math.atan(bulge), ring))
        t = np.array(rows, dtype=np.float64).reshape(-1, 8)
        return cls(t[:, 0:2], t[:, 2:4], t[:, 4:6], t[:, 6], t[:, 7].astype(np.int64))

    def distance(self, points: Floats) -> Floats:
        """(J,) from the nearest side."""
        best = np.full(len(points), math.inf)
        for k in range(len(self.a)):
            best = np.minimum(best, self._from_side(k, points))
        return best

    def _from_side(self, k: int, points: Floats) -> Floats:
        (ax, ay), (bx, by) = self.a[k], self.b[k]
        x, y = points[:, 0], points[:, 1]
        if self.sweep[k] == 0.0:
            dx, dy = bx - ax, by - ay
            part = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
            part = np.clip(part, 0.0, 1.0)
            return np.hypot(x - ax - part * dx, y - ay - part * dy)
        cx, cy = self.centre[k]
        turned = np.arctan2(y - cy, x - cx) - math.atan2(ay - cy, ax - cx)
        turned = np.mod(turned if self.sweep[k] > 0.0 else -turned, math.tau)
        on = np.abs(np.hypot(x - cx, y - cy) - math.hypot(ax - cx, ay - cy))
        ends = np.minimum(np.hypot(x - ax, y - ay), np.hypot(x - bx, y - by))
        return np.where(turned <= abs(self.sweep[k]), on, ends)

    def within(self, points: Floats) -> Bools:
        """(J,) whether an odd number of paths hold each point: chords of arcs, and what lies
        between a chord and its arc besides. Points are moved off lines through vertices."""
        x, y = points[:, 0] + 1.7e-8, points[:, 1] + 2.3e-8
        odd = np.zeros(len(points), dtype=np.bool_)
        for k in range(len(self.a)):
            (ax, ay), (bx, by) = self.a[k], self.b[k]
            if (ay > by) != (ay < by):
                spans = (ay > y) != (by > y)
                odd ^= spans & (x < ax + (y - ay) * (bx - ax) / (by - ay))
            if self.sweep[k] != 0.0:
                cx, cy = self.centre[k]
                side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
                beyond = side < 0.0 if self.sweep[k] > 0.0 else side > 0.0
                inside = np.hypot(x - cx, y - cy) < math.hypot(ax - cx, ay - cy)
                odd ^= beyond & inside
        return odd

    def samples(self, spacing: float) -> tuple[Floats, Floats, Ints]:
        """(J, 2) places on the sides (not their ends), (J, 2) the left normals there, and (J,)
        the path of each."""
        places, normals, rings = [], [], []
        for k in range(len(self.a)):
            move = self._as_move(k)
            count = max(2, math.ceil(move.length / spacing))
            part = (np.arange(count) + 0.5) / count
            places.append(move.at(part)[:, :2])
            ahead = move.at(part + 1e-6)[:, :2] - move.at(part - 1e-6)[:, :2]
            ahead /= np.hypot(ahead[:, 0], ahead[:, 1])[:, None]
            normals.append(np.column_stack([-ahead[:, 1], ahead[:, 0]]))
            rings.append(np.full(count, self.ring[k]))
        return np.concatenate(places), np.concatenate(normals), np.concatenate(rings)

    def _as_move(self, k: int) -> Move:
        (ax, ay), (bx, by) = self.a[k].tolist(), self.b[k].tolist()
        sweep = float(self.sweep[k])
        centre = (float(self.centre[k, 0]), float(self.centre[k, 1])) if sweep else None
        return Move(False, (ax, ay, 0.0), (bx, by, 0.0), 0, centre, sweep)

    def only(self, ring: int) -> Walls:
        """The sides of one path."""
        keep = self.ring == ring
        return Walls(
            self.a[keep], self.b[keep], self.centre[keep], self.sweep[keep], self.ring[keep]
        )
