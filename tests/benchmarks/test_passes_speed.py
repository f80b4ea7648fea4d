"""Verification of many passes over the same places takes as long for each as that of few.

Run it by `pytest -m benchmark -s tests/benchmarks/test_passes_speed.py`. Both are run in turns in
one process; the ratio is the answer, whatever else the machine is doing.
"""

import time

import pytest

from camtool.planning.job import job_of
from camtool.planning.plan import plan
from camtool.toolpath.moves import Toolpath
from tests.oracles.path_machine import path_machine
from tests.planning.test_place import drawing_of, rectangle
from tests.targets import verify

pytestmark = pytest.mark.benchmark
FEW, MANY = 250, 2000
MOST_RATIO = 1.6
ROUNDS = 3


def passes(count: int) -> Toolpath:
    """A square in so many passes."""
    job = job_of(depth_mm=1.0, step_down_mm=1.0 / count, side="on")
    return plan(drawing_of([rectangle(0, 0, 10, 10)]), job, path_machine())


def test_a_pass_of_many_takes_as_long_as_one_of_few() -> None:
    toolpaths = {count: passes(count) for count in (FEW, MANY)}
    least = dict.fromkeys(toolpaths, float("inf"))
    for _ in range(ROUNDS):
        for count, toolpath in toolpaths.items():
            begun = time.process_time()
            verify(toolpath, path_machine(), wanted=toolpath)
            least[count] = min(least[count], time.process_time() - begun)
    ratio = least[MANY] / MANY / (least[FEW] / FEW)
    print(f"{1e3 * least[MANY] / MANY:.2f} ms a pass of many, {ratio:.2f} times one of few")
    assert ratio < MOST_RATIO
