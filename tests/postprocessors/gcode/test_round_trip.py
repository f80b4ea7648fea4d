"""read(write(t)) is t to the dialect's resolution, for grbl and linuxcnc."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program
from tests.oracles.gcode_paths import farthest_mm
from tests.postprocessors.gcode.parts import part, toolpaths
from tests.strategies import examples

TARGETS = ("grbl", "linuxcnc")
UNIT_MM = 0.001
HALF_UNIT_MM = UNIT_MM / 2.0 + 1e-9
MOST_STRAY_UNITS = 2.2
"""Ends and centre half a unit off along each axis: √2/2 at the centre moves the far side of an
arc by as much, twice (its radius follows the start), and the end by √2/2 once more."""


def there_and_back(path: Toolpath, name: str, *settings: str) -> tuple[Program, Toolpath]:
    target = load_target(name, settings=settings)
    program = target.target.write(path, target.machine)
    decoded: Toolpath = target.target.read(program.data, target.machine)
    return program, decoded


def columns(path: Toolpath) -> list[tuple[object, ...]]:
    """All that a row says, NaN as None, without provenance."""
    return [(move.kind, move.end, move.centre, move.feed, move.value) for move in path]


@pytest.mark.parametrize("name", TARGETS)
def test_every_kind_of_row_comes_back(name: str) -> None:
    wanted = part(tools=name == "linuxcnc")
    _, decoded = there_and_back(wanted, name)
    rows = [row for row in columns(wanted) if name == "linuxcnc" or row[0] != Kind.MESSAGE]
    assert [row[0] for row in columns(decoded)] == [row[0] for row in rows]
    for mine, theirs in zip(columns(decoded), rows, strict=True):
        np.testing.assert_allclose(mine[1], theirs[1], atol=1e-12)
        assert mine[3] == theirs[3]
        assert mine[4] == theirs[4] or mine[0] == Kind.MESSAGE
        if mine[2] is not None:
            np.testing.assert_allclose(mine[2], theirs[2], atol=1e-12)


def check_random(path: Toolpath, name: str, *options: str) -> None:
    """Each row comes back, in order, as itself or as the pieces that the findings tell of."""
    program, decoded = there_and_back(path, name, *options)
    came_from = program.row_of_block[decoded.block]
    assert (np.diff(came_from[came_from >= 0]) >= 0).all()
    starts = decoded.starts
    for move in path:
        rows = np.flatnonzero(came_from == move.index)
        if move.kind > Kind.ARC_CCW:
            assert [int(decoded.kind[row]) for row in rows] == [move.kind]
            assert move.value is None or decoded.value[rows[0]] == move.value
            continue
        if not len(rows):  # smaller than the last decimal
            assert np.abs(np.subtract(move.end, move.start)).max() <= UNIT_MM + 1e-9
            continue
        assert np.abs(decoded.end[rows[-1]] - move.end).max() <= HALF_UNIT_MM
        if move.feed is not None:
            assert (np.abs(decoded.feed[rows] - move.feed) < 0.1 * (1.0 + 1e-6)).all()
        stray = max(farthest_mm(move, decoded, int(row), starts[row]) for row in rows)
        assert stray <= MOST_STRAY_UNITS * UNIT_MM
    again, twice = there_and_back(decoded, name, *options)
    assert columns(twice) == columns(decoded)
    assert not {finding.code for finding in again.findings} & {ProgramCode.ARC_MENDED}


@pytest.mark.parametrize("name", TARGETS)
@examples(60, 10_000)
@given(path=toolpaths())
def test_random_paths_come_back(name: str, path: Toolpath) -> None:
    check_random(path, name)


@pytest.mark.parametrize(
    "option", ["dialect.strip_zeros=true", "dialect.block_numbers=true", "dialect.comments=none"]
)
@pytest.mark.parametrize("name", TARGETS)
@examples(30)
@given(path=toolpaths())
def test_options_change_the_text_and_not_the_path(name: str, option: str, path: Toolpath) -> None:
    plain, decoded = there_and_back(path, name)
    other, same = there_and_back(path, name, option)
    assert other.data != plain.data
    assert columns(same) == columns(decoded)


@examples(30)
@given(path=toolpaths())
def test_full_circles_as_halves_are_the_same_circles(path: Toolpath) -> None:
    _, whole = there_and_back(path, "grbl")
    _, halves = there_and_back(path, "grbl", "dialect.full_circles=halves")
    full = np.isclose(np.abs(whole.sweeps()), 2.0 * np.pi)
    assert len(halves) == len(whole) + int((full & whole.is_arc).sum())
    assert (np.abs(halves.sweeps()) < 6.21).all()


@given(st.integers(3, 6))
def test_decimals_are_those_asked_for(decimals: int) -> None:
    path = ToolpathBuilder().rapid(1.0 / 3.0, -2.0 / 3.0, 1.0).event(Kind.END).finish()
    _, decoded = there_and_back(path, "linuxcnc", f"dialect.decimals={decimals}")
    assert decoded.end[0].tolist() == [round(1 / 3, decimals), round(-2 / 3, decimals), 1.0]


def test_a_path_that_strays_is_seen() -> None:
    """The measure itself can fail: an arc against its chord."""
    arc = ToolpathBuilder().arc(2.0, 0.0, centre=(1.0, 0.0), ccw=True, feed=1.0).finish()
    line = ToolpathBuilder().line(2.0, 0.0, feed=1.0).finish()
    (move,) = arc
    assert farthest_mm(move, line, 0, line.starts[0]) == pytest.approx(1.0, abs=0.05)
