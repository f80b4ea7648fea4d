"""The machines that come as files: each stands for itself, and reads what it writes."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import MachineError
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
            builder.event(move.kind, move.value)
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


@pytest.mark.slow
@pytest.mark.parametrize("name", ON_ISO)
@examples(1000, 1000)
@given(path=toolpaths())
def test_a_thousand_random_paths_of_each(name: str, path: Toolpath) -> None:
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
