"""A made-up machine whose controller follows the path, and slow twins of what it does."""

from __future__ import annotations

import math
from typing import Any

from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.lowering import point_of, sweep_of
from tests.targets import build_machine

STEP = 0.005


def path_table() -> dict[str, Any]:
    """Its machine file as nested dicts; each call a new one."""
    return {
        "target": {"name": "made-up", "title": "Made up", "dialect": "none", "extension": ".x"},
        "axes": {name: {"coded_step_mm": STEP} for name in "xyz"},
        "feed": {"default_mm_min": 100.0, "unit_mm_min": 1.0},
        "limits": {},
        "defaults": {"safe_z_mm": 1.0, "cut_depth_mm": 0.1, "fit_tolerance_mm": 0.005},
        "controller": {"model": "path"},
    }


def path_machine(*settings: str) -> Machine:
    """The machine with `key.key=value` settings over its file."""
    return build_machine(path_table(), "made-up.toml", None, settings)


def both(axis_key: str, value: float) -> tuple[str, str]:
    """The setting of a key for X and for Y."""
    return f"axes.x.{axis_key}={value}", f"axes.y.{axis_key}={value}"


def dense_path(toolpath: Toolpath, parts: int = 2000) -> list[tuple[int, tuple[float, ...]]]:
    """Row and position of `parts` points on each move, the turning points among them when
    `parts` divides the sweep into quarters."""
    found: list[tuple[int, tuple[float, ...]]] = []
    for move in toolpath:
        if move.kind == Kind.END:
            break
        if move.kind > Kind.ARC_CCW or (move.centre is None and move.start == move.end):
            continue
        for k in range(1, parts + 1):
            share = k / parts
            if k == parts:
                point: tuple[float, ...] = move.end
            elif move.centre is not None:
                point = point_of(move, share)
            else:
                point = tuple(
                    a + share * (b - a) for a, b in zip(move.start, move.end, strict=True)
                )
            found.append((move.index, point))
    return found


def length_of(toolpath: Toolpath, row: int) -> float:
    """Way of a row in space, mm."""
    move = list(toolpath)[row]
    if move.centre is None:
        return math.dist(move.start, move.end)
    radius = 0.5 * (math.dist(move.start[:2], move.centre) + math.dist(move.end[:2], move.centre))
    return math.hypot(radius * sweep_of(move), move.end[2] - move.start[2])


class Slide:
    """One axis: play taken up, compensation at each reversal, one position after the other."""

    def __init__(self, start: float, play: float, compensation: float, *, centred: bool) -> None:
        low = -0.5 * play if centred else 0.0
        self.flanks = low, low + play
        self.compensation, self.extra = compensation, 0.0
        self.at, self.furthest, self.up, self.reversals = start, start, True, 0

    def go(self, to: float) -> float:
        back = self.furthest - to if self.up else to - self.furthest
        if back <= 0.0:
            self.furthest = to
        elif back >= 0.5 * STEP:
            self.up = not self.up
            self.furthest = to
            self.reversals += 1
            self.extra += self.compensation if self.up else -self.compensation
        motor = to + self.extra
        if motor + self.flanks[0] > self.at:
            self.at = motor + self.flanks[0]
        elif motor + self.flanks[1] < self.at:
            self.at = motor + self.flanks[1]
        return self.at
