"""grbl's own firmware on this computer: its sources, compiled for the board of `grbl_board`.

GRBL_SOURCE names a checkout of github.com/gnea/grbl (1.1h), or its folder `grbl`.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from camtool.arrays import Floats, Ints

BOARD = Path(__file__).parent / "grbl_board"
HEADERS = ("avr/io.h", "avr/pgmspace.h", "avr/interrupt.h", "avr/wdt.h", "util/delay.h")
OURS = {"main.c", "serial.c", "eeprom.c"}
"""Files of grbl whose part the board plays."""

TICK_S = 1.0 / 16e6
FLAGS = ("-O1", "-fcommon", "-w", "-fsingle-precision-constant", "-std=gnu99")
TICK = np.dtype([("at", "<u8"), ("steps", "<i4", 3), ("pwm", "<i4"), ("on", "<i4")])

WAITING = {
    "motion_control.c": (
        r"(if \( plan_check_full_buffer\(\) \) \{ protocol_auto_cycle_start\(\);)",
        r"\1 board_wait();",
    ),
    "protocol.c": (
        r"(protocol_execute_realtime\(\);   // Check and execute run-time commands)",
        r"\1\n    board_wait();",
    ),
}
"""Where the main program waits for the motors, time goes on; elsewhere it takes none."""


def source() -> Path | None:
    """The folder of its sources, None where nobody names it."""
    named = os.environ.get("GRBL_SOURCE")
    if named is None:
        return None
    folder = Path(named)
    return folder if (folder / "gcode.c").exists() else folder / "grbl"


@dataclass(frozen=True, eq=False)
class Ran:
    """What it did: positions (N, 3) steps after each tick with a step, when (N,) s, the PWM of
    the spindle (N,), 0 while it is off; the time until it stood still, s; for each line the
    number of its error or 0, and where the parser stood after it, (L, 3) mm."""

    steps: Ints
    at_s: Floats
    pwm: Ints
    seconds: float
    errors: list[int]
    places: Floats


def built(folder: Path, *, smoothing: bool = True) -> Path:
    """The program, made in a folder."""
    origin = source()
    assert origin is not None
    work = folder / ("smooth" if smoothing else "plain")
    work.mkdir(parents=True)
    for header in HEADERS:
        (work / header).parent.mkdir(exist_ok=True)
        (work / header).touch()
    for file in origin.glob("*.[ch]"):
        text = file.read_text(encoding="utf-8")
        if file.name in WAITING:
            text, count = re.subn(*WAITING[file.name], text)
            assert count == 1, file.name
        if file.name == "protocol.c":
            text, count = re.subn(r"while \(sys\.suspend\) \{", r"\g<0> board_resume();", text)
            assert count == 1
        if file.name == "config.h" and not smoothing:
            text = text.replace("#define ADAPTIVE_MULTI_AXIS_STEP_SMOOTHING", "//")
        if file.name not in OURS:
            (work / file.name).write_text(text, encoding="utf-8")
    for name in ("board.c", "board.h"):
        shutil.copyfile(BOARD / name, work / name)
    program = work / "grbl"
    files = sorted(each.name for each in work.glob("*.c"))
    command = ["gcc", *FLAGS, "-I.", "-include", "board.h", *files, "-lm", "-o", str(program)]
    subprocess.run(command, cwd=work, check=True)
    return program


def run(program: Path, data: bytes, settings: dict[str, float], folder: Path) -> Ran:
    """What it does with lines, after settings such as {"$32": 1}."""
    before = "".join(f"{name}={value:g}\n" for name, value in settings.items()).encode()
    (folder / "lines").write_bytes(before + data)
    done = subprocess.run(
        [program, folder / "lines", folder / "steps"], capture_output=True, check=True, timeout=600
    )
    errors, places, seconds, skip = list[int](), list[list[float]](), 0.0, len(settings)
    for line in done.stdout.decode("ascii").splitlines():
        if line.startswith("at "):
            places.append([float(word) for word in line.split()[2:]])
        elif line.startswith("end "):
            seconds = int(line.split()[1]) * TICK_S
        elif line.startswith("Grbl "):
            errors.clear()  # what it says of its empty memory
        elif line == "ok" or line.startswith("error:"):
            errors.append(0 if line == "ok" else int(line[6:]))
    ticks = np.fromfile(folder / "steps", dtype=TICK)
    return Ran(
        ticks["steps"].astype(np.int64),
        ticks["at"] * TICK_S,
        np.where(ticks["on"] > 0, ticks["pwm"], 0),
        seconds,
        errors[skip:],
        np.array(places[skip + 1 :]),
    )
