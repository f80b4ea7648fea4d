"""Sizes of the report: those of the cut edge, nominally as drawn."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely

from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing
from camtool.planning.job import Job, Operation, Tool, job_of
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.verification.report import DimensionReport
from tests.drawings import drawing_of
from tests.oracles.contours import closed
from tests.oracles.part_sizes import SLACK_MM, Ball, left_of, polygon, removed, size_of
from tests.oracles.stock import Cutter, Path, moves_of
from tests.oracles.stock_jobs import circle

WIDE, HIGH, TOOL = 120.0, 80.0, 3.175


def box(x: float, y: float, width: float, height: float) -> Polyline:
    corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]]
    return Polyline(np.column_stack([corners, np.zeros(4)]), closed=True)


def sizes(paths: list[Polyline], *settings: str, **asked: Any) -> dict[str, DimensionReport]:
    """The dimensions by name."""
    loaded = load_target("linuxcnc", settings=("dialect.path=exact-path", *settings))
    made = post_drawing(drawing_of(paths), job_of(**asked), loaded)
    assert made.verification is not None, made.findings
    found = made.verification.report.dimensions
    of = "centre" if asked.get("side") == "on" else "edge"
    assert {item.of for item in found} == {of}
    return {item.name: item for item in found}


@pytest.mark.parametrize("side", ["outside", "inside", "on"])
@pytest.mark.parametrize("joins", ["round", "sharp", "mitre"])
def test_a_plate_is_as_large_as_it_is_drawn(side: str, joins: str) -> None:
    found = sizes([box(0, 0, WIDE, HIGH)], side=side, joins=joins, tool_diameter_mm=TOOL)
    for name, nominal in (("X", WIDE), ("Y", HIGH)):
        for of in ("part", "contour 1"):
            item = found[f"{of} {name}"]
            assert item.nominal_mm == nominal
            assert item.predicted_mm == pytest.approx(nominal, abs=2e-3)


def test_a_window_in_a_plate_and_a_diamond() -> None:
    found = sizes([box(0, 0, 60, 40), box(10, 10, 30, 20)], tool_diameter_mm=TOOL)
    both = sorted((item.nominal_mm, item.predicted_mm) for item in found.values())
    assert [nominal for nominal, _ in both] == [20.0, 30.0, 40.0, 40.0, 60.0, 60.0]
    assert all(abs(one - other) < 2e-3 for one, other in both)
    half = math.sqrt(200.0)
    diamond = Polyline(
        np.array([[half, 0, 0], [0, half, 0], [-half, 0, 0], [0, -half, 0.0]]), closed=True
    )
    round_it = sizes([diamond], side="outside", joins="sharp", tool_diameter_mm=TOOL)
    assert round_it["part X"].predicted_mm == pytest.approx(2.0 * half, abs=2e-3)
    within = sizes([diamond], side="inside", tool_diameter_mm=TOOL)
    # A round tool does not reach into the corners: r (√2 − 1) is left in each.
    left = (math.sqrt(2.0) - 1.0) * TOOL
    assert within["part X"].nominal_mm == pytest.approx(2.0 * half)
    assert within["part X"].predicted_mm == pytest.approx(2.0 * half - left, abs=2e-3)


def test_allowance_pockets_and_the_slides() -> None:
    plate = [box(0, 0, WIDE, HIGH)]
    larger = sizes(plate, side="outside", tool_diameter_mm=TOOL, allowance_mm=0.2)
    assert larger["part X"].nominal_mm == WIDE
    assert larger["part X"].predicted_mm == pytest.approx(WIDE + 0.4, abs=2e-3)
    pocket = sizes(plate, kind="pocket", tool_diameter_mm=TOOL)
    assert pocket["part Y"].predicted_mm == pytest.approx(HIGH, abs=2e-3)
    # Steps that are a thousandth too large make the centre's box so much larger.
    moved = sizes(plate, "axes.x.real_step_mm=0.0005005", "axes.x.coded_step_mm=0.0005",
                  side="outside", tool_diameter_mm=TOOL)  # fmt: skip
    assert moved["part X"].predicted_mm == pytest.approx(WIDE + 1e-3 * (WIDE + TOOL), abs=3e-3)


@pytest.mark.parametrize(("depth", "least"), [(2.0, WIDE), (5.0, WIDE)])
def test_what_is_carved_is_as_large_as_the_bit_is_wide_at_the_surface(
    depth: float, least: float
) -> None:
    bit = Tool(diameter_mm=6.0, kind="v", tip_angle_rad=0.5 * math.pi)
    carve = Job(operations=(Operation(kind="vcarve", tool=bit, depth_mm=depth),))
    made = post_drawing(drawing_of([box(0, 0, WIDE, HIGH)]), carve, load_target("linuxcnc"))
    assert made.verification is not None, made.findings
    size = made.verification.report.dimensions[0]
    assert (size.nominal_mm, size.of) == (WIDE, "edge")
    assert size.predicted_mm == pytest.approx(least, abs=0.03)


def test_what_is_roughed_and_finished_is_as_large_as_it_is_finished() -> None:
    cutter = Tool(diameter_mm=TOOL)
    rough = Operation(side="outside", tool=cutter, allowance_mm=0.3)
    job = Job(operations=(rough, replace(rough, allowance_mm=0.0)))
    made = post_drawing(drawing_of([box(0, 0, WIDE, HIGH)]), job, load_target("linuxcnc"))
    assert made.verification is not None, made.findings
    size = made.verification.report.dimensions[0]
    assert size.nominal_mm == WIDE
    assert size.predicted_mm == pytest.approx(WIDE, abs=0.02)


def test_parts_that_one_contour_runs_round_are_as_the_tool_leaves_them() -> None:
    found = sizes([box(0, 0, 20, 20), box(21, 0, 20, 20)], tool_diameter_mm=TOOL)
    assert found["part X"].nominal_mm == pytest.approx(41.0)
    assert found["part X"].predicted_mm == pytest.approx(41.0, abs=2e-3)


# Sizes against what the program itself removes of the stock.

ROUND: tuple[Path, ...] = (circle(30.0, 30.0, 20.0),)
RING: tuple[Path, ...] = (circle(30.0, 30.0, 20.0), circle(30.0, 30.0, 14.0))
DUMBBELL: tuple[Path, ...] = (
    [(0, 0, 0), (10, 0, 0), (10, 4, 0), (20, 4, 0), (20, 0, 0), (30, 0, 0), (30, 10, 1.0),
     (20, 10, 0), (20, 6, 0), (10, 6, 0), (10, 10, 0), (0, 10, 0)],
)  # fmt: skip
LEAF: tuple[Path, ...] = ([(0.0, 0.0, 0.4), (30.0, 10.0, 0.4)],)
BIT = Tool(6.0, "v", math.radians(60.0))
BALL = Tool(6.0, "ball")
MADE: dict[str, tuple[tuple[Path, ...], Operation]] = {
    "round pocket": (ROUND, Operation(kind="pocket", tool=Tool(2.0))),
    "zigzag": (ROUND, Operation(kind="pocket", pattern="zigzag", tool=Tool(2.0), angle_rad=0.3)),
    "pocket with an island": (RING, Operation(kind="pocket", tool=Tool(2.0), depth_mm=3.0,
                                              step_down_mm=1.0, allowance_mm=0.2)),
    "pocket with a neck": (DUMBBELL, Operation(kind="pocket", tool=Tool(3.0))),
    "pocket of a leaf": (LEAF, Operation(kind="pocket", tool=Tool(2.0))),
    "pocket of a leaf, finished": (LEAF, Operation(kind="pocket", tool=Tool(2.0), finish_mm=0.2)),
    "shallow pocket by a ball": (ROUND, Operation(kind="pocket", tool=BALL, depth_mm=1.0)),
    "bore": (ROUND, Operation(kind="bore", tool=Tool(6.0), depth_mm=4.0)),
    "carved disc": (ROUND, Operation(kind="vcarve", tool=BIT, depth_mm=2.0)),
    "carved ring": (RING, Operation(kind="vcarve", tool=BIT, depth_mm=20.0)),
    "carved leaf": (LEAF, Operation(kind="vcarve", tool=BIT, depth_mm=20.0)),
    "window": (LEAF, Operation(side="inside", tool=Tool(3.0), depth_mm=1.0)),
    "window with a neck": (DUMBBELL, Operation(side="inside", tool=Tool(3.0), depth_mm=1.0)),
    "plate": (LEAF, Operation(side="outside", tool=Tool(3.0), depth_mm=1.0, joins="sharp")),
    "plate by a ball": (ROUND, Operation(side="outside", tool=BALL, depth_mm=1.0)),
    "plate with a hole": (RING, Operation(tool=Tool(3.0), depth_mm=1.0, allowance_mm=-0.1)),
}  # fmt: skip


@pytest.mark.parametrize("name", MADE)
def test_sizes_are_those_of_what_is_cut(name: str) -> None:
    paths, operation = MADE[name]
    target = load_target("linuxcnc", settings=("dialect.path=exact-path",))
    drawing = drawing_of([closed(*path) for path in paths])
    made = post_drawing(drawing, Job((operation,)), target)
    assert made.verification is not None, made.findings
    assert made.program is not None
    part = made.verification.report.dimensions[:2]
    tool = operation.tool
    cutter = Cutter(tool.radius_mm, math.tan(0.5 * (tool.tip_angle_rad or 0.0)))
    if tool.kind == "ball":
        cutter = Ball(tool.radius_mm)
    area = removed(moves_of(made.program.data.decode()), cutter)
    if operation.kind == "profile" and operation.side != "inside":
        area = left_of(area, paths[:1])
    drawn = shapely.union_all([polygon(path) for path in paths])
    assert [each.nominal_mm for each in part] == pytest.approx(size_of(drawn.bounds), abs=1e-3)
    assert [each.predicted_mm for each in part] == pytest.approx(
        size_of(area.bounds), abs=SLACK_MM
    )
    assert {each.of for each in part} == {"edge"}


def test_what_has_no_edge_has_no_size() -> None:
    """The width of a groove is no size of what is drawn; a chamfer breaks the edge of another
    operation; a drill makes holes of its own size."""
    target = load_target("linuxcnc", settings=("dialect.path=exact-path",))
    drawing = drawing_of([closed(*path) for path in ROUND])

    def found(*operations: Operation) -> tuple[DimensionReport, ...]:
        made = post_drawing(drawing, Job(operations), target)
        assert made.verification is not None, made.findings
        return made.verification.report.dimensions

    groove = Operation(kind="engrave", tool=Tool(2.0), depth_mm=0.5)
    chamfer = Operation(
        kind="chamfer", side="outside", tool=replace(BIT, number=1), chamfer_mm=0.5
    )
    plate = Operation(side="outside", tool=Tool(2.0, number=2), depth_mm=1.0)
    point = replace(groove, tool=Tool())
    assert {(each.of, each.nominal_mm) for each in found(groove)} == {("centre", 40.0)}
    assert {(each.of, each.nominal_mm) for each in found(point)} == {("edge", 40.0)}
    assert found(chamfer) == ()
    assert [each.predicted_mm for each in found(plate, chamfer)[:2]] == [40.0, 40.0]
