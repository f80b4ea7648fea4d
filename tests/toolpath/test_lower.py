"""What a dialect cannot say, said by what it can: against literal twins."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError, PostError
from camtool.toolpath import lower
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.lower import (
    LoweredToolpath,
    arcs_to_lines,
    arcs_within,
    helices_to_steps,
    slope_step_mm,
    xy_then_z,
)
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles import lowering
from tests.oracles.dense_moves import pic_mmh
from tests.strategies import coordinates

CLOSE_MM = 1e-9
"""Two ways round the same trigonometry."""

heights = st.sampled_from([0.0, -0.5, 1.0, 2.0, 1e-310])


@st.composite
def toolpaths(draw: st.DrawFn) -> Toolpath:
    """Rapids, lines, arcs (full ones, helices, slight spirals) and events."""
    b = ToolpathBuilder(draw(st.sampled_from([(0.0, 0.0, 0.0), (1.0, -2.0, 3.0)])))
    for number in range(draw(st.integers(0, 8))):
        b.block = number
        b.source = draw(st.sampled_from(["", "CUT/LINE 1", "CUT/ARC 2"]))
        kind = draw(st.sampled_from(["rapid", "line", "arc", "full", "dwell"]))
        feed = draw(st.sampled_from([1.0, 20.0]))
        if kind == "dwell":
            b.event(Kind.DWELL, 0.5)
        elif kind == "rapid":
            b.rapid(draw(coordinates(5)), draw(coordinates(5)), draw(heights))
        elif kind == "line":
            stay = draw(st.booleans())
            b.line(None if stay else draw(coordinates(5)), z=draw(heights), feed=feed)
        else:
            _add_arc(draw, b, feed, full=kind == "full")
    return b.finish()


def _add_arc(draw: st.DrawFn, b: ToolpathBuilder, feed: float, *, full: bool) -> None:
    x, y, _ = b.position
    radius, turn = draw(st.floats(0.01, 10.0)), draw(st.floats(0.0, 6.28))
    centre = (x + radius * math.cos(turn), y + radius * math.sin(turn))
    far = turn + math.pi + draw(st.floats(-6.2, 6.2).filter(lambda sweep: abs(sweep) > 1e-3))
    spiral = radius * draw(st.sampled_from([1.0, 1.0, 1.001]))
    end = (centre[0] + spiral * math.cos(far), centre[1] + spiral * math.sin(far))
    to = (x, y) if full else end
    b.arc(*to, draw(st.none() | heights), centre=centre, ccw=draw(st.booleans()), feed=feed)


def agrees(lowered: LoweredToolpath, given_: Toolpath, wanted: list[lowering.Piece]) -> None:
    """The rows of the twin, with all that goes on from the given rows."""
    made = lowered.toolpath
    assert [Kind(k) for k in made.kind] == [piece.kind for piece in wanted]
    assert lowered.row.dtype == np.int64
    assert lowered.row.tolist() == [piece.row for piece in wanted]
    for move, piece in zip(made, wanted, strict=True):
        assert move.end == pytest.approx(piece.end, abs=CLOSE_MM)
        assert move.centre == piece.centre
    keeps(lowered, given_)


def keeps(lowered: LoweredToolpath, given_: Toolpath) -> None:
    """Ends exact, rows ascending and all there, columns and records as they were."""
    made, row = lowered.toolpath, lowered.row
    last = np.flatnonzero(np.diff(row, append=len(given_)))
    assert row[last].tolist() == list(range(len(given_)))
    assert (np.diff(row) >= 0).all()
    assert np.array_equal(made.end[last], given_.end)
    for name in ("feed", "value", "source", "block"):
        column = getattr(given_, name)[row]
        assert np.array_equal(getattr(made, name), column, equal_nan=True)
    assert np.array_equal(made.start, given_.start)
    assert (made.texts, made.findings) == (given_.texts, given_.findings)


@given(toolpaths())
def test_xy_then_z_is_its_twin(toolpath: Toolpath) -> None:
    lowered = xy_then_z(toolpath)
    agrees(lowered, toolpath, lowering.xy_then_z(toolpath))
    made = lowered.toolpath
    begin = made.starts
    in_xy = made.is_arc | (made.end[:, :2] != begin[:, :2]).any(axis=1)
    assert not (in_xy & (made.end[:, 2] != begin[:, 2])).any()
    assert np.array_equal(xy_then_z(made).toolpath.end, made.end)


@given(toolpaths(), st.sampled_from([0.1, 0.3, 0.5, 7.0]))
def test_steps_of_slopes_are_their_twins(toolpath: Toolpath, step: float) -> None:
    lowered = helices_to_steps(toolpath, step)
    agrees(lowered, toolpath, lowering.helices_to_steps(toolpath, step))
    assert np.array_equal(xy_then_z(lowered.toolpath).row, np.arange(len(lowered.row)))


@given(toolpaths(), st.sampled_from([0.1, 0.3, 0.5, 7.0]))
def test_steps_are_never_below_the_slope_and_little_above(toolpath: Toolpath, step: float) -> None:
    lowered = helices_to_steps(toolpath, step)
    given_, made = list(toolpath), list(lowered.toolpath)
    for row in np.flatnonzero(toolpath.is_feed).tolist():
        wanted = given_[row]
        pieces = [made[index] for index in np.flatnonzero(lowered.row == row)]
        flat = [piece for piece in pieces if piece.centre or piece.start[:2] != piece.end[:2]]
        for number, piece in enumerate(flat):
            assert piece.start[2] == piece.end[2]
            for share in (
                number / len(flat),
                (number + 0.5) / len(flat),
                (number + 1) / len(flat),
            ):
                true = wanted.start[2] + share * (wanted.end[2] - wanted.start[2])
                assert -1e-9 <= piece.end[2] - true <= step + 1e-9


def test_a_slope_of_whole_steps_has_so_many() -> None:
    ramp = ToolpathBuilder().line(3.0, z=-0.3, feed=1).finish()
    assert len(helices_to_steps(ramp, 0.1).toolpath) == 6
    assert len(helices_to_steps(ramp, 0.099).toolpath) == 8


def test_the_step_of_a_machine_is_its_tolerance_or_a_step_of_z() -> None:
    assert slope_step_mm(pic_mmh()) == 0.0005
    assert slope_step_mm(pic_mmh("axes.z.coded_step_mm=0.04")) == 0.04


@given(toolpaths(), st.sampled_from([1e-4, 0.003, 0.1, 30.0]), st.data())
def test_chords_are_their_twins_and_within_the_tolerance(
    toolpath: Toolpath, tolerance_mm: float, data: st.DataObject
) -> None:
    rows = np.array([data.draw(st.booleans()) for _ in range(len(toolpath))], dtype=np.bool_)
    lowered = arcs_to_lines(toolpath, rows, tolerance_mm)
    chosen = np.flatnonzero(toolpath.is_arc & rows)
    count = np.bincount(lowered.row, minlength=len(toolpath))
    parts = {int(row): int(count[row]) for row in chosen}
    agrees(lowered, toolpath, lowering.split(toolpath, parts, lines=True))
    moves = list(toolpath)
    for row, n in parts.items():
        _chords_are_few_and_near(moves[row], n, tolerance_mm)
    assert (count[np.setdiff1d(np.arange(len(toolpath)), chosen)] == 1).all()


def _chords_are_few_and_near(move, n: int, tolerance_mm: float) -> None:
    radius = math.dist(move.start[:2], move.centre)
    radius = max(radius, math.dist(move.end[:2], move.centre))
    sweep = abs(lowering.sweep_of(move))

    def sagitta(count: int) -> float:
        return radius * (1.0 - math.cos(0.5 * sweep / count))

    assert sagitta(n) <= tolerance_mm * (1.0 + 1e-6) + 1e-13
    assert sweep / n <= lower.MAX_CHORD_SWEEP_RAD + 1e-12
    if n > 1:  # one chord fewer would stray too far, or be too wide
        fewer = n - 1
        too_far = sagitta(fewer) > tolerance_mm * (1.0 - 1e-6) - 1e-13
        assert too_far or sweep / fewer > lower.MAX_CHORD_SWEEP_RAD - 1e-12


def test_no_point_of_the_arc_is_farther_from_the_chords_than_the_tolerance() -> None:
    arc = ToolpathBuilder((1.0, 0.0, 0.0)).arc(0, 1, centre=(0, 0), ccw=False, feed=1).finish()
    chords = arcs_to_lines(arc, arc.is_arc, 0.01).toolpath
    points = np.concatenate([arc.start[None, :2], chords.end[:, :2]])
    share = np.linspace(0, 1, 500)[:, None]
    cloud = np.concatenate([a + (b - a) * share for a, b in pairwise(points)])
    sagitta = 1.0 - np.hypot(cloud[:, 0], cloud[:, 1])
    assert 0.005 < sagitta.max() <= 0.01 + 1e-12
    assert sagitta.min() > -1e-12


@given(toolpaths(), st.sampled_from([0.1, 0.5 * math.pi, math.pi, 6.0, 7.0]))
def test_arcs_within_a_sweep_are_their_twins(toolpath: Toolpath, most: float) -> None:
    parts = {
        move.index: max(1, math.ceil((abs(lowering.sweep_of(move)) - 1e-9) / most))
        for move in toolpath
        if move.centre
    }
    lowered = arcs_within(toolpath, most)
    agrees(lowered, toolpath, lowering.split(toolpath, parts))
    spiral_rounding = 1e-6  # parts of tiny arcs are read back from rounded points
    assert (np.abs(lowered.toolpath.sweeps()) <= most + spiral_rounding).all()
    total = np.bincount(lowered.row, lowered.toolpath.sweeps(), minlength=len(toolpath))
    assert total == pytest.approx(toolpath.sweeps(), abs=1e-5)


def test_quarters_stay_quarters() -> None:
    b = ToolpathBuilder((1.3, 0.0, 0.0))
    for x, y in ((0.0, 1.3), (-1.3, 0.0), (0.0, -1.3), (1.3, 0.0)):
        b.arc(x, y, centre=(0, 0), ccw=True, feed=1)
    assert len(arcs_within(b.finish(), 0.5 * math.pi).toolpath) == 4


@given(toolpaths())
def test_one_after_the_other_names_the_first_rows(toolpath: Toolpath) -> None:
    first = xy_then_z(toolpath)
    second = arcs_to_lines(first.toolpath, first.toolpath.is_arc, 0.1)
    both = second.after(first)
    assert both.toolpath is second.toolpath
    keeps(both, toolpath)


def empty() -> Toolpath:
    return ToolpathBuilder().finish()


@pytest.mark.parametrize(
    "run",
    [
        xy_then_z,
        lambda t: helices_to_steps(t, 1.0),
        lambda t: arcs_within(t, 1.0),
        lambda t: arcs_to_lines(t, t.is_arc, 0.1),
    ],
)
def test_nothing_stays_nothing(run: Callable[[Toolpath], LoweredToolpath]) -> None:
    assert (len(run(empty()).toolpath), len(run(empty()).row)) == (0, 0)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_bad_tolerances_and_sweeps(bad: float) -> None:
    with pytest.raises(OptionError, match="tolerance"):
        arcs_to_lines(empty(), np.zeros(0, dtype=np.bool_), bad)
    with pytest.raises(OptionError, match="sweep"):
        arcs_within(empty(), bad)
    with pytest.raises(OptionError, match="step"):
        helices_to_steps(empty(), bad)


def test_an_arc_without_a_centre_is_named() -> None:
    b = ToolpathBuilder().line(1, feed=1).arc(2, 0, centre=(math.nan, 0), ccw=True, feed=1)
    with pytest.raises(PostError, match="move 1: an arc without a centre"):
        arcs_within(b.finish(), 1.0)


def test_far_too_many_chords_are_refused_before_they_are_made() -> None:
    arc = ToolpathBuilder((1e6, 0, 0)).arc(1e6, 0, centre=(0, 0), ccw=True, feed=1).finish()
    with pytest.raises(PostError, match="wider tolerance"):
        arcs_to_lines(arc, arc.is_arc, 1e-9)
    slope = ToolpathBuilder().line(1, z=-1e3, feed=1).finish()
    with pytest.raises(PostError, match=r"move 0: .* larger step"):
        helices_to_steps(slope, 1e-6)


def test_an_arc_about_its_own_start_is_cut_without_noise() -> None:
    b = ToolpathBuilder().arc(0, 0, centre=(0, 0), ccw=True, feed=1)
    assert (arcs_to_lines(b.finish(), np.ones(1, np.bool_), 0.1).toolpath.end == 0.0).all()
