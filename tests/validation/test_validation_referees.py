"""Recordings of the firmware of grbl and grblHAL and of LinuxCNC's motion against their models.

`referees/README.md` says where they come from. grbl, grblHAL: positions step for step, by their
digest, and times within 0.2 %; LinuxCNC: paths within 15 µm, times within 0.5 %. The tables go
into docs/validation.md.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from camtool.arrays import Floats
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import load_target
from tests.oracles.motion_rows import RowMotion, rows_of
from tests.targets import simulate
from tests.validation.page import check, mm, signed
from tests.validation.pieces import UM

REFEREES = Path(__file__).parent / "referees"
GRBL = sorted((REFEREES / "grbl").glob("*.json"))
GRBLHAL = sorted((REFEREES / "grblhal").glob("*.json"))
LINUXCNC = sorted((REFEREES / "linuxcnc").glob("*.ngc"))

GRBL_TIME_PART = 0.002
LINUXCNC_TIME_PART = 0.005
LINUXCNC_PATH_MM = 0.015

MOST_SAMPLES = 5000
"""So many of the model's samples are held against the recorded line."""

NEAR_PIECES = 50
NEAR_PART = 0.01
"""A point is looked for so many pieces of a line, or that part of it, before and behind."""


def run(name: str, data: bytes, *settings: str) -> tuple[list[RowMotion], float]:
    """The motion of each row of a program, and the time of all, s."""
    target = load_target(name, settings=settings)
    path = target.target.read(data, target.machine)
    rows = rows_of(simulate(path, target.machine, Options(effects=IDEAL)))
    return rows, sum(row.duration_s for row in rows)


def samples(rows: list[RowMotion]) -> Floats:
    return np.concatenate([row.commanded for row in rows])


def off_line(points: Floats, line: Floats) -> float:
    """The farthest of `points` (P, 3) from a polyline (L, 3) that goes the same way, mm.

    Each point is looked for near where the one before it was found, so a path that wanders off, or
    goes another way, counts as farther than it is, never as nearer.
    """
    begin, way = line[:-1], np.diff(line, axis=0)
    square = (way**2).sum(axis=1)
    begin, way, square = begin[square > 0.0], way[square > 0.0], square[square > 0.0]
    reach = max(NEAR_PIECES, int(NEAR_PART * len(begin)))
    most, at = 0.0, 0
    for point in points:
        near = slice(max(at - reach, 0), at + reach)
        share = ((point - begin[near]) * way[near]).sum(axis=1) / square[near]
        apart = begin[near] + np.clip(share, 0.0, 1.0)[:, None] * way[near] - point
        far = (apart**2).sum(axis=1)
        at = near.start + int(far.argmin())
        most = max(most, float(far.min()))
    return float(np.sqrt(most))


def digest(steps: Floats) -> str:
    return hashlib.sha256(np.rint(steps).astype("<i4").tobytes()).hexdigest()


def test_grbl(bless: bool) -> None:
    """$1 and $32 as recorded; the reset's own stop in front of the recording is taken off. Without
    smoothing the timer's longest tick is longer, 16 MHz / (65535 · 64)."""
    assert len(GRBL) == 11
    rows = []
    for file in GRBL:
        said: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        settings = said.get("settings", {})
        idle, laser = settings.get("$1", 255), bool(settings.get("$32", 0))
        reset_s = 0.0 if idle == 255 else idle / 1000.0
        wanted_s = said["with_amass"]["time_s"] - reset_s
        program = said["program"].encode()
        set_ = f"controller.idle_delay_ms={idle}", f"controller.laser_mode={str(laser).lower()}"
        _, seconds = run("grbl", program, *set_)
        assert abs(seconds - wanted_s) < GRBL_TIME_PART * wanted_s, file.name
        recorded = said["without_amass"]
        plain_s = recorded["time_s"] - reset_s
        motion, plain = run("grbl", program, *set_, "controller.least_step_hz=3.8")
        assert abs(plain - plain_s) < GRBL_TIME_PART * plain_s, file.name
        steps = samples(motion) / 0.004
        assert len(steps) == recorded["step_ticks"], file.name
        assert digest(steps) == recorded["sha256_of_int32_xyz_rows"], file.name
        rows.append(
            [
                file.stem,
                str(idle),
                str(int(laser)),
                str(len(steps)),
                mm(wanted_s),
                mm(seconds),
                signed(100.0 * (seconds / wanted_s - 1.0), 2),
            ]
        )
    heads = ["program", "$1", "$32", "events, all equal", "grbl, s", "model, s", "%"]
    check("referee-grbl", heads, rows, bless)


GRBLHAL_BLOCKS = 101
"""$398 of its 100 blocks; one place of a ring stays empty."""


def grblhal_settings(said: dict[str, float]) -> list[str]:
    """The settings of the machine file for its settings that a recording says."""
    keys = {"11": "max_rate_mm_min", "12": "acceleration_mm_s2"}
    axes = {name: value for name, value in said.items() if name != "$1"}
    return [
        "controller.firmware=grblHAL",
        f"controller.buffer_blocks={GRBLHAL_BLOCKS}",
        "controller.least_step_hz=0.01",
        *(f"axes.{'xyz'[int(name[-1])]}.{keys[name[1:3]]}={axes[name]}" for name in axes),
    ]


def test_grblhal(bless: bool) -> None:
    """The programs begin with a dwell of 0.2 s, behind which its buffer is full; the clock of the
    recordings begins with the first move."""
    assert len(GRBLHAL) == 11
    rows = []
    for file in GRBLHAL:
        said: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        settings = grblhal_settings(said["settings"])
        motion, seconds = run("grbl", said["program"].encode(), *settings)
        seconds -= 0.2
        recorded, wanted_s = said["without_smoothing"], said["with_smoothing"]["time_s"]
        assert abs(seconds - wanted_s) < GRBL_TIME_PART * wanted_s, file.name
        steps = samples(motion) / 0.004
        assert len(steps) == recorded["step_ticks"], file.name
        assert digest(steps) == recorded["sha256_of_int32_xyz_rows"], file.name
        apart = signed(100.0 * (seconds / wanted_s - 1.0), 2)
        rows.append([file.stem, str(len(steps)), mm(wanted_s), mm(seconds), apart])
    heads = ["program", "events, all equal", "grblHAL, s", "model, s", "%"]
    check("referee-grblhal", heads, rows, bless)


def test_linuxcnc(bless: bool) -> None:
    assert len(LINUXCNC) == 13
    rows = []
    for file in LINUXCNC:
        recorded = np.loadtxt(file.with_suffix(".csv"), delimiter=",")
        motion, seconds = run("linuxcnc", file.read_bytes())
        found = np.concatenate([recorded[:1, 1:], samples(motion)])
        every = max(1, len(found) // MOST_SAMPLES)
        beside = off_line(recorded[:, 1:], found)
        apart = off_line(found[::every], recorded[:, 1:])
        wanted_s = float(recorded[-1, 0])
        assert max(beside, apart) < LINUXCNC_PATH_MM, file.name
        assert abs(seconds - wanted_s) < LINUXCNC_TIME_PART * wanted_s, file.name
        rows.append(
            [
                f"{file.stem}.ngc",
                mm(wanted_s),
                mm(seconds),
                signed(100.0 * (seconds / wanted_s - 1.0), 2),
                mm(beside * UM, 1),
                mm(apart * UM, 1),
            ]
        )
    heads = ["program", "LinuxCNC, s", "model, s", "%"]
    heads += ["LinuxCNC off the model, µm", "model off LinuxCNC, µm"]
    check("referee-linuxcnc", heads, rows, bless)
