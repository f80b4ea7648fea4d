"""Where the tool comes from, so that no play is left when a cut begins."""

from __future__ import annotations

import numpy as np
import pytest
from camtool_postprocessors.pic_mmh.dialect import PicMmhController
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.polylines import Polyline
from camtool.machine.model import Machine, PathController, PlayCells, PlayMap
from camtool.planning.items import CutRun
from camtool.planning.reversing import APPROACH_MARGIN_MM, Approaches, approach_mm, residuals
from camtool.records import replace
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import ALL
from camtool.verification.cuts import cut_moves
from tests.paths import scaled
from tests.planning.reversal_parts import reversals_of, run_of, square, toolpath, with_play
from tests.strategies import contours, examples, open_contours
from tests.targets import simulate


def line(*points: tuple[float, float]) -> CutRun:
    return run_of(Polyline(np.array([(x, y, 0.0) for x, y in points])))


MARGIN = APPROACH_MARGIN_MM


@pytest.mark.parametrize(
    ("run", "from_x", "from_y", "why"),
    [
        (line((1, 2), (3, 4)), -MARGIN, -MARGIN, "both axes towards +"),
        (line((1, 2), (0, 4)), MARGIN, -MARGIN, "X towards −"),
        (line((1, 2), (0, 0)), MARGIN, MARGIN, "both towards −"),
        (line((1, 2), (1, 0)), -MARGIN, MARGIN, "X stands still: from its better side"),
        (line((1, 2), (1, 0), (0, 0)), MARGIN, MARGIN, "X moves later, towards −"),
        (line((1, 2), (2, 0), (0, 0)), -MARGIN, MARGIN, "X moves towards + first"),
        (run_of(Polyline(np.array([[1, 2, 1.0], [1, 4, 0]]))), -MARGIN, -MARGIN, "an arc"),
    ],
)
def test_both_axes_come_as_they_go_on(
    machine: Machine, run: CutRun, from_x: float, from_y: float, why: str
) -> None:
    assert Approaches(machine)(run) == pytest.approx((1 + from_x, 2 + from_y)), why


def test_a_hole_is_always_reached_from_one_side(machine: Machine) -> None:
    hole = CutRun(np.array([[1, 2, -1.0, 0], [1, 2, 0.5, 0]]), np.array([5.0]), 5.0, "hole")
    assert Approaches(machine)(hole) == pytest.approx((1 - MARGIN, 2 - MARGIN))


def test_the_way_is_what_compensation_leaves_of_the_play(machine: Machine) -> None:
    bare = with_play(machine, backlash_mm=0.3, compensation_mm=0.1)
    assert approach_mm(bare.axes.x) == pytest.approx(0.2 + MARGIN)
    one = with_play(machine, backlash_mm=0.3, compensation_mm=0.0, y_backlash_mm=0.0)
    assert Approaches(one)(line((1, 2), (3, 4))) == pytest.approx((1 - 0.3 - MARGIN, 2))
    none = with_play(machine, backlash_mm=0.0, compensation_mm=0.0)
    assert Approaches(none)(line((1, 2), (3, 4))) is None


def test_of_a_map_of_play_the_regions_that_are_worst_count(machine: Machine) -> None:
    """Compensation of X, 0.15 mm, leaves 0.13 too much in one region and 0.05 too little in
    another: the first is told, the second needs the longer approach."""
    cells = PlayCells((0.0, 10.0, 20.0), (0.0, 20.0), ((0.02, 0.2),))
    known = with_play(machine, backlash_mm=0.15, compensation_mm=0.15)
    mapped = replace(known, play_map=PlayMap(use=True, x=cells))
    x, y = residuals(mapped)
    assert abs(x.plus_mm - x.minus_mm) == pytest.approx(0.13)
    assert abs(y.plus_mm - y.minus_mm) == pytest.approx(0.0)
    come = Approaches(mapped)(line((1, 2), (3, 4)))
    assert come == pytest.approx((1 - MARGIN - 0.05, 2 - MARGIN))


def test_an_engaged_axis_comes_straight(machine: Machine) -> None:
    come = Approaches(machine)
    assert come(line((0, 0), (1, 1))) == pytest.approx((-MARGIN, -MARGIN))
    assert come(line((1, 1), (2, 2))) is None  # both go on
    assert come(line((2, 2), (3, 1))) == pytest.approx((2, 2 + MARGIN))  # Y turns
    assert come(line((2.9, 0.5), (3, 0))) == pytest.approx((2.9 - MARGIN, 0.5))  # X was beyond
    assert come(line((3.01, 0), (3.02, -1))) is None
    # From farther than the play on both axes: the way there takes it up.
    assert come(line((4, -2), (5, -3))) is None
    assert come(line((2, 2), (1, 3))) is None
    # X has come back by less than its play.
    assert come(line((1 + 0.5 * MARGIN, 3), (2, 4))) == pytest.approx((1 - 0.5 * MARGIN, 3))


@examples(40)
@given(st.lists(st.one_of(contours(max_points=6), open_contours(max_points=6)), max_size=5))
def test_the_first_motion_of_a_cut_is_no_reversal(machine: Machine, paths: list[Polyline]) -> None:
    follower = replace(machine, controller=PathController(grid="none"))
    paths = [scaled(path, 0.05) for path in paths]
    moves = toolpath(paths, follower, approach=True)
    cuts = cut_moves(moves, flat_cuts=False).is_cut
    counted = np.zeros(2, dtype=np.int64)
    for chunk in simulate(moves, follower):
        counted += chunk.ledger.reversals[cuts[chunk.ledger.row], :2].sum(axis=0)
    wanted = [reversals_of(run_of(path), follower) for path in paths]
    assert counted.tolist() == np.array(wanted).reshape(-1, 2).sum(axis=0).tolist()


@given(contours(max_points=6))
def test_a_slide_stands_engaged_from_the_first_cut_on(machine: Machine, path: Polyline) -> None:
    # Whole steps of compensation: 0.14 mm are 1000.
    loose = with_play(machine, backlash_mm=0.3, compensation_mm=0.14)
    follower = replace(loose, controller=PathController(grid="none"))
    path = scaled(path, 0.05)
    x, y = path.vertices[0, :2].tolist()
    # Short enough to drive each axis one way only.
    path = Polyline(np.array([[x, y, 0.0], [*(0.5 * (path.vertices[1, :2] + (x, y))), 0.0]]))
    moves = toolpath([square(), path], follower, approach=True)
    last = int(np.flatnonzero(cut_moves(moves, flat_cuts=False).is_cut)[-1])
    lag = np.concatenate(
        [
            (chunk.slide - chunk.commanded)[chunk.row == last, :2]
            for chunk in simulate(moves, follower)
        ]
    )
    way = np.sign(path.end - path.start)
    for axis, residual in enumerate(residuals(follower)):
        error = residual.error_mm(int(way[axis]) or residual.better)
        assert lag[:, axis] == pytest.approx(error, abs=1e-9)


@pytest.mark.parametrize("play", ["preloaded", "centred"])
@pytest.mark.parametrize("direction", ["+", "-"])
@pytest.mark.parametrize("compensation_steps", [0, 150, 250])
def test_residual_errors_are_those_of_the_play_operator(
    machine: Machine, play: str, direction: str, compensation_steps: int
) -> None:
    step = 0.001
    axis = replace(
        machine.axes.x,
        coded_step_mm=step,
        real_step_mm=step,
        backlash_mm=0.2,
        compensation_mm=compensation_steps * step,
    )
    controller = PicMmhController(start_play=play, start_direction=direction)  # type: ignore[arg-type]
    changed = replace(machine, axes=replace(machine.axes, x=axis), controller=controller)
    residual = residuals(changed)[0]
    first = 1 if direction == "+" else -1
    way = np.concatenate([np.arange(2000), np.arange(2000, -2000, -1), np.arange(-2000, 0)])
    commanded = np.column_stack([way * step, np.zeros((len(way), 2))])
    mechanics = Mechanics(changed, np.zeros(3), ALL)
    slide, _ = mechanics.follow(commanded, np.array([0, len(way)]))
    error = (slide - commanded)[:, 0]
    assert error[1900] == pytest.approx(residual.plus_mm, abs=1e-12) or first < 0
    assert error[5900] == pytest.approx(residual.minus_mm, abs=1e-12)
    assert error[-1] == pytest.approx(residual.plus_mm, abs=1e-12)
    smaller = min(abs(residual.plus_mm), abs(residual.minus_mm))
    assert abs(residual.error_mm(residual.better)) == pytest.approx(smaller)
    assert residual.matters
