"""Proofs of gouges and leftovers: bounds against dense points, planted faults of each kind against
needles, and the samples."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.api import read_job
from camtool.arrays import Floats
from camtool.geometry.boxes import IndexedCurves
from camtool.geometry.polylines import Segments
from camtool.importers.read import read_drawing
from camtool.kernels.offsets import (
    APART,
    MORE,
    SLOPE_X,
    chord_distances,
    disc_tangents,
    nearest_distances,
)
from camtool.pipeline import post_drawing
from camtool.planning.job import Job, Operation, Stock, Tool
from camtool.planning.plan import Plan, planned
from camtool.records import replace
from camtool.stock.cut import CutStock, cut_box
from camtool.stock.heights import Bracket, stock_tree
from camtool.stock.moves import StockMoves, stock_moves_of_toolpath
from camtool.stock.proofs import proved_gouge, proved_leftover
from camtool.stock.slides import tools_of_rows
from camtool.stock.wanted import WantedSolid, wanted_solid
from camtool.target.registry import load_target
from camtool.toolpath.moves import Toolpath
from camtool.verification.report import Gates
from tests.drawings import drawing_of
from tests.oracles.contours import closed
from tests.oracles.stock_jobs import circle, random_job
from tests.planning.test_stock import operation_of
from tests.strategies import examples

SAMPLES = Path(__file__).parents[2] / "samples"
MILL, BALL = Tool(4.0), Tool(4.0, "ball")
BULL, BIT = Tool(4.0, "bull", corner_radius_mm=1.0), Tool(6.0, "v", math.radians(60.0))
SQUARE = closed((0, 0), (30, 0), (30, 20), (0, 20))
STOCK = Stock(6.0, (-10.0, -10.0), (50.0, 40.0))
BESIDE_MM = 1e-3


@pytest.mark.checked
@examples(60)
@given(seed=st.integers(0, 100_000))
def test_linear_bounds_hold_the_distances(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 7))
    start = rng.uniform(-5.0, 5.0, (count, 2))
    end = start + rng.normal(0.0, 2.0, (count, 2))
    if rng.random() < 0.5:
        start[1:] = end[:-1]
    bulge = np.where(rng.random(count) < 0.5, 0.0, rng.uniform(-1.0, 1.0, count))
    curves = IndexedCurves.of(Segments.between(start, end, bulge))

    def distances(points: Floats) -> Floats:
        flat = np.ascontiguousarray(points.reshape(-1, 2))
        return nearest_distances(flat, curves.rows, curves.tree).reshape(points.shape[:-1])

    middle = rng.uniform(-5.0, 5.0, (40, 2))
    half = rng.normal(0.0, 1.0, (40, 2)) * 10.0 ** rng.uniform(-2.0, 0.5, (40, 1))
    share = np.linspace(0.0, 1.0, 41)
    away = distances(middle[:, None] + (2.0 * share - 1.0)[:, None] * half[:, None])
    bounds = chord_distances(middle, half, curves.rows, curves.tree)
    least, most = (bounds[:, [k]] + (bounds[:, [k + 1]] - bounds[:, [k]]) * share for k in (0, 2))
    assert (least <= away + 1e-9).all()
    assert (most >= away - 1e-9).all()

    reach = np.hypot(half[:, 0], half[:, 1])
    turn, part = rng.uniform(0.0, math.tau, (40, 60)), np.sqrt(rng.random((40, 60)))
    off = (reach[:, None] * part)[..., None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    away = distances(middle[:, None] + off)
    tangents = disc_tangents(middle, reach, curves.rows, curves.tree)
    for k in range(2):
        one = tangents[:, k]
        linear = one[:, [APART]] + (off * one[:, None, SLOPE_X : SLOPE_X + 2]).sum(axis=-1)
        clear = np.isfinite(one[:, APART]) & (one[:, APART] >= reach)
        assert (away[clear] <= (linear + one[:, [MORE]])[clear] + 1e-9).all()


def plan_of(*operations: Operation, paths: tuple[object, ...] = (SQUARE,)) -> Plan:
    target = load_target("linuxcnc")
    return planned(drawing_of(list(paths)), Job(operations, stock=STOCK), target.machine)  # type: ignore[arg-type]


def cut_of(plan: Plan, toolpath: Toolpath | None = None) -> CutStock:
    toolpath = toolpath or plan.toolpath
    tools = tools_of_rows(toolpath, plan.job)
    moves = stock_moves_of_toolpath(toolpath, tools.index, tools.cutters)
    return stock_of(moves)


def stock_of(moves: StockMoves) -> CutStock:
    return CutStock(moves, stock_tree(moves), STOCK.box_mm or cut_box(moves), -6.0)


def moved(stock: CutStock, by: tuple[float, float, float]) -> CutStock:
    """The stock after the same moves, all moved."""
    off, moves = np.array(by), stock.moves
    return stock_of(replace(moves, start=moves.start + off, end=moves.end + off))


def both(stock: CutStock, solid: WantedSolid, limit_mm: float) -> tuple[Bracket, Bracket]:
    return (
        proved_gouge(lambda _: stock, solid, limit_mm),
        proved_leftover(lambda _: stock, solid, limit_mm),
    )


OPERATIONS = {
    "pocket": Operation(kind="pocket", tool=MILL, depth_mm=2.0),
    "pocket by a bull nose": Operation(kind="pocket", tool=BULL, depth_mm=2.0, step_over=0.3),
    "outline": Operation(tool=MILL, depth_mm=2.0, side="outside"),
    "carving": Operation(kind="vcarve", tool=BIT, depth_mm=4.0),
    "engraving by a ball": Operation(kind="engrave", tool=BALL, depth_mm=1.0),
    "engraving by a bit": Operation(kind="engrave", tool=BIT, depth_mm=1.0),
}
CURVED = (closed(*circle(10.0, 8.0, 9.0)), closed((25, 0, 0.0), (33, 0, 0.4), (33, 12, 0.0)))


@pytest.mark.parametrize("name", OPERATIONS)
@pytest.mark.parametrize("paths", [(SQUARE,), CURVED], ids=["straight", "curved"])
def test_what_is_as_asked_is_proved_to_a_micrometre(name: str, paths: tuple[object, ...]) -> None:
    plan = plan_of(OPERATIONS[name], paths=paths)
    stock = cut_of(plan)
    # Arcs of the toolpath are chords here, up to a micrometre beside them.
    limit = 3e-3
    for found in both(stock, wanted_solid(plan.steps), limit):
        assert found.high <= limit


@pytest.mark.parametrize("name", OPERATIONS)
@pytest.mark.parametrize("by", [(0.0, 0.0, -0.02), (-0.012, 0.016, 0.01)])
def test_moved_programs_are_told_by_their_way(name: str, by: tuple[float, float, float]) -> None:
    """The distance counts in the plane and in depth alike, so it is no more than either, and walls
    across the way show all of it."""
    plan = plan_of(OPERATIONS[name])
    stock = moved(cut_of(plan), by)
    limit = 2e-3
    gouge, left = both(stock, wanted_solid(plan.steps), limit)
    flat, deep = math.hypot(*by[:2]), by[2]
    for found in (gouge, left):
        assert found.low <= found.high
        assert found.high <= 1.2 * max(flat, abs(deep)) + limit
    if not flat:
        assert gouge.low >= 0.8 * -deep if name in ("pocket", "outline") else gouge.low > 0.0
        # The chords of the moves are a micrometre beside them.
        assert left.high <= limit + BESIDE_MM
    elif name == "pocket":
        # A square's wall is as far off as the longer part of the way across it.
        assert gouge.low >= 0.8 * max(map(abs, by[:2]))
        assert left.high >= max(*map(abs, by[:2]), deep)
        assert left.low >= 0.3 * left.high


@pytest.mark.parametrize(
    "seed", [*range(10), *(pytest.param(k, marks=pytest.mark.slow) for k in range(10, 40))]
)
def test_brackets_of_random_jobs_hold_what_dense_points_show(seed: int) -> None:
    """No point of a dense lattice shows more than what is proved, and what is found is there."""
    asked = random_job(np.random.default_rng(seed))
    target = load_target("linuxcnc")
    job = Job((operation_of(asked),))
    plan = planned(drawing_of([closed(*path) for path in asked.paths]), job, target.machine)
    tools = tools_of_rows(plan.toolpath, plan.job)
    moves = stock_moves_of_toolpath(plan.toolpath, tools.index, tools.cutters)
    if not len(moves):
        return
    rng = np.random.default_rng(seed)
    off = rng.normal(0.0, 0.02, 3)
    moves = replace(moves, start=moves.start + off, end=moves.end + off)
    stock = CutStock(moves, stock_tree(moves), cut_box(moves))
    solid = wanted_solid(plan.steps)
    low, high = np.array(stock.box_mm).reshape(2, 2)
    points = rng.uniform(low, high, (20_000, 2))
    z = stock.heights(points)
    for number, found in enumerate(both(stock, solid, 0.01)):
        for distance_mm, is_more in ((found.low - BESIDE_MM, True), (found.high, False)):
            if not 0.0 < distance_mm < math.inf:
                continue
            at = np.array([found.at_mm]) if is_more else points
            level = stock.heights(at) if is_more else z
            bands = replace(solid, wall_mm=distance_mm).bands(at)
            excess = bands[:, 0] - level if number == 0 else level - bands[:, 1]
            if is_more:
                assert excess[0] > distance_mm
            else:
                assert excess.max() <= distance_mm + 1e-9


@pytest.mark.parametrize(
    ("name", "drawing", "target"),
    [
        ("plate", "plate.dxf", "linuxcnc"),
        ("sign", "sign.svg", "grbl"),
        ("tray", "tray.svg", "linuxcnc"),
        ("mount", "mount.dxf", "grbl"),
        ("board", "board.dxf", "grbl"),
    ],
)
def test_the_samples_are_proved_to_ten_micrometres(name: str, drawing: str, target: str) -> None:
    gates = Gates(gouge_mm=0.01, leftover_mm=0.01)
    job = read_job(SAMPLES / f"{name}.toml")
    run = post_drawing(read_drawing(SAMPLES / drawing), job, load_target(target), gates=gates)
    assert [str(each) for each in run.findings if each.code.name == "ABOVE_GATE"] == []


def test_the_walls_of_the_logo_are_off_by_the_backlash() -> None:
    """The controller of pic-mmh compensates 11.5 and 9.5 µm too much: the walls are off by that,
    and so the material is, whose depth is no more than 20 µm."""
    gates = Gates(gouge_mm=0.005, leftover_mm=0.005)
    job = read_job(SAMPLES / "logo.toml")
    drawing, target = read_drawing(SAMPLES / "logo.dxf"), load_target("pic-mmh")
    run = post_drawing(drawing, job, target, gates=gates)
    found = [each.measured for each in run.findings if each.code.name == "ABOVE_GATE"]
    assert len(found) == 2
    assert all(each is not None and 9.0 < each <= 15.0 for each in found)
    exact = post_drawing(
        drawing, replace(job, compensate=True), target, gates=Gates(gouge_mm=0.01)
    )
    assert not [each for each in exact.findings if each.code.name == "ABOVE_GATE"]
