"""Arcs whose rounded numbers break the controller's rule: re-centred, split, or lines."""

import math

import numpy as np
import pytest
from camtool_postprocessors.gcode.arcs import arcs_accepted, arcs_of
from camtool_postprocessors.grbl.dialect import GrblDialect
from hypothesis import given
from hypothesis import strategies as st

from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.gcode_paths import farthest_mm


def dialect(*settings: str) -> GrblDialect:
    options: GrblDialect = load_target("grbl", settings=settings).machine.dialect
    return options


def coarse(decimals: int) -> GrblDialect:
    """A dialect of fewer decimals than a machine file may say: there the rule is often broken."""

    return replace(dialect(), decimals=decimals)


def one_arc(
    radius: float, first: float, sweep: float, at: tuple[float, float] = (0.0, 0.0)
) -> Toolpath:
    """A rapid to the start of an arc, and the arc (CCW for a positive sweep)."""
    start, end = (
        (at[0] + radius * math.cos(angle), at[1] + radius * math.sin(angle))
        for angle in (first, first + sweep)
    )
    path = ToolpathBuilder().rapid(*start)
    return path.arc(*end, centre=at, ccw=sweep > 0.0, feed=100.0).finish()


def rule(out: np.ndarray, back: np.ndarray, unit: float, options: GrblDialect) -> bool:
    """grbl's own rule, once more."""
    r1, r2 = math.hypot(*out) * unit, math.hypot(*back) * unit
    gap = abs(r1 - r2)
    return gap <= options.arc_difference_mm or (
        gap <= options.arc_most_difference_mm and gap <= options.arc_difference_part * r1
    )


@given(
    st.floats(0.2, 50.0),
    st.floats(0.0, 2.0 * math.pi),
    st.floats(0.1, 6.2),
    st.booleans(),
    st.integers(1, 3),
)
def test_every_arc_passes_the_rule_and_stays_in_place(
    radius: float, first: float, sweep: float, ccw: bool, decimals: int
) -> None:
    options = coarse(decimals)
    unit = 10.0**-decimals
    path = one_arc(radius, first, sweep if ccw else -sweep, at=(3.21, -1.234))
    arcs = arcs_of(path, options)
    pieces = arcs.pieces.get(1)
    at = arcs.end[0, :2]
    rows = (
        [(int(arcs.kind[1]), arcs.end[1, :2], arcs.offset[1])]
        if pieces is None
        else [(piece.kind, np.array(piece.end), np.array(piece.offset)) for piece in pieces]
    )
    move = list(path)[1]
    for kind, end, offset in rows:
        builder = ToolpathBuilder((*(at * unit).tolist(), 0.0))
        if kind == Kind.LINE:
            builder.line(*(end * unit).tolist(), feed=1.0)
        else:
            assert rule(offset, end - at - offset, unit, options)
            centre = ((at + offset) * unit).tolist()
            builder.arc(
                *(end * unit).tolist(), centre=tuple(centre), ccw=kind == Kind.ARC_CCW, feed=1.0
            )
        one = builder.finish()
        assert farthest_mm(move, one, 0, one.starts[0]) <= 3.0 * unit + options.arc_difference_mm
        at = end
    if rows:
        assert at.tolist() == arcs.end[1, :2].tolist()


def test_coarse_numbers_use_all_three_mends() -> None:
    """Otherwise the test above would prove nothing."""
    rng = np.random.default_rng(5)
    used = {"recentred": 0, "split": 0, "lines": 0, "plain": 0}
    for _ in range(400):
        path = one_arc(*rng.uniform([0.2, 0.0, 0.1], [10.0, 6.0, 6.0]), at=(1.23, 4.56))
        counts = arcs_of(path, coarse(1)).counts
        for name in ("recentred", "split", "lines"):
            used[name] += getattr(counts, name)
        used["plain"] += counts.first < 0
    assert min(used.values()) > 0


@pytest.mark.parametrize(
    ("radius", "sweep", "is_line"),
    [(100.0, 0.005, True), (100.0, 0.007, False), (0.0004, 6.0, True), (1.0, 0.05, True)],
)
def test_arcs_flatter_than_half_a_unit_are_lines(
    radius: float, sweep: float, is_line: bool
) -> None:
    arcs = arcs_of(one_arc(radius, 0.0, sweep), dialect())
    assert (arcs.kind[1] == Kind.LINE) == is_line
    assert arcs.counts.flat == is_line


def test_absurd_radii_become_lines() -> None:
    radius = 100_000.0
    sweep = 2.0 * math.asin(50.0 / radius)
    first = math.pi / 2.0 - sweep / 2.0
    path = one_arc(radius, first, sweep, at=(0.0, -radius))
    target = load_target("grbl")
    program = target.target.write(path, target.machine)
    decoded = target.target.read(program.data, target.machine)
    assert b"I" not in program.data.replace(b"IN", b"").split(b"G54")[1]
    (finding,) = [note for note in program.findings if note.code == ProgramCode.ARC_MENDED]
    assert "1 written as lines" in finding.message
    move = list(path)[1]
    rows = np.flatnonzero(decoded.kind == Kind.LINE)
    stray = max(farthest_mm(move, decoded, int(row), decoded.starts[row]) for row in rows)
    assert 2 <= len(rows) <= 12
    assert stray < 0.002


def test_a_crooked_arc_is_mended_and_told() -> None:
    """Radii that differ by 7 µm: grbl would stop with its error 33."""
    path = ToolpathBuilder().rapid(1.0, 0.0).arc(-1.007, 0.0, centre=(0.0, 0.0), ccw=True, feed=9)
    target = load_target("grbl")
    program = target.target.write(path.finish(), target.machine)
    assert any(note.code == ProgramCode.ARC_MENDED for note in program.findings)
    decoded = target.target.read(program.data, target.machine)
    assert decoded.end[-2].tolist() == [-1.007, 0.0, 0.0]
    assert decoded.is_arc.any()


@pytest.mark.parametrize("sweep", [1e-4, 2.0 * math.pi - 1e-4])
def test_short_arcs_do_not_become_circles_nor_circles_nothing(sweep: float) -> None:
    """Start and end round to one place: nothing is left of the one, the other is full."""
    path = one_arc(2.0, 0.3, sweep)
    arcs = arcs_of(path, dialect())
    assert arcs.end[0].tolist() == arcs.end[1].tolist()
    if sweep < 1.0:
        assert arcs.kind[1] == Kind.LINE  # which moves nothing and is left out
    else:
        assert 1 not in arcs.pieces
        assert arcs.kind[1] == Kind.ARC_CCW


def test_a_turn_that_the_controller_takes_for_a_circle_does_not_hold() -> None:
    options = dialect()
    start, centre = np.array([[2_000_000, 0]]), np.array([[0, 0]])
    kinds = np.array([Kind.ARC_CCW])
    for units, holds in ((1, False), (10, True)):
        end = np.array([[2_000_000, units]])
        sweep = np.array([units / 2_000_000])
        assert arcs_accepted(sweep, (start, end, centre), kinds, options)[0] == holds


def test_linuxcnc_gets_no_arc_of_a_radius_that_it_calls_zero() -> None:
    target = load_target("linuxcnc")
    for radius in (0.0006, 0.001, 0.0012, 0.002):
        path = one_arc(radius, 0.0, 2.0 * math.pi, at=(1.0, 1.0))
        full = ToolpathBuilder().rapid(*path.end[0, :2].tolist())
        full.arc(*path.end[0, :2].tolist(), centre=(1.0, 1.0), ccw=True, feed=9.0)
        program = target.target.write(full.finish(), target.machine)
        target.target.read(program.data, target.machine)
