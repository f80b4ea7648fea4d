"""grblHAL's simulator as it comes, in real time, as referee of the model:

    GRBLHAL_SIM=…/grblHAL_sim pytest -m slow tests/postprocessors/grbl/test_grblhal_live.py

GRBLHAL_SIM names its program. It says its position every half millisecond, except for the last
moves, which its stepper has taken over already.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from tests.validation.test_validation_referees import REFEREES, grblhal_settings, run, samples

SIMULATOR = os.environ.get("GRBLHAL_SIM")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.referee,
    pytest.mark.skipif(SIMULATOR is None, reason="GRBLHAL_SIM names no simulator of grblHAL"),
]

STEP_MM = 0.004
OFF_STEPS = 1.5
"""Within an event its smoothing lets slower axes step earlier."""
TIME_PART, TIME_S = 0.005, 0.12
"""It prepares a tenth of a second before it moves."""
END = "\x06"
"""Ends the simulator when nothing is left to do."""
POSITION = re.compile(r" *(\d+\.\d+) (-?\d+), (-?\d+), (-?\d+), ")


TIMED = ("circles", "corners", "rapids")
"""The other programs wait for its lines: at dwells, and where a block is shorter than its line."""


@pytest.mark.parametrize("name", [*TIMED, "dwells", "tiny"])
def test_the_simulator_as_it_comes(name: str, tmp_path: Path) -> None:
    """Each position that it says is one of the model's path, and the last is its end."""
    assert SIMULATOR is not None
    said = json.loads((REFEREES / "grblhal" / f"{name}.json").read_text(encoding="utf-8"))
    settings = "".join(f"{key}={value:g}\n" for key, value in said["settings"].items())
    where = ("-e", tmp_path / "settings", "-s", tmp_path / "steps", "-b", tmp_path / "blocks")
    subprocess.run(
        [SIMULATOR, "-n", "-r", "0.0005", *where],
        input=f"{settings}{said['program']}{END}".encode(),
        stdout=subprocess.DEVNULL,
        timeout=120.0,
        check=True,
    )
    found = POSITION.findall((tmp_path / "steps").read_text(encoding="ascii"))
    table = np.array(found, dtype=np.float64)
    motion, seconds = run("grbl", said["program"].encode(), *grblhal_settings(said["settings"]))
    path = np.concatenate([np.zeros((1, 3)), samples(motion) / STEP_MM])
    assert (table[-1, 1:] == path[-1]).all()
    apart, _ = KDTree(path).query(table[:, 1:])
    assert apart.max() <= OFF_STEPS
    moving = table[(table[:, 1:] != 0).any(axis=1), 0]
    lasted_s = moving[-1] - moving[0]
    assert name not in TIMED or lasted_s == pytest.approx(seconds - 0.2, rel=TIME_PART, abs=TIME_S)
