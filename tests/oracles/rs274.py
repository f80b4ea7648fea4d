"""LinuxCNC's own interpreter as a referee: what `rs274 -g` makes of a program, as rows.

pytestmark = needs_rs274             marks and skips
compare(toolpath, data, tmp_path)    the motions of the toolpath are LinuxCNC's own
"""

from __future__ import annotations

import fcntl
import os
import re
import resource
import shutil
import subprocess
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import numpy as np
import pytest

from camtool.errors import ProgramError
from camtool.toolpath.moves import Kind, Toolpath

RS274 = shutil.which("rs274")
NO_LENGTHS = Path(__file__).parent / "headless" / "tools.tbl"
"""Tools 1 to 9, 3 mm wide."""

MOST_SECONDS, MOST_BYTES = 10, 30_000_000
"""Of one run of it."""

PRINTED_MM = 1.1e-4
"""rs274 prints four decimals."""

needs_rs274 = [
    pytest.mark.referee,
    pytest.mark.skipif(
        RS274 is None, reason="rs274 is missing: apt-get install linuxcnc-uspace brings it"
    ),
]

Call = tuple[str, str, list[float]]
"""Name, arguments as text, the numbers among them."""

_CALL = re.compile(r"N(?:\.+|\d+) *([A-Z_0-9]+)\((.*)\)$")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_MOVES = {"STRAIGHT_TRAVERSE": Kind.RAPID, "STRAIGHT_FEED": Kind.LINE}
_MM = {"CANON_UNITS_MM": 1.0, "CANON_UNITS_INCHES": 25.4}


def run_rs274(*arguments: str, **more: Any) -> subprocess.CompletedProcess[str]:
    """The interpreter, one at a time: two at once share memory, and one of them dies of it now
    and then (SIGBUS, 15 of 400 runs)."""
    with (Path(gettempdir()) / f"one-linuxcnc-{os.getuid()}").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return subprocess.run(
            [str(RS274), *arguments], capture_output=True, text=True, check=False, **more
        )


def _bound() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
    resource.setrlimit(resource.RLIMIT_FSIZE, (MOST_BYTES, MOST_BYTES))


def interpreted(
    data: bytes, folder: Path, home: Path | None = None, table: Path | None = None
) -> list[Call]:
    """The canonical calls of a program; ProgramError with LinuxCNC's words when it refuses. `home`
    is the folder of its subs, `table` the file of its tools."""
    file = folder / "program.ngc"
    file.write_bytes(data)
    said = folder / "calls.txt"
    # Some faulty programs make it loop without end, and say the same without end.
    tools = () if table is None else ("-t", str(table))
    run = run_rs274(*tools, "-g", str(file), str(said), cwd=home or folder, preexec_fn=_bound)
    lines = said.read_text(encoding="latin-1").splitlines() if said.exists() else []
    found = [_CALL.search(line) for line in [*run.stdout.splitlines(), *lines]]
    said.unlink(missing_ok=True)
    calls = [
        (call[1], call[2], [float(number) for number in _NUMBER.findall(call[2])])
        for call in found
        if call
    ]
    if run.returncode != 0:
        raise ProgramError(run.stderr.strip() or "it does not end")
    return calls


def motions(calls: list[Call]) -> np.ndarray:
    """(N, 7) kind, x, y, z, centre x, centre y, feed of each motion, mm; NaN where none."""
    rows, feed, mm, none = [], float("nan"), 1.0, float("nan")
    for name, text, values in calls:
        if name == "USE_LENGTH_UNITS":
            feed, mm = feed * mm / _MM[text], _MM[text]
        elif name == "SET_FEED_RATE":
            feed = values[0]
        elif name in _MOVES:
            x, y, z = values[:3]
            rate = none if name == "STRAIGHT_TRAVERSE" else feed * mm
            rows.append((_MOVES[name], x * mm, y * mm, z * mm, none, none, rate))
        elif name == "ARC_FEED":
            x, y, cx, cy, turn, z = values[:6]
            arc = np.array([x, y, z, cx, cy, feed]) * mm
            rows += _turns(rows[-1] if rows else (0.0,) * 7, arc, int(turn))
    return np.array(rows, dtype=np.float64).reshape(-1, 7)


def _turns(before: tuple[float, ...], arc: np.ndarray, turns: int) -> list[tuple[float, ...]]:
    """An arc of some turns as whole circles and the rest, each with its share of the height."""
    kind = Kind.ARC_CCW if turns > 0 else Kind.ARC_CW
    start, end, centre = np.array(before[1:4]), arc[:3], arc[3:5]
    a, b = (np.arctan2(*(p[:2] - centre)[::-1]) for p in (start, end))
    own = np.mod((b - a) * np.sign(turns), 2.0 * np.pi)
    own = own if own > 1e-6 else 2.0 * np.pi
    whole = abs(turns) - 1
    rise = (end[2] - start[2]) * 2.0 * np.pi / (whole * 2.0 * np.pi + own)
    circles = [(kind, *start[:2], start[2] + k * rise, *arc[3:]) for k in range(1, whole + 1)]
    return [*circles, (kind, *arc)]


def motions_of(path: Toolpath) -> np.ndarray:
    """The same of a toolpath; homing is a rapid in LinuxCNC."""
    homing = np.isin(path.kind, (Kind.HOME_XY, Kind.HOME_Z))
    kind = np.where(homing, int(Kind.RAPID), path.kind)
    table = np.column_stack([kind, path.end, path.centre, path.feed])
    return np.asarray(table[path.is_motion | homing])


def compare(path: Toolpath, data: bytes, folder: Path) -> None:
    """The moves of the toolpath are those that LinuxCNC finds in the program, with tools of length
    0."""
    ours, theirs = motions_of(path), motions(interpreted(data, folder, table=NO_LENGTHS))
    assert ours[:, 0].tolist() == theirs[:, 0].tolist()
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=PRINTED_MM)
