"""How long the Matlab router's 100,000 lines take to write and to read, in 200 strokes."""

from typing import Any

import numpy as np
import pytest

from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath

pytestmark = pytest.mark.benchmark
LINES, STROKES = 100_000, 200


def many_lines() -> Toolpath:
    """Lines all over the area, so that some of them have to be split."""
    places = np.random.default_rng(7).uniform(1.0, 199.0, (STROKES, LINES // STROKES + 1, 2))
    path = ToolpathBuilder().rapid(z=9.0)
    for first, *rest in places.tolist():
        path.rapid(*first).line(z=-1.0, feed=200.0)
        for x, y in rest:
            path.line(x, y, feed=225.0)
        path.rapid(z=9.0)
    return path.finish()


@pytest.mark.benchmark(group="100,000 lines of the Matlab router")
@pytest.mark.parametrize("form", ["m", "stream"])
def test_writing(benchmark: Any, form: str) -> None:
    target = load_target("matlab-router", settings=[f"dialect.format={form}"])
    path = many_lines()
    program = benchmark.pedantic(lambda: target.target.write(path, target.machine), rounds=5)
    assert len(program.row_of_block) > LINES


@pytest.mark.benchmark(group="100,000 lines of the Matlab router")
@pytest.mark.parametrize("form", ["m", "stream"])
def test_reading(benchmark: Any, form: str) -> None:
    target = load_target("matlab-router", settings=[f"dialect.format={form}"])
    data = target.target.write(many_lines(), target.machine).data
    decoded = benchmark.pedantic(lambda: target.target.read(data, target.machine), rounds=5)
    assert len(decoded) > LINES
