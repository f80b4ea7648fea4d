"""Whatever table is valid: what is written is read back equal to the dialect's resolution."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.target.registry import LoadedTarget
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.gcode_paths import farthest_mm
from tests.postprocessors.gcode.parts import toolpaths
from tests.postprocessors.iso.tables import machine_with, tables
from tests.strategies import examples


def check_there_and_back(path: Toolpath, loaded: LoadedTarget) -> None:
    """Each row comes back, in order, as itself or as the pieces that stand for it."""
    target, machine = loaded.target, loaded.machine
    dialect: Any = machine.dialect
    program = target.write(path, machine)
    decoded = target.read(program.data, machine)
    listing = target.listing(program.data, machine)
    assert listing is not None
    assert len(listing.blocks) == len(program.row_of_block)
    came_from = program.row_of_block[decoded.block]
    assert (np.diff(came_from[came_from >= 0]) >= 0).all()
    unit = dialect.last_decimal_mm
    most_stray = 2.2 * unit
    if dialect.arcs.form == "radius":
        most_stray = 4.0 * unit
    small = dialect.arcs.min_radius_mm
    lined = machine.defaults.fit_tolerance_mm
    starts = decoded.starts
    for move in path:
        rows = np.flatnonzero(came_from == move.index)
        if move.kind > Kind.ARC_CCW:
            if move.kind == Kind.END and not dialect.program.end:
                continue
            assert [int(decoded.kind[row]) for row in rows] == [move.kind]
            if move.value is not None:
                assert decoded.value[rows[0]] == pytest.approx(move.value, abs=0.1)
            continue
        if not len(rows):  # smaller than the last decimal
            assert np.abs(np.subtract(move.end, move.start)).max() <= unit * 1.001
            continue
        assert np.abs(decoded.end[rows[-1]] - move.end).max() <= unit * 0.501
        if move.feed is not None:
            check_feed(move.feed, decoded, rows, loaded)
        stray = max(farthest_mm(move, decoded, int(row), starts[row]) for row in rows)
        allowed = most_stray
        if move.centre is not None and (
            dialect.arcs.form == "chords"
            or (not dialect.arcs.helices and move.end[2] != move.start[2])
        ):
            allowed += lined
        if move.centre is not None:
            radius = float(np.hypot(*np.subtract(move.start[:2], move.centre)))
            if radius < small / 0.9 or radius > dialect.arcs.max_radius_mm:
                allowed += unit
        assert stray <= allowed


def check_feed(feed: float, decoded: Toolpath, rows: np.ndarray, loaded: LoadedTarget) -> None:
    """The feed of rows is the wanted one, as far as F can say it."""
    dialect: Any = loaded.machine.dialect
    got = decoded.feed[rows]
    if dialect.feeds.mode == "per-minute":
        unit = dialect.unit
        step = loaded.machine.feed.unit_mm_min
        allowed: Any = step * unit.mm / 10.0**unit.more_decimals * (1.0 + 1e-6)
    elif dialect.feeds.mode == "per-revolution":
        allowed = 1200.0 * 25.4 * 10.0**-dialect.feeds.decimals
    else:  # F is the inverse of a time, the length in it that of the rounded move
        length = np.linalg.norm(decoded.end[rows] - decoded.starts[rows], axis=1)
        arms = np.linalg.norm(decoded.starts[rows, :2] - decoded.centre[rows], axis=1)
        length = np.maximum(length, np.nan_to_num(arms))
        part = 0.02 + 4.0 * dialect.last_decimal_mm / np.maximum(length, 1e-9)
        allowed = 100.0 * 25.4 * 10.0**-dialect.feeds.decimals + part * feed
    assert bool((np.abs(got - feed) <= allowed).all())


@st.composite
def spun(draw: st.DrawFn) -> Toolpath:
    """Random moves while the spindle turns, so that any mode of feeds can say them."""
    path = draw(toolpaths())
    head = ToolpathBuilder().event(Kind.SPINDLE_CW, 1200.0)
    for move in path:
        if move.kind == Kind.SPINDLE_OFF or (
            move.kind in (Kind.SPINDLE_CW, Kind.SPINDLE_CCW) and (move.value or 0.0) < 100.0
        ):
            continue
        if move.kind > Kind.ARC_CCW:
            head.event(move.kind, move.value)
        elif move.centre is not None:
            assert move.feed is not None
            x, y, z = move.end
            ccw = move.kind == Kind.ARC_CCW
            head.arc(x, y, z, centre=move.centre, ccw=ccw, feed=move.feed)
        elif move.feed is not None:
            head.line(*move.end, feed=move.feed)
        else:
            head.rapid(*move.end)
    return head.finish()


@examples(200, 10_000)
@given(dialect=tables(), path=spun())
def test_random_dialects_read_what_they_write(dialect: dict[str, Any], path: Toolpath) -> None:
    check_there_and_back(path, machine_with(dialect))
