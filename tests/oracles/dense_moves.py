"""Slow, obvious twins for the verification: moves as many points, distances as minima over these.

Also the motion of a machine that has nothing of its own: points along the moves themselves, with
whatever error a test puts on the slides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from camtool.arrays import Floats
from camtool.machine.model import Machine
from camtool.simulation.motion import Chunk, one_row
from camtool.tables import read_table
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Move, Toolpath
from tests.targets import build_machine

MACHINE_FILE = Path(__file__).parents[2] / "postprocessors" / "pic_mmh" / "machine.toml"

DOWN_MM = -0.02
SAFE_MM = 0.2
FEED = 0.8


def pic_mmh(*settings: str) -> Machine:
    """The machine of the first target, with `key.key=value` settings over it."""
    return build_machine(read_table(MACHINE_FILE), str(MACHINE_FILE), None, settings)


def cut(builder: ToolpathBuilder, x: float, y: float) -> ToolpathBuilder:
    """Go to (x, y) in the air and plunge."""
    return builder.rapid(z=SAFE_MM).rapid(x, y).line(z=DOWN_MM, feed=FEED)


def square(builder: ToolpathBuilder, x: float, y: float, side: float) -> ToolpathBuilder:
    """A closed square with its lower left corner at (x, y), CCW."""
    cut(builder, x, y)
    for to in ((x + side, y), (x + side, y + side), (x, y + side), (x, y)):
        builder.line(*to, feed=FEED)
    return builder.rapid(z=SAFE_MM)


def circle(
    builder: ToolpathBuilder, x: float, y: float, radius: float, *, ccw: bool = True
) -> ToolpathBuilder:
    """A full circle about (x, y), from its right end."""
    cut(builder, x + radius, y)
    builder.arc(x + radius, y, centre=(x, y), ccw=ccw, feed=FEED)
    return builder.rapid(z=SAFE_MM)


def points_of(move: Move, count: int) -> list[tuple[float, float]]:
    """`count` + 1 points of a move in XY, its two ends among them, by trigonometry alone."""
    (x0, y0, _), (x1, y1, _) = move.start, move.end
    if move.centre is None:
        return [(x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count) for k in range(count + 1)]
    cx, cy = move.centre
    radius = math.hypot(x0 - cx, y0 - cy)
    begin, finish = math.atan2(y0 - cy, x0 - cx), math.atan2(y1 - cy, x1 - cx)
    if move.kind == Kind.ARC_CCW:
        while finish <= begin + 1e-12:
            finish += 2 * math.pi
    else:
        while finish >= begin - 1e-12:
            finish -= 2 * math.pi
    angles = [begin + (finish - begin) * k / count for k in range(count + 1)]
    return [(cx + radius * math.cos(a), cy + radius * math.sin(a)) for a in angles]


def dense_distance(point: Floats, cloud: Floats) -> float:
    """Distance of a point to the nearest of many."""
    return float(np.sqrt(((cloud - point) ** 2).sum(axis=1)).min())


def follow(
    toolpath: Toolpath,
    count: int = 400,
    bend: Callable[[Floats], Floats] = lambda points: points,
    *,
    pieces: int = 1,
) -> Iterator[Chunk]:
    """Chunks of a controller that follows every move exactly, `count` samples each; the slides
    are `bend` of the commanded points (K, 2). Each row in `pieces` chunks."""
    for move in toolpath:
        samples = np.empty((0, 3))
        if move.kind <= Kind.ARC_CCW:
            xy = np.array(points_of(move, count))[1:]
            z = np.linspace(move.start[2], move.end[2], count + 1)[1:]
            samples = np.column_stack([xy, z])
        for part in np.array_split(samples, pieces):
            yield chunk(move.index, part, bend)


def chunk(row: int, samples: Floats, bend: Callable[[Floats], Floats]) -> Chunk:
    """Make a chunk with a step, an iteration and a second per sample, and no reversals."""
    slide = samples.copy()
    if len(samples):
        slide[:, :2] = bend(samples[:, :2])
    return one_row(
        row,
        samples,
        slide,
        duration_s=float(len(samples)),
        iterations=len(samples),
        steps=(len(samples),) * 3,
    )
