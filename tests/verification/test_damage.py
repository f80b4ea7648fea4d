"""Random damage of programs, on every target: nearly all of it is found by `verify --against`.

What makes no difference is no damage, and what no reader takes is none that reaches the machine:
both are thrown again. The flags are those of the post, and no limit is raised for the machine's
own errors.
"""

import math
from collections import Counter
from functools import cache
from pathlib import Path
from random import Random

import numpy as np
import pytest

from camtool.errors import CamtoolError, ProgramError
from camtool.findings import Severity, worst
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing, verify_program
from camtool.planning.job import Job, job_of
from camtool.target.registry import LoadedTarget, load_target
from tests.drawings import drawing_of
from tests.fuzz.program_damage import KINDS, Whole, damaged
from tests.oracles.changed import makes_a_difference

SAMPLE = Path(__file__).parents[2] / "samples" / "i8751-sample.toml"

CASES: dict[str, tuple[float, float, dict[str, float]]] = {
    "grbl": (1.0, 0.001, {"feed": 400.0, "plunge": 100.0, "spindle": 8000.0, "safe": 4.0}),
    "linuxcnc": (1.0, 0.001, {"feed": 400.0, "plunge": 100.0, "spindle": 8000.0, "safe": 4.0}),
    "flashcut": (0.1, 0.001, {"feed": 3.0, "safe": 0.4, "depth": 0.02}),
    "pic-mmh": (0.05, 0.00014, {"feed": 0.8, "plunge": 0.6, "safe": 0.2, "depth": 0.02}),
    "valcnc": (1.0, 0.0008, {"safe": 4.0}),
    "i8751": (1.0, 0.0125, {"safe": 2.0}),
    "matlab-router": (2.0, 0.2, {"feed": 150.0}),
}
"""How large the part is (1: 52 mm), the finest difference that the dialect says (mm), and what
the job names."""

NAMES = {
    "feed": "feed_mm_min",
    "plunge": "plunge_feed_mm_min",
    "spindle": "spindle_rpm",
    "safe": "safe_z_mm",
    "depth": "depth_mm",
}
APART_UNITS = 3.0
"""A damage is one when it moves the tool by more than so many units."""

OF_50 = 48


def part(scale: float) -> Drawing:
    """A plate, a star, holes, a shape of arcs, and an open line."""
    quarter = math.tan(math.pi / 8.0)
    plate = [
        (5, 3, 0),
        (41, 3, quarter),
        (43, 5, 0),
        (43, 31, quarter),
        (41, 33, 0),
        (5, 33, quarter),
        (3, 31, 0),
        (3, 5, quarter),
    ]
    spokes = [(7.0 if k % 2 else 3.5, 0.2 * math.pi * k) for k in range(10)]
    star = [(15 + r * math.cos(turn), 18 + r * math.sin(turn), 0) for r, turn in spokes]
    blob = [(27, 11, 0.3), (35, 12, -0.2), (37, 23, 0.4), (30, 26, 0.1), (26, 19, -0.3)]
    holes = [
        [(x + r, y, 1), (x - r, y, 1)] for x, y, r in ((8, 29, 1.5), (38, 29, 1.5), (30, 17, 1.2))
    ]
    line = [(48, 5, 0), (53, 15, 0.5), (49, 28, 0), (55, 31, 0)]
    size = np.array([scale, scale, 1.0])
    closed = [Polyline(np.array(path) * size, True) for path in (plate, star, blob, *holes)]
    return drawing_of([*closed, Polyline(np.array(line) * size, False)])


@cache
def sound(name: str) -> tuple[Whole, Drawing, Job]:
    """The program of the part on a target, and what it was posted from."""
    scale, unit_mm, said = CASES[name]
    machine = SAMPLE if name == "i8751" else None
    target: LoadedTarget = load_target(name, machine_file=machine)
    flags = {NAMES[key]: value for key, value in said.items()}
    job = job_of(tool_diameter_mm=scale, **flags)
    posted = post_drawing(part(scale), job, target, check=False)
    assert posted.program is not None
    whole = Whole(target, posted.program.data, posted.wanted, unit_mm)
    return whole, part(scale), job


def throw(name: str, kind: str, random: Random) -> bytes | None:
    """One damaged program that can be read and differs; None when the target knows no such."""
    whole = sound(name)[0]
    read, machine = whole.target.target.read, whole.target.machine
    before = read(whole.data, machine)
    for _ in range(40):
        try:
            data = damaged(whole, kind, random)
            if data is None or data == whole.data:
                continue
            after = read(data, machine)
        except CamtoolError:
            continue
        apart = APART_UNITS * whole.unit_mm
        feed = 0.6 * machine.feed.unit_mm_min
        if makes_a_difference(before, after, apart_mm=apart, feed=feed):
            return data
    return None


def found(name: str, data: bytes) -> bool:
    """Whether `verify --against` would end with exit code 1 (or 2)."""
    whole, drawing, job = sound(name)
    try:
        run = verify_program(data, whole.target, source="damaged", drawing=drawing, job=job)
    except ProgramError:  # the controller's model cannot follow it
        return True
    return worst(run.findings) is Severity.ERROR


def missed(name: str, seed: int, count: int) -> list[str]:
    """What was not found of so many damages: kinds, each with the program's changed part."""
    random = Random(f"{name} {seed}")
    lost: list[str] = []
    thrown: Counter[str] = Counter()
    while sum(thrown.values()) < count:
        kind = KINDS[sum(thrown.values()) % len(KINDS)]
        data = throw(name, kind, random)
        if data is None:  # the dialect has no arcs, or no feeds
            kind = "shifted"
            data = throw(name, kind, random)
        assert data is not None
        thrown[kind] += 1
        if not found(name, data):
            lost.append(f"{kind}: {_changed(sound(name)[0].data, data)}")
    return lost


def _changed(before: bytes, after: bytes) -> str:
    """The first place where two programs differ."""
    at = next(
        (k for k, (a, b) in enumerate(zip(before, after, strict=False)) if a != b), len(before)
    )
    low = max(at - 30, 0)
    return f"{before[low : at + 40]!r} became {after[low : at + 40]!r}"


@pytest.mark.parametrize("name", CASES)
def test_a_sound_program_is_as_asked(name: str) -> None:
    assert not found(name, sound(name)[0].data)


@pytest.mark.parametrize("name", CASES)
def test_damage_is_found(name: str) -> None:
    lost = missed(name, 0, len(KINDS))
    assert lost == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 4))
@pytest.mark.parametrize("name", CASES)
def test_of_50_damages_48_are_found(name: str, seed: int) -> None:
    lost = missed(name, seed, 50)
    assert 50 - len(lost) >= OF_50, "\n".join(lost)
