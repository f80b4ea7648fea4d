"""Klipper's own host as referee of its model, on generated programs:

    KLIPPER_SOURCE=… KLIPPER_DICT=… KLIPPER_PYTHON=… \\
        pytest -m slow tests/postprocessors/iso/test_klipper_live.py

`tests.oracles.klipper_batch` says what these name.
"""

from __future__ import annotations

import math
import random
from pathlib import Path

import numpy as np
import pytest
from camtool_postprocessors.iso.klipper import KlipperModel

from camtool.toolpath.moves import Kind
from tests.oracles.klipper_batch import places, steps_of
from tests.validation.test_validation_referees import (
    KLIPPER_STEPS,
    STEP_MM,
    first_step_s,
    klipper_path,
    place_at,
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.referee,
    pytest.mark.skipif(places() is None, reason="KLIPPER_SOURCE, _DICT or _PYTHON is not set"),
]


def program(draw: random.Random) -> str:
    """Lines, arcs, helices and dwells of many sizes and feeds, behind a dwell: in its first second
    batch mode empties the queue at moments of its own."""
    x, y, z = 1.0, 0.0, 0.0
    blocks = ["G4 P2000", "G1 X1.000 F600"]
    for _ in range(draw.randint(10, 80)):
        which, size = draw.random(), 10.0 ** draw.uniform(-2.0, 1.2)
        angle, feed = draw.uniform(0.0, 2.0 * math.pi), draw.choice([30, 400, 1500, 3500])
        if which < 0.6:
            x, y = x + size * math.cos(angle), y + size * math.sin(angle)
            z += draw.choice([0.0, 0.0, draw.uniform(-0.5, 0.5)])
            blocks.append(f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f} F{feed}")
        elif which < 0.95:
            x, y = round(x, 3), round(y, 3)
            i, j = round(size * math.cos(angle), 3), round(size * math.sin(angle), 3)
            if i == j == 0.0:
                continue
            turn = draw.uniform(0.1, 6.0)
            word = draw.choice(["G2", "G3"])
            last = math.atan2(-j, -i) + (turn if word == "G3" else -turn)
            radius = math.hypot(i, j)
            x, y = x + i + radius * math.cos(last), y + j + radius * math.sin(last)
            z += draw.choice([0.0, 0.3])
            blocks.append(f"{word} X{x:.3f} Y{y:.3f} Z{z:.3f} I{i:.3f} J{j:.3f} F{feed}")
        else:
            blocks.append(f"G4 P{draw.randint(0, 400)}")
    return "G21\nG90\nG17\n" + "\n".join(blocks) + "\n"


@pytest.mark.parametrize("seed", range(20))
def test_every_step(seed: int, tmp_path: Path) -> None:
    """At the moment of each step the model is where the motors are, within a step."""
    text = program(random.Random(seed))
    at_s, steps = steps_of(text, tmp_path)
    path, machine = klipper_path(text)
    moves = KlipperModel().planned(path, machine)
    waits = np.where(moves.path.kind == Kind.DWELL, moves.path.value, 0.0)
    begin_s = first_step_s(moves, waits, int(np.flatnonzero(steps[0])[0]))
    place = place_at(moves, waits, at_s - at_s[0] + begin_s) / STEP_MM
    assert np.abs(place - steps).max() < KLIPPER_STEPS, text
