"""Random jobs, and what is wrong with a program that does one: judged in a block of stock.

A job says in its own words what shall become of the stock; nothing is taken from camtool's plan
but its findings, which may say beforehand what is found here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from camtool.arrays import Bools, Floats, Ints
from camtool.records import replace
from tests.oracles.stock import CELL_MM, POINT_MM, Cutter, Move, Path, Stock, Walls

Rng = np.random.Generator

GOUGE_MM = 0.02
"""A wall may be cut into by this much."""

CHIP_MM = 0.01
"""A chip may be thicker than the step down, and a rapid may scratch, by this much."""

FAR = 5.0
"""The tool goes nowhere farther from all that is drawn than so many times its distance from the
wall (and its leads), but where a finding says so."""

MARGIN_MM = 8.0
"""So far beside the drawing the stock reaches, at least."""


@dataclass(frozen=True)
class Asked:
    """One operation: `paths` closed, in its frame; `kind` and `side` as camtool calls them;
    lengths in mm. `settings`: whatever else is asked of camtool, by its own names."""

    kind: str
    paths: tuple[Path, ...]
    cutter: Cutter
    depth: float
    side: str = "auto"
    step: float | None = None
    allowance: float = 0.0
    tabs: tuple[int, float, float] | None = None
    leads: tuple[float, float] = (0.0, 0.0)
    """The lengths of the lead in and out, 0 for none."""
    peck: float | None = None
    settings: dict[str, Any] = field(default_factory=dict)

    @property
    def away(self) -> float:
        """From the wall to the tool centre."""
        return self.cutter.radius + self.allowance


@dataclass
class Seen:
    """A program in its stock: its moves, what each cut, and points along all cuts below the top:
    `points` (J, 3) and the `row` (J,) of their move."""

    moves: list[Move]
    stock: Stock
    chips: list[float]
    places: list[tuple[float, float]]
    points: Floats
    row: Ints


def complaints(asked: Asked, moves: list[Move], findings: Collection[str]) -> list[str]:
    """Return the faults of the program; `findings` are the names of reported codes."""
    said = set(findings)
    walls = Walls.of(asked.paths)
    seen = _watched(asked, moves, walls)
    found = [*_chips(asked, seen), *_plunges(asked, seen, walls, said)]
    if asked.kind == "vcarve":
        found += _carving(asked, seen, walls, said)
    elif asked.kind == "drill":
        found += _holes(asked, seen)
    elif asked.kind == "engrave" or asked.side == "on":
        found += _lines(asked, seen, walls)
    else:
        found += _gouges(asked, seen, walls, said)
        found += _left(asked, seen, walls, said)
    if asked.tabs is not None:
        # Where the pass before a finishing pass does not get, no tabs of its own stand.
        found += _tabs(asked, seen, bool(said & {"TAB_LEFT_OUT", "FINISH_IN_PASSES"}))
    return found


def _watched(asked: Asked, moves: list[Move], walls: Walls) -> Seen:
    every = walls.samples(1.0)[0]
    low = every.min(axis=0) - MARGIN_MM - 2.0 * asked.cutter.radius
    high = every.max(axis=0) + MARGIN_MM + 2.0 * asked.cutter.radius
    stock = Stock((low[0], low[1]), (high[0], high[1]), CELL_MM)
    chips, places, points, rows = [], [], [], []
    most = _thickest(asked)
    for row, move in enumerate(moves):
        cut = stock.cut(move, asked.cutter, 0.0 if move.rapid else most)
        chips.append(cut.chip)
        places.append(cut.at)
        if not move.rapid and min(move.a[2], move.b[2]) < -1e-9:
            along = move.points(POINT_MM)
            along = along[along[:, 2] < -1e-9]
            points.append(along)
            rows.append(np.full(len(along), row))
    if not points:
        return Seen(moves, stock, chips, places, np.empty((0, 3)), np.empty(0, dtype=np.int64))
    return Seen(moves, stock, chips, places, np.concatenate(points), np.concatenate(rows))


def _thickest(asked: Asked) -> float:
    """The thickest chip that may be taken at once: a finishing pass takes all of the depth."""
    if "finish_mm" in asked.settings:
        return asked.depth
    step = asked.peck if asked.kind == "drill" else asked.step
    return asked.depth if step is None else step


def _chips(asked: Asked, seen: Seen) -> Iterator[str]:
    """Cuts thicker than the step, and rapids that cut at all; the worst of each."""
    for rapid, limit in ((False, _thickest(asked)), (True, 0.0)):
        rows = [row for row, move in enumerate(seen.moves) if move.rapid == rapid]
        worst = max(rows, key=lambda row: seen.chips[row], default=None)
        if worst is not None and seen.chips[worst] > limit + CHIP_MM:
            x, y = seen.places[worst]
            what = "rapid" if rapid else "step"
            yield (
                f"{what}: line {seen.moves[worst].line} takes {seen.chips[worst]:.3f} mm at once"
                f" instead of {limit:.3f} near ({x:.2f}, {y:.2f})"
            )


def _plunges(asked: Asked, seen: Seen, walls: Walls, said: set[str]) -> Iterator[str]:
    """With a lead-in, the tool goes down beside the wall and not on it."""
    # A line along the tangent of a straight wall begins on that wall, whatever is done.
    kind = getattr(asked.settings.get("lead_in"), "kind", "none")
    is_led = asked.kind == "profile" and kind == "arc" and asked.side != "on"
    if not is_led or asked.tabs is not None or "LEAD_LEFT_OUT" in said:
        return
    for row, move in enumerate(seen.moves):
        down = not move.rapid and move.length == 0.0 and move.b[2] < move.a[2]
        if down and seen.chips[row] > CHIP_MM:
            far = walls.distance(np.array([move.b[:2]]))[0]
            if far < asked.away + 0.01:
                yield f"plunge: line {move.line} goes down on the wall"
                return


def _free(asked: Asked, walls: Walls, points: Floats) -> Floats:
    """Distances of points (J, 2) from the material that must stay; below 0 inside of it."""
    within = walls.within(points)
    stays = within if asked.kind == "profile" and asked.side != "inside" else ~within
    return np.where(stays, -1.0, 1.0) * walls.distance(points)


def _gouges(asked: Asked, seen: Seen, walls: Walls, said: set[str]) -> Iterator[str]:
    """Report places at which the tool's edge enters the wall, or strays from all walls."""
    flat = seen.points[:, :2]
    if len(flat) == 0:
        return
    if "GOUGE" in said:  # the tool does not fit between two parts, and that is said
        return
    free = _free(asked, walls, flat)
    deep = asked.away - free
    if asked.settings.get("corners", "none") != "none":
        deep = np.where(_at_corner(asked, walls, flat), -math.inf, deep)
    k = int(deep.argmax())
    if deep[k] > GOUGE_MM:
        x, y = flat[k].tolist()
        line = seen.moves[int(seen.row[k])].line
        yield f"gouge: {deep[k]:.4f} mm into the wall at ({x:.3f}, {y:.3f}), line {line}"
    if asked.kind == "profile" and "CORNER_FAR" not in said:
        stray = walls.distance(flat) - max(asked.leads) * 1.5 - FAR * asked.away
        k = int(stray.argmax())
        if stray[k] > 0.0:
            line = seen.moves[int(seen.row[k])].line
            yield f"stray: {stray[k]:.2f} mm farther than expected, line {line}"


def _at_corner(asked: Asked, walls: Walls, points: Floats) -> Bools:
    """Points from which the tool's edge reaches a corner of the drawing, and no farther."""
    apart, _ = cKDTree(walls.a).query(points)
    return np.asarray((apart >= asked.away - GOUGE_MM) & (apart <= 1.5 * asked.away))


def _left(asked: Asked, seen: Seen, walls: Walls, said: set[str]) -> Iterator[str]:
    """Report material along walls and on floors that the tool could reach and left."""
    bottom = seen.points[seen.points[:, 2] <= 1e-3 - asked.depth][:, :2]
    place, left, ring = walls.samples(0.25)
    held = asked.tabs is not None
    length = 0.0 if asked.tabs is None else asked.tabs[1] + 2.0 * asked.cutter.radius
    for sign in (1.0, -1.0):
        middle = place + sign * asked.away * left
        step = place + sign * 1e-3 * left
        free = np.full(len(place), -1.0)
        # Outside of each path on its own, whatever is beside it; else of all at once.
        for one in range(len(asked.paths)) if asked.side == "outside" else (-1,):
            mine, part = (ring == one, walls.only(one)) if one >= 0 else (ring >= 0, walls)
            is_free = _free(asked, part, step[mine]) > 0.0
            free[mine] = np.where(is_free, _free(asked, part, middle[mine]), -1.0)
        can = free >= asked.away - 1e-6
        if not can.any():
            continue
        chip = place + sign * (asked.allowance + GOUGE_MM) * left
        far = cKDTree(bottom).query(chip[can])[0] if len(bottom) else np.full(can.sum(), 99.0)
        missed = far > asked.cutter.radius
        if held and missed.any():
            # Tabs, and their slopes, may stand there: as long as they are in all, no longer.
            count, _, height = asked.tabs  # type: ignore[misc]
            most = count * len(asked.paths) * (length + 4.0 * height + 1.0)
            steep = asked.settings.get("entry")
            if steep is not None:
                most += count * len(asked.paths) * 2.0 * height / math.tan(steep.angle_rad)
            # Those of a neighbour, or of the other side, stand here too.
            most *= 2.0 if "TAB_SHARED" in said else 1.0
            total = 0.25 * float(missed.sum())
            if total > most:
                yield f"left: {total:.2f} mm of the wall where tabs account for {most:.2f}"
            continue
        if missed.any():
            x, y = place[can][missed][0].tolist()
            yield f"left: {missed.sum()} places of the wall, the first near ({x:.2f}, {y:.2f})"
    if asked.kind == "pocket":
        points = seen.stock.points
        shape = seen.stock.height.shape
        fits = (_free(asked, walls, points) >= asked.away).reshape(shape)
        near = distance_transform_edt(~fits, sampling=seen.stock.cell) if fits.any() else None
        if near is not None:
            wanted = near <= asked.cutter.radius - seen.stock.cell
            rest = wanted & (seen.stock.height > 0.01 - asked.depth)
            if rest.any():
                row, column = np.argwhere(rest)[0]
                at = f"({seen.stock.x[column]:.2f}, {seen.stock.y[row]:.2f})"
                yield f"left: {rest.sum()} needles of the floor, the first near {at}"


def _lines(asked: Asked, seen: Seen, walls: Walls) -> Iterator[str]:
    """Lines that are followed: nowhere missed at full depth, and nothing else cut."""
    deep = seen.points[seen.points[:, 2] <= 1e-3 - asked.depth][:, :2]
    place, _, _ = walls.samples(0.3)
    far = cKDTree(deep).query(place)[0] if len(deep) else np.full(len(place), 99.0)
    missed = far > 0.5 * POINT_MM + GOUGE_MM
    if asked.tabs is None and missed.any():
        yield f"left: {missed.sum()} places of the line"
    if max(asked.leads) == 0.0:
        off = walls.distance(seen.points[:, :2]).max(initial=0.0)
        if off > GOUGE_MM:
            yield f"gouge: {off:.4f} mm beside the line"


def _carving(asked: Asked, seen: Seen, walls: Walls, said: set[str]) -> Iterator[str]:
    """The cone cuts walls that fall at its angle from the line, down to a floor where depth or
    width ends that, and nothing else:

        depth at a distance s from the line = min(s, limit) / slope    for a pointed bit.
    """
    cutter = asked.cutter
    deep = -seen.points[:, 2]
    wide = cutter.radius_at(deep)
    over = wide - _free(asked, walls, seen.points[:, :2])
    k = int(over.argmax()) if len(over) else 0
    if len(over) and over[k] > GOUGE_MM:
        x, y = seen.points[k, :2].tolist()
        line = seen.moves[int(seen.row[k])].line
        yield f"gouge: {over[k]:.4f} mm beyond the line at ({x:.3f}, {y:.3f}), line {line}"
    limit = min(cutter.tip + asked.depth * cutter.slope, cutter.radius)
    points = seen.stock.points
    inward = _free(asked, walls, points)
    got = -seen.stock.height.ravel()
    most = np.where(inward > 0.0, np.minimum(inward, limit) - cutter.tip, 0.0)
    most = np.where(inward >= cutter.tip, np.maximum(most, 0.0), 0.0) / cutter.slope
    if cutter.tip == 0.0:
        wanted = (inward > 0.0) & (inward <= limit - seen.stock.cell)
        less = np.where(wanted, most - got, 0.0)
        k = int(less.argmax())
        if less[k] > GOUGE_MM / cutter.slope:
            x, y = points[k].tolist()
            yield f"left: {less[k]:.3f} mm of what the bit can cut near ({x:.2f}, {y:.2f})"
    more = got - np.where(inward > 0.0, (limit - cutter.tip) / cutter.slope, 0.0)
    if more.max() > GOUGE_MM / cutter.slope:
        yield f"gouge: {more.max():.3f} mm deeper than depth and bit allow"


def _holes(asked: Asked, seen: Seen) -> Iterator[str]:
    """Each circle, given as two half circles, is drilled in its middle to the depth."""
    for path in asked.paths:
        middle = np.mean([place[:2] for place in path], axis=0)
        near = np.hypot(*(seen.points[:, :2] - middle).T) <= GOUGE_MM
        if not near.any() or seen.points[near, 2].min() > 1e-3 - asked.depth:
            yield f"left: the hole at ({middle[0]:.2f}, {middle[1]:.2f})"


def _tabs(asked: Asked, seen: Seen, some_left_out: bool) -> Iterator[str]:
    """As many bridges as asked for, as wide and as high, in the end; where some were left out, and
    that is said, all for which the tool goes up so far."""
    assert asked.tabs is not None
    count, width, height = asked.tabs
    top = height - asked.depth
    wanted, bridges = 0, 0
    for stay in _stays(seen.moves):
        if min(move.b[2] for move in stay) > 1e-3 - asked.depth:
            continue
        pieces = list(_raised(stay, top))
        bridges += sum(_is_whole(asked, seen, piece) for piece in pieces)
        long = sum(_length(piece) > width + 2.0 * asked.cutter.radius - 0.1 for piece in pieces)
        wanted += min(count, long) if some_left_out else count
    if bridges < wanted:
        yield f"tabs: {bridges} bridges of {width} mm instead of {wanted}"


def _length(piece: Floats) -> float:
    return float(np.hypot(*np.diff(piece[:, :2], axis=0).T).sum())


def _stays(moves: list[Move]) -> Iterator[list[Move]]:
    """The feeds between rapids."""
    stay: list[Move] = []
    for move in moves:
        if move.rapid:
            if stay:
                yield stay
            stay = []
        else:
            stay.append(move)


def _raised(stay: list[Move], top: float) -> Iterator[Floats]:
    """The stretches (J, 3) of the last time round that keep above the bridge."""
    points = np.concatenate([move.points(0.05) for move in stay])
    low = np.flatnonzero(points[:, 2] < top - 0.02)
    # A stretch lies between two places below the bridge's top, both at the lowest level near it.
    for i, j in pairwise(low.tolist()):
        if j - i > 2:
            piece = points[i + 1 : j]
            lower = min(points[i, 2], points[j, 2])
            if lower < top - 0.02:
                yield piece
    # A finishing pass may begin on a bridge, and end there.
    if len(low) and low[0] and low[-1] < len(points) - 1:
        yield np.concatenate([points[low[-1] + 1 :], points[: low[0]]])


def _is_whole(asked: Asked, seen: Seen, piece: Floats) -> bool:
    """True if the stock still stands between both sides of the cut, somewhere on a raised stretch,
    over the required width."""
    assert asked.tabs is not None
    _, width, height = asked.tabs
    flat, reach = piece[:, :2], width + 2.0 * asked.cutter.radius - 0.1
    half = max(0.5 * width - 2.0 * seen.stock.cell, 0.0)
    s = np.linspace(-half, half, 9)
    t = np.linspace(-asked.cutter.radius, asked.cutter.radius, 21)
    for k in range(len(flat)):
        # The chord about this place that is as long as the tool must stay up.
        far = np.minimum(*(np.hypot(*(flat[side] - flat[k]).T).max() for side in _sides(k)))
        if 2.0 * far < reach - 0.2:
            continue
        ends = [_first_far(flat[side], flat[k], 0.5 * reach - 0.1) for side in _sides(k)]
        chord = ends[1] - ends[0]
        # Round a corner a bridge may stand askew.
        for turn in np.radians([0, 15, -15, 30, -30, 45, -45, 60, -60, 75, -75]):
            angle = math.atan2(chord[1], chord[0]) + turn
            ahead = np.array([math.cos(angle), math.sin(angle)])
            aside = np.array([-ahead[1], ahead[0]])
            grid = flat[k] + s[:, None, None] * ahead + t[None, :, None] * aside
            if (seen.stock.at(grid.reshape(-1, 2)) >= height - asked.depth - 0.02).all():
                return True
    return False


def _sides(k: int) -> tuple[slice, slice]:
    return slice(k, None, -1), slice(k, None)


def _first_far(points: Floats, place: Floats, far: float) -> Floats:
    """The first of the points that is so far from a place, or the farthest."""
    apart = np.hypot(*(points - place).T)
    beyond = np.flatnonzero(apart >= far)
    return points[beyond[0] if len(beyond) else int(apart.argmax())]


# ----- random jobs ---------------------------------------------------------------------------

Make = Callable[[Rng], Path]
QUARTER = math.tan(math.pi / 8.0)


def circle(x: float, y: float, radius: float) -> Path:
    """Two half circles."""
    return [(x - radius, y, 1.0), (x + radius, y, 1.0)]


def rectangle(w: float, h: float, r: float = 0.0) -> Path:
    """With its lower left corner at 0, and corners of radius r."""
    if r == 0.0:
        return [(0.0, 0.0, 0.0), (w, 0.0, 0.0), (w, h, 0.0), (0.0, h, 0.0)]
    return [
        (r, 0.0, 0.0), (w - r, 0.0, QUARTER), (w, r, 0.0), (w, h - r, QUARTER),
        (w - r, h, 0.0), (r, h, QUARTER), (0.0, h - r, 0.0), (0.0, r, QUARTER),
    ]  # fmt: skip


def ell(w: float, h: float, t: float) -> Path:
    """An L, t wide."""
    return [(0, 0, 0), (w, 0, 0), (w, t, 0), (t, t, 0), (t, h, 0), (0, h, 0)]


def star(points: int, inner: float, outer: float) -> Path:
    """Straight sides about 0."""
    angle = np.arange(2 * points) * np.pi / points
    radius = np.where(np.arange(2 * points) % 2, inner, outer)
    return [
        (float(r * math.cos(a)), float(r * math.sin(a)), 0.0)
        for r, a in zip(radius, angle, strict=True)
    ]


def moved(path: Path, dx: float, dy: float) -> Path:
    """So much farther."""
    return [(x + dx, y + dy, bulge) for x, y, bulge in path]


def reversed_path(path: Path) -> Path:
    """The same, travelled the other way."""
    back = list(path[::-1])
    bulges = [path[(len(path) - 2 - k) % len(path)][2] for k in range(len(path))]
    return [(x, y, -bulge) for (x, y, _), bulge in zip(back, bulges, strict=True)]


def rounded(path: Path, digits: int = 3) -> Path:
    """As files have it."""
    return [(round(x, digits), round(y, digits), bulge) for x, y, bulge in path]


def _shape(rng: Rng, size: float) -> Path:
    """A random closed path about so large, its box beginning at 0."""
    w, h = (float(v) for v in rng.uniform(0.6, 1.2, 2) * size)
    kind = int(rng.integers(6))
    if kind == 0:
        return rectangle(w, h)
    if kind == 1:
        return rectangle(w, h, float(rng.uniform(0.05, 0.3)) * min(w, h))
    if kind == 2:
        return moved(circle(0.0, 0.0, 0.5 * w), 0.5 * w, 0.5 * w)
    if kind == 3:
        return ell(w, h, float(rng.uniform(0.3, 0.6)) * min(w, h))
    if kind == 4:
        r = 0.25 * h
        return [(r, 0, 0), (w, 0, 1.0), (w, 2 * r, 0), (r, 2 * r, 1.0)]
    points = int(rng.integers(4, 8))
    return moved(star(points, float(rng.uniform(0.2, 0.4)) * w, 0.5 * w), 0.5 * w, 0.5 * w)


def _layout(rng: Rng, size: float, gap: float, nested: bool = True) -> tuple[Path, ...]:
    """Make one path, two beside each other with this gap, four, or one within another."""
    one = _shape(rng, size)
    wide = max(x for x, _, _ in one)
    kind = int(rng.integers(5 if nested else 3))
    if kind == 0:
        return (one,)
    if kind == 1:
        return one, moved(_shape(rng, size), _right(one) + gap, 0.0)
    if kind == 2:
        step, up = _right(one) + gap, _top(one) + gap
        return tuple(moved(one, i * step, j * up) for j in range(2) for i in range(2))
    if kind == 3:
        outer = rectangle(2.0 * wide, 2.0 * wide)
        return outer, moved(circle(0.0, 0.0, 0.3 * wide), wide, wide)
    inner = rectangle(0.5 * wide, 0.6 * wide, 0.1 * wide)
    return rectangle(1.3 * wide, 1.5 * wide), moved(inner, 0.3 * wide, 0.4 * wide)


def _around(path: Path) -> float:
    """Approximate length of the path, mm."""
    return 0.1 * len(Walls.of([path]).samples(0.1)[0])


def _right(path: Path) -> float:
    return float(Walls.of([path]).samples(0.1)[0][:, 0].max())


def _top(path: Path) -> float:
    return float(Walls.of([path]).samples(0.1)[0][:, 1].max())


def random_job(rng: Rng) -> Asked:
    """Make an operation on a random layout, with random options that fit together."""
    kind = str(
        rng.choice(["profile", "profile", "profile", "pocket", "engrave", "drill", "vcarve"])
    )
    made = {
        "profile": _profile,
        "pocket": _pocket,
        "engrave": _engrave,
        "drill": _drill,
        "vcarve": _vcarve,
    }[kind](rng)
    paths = tuple(
        rounded(reversed_path(path) if rng.random() < 0.3 else path) for path in made.paths
    )
    # A generator of its own, so that all other choices stay those of the seed.
    return _finished(replace(made, paths=paths), rng.spawn(1)[0])


def _finished(asked: Asked, rng: Rng) -> Asked:
    """With a finishing pass at the wall or without, and another allowance."""
    if asked.kind not in ("profile", "pocket") or asked.side == "on" or rng.random() < 0.5:
        return asked
    finish = float(rng.choice([0.05, 0.1, 0.2])) * 2.0 * asked.cutter.radius
    allowance = float(rng.choice([asked.allowance, 0.0, 0.1, -0.1]))
    return replace(asked, allowance=allowance, settings=asked.settings | {"finish_mm": finish})


def _depth(rng: Rng) -> tuple[float, float | None, dict[str, Any]]:
    depth = float(rng.choice([1.0, 2.0, 3.0, 6.0]))
    step = None if rng.random() < 0.3 else depth / float(rng.choice([1.5, 2.0, 3.0, 5.0]))
    rest: dict[str, Any] = {}
    if step is not None and rng.random() < 0.3:
        rest["last_pass_mm"] = 0.3 * step
    return depth, step, rest


def _entry(rng: Rng, *kinds: str) -> dict[str, Any]:
    from camtool.planning.job import Entry

    kind = str(rng.choice(["plunge", *kinds]))
    if kind == "plunge":
        return {}
    return {"entry": Entry(kind, math.radians(float(rng.choice([2.0, 5.0, 12.0]))))}


def _profile(rng: Rng) -> Asked:
    from camtool.planning.job import Lead

    diameter = float(rng.choice([1.0, 2.0, 3.0, 6.0]))
    side = str(rng.choice(["auto", "outside", "outside", "inside", "on"]))
    depth, step, settings = _depth(rng)
    settings |= _entry(rng, "ramp")
    gap = diameter * float(rng.choice([0.6, 1.02, 1.07, 1.2, 1.4, 1.7, 2.2, 4.0]))
    nested = side not in ("outside", "inside")
    paths = _layout(rng, float(rng.uniform(4.0, 9.0)) * max(diameter, 2.0), gap, nested)
    leads = [0.0, 0.0]
    for k, name in enumerate(("lead_in", "lead_out")):
        if rng.random() < 0.4:
            leads[k] = float(rng.choice([0.5, 1.0, 2.0])) * diameter
            settings[name] = Lead(str(rng.choice(["line", "arc"])), leads[k])
    tabs = None
    if rng.random() < 0.4:
        from camtool.planning.job import Tabs

        tabs = int(rng.integers(2, 5)), float(rng.choice([1.0, 2.0, 3.0])), 0.3 * depth
        settings["tabs"] = Tabs(
            count=tabs[0], width_mm=tabs[1], height_mm=tabs[2], ramped=bool(rng.random() < 0.4)
        )
        angle = settings["entry"].angle_rad if "entry" in settings else 0.25 * math.pi
        slope = 2.0 * tabs[2] / math.tan(min(angle, 0.25 * math.pi))
        room = min(_around(path) for path in paths) - 4.0 * diameter
        if tabs[0] * (tabs[1] + diameter + slope) > 0.7 * room:
            tabs = settings.pop("tabs", None) and None
    allowance = float(rng.choice([0.0, 0.0, 0.3])) if side != "on" else 0.0
    settings["direction"] = str(rng.choice(["drawn", "climb", "conventional"]))
    settings["joins"] = str(rng.choice(["round", "round", "mitre", "sharp"]))
    if rng.random() < 0.2:
        settings["corners"] = str(rng.choice(["dogbone", "overcut"]))
        paths = (ell(12.0 * diameter, 10.0 * diameter, 5.0 * diameter),)
    if rng.random() < 0.3:
        settings["overlap_mm"] = 0.7 * diameter
    if rng.random() < 0.3:
        settings["start"] = str(rng.choice(["longest-line", "corner"]))
    cutter = Cutter(0.5 * diameter)
    return Asked(
        "profile", paths, cutter, depth, side, step, allowance, tabs, (leads[0], leads[1]),
        settings=settings,
    )  # fmt: skip


def _pocket(rng: Rng) -> Asked:
    diameter = float(rng.choice([1.5, 2.0, 3.0]))
    depth, step, settings = _depth(rng)
    settings |= _entry(rng, "ramp", "helix")
    settings["pattern"] = str(rng.choice(["contour", "zigzag"]))
    if settings["pattern"] == "zigzag":
        settings["angle_rad"] = float(rng.choice([0.0, 0.5]))
    settings["step_over"] = float(rng.choice([0.3, 0.45, 0.6, 0.9]))
    settings["direction"] = str(rng.choice(["drawn", "climb", "conventional"]))
    gap = diameter * float(rng.choice([0.5, 1.2, 2.0]))
    paths = _layout(rng, float(rng.uniform(4.0, 8.0)) * diameter, gap)
    allowance = float(rng.choice([0.0, 0.0, 0.3]))
    return Asked(
        "pocket", paths, Cutter(0.5 * diameter), depth, "auto", step, allowance, settings=settings
    )


def _engrave(rng: Rng) -> Asked:
    depth, step, settings = _depth(rng)
    settings |= _entry(rng, "ramp")
    if rng.random() < 0.3:
        settings["overlap_mm"] = 0.5
    paths = _layout(rng, float(rng.uniform(8.0, 20.0)), float(rng.uniform(0.5, 5.0)))
    cutter = Cutter(0.5 * float(rng.choice([0.6, 1.0, 2.0])))
    return Asked("engrave", paths, cutter, depth, "on", step, settings=settings)


def _drill(rng: Rng) -> Asked:
    diameter = float(rng.choice([2.0, 3.0]))
    count = int(rng.integers(1, 8))
    paths = tuple(
        circle(3.0 * diameter * k, float(rng.uniform(0.0, 20.0)), 0.5 * diameter)
        for k in range(count)
    )
    depth = float(rng.choice([2.0, 5.0, 10.0]))
    peck = None if rng.random() < 0.3 else depth / float(rng.choice([1.5, 3.0, 4.0]))
    settings = {} if peck is None else {"peck_mm": peck}
    return Asked("drill", paths, Cutter(0.5 * diameter), depth, peck=peck, settings=settings)


def _vcarve(rng: Rng) -> Asked:
    angle = math.radians(float(rng.choice([30.0, 60.0, 90.0, 120.0])))
    tip = 0.5 * float(rng.choice([0.0, 0.0, 0.3]))
    cutter = Cutter(0.5 * float(rng.choice([4.0, 6.0, 12.0])), math.tan(0.5 * angle), tip)
    depth = float(rng.choice([0.5, 1.0, 2.0, 20.0]))
    step = None if rng.random() < 0.4 else depth / float(rng.choice([1.5, 2.0, 3.0, 5.0]))
    paths = _layout(rng, float(rng.uniform(6.0, 22.0)), float(rng.uniform(1.0, 4.0)))
    return Asked("vcarve", paths, cutter, depth, step=step)


def described(asked: Asked) -> str:
    """The job in one line, for whoever must find it again."""
    rest = ", ".join(f"{name}={value}" for name, value in asked.settings.items())
    return (
        f"{asked.kind} {asked.side}, {len(asked.paths)} paths, {asked.cutter}, depth"
        f" {asked.depth}, step {asked.step}, allowance {asked.allowance}; {rest}"
    )
