"""How long the order takes, against sorting the same places along one axis."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from camtool.planning.order import Choices, best_order, drawn_order, travel_mm

pytestmark = pytest.mark.benchmark
NONE = np.empty((0, 2), dtype=np.int64)
ZERO = (0.0, 0.0)


def squares(count: int) -> Choices:
    """Squares of 4 mm anywhere in a metre."""
    corner = np.random.default_rng(1).uniform(0, 1000, (count, 1, 2))
    places = (corner + 4.0 * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])).reshape(-1, 2)
    return Choices(np.repeat(np.arange(count), 4), places, places)


@pytest.mark.benchmark(group="order of 2,000 and 10,000 squares (the aim: 2,000 below 1 s)")
@pytest.mark.parametrize("what", ["sorted", "ordered", "nested", "10,000"])
def test_squares(benchmark: Any, what: str) -> None:
    choices = squares(10_000 if what == "10,000" else 2_000)
    if what == "sorted":
        benchmark.pedantic(lambda: np.argsort(choices.entry[:, 0]), rounds=5)
        return
    before = np.arange(2_000).reshape(-1, 2) if what == "nested" else NONE
    rows = benchmark.pedantic(lambda: best_order(choices, before), rounds=3, warmup_rounds=1)
    length = travel_mm(choices, rows, ZERO, ZERO)
    benchmark.extra_info["travel_mm"] = length
    assert length < 0.1 * travel_mm(choices, drawn_order(choices), ZERO, ZERO)
