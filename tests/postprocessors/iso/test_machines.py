"""The machines that come as files: each stands for itself, and reads what it writes."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import CamtoolError, MachineError
from camtool.importers.read import read_drawing
from camtool.machine.model import Axis
from camtool.pipeline import post_drawing
from camtool.planning.job import job_of
from camtool.tables import read_table
from camtool.target.registry import (
    list_target,
    load_target,
    own_target_of,
    shipped_files,
    target_names,
)
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.postprocessors.gcode.parts import toolpaths
from tests.postprocessors.iso.test_tables import check_there_and_back
from tests.strategies import examples

FILES = shipped_files()
ON_ISO = sorted(name for name in FILES if own_target_of(name) == "iso")


def test_there_are_some_and_each_is_known_by_its_own_name() -> None:
    assert {"fanuc", "haas", "mach3", "mach4", "marlin", "reprap", "smoothie"} <= set(ON_ISO)
    assert {"klipper", "fluidnc", "grblhal"} <= set(FILES) <= set(target_names())
    for name, file in FILES.items():
        assert read_table(file)["target"]["name"] == name


@pytest.mark.parametrize("name", sorted(FILES))
def test_each_value_has_its_source(name: str) -> None:
    """Each number and word has a comment, or its table has one, or the same key of X."""
    bare, table, sourced_table, sourced = list[str](), "", False, set[str]()
    for line in FILES[name].read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            table, sourced_table = line.partition("]")[0], "#" in line
        elif "=" in line and not line.startswith("#"):
            key = line.partition("=")[0].strip()
            is_name = table in ("", "[target") and key != "extension"
            if "#" in line or sourced_table or is_name:
                sourced.add(key)
            elif not (table.startswith("[axes.") and key in sourced):
                bare.append(f"{table}] {key}")
    assert set(bare) <= {"[target] extension"}


@pytest.mark.parametrize("name", sorted(FILES))
def test_the_list_says_what_its_figures_rest_on(name: str) -> None:
    listed = list_target(name)
    assert listed.target.rests_on
    assert listed.grade in ("timed", "path only", "step-true")
    assert listed.needs == ()


def kept(path: Toolpath, name: str) -> Toolpath:
    """A path without what this machine cannot say, at speeds of its spindle."""
    events = load_target(name).machine.dialect.events  # type: ignore[attr-defined]
    builder = ToolpathBuilder()
    for move in path:
        if move.kind == Kind.SPINDLE_CCW and not events.spindle_ccw:
            continue
        if move.kind > Kind.ARC_CCW:
            is_speed = move.kind in (Kind.SPINDLE_CW, Kind.SPINDLE_CCW)
            is_whole = is_speed and events.rpm_decimals == 0 and move.value is not None
            builder.event(move.kind, math.ceil(move.value) if is_whole else move.value)
        elif move.centre is not None:
            assert move.feed is not None
            x, y, z = move.end
            ccw = move.kind == Kind.ARC_CCW
            builder.arc(x, y, z, centre=move.centre, ccw=ccw, feed=move.feed)
        elif move.feed is not None:
            builder.line(*move.end, feed=move.feed)
        else:
            builder.rapid(*move.end)
    return builder.finish()


@examples(25, 1000)
@given(name=st.sampled_from(ON_ISO), path=toolpaths())
def test_random_paths_come_back(name: str, path: Toolpath) -> None:
    check_there_and_back(kept(path, name), load_target(name))


@pytest.mark.parametrize("name", sorted(FILES))
@pytest.mark.parametrize("units", ["mm", "in"])
def test_a_drawing_is_written_and_judged(name: str, units: str) -> None:
    if name == "klipper" and units == "in":
        with pytest.raises(MachineError, match="units"):
            load_target(name, settings=["dialect.program.units=in"])
        return
    key = "dialect.units" if name not in ON_ISO else "dialect.program.units"
    target = load_target(name, settings=[f"{key}={units}"])
    drawing = read_drawing(Path("samples/logo.dxf"))
    run = post_drawing(drawing, job_of(kind="profile"), target)
    assert not run.failed
    assert isinstance(target.machine.axes.x, Axis)


def test_a_users_file_may_extend_one(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(
        'extends = "mach4"\n[target]\nname = "mine"\n[dialect.words]\ndecimals = 3\n',
        encoding="utf-8",
    )
    machine = load_target("mach4", machine_file=file).machine
    assert machine.target.name == "mine"
    assert machine.dialect.words.decimals == 3  # type: ignore[attr-defined]
    assert machine.dialect.events.dwell == ("G4 P{ms}",)  # type: ignore[attr-defined]
    assert machine.dialect.lines.end == "crlf"  # type: ignore[attr-defined]


def test_a_wrong_name_gets_a_guess() -> None:
    with pytest.raises(MachineError, match="did you mean haas"):
        load_target("hass")


def test_fanuc_reads_feeds_without_a_point_as_whole_and_lengths_as_parts() -> None:
    target = load_target("fanuc")
    path = target.target.read(
        b"%\nO1\nG90 G0 X0 Y0\nG1 X1500 F500\nX3. F250.\nM30\n%\n", target.machine
    )
    assert [row.end[0] for row in path if row.kind == Kind.LINE] == [1.5, 3.0]
    assert [row.feed for row in path if row.kind == Kind.LINE] == [500.0, 250.0]


CYCLES = [name for name in ON_ISO if load_target(name).machine.dialect.cycles.use]  # type: ignore[attr-defined]


@pytest.mark.parametrize("dwell_s", [None, 0.5])
@pytest.mark.parametrize("name", CYCLES)
def test_a_cycle_is_the_moves_that_it_stands_for(name: str, dwell_s: float | None) -> None:
    drawing = read_drawing(Path("samples/plate.dxf"))
    decoded = []
    for use in ("true", "false"):
        target = load_target(name, settings=[f"dialect.cycles.use={use}"])
        job = job_of(kind="drill", **({} if dwell_s is None else {"dwell_s": dwell_s}))
        run = post_drawing(drawing, job, target, check=False)
        assert run.program is not None
        assert run.decoded is not None
        assert (b"G98 G8" in run.program.data) == (use == "true")
        decoded.append([(row.kind, row.end, row.feed, row.value) for row in run.decoded])
    assert decoded[0] == decoded[1]


@pytest.mark.parametrize("name", CYCLES)
def test_pecks_end_at_the_same_depth_and_above(name: str) -> None:
    target = load_target(name, settings=["defaults.feed_z_mm=1.0"])
    job = job_of(kind="drill", peck_mm=0.4)
    run = post_drawing(read_drawing(Path("samples/plate.dxf")), job, target, check=False)
    assert run.program is not None
    assert run.decoded is not None
    assert run.wanted is not None
    assert b"G83" in run.program.data
    for path in (run.wanted, run.decoded):
        cuts = path.end[path.is_feed]
        assert cuts[:, 2].min() == pytest.approx(-1.0)
    bites = [-(row.end[2] - row.start[2]) for row in run.decoded if row.feed is not None]
    assert max(bites) <= 0.4 + target.machine.dialect.cycles.clearance_mm + 1e-9  # type: ignore[attr-defined]


DRAWINGS = sorted(
    path for path in Path("samples").iterdir() if path.suffix in (".dxf", ".svg", ".csv")
)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(FILES))
@pytest.mark.parametrize("kind", ["profile", "engrave", "pocket", "drill"])
def test_every_drawing_is_written_and_read_back(name: str, kind: str) -> None:
    """Those that an operation can cut at all, on every machine alike."""
    size = ["axes.x.travel_mm=5000", "axes.y.travel_mm=5000", "dialect.cycles.use=false"]
    target = load_target(name, settings=size[: 3 if name in ON_ISO else 2])
    unit_mm = target.target.unit_mm(target.machine, target.machine.axes.x)
    written = 0
    for file in DRAWINGS:
        more = {"tool_diameter_mm": 1.0} if kind == "pocket" else {}
        try:
            run = post_drawing(read_drawing(file), job_of(kind=kind, **more), target, check=False)
        except CamtoolError:
            continue
        if run.program is None or run.decoded is None:
            continue
        assert run.wanted is not None
        came_from = run.program.row_of_block[run.decoded.block]
        rows = np.flatnonzero(run.decoded.is_motion & (came_from >= 0))
        last = rows[np.append(np.diff(came_from[rows]) != 0, True)]
        stray = np.abs(run.decoded.end[last] - run.wanted.end[came_from[last]])
        assert stray.max(initial=0.0) <= 0.51 * unit_mm, file
        written += 1
    assert written >= 2
