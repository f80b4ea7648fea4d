"""Twenty programs through the LinuxCNC that is installed, without a screen, against the model.

    pytest -m slow tests/validation/test_validation_live.py            (about fifteen minutes)
    pytest -m slow --bless tests/validation/test_validation_live.py    writes docs/validation.md

With CAMTOOL_TRAJECTORY, the folder `tests/trajectory-planner/circular-arcs/nc_files` of LinuxCNC's
sources, its own programs for its planner are run too (an hour).

`live.py` runs them within Debian's linuxcnc-uspace. CAMTOOL_LIVE names a folder in which the
recordings are kept; those that are there already are not made again.
"""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from camtool.arrays import Floats
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import load_target
from tests.oracles.linuxcnc_headless import COMMAND, alone, laid_out
from tests.oracles.motion_rows import rows_of
from tests.targets import simulate
from tests.validation.page import check, mm, signed
from tests.validation.pieces import UM

HERE = Path(__file__).parent
SAMPLES = HERE.parents[1] / "samples"
NC_FILES = Path("/usr/share/linuxcnc/ncfiles")
RECORDED = ("circle10", "helix", "short61", "star", "zigzag")
OWN = ("hole-circle", "polar", "3dtest", "toplevel", "spiral")
PLATE = ("pocket", "slot", "window", "holes", "sign", "line", "outline")
OF_PLATE = ("plate.dxf", "--job", "plate.toml", "--feed", "1500", "--operation")
POSTED = {
    "logo": ("logo.dxf",),
    **{f"plate-{name}": (*OF_PLATE, name) for name in PLATE},
    "bore": ("board.dxf", "--job", "board.toml", "--operation", "screws", "--feed", "1000"),
    "chamfer": (
        *("mount.dxf", "--kind", "chamfer", "--tool-kind", "v", "--tool-angle", "90"),
        *("--tool-diameter", "6", "--chamfer", "0.5", "--feed", "1500"),
    ),
}

PATH_UM = 10.0
TIME_PART = 0.005
MOST_MISSES = 2

CAUSES = {"3dtest": "arcs in XZ and YZ are chords in a toolpath; each chord is a move of its own"}
"""Why programs are off by more than is aimed at."""

CHORDS = "arcs in XZ and YZ are chords in a toolpath"
STOPS = {
    "interp_state/sloc_testing": "stops, each of them late on a busy computer",
    "quick-tests/axis_letter": "0.08 s lost at the first stop, on a busy computer",
    "quick-tests/zero_length_move": "0.3 s in all: two stops, 6 ms",
}
"""Programs whose times scatter by 2 %: LinuxCNC's task comes late to each stop, by as much as the
computer is busy."""

OF_PLANNER = {
    "arc-feed/arc_time": CHORDS,
    "arc-intersections/arc-arc-planeswitch": CHORDS,
    "arc-intersections/linearc-end-overrun": CHORDS,
    "arc-intersections/linearc-stellabee": CHORDS,
    "arc-intersections/tort-sam-mach3": CHORDS,
    "performance/test_12mmflat": CHORDS,
    "quick-tests/cradek_accel_issue": CHORDS,
    "quick-tests/sam-tolerance-issue": CHORDS,
    "violation_checks/arc_vel_violation2": CHORDS,
    "violation_checks/maxvel_violation_helical": CHORDS,
    "violation_checks/maxvel_violation_helical2": CHORDS,
    "violation_checks/sam_violation1": CHORDS,
    "violation_checks/sam_violation2_verbatim": CHORDS,
    "violation_checks/stellabee-kink-test": CHORDS,
    "violation_checks/stellabee-violation-spirals": CHORDS,
    "performance/random_lines_0.001in": "moves of 1 µm, one to two servo periods each",
    "diagnostic/lineno-test": "a dwell before the first move, which the recording leaves out",
    **STOPS,
}
"""Why LinuxCNC's own programs for its planner are off by more, by folder and name."""

NOT_RUN = {
    "arc-feed/full_xy": "a frame that the program places: the recording is of the axes",
    "arc-feed/full_xz": "the same",
    "arc-feed/full_yz": "the same",
    "diagnostic/abc_tangent": "rotary axes, which the machine does not have",
    "diagnostic/bad_spirals_1": "refused by both: an arc of two radii",
    "diagnostic/bad_spirals_comp": "refused by both: an arc of two radii",
    "diagnostic/bad_spirals_lathe": "refused by both: an arc of two radii",
    "diagnostic/spiral_aggressive": "refused by both: an arc of two radii",
    "diagnostic/rgh": "the live machine stops in it",
    "interp_state/sloc_toolchange": "no moves",
    "quick-tests/tolerance_parabolic_check2": "lines with /, which the live machine leaves out",
    "spindle/g33_blend": "follows a spindle, which the machine does not have",
    "spindle/g33_simple": "follows a spindle",
    "spindle/g95_blend": "follows a spindle",
    "spindle/rigidtap_test": "follows a spindle",
    "spindle/tapping": "follows a spindle",
    "violation_checks/tap-discrimant-error-orig": "follows a spindle",
    "violation_checks/machinekit_412": "a rotary axis",
    "violation_checks/sam_vel_violation": "a frame that the program turns",
    "violation_checks/sam_zero_length_move": "tool 15, which the table of the test does not have",
    "violation_checks/tkalcevic_realtime_error": "a rotary axis",
    "wz-tests/130207L": "M111, a program of the machine",
    "wz-tests/130207LZW": "an axis W",
    "wz-tests/xw": "an axis W",
}
"""Those that are not compared."""

LONGEST_S = 100.0
"""Longer programs are left out."""

SCATTER_PLACES = 15.0
"""No two runs of a real-time process are the same: paths differ by 1 µm, times by some periods."""

MAX_RECORDINGS = 3
"""A program that comes late without a known cause is recorded again: on a busy computer the task
and the sampler lose time by themselves."""

APART = {("", "paths apart, µm"): 100.0}
"""More places for paths: on a busy computer their samples scatter. The aim is asked beside it."""

LIVE_HEADS = ("paths apart, µm", "LinuxCNC, s", "%")
OF_PLANNER_S = {("", head): 100.0 for head in LIVE_HEADS} | {
    (name, head): math.inf for name in OF_PLANNER for head in LIVE_HEADS
}
"""Places of what is measured on the live machine. The aims are asked beside them, and two runs
that both keep them differ by twice as much; programs that miss them for a known cause differ from
run to run by more."""

LATE = APART | {("plate-holes", "LinuxCNC, s"): 70.0, ("plate-holes", "%"): 70.0}
"""And for the times of a program that stops so often that they scatter by 0.6 %: on a busy
computer LinuxCNC's task is late at each stop."""

MOST_POINTS = 3000
WINDOW_S = 1.0
WINDOW_PART = 0.02


@dataclass(frozen=True, eq=False)
class Line:
    """Positions (N, 3) mm and when the tool is there (N,) s."""

    points: Floats
    seconds: Floats

    def fewer(self) -> Line:
        every = max(1, len(self.points) // MOST_POINTS)
        return Line(self.points[::every], self.seconds[::every])


def posted(name: str, folder: Path) -> Path:
    """A program of the twenty."""
    file = folder / f"{name}.ngc"
    if name in RECORDED:
        shutil.copyfile(HERE / "referees" / "linuxcnc" / f"{name}.ngc", file)
    elif name in OWN:
        shutil.copyfile(NC_FILES / f"{name}.ngc", file)
    else:
        drawing, *flags = POSTED[name]
        flags = [str(SAMPLES / flag) if flag.endswith(".toml") else flag for flag in flags]
        command = [sys.executable, "-m", "camtool", "post", str(SAMPLES / drawing), "-q"]
        subprocess.run([*command, "-t", "linuxcnc", *flags, "-o", str(file)], check=True)
    return file


def record(programs: list[Path], folder: Path, above: Sequence[Path]) -> None:
    """Run programs, each of which gets its samples beside it; `above` as `laid_out` has it."""
    work = folder / "machine"
    environment = laid_out(work, (HERE / "live.py").read_text(encoding="utf-8"), above)
    environment["CNC_PROGRAMS"] = " ".join(map(str, programs))
    with alone(), (work / "log").open("w", encoding="utf-8") as log:
        subprocess.run(
            COMMAND, cwd=work, env=environment, stdout=log, stderr=log,
            stdin=subprocess.DEVNULL, timeout=3600, check=False,
        )  # fmt: skip


def recorded(program: Path) -> Line:
    """Return LinuxCNC's recorded motion, from the first move out of X0 Y0 Z0 to the last."""
    rows = []
    with Path(f"{program}.samples").open(encoding="ascii") as lines:
        for line in lines:
            parts = line.split()
            if len(parts) >= 4 and parts[0].isdigit():
                rows.append([float(part) for part in parts[:4]])
    samples = np.array(rows)
    points = samples[:, 1:]
    moves = np.flatnonzero(np.abs(np.diff(points, axis=0)).max(axis=1) > 0.0)
    begins = moves[np.abs(points[moves]).max(axis=1) < 1e-9]
    mine = slice(int(begins[0]), int(moves[-1]) + 2)
    seconds = 0.001 * (samples[mine, 0] - samples[mine.start, 0])
    return Line(points[mine], seconds)


@dataclass(frozen=True)
class Compared:
    """The cells of a program's row in the table, and whether it is beside the aim."""

    cells: list[str]
    is_missed: bool


def comparison(program: Path, model: Line) -> Compared | None:
    """Compare the recorded motion with the model's; None where the sampler came too late."""
    try:
        live = recorded(program)
    except IndexError:
        return None
    wanted_s, found_s = float(live.seconds[-1]), float(model.seconds[-1])
    beside = UM * max(off(live, model), off(model, live))
    part = found_s / wanted_s - 1.0
    cells = [mm(wanted_s, 2), mm(found_s, 2), signed(100.0 * part, 2), mm(beside, 1)]
    return Compared(cells, beside > PATH_UM or abs(part) > TIME_PART)


def predicted(program: Path) -> Line:
    """Return the model's motion at about the times of the recorded samples."""
    target = load_target("linuxcnc")
    path = target.target.read_in(program.read_bytes(), target.machine, program.parent)
    points, seconds, now = [np.zeros((1, 3))], [np.zeros(1)], 0.0
    for row in rows_of(simulate(path, target.machine, Options(effects=IDEAL))):
        count = len(row.commanded)
        points.append(row.commanded)
        seconds.append(now + row.duration_s * np.arange(1, count + 1) / max(count, 1))
        now += row.duration_s
    every = np.concatenate(points)
    return Line(np.append(every, every[-1:], axis=0), np.append(np.concatenate(seconds), now))


def off(some: Line, line: Line) -> float:
    """The farthest of some points from a line, of which only what is there at about the same time
    counts: a path that goes elsewhere, or another way, is not near by chance."""
    scale = line.seconds[-1] / some.seconds[-1]
    begin, way = line.points[:-1], np.diff(line.points, axis=0)
    square = (way**2).sum(axis=1)
    window = WINDOW_S + WINDOW_PART * line.seconds[-1]
    some = some.fewer()
    low = np.searchsorted(line.seconds[1:], some.seconds * scale - window)
    high = np.searchsorted(line.seconds[:-1], some.seconds * scale + window)
    most = 0.0
    for point, first, last in zip(some.points, low.tolist(), high.tolist(), strict=True):
        near = slice(min(first, len(begin) - 1), max(last, min(first, len(begin) - 1) + 1))
        along = ((point - begin[near]) * way[near]).sum(axis=1)
        share = np.clip(along / np.where(square[near] > 0.0, square[near], 1.0), 0.0, 1.0)
        apart = begin[near] + share[:, None] * way[near] - point
        most = max(most, float((apart**2).sum(axis=1).min()))
    return float(np.sqrt(most))


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("linuxcnc") is None, reason="LinuxCNC is not installed")
@pytest.mark.skipif(not NC_FILES.is_dir(), reason="LinuxCNC's own programs are not installed")
def test_linuxcnc_live(bless: bool, tmp_path: Path) -> None:
    folder = Path(os.environ.get("CAMTOOL_LIVE", tmp_path)).absolute()
    names = [*RECORDED, *POSTED, *OWN]
    assert len(names) == 20
    programs = {name: posted(name, folder) for name in names}
    left = [file for file in programs.values() if not Path(f"{file}.samples").exists()]
    if left:
        record(left, folder, [folder, *tmp_path.parents[:2]])
    rows, misses = [], []
    for name, program in programs.items():
        live, model = recorded(program), predicted(program)
        wanted_s, found_s = float(live.seconds[-1]), float(model.seconds[-1])
        beside = UM * max(off(live, model), off(model, live))
        part = found_s / wanted_s - 1.0
        late = (name, "%") in LATE and abs(part) < 2.0 * TIME_PART
        missed = beside > PATH_UM or (abs(part) > TIME_PART and not late)
        misses += [name] if missed else []
        cells = [mm(wanted_s, 2), mm(found_s, 2), signed(100.0 * part, 2), mm(beside, 1)]
        rows.append([name, *cells, CAUSES.get(name, "")])
    heads = ["program", "LinuxCNC, s", "model, s", "%", "paths apart, µm", "cause where it misses"]
    check("live-linuxcnc", heads, rows, bless, SCATTER_PLACES, LATE)
    assert len(misses) <= MOST_MISSES, misses
    assert set(misses) <= set(CAUSES), misses


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("linuxcnc") is None, reason="LinuxCNC is not installed")
@pytest.mark.skipif(not os.environ.get("CAMTOOL_TRAJECTORY"), reason="CAMTOOL_TRAJECTORY is unset")
def test_programs_of_linuxcnc_s_planner(bless: bool, tmp_path: Path) -> None:
    """All that run, each text once: within the aim, or with a cause that stands here."""
    source = Path(os.environ["CAMTOOL_TRAJECTORY"])
    folder = Path(os.environ.get("CAMTOOL_LIVE", tmp_path)).absolute()
    programs, models, seen = {}, {}, set()
    names = {
        file.relative_to(source).with_suffix("").as_posix(): file for file in source.rglob("*.ngc")
    }
    for name, file in sorted(names.items()):
        data = file.read_bytes()
        if name.startswith("auto-test") or name in NOT_RUN or data in seen:
            continue
        seen.add(data)
        programs[name] = folder / f"{name.replace('/', '__')}.ngc"
        programs[name].write_bytes(data)
        models[name] = predicted(programs[name])
        if models[name].seconds[-1] > LONGEST_S:
            del programs[name], models[name]
    again = [name for name in programs if not Path(f"{programs[name]}.samples").exists()]
    compared: dict[str, Compared | None] = {}
    for _ in range(MAX_RECORDINGS):
        if again:
            record([programs[name] for name in again], folder, [folder, *tmp_path.parents[:2]])
        compared |= {
            name: comparison(programs[name], models[name])
            for name in programs
            if name in again or name not in compared
        }
        again = [
            name
            for name, each in compared.items()
            if name not in OF_PLANNER and (each is None or each.is_missed)
        ]
        if not again:
            break
    rows = [
        [name, *(["", "", "", ""] if each is None else each.cells), OF_PLANNER.get(name, "")]
        for name, each in compared.items()
    ]
    misses = [name for name, each in compared.items() if each is None or each.is_missed]
    heads = ["program", "LinuxCNC, s", "model, s", "%", "paths apart, µm", "cause where it misses"]
    check("live-planner", heads, rows, bless, SCATTER_PLACES, OF_PLANNER_S)
    assert set(misses) <= set(OF_PLANNER), misses
