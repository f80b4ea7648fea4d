"""What no program may do: travel, stock, rapids, tools, feeds."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Mark
from camtool.geometry.polylines import Polyline
from camtool.machine.model import Machine
from camtool.pipeline import post_drawing
from camtool.planning.checks import checked
from camtool.planning.findings import PlanningCode
from camtool.planning.job import Job, KeepOutBox, Lead, Operation, Placement, Stock, Tool, job_of
from camtool.planning.plan import plan, planned
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from tests.drawings import drawing_of
from tests.oracles.path_machine import path_machine
from tests.strategies import examples

STOCK = Stock(2.0, (0.0, 0.0), (10.0, 10.0))


def found(
    path: ToolpathBuilder, job: Job | None = None, machine: Machine | None = None
) -> list[Finding]:
    return list(checked(path.finish(), job or job_of(), machine or path_machine()))


def codes(path: ToolpathBuilder, job: Job | None = None, *settings: str) -> list[Code]:
    return [finding.code for finding in found(path, job, path_machine(*settings))]


def down(x: float, y: float, z: float = -1.0) -> ToolpathBuilder:
    return ToolpathBuilder().rapid(z=5).rapid(x, y).line(z=z, feed=10)


def square(path: ToolpathBuilder, x: float, y: float) -> ToolpathBuilder:
    path.rapid(z=5).rapid(x, y).line(z=-1, feed=10)
    path.line(x + 1, y, feed=10).line(x + 1, y + 1, feed=10).line(x, y, feed=10)
    return path.rapid(z=5)


def test_a_sound_toolpath_has_no_findings() -> None:
    path = square(ToolpathBuilder(), 1, 1)
    assert found(path, job_of(stock=STOCK, tool_diameter_mm=1.0)) == []
    assert found(ToolpathBuilder(), job_of(stock=STOCK)) == []


def test_travel_counts_part_zero_and_the_bulge_of_arcs() -> None:
    path = ToolpathBuilder().rapid(4, 0).arc(4, 2, centre=(4, 1), ccw=True, feed=10)
    assert codes(path, None, "axes.x.travel_mm=5.0") == []
    (finding,) = found(path, None, path_machine("axes.x.travel_mm=4.9"))
    assert (finding.code, finding.measured, finding.limit) == (ProgramCode.OUT_OF_TRAVEL, 5.0, 4.9)


@pytest.mark.parametrize(
    ("corner", "other", "depth", "advice"),
    [
        ((4, 0), (13, 3), 1, "use --origin lower-left"),  # 9 wide, 4 away from part zero
        ((0, 0), (13, 3), 1, "scale the drawing"),
        ((0, 0), (3, 11), 1, "use --rotate 90 --origin lower-left"),
        ((0, 0), (11, 9), 1, "scale the drawing"),
        ((0, 0), (3, 3), 9, "lower safe_z or the depth"),
    ],
)
def test_only_what_helps_is_advised(
    corner: tuple[int, int], other: tuple[int, int], depth: int, advice: str
) -> None:
    path = down(*corner, -float(depth)).line(*other, feed=10)
    machine = path_machine(
        "axes.x.travel_mm=12.0", "axes.y.travel_mm=8.0", "axes.z.travel_mm=12.0"
    )
    (finding,) = (
        each for each in found(path, None, machine) if each.code == ProgramCode.OUT_OF_TRAVEL
    )
    assert f": {advice}" in finding.message
    axis = finding.where.split()[1].rstrip(",").lower()
    assert f"--set axes.{axis}.travel_mm=" in finding.message
    assert "in the machine file of made-up" in finding.message


def test_a_stock_of_which_only_the_thickness_is_known_is_as_large_as_the_job_needs() -> None:
    job = job_of(stock=Stock(2.0), tool_diameter_mm=1.0)
    assert codes(down(500, 500, -2).line(600, 1, feed=10), job) == []
    (finding,) = found(down(1, 1, -2).line(2, 1, -3.5, feed=10), job)
    assert finding.code == PlanningCode.OUT_OF_STOCK
    assert finding.limit == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("thickness", "board", "through", "allowed"),
    [
        (2.0, None, 0.2, 1.0),
        (2.0, None, 1.0, 1.0),
        (2.0, None, 1.01, None),
        (0.1, None, 0.05, 0.05),  # thin stock has a thin board
        (0.1, None, 0.06, None),
        (2.0, 5.0, 5.0, 5.0),
        (2.0, 5.0, 5.01, None),
        (2.0, 0.0, 0.01, None),
    ],
)
def test_cuts_may_go_through_the_stock_as_far_as_the_spoilboard_lets_them(
    thickness: float, board: float | None, through: float, allowed: float | None
) -> None:
    job = job_of(stock=Stock(thickness, STOCK.corner_mm, STOCK.size_mm, board))
    assert codes(down(1, 1, -thickness).line(2, 1, feed=10), job) == []
    path = down(1, 1, -thickness).line(2, 1, -thickness - through, feed=10)
    (finding,) = found(path, job)
    assert finding.code == PlanningCode.OUT_OF_STOCK
    assert finding.severity == (Severity.ERROR if allowed is None else Severity.INFO)
    assert finding.measured == pytest.approx(thickness + through)
    assert finding.where == "move 3"
    assert ("spoilboard in [stock]" in finding.message) == (allowed is None)
    if allowed is not None:
        assert finding.limit == pytest.approx(thickness + allowed)
    assert codes(path) == []


def test_leads_may_begin_in_the_air_but_no_cut_lies_there_alone() -> None:
    job = job_of(stock=STOCK, tool_diameter_mm=1.0)
    assert codes(down(-3, 5).line(5, 5, feed=10), job) == []
    path = square(square(square(ToolpathBuilder(), 1, 1), 12, 1), 1, -2)
    (finding,) = found(path, job)
    assert (finding.code, finding.severity) == (PlanningCode.OUT_OF_STOCK, Severity.WARNING)
    assert finding.message.startswith("2 cuts lie wholly beside")
    assert "near (12.000, 1.000)" in finding.where
    assert codes(square(ToolpathBuilder(), 10.4, 1), job) == []  # half a tool still cuts
    assert codes(square(ToolpathBuilder(), 10.6, 1), job) == [PlanningCode.OUT_OF_STOCK]


def test_arcs_reach_into_the_stock_by_their_bulge() -> None:
    job = job_of(stock=STOCK)
    path = down(10.5, 4).arc(10.5, 6, centre=(10.5, 5), ccw=False, feed=10)
    assert codes(path, job) == []


def two(number: int | None) -> Job:
    one = Operation(name="coarse", tool=Tool(4.0, number=1))
    return Job(operations=(one, Operation(name="fine", tool=Tool(1.0, number=number))))


def test_a_tool_without_a_number_of_its_own_cannot_be_asked_for() -> None:
    assert codes(ToolpathBuilder(), two(2)) == []
    for number in (None, 1):
        (finding,) = found(ToolpathBuilder(), two(number))
        assert (finding.code, finding.where) == (PlanningCode.TOOL_NOT_SAID, "operation 'fine'")
    same = Operation(tool=Tool(1.0, name="a"))
    assert codes(ToolpathBuilder(), Job(operations=(same, Operation(tool=Tool(1.0))))) == []


LIMITS = ("limits.max_feed_mm_min=100", "axes.z.max_rate_mm_min=10")


def test_feeds_keep_to_the_machine() -> None:
    path = ToolpathBuilder().line(10, 0, feed=100)
    assert codes(path, None, *LIMITS) == []
    (finding,) = found(path.line(0, 0, feed=101), None, path_machine(*LIMITS))
    assert (finding.code, finding.where) == (ProgramCode.FEED_ABOVE_LIMIT, "move 1")
    assert (finding.measured, finding.limit) == (101.0, 100.0)
    assert codes(path) == []


@pytest.mark.parametrize(("part_above", "count"), [(1e-10, 0), (1e-7, 1)])
def test_feeds_may_exceed_the_limit_by_rounding_alone(part_above: float, count: int) -> None:
    path = ToolpathBuilder().line(10, 0, feed=100 * (1 + part_above))
    assert codes(path, None, *LIMITS) == [ProgramCode.FEED_ABOVE_LIMIT] * count


def test_slopes_keep_to_what_z_can() -> None:
    steep = ToolpathBuilder().line(3, 0, -0.4, feed=75)  # 4 : 30, along Z 9.9 mm/min
    assert codes(steep, None, *LIMITS) == []
    (finding,) = found(steep.line(6, 0, -0.9, feed=75), None, path_machine(*LIMITS))
    assert finding.measured == pytest.approx(75.0 * 0.5 / math.hypot(3.0, 0.5))
    assert "or slope less" in finding.message
    assert codes(ToolpathBuilder().line(z=-1, feed=11), None, *LIMITS) == [
        ProgramCode.FEED_ABOVE_LIMIT
    ]


def test_a_helix_is_as_long_as_it_is() -> None:
    turn = ToolpathBuilder((1.0, 0.0, 0.0))
    turn.arc(1, 0, -0.6, centre=(0, 0), ccw=True, feed=100)  # 6.28 round: 9.5 along Z
    assert codes(turn, None, *LIMITS) == []
    turn.arc(1, 0, -1.4, centre=(0, 0), ccw=True, feed=100)  # 12.6 along Z
    assert codes(turn, None, *LIMITS) == [ProgramCode.FEED_ABOVE_LIMIT]


def box(x: float, y: float, width: float, height: float) -> Polyline:
    corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
    return Polyline(np.array([(*corner, 0.0) for corner in corners]), closed=True)


def off_stock(job: Job, *paths: Polyline) -> list[Finding]:
    """Return the findings of planning about the stock."""
    findings = plan(drawing_of(paths), job, path_machine()).findings
    return [each for each in findings if each.code == PlanningCode.OUT_OF_STOCK]


def job_on(operation: Operation, **more: object) -> Job:
    return Job((operation,), stock=Stock(2.0, (0.0, 0.0), (40.0, 30.0)), **more)  # type: ignore[arg-type]


PROFILE = Operation(tool=Tool(3.0), depth_mm=1.0)


@given(
    x=st.floats(-60.0, 60.0),
    y=st.floats(-50.0, 50.0),
    width=st.floats(4.0, 60.0),
    height=st.floats(4.0, 50.0),
)
@examples(60)
def test_a_part_must_lie_within_the_stock(x: float, y: float, width: float, height: float) -> None:
    part, stock = shapely.box(x, y, x + width, y + height), shapely.box(0, 0, 40, 30)
    errors = [e for e in off_stock(job_on(PROFILE), box(x, y, width, height))
              if e.severity is Severity.ERROR]  # fmt: skip
    beyond = max(-x, -y, x + width - 40.0, y + height - 30.0)
    if part.within(stock):
        assert errors == []  # the tool runs beside the edge of the stock there
    elif beyond > 0.01:
        (error,) = errors
        assert ("wholly" in error.message) == (part.intersection(stock).area == 0.0)
        if "wholly" not in error.message:
            assert error.measured == pytest.approx(beyond)


def test_a_part_off_the_stock_is_a_warning_where_the_job_allows_it() -> None:
    for y in (26.0, 40.0):  # partly, and wholly
        for allow, severity in (((), Severity.ERROR), (("off-stock",), Severity.WARNING)):
            (finding,) = off_stock(job_on(PROFILE, allow=allow), box(2.0, y, 6.0, 6.0))
            assert finding.severity == severity


@given(
    x=st.floats(-30.0, 60.0),
    y=st.floats(-30.0, 50.0),
    width=st.floats(1.0, 20.0),
    height=st.floats(1.0, 20.0),
)
def test_a_clamp_reaches_the_stock(x: float, y: float, width: float, height: float) -> None:
    """Shapely tells how far a box is from the stock; one without an end is no clamp."""
    clamp = KeepOutBox("clamp", (x, x + width), (y, y + height), (5.0, 20.0))
    apart = shapely.box(*(x, y, x + width, y + height)).distance(shapely.box(0, 0, 40, 30))
    if 0.0 < apart < 0.05:
        return
    part = box(10.0, 10.0, 5.0, 5.0)
    found = off_stock(job_on(PROFILE, keep_out=(clamp,)), part)
    assert len(found) == (apart > 0.0)
    for each in found:
        assert each.severity is Severity.ERROR
        assert each.where == "[[keep_out]] 'clamp'"
        assert 0.0 < (each.measured or 0.0) <= apart + 1e-9
        assert "--allow off-stock" in each.message
    allowed = off_stock(job_on(PROFILE, keep_out=(clamp,), allow=("off-stock",)), part)
    assert [each.severity for each in allowed] == [Severity.WARNING] * len(found)
    area = replace(clamp, y_mm=(-math.inf, clamp.y_mm[1]))
    assert off_stock(job_on(PROFILE, keep_out=(area,)), part) == []


@pytest.mark.parametrize("lead", ["line", "arc"])
@given(length=st.floats(0.5, 12.0), gap=st.floats(0.0, 12.0))
@examples(30)
def test_leads_stay_over_the_stock(lead: str, length: float, gap: float) -> None:
    """A part `gap` from the left edge of the stock, which the tool reaches from there: where the
    path ends is looked up in the plan."""
    leads = {"lead_in": Lead(lead, length), "lead_out": Lead(lead, length)}
    operation = replace(PROFILE, start=(gap, 15.0), **leads)
    job = job_on(operation)
    made = planned(drawing_of([box(gap, 5.0, 20.0, 20.0)]), job, path_machine())
    (step,) = made.steps
    ends = [run.vertices[row, :2] for run in step.runs for row in (0, -1)]
    stock = shapely.box(0, 0, 40, 30)
    apart = [float(shapely.Point(end).distance(stock)) - 1.5 for end in ends]
    if any(abs(each - 0.01) < 1e-6 for each in apart):
        return
    found = [each for each in made.toolpath.findings if each.code == PlanningCode.OUT_OF_STOCK]
    assert len(found) == sum(each > 0.01 for each in apart)
    for each, beyond in zip(found, (each for each in apart if each > 0.01), strict=True):
        assert each.severity is Severity.ERROR
        assert each.measured == pytest.approx(beyond)
    allowed = off_stock(replace(job, allow=("off-stock",)), box(gap, 5.0, 20.0, 20.0))
    assert [each.severity for each in allowed] == [Severity.WARNING] * len(found)


def long_findings(drawn: Polyline, **more: object) -> list[Finding]:
    job = Job((Operation(side="on", depth_mm=1.0, **more),), allow=("long",))  # type: ignore[arg-type]
    made = plan(drawing_of([drawn]), job, path_machine())
    return [each for each in made.findings if each.code == PlanningCode.LONG]


def test_long_drawings_are_refused_or_warned_about() -> None:
    """150 m is more than any machine has; 1500 m is refused anyway."""
    wide, wider = (box(0.0, 0.0, width, 5.0) for width in (150_000.0, 1_500_000.0))
    with pytest.raises(OptionError, match="more than 100000 mm") as refused:
        plan(drawing_of([wide]), Job(), path_machine())
    assert "--allow long" in str(refused.value.mend)
    with pytest.raises(OptionError, match=r"more than 1e\+06 mm"):
        long_findings(wider)
    (finding,) = long_findings(wide)
    assert (finding.severity, finding.measured) == (Severity.WARNING, pytest.approx(150_000.0))
    assert long_findings(box(0.0, 0.0, 90_000.0, 5.0)) == []


@pytest.mark.parametrize(
    ("placement", "key"),
    [
        (Placement(scale=30_000.0), "scale"),
        (Placement(fit_mm=(150_000.0, 0.0)), "fit"),
        (Placement(copies=(2, 1), pitch_mm=(149_995.0, 0.0)), "pitch"),
        (Placement(origin=(-1_500_000.0, 0.0)), "origin"),
    ],
)
def test_what_a_flag_makes_long_names_the_flag_that_allows_it(
    placement: Placement, key: str
) -> None:
    """150 m by each key, and 1.5 km from part zero; ten times as much is refused without it."""
    square = drawing_of([box(0.0, 0.0, 5.0, 5.0)])
    job = Job((Operation(side="on", depth_mm=1.0),), placement)
    with pytest.raises(OptionError) as refused:
        plan(square, job, path_machine())
    assert refused.value.where == f"key {key}"
    assert "--allow long" in str(refused.value.mend)
    made = plan(square, replace(job, allow=("long",)), path_machine())
    assert PlanningCode.LONG in {each.code for each in made.findings}


@pytest.mark.parametrize("more", [{"scale": 300_000.0}, {"origin": (-2e7, 0.0)}])
def test_what_nothing_allows_names_no_flag(more: dict[str, object]) -> None:
    job = Job((Operation(side="on", depth_mm=1.0),), Placement(**more))  # type: ignore[arg-type]
    with pytest.raises(OptionError) as refused:
        plan(drawing_of([box(0.0, 0.0, 5.0, 5.0)]), job, path_machine())
    assert "--allow" not in str(refused.value.mend)


def test_long_programs_are_refused_or_warned_about(monkeypatch: pytest.MonkeyPatch) -> None:
    """Limits small enough for a test: ten passes round a square of four corners."""
    monkeypatch.setattr("camtool.planning.job.MAX_MOVES", 30)
    monkeypatch.setattr("camtool.planning.checks.MAX_MOVES", 30)
    square = box(0.0, 0.0, 5.0, 5.0)
    passes = Operation(side="on", depth_mm=1.0, step_down_mm=0.1)
    with pytest.raises(OptionError, match="40 moves, more than 30") as refused:
        plan(drawing_of([square]), Job((passes,)), path_machine())
    assert "--allow long" in str(refused.value.mend)
    (finding,) = long_findings(square, step_down_mm=0.1)
    assert finding.severity == Severity.WARNING
    monkeypatch.setattr("camtool.planning.job.MAX_LONG_MOVES", 35)
    with pytest.raises(OptionError, match="more than 35") as refused:
        long_findings(square, step_down_mm=0.1)
    assert "--allow" not in str(refused.value.mend)
    with pytest.raises(OptionError, match="word to allow"):
        Job(allow=("all",))


def test_each_copy_off_the_stock_is_named() -> None:
    """Three of four parts lie off it: the right ones in part, an upper one wholly."""
    place = Placement(copies=(2, 2), pitch_mm=(25.0, 32.0))
    found = off_stock(job_on(PROFILE, placement=place), box(1, 1, 20, 12))
    assert {each.severity for each in found} == {Severity.ERROR}
    told = {each.where.split(" at ")[0].split("copy ")[1]: each.message for each in found}
    assert set(told) == {"2", "3", "4"}
    assert "6 mm beyond the right edge" in told["2"]
    assert "wholly beside the stock, 3 mm beyond its upper edge" in told["3"]


@pytest.mark.parametrize(
    ("operation", "path", "severity"),
    [
        # A pocket open at the edge, a notch, a line that runs out: they may be meant.
        (Operation("pocket", tool=Tool(3.0), depth_mm=1.0), box(30, 5, 20, 10), Severity.WARNING),
        (Operation(tool=Tool(3.0), side="inside", depth_mm=1.0), box(30, 5, 20, 10),
         Severity.WARNING),
        (Operation("engrave", depth_mm=0.5), Polyline(np.array([[5, 5, 0], [50, 5, 0.0]])),
         Severity.WARNING),
        (Operation("bore", tool=Tool(3.0), depth_mm=1.0),
         Polyline(np.array([[36, 5, 1], [44, 5, 1.0]]), closed=True), Severity.WARNING),
        # Half an engraving is none, and nothing is cut in the air.
        (Operation("engrave", depth_mm=0.5), box(30, 5, 20, 10), Severity.ERROR),
        (Operation("engrave", depth_mm=0.5), Polyline(np.array([[45, 5, 0], [50, 5, 0.0]])),
         Severity.ERROR),
        (Operation("pocket", tool=Tool(3.0), depth_mm=1.0), box(45, 5, 20, 10), Severity.ERROR),
        (Operation("drill", tool=Tool(8.0, "drill"), depth_mm=1.0),
         Polyline(np.array([[46, 5, 1], [54, 5, 1.0]]), closed=True), Severity.ERROR),
    ],
)  # fmt: skip
def test_what_may_be_meant_beyond_the_edge_is_a_warning(
    operation: Operation, path: Polyline, severity: Severity
) -> None:
    (finding,) = off_stock(job_on(operation), path)
    assert finding.severity is severity
    assert "right edge" in finding.message
    assert finding.measured is not None


def test_a_point_to_drill_beside_the_stock_is_an_error() -> None:
    drawing = replace(drawing_of([]), marks=(Mark((41.0, 5.0), "0", "", "POINT 1"),
                                             Mark((39.0, 5.0), "0", "", "POINT 2")))  # fmt: skip
    drill = Operation("drill", tool=Tool(2.0, "drill"), depth_mm=1.0)
    findings = plan(drawing, job_on(drill), path_machine()).findings
    (finding,) = (each for each in findings if each.code == PlanningCode.OUT_OF_STOCK)
    assert finding.severity is Severity.ERROR
    assert "POINT 1" in finding.where
    assert finding.measured == pytest.approx(1.0)


@pytest.mark.parametrize("side", ["auto", "inside"])
@pytest.mark.parametrize("target", ["grbl", "linuxcnc", "pic-mmh"])
def test_what_shrinks_to_nothing_is_named_and_the_rest_is_cut(side: str, target: str) -> None:
    """The program is that of the drawing without these contours."""
    kept = [box(0, 0, 4, 3), box(0.5, 0.5, 1, 1)]
    circle = Polyline(np.array([[2.0, 2.0, 1], [2.4, 2.0, 1.0]]), closed=True)
    sliver = Polyline(np.array([[3.0, 0.5, 0], [3.5, 0.5, 0], [3.25, 0.501, 0.0]]), closed=True)
    job = Job((Operation(tool=Tool(0.5), depth_mm=0.1, side=side),))
    machine = load_target(target)
    texts, found = [], list[Finding]()
    for paths in (kept, [*kept, circle, sliver]):
        run = post_drawing(drawing_of(paths), job, machine, check=False)
        assert run.program is not None, run.findings
        texts.append([line for line in run.program.data.splitlines() if b"(" not in line])
        found = [each for each in run.findings if each.code == PlanningCode.CONTOUR_TOO_SMALL]
    assert texts[0] == texts[1]
    assert {each.severity for each in found} == {Severity.WARNING}
    told = {str(each.where): each.measured for each in found}
    assert told == {
        "0/PATH 2 at X 2.2000 Y 2.0000": pytest.approx(math.pi * 0.2**2),
        "0/PATH 3 at X 3.2500 Y 0.5005": pytest.approx(0.5 * 0.5 * 0.001),
    }
