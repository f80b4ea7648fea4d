"""Toolpaths bent beforehand: the slides come out where it was wanted."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st

from camtool.geometry.polylines import Polyline
from camtool.machine.model import Machine
from camtool.planning.compensating import (
    MonotoneSegment,
    compensate,
    monotone_segments,
    motor_path,
)
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Move, Toolpath
from tests.oracles.path_machine import dense_path, path_machine
from tests.strategies import contours, open_contours
from tests.targets import simulate

FREE = "controller.grid=none"
DENSE = 200
"""Chords that stand for an arc in the oracle: of 10 mm and half a turn they miss 0.3 µm."""

FINE_MM = 0.5 * 0.004 + 0.0005 + 0.0003
"""How far off slides may be: a controller notices that an axis turns once it came back by half a
step, and adds its compensation then; arcs that became ellipses; the oracle's chords."""


def cut(path: Polyline, z: float = -0.1) -> Toolpath:
    """A rapid to the start, a plunge, the path, and up again."""
    b = ToolpathBuilder()
    vertices = np.concatenate([path.vertices, path.vertices[:1]]) if path.closed else path.vertices
    b.rapid(z=1.0).rapid(*vertices[0, :2].tolist()).line(z=z, feed=10.0)
    for (x0, y0, bulge), (x1, y1, _) in zip(
        vertices[:-1].tolist(), vertices[1:].tolist(), strict=True
    ):
        if bulge == 0.0:
            b.line(x1, y1, feed=20.0)
        else:
            share = (1.0 - bulge**2) / (4.0 * bulge)
            centre = 0.5 * (x0 + x1) - share * (y1 - y0), 0.5 * (y0 + y1) + share * (x1 - x0)
            b.arc(x1, y1, centre=centre, ccw=bulge > 0.0, feed=20.0)
    return b.rapid(z=1.0).event(Kind.END).finish()


def dense(toolpath: Toolpath, parts: int) -> np.ndarray:
    """(P, 3) points of all moves."""
    return np.array([toolpath.start, *(point for _, point in dense_path(toolpath, parts))])


def errors_mm(sent: Toolpath, wanted: Toolpath, machine: Machine) -> np.ndarray:
    """Distances of the slides to the wanted path, while they are below the stock top."""
    chunks = list(simulate(sent, machine))
    slide = np.concatenate([chunk.slide for chunk in chunks])
    low = slide[slide[:, 2] < -1e-6][::5, :2]
    line = dense(wanted, DENSE)[:, :2]
    pieces = shapely.STRtree(shapely.linestrings(np.stack([line[:-1], line[1:]], axis=1)))
    _, distance = pieces.query_nearest(
        shapely.points(low), return_distance=True, all_matches=False
    )
    return np.asarray(distance)


@st.composite
def machines(draw: st.DrawFn) -> Machine:
    """Machines of any play, with none, too little or nearly exact compensation."""
    settings = [FREE, f"controller.start_play={draw(st.sampled_from(['preloaded', 'centred']))}"]
    settings.append(f"controller.start_direction={draw(st.sampled_from('+-'))}")
    for axis in "xyz":
        play = draw(st.sampled_from([0.0, 0.03, 0.4]))
        real = draw(st.sampled_from([0.004, 0.00412, 0.00392]))
        most = math.floor(play / real) * 0.004
        settings += [
            f"axes.{axis}.coded_step_mm=0.004",
            f"axes.{axis}.backlash_mm={play}",
            f"axes.{axis}.compensation_mm={most * draw(st.sampled_from([0.0, 0.5, 1.0]))}",
            f"axes.{axis}.real_step_mm={real}",
        ]
    settings.append(f"mechanics.squareness_rad={draw(st.sampled_from([0.0, 0.01, -0.002]))}")
    return path_machine(*settings, "defaults.fit_tolerance_mm=0.0005")


@given(contours(max_points=6) | open_contours(), machines())
def test_nothing_is_left_of_play_and_scale(path: Polyline, machine: Machine) -> None:
    wanted = cut(path)
    assert errors_mm(compensate(wanted, machine).toolpath, wanted, machine).max() < FINE_MM


def test_without_it_the_same_part_is_off_by_the_play() -> None:
    machine = path_machine(FREE, "axes.x.backlash_mm=0.4", "axes.y.backlash_mm=0.4")
    wanted = cut(Polyline(np.array([[0, 0, 0], [5, 1, 0], [1, 6, 0]], dtype=float), True))
    assert errors_mm(wanted, wanted, machine).max() > 0.3
    assert errors_mm(compensate(wanted, machine).toolpath, wanted, machine).max() < FINE_MM


@example(
    Polyline(np.array([[6.1, 2.24, -0.037], [-1.37, 1.785, 0], [-0.5, -0.866, 0]]), True),
    0.1,
    "preloaded",
)
@given(
    contours(max_points=6), st.sampled_from([0.02, 0.1]), st.sampled_from(["preloaded", "centred"])
)
def test_of_too_much_compensation_half_is_left_at_reversals(
    path: Polyline, excess: float, start: str
) -> None:
    play = [f"axes.{axis}.backlash_mm=0.2" for axis in "xy"]
    set_to = [f"axes.{axis}.compensation_mm={0.2 + excess}" for axis in "xy"]
    step = [f"axes.{axis}.coded_step_mm=0.004" for axis in "xyz"]
    machine = path_machine(FREE, f"controller.start_play={start}", *step, *play, *set_to)
    wanted = cut(path)
    before = errors_mm(wanted, wanted, machine)
    after = errors_mm(compensate(wanted, machine).toolpath, wanted, machine)
    # Both axes may turn at the same place, and a step back is a whole step.
    assert after.max() <= 0.5 * math.sqrt(2.0) * excess + 0.009
    assert np.sqrt((after**2).mean()) < np.sqrt((before**2).mean())


def test_play_by_region() -> None:
    cells = "{x_mm = [-9, 0, 9], y_mm = [-9, 1, 9], play_mm = [[0.1, 0.2], [0.3, 0.05]]}"
    step = [f"axes.{axis}.coded_step_mm=0.001" for axis in "xyz"]
    maps = [f"play_map.{axis}={cells}" for axis in "xy"]
    machine = path_machine(FREE, *step, "play_map.use=true", *maps)
    points = [[-5, -4, 0.2], [6, -3, 0], [4, 5, -0.3], [-6, 3, 0.1]]
    wanted = cut(Polyline(np.array(points, dtype=float), True))
    before = errors_mm(wanted, wanted, machine)
    after = errors_mm(compensate(wanted, machine).toolpath, wanted, machine)
    assert before.max() > 0.2
    # Near an edge the play of the neighbour may be taken.
    assert np.quantile(after, 0.9) < FINE_MM
    assert after.max() < 0.25


def test_a_perfect_machine_gets_what_was_wanted() -> None:
    wanted = cut(Polyline(np.array([[0, 0, 0], [1, 0, 1.0], [1, 1, 0]], dtype=float), True))
    assert compensate(wanted, path_machine(FREE)).toolpath is wanted


def test_rows_keep_their_sources_feeds_and_events() -> None:
    b = ToolpathBuilder()
    b.message("mount tool 3").event(Kind.SPINDLE_CW, 1000.0)
    b.source = "layer 7"
    b.rapid(1.0, 1.0).line(z=-1.0, feed=5.0).line(2.0, 0.5, feed=7.0).event(Kind.DWELL, 0.5)
    machine = path_machine(FREE, "axes.x.backlash_mm=0.1", "axes.y.backlash_mm=0.1")
    bent = compensate(b.event(Kind.END).finish(), machine)
    made = bent.toolpath
    assert bent.row.tolist() == [0, 1, 2, 3, 4, 4, 5, 6]
    kinds = [Kind(kind).name for kind in made.kind.tolist()]
    assert kinds == ["MESSAGE", "SPINDLE_CW", "RAPID", "LINE", "LINE", "LINE", "DWELL", "END"]
    assert [move.source for move in made][2:6] == ["layer 7"] * 4
    assert [move.feed for move in made][3:6] == [5.0, 7.0, 7.0]
    assert made.texts[int(made.value[0])] == "mount tool 3"
    # Only Y turns back: it takes up its play alone, and X goes on.
    assert made.end[3:6, :2] == pytest.approx(np.array([[1, 1], [1, 0.9], [2, 0.4]]))


def test_scale_alike_in_both_axes_keeps_arcs() -> None:
    scale = [f"axes.{axis}.real_step_mm=0.00404" for axis in "xy"]
    step = [f"axes.{axis}.coded_step_mm=0.004" for axis in "xyz"]
    wanted = cut(Polyline(np.array([[1, 0, 1.0], [-1, 0, 1.0]], dtype=float), True))
    made = motor_path(wanted, path_machine(FREE, *step, *scale)).toolpath
    assert made.is_arc.sum() == 2
    assert made.end[:, :2] == pytest.approx(wanted.end[:, :2] / 1.01)


def test_unequal_scale_makes_ellipses() -> None:
    step = [f"axes.{axis}.coded_step_mm=0.004" for axis in "xyz"]
    machine = path_machine(FREE, *step, "axes.x.real_step_mm=0.0042")
    wanted = cut(Polyline(np.array([[1, 0, 1.0], [-1, 0, 1.0]], dtype=float), True))
    made = motor_path(wanted, machine).toolpath
    assert made.is_arc.sum() > 4
    points = dense(made, 100)
    spoke = points[np.abs(points[:, 2] + 0.1) < 1e-9, :2] * [1.05, 1.0]
    radius = np.hypot(spoke[:, 0], spoke[:, 1])
    tolerance = machine.defaults.fit_tolerance_mm
    assert np.abs(radius - 1.0).max() < 1.1 * tolerance


def arc(start_rad: float, sweep_rad: float, radius: float = 2.0) -> Move:
    spoke = radius * np.array([math.cos(start_rad), math.sin(start_rad)])
    angle = start_rad + sweep_rad
    to = radius * np.array([math.cos(angle), math.sin(angle)])
    b = ToolpathBuilder((spoke[0], spoke[1], 0.0))
    b.arc(to[0], to[1], -1.0, centre=(0.0, 0.0), ccw=sweep_rad > 0.0, feed=1.0)
    return next(iter(b.finish()))


@given(st.floats(-7.0, 7.0), st.floats(0.01, 6.2), st.booleans())
def test_stretches_of_an_arc_turn_no_axis_and_meet(start: float, sweep: float, ccw: bool) -> None:
    signed = sweep if ccw else -sweep
    move = arc(start, signed)
    parts = list(monotone_segments(move, signed))
    assert parts[0].begin == move.start
    assert parts[-1].end == move.end
    assert sum(part.sweep_rad for part in parts) == pytest.approx(signed)
    for one, after in pairwise(parts):
        assert one.end == after.begin
    for part in parts:
        points = np.array([part.at(share) for share in np.linspace(0.0, 1.0, 20)])
        for axis in (0, 1):
            ways = np.diff(points[:, axis])
            assert (ways > -1e-9).all() or (ways < 1e-9).all()


@given(st.floats(0.05, 1.5), st.floats(0.0, 1.0), st.booleans())
def test_where_a_stretch_has_a_value(sweep: float, share: float, straight: bool) -> None:
    whole = next(monotone_segments(arc(0.01, sweep), sweep))
    part = MonotoneSegment(whole.begin, whole.end) if straight else whole
    for axis in (0, 1, 2):
        value = part.at(share)[axis]
        if abs(part.end[axis] - part.begin[axis]) > 1e-6:
            assert part.at(part.share_at(axis, value))[axis] == pytest.approx(value, abs=1e-12)
