"""The plan: a drawing and a job become the toolpath of a machine.

    drawing ─place─▶ in the work frame ─choose─▶ paths of an operation ─its kind─▶ items
    items ─reversals─▶ items ─order─▶ items with start and direction ─runs─▶ runs
    runs of all operations ─link─▶ toolpath ─▶ checked

Operations follow each other as the job lists them; each is put into order on its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import chain
from pathlib import PurePath

import numpy as np
from msgspec import Struct

from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.drawing import Drawing, is_text
from camtool.geometry.measure import path_lengths
from camtool.geometry.polylines import Polylines
from camtool.machine.model import Machine
from camtool.planning.checks import checked
from camtool.planning.contours import runs_of, with_starts
from camtool.planning.drawn import drawn_of
from camtool.planning.findings import (
    FIT_COARSE,
    MARKS_NOT_CUT,
    NOTHING_DRAWN,
    NOTHING_DRAWN_BUT_PATHS,
    TEXT_AS_EDGE,
    PlanningCode,
)
from camtool.planning.finish import in_passes, of_stage
from camtool.planning.gouges import branch_findings, side_findings
from camtool.planning.items import (
    Chosen,
    Contour,
    Fixed,
    Items,
    Runs,
    Setting,
    Step,
    Work,
    contours_of,
)
from camtool.planning.job import Job, Operation, Tool, refuse_endless
from camtool.planning.kinds import function_of
from camtool.planning.leads import KeepOut
from camtool.planning.link import link
from camtool.planning.naming import key_of, operation_name, setup_heading
from camtool.planning.order import (
    Point,
    best_order,
    choices_of,
    chosen_paths,
    drawn_order,
    must_precede,
    travel_mm,
)
from camtool.planning.pins import pin_findings, with_pins
from camtool.planning.place import SCALE_SHARE, collapse_findings, place
from camtool.planning.settings import setting_of
from camtool.planning.sides import Sides, choose, runs_beside, takes_mark
from camtool.planning.tabs import middle_of_longest_gap, raised_over_bridges, with_tabs
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Toolpath

HOME: Point = (0.0, 0.0)

MAX_OVERLAPS = 20


class Plan(Struct, frozen=True, eq=False):
    """The results of all stages of planning: the job, the drawing in the work frame, the steps,
    and the toolpath."""

    job: Job
    placed: Drawing
    steps: tuple[Step, ...]
    toolpath: Toolpath


def plan(drawing: Drawing, job: Job, machine: Machine) -> Toolpath:
    """Return the toolpath that cuts the drawing, in the work frame, with the findings of planning.

    OptionError if the drawing or the machine does not allow what the job asks."""
    return planned(drawing, job, machine).toolpath


def planned(drawing: Drawing, job: Job, machine: Machine, *, undivided: bool = False) -> Plan:
    """Plan the drawing and return the result of every stage; see `plan`.

    `undivided`: return the plan with which verification compares a program. Contours that were
    divided into runs to avoid axis reversals are left whole. Those that were not keep their chosen
    start points, on which ramps, leads and tabs depend. No approach moves are added."""
    if job.setups:
        names = ", ".join(setup.name for setup in job.setups)
        raise OptionError(
            "the job has several set-ups, and a program cuts one of them",
            where="table [[setups]]",
            mend=f"name one with --setup: {names}",
        )
    placed_drawing = place(drawing, job)
    sides = Sides.of(placed_drawing, _with_all_setups(job), machine.defaults.cut_depth_mm)
    tool_place: Point = HOME
    steps: list[Step] = []
    settings = [setting_of(operation, job, machine) for operation in job.operations]
    for rank, setting in enumerate(settings, 1):
        end_place = machine.defaults.park_mm if rank == len(settings) else None
        ends = tool_place, end_place
        step = _step(placed_drawing, job, setting, machine, ends, sides, steps)
        end = _end(step.runs, tool_place)
        if undivided and _is_divided(job, setting.operation):
            plain_job = replace(job, minimise="rapids")
            step = _step(placed_drawing, plain_job, setting, machine, ends, sides, steps)
        tool_place = end
        steps.append(step)
    steps = _rested(_sparing(steps))
    unlinked = Plan(job, placed_drawing, tuple(steps), ToolpathBuilder().finish())
    return _linked(unlinked, drawing, job, machine, undivided=undivided)


def _with_all_setups(job: Job) -> Job:
    """Return the job with the operations of the part's other set-ups after its own: edges that are
    cut in these are edges too."""
    other_operations = [each for each in job.whole.operations if each not in job.operations]
    return (
        replace(job, operations=(*job.operations, *other_operations)) if other_operations else job
    )


def _linked(
    plan: Plan, drawing: Drawing, full_job: Job, machine: Machine, *, undivided: bool
) -> Plan:
    """Return the plan with the toolpath of its steps; its own job may be a part of `full_job`."""
    job, placed_drawing, steps = plan.job, plan.placed, plan.steps
    worked = [(step.setting, step.runs) for step in steps]
    approaches = None
    if not undivided and (job.approach or job.minimise == "reversals"):
        from camtool.planning.reversing import Approaches

        approaches = partial(Approaches, machine)
    builder = link(worked, machine, approaches)
    toolpath = builder.finish()
    findings = collapse_findings(drawing, placed_drawing, job)
    findings += [finding for step in steps for finding in step.findings]
    findings += _left_over(placed_drawing, full_job, any(step.runs for step in steps))
    findings += _coarse(drawing, placed_drawing)
    findings += pin_findings(placed_drawing, job)
    findings += checked(toolpath, job, machine, steps)
    made_from = PurePath(drawing.file).name
    toolpath = replace(
        toolpath,
        findings=tuple(findings),
        made_from=made_from,
        setup=setup_heading(job),
        tabs_mm=_tabs(steps),
        drawn=drawn_of(toolpath, builder.runs, steps, placed_drawing, job.stock),
    )
    return replace(plan, toolpath=toolpath)


def _tabs(steps: Sequence[Step]) -> tuple[tuple[float, float], ...]:
    """Return the places of all tabs, without repeats."""
    places = [tuple(bridge.centre.tolist()) for step in steps for bridge in step.bridges]
    return tuple(dict.fromkeys((float(x), float(y)) for x, y in places))


def turns_of_tools(plan: Plan) -> list[list[int]]:
    """Return the indices of the plan's steps in groups, one for each stretch between tool changes.
    Steps that cut nothing belong to the group before them."""
    turns: list[list[int]] = [[]]
    tool: Tool | None = None
    for index, step in enumerate(plan.steps):
        if step.runs:
            own_tool = step.operation.tool
            same_tool = tool is None or tool == own_tool
            if not (
                same_tool or (tool and tool.number is not None and tool.number == own_tool.number)
            ):
                turns.append([])
            tool = own_tool
        turns[-1].append(index)
    return turns


def parted(
    plan: Plan,
    turns: Sequence[Sequence[int]],
    drawing: Drawing,
    machine: Machine,
    *,
    undivided: bool = False,
) -> tuple[Plan, ...]:
    """Return a plan for each group of steps in `turns`, in the frame of the whole plan and with
    the cuts of that; what steps leave for each other, and the sides on which they cut, are
    therefore the same."""
    parts = []
    for turn in turns:
        steps = tuple(plan.steps[index] for index in turn)
        job = replace(plan.job, operations=tuple(step.operation for step in steps))
        part = replace(plan, job=job, steps=steps)
        parts.append(_linked(part, drawing, plan.job, machine, undivided=undivided))
    return tuple(parts)


def _coarse(drawing: Drawing, placed_drawing: Drawing) -> Iterator[Finding]:
    """Yield FIT_COARSE if curves were fitted for a smaller scale than that of the job."""
    if not drawing.fit.max_mm or not placed_drawing.fit.max_mm:
        return
    scale = placed_drawing.fit.max_mm / drawing.fit.max_mm
    if scale > drawing.made_for * (1.0 + SCALE_SHARE):
        yield FIT_COARSE(
            where=placed_drawing.file,
            measured=placed_drawing.fit.max_mm,
            read=drawing.made_for,
            scale=scale,
            off_um=placed_drawing.fit.max_mm * 1000.0,
        )


def _step(
    placed_drawing: Drawing,
    job: Job,
    setting: Setting,
    machine: Machine,
    ends: tuple[Point, Point | None],
    sides: Sides,
    before: Sequence[Step],
) -> Step:
    """Plan one operation, from what it takes to its runs. `ends`: the point from which the tool
    comes, and the one to which it goes (None: it stays). `before`: the steps so far; for a
    finishing stage the last of these is its roughing."""
    chosen = choose(placed_drawing, setting.operation, sides)
    chosen = with_pins(chosen, placed_drawing, job, setting.operation)
    if setting.operation.engagement_rad is not None:
        from camtool.planning.air import air_after

        chosen = replace(chosen, air=tuple(chain.from_iterable(map(air_after, before))))
    work: Work = function_of(setting.operation.contract.work)(chosen, setting)
    items, tab_findings = work.items, list[Finding]()
    if contours := contours_of(items):
        contours, tab_findings = with_tabs(_with_starts(contours))
        contours = _begun_between_tabs(contours)
        if setting.operation.stage == "finish":
            contours, pass_findings = in_passes(contours, setting, before[-1])
            tab_findings += pass_findings
        items = contours
    sided = side_findings(work, chosen, sides, setting.operation)
    unclear = branch_findings(placed_drawing.healing.branches, chosen, sides, setting.operation)
    findings = of_stage(setting.operation, [*unclear, *work.findings, *sided, *tab_findings])
    findings = [*_text_as_edge(placed_drawing, chosen, setting.operation, findings), *findings]
    choices = choices_of(items)
    drawn_mm = travel_mm(choices, drawn_order(choices), *ends)
    if job.minimise == "reversals":
        from camtool.planning.reversing import fewer_reversals

        items, reversal_findings = fewer_reversals(items, machine)
        findings += reversal_findings
        choices = choices_of(items)
    _refuse_endless(items, setting)
    rows = best_order(choices, must_precede(items), *ends)
    order = choices.owner[rows]
    bridges = work.bridges
    if contours := contours_of(items):
        paths = chosen_paths(contours, choices, rows)
        cut = runs_of(contours, order, paths, _walls(placed_drawing, sides, setting.operation))
        runs, counts, bridges = cut.runs, cut.counts, cut.bridges
        findings += of_stage(setting.operation, cut.findings)
    else:
        fixed = [item for item in items if isinstance(item, Fixed)]
        each = [fixed[k].runs for k in order.tolist()]
        runs, counts = Runs.of(chain.from_iterable(each)), tuple(map(len, each))
    return Step(
        operation=setting.operation,
        setting=setting,
        chosen=chosen,
        items=items,
        runs=runs,
        owner=np.repeat(order, counts),
        findings=tuple(findings),
        rapid_drawn_mm=drawn_mm,
        rapid_mm=travel_mm(choices, rows, *ends),
        bridges=bridges,
    )


def _text_as_edge(
    placed_drawing: Drawing, chosen: Chosen, operation: Operation, findings: Sequence[Finding]
) -> Iterator[Finding]:
    """Yield a finding if outlines of text are cut as edges and the tool has no room beside some of
    them."""
    if not runs_beside(operation):
        return
    text = [
        name
        for name, source, closed in zip(
            chosen.names, chosen.source.tolist(), chosen.lines.closed.tolist(), strict=True
        )
        if closed and is_text(placed_drawing.sources[source])
    ]
    spoilt = (ProgramCode.GOUGE, PlanningCode.CONTOUR_TOO_SMALL)
    places = [each.where or "" for each in findings if each.code in spoilt]
    if any(place.startswith(f"{name} at ") for name in set(text) for place in places):
        yield TEXT_AS_EDGE(where=operation_name(operation), measured=len(text))


def _is_divided(job: Job, operation: Operation) -> bool:
    """Return True if contours of the operation are divided into runs to avoid reversals."""
    if job.minimise != "reversals":
        return False
    from camtool.planning.reversing import may_divide

    return may_divide(operation)


def _sparing(steps: list[Step]) -> list[Step]:
    """Return the steps with their runs raised over the bridges of all tabs, whichever step leaves
    them. Fixed items keep away from their own."""
    bridges = [bridge for step in steps for bridge in step.bridges]
    if not bridges:
        return steps
    spared = []
    for step in steps:
        own = {id(bridge) for bridge in step.bridges if not contours_of(step.items)}
        others = [bridge for bridge in bridges if id(bridge) not in own]
        raised = raised_over_bridges(step.runs, step.operation, step.setting.feeds, others)
        findings = (*step.findings, *of_stage(step.operation, raised.findings))
        spared.append(replace(step, runs=raised.runs, findings=findings))
    return spared


def _rested(steps: list[Step]) -> list[Step]:
    """Return the steps without findings about material that another step clears."""
    rest_names = [step.operation.rest for step in steps if step.operation.rest_of is not None]
    codes = (PlanningCode.UNREACHED, PlanningCode.DEPTH_LIMITED)
    return [
        replace(step, findings=tuple(each for each in step.findings if each.code not in codes))
        if step.operation.name and step.operation.name in rest_names
        else step
        for step in steps
    ]


def _refuse_endless(items: Items, setting: Setting) -> None:
    """Raise OptionError for passes or an overlap that would follow the contours too many times."""
    operation, passes = setting.operation, len(setting.levels_mm)
    paths = [contour.path for contour in contours_of(items)]
    if passes > 1:
        refuse_endless(
            passes * float(sum(len(path.vertices) for path in paths)),
            key_of(operation, "step_down"),
            f"{passes} passes",
            "give a larger step",
            is_long=operation.may_be_long,
        )
    closed = [path for path in paths if path.closed]
    if operation.overlap_mm > 0.0 and closed:
        shortest = float(path_lengths(Polylines.of(closed)).min())
        if operation.overlap_mm > MAX_OVERLAPS * shortest:
            raise OptionError(
                f"an overlap of {operation.overlap_mm:g} mm goes"
                f" {operation.overlap_mm / shortest:.3g} times round a contour of"
                f" {shortest:.4g} mm",
                where=key_of(operation, "overlap"),
                mend=f"give {MAX_OVERLAPS * shortest:.4g} mm or less",
            )


def _walls(placed_drawing: Drawing, sides: Sides, operation: Operation) -> KeepOut:
    """Return the closed lines that leads must keep away from: those of the operation itself, and
    those along which any operation makes walls."""
    count = len(placed_drawing.paths)
    makers = [each.contract.leaves_walls for each in sides.operations]
    is_own, walls = sides.taken_by(operation)[:count], sides.cuts[makers, :count].any(axis=0)
    rows = np.flatnonzero((is_own | walls) & placed_drawing.paths.closed)
    return KeepOut(placed_drawing.paths.select(rows.tolist()), is_own[rows])


def _with_starts(contours: list[Contour]) -> list[Contour]:
    """Return the contours, closed ones with the starts that their operation's rule allows."""
    if contours[0].setting.operation.start == "nearest":
        return contours
    contours_made = []
    for contour in contours:
        operation = contour.setting.operation
        path, starts = with_starts(contour.path, operation.start, operation.away_mm)
        contours_made.append(replace(contour, path=path, starts=starts))
    return contours_made


def _begun_between_tabs(contours: list[Contour]) -> list[Contour]:
    """Return the contours; those with tabs placed by hand begin as far from these as possible,
    unless a rule says where, since no tab can stand where a contour begins."""
    contours_made = []
    for contour in contours:
        tabs = contour.setting.operation.tabs
        if tabs and tabs.at_mm and contour.path.closed and not len(contour.starts):
            path, starts = with_starts(
                contour.path, middle_of_longest_gap(contour.path, tabs.at_mm), 0.0
            )
            contour = replace(contour, path=path, starts=starts)
        contours_made.append(contour)
    return contours_made


def _end(runs: Runs, tool_place: Point) -> Point:
    """Return the place (x, y), mm, where the tool comes up after the runs; `tool_place` if there
    are none."""
    if not len(runs):
        return tool_place
    x, y = runs.vertices[-1, :2].tolist()
    return x, y


def _left_over(placed_drawing: Drawing, job: Job, cuts: bool) -> list[Finding]:
    """Return findings about what is drawn and not cut: points that are not drilled, or the whole
    drawing."""
    findings: list[Finding] = []
    drills = [operation for operation in job.operations if operation.contract.takes == "holes"]
    uncut_marks = [
        mark
        for mark in placed_drawing.marks
        if job.takes(mark.layer, mark.colour)
        and not any(takes_mark(operation, mark) for operation in drills)
    ]
    if uncut_marks:
        findings.append(MARKS_NOT_CUT(measured=len(uncut_marks)))
    if not cuts and (len(placed_drawing.paths) or placed_drawing.marks):
        findings.append(
            (NOTHING_DRAWN_BUT_PATHS if len(placed_drawing.paths) else NOTHING_DRAWN)(
                where=placed_drawing.file
            )
        )
    return findings
