"""How long the mechanics take: `pytest -m benchmark tests/benchmarks/test_mechanics_speed.py`."""

import math
from typing import Any

import numpy as np
import pytest

from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import ALL, CHUNK_STEPS
from camtool.target.registry import load_target

pytestmark = pytest.mark.benchmark

SETTINGS = {
    "one play": "play_map.use=false",
    "play by region": "play_map.use=true",
    "scatter": "axes.x.repeatability_mm=0.001",
    "out of square": "mechanics.squareness_rad=0.001",
}


@pytest.mark.benchmark(group="one chunk of three axes")
@pytest.mark.parametrize("what", SETTINGS)
def test_a_chunk(benchmark: Any, what: str) -> None:
    machine = load_target("pic-mmh", settings=[SETTINGS[what]]).machine
    angle = np.linspace(0.0, 10.0 * math.pi, CHUNK_STEPS)
    ring = np.column_stack([5.0 + 4.0 * np.cos(angle), 3.0 + 3.0 * np.sin(angle), 0.0 * angle])
    mechanics = Mechanics(machine, ring[0], ALL)
    slide, reversals = benchmark(mechanics.follow, ring, np.array([0, CHUNK_STEPS]))
    assert np.abs(slide - ring).max() < 0.05
    assert reversals[0, 2] == 0
