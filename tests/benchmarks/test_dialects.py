"""How long 100,000 moves take to write and to read (`pytest -m benchmark` on this file).

The first of each group is the least that any writer or reader must do in Python: one format or one
match of a regular expression per move. The ratio to it is the answer.
"""

import math
import re
from typing import Any

import numpy as np
import pytest

from camtool.target.registry import load_target, target_names
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

pytestmark = pytest.mark.benchmark
MOVES = 100_000
TEXT_TARGETS = [
    name
    for name in ("flashcut", "grbl", "linuxcnc", "pic-mmh", "valcnc")
    if name in target_names()
]
WORD = re.compile(r"([A-Z])(-?\d+(?:\.\d+)?)")


def many_moves(feed: float, reach_mm: float = 4.0) -> Toolpath:
    """Lines, a third of them arcs, a rapid now and then, in a square of `reach_mm`."""
    rng = np.random.default_rng(7)
    ends = np.round(rng.uniform(1.0, reach_mm, (MOVES, 2)), 3)
    path = ToolpathBuilder().rapid(z=1.0).rapid(1.0, 1.0)
    for index, (x, y) in enumerate(ends[: MOVES - 3].tolist()):
        from_x, from_y, _ = path.position
        dx, dy = x - from_x, y - from_y
        if index % 3 == 0 and math.hypot(dx, dy) > 0.1:
            centre = (from_x + dx / 2.0 - 0.2 * dy, from_y + dy / 2.0 + 0.2 * dx)
            path.arc(x, y, centre=centre, ccw=bool(index % 2), feed=feed)
        elif index % 50 == 1:
            path.rapid(x, y)
        else:
            path.line(x, y, feed=feed)
    return path.event(Kind.END).finish()


def plainly_written(path: Toolpath) -> bytes:
    """Write each move by one format string, as a lower bound of the time."""
    rows = zip(path.kind.tolist(), path.end.tolist(), strict=True)
    return "\n".join(f"G{kind} X{x:.3f} Y{y:.3f}" for kind, (x, y, _) in rows).encode()


@pytest.mark.benchmark(group="100,000 moves written")
@pytest.mark.parametrize("what", ["one format each", *TEXT_TARGETS])
def test_writing(benchmark: Any, what: str) -> None:
    if what == "one format each":
        path = many_moves(5.0)
        assert benchmark.pedantic(lambda: plainly_written(path), rounds=5)
        return
    target = load_target(what)
    path = many_moves(target.machine.feed.default_mm_min)
    program = benchmark.pedantic(
        lambda: target.target.write(path, target.machine), rounds=5, warmup_rounds=1
    )
    assert program.data.count(b"\n") >= MOVES
    benchmark.extra_info["bytes"] = len(program.data)


@pytest.mark.benchmark(group="100,000 moves read back")
@pytest.mark.parametrize("what", ["one match each", *TEXT_TARGETS])
def test_reading(benchmark: Any, what: str) -> None:
    if what == "one match each":
        lines = plainly_written(many_moves(5.0)).decode().splitlines()
        assert benchmark.pedantic(lambda: [WORD.findall(line) for line in lines], rounds=5)
        return
    target = load_target(what)
    path = many_moves(target.machine.feed.default_mm_min)
    data = target.target.write(path, target.machine).data
    decoded = benchmark.pedantic(
        lambda: target.target.read(data, target.machine), rounds=5, warmup_rounds=1
    )
    assert len(decoded) >= MOVES
