"""How long lowering and judging take: `pytest -m benchmark tests/benchmarks/test_path_motion.py`.

As in test_main_job.py, the ratio within a group is the answer.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.lower import LoweredToolpath, arcs_to_lines, arcs_within, xy_then_z
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.dense_moves import cut
from tests.oracles.path_machine import both, path_machine
from tests.targets import simulate, verify

pytestmark = pytest.mark.benchmark
MOVES = 100_000
PART_MM = 200.0


def mixed(count: int) -> Toolpath:
    """Random lines and arcs, every one with a change of Z."""
    rng = np.random.default_rng(1)
    end = rng.uniform(-5.0, 5.0, (count, 3))
    begin = np.concatenate([np.zeros((1, 3)), end[:-1]])
    chord = (end - begin)[:, :2]
    aside = np.column_stack([-chord[:, 1], chord[:, 0]]) * rng.uniform(-1.0, 1.0, (count, 1))
    kind = rng.integers(Kind.LINE, Kind.ARC_CCW + 1, count)
    centre = np.where(kind[:, None] == Kind.LINE, np.nan, 0.5 * (begin + end)[:, :2] + aside)
    return Toolpath(
        kind=kind,
        end=end,
        centre=centre,
        feed=np.full(count, 100.0),
        value=np.full(count, np.nan),
        source=np.full(count, -1),
        block=np.arange(count),
        start=np.zeros(3),
    )


LOWERINGS: dict[str, Callable[[Toolpath], LoweredToolpath]] = {
    "XY, then Z": xy_then_z,
    "four chords an arc": lambda path: arcs_to_lines(path, path.is_arc, 0.5),
    "halves": lambda path: arcs_within(path, math.pi),
    "quarters": lambda path: arcs_within(path, 0.5 * math.pi),
}


@pytest.mark.benchmark(group="100,000 moves in fewer words")
@pytest.mark.parametrize("name", list(LOWERINGS))
def test_lowering(benchmark: Any, name: str) -> None:
    toolpath = mixed(MOVES)
    lowered = benchmark.pedantic(LOWERINGS[name], (toolpath,), rounds=5, warmup_rounds=1)
    assert len(lowered.row) >= MOVES
    benchmark.extra_info["moves"] = len(lowered.row)


def part(contours: int, sides: int) -> Toolpath:
    """Wavy rings side by side on a part of 200 mm."""
    b = ToolpathBuilder()
    across = math.isqrt(contours)
    cell = PART_MM / across
    for number in range(across * across):
        x, y = ((place + 0.5) * cell for place in divmod(number, across))
        cut(b, x + 0.4 * cell, y)
        for side in range(1, sides + 1):
            turn = 2.0 * math.pi * side / sides
            radius = cell * (0.4 + 0.05 * math.sin(7.0 * turn))
            b.line(x + radius * math.cos(turn), y + radius * math.sin(turn), feed=100.0)
        b.rapid(z=0.2)
    return b.finish()


@pytest.mark.benchmark(group="a part of 200 mm on a controller that follows the path")
@pytest.mark.parametrize("shape", [(16, 60), (196, 100), (196, 500)])
@pytest.mark.parametrize("what", ["simulate", "verify"])
def test_part(benchmark: Any, what: str, shape: tuple[int, int]) -> None:
    toolpath, machine = part(*shape), path_machine(*both("backlash_mm", 0.05))

    def run() -> float:
        if what == "simulate":
            return sum(
                float(chunk.ledger.duration_s.sum()) for chunk in simulate(toolpath, machine)
            )
        return verify(toolpath, machine, wanted=toolpath).report.time_s

    assert benchmark.pedantic(run, rounds=3, warmup_rounds=1) > 0.0
    benchmark.extra_info["moves"] = len(toolpath)
