"""Recordings of grbl, grblHAL, Klipper and Marlin, and of LinuxCNC's motion, against their models.

`referees/README.md` says where they come from. grbl, grblHAL: positions step for step, by their
digest, and times within 0.2 %; Klipper: within a step at any time; Marlin: paths
within 2 steps, times within 0.5 % but for one; LinuxCNC: paths within 15 µm,
times within 0.5 %. The tables go into docs/validation.md.
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from camtool_postprocessors.iso.controllers import KlipperController, MarlinController
from camtool_postprocessors.iso.klipper import KlipperModel
from camtool_postprocessors.iso.marlin import FIRST_MOVE_DELAY_S, MarlinModel
from camtool_postprocessors.iso.timed import PlannedMoves
from scipy.spatial import KDTree

from camtool.arrays import Floats
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.motion_rows import RowMotion, rows_of
from tests.targets import simulate
from tests.validation.page import check, mm, signed
from tests.validation.pieces import UM

REFEREES = Path(__file__).parent / "referees"
GRBL = sorted((REFEREES / "grbl").glob("*.json"))
GRBLHAL = sorted((REFEREES / "grblhal").glob("*.json"))
KLIPPERS = sorted((REFEREES / "klipper").glob("*.json"))
MARLINS = sorted((REFEREES / "marlin").glob("*.json"))
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


STEP_MM = 0.004
MAX_PAIRS = 12
"""Klipper leaves out a step and the one back if they are within 0.75 ms (SDS_FILTER_TIME)."""
KLIPPER_IDLE_S = 0.03
"""Half a step at either end of a program, where it is slow."""

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


KLIPPER_AXES = {
    **{f"axes.{axis}.max_rate_mm_min": 3000.0 for axis in "xyz"},
    "limits.rapid_mm_min": 3000.0,
}
KLIPPER = KlipperController(
    max_velocity_mm_s=50.0,
    max_accel_mm_s2=250.0,
    max_z_velocity_mm_s=25.0,
    max_z_accel_mm_s2=100.0,
    arc_resolution_mm=0.1,
)
KLIPPER_STEPS = 1.0
"""Half a step is where a motor waits for the next; its steps are sent within 25 µs, in which 0.3
steps pass at 50 mm/s."""


def klipper_path(program: str) -> tuple[Toolpath, Machine[Any, Any]]:
    """Read a program for Klipper, whose words are those of grbl but for dwells in ms."""
    settings = [f"{key}={value}" for key, value in KLIPPER_AXES.items()]
    target = load_target("grbl", settings=settings)
    machine = replace(target.machine, controller=KLIPPER)
    text = re.sub(r"G4 P([0-9.]+)", lambda found: f"G4 P{float(found[1]) / 1000.0:g}", program)
    return target.target.read(text.encode(), target.machine), machine


def place_at(moves: PlannedMoves, waits: Floats, at_s: Floats) -> Floats:
    """The places (T, 3) mm at times (T,) of planned moves, each of which waits and then moves."""
    ramps = moves.ramps_s()
    begin = np.concatenate([[0.0], np.cumsum(waits + ramps.sum(axis=0))])
    move = np.clip(np.searchsorted(begin, at_s, side="right") - 1, 0, len(waits) - 1)
    left, travelled = at_s - begin[move] - waits[move], np.zeros(len(at_s))
    a = moves.acceleration[move] * [[1.0], [0.0], [-1.0]]
    for ramp, first, slope in zip(
        ramps[:, move], (moves.entry[move], moves.peak[move], moves.peak[move]), a, strict=True
    ):
        spent = np.clip(left, 0.0, ramp)
        travelled += first * spent + 0.5 * slope * spent**2
        left = left - ramp
    share = travelled / np.where(moves.length > 0.0, moves.length, 1.0)[move]
    starts = moves.path.starts[move]
    return np.asarray(starts + (moves.path.end[move] - starts) * share[:, None])


def first_step_s(moves: PlannedMoves, waits: Floats, axis: int) -> float:
    """When an axis first passes half a step."""
    first = int((moves.path.end[:, axis] != 0.0).argmax())
    low, high = 0.0, float((moves.seconds() + waits)[: first + 1].sum())
    while high - low > 1e-7:
        middle = 0.5 * (low + high)
        place = place_at(moves, waits, np.array([middle]))
        low, high = (low, middle) if abs(place[0, axis]) > 0.5 * STEP_MM else (middle, high)
    return high


def test_klipper(bless: bool) -> None:
    """Where the motors stand at the moment of each 1/400 of the steps, and how many there are."""
    assert len(KLIPPERS) == 10
    rows = []
    for file in KLIPPERS:
        said: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        path, machine = klipper_path(said["program"])
        model = KlipperModel()
        moves = model.planned(path, machine)
        waits = np.where(moves.path.kind == Kind.DWELL, moves.path.value, 0.0)
        recorded = np.array(said["positions"])
        axis = int(np.flatnonzero(recorded[0, 1:])[0])
        begin_s = first_step_s(moves, waits, axis)
        place = place_at(moves, waits, recorded[:, 0] + begin_s) / STEP_MM
        apart = np.abs(place - recorded[:, 1:]).max()
        assert apart < KLIPPER_STEPS, file.name
        motion = rows_of(model.run(path, machine, Options(effects=IDEAL)))
        counts = np.sum([row.steps for row in motion], axis=0)
        pairs = (counts - said["steps"]) / 2
        assert (pairs == np.rint(pairs)).all(), file.name
        assert pairs.min() >= 0.0, file.name
        assert pairs.max() <= MAX_PAIRS, file.name
        seconds = sum(row.duration_s for row in motion)
        idle_s = seconds - begin_s - float(recorded[-1, 0])
        assert 0.0 <= idle_s < KLIPPER_IDLE_S, file.name
        total = str(sum(said["steps"]))
        left_out = str(int(pairs.sum()) * 2)
        times = mm(recorded[-1, 0]), mm(seconds)
        rows.append([file.stem, total, left_out, *times, mm(apart, 2)])
    heads = ["program", "steps", "left out by Klipper", "Klipper, first to last step, s"]
    heads += ["model, all, s", "steps apart"]
    check("referee-klipper", heads, rows, bless)


MARLIN = MarlinController(travel_acceleration_mm_s2=250.0, mm_per_arc_segment=0.2)
MARLIN_LIMITS = {"x": (3000.0, 250.0), "y": (3000.0, 250.0), "z": (1500.0, 100.0)}
MARLIN_STEPS = 2.0
"""Bresenham lines, between the ends of moves."""
MARLIN_TIME_PART = 0.005
MARLIN_MISSES = {"tiny": 0.05}
FIRST_STEP_S = {"feeds": 1.0 / 21.0}
"""The first step comes a period of the lowest rate behind the start."""


def marlin_path(program: str) -> tuple[Toolpath, Machine[Any, Any]]:
    """Read a program for Marlin, whose words are those of grbl but for dwells in ms."""
    path, machine = klipper_path(program)
    axes = {
        name: replace(
            getattr(machine.axes, name), max_rate_mm_min=rate, acceleration_mm_s2=acceleration
        )
        for name, (rate, acceleration) in MARLIN_LIMITS.items()
    }
    return path, replace(machine, axes=replace(machine.axes, **axes), controller=MARLIN)


def test_marlin(bless: bool) -> None:
    """The positions at 1/400 of the steps lie on the model's path, and times are near."""
    assert len(MARLINS) == 10
    rows = []
    for file in MARLINS:
        said: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        path, machine = marlin_path(said["program"])
        motion = rows_of(MarlinModel().run(path, machine, Options(effects=IDEAL)))
        recorded = np.array(said["positions"])
        places = np.concatenate([np.zeros((1, 3)), samples(motion) / STEP_MM])
        apart, _ = KDTree(places).query(recorded[:, 1:])
        assert apart.max() <= MARLIN_STEPS, file.name
        assert np.rint(places[-1]).tolist() == recorded[-1, 1:].tolist(), file.name
        seconds = sum(row.duration_s for row in motion) - FIRST_STEP_S.get(file.stem, 1.0 / 120.0)
        if file.stem == "dwells":  # a single move before the first dwell
            seconds -= FIRST_MOVE_DELAY_S
        wanted_s = float(recorded[-1, 0])
        part = seconds / wanted_s - 1.0
        assert abs(part) < MARLIN_MISSES.get(file.stem, MARLIN_TIME_PART), file.name
        times = mm(wanted_s), mm(seconds), signed(100.0 * part, 2)
        rows.append([file.stem, str(sum(said["steps"])), *times, mm(float(apart.max()), 1)])
    heads = ["program", "steps", "Marlin, s", "model, s", "%", "steps apart"]
    check("referee-marlin", heads, rows, bless)


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
