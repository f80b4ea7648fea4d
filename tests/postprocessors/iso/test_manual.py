"""Programs for Fanuc, Haas and Mach3 are read by a reader that follows their manuals, and by no
word of ours: the path is the planned one within the last decimal."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import CamtoolError
from camtool.importers.read import read_drawing
from camtool.pipeline import post_drawing
from camtool.planning.job import job_of
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.moves import Kind, Move, Toolpath
from tests.oracles.fanuc_manual import FANUC, HAAS, MACH3, Step, run
from tests.postprocessors.gcode.parts import part, toolpaths
from tests.strategies import examples

CONTROLS = {"fanuc": FANUC, "haas": HAAS, "mach3": MACH3}
DRAWINGS = sorted(
    path for path in Path("samples").iterdir() if path.suffix in (".dxf", ".svg", ".csv")
)
MOVES = {Kind.RAPID: "rapid", Kind.LINE: "line", Kind.ARC_CW: "cw", Kind.ARC_CCW: "ccw"}
EVENTS = {
    Kind.DWELL: "dwell",
    Kind.SPINDLE_CW: "spindle cw",
    Kind.SPINDLE_CCW: "spindle ccw",
    Kind.SPINDLE_OFF: "spindle off",
    Kind.TOOL_CHANGE: "tool",
    Kind.COOLANT_MIST: "mist",
    Kind.COOLANT_FLOOD: "flood",
    Kind.COOLANT_OFF: "dry",
}


def stray_mm(points: np.ndarray, move: Move) -> float:
    """The greatest distance of points from a planned move."""
    start, end = np.array(move.start), np.array(move.end)
    if move.centre is None:
        along = end - start
        length = float(along @ along)
        share = np.clip((points - start) @ along / length, 0.0, 1.0) if length else 0.0
        nearest = start + np.outer(share, along)
        return float(np.linalg.norm(points - nearest, axis=1).max())
    centre = np.array(move.centre)
    out, to = start[:2] - centre, points[:, :2] - centre
    radius = float(np.hypot(*out))
    return float(np.abs(np.hypot(*to.T) - radius).max())


def check_same_path(data: bytes, wanted: Toolpath, name: str, target: LoadedTarget) -> None:
    """Each planned move is one or more steps of the manual's reader, from its start to its end and
    nowhere else, at its feed; each event comes where it was planned."""
    unit_mm = target.target.unit_mm(target.machine, target.machine.axes.x)
    is_inches = target.machine.dialect.program.units == "in"  # type: ignore[attr-defined]
    feed_unit_mm_min = target.machine.feed.unit_mm_min * (2.54 if is_inches else 1.0)
    steps = run(data, CONTROLS[name])
    place, at = np.array(wanted.start), 0

    def taken(is_move: bool) -> Step:
        nonlocal at
        while steps[at].is_move and np.abs(np.array(steps[at].end) - place).max() < 1e-9:
            if is_move and len(steps[at].points) > 1:
                break
            at += 1
        at += 1
        return steps[at - 1]

    for move in wanted:
        if move.kind in EVENTS:
            step = taken(False)
            assert step.kind == EVENTS[move.kind], move
            if move.value is not None:
                near = 0.00051 if move.kind == Kind.DWELL else 0.51
                assert step.value == pytest.approx(move.value, abs=near), move
            continue
        if move.kind not in MOVES:
            continue
        near = 0.51 * unit_mm
        if move.centre is None and np.abs(np.array(move.end) - place).max() <= near:
            continue
        while True:
            step = taken(True)
            assert step.is_move, (move, step)
            assert (step.kind == "rapid") == (move.kind == Kind.RAPID), (move, step)
            assert stray_mm(step.points, move) <= 2.0 * unit_mm, (move, step)
            if move.feed is not None:
                assert move.feed - feed_unit_mm_min <= step.feed <= move.feed + 1e-6, (move, step)
            place = np.array(step.end)
            if np.abs(place - np.array(move.end)).max() <= near:
                break


def load(name: str, *settings: str) -> LoadedTarget:
    return load_target(name, settings=list(settings))


def check_pecks(steps: list[Step], wanted: Toolpath) -> None:
    """The same holes to the same depth, in bites no larger than the planned ones: where they begin
    is the controller's own, since it counts from R and the plan from the stock."""
    cut = [step.end for step in steps if step.kind == "line"]
    planned = [move.end for move in wanted if move.kind == Kind.LINE]
    holes: list[dict[tuple[float, ...], float]] = [{}, {}]
    for found, ends in zip(holes, (cut, planned), strict=True):
        for x, y, z in ends:
            place = (round(x, 2), round(y, 2))
            found[place] = round(min(found.get(place, 0.0), z), 2)
    assert holes[0] == holes[1]
    assert len(cut) > len(holes[0])


def check_written(path: Toolpath, target: LoadedTarget, name: str) -> None:
    data = target.target.write(path, target.machine).data
    check_same_path(data, path, name, target)


@pytest.mark.parametrize("units", ["mm", "in"])
@pytest.mark.parametrize("name", CONTROLS)
def test_every_kind_of_row(name: str, units: str) -> None:
    target = load(name, f"dialect.program.units={units}")
    path = part(tools=True)
    path = path.first(next(move.index for move in path if move.kind == Kind.HOME_Z))
    check_written(path, target, name)


@examples(60, 3000)
@given(name=st.sampled_from(sorted(CONTROLS)), inches=st.booleans(), path=toolpaths())
def test_random_paths(name: str, inches: bool, path: Toolpath) -> None:
    target = load(name, f"dialect.program.units={'in' if inches else 'mm'}")
    check_written(path, target, name)


FILES = {"profile": "logo.dxf", "engrave": "logo.dxf", "pocket": "mount.dxf"}
JOBS: dict[str, dict[str, Any]] = {
    "profile": {},
    "engrave": {},
    "pocket": {"tool_diameter_mm": 1.0},
    "drill": {},
    "dwelling": {"kind": "drill", "dwell_s": 0.5},
    "pecking": {"kind": "drill", "peck_mm": 0.4},
}


def check_drawing(name: str, kind: str, file: Path, units: str) -> bool:
    """True if the operation can cut this drawing."""
    size = ["axes.x.travel_mm=5000", "axes.y.travel_mm=5000", "defaults.feed_z_mm=1.0"]
    target = load(name, *size, f"dialect.program.units={units}")
    job = job_of(**{"kind": kind, "spindle_rpm": 1200.0, **JOBS[kind]})
    try:
        run_ = post_drawing(read_drawing(file), job, target, check=False)
    except CamtoolError:
        return False
    if run_.program is None or run_.wanted is None:
        return False
    if kind == "pecking":
        check_pecks(run(run_.program.data, CONTROLS[name]), run_.wanted)
    else:
        check_same_path(run_.program.data, run_.wanted, name, target)
    return True


@pytest.mark.parametrize("kind", JOBS)
@pytest.mark.parametrize("name", CONTROLS)
def test_a_job(name: str, kind: str) -> None:
    file = Path(f"samples/{FILES.get(kind, 'plate.dxf')}")
    for units in ("mm", "in") if kind == "profile" else ("mm",):
        assert check_drawing(name, kind, file, units)


@pytest.mark.slow
@pytest.mark.parametrize("units", ["mm", "in"])
@pytest.mark.parametrize("kind", JOBS)
@pytest.mark.parametrize("name", CONTROLS)
def test_every_drawing(name: str, kind: str, units: str) -> None:
    assert sum(check_drawing(name, kind, file, units) for file in DRAWINGS) >= 2
