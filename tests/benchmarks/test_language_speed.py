"""How long foreign programs take to read (`pytest -m benchmark` on this file): a million plain
blocks, and blocks that are interpreted one by one.

The first of each group is the least that a reader must do in Python: one match of a regular
expression for each block.
"""

import re
from typing import Any

import numpy as np
import pytest

from camtool.target.registry import load_target

pytestmark = pytest.mark.benchmark

PLAIN, TURNS = 1_000_000, 20_000
BLOCK = re.compile(r"(?:N\d+)?(?:[GXYZIJF][+-]?[\d.]+ ?)*")
LOOP = f"""G21 G90 F500
#1=0
o100 while [#1 lt {TURNS}]
#1=[#1+1]
G1 X[10*cos[#1]] Y[10*sin[#1]]
Z[#1/1000]
o100 endwhile
M2
"""


def plain_program() -> bytes:
    """Lines to random places, as many CAM programs have them: X and Y alone."""
    places = np.random.default_rng(7).uniform(0.0, 100.0, (PLAIN, 2))
    lines = [f"X{x:.3f} Y{y:.3f}" for x, y in places.tolist()]
    return "\n".join(["G21 G90 F500", "G1 X0 Y0", *lines, "M2"]).encode()


@pytest.mark.benchmark(group="1,000,000 plain blocks read")
@pytest.mark.parametrize("what", ["one match each", "grbl", "linuxcnc"])
def test_plain_blocks(benchmark: Any, what: str) -> None:
    data = plain_program()
    if what == "one match each":
        lines = data.decode().splitlines()
        assert all(benchmark.pedantic(lambda: [BLOCK.fullmatch(line) for line in lines[1:-1]]))
        return
    target = load_target(what)
    path = benchmark.pedantic(lambda: target.target.read(data, target.machine), rounds=3)
    assert len(path) == PLAIN + 2


@pytest.mark.benchmark(group="blocks of a loop with expressions")
@pytest.mark.parametrize("what", ["one match each", "linuxcnc"])
def test_a_loop(benchmark: Any, what: str) -> None:
    if what == "one match each":
        lines = ["G1 X10.000 Y10.000"] * (5 * TURNS)
        assert all(benchmark.pedantic(lambda: [BLOCK.fullmatch(line) for line in lines], rounds=3))
        return
    target = load_target("linuxcnc")
    data = LOOP.encode()
    path = benchmark.pedantic(lambda: target.target.read(data, target.machine), rounds=3)
    assert len(path) == 2 * TURNS + 1
