"""Faults planted into programs: each is found in the stock, with the place and the size that a
slow stock of needles has, and the programs without them have none."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.findings import Finding, Severity
from camtool.importers.read import read_drawing
from camtool.pipeline import Judging, post_by_tool, post_drawing, verify_program
from camtool.planning.job import Job, KeepOutBox, Operation, Stock, Tabs, Tool
from camtool.planning.plan import Plan, planned
from camtool.records import replace
from camtool.stock.checks import StockRequest, stock_findings, stock_request
from camtool.stock.cut import cut_stock
from camtool.stock.cutters import cutter_profile
from camtool.stock.findings import StockCode
from camtool.stock.moves import stock_moves_of_toolpath
from camtool.stock.proofs import proved_gouge, proved_leftover
from camtool.stock.slides import tools_of_rows
from camtool.stock.wanted import wanted_solid
from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification.report import Gates
from tests.drawings import drawing_of
from tests.oracles.contours import closed
from tests.oracles.stock import Cutter, Move
from tests.oracles.stock import Stock as Needles
from tests.oracles.stock_jobs import random_job
from tests.planning.test_stock import operation_of
from tests.strategies import examples

DEEP_MM = 0.01
CELL_MM = 0.1
MILL = Tool(4.0)
SQUARE = closed((0, 0), (30, 0), (30, 20), (0, 20))
STOCK = Stock(3.0, (-10.0, -10.0), (50.0, 40.0))

SEEDS = (*range(60), 120, 158, 160, 264, 313, 344, 424)
"""Random jobs of all kinds; the last with leads about corners."""


def plan_of(*operations: Operation, **job: object) -> Plan:
    target = load_target("linuxcnc")
    return planned(drawing_of([SQUARE]), Job(operations, **job), target.machine)  # type: ignore[arg-type]


def judged(
    plan: Plan, toolpath: Toolpath | None = None, tools: Sequence[Tool] | None = None
) -> tuple[Finding, ...]:
    """The findings of a toolpath in the stock of a plan; `tools`: those that are really in."""
    toolpath = toolpath or plan.toolpath
    request = stock_request(plan.steps, plan.job, 0.01)
    return found_in(toolpath, request, tools)


def found_in(
    toolpath: Toolpath, request: StockRequest, tools: Sequence[Tool] | None = None
) -> tuple[Finding, ...]:
    job = Job(request.operations)
    found = tools_of_rows(toolpath, job)
    cutters = tuple(map(cutter_profile, tools)) if tools else found.cutters
    moves = stock_moves_of_toolpath(toolpath, found.index, cutters)
    return stock_findings(toolpath, moves, request, DEEP_MM)


def codes(findings: Sequence[Finding]) -> set[str]:
    return {finding.code.name for finding in findings}


def lowered(toolpath: Toolpath, change: Callable[[Floats], Floats]) -> Toolpath:
    """The toolpath with other heights (N,) of the ends of its moves."""
    end = toolpath.end.copy()
    end[:, 2] = change(end[:, 2])
    return replace(toolpath, end=end)


def needles(toolpath: Toolpath, cutter: Cutter) -> tuple[Needles, list[float]]:
    """The stock after a toolpath, by the slow oracle, and the thickest chip of each move."""
    stock, chips = Needles((-10.0, -10.0), (40.0, 30.0), CELL_MM), []
    starts, sweeps = toolpath.starts, toolpath.sweeps()
    for row in np.flatnonzero(toolpath.is_feed | (toolpath.kind == Kind.RAPID)).tolist():
        centre = tuple(toolpath.centre[row].tolist()) if toolpath.is_arc[row] else None
        a, b = tuple(starts[row].tolist()), tuple(toolpath.end[row].tolist())
        chips.append(stock.cut(Move(False, a, b, row, centre, float(sweeps[row])), cutter).chip)
    return stock, chips


def place_of(finding: Finding) -> Floats:
    found = re.search(r"X (\S+) Y (\S+)", finding.where)
    assert found is not None
    return np.array([float(found[1]), float(found[2])])


def one(findings: Sequence[Finding], code: StockCode) -> Finding:
    found = [finding for finding in findings if finding.code is code]
    assert found, [str(each) for each in findings]
    return found[0]


@pytest.mark.parametrize("seed", SEEDS)
def test_random_jobs_raise_no_alarm(seed: int) -> None:
    assert alarms(seed) == []


@pytest.mark.slow
@pytest.mark.parametrize("first", range(60, 1060, 50))
def test_many_random_jobs_raise_no_alarm(first: int) -> None:
    for seed in range(first, first + 50):
        assert alarms(seed) == [], seed


def alarms(seed: int) -> list[str]:
    """What is found in the stock of a random job whose planning found no fault."""
    asked = random_job(np.random.default_rng(seed))
    paths = [closed(*path) for path in asked.paths]
    plan = planned(drawing_of(paths), Job((operation_of(asked),)), load_target("linuxcnc").machine)
    if any(
        each.severity is Severity.ERROR or each.code.name == "GOUGE"
        for each in plan.toolpath.findings
    ):
        return []
    return [str(each) for each in judged(plan)]


def test_a_floor_cut_too_deep_is_found_with_its_depth() -> None:
    plan = plan_of(Operation(kind="pocket", tool=MILL, depth_mm=2.0, step_down_mm=1.0))
    deeper = lowered(plan.toolpath, lambda z: np.where(z == -2.0, -2.05, z))
    finding = one(judged(plan, deeper), StockCode.CUT_TOO_DEEP)
    stock, _ = needles(deeper, Cutter(2.0))
    assert finding.severity is Severity.ERROR
    assert finding.measured == pytest.approx(0.05, abs=1e-6)
    assert stock.at(place_of(finding)[None])[0] == pytest.approx(-2.05)
    assert stock.height.min() == pytest.approx(-2.0 - finding.measured)
    assert judged(plan) == ()


def test_a_cut_into_the_part_is_found_where_it_is() -> None:
    plan = plan_of(Operation(tool=MILL, depth_mm=2.0, side="outside"))
    row = int(np.flatnonzero(plan.toolpath.is_feed)[2])
    end = plan.toolpath.end.copy()
    # The corner of the path moves by 1 mm into the part.
    end[row, :2] += np.sign(np.array([15.0, 10.0]) - end[row, :2])
    inner = replace(plan.toolpath, end=end)
    finding = one(judged(plan, inner), StockCode.CUT_TOO_DEEP)
    stock, _ = needles(inner, Cutter(2.0))
    inside = ((stock.points > [0.1, 0.1]) & (stock.points < [29.9, 19.9])).all(axis=1)
    assert stock.height.ravel()[inside].min() == -2.0
    assert finding.measured == 2.0
    x, y = place_of(finding)
    assert 0.0 < x < 30.0
    assert 0.0 < y < 20.0


@pytest.mark.parametrize("finish", [None, 0.3])
def test_tabs_are_no_material_that_is_left(finish: float | None) -> None:
    """The finishing pass has no tabs itself, and is raised over those of the first one."""
    tabs = Tabs(count=4, width_mm=5.0, height_mm=1.0)
    operation = Operation(
        kind="profile", tool=MILL, depth_mm=3.0, side="outside", tabs=tabs, finish_mm=finish
    )
    plan = plan_of(operation, stock=STOCK)
    stock, _ = needles(plan.toolpath, Cutter(2.0))
    ring = stock.at(np.array([[15.0, -1.5], [-1.5, 10.0]]))
    assert (ring <= -2.0).all()
    assert -2.0 in np.round(stock.height, 9)
    assert "MATERIAL_LEFT" not in codes(judged(plan))


def test_what_is_left_is_found() -> None:
    plan = plan_of(Operation(kind="pocket", tool=MILL, depth_mm=2.0))
    rows = np.flatnonzero(plan.toolpath.is_feed)
    # The last quarter of the clearing moves runs 0.3 mm too high.
    end = plan.toolpath.end.copy()
    end[rows[3 * len(rows) // 4] :, 2] += np.where(
        end[rows[3 * len(rows) // 4] :, 2] < 0.0, 0.3, 0.0
    )
    higher = replace(plan.toolpath, end=end)
    finding = one(judged(plan, higher), StockCode.MATERIAL_LEFT)
    stock, _ = needles(higher, Cutter(2.0))
    assert finding.measured == pytest.approx(
        float(stock.at(place_of(finding)[None])[0]) + 2.0, abs=0.02
    )
    assert finding.measured >= 0.29


def test_what_is_left_between_the_points_of_a_lattice_is_found() -> None:
    """Two rows of a zigzag leave a sliver of 0.02 mm between them."""
    operation = Operation(
        kind="pocket", tool=MILL, depth_mm=2.0, pattern="zigzag", step_over=0.975
    )
    plan = plan_of(operation)
    rows = np.unique(np.round(plan.toolpath.end[:, 1], 3))
    assert 10.0 in rows
    assert 6.82 in rows
    end = plan.toolpath.end.copy()
    end[np.abs(end[:, 1] - 6.82) < 1e-3, 1] = 5.98
    finding = one(judged(plan, replace(plan.toolpath, end=end)), StockCode.MATERIAL_LEFT)
    assert finding.measured == pytest.approx(2.0)
    assert place_of(finding)[1] == pytest.approx(7.99, abs=0.011)
    assert judged(plan) == ()


def test_a_missing_pass_is_found_with_its_chip() -> None:
    plan = plan_of(Operation(tool=MILL, depth_mm=3.0, step_down_mm=1.0, side="outside"))
    skipped = lowered(plan.toolpath, lambda z: np.where(z == -2.0, -1.0, z))
    finding = one(judged(plan, skipped), StockCode.PASS_TOO_DEEP)
    _, chips = needles(skipped, Cutter(2.0))
    assert finding.measured == pytest.approx(2.0)
    assert finding.measured == pytest.approx(max(chips))
    assert finding.limit == 1.0


def test_edges_shorter_than_a_pass_are_found() -> None:
    short = Tool(4.0, cutting_length_mm=1.5)
    plan = plan_of(Operation(tool=short, depth_mm=3.0, side="outside"))
    assert one(judged(plan), StockCode.PASS_TOO_DEEP).limit == 1.5


def test_a_missing_tab_is_found_at_its_place() -> None:
    tabs = Tabs(count=4, width_mm=3.0, height_mm=1.0)
    plan = plan_of(
        Operation(tool=MILL, depth_mm=3.2, side="outside", step_down_mm=1.6, tabs=tabs),
        stock=STOCK,
    )
    assert codes(judged(plan)) <= {"TOOL_NOT_KNOWN"}
    bridge = plan.steps[0].bridges[1]
    start, end = plan.toolpath.starts, plan.toolpath.end
    near = np.hypot(*(0.5 * (start + end)[:, :2] - bridge.centre).T) < 4.0
    cut = lowered(plan.toolpath, lambda z: np.where(near & (z < -2.0) & (z > -3.2), -3.2, z))
    finding = one(judged(plan, cut), StockCode.TAB_MISSING)
    assert place_of(finding) == pytest.approx(bridge.centre, abs=1e-3)
    stock, _ = needles(cut, Cutter(2.0))
    assert stock.at(bridge.centre[None])[0] == pytest.approx(-3.2)
    assert finding.measured == pytest.approx(0.0, abs=1e-9)


def test_a_thin_tab_is_found_with_its_width() -> None:
    tabs = Tabs(count=4, width_mm=3.0, height_mm=1.0)
    operation = Operation(tool=MILL, depth_mm=3.2, side="outside", tabs=tabs)
    plan = plan_of(operation, stock=STOCK)
    wider = stock_request(
        [replace(step, operation=replace(operation, tabs=replace(tabs, width_mm=4.0)))
         for step in plan.steps], plan.job, 0.01,
    )  # fmt: skip
    finding = one(found_in(plan.toolpath, wider), StockCode.TAB_THIN)
    assert finding.measured == pytest.approx(3.0, abs=0.1)
    assert finding.limit == 4.0


def test_a_blunt_bit_cuts_into_what_is_to_stay() -> None:
    bit = Tool(8.0, "v", math.radians(60.0))
    blunt = Tool(8.0, "v", math.radians(90.0))
    plan = plan_of(Operation(kind="vcarve", tool=bit, depth_mm=2.0))
    assert judged(plan) == ()
    finding = one(judged(plan, tools=[blunt]), StockCode.CUT_TOO_DEEP)
    stock, _ = needles(plan.toolpath, Cutter(4.0, 1.0))
    beyond = stock.height[(stock.y > 5.0) & (stock.y < 15.0)][:, stock.x < 0.0].min()
    assert finding.measured == pytest.approx(-beyond, abs=CELL_MM + 0.03)


def test_a_rapid_through_the_part_is_found() -> None:
    plan = plan_of(Operation(kind="pocket", tool=MILL, depth_mm=2.0))
    end = plan.toolpath.end.copy()
    end[-1] = [60.0, 10.0, -1.0]
    kind = plan.toolpath.kind.copy()
    kind[-1] = Kind.RAPID
    wrong = replace(plan.toolpath, end=end, kind=kind)
    finding = one(judged(plan, wrong), StockCode.CUT_TOO_DEEP)
    assert finding.measured == pytest.approx(1.0, abs=0.5)
    assert place_of(finding)[0] > 30.0 - 2.0


@pytest.mark.parametrize(("deeper", "limit"), [(0.05, 0.03), (0.05, 0.06), (0.0, 0.03)])
def test_a_gouge_is_bracketed(deeper: float, limit: float) -> None:
    plan = plan_of(Operation(kind="pocket", tool=MILL, depth_mm=2.0))
    change = lowered(plan.toolpath, lambda z: np.where(z == -2.0, -2.0 - deeper, z))
    target = load_target("linuxcnc")
    stock = cut_stock(change, target, plan.job, None, 1e-4)
    found = proved_gouge(lambda _: stock, wanted_solid(plan.steps), limit)
    if deeper > limit:
        assert found.low <= deeper <= found.high
        assert found.high - found.low <= 0.2 * deeper
    else:
        assert found.low < limit
        assert found.high <= limit + 1e-9


def test_what_is_left_is_bracketed() -> None:
    plan = plan_of(Operation(kind="pocket", tool=MILL, depth_mm=2.0))
    higher = lowered(plan.toolpath, lambda z: np.where(z == -2.0, -1.9, z))
    target, solid = load_target("linuxcnc"), wanted_solid(plan.steps)
    stock = cut_stock(higher, target, plan.job, None, 1e-4)
    found = proved_leftover(lambda _: stock, solid, 0.05)
    assert found.low <= 0.1 <= found.high
    assert found.high - found.low <= 0.02
    exact = cut_stock(plan.toolpath, target, plan.job, None, 1e-4)
    assert proved_leftover(lambda _: exact, solid, 0.05).high <= 0.05


def test_limits_of_the_stock_are_gates() -> None:
    operation = Operation(kind="pocket", tool=MILL, depth_mm=2.0)
    target, drawing = load_target("linuxcnc"), drawing_of([SQUARE])
    wide = Gates(gouge_mm=0.05, leftover_mm=0.05)
    program = post_drawing(drawing, Job((operation,)), target, gates=wide)
    assert not program.failed
    tight = post_drawing(drawing, Job((operation,)), target, gates=Gates(leftover_mm=1e-4))
    assert tight.failed
    assert "ABOVE_GATE" in codes(tight.findings)
    deeper = Job((replace(operation, depth_mm=2.2),))
    assert program.program is not None
    found = verify_program(
        program.program.data,
        target,
        source="a.ngc",
        drawing=drawing,
        job=deeper,
        judging=Judging(gates=wide),
    )
    left = [each for each in found.findings if each.where == "--max-leftover"]
    assert [each.measured for each in left] == pytest.approx([200.0], abs=10.0)
    alone = verify_program(
        program.program.data, target, source="a.ngc", judging=Judging(gates=wide)
    )
    assert sum("is known without a drawing" in each.message for each in alone.findings) == 2


def test_the_slides_of_a_compensated_program_raise_no_alarm() -> None:
    """Its passes lie a few micrometres beside each other, and the program itself is bent."""
    drawing = read_drawing(Path("samples/logo.dxf"))
    operation = Operation(tool=Tool(0.1), depth_mm=0.05, step_down_mm=0.02, layers=("CUT",))
    run = post_drawing(drawing, Job((operation,), compensate=True), load_target("pic-mmh"))
    assert run.verification is not None
    assert not codes(run.findings) & {each.name for each in StockCode}


def test_parts_of_a_program_do_not_miss_what_the_others_clear() -> None:
    """The small tool clears the corners that the wide one has left, in a program of its own."""
    wide = Operation(kind="pocket", name="wide", tool=Tool(6.0, number=1), depth_mm=2.0)
    small = Operation(kind="pocket", name="rest", rest="wide", tool=Tool(2.0, number=2))
    runs = post_by_tool(drawing_of([SQUARE]), Job((wide, small)), load_target("linuxcnc"))
    assert len(runs) == 2
    for run in runs:
        assert run.verification is not None
        assert codes(run.findings) & {each.name for each in StockCode} == {"STOCK_NOT_JUDGED"}


def test_a_program_whose_tools_are_not_known_says_what_is_not_judged() -> None:
    """Two tools without numbers: depths are not judged, a rapid in the stock is found all the
    same; with numbers all is judged."""
    two = [
        Operation(kind="pocket", name="wide", tool=Tool(6.0), depth_mm=2.0),
        Operation(kind="pocket", rest="wide", tool=Tool(2.0)),
    ]
    numbered = [
        replace(each, tool=replace(each.tool, number=k)) for k, each in enumerate(two, start=1)
    ]
    target, drawing = load_target("linuxcnc"), drawing_of([SQUARE])
    run = post_drawing(drawing, Job(tuple(numbered)), target)
    assert run.program is not None
    text = run.program.data.decode()
    damaged = text.replace("M2", "G0 Z-1\nG0 X50 Y10\nG0 Z5\nM2")
    assert damaged != text
    for operations, unknown in ((two, True), (numbered, False)):
        for data, wrong in ((text, False), (damaged, True)):
            found = verify_program(
                data.encode(), target, source="a.ngc", drawing=drawing, job=Job(tuple(operations))
            )
            assert ("STOCK_NOT_JUDGED" in codes(found.findings)) == unknown
            assert ("RAPID_IN_STOCK" in codes(found.findings)) == wrong
            if unknown:
                said = one(found.findings, StockCode.STOCK_NOT_JUDGED)
                assert "not known which of 2 tools" in said.message


@pytest.mark.parametrize("stickout", [8.0, 10.0, 10.5])
def test_a_holder_in_the_stock_is_found_with_its_depth(stickout: float) -> None:
    tool = Tool(4.0, stickout_mm=stickout, holder_diameter_mm=20.0)
    plan = plan_of(Operation(kind="pocket", tool=tool, depth_mm=10.0, step_down_mm=2.0))
    found = [each for each in judged(plan) if each.code is StockCode.TOOL_IN_STOCK]
    if stickout >= 10.0:
        assert found == []
        return
    (finding,) = found
    stock, _ = needles(plan.toolpath, Cutter(2.0))
    standing = stock.at(place_of(finding)[None])[0]
    assert finding.measured == pytest.approx(standing - (stickout - 10.0))
    assert finding.measured == pytest.approx(2.0)


def test_a_wide_shank_in_a_narrow_pocket_is_found() -> None:
    thin = Tool(2.0, cutting_length_mm=4.0, shank_diameter_mm=6.0)
    operation = Operation(kind="pocket", tool=thin, depth_mm=5.0, step_down_mm=1.0)
    finding = one(judged(plan_of(operation)), StockCode.TOOL_IN_STOCK)
    assert finding.measured == pytest.approx(1.0)
    assert "shank" in finding.message
    slim = replace(thin, shank_diameter_mm=2.0)
    found = codes(judged(plan_of(replace(operation, tool=slim))))
    assert found == {"TOOL_NOT_KNOWN"}


def test_a_clamp_in_the_way_is_found_and_one_beside_it_is_not() -> None:
    operation = Operation(tool=MILL, depth_mm=2.0, side="outside")
    inner = KeepOutBox("clamp", (-20.0, -3.5), (5.0, 15.0), (0.0, 12.0))
    finding = one(judged(plan_of(operation, keep_out=(inner,))), StockCode.KEEP_OUT_ENTERED)
    # The tool's centre runs 2 mm beside the part, its edge 4 mm.
    assert finding.measured == pytest.approx(0.5)
    assert "'clamp'" in finding.message
    outer = replace(inner, x_mm=(-20.0, -4.5))
    assert codes(judged(plan_of(operation, keep_out=(outer,)))) == {"TOOL_NOT_KNOWN"}
    low = replace(inner, z_mm=(-50.0, -2.0))
    assert codes(judged(plan_of(operation, keep_out=(low,)))) == {"TOOL_NOT_KNOWN"}


@examples(60)
@given(seed=st.integers(0, 1 << 30))
def test_boxes_are_entered_as_dense_points_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plan = plan_of(Operation(tool=MILL, depth_mm=2.0, side="outside", joins="sharp"))
    low, size = rng.uniform(-8.0, 30.0, 3), rng.uniform(0.5, 12.0, 3)
    low[2] = rng.uniform(-4.0, 6.0)
    ends = [(float(a), float(a + b)) for a, b in zip(low, size, strict=True)]
    box = KeepOutBox("box", *ends)
    job = replace(plan.job, keep_out=(box,))
    found = found_in(plan.toolpath, stock_request(plan.steps, job, 0.01))
    depth = max(
        [each.measured or 0.0 for each in found if each.code is StockCode.KEEP_OUT_ENTERED],
        default=-math.inf,
    )
    share = np.linspace(0.0, 1.0, 4001)[:, None]
    deepest = -math.inf
    for a, b in zip(plan.toolpath.starts, plan.toolpath.end, strict=True):
        points = a + share * (b - a)
        points = points[points[:, 2] < ends[2][1]]
        (x0, x1), (y0, y1), _ = ends
        x, y = points[:, 0], points[:, 1]
        outside = np.hypot(np.maximum(np.maximum(x0 - x, x - x1), 0.0),
                           np.maximum(np.maximum(y0 - y, y - y1), 0.0))  # fmt: skip
        deepest = max(deepest, 2.0 - float(outside.min(initial=math.inf)))
    if deepest > 1e-3:
        assert depth == pytest.approx(deepest, abs=0.02)
    else:
        assert depth <= 0.02
