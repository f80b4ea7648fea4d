"""flashcut and valcnc: what is written is what is read back, and every arc stays an arc."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from tests.postprocessors.gcode.plain_parts import KINDS, anywhere, judge, on_grid, part
from tests.strategies import examples

TARGETS = sorted(KINDS)
LOADED = {name: load_target(name) for name in TARGETS}


ROW_BY_ROW = LOADED | {"flashcut": load_target("flashcut", settings=["dialect.rapids=straight"])}
"""Machines whose programs have a row for each row of the toolpath, where it can be said at all."""


def check_same(name: str, wanted: Toolpath) -> None:
    target = ROW_BY_ROW[name]
    program = target.target.write(wanted, target.machine)
    assert {finding.code for finding in program.findings} <= {ProgramCode.COORDINATES_SCALED}
    read = target.target.read(program.data, target.machine)
    assert read.kind.tolist() == wanted.kind.tolist()
    np.testing.assert_allclose(read.end, wanted.end, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(read.centre, wanted.centre, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(read.feed, wanted.feed, rtol=1e-12)
    rows = program.row_of_block[read.block]
    assert rows.tolist() == list(range(len(wanted)))
    again = target.target.write(read, target.machine)
    assert again.data == program.data


@pytest.mark.parametrize("name", TARGETS)
@examples(100, 10_000)
@given(data=st.data())
def test_what_can_be_said_comes_back(name: str, data: st.DataObject) -> None:
    check_same(name, data.draw(on_grid(KINDS[name])))


@pytest.mark.parametrize("name", TARGETS)
@examples(100, 10_000)
@given(data=st.data())
def test_anything_comes_back_within_a_unit(name: str, data: st.DataObject) -> None:
    judge(LOADED[name], data.draw(anywhere(KINDS[name])), KINDS[name].unit_mm)


def unit_of(target: LoadedTarget) -> float:
    """The last decimal of a coordinate, mm."""
    options = structs.asdict(target.machine.dialect)
    return float(10.0 ** -options["decimals"] / options.get("coord_scale", 1.0))


@pytest.mark.parametrize(
    ("name", "setting"),
    [
        ("flashcut", "dialect.decimals=4"),
        ("flashcut", "dialect.trailing_zeros=true"),
        ("flashcut", "dialect.feed_words=everywhere"),
        ("flashcut", "dialect.full_circles=whole"),
        ("flashcut", "dialect.rapids=straight"),
        ("flashcut", "dialect.z_up=-"),
        ("valcnc", "dialect.coord_scale=1"),
        ("valcnc", "dialect.decimals=3"),
        ("valcnc", "dialect.max_sweep_deg=60"),
        ("valcnc", "dialect.max_sweep_deg=30"),
    ],
)
def test_every_option_is_understood_by_both(name: str, setting: str) -> None:
    target = load_target(name, settings=[setting])
    program = judge(target, part(3.0, 8.0), unit_of(target))
    default = LOADED[name].target.write(part(3.0, 8.0), LOADED[name].machine)
    assert program.data != default.data


@pytest.mark.parametrize("name", TARGETS)
def test_random_arcs_stay_arcs(name: str) -> None:
    """Of large arcs none may become lines, whatever their numbers."""
    rng = np.random.default_rng(20070301)
    path = ToolpathBuilder()
    for _ in range(3000):
        x, y, _ = path.position
        radius, angle = rng.uniform(0.5, 8.0), math.atan2(y, x) + rng.normal()
        sweep, ccw = rng.uniform(0.2, 6.2), bool(rng.integers(2))
        cx, cy = x - radius * math.cos(angle), y - radius * math.sin(angle)
        to = angle + (sweep if ccw else -sweep)
        path.arc(
            cx + radius * math.cos(to),
            cy + radius * math.sin(to),
            centre=(cx, cy),
            ccw=ccw,
            feed=3.0,
        )
    target = LOADED[name]
    wanted = path.finish()
    program = target.target.write(wanted, target.machine)
    read = target.target.read(program.data, target.machine)
    assert (read.is_arc == read.is_feed).all()
    (mended,) = (f for f in program.findings if f.code == ProgramCode.ARC_MENDED)
    assert mended.measured is not None
    assert mended.measured > 100
    assert "0 too small or too large" in mended.message


@pytest.mark.parametrize("name", TARGETS)
def test_full_circles_are_written_in_parts(name: str) -> None:
    target = LOADED[name]
    circle = ToolpathBuilder().rapid(2.0, 0.0).arc(2.0, 0.0, centre=(0, 0), ccw=True, feed=3.0)
    program = target.target.write(circle.finish(), target.machine)
    read = target.target.read(program.data, target.machine)
    arcs = read.sweeps()[read.is_arc]
    assert len(arcs) == (2 if name == "flashcut" else 4)
    assert arcs.sum() == pytest.approx(2.0 * math.pi)


@pytest.mark.parametrize("name", TARGETS)
def test_a_speck_of_an_arc_behind_a_nearly_full_circle(name: str) -> None:
    """The circle lacks 0.01 µm: to close it would turn the speck into a circle."""
    path = ToolpathBuilder().rapid(0.0, 0.0)
    path.arc(-5.0e-12, 1.0e-5, centre=(-10.0, 0.0), ccw=False, feed=3.0)
    path.arc(-6.0e-9, 3.8e-6, centre=(-0.00316, 1.0e-5), ccw=False, feed=3.0)
    judge(LOADED[name], path.event(Kind.END).finish(), KINDS[name].unit_mm)


def test_findings_count_what_was_lost() -> None:
    target = LOADED["flashcut"]
    wanted = part(3.0, 8.0)
    found = {f.code: f for f in target.target.write(wanted, target.machine).findings}
    assert set(found) == {
        ProgramCode.MOVE_SPLIT,
        ProgramCode.EVENT_LEFT_OUT,
        ProgramCode.VALUE_ROUNDED,
    }
    assert "1 feed move in" in found[ProgramCode.MOVE_SPLIT].message
    assert "DWELL" in found[ProgramCode.EVENT_LEFT_OUT].message
    valcnc = LOADED["valcnc"]
    found = {f.code: f for f in valcnc.target.write(wanted, valcnc.machine).findings}
    assert set(found) >= {
        ProgramCode.COORDINATES_SCALED,
        ProgramCode.MOVE_SPLIT,
        ProgramCode.EVENT_LEFT_OUT,
        ProgramCode.FEED_ROUNDED,
    }
    assert "6 events" in found[ProgramCode.EVENT_LEFT_OUT].message


def test_specks_are_counted() -> None:
    target = LOADED["flashcut"]
    path = ToolpathBuilder().line(1.0, 0.0, feed=3.0).line(1.0002, 0.0, feed=3.0)
    path.arc(1.0002, 0.004, centre=(1.0002, 0.002), ccw=True, feed=3.0)
    path.arc(1.5, 0.004, centre=(1.25, 200.0), ccw=True, feed=3.0)
    found = {f.code: f for f in target.target.write(path.finish(), target.machine).findings}
    assert found[ProgramCode.MOVE_COLLAPSED].measured == 2.0
    assert found[ProgramCode.ARC_MENDED].message.startswith("0 arcs got another centre")
    assert found[ProgramCode.ARC_MENDED].where == "move 2"


@pytest.mark.parametrize("name", TARGETS)
def test_an_empty_toolpath(name: str) -> None:
    target = LOADED[name]
    program = target.target.write(ToolpathBuilder().finish(), target.machine)
    assert program.data == (b"M30\n" if name == "flashcut" else b"")
    assert len(program.row_of_block) == program.data.count(b"\n")


def test_kinds_are_those_of_the_targets() -> None:
    for name, kinds in KINDS.items():
        assert kinds.unit_mm == pytest.approx(unit_of(LOADED[name]))
    assert (
        Kind.END not in LOADED["valcnc"].target.read(b"G00X0Y0Z1", LOADED["valcnc"].machine).kind
    )
