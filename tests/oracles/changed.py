"""Whether two programs make a different part, or endanger it otherwise: by very many points.

Every feed is walked in small chords where it is in the stock. A point of one program that has no
point of the other near it (in X, Y and Z) on a chord that runs the same way at the same feed, with
the spindle and the tool as they are there, is a difference; so is a move that is cut more often, a
rapid that runs lower, an end that is missing or lower, and a wait that is left out.
"""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from camtool.arrays import Floats
from camtool.records import replace
from camtool.toolpath.moves import Kind, Move, Toolpath

CHORDS = 24
"""Chords of an arc or line, at least."""


def makes_a_difference(before: Toolpath, after: Toolpath, *, apart_mm: float, feed: float) -> bool:
    """True if `after` differs from `before` by more than `apart_mm`, or by `feed` mm/min."""
    one, other = _Work(before, apart_mm), _Work(after, apart_mm)
    if other.ended < one.ended or other.lowest < one.lowest - apart_mm:
        return True
    if other.last < one.last - apart_mm or other.waits != one.waits:
        return True
    if any(count > one.moves[move] for move, count in other.moves.items() if move in one.moves):
        return True
    return one.lacks(other, apart_mm, feed) or other.lacks(one, apart_mm, feed)


class _Work:
    """The moves of a program that feed into the stock, and what else matters."""

    def __init__(self, toolpath: Toolpath, apart_mm: float) -> None:
        self.moves: Counter[tuple[object, ...]] = Counter()
        self.chords: list[tuple[Floats, Floats, tuple[object, ...], tuple[float, ...]]] = []
        self.ended, self.lowest, self.waits = False, math.inf, 0.0
        state: tuple[float, ...] = (0.0, 0.0)
        position = tuple(toolpath.start.tolist())
        for move in toolpath:
            if move.kind == Kind.END:
                self.ended = True
                break
            if move.kind in (Kind.SPINDLE_CW, Kind.SPINDLE_CCW, Kind.SPINDLE_OFF):
                sign = {Kind.SPINDLE_CW: 1.0, Kind.SPINDLE_CCW: -1.0, Kind.SPINDLE_OFF: 0.0}
                state = (sign[move.kind] * (move.value or 0.0), state[1])
            elif move.kind == Kind.TOOL_CHANGE:
                state = (state[0], move.value or 0.0)
            elif move.kind == Kind.DWELL:
                self.waits += move.value or 0.0
            if move.kind > Kind.ARC_CCW:
                continue
            position = move.end
            if move.kind == Kind.RAPID:
                if move.start[:2] != move.end[:2]:
                    self.lowest = min(self.lowest, move.start[2], move.end[2])
            elif min(move.start[2], move.end[2]) < 0.0:
                key = tuple(np.round([*move.start, *move.end, *(move.centre or ())], 6).tolist())
                if key[:3] != key[3:6] or move.centre is not None:
                    self.moves[(move.kind, *key)] += 1
                    points = _points(_sunk(move), apart_mm)
                    key = (move.kind, *key, move.feed, state)
                    self.chords.append((points[:-1], points[1:], key, (move.feed or 0.0, *state)))
        self.last = position[2]

    def lacks(self, other: _Work, apart_mm: float, feed: float) -> bool:
        """True if a chord of this path has no similar chord of the other one nearby."""
        known = {key for _, _, key, _ in other.chords}
        rest = [chord for chord in self.chords if chord[2] not in known]
        if not rest:
            return False
        if not other.chords:
            return True
        begin, end = (np.concatenate([chord[k] for chord in other.chords]) for k in (0, 1))
        counts = [len(chord[0]) for chord in other.chords]
        states = np.repeat(np.array([chord[3] for chord in other.chords]), counts, axis=0)
        way = end - begin
        long = np.linalg.norm(way, axis=1)
        kept = long > 0.0
        begin, way, long, states = begin[kept], way[kept], long[kept], states[kept]
        for first, last, _, state in rest:
            alike = (np.abs(states - state) <= [feed, 0.5, 0.5]).all(axis=1)
            if not alike.any():
                return True
            b, w, n = begin[alike], way[alike], long[alike]
            for p, q in zip(first, last, strict=True):
                own = np.linalg.norm(q - p)
                if own == 0.0:
                    continue
                same = (w @ (q - p)) / (n * own) > 0.5
                for place in (p + 0.02 * (q - p), 0.5 * (p + q), q - 0.02 * (q - p)):
                    share = np.clip(((place - b) * w).sum(axis=1) / n**2, 0.0, 1.0)
                    gap = np.linalg.norm(b + share[:, None] * w - place, axis=1)
                    if not (same & (gap <= apart_mm)).any():
                        return True
        return False


def _sunk(move: Move) -> Move:
    """The part of a move that is in the stock; of an arc all of it."""
    (x, y, z), (a, b, c) = move.start, move.end
    if move.centre is not None or z * c >= 0.0:
        return move
    share = z / (z - c)
    top = (x + share * (a - x), y + share * (b - y), 0.0)
    return replace(move, **{"end" if z < 0.0 else "start": top})


def _points(move: Move, apart_mm: float) -> Floats:
    """(n, 3) points along a move; an arc's radius changes evenly from its start to its end."""
    start, end = np.array(move.start), np.array(move.end)
    if move.centre is None:
        share = np.linspace(0.0, 1.0, CHORDS + 1)[:, None]
        return start + share * (end - start)
    arms = start[:2] - move.centre, end[:2] - move.centre
    angles = [math.atan2(arm[1], arm[0]) for arm in arms]
    radii = [math.hypot(*arm) for arm in arms]
    sign = 1.0 if move.kind == Kind.ARC_CCW else -1.0
    sweep = (sign * (angles[1] - angles[0])) % math.tau
    if move.start[:2] == move.end[:2] or sweep == 0.0:
        sweep = math.tau
    sagitta = min(0.05 * apart_mm / max(radii[0], 1e-9), 1.0)
    count = max(CHORDS, math.ceil(sweep / (2.0 * math.acos(1.0 - sagitta))))
    share = np.linspace(0.0, 1.0, count + 1)
    angle = angles[0] + sign * sweep * share
    radius = radii[0] + share * (radii[1] - radii[0])
    return np.column_stack(
        [
            move.centre[0] + radius * np.cos(angle),
            move.centre[1] + radius * np.sin(angle),
            start[2] + share * (end[2] - start[2]),
        ]
    )
