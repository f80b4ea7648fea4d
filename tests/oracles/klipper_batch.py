"""Klipper's own host in batch mode, with the steps that it sends.

KLIPPER_SOURCE names a checkout of github.com/Klipper3d/klipper, KLIPPER_DICT a data dictionary of
its firmware for a Linux process, and KLIPPER_PYTHON a Python with the packages that it needs.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np

from camtool.arrays import Floats, Ints

CLOCK_HZ = 50e6
"""Of a Linux process."""

CONFIGURATION = """
[gcode_arcs]
resolution: 0.1
[force_move]
enable_force_move: True
[mcu]
serial: none
[printer]
kinematics: cartesian
max_velocity: 50
max_accel: 250
max_z_velocity: 25
max_z_accel: 100
square_corner_velocity: 5
"""
AXIS = """
[stepper_{axis}]
step_pin: gpiochip0/gpio{pin}1
dir_pin: gpiochip0/gpio{pin}2
endstop_pin: gpiochip0/gpio{pin}3
rotation_distance: 0.8
microsteps: 1
position_endstop: -300
position_min: -300
position_max: 300
"""
AT_ZERO = "SET_KINEMATIC_POSITION X=0 Y=0 Z=0\n"


def places() -> tuple[Path, Path, Path] | None:
    """Its sources, dictionary and Python; None where one of them is not named."""
    named = [os.environ.get(f"KLIPPER_{name}") for name in ("SOURCE", "DICT", "PYTHON")]
    if not all(named):
        return None
    source, dictionary, python = (Path(str(name)) for name in named)
    return source, dictionary, python


def steps_of(program: str, folder: Path) -> tuple[Floats, Ints]:
    """The moments (K,) s of all steps of a program, and the positions (K, 3) after them."""
    found = places()
    assert found is not None
    source, dictionary, python = found
    axes = "".join(AXIS.format(axis=axis, pin=k) for k, axis in enumerate("xyz", 1))
    (folder / "mill.cfg").write_text(CONFIGURATION + axes, encoding="ascii")
    (folder / "program.gcode").write_text(AT_ZERO + program, encoding="ascii")
    subprocess.run(
        [
            python, source / "klippy" / "klippy.py", folder / "mill.cfg",
            "-i", folder / "program.gcode", "-o", folder / "sent", "-d", dictionary,
        ],
        check=True,
        capture_output=True,
        timeout=120.0,
    )  # fmt: skip
    dump = subprocess.run(
        [python, source / "klippy" / "parsedump.py", dictionary, folder / "sent"],
        check=True,
        capture_output=True,
        text=True,
        timeout=120.0,
    ).stdout
    return events_of(dump)


def events_of(dump: str) -> tuple[Floats, Ints]:
    """The steps of a dump: each `queue_step` is `count` of them, the first after `interval` ticks,
    each of the following after `add` more than the one before."""
    axes, ways, clocks = dict[str, int](), dict[str, int](), dict[str, int]()
    events = list[tuple[int, int, int]]()
    for line in dump.splitlines():
        word, *rest = line.split() or [""]
        said = dict(part.split("=", 1) for part in rest if "=" in part)
        motor = said.get("oid", "")
        if word == "config_stepper":
            axes[motor] = len(axes)
        elif word == "set_next_step_dir":
            ways[motor] = 1 if said["dir"] == "1" else -1
        elif word == "reset_step_clock":
            clocks[motor] = int(said["clock"])
        elif word == "queue_step":
            interval = int(said["interval"])
            for _ in range(int(said["count"])):
                clocks[motor] = clocks.get(motor, 0) + interval
                interval += int(said["add"])
                events.append((clocks[motor], axes[motor], ways[motor]))
    table = np.array(sorted(events), dtype=np.int64)
    moves = np.zeros((len(table), 3), dtype=np.int64)
    moves[np.arange(len(table)), table[:, 1]] = table[:, 2]
    return table[:, 0] / CLOCK_HZ, np.cumsum(moves, axis=0)
