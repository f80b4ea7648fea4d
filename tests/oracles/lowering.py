"""Slow, obvious twins of camtool.toolpath.lower: one move after the other, by trigonometry."""

from __future__ import annotations

import math
from dataclasses import dataclass

from camtool.toolpath.moves import Kind, Move, Toolpath

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Piece:
    """A piece of a lowered move: its kind, its end, its centre and the row that it came from."""

    kind: Kind
    end: Point
    centre: tuple[float, float] | None
    row: int


def xy_then_z(toolpath: Toolpath) -> list[Piece]:
    pieces = []
    for move in toolpath:
        (x0, y0, z0), (x1, y1, z1) = move.start, move.end
        arc = move.centre is not None
        flat = not arc and (x0, y0) == (x1, y1)
        if move.kind > Kind.ARC_CCW or flat or z0 == z1:
            pieces.append(Piece(move.kind, move.end, move.centre, move.index))
            continue
        straight = Kind.LINE if arc else move.kind
        if z1 > z0:
            pieces.append(Piece(straight, (x0, y0, z1), None, move.index))
            pieces.append(Piece(move.kind, move.end, move.centre, move.index))
        else:
            pieces.append(Piece(move.kind, (x1, y1, z0), move.centre, move.index))
            pieces.append(Piece(straight, move.end, None, move.index))
    return pieces


def helices_to_steps(toolpath: Toolpath, max_dz: float) -> list[Piece]:
    """Each slope in the fewest parts of at most max_dz: rise, then along; or along, then sink."""
    pieces = []
    for move in toolpath:
        (x0, y0, z0), (x1, y1, z1) = move.start, move.end
        arc = move.centre is not None
        still = not arc and (x0, y0) == (x1, y1)
        if move.kind > Kind.ARC_CCW or still or z0 == z1:
            pieces.append(Piece(move.kind, move.end, move.centre, move.index))
            continue
        straight = Kind.LINE if arc else move.kind
        count = 1
        while move.kind != Kind.RAPID and abs(z1 - z0) / count > max_dz * (1 + 1e-12):
            count += 1
        here = move.start
        for k in range(1, count + 1):
            share = k / count
            there = (
                point_of(move, share)
                if arc
                else tuple(a + (b - a) * share for a, b in zip(move.start, move.end, strict=True))
            )
            there = move.end if k == count else there
            if there[2] > here[2]:
                pieces.append(Piece(straight, (here[0], here[1], there[2]), None, move.index))
                pieces.append(Piece(move.kind, there, move.centre, move.index))
            else:
                flat = (there[0], there[1], here[2])
                pieces.append(Piece(move.kind, flat, move.centre, move.index))
                pieces.append(Piece(straight, there, None, move.index))
            here = there
    return pieces


def sweep_of(move: Move) -> float:
    """Signed sweep of an arc, rad; a full turn when it ends where it starts."""
    assert move.centre is not None
    cx, cy = move.centre
    begin = math.atan2(move.start[1] - cy, move.start[0] - cx)
    finish = math.atan2(move.end[1] - cy, move.end[0] - cx)
    if move.end[:2] == move.start[:2]:
        finish = begin
    if move.kind == Kind.ARC_CCW:
        return finish - begin + (2 * math.pi if finish <= begin else 0.0)
    return finish - begin - (2 * math.pi if finish >= begin else 0.0)


def split(toolpath: Toolpath, parts: dict[int, int], *, lines: bool = False) -> list[Piece]:
    """Arc `row` in `parts[row]` equal parts (chords of them when `lines`); the rest as it is."""
    pieces = []
    for move in toolpath:
        count = parts.get(move.index, 1)
        kind, centre = move.kind, move.centre
        if lines and move.index in parts:
            kind, centre = Kind.LINE, None
        for k in range(1, count):
            pieces.append(Piece(kind, point_of(move, k / count), centre, move.index))
        pieces.append(Piece(kind, move.end, centre, move.index))
    return pieces


def point_of(move: Move, share: float) -> Point:
    """The point of an arc at `share` of its sweep; radius and Z in proportion."""
    assert move.centre is not None
    (x0, y0, z0), (x1, y1, z1), (cx, cy) = move.start, move.end, move.centre
    r0, r1 = math.dist((x0, y0), (cx, cy)), math.dist((x1, y1), (cx, cy))
    angle = math.atan2(y0 - cy, x0 - cx) + share * sweep_of(move)
    radius = r0 + share * (r1 - r0)
    return (cx + radius * math.cos(angle), cy + radius * math.sin(angle), z0 + share * (z1 - z0))
