"""How fast motion in whole steps is made, with the mechanics and without judging.

`pytest -m benchmark tests/benchmarks/test_legs_motion.py`
"""

from typing import Any

import numpy as np
import pytest

from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.postprocessors.i8751.machines import SAMPLE
from tests.targets import simulate

pytestmark = pytest.mark.benchmark
MOVES = 200_000


def short_moves(kind: Kind) -> Toolpath:
    """Moves of half a millimetre round a circle that drifts to the right."""
    angle = np.arange(MOVES) * 0.01
    end = np.column_stack([50.0 * np.cos(angle) + 0.01 * angle, 50.0 * np.sin(angle), 0 * angle])
    start = np.concatenate([np.zeros((1, 3)), end[:-1]])
    middle, across = 0.5 * (start + end)[:, :2], (end - start)[:, 1::-1] * [-1.0, 1.0]
    is_arc = kind == Kind.ARC_CCW
    return Toolpath(
        kind=np.full(MOVES, kind),
        end=end,
        centre=middle + across if is_arc else np.full((MOVES, 2), np.nan),
        feed=np.full(MOVES, 9.0),
        value=np.full(MOVES, np.nan),
        source=np.full(MOVES, -1),
        block=np.arange(MOVES),
        start=np.zeros(3),
    )


CASES = {
    "one line of 20 million steps": ("valcnc", None),
    "200,000 lines": ("valcnc", Kind.LINE),
    "200,000 arcs": ("valcnc", Kind.ARC_CCW),
    "200,000 dog-legs": ("i8751", Kind.LINE),
}


@pytest.mark.benchmark(group="motion in whole steps")
@pytest.mark.parametrize("name", CASES)
def test_motion(benchmark: Any, name: str) -> None:
    target, kind = CASES[name]
    machine = load_target(target, machine_file=SAMPLE if target == "i8751" else None).machine
    toolpath = ToolpathBuilder().line(800_000.0, 300_000.0, feed=9.0).finish()
    if kind is not None:
        toolpath = short_moves(kind)

    def run() -> int:
        return sum(len(chunk.row) for chunk in simulate(toolpath, machine))

    samples = benchmark.pedantic(run, rounds=3, warmup_rounds=1)
    assert samples > 2_000_000
    benchmark.extra_info["samples"] = samples
