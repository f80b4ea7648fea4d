"""The steps from a drawing or a program to a Run.

    post_drawing     Drawing + Job + target → program, read back, simulated and judged
    post_by_tool     the same as a program for each turn of a tool
    post_by_setup    the same as a program for each set-up of the job
    verify_program   bytes of any program → judged, against a drawing if there is one
    convert_program  bytes of a program of one target → the program of another, judged as above
    lint_program     bytes of a program → decoded, judged without its motion
    read_program     bytes of a program → decoded, not judged

Nothing here reads or writes a file."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, TypeVar

from msgspec import Struct, field

from camtool.bounds import TooLongError
from camtool.errors import OptionError, ProgramError
from camtool.findings import Finding, Severity, worst
from camtool.geometry.turn import UNTURNED
from camtool.planning.job import Job
from camtool.planning.naming import pins_of, setup_words, tool_words
from camtool.progress import Progress
from camtool.records import FrozenRecord, replace
from camtool.run import Run
from camtool.simulation.motion import ALL
from camtool.simulation.rows import block_of
from camtool.stock.findings import STOCK_NOT_JUDGED_TOOLS
from camtool.stock.moves import stock_moves_of_toolpath
from camtool.stock.slides import slide_moves
from camtool.toolpath.findings import SURFACE_FOLLOWED_NOT, SURFACE_FOLLOWED_WITHIN
from camtool.toolpath.lower import at_feed, carried_over, turned, within_feeds, without_coolant
from camtool.toolpath.moves import Kind, changes_between_cuts, feeds_below_top, toolpath_extents
from camtool.toolpath.program import Program
from camtool.toolpath.surface import Surface, follow, surface_error
from camtool.toolpath.touching import untouched_place
from camtool.verification.case import (
    TRACE_POINTS,
    WORST_LISTED,
    Case,
    VerifyOptions,
    coverage_of,
    nose_of,
    tool_mm,
)
from camtool.verification.cuts import is_flat, rapid_length_mm
from camtool.verification.engagement import ProgramSlides, judge_engagement
from camtool.verification.motion_findings import program_findings
from camtool.verification.report import (
    BaselineReport,
    Planned,
    PlannedOperation,
    PlannedStock,
    PlannedTool,
    gate_findings,
    rounded,
    stock_gate_findings,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from camtool.arrays import Bools, Floats, Indices
    from camtool.geometry.drawing import Drawing
    from camtool.machine.model import Machine
    from camtool.planning.items import Step
    from camtool.planning.job import Tool
    from camtool.planning.plan import Plan
    from camtool.simulation.motion import Effects
    from camtool.stock.before import StockBefore
    from camtool.stock.checks import StockRequest
    from camtool.stock.cut import CutStock
    from camtool.target.registry import LoadedTarget
    from camtool.toolpath.moves import CompensatedToolpath, Toolpath
    from camtool.toolpath.wanted import ProtectedRegion
    from camtool.verification.conformance import ProgramRequest
    from camtool.verification.registration import Registration
    from camtool.verification.report import Gates
    from camtool.verification.verify import Verification


T = TypeVar("T")

WALL_COVERAGES = 2.0
"""The stock is not judged within this many tolerances of coverage beside its walls."""

PLANNING = "planning"
"""The name of the stage that plans the moves of a job."""


@dataclass(frozen=True, repr=False, eq=False)
class Judging(FrozenRecord):
    """Options of judging a program.

    `found`: the contours of the drawing that the program cuts are found from the program; only the
    place of the drawing and the diameter of the tool are taken from the job. `align`: the place is
    found from the program too. `interpolator` replaces the controller's own; `effects` are the
    parts of the mechanics that act (None: all); exceeding `gates` is a finding. `worst` moves are
    listed, and `trace_points` of the slides' path are kept (None: the default numbers);
    `keep_ledger` keeps time, steps and reversals of each row."""

    interpolator: str | None = None
    effects: Effects | None = None
    gates: Gates | None = None
    worst: int | None = None
    trace_points: int | None = None
    found: bool = False
    align: bool = False
    keep_ledger: bool = False


class _Posting(Struct, frozen=True):
    """The options of `post_drawing`."""

    check: bool = True
    gates: Gates | None = None
    trace_points: int | None = None
    brief: bool = False
    is_whole: bool = True
    progress: Progress = field(default_factory=Progress)
    before: StockBefore | None = None


def post_drawing(
    drawing: Drawing,
    job: Job,
    target: LoadedTarget,
    *,
    check: bool = True,
    gates: Gates | None = None,
    trace_points: int | None = None,
    brief: bool = False,
    progress: Progress | None = None,
) -> Run:
    """Plan, write, read back, simulate and judge.

    `check=False` leaves out the last two; `brief` leaves out the shape of the part that comes out,
    and what the job would be without its measures against reversals and backlash. At most
    `trace_points` of the slides' path are kept (None: the default). `progress` is told of each
    stage. Raises OptionError, MachineError, and PostError for what the target cannot write."""
    from camtool.stock.before import planned_before

    posting = _Posting(check, gates, trace_points, brief, progress=progress or Progress())
    posting.progress.begin(PLANNING)
    posting = replace(posting, before=planned_before(drawing, job, target.machine))
    return _post_drawing(drawing, job, target, posting)


def _post_drawing(drawing: Drawing, job: Job, target: LoadedTarget, posting: _Posting) -> Run:
    """Post a job as one program, judged in the stock `posting.before`, as it is before that
    program runs."""
    from camtool.planning.plan import planned

    def plain() -> Run | None:
        other = _without_measures(job)
        if posting.brief or other == job:
            return None
        plainly = _Posting(progress=posting.progress, before=posting.before)
        return _post_drawing(drawing, other, target, plainly)

    def whole() -> Plan:
        return planned(drawing, job, target.machine, undivided=True)

    posting.progress.begin(PLANNING)
    return _post_plan(
        drawing, planned(drawing, job, target.machine), target, posting, plain, whole
    )


def post_by_tool(
    drawing: Drawing,
    job: Job,
    target: LoadedTarget,
    *,
    check: bool = True,
    gates: Gates | None = None,
    trace_points: int | None = None,
    progress: Progress | None = None,
) -> tuple[Run, ...]:
    """Post a drawing as several programs, one for each stretch between tool changes, for machines
    without a tool changer; otherwise as `post_drawing`.

    All are planned together, in one frame, so that they cut what the single program would; each is
    complete, and is judged alone against what its operations ask for."""
    from camtool.planning.plan import parted, planned, turns_of_tools
    from camtool.stock.before import planned_before

    posting = _Posting(check, gates, trace_points, progress=progress or Progress())
    machine = target.machine
    posting.progress.begin(PLANNING)
    posting = replace(posting, before=planned_before(drawing, job, machine))
    every = planned(drawing, job, machine)
    turns = turns_of_tools(every)
    posting = replace(posting, is_whole=len(turns) == 1)
    plans = parted(every, turns, drawing, machine)

    @cache
    def plains() -> tuple[Run | None, ...]:
        other = _without_measures(job)
        if other == job:
            return (None,) * len(turns)
        runs = post_by_tool(drawing, other, target, progress=progress)
        return runs if len(runs) == len(turns) else (None,) * len(turns)

    @cache
    def wholes() -> tuple[Plan, ...]:
        undivided = planned(drawing, job, machine, undivided=True)
        return parted(undivided, turns, drawing, machine, undivided=True)

    runs = []
    for k, plan in enumerate(plans):
        plain_run, whole_plan = partial(_kth_of, plains, k), partial(_kth_of, wholes, k)
        part = f"program {k + 1} of {len(plans)}" if len(plans) > 1 else ""
        runs.append(
            replace(_post_plan(drawing, plan, target, posting, plain_run, whole_plan), part=part)
        )
    return tuple(runs)


def post_by_setup(
    drawing: Drawing,
    job: Job,
    target: LoadedTarget,
    *,
    check: bool = True,
    gates: Gates | None = None,
    trace_points: int | None = None,
    progress: Progress | None = None,
) -> tuple[Run, ...]:
    """Post a drawing as several programs, one for each set-up of the job, in their order;
    otherwise as `post_drawing`.

    Each is judged in its own frame, in the stock that the set-ups before it leave. OptionError for
    a job without set-ups."""
    from camtool.stock.before import stock_before

    if not job.setups:
        raise OptionError("the job has no set-ups", where="[[setups]]", mend="post it as it is")
    posting = _Posting(check, gates, trace_points, progress=progress or Progress())
    runs: list[Run] = []
    cut: list[tuple[Job, Toolpath]] = []
    for setup in job.setups:
        setup_job = job.setup(setup.name)
        posting = replace(posting, before=stock_before(setup_job, cut))
        run = _post_drawing(drawing, setup_job, target, posting)
        runs.append(replace(run, part=f"set-up {setup.name}"))
        if run.wanted is not None:
            cut.append((setup_job, run.wanted))
    return tuple(runs)


def _kth_of(several: Callable[[], tuple[T, ...]], k: int) -> T:
    return several()[k]


def _post_plan(
    drawing: Drawing,
    plan: Plan,
    target: LoadedTarget,
    posting: _Posting,
    plain_run: Callable[[], Run | None],
    whole_plan: Callable[[], Plan],
) -> Run:
    """Write, read back and judge the program of a plan. `plain_run` returns the run of the same
    job without its measures against reversals and backlash (None if it has none), for comparison;
    `whole_plan` returns the plan with contours not divided."""
    from camtool.planning.checks import doubtful_settings

    job, progress = plan.job, posting.progress
    wanted_path = plan.toolpath
    run = Run(source=drawing.file, target=target, drawing=drawing, job=job, wanted=wanted_path)
    doubtful = doubtful_settings(
        plan.steps, target.machine, job.stock, starts_spindle=target.target.starts_spindle
    )
    findings = _merge_findings(drawing.findings, wanted_path.findings, tuple(doubtful))
    if worst(findings) >= Severity.ERROR:
        return replace(run, findings=findings)
    judged_plan = plan if posting.check else None
    del plan  # free the intermediate stages; without verification nothing reads them
    compensation = _compensate(wanted_path, target.machine) if job.compensate else None
    written = wanted_path if compensation is None else compensation.toolpath
    program, decoded = _write_and_read_back(written, target, drawing.file, progress)
    decoded = _with_operations(decoded, written, program)
    repeated = _repeated_findings(program, decoded)
    findings = _merge_findings(findings, program.findings, decoded.findings, left_out=repeated)
    turns_work = target.machine.spindle.turns == "work"
    if judged_plan is None and turns_work:
        return replace(run, program=program, decoded=decoded, findings=findings)
    if judged_plan is None:
        slides = ProgramSlides(Case(decoded, target), job)
        stock_findings = _stock_findings(slides, None, before=posting.before)
        findings = _merge_findings(findings, stock_findings)
        return replace(run, program=program, decoded=decoded, findings=findings)
    from camtool.planning.drawn import kept_of
    from camtool.stock.checks import stock_request

    plain_result = plain_run()
    # Contours that are divided at reversals are judged as the whole contours of the drawing.
    full_plan = judged_plan
    if _without_measures(job) != job and compensation is None:
        full_plan = whole_plan()
    tool, nose = tool_mm(job), nose_of(job)
    options = VerifyOptions(
        source=drawing.file,
        tool_diameter_mm=tool,
        nose=nose,
        kept=kept_of(full_plan.steps) if (tool or nose) and not posting.brief else (),
        shape=not posting.brief and not turns_work,
        trace_points=TRACE_POINTS if posting.trace_points is None else posting.trace_points,
    )
    case = Case(
        decoded,
        target,
        full_plan.toolpath,
        judged_plan.placed,
        options,
        compensation,
        written_from=written,
        row_from=_row_from(program, decoded, written),
    )
    saved = sum(step.rapid_drawn_mm - step.rapid_mm for step in judged_plan.steps)
    rapid = rapid_length_mm(written)
    figures = Planned(
        rapid_drawn_mm=rounded(rapid + saved),
        rapid_mm=rounded(rapid),
        operations=_operations(judged_plan.steps),
        tools=_tools(judged_plan.steps),
        stock=_stock(job),
        zero=job.placement.origin if job.placement.turn == UNTURNED else "set-up",
        cut_mm=_cut_mm(wanted_path),
        swept_mm=_swept_mm(wanted_path, judged_plan.steps),
        touch_mm=_touch_mm(wanted_path),
        setup=setup_words(job),
        pins_mm=pins_of(job),
        flip_error_mm=None if job.setup_of is None else job.setup_of[1].flip_error_mm,
    )
    steps = judged_plan.steps
    request = stock_request(
        steps, job, _beside_mm(case), before=posting.before, is_whole=posting.is_whole
    )
    del judged_plan, full_plan  # free the paths of the stages
    verification = _judge_program(case, program.data, progress)
    slides = ProgramSlides(case, job)
    engaged = judge_engagement(slides, request, posting.gates)
    if turns_work:
        from camtool.verification.section import section_findings

        sections = tuple(section_findings(decoded, target, steps, case.simulation))
        in_stock = (*sections, *_stock_gates(case, None, job, posting.gates))
    else:
        in_stock = _stock_findings(slides, request, findings, before=posting.before)
        in_stock = (*in_stock, *_stock_gates(case, request, job, posting.gates))
    findings = _merge_findings(findings, in_stock, engaged.findings)
    del steps
    figures = _with_times(figures, written, case, verification)
    gate_findings = _gate_findings(verification, posting.gates, findings)
    findings = _merge_findings(findings, verification.findings, gate_findings, left_out=repeated)
    verification = verification.with_planning(figures, _before_figures(plain_result))
    verification = verification.with_engagement(engaged.reports(decoded, request, in_stock))
    return replace(
        run,
        program=program,
        decoded=decoded,
        verification=verification.with_findings(findings),
        findings=findings,
        before=plain_result,
    )


def verify_program(
    data: bytes,
    target: LoadedTarget,
    *,
    source: str,
    drawing: Drawing | None = None,
    job: Job | None = None,
    judging: Judging | None = None,
    progress: Progress | None = None,
) -> Run:
    """Simulate and judge any program of the target, against `drawing` planned with `job` if given.
    ProgramError names file, block and column."""
    judging, progress = judging or Judging(), progress or Progress()
    progress.begin(f"reading {PurePath(source).name}")
    run = read_program(data, target, source=source)
    decoded = run.decoded
    assert decoded is not None
    case = Case(decoded, target)
    protected: tuple[ProtectedRegion, ...] = ()
    asked_of_stock: StockRequest | None = None
    before: StockBefore | None = None
    if drawing is not None and judging.found:
        case, job = _register_drawing(case, drawing, job or Job(), align=judging.align)
    elif drawing is not None:
        from camtool.planning.drawn import kept_of
        from camtool.planning.plan import planned
        from camtool.stock.before import planned_before
        from camtool.stock.checks import stock_request

        job_used, machine = job or Job(), target.machine
        progress.begin(PLANNING)
        plan = planned(drawing, job_used, machine)
        compensation = _compensate(plan.toolpath, machine) if job_used.compensate else None
        order = _program_request(job_used, target, plan.toolpath, compensation)
        if compensation is None and _without_measures(job_used) != job_used:
            plan = planned(drawing, job_used, machine, undivided=True)
        case = replace(
            case, wanted=plan.toolpath, drawing=plan.placed, compensated=compensation, asked=order
        )
        protected = kept_of(plan.steps)
        before = planned_before(drawing, job_used, machine)
        asked_of_stock = stock_request(plan.steps, job_used, _beside_mm(case), before=before)
    options = VerifyOptions(
        interpolator=judging.interpolator,
        effects=judging.effects or ALL,
        source=source,
        tool_diameter_mm=tool_mm(job or Job()),
        nose=nose_of(job or Job()),
        kept=protected,
        worst=WORST_LISTED if judging.worst is None else judging.worst,
        trace_points=TRACE_POINTS if judging.trace_points is None else judging.trace_points,
        keep_ledger=judging.keep_ledger,
    )
    verification = _judge_program(replace(case, options=options), data, progress)
    gate_findings = _gate_findings(verification, judging.gates)
    gate_findings = (*_stock_gates(case, asked_of_stock, job, judging.gates), *gate_findings)
    planning = case.wanted.findings if case.wanted is not None else ()
    slides = ProgramSlides(case, job)
    in_stock = _stock_findings(slides, asked_of_stock, planning, before=before)
    engaged = judge_engagement(slides, asked_of_stock, judging.gates)
    gate_findings = (*in_stock, *engaged.findings, *gate_findings)
    reports = engaged.reports(case.decoded, asked_of_stock, in_stock)
    verification = verification.with_engagement(reports)
    if gate_findings:
        verification = verification.with_findings((*verification.findings, *gate_findings))
    return replace(
        run,
        drawing=drawing,
        job=job,
        wanted=case.wanted,
        verification=verification,
        findings=verification.findings,
    )


def _register_drawing(case: Case, drawing: Drawing, job: Job, *, align: bool) -> tuple[Case, Job]:
    """Find the parts of the drawing that the program cuts. Return the case with these as its
    wanted moves, and the job with the place of the drawing and the tool diameter found from the
    program."""
    from camtool.planning.place import place
    from camtool.verification.registration import register

    placed_drawing = place(drawing, job)
    registration = register(
        case.decoded,
        placed_drawing,
        tool_diameter_mm=tool_mm(job),
        align=align,
        limit_mm=coverage_of(case.machine),
        flat_cuts=is_flat(case.decoded),
    )
    job = _found_job(job, registration)
    wanted_path = registration.wanted if registration.report.followed else None
    placed_drawing = place(drawing, job)
    return replace(
        case, wanted=wanted_path, drawing=placed_drawing, registration=registration
    ), job


def _found_job(job: Job, registration: Registration) -> Job:
    """Return the job with the tool diameter that was found from a program, and with the drawing
    placed where the program cuts it."""
    if registration.diameter_mm is not None:
        operations = tuple(
            replace(each, tool=replace(each.tool, diameter_mm=registration.diameter_mm))
            for each in job.operations
        )
        job = replace(job, operations=operations)
    x, y = registration.shift_mm
    if x or y:
        # Aligning is refused where the job says an origin, so that the drawing's zero is it.
        job = replace(job, placement=replace(job.placement, origin=(-x, -y)))
    return job


def convert_program(
    data: bytes,
    source: LoadedTarget,
    target: LoadedTarget,
    *,
    file: str,
    feed_mm_min: float | None = None,
    turn_deg: float = 0.0,
    surface: Surface | None = None,
    check: bool = True,
    progress: Progress | None = None,
) -> Run:
    """Return a program of one target as the program of another, read back and judged against the
    first.

    The second program shall make the moves that the first controller decodes. Setting part zero
    is left out, since a program begins there. Feeds that are too fast for the second machine
    become its highest feed; `feed_mm_min` replaces all feeds. The moves are turned by `turn_deg`
    counter-clockwise about part zero. With a `surface` the cuts follow it, within the machine's
    tolerance for curves, and are compared with it. ProgramError names file, block and column."""
    progress = progress or Progress()
    progress.begin(f"reading {PurePath(file).name}")
    decoded = _decode(data, source, file)
    is_same_dialect = source.machine.target.dialect == target.machine.target.dialect
    wanted_path = decoded if is_same_dialect else carried_over(decoded)
    if not target.machine.coolant.kinds:
        wanted_path = without_coolant(wanted_path)
    if feed_mm_min is not None:
        wanted_path = at_feed(wanted_path, feed_mm_min)
    else:
        wanted_path = within_feeds(wanted_path, target.machine)
    if turn_deg:
        wanted_path = turned(wanted_path, turn_deg)
    flat_path = wanted_path
    if surface is not None:
        wanted_path = follow(wanted_path, surface, target.machine.defaults.fit_tolerance_mm)
    run = Run(source=file, target=target, wanted=wanted_path)
    if worst(wanted_path.findings) >= Severity.ERROR:
        return replace(run, findings=wanted_path.findings)
    program, reread = _write_and_read_back(wanted_path, target, file, progress)
    repeated = _repeated_findings(program, reread)
    findings = _merge_findings(
        wanted_path.findings, program.findings, reread.findings, left_out=repeated
    )
    if surface is not None:
        findings = (*findings, _surface_finding(flat_path, reread, surface, target))
    if not check:
        return replace(run, program=program, decoded=reread, findings=findings)
    case = Case(
        reread,
        target,
        wanted_path,
        options=VerifyOptions(source=file),
        written_from=wanted_path,
        row_from=_row_from(program, reread, wanted_path),
    )
    verification = _judge_program(case, program.data, progress)
    findings = _merge_findings(findings, verification.findings, left_out=repeated)
    return replace(
        run,
        program=program,
        decoded=reread,
        verification=verification.with_findings(findings),
        findings=findings,
    )


def _surface_finding(
    flat: Toolpath, written: Toolpath, surface: Surface, target: LoadedTarget
) -> Finding:
    """Return the finding that says how far (mm) the cuts of a program are from the surface that
    they follow."""
    machine = target.machine
    limit = machine.defaults.fit_tolerance_mm + target.target.unit_mm(machine, machine.axes.z)
    error_mm, row = surface_error(flat, written, surface)
    if error_mm <= limit:
        return SURFACE_FOLLOWED_WITHIN(measured=error_mm, limit=limit)
    place = block_of(written, row)
    return SURFACE_FOLLOWED_NOT(where=place, measured=error_mm, limit=limit)


def read_program(data: bytes, target: LoadedTarget, *, source: str) -> Run:
    """Decode a program as the controller does, without judging it; ProgramError names the file
    too."""
    import numpy as np

    decoded = _decode(data, target, source)
    names = target.machine.target
    program = Program(data, names.extension, names.name, np.empty(0, dtype=np.int32))
    return Run(
        source=source, target=target, program=program, decoded=decoded, findings=decoded.findings
    )


def lint_program(data: bytes, target: LoadedTarget, *, source: str) -> Run:
    """Decode a program as the controller does, with all findings that need no simulation;
    ProgramError as for `read_program`."""
    run = read_program(data, target, source=source)
    assert run.decoded is not None
    case = Case(run.decoded, target)
    findings = _merge_findings(
        run.findings, program_findings(case), _stock_findings(ProgramSlides(case, None), None)
    )
    return replace(run, findings=findings)


def _decode(data: bytes, target: LoadedTarget, file: str) -> Toolpath:
    try:
        toolpath = target.target.read_in(data, target.machine, _folder_of(file))
    except ProgramError as error:
        error.file = error.file or file
        raise
    return toolpath


def _folder_of(file: str) -> Path | None:
    """Return the folder of a program's file, None if it came from no file."""
    path = Path(file)
    try:
        return path.parent if path.is_file() else None
    except (OSError, ValueError):
        return None


def _write_and_read_back(
    moves: Toolpath, target: LoadedTarget, file: str, progress: Progress
) -> tuple[Program, Toolpath]:
    """Return the program of these moves, and the toolpath that the target's controller decodes
    from its bytes; `file` names the source in errors."""
    progress.begin("writing")
    try:
        program = target.target.write(moves, target.machine)
    except TooLongError as error:
        error.file = file
        raise
    progress.begin("reading back")
    return program, target.target.read(program.data, target.machine)


def _repeated_findings(program: Program, decoded: Toolpath) -> set[Finding]:
    """Return the findings of the reader whose code the writer has reported too."""
    codes = {finding.code for finding in program.findings}
    return {finding for finding in decoded.findings if finding.code in codes}


def _operations(steps: Sequence[Step]) -> tuple[PlannedOperation, ...]:
    """Return the entries of the report for the operations that cut something."""
    from camtool.planning.checks import deepest_pass

    cutting = [step for step in steps if step.runs]
    tools = list(dict.fromkeys(step.operation.tool for step in cutting))
    rows = []
    for step in cutting:
        operation, setting = step.operation, step.setting
        in_passes = operation.contract.descent == "passes"
        rows.append(
            PlannedOperation(
                name=operation.name,
                kind=operation.kind,
                tool=tools.index(operation.tool),
                tool_name=operation.tool.name,
                tool_diameter_mm=operation.tool.diameter_mm,
                material=operation.material,
                chip_load_mm=operation.tool.feed_per_tooth_mm(
                    setting.feeds.cut_mm_min, setting.spindle_rpm
                ),
                surface_speed_m_min=operation.tool.edge_speed_m_min(setting.spindle_rpm),
                spindle_rpm=setting.spindle_rpm,
                feed_mm_min=setting.feeds.cut_mm_min,
                plunge_mm_min=setting.feeds.plunge_mm_min,
                depth_mm=rounded(_deepest_mm(step)),
                passes=len(setting.levels_mm) if in_passes else None,
                deepest_pass_mm=deepest_pass(setting) if in_passes else None,
                coolant=operation.coolant,
                chip_load_limits_mm=_open_ended(operation.tool.chip_load_mm),
                surface_speed_limits_m_min=_open_ended(operation.tool.surface_speed_m_min),
                leaves_mm=rounded(operation.allowance_mm),
                tabs=len({tuple(bridge.centre.tolist()) for bridge in step.bridges}),
            )
        )
    return tuple(rows)


def _open_ended(limits: tuple[float, float] | None) -> tuple[float, float | None] | None:
    """Return the limits, with None for an infinite upper limit."""
    if limits is None:
        return None
    return limits[0], limits[1] if math.isfinite(limits[1]) else None


def _deepest_mm(step: Step) -> float:
    """Return the greatest depth that an operation cuts, mm (positive). A carving may stay above
    the depth that it is allowed."""
    return -float(step.runs.vertices[:, 2].min())


def _tools(steps: Sequence[Step]) -> tuple[PlannedTool, ...]:
    """Return the tools of the operations that cut something, in the order of first use."""
    deepest: dict[tuple[Tool, str], float] = {}
    for step in steps:
        if step.runs:
            key = step.operation.tool, step.operation.contract.tool_shape
            deepest[key] = max(rounded(_deepest_mm(step)), deepest.get(key, 0.0))
    return tuple(
        PlannedTool(
            tool.number,
            tool.name,
            tool_words(tool, shape),
            depth,
            tool.cutting_length_mm,
            tool.stickout_mm,
            tool.holder_diameter_mm,
        )
        for (tool, shape), depth in deepest.items()
    )


def _with_times(
    planned: Planned, written: Toolpath, case: Case, verification: Verification
) -> Planned:
    """Return the operations with the time of each, s; the tool change before an operation and the
    way to its first cut count as its own."""
    import numpy as np

    if written.operations is None or case.row_from is None:
        return planned
    # Blocks that come from no row (head and end of the program) count with the row before.
    row = np.maximum.accumulate(case.row_from.clip(min=0))
    turn = np.searchsorted(written.operations.begin, row, side="right") - 1
    count = len(planned.operations)
    seconds = np.bincount(turn.clip(min=0), verification.rows.seconds, minlength=count)
    operations = [
        replace(each, time_s=rounded(float(seconds[k])))
        for k, each in enumerate(planned.operations)
    ]
    return replace(planned, operations=tuple(operations))


def _cut_mm(wanted_path: Toolpath) -> tuple[float, float, float, float] | None:
    """Return (left, low, right, high) of the area that the tools cut, mm; V bits count with their
    width at their depth. None if nothing is cut, or the operations of the moves are not known."""
    import numpy as np

    operations = wanted_path.operations
    if operations is None:
        return None
    begins = operations.begin.tolist()
    boxes, ends = [], [*begins[1:], len(wanted_path)]
    for note, low, high in zip(operations.notes, begins, ends, strict=True):
        part = wanted_path.part(low, high)
        cuts = part.is_feed if is_flat(part) else feeds_below_top(part)
        if not cuts.any():
            continue
        reach = 0.5 * note.tool.diameter_mm
        if note.tool.kind == "v" and note.tool.tip_angle_rad is not None:
            taper_reach = note.depth_mm * math.tan(0.5 * note.tool.tip_angle_rad)
            reach = min(taper_reach, reach or math.inf)
        boxes.append(toolpath_extents(part, rows=cuts)[:2] + np.array([-reach, reach]))
    return _around(boxes)


def _around(boxes: Sequence[Floats]) -> tuple[float, float, float, float] | None:
    """Return the bounding box (left, low, right, high) of boxes (2, 2) [[x, x], [y, y]]; None if
    there are none."""
    import numpy as np

    if not boxes:
        return None
    every = np.array(boxes)
    (left_x, lowest), (right, top) = every[:, :, 0].min(axis=0), every[:, :, 1].max(axis=0)
    return float(left_x), float(lowest), float(right), float(top)


def _swept_mm(
    wanted_path: Toolpath, steps: Sequence[Step]
) -> tuple[float, float, float, float] | None:
    """Return (left, low, right, high) of the area over which tools, shanks and holders pass, as
    far as their sizes are known, at any height and in rapids too, mm. None if it is not known
    which tool moves."""
    import numpy as np

    tools = [step.operation.tool for step in steps if step.runs]
    operations = wanted_path.operations
    if operations is None or len(operations.begin) != len(tools):
        return None
    begins = [0, *operations.begin[1:].tolist()]
    boxes = []
    for tool, low, high in zip(tools, begins, [*begins[1:], len(wanted_path)], strict=True):
        part = wanted_path.part(low, high)
        if part.is_motion.any():
            reach = max([tool.radius_mm, *(radius for _, radius, *_ in tool.bodies)])
            box = toolpath_extents(part, rows=part.is_motion)[:2]
            boxes.append(box + np.array([-reach, reach]))
    return _around(boxes)


def _touch_mm(wanted_path: Toolpath) -> tuple[tuple[float, float] | None, ...]:
    """Return, for each tool that is mounted during the program, a point (x, y) of the uncut top
    where it can be touched off; None if there is none."""
    rows = changes_between_cuts(wanted_path).tolist()
    return tuple(untouched_place(wanted_path, row) for row in rows)


def _stock(job: Job) -> PlannedStock | None:
    stock = job.stock
    if stock is None:
        return None
    return PlannedStock(stock.thickness_mm, stock.corner_mm, stock.size_mm, stock.through_mm)


def _gate_findings(
    verification: Verification, gates: Gates | None, findings: Iterable[Finding] = ()
) -> tuple[Finding, ...]:
    """Return a finding for each limit (gate) that the figures exceed."""
    if gates is None:
        return ()
    return tuple(gate_findings(verification.report, gates, findings))


def _compensate(wanted_path: Toolpath, machine: Machine) -> CompensatedToolpath:
    """Return the commanded moves that make the machine's slides follow `wanted_path`."""
    from camtool.planning.compensating import compensate

    return compensate(wanted_path, machine)


def _without_measures(job: Job) -> Job:
    """Return the job without its measures against reversals and backlash (order, approach moves,
    compensation)."""
    return replace(job, minimise="rapids", approach=False, compensate=False)


def _before_figures(plain_run: Run | None) -> BaselineReport | None:
    """Return the figures of the run without measures, for the report; None if there is no such
    run."""
    if plain_run is None:
        return None
    if plain_run.verification is None or plain_run.failed:
        return BaselineReport()
    report = plain_run.verification.report
    cutting, air = report.reversals.cutting, report.reversals.air
    return BaselineReport(
        cutting.x + cutting.y, air.x + air.y, report.error_um.total.max, report.time_s
    )


def _judge_program(case: Case, data: bytes, progress: Progress) -> Verification:
    """Simulate the program `data` of a case (drawing, job and machine), and return its report and
    findings."""
    from camtool.verification.verify import verify

    progress.begin("simulating and judging", len(case.decoded))
    target, machine = case.target.target, case.target.machine
    options = replace(
        case.options,
        size_bytes=len(data),
        line_bytes=target.line_bytes(data, machine),
        stray_mm=target.stray_mm(machine),
    )
    return verify(replace(case, options=options), progress)


def _beside_mm(case: Case) -> float:
    """Return how far (mm, in the plane) a wall may be off without a finding about the stock: the
    tolerance of coverage plus the distance of the planned lines from the drawing."""
    drawn = None if case.wanted is None else case.wanted.drawn
    off_mm = 0.0 if drawn is None else float(drawn.off_mm[:, 0].max(initial=0.0))
    return WALL_COVERAGES * case.coverage_mm + off_mm


NETS_THIN_MM = 2e-3
"""The slides' path is thinned by no more than this where nets of copper are proved."""


def _stock_findings(
    slides: ProgramSlides,
    request: StockRequest | None,
    planning: tuple[Finding, ...] = (),
    *,
    before: StockBefore | None = None,
) -> tuple[Finding, ...]:
    """Return the findings about the stock after a program. It is cut along the path that the
    controller decodes, or along the slides' path if the program is compensated. Only rapids are
    checked if tools are not known or have no width, or if nothing is asked for (`request` None).
    """
    from camtool.stock.rapids import rapid_findings

    case, job = slides.case, slides.job or Job()
    decoded, moves, tools = case.decoded, None, None
    findings_found: list[Finding] = []
    try:
        tools = slides.tools
        moves = stock_moves_of_toolpath(decoded, tools.index, tools.cutters)
    except OptionError as error:
        shapes = {operation.tool for operation in job.operations if operation.tool.diameter_mm}
        if request is not None and shapes:
            findings_found.append(STOCK_NOT_JUDGED_TOOLS(measured=len(shapes), mend=error.mend))
    beside_mm = WALL_COVERAGES * case.coverage_mm
    findings_found += rapid_findings(decoded, moves, job.stock, beside_mm, before)
    if moves is None or tools is None or request is None:
        return tuple(findings_found)
    if not any(cutter.radius_mm for cutter in tools.cutters):
        return tuple(findings_found)
    from camtool.stock.checks import net_findings, stock_findings

    if request.copper:
        fine = slide_moves(decoded, case.target, tools, case.simulation, thin_mm=NETS_THIN_MM)
        findings_found += net_findings(fine, request)
    if case.compensated is not None:
        moves = slides.moves
    return (*findings_found, *stock_findings(decoded, moves, request, case.depth_mm, planning))


def _stock_gates(
    case: Case, request: StockRequest | None, job: Job | None, gates: Gates | None
) -> tuple[Finding, ...]:
    """Return a finding for each limit of the stock (gouge, leftover, engagement) that the slides'
    path exceeds."""
    if gates is None or (gates.gouge_mm is None and gates.leftover_mm is None):
        return ()
    from camtool.stock.cut import cut_stock
    from camtool.stock.proofs import proved_gouge, proved_leftover

    @cache
    def cut(thin_mm: float) -> CutStock:
        return cut_stock(case.decoded, case.target, job, case.simulation, thin_mm)

    gate_findings: list[Finding] = []
    for subject, limit_mm, proved in (
        ("gouge", gates.gouge_mm, proved_gouge),
        ("leftover", gates.leftover_mm, proved_leftover),
    ):
        if limit_mm is None:
            continue
        bracket = None
        # Leftovers cannot be judged if other programs of the set-up have cut before.
        if request is not None and (request.is_whole or subject == "gouge"):
            with suppress(OptionError):
                bracket = proved(cut, request.solid, limit_mm, request.before)
        gate_findings += stock_gate_findings(subject, limit_mm, bracket)
    return tuple(gate_findings)


def _with_operations(decoded: Toolpath, written: Toolpath, program: Program) -> Toolpath:
    """Return the decoded toolpath with the operations of the written one: each decoded move gets
    the operation of the row from which it was written."""
    import numpy as np

    operations = written.operations
    if operations is None:
        return decoded
    row = np.maximum.accumulate(_row_from(program, decoded, written).clip(min=0))
    begin = np.searchsorted(row, operations.begin).astype(operations.begin.dtype)
    return replace(decoded, operations=replace(operations, begin=begin))


def _row_from(program: Program, decoded: Toolpath, written: Toolpath) -> Indices:
    """Return (N,) the row of the written toolpath for each decoded row, −1 for none.

    A canned cycle is one block, written from its first cut. Where the controller makes the same
    moves of it as were planned, each move gets its own row."""
    import numpy as np

    last = len(program.row_of_block)
    rows = np.append(program.row_of_block, np.int32(-1))[decoded.block.clip(max=last)]
    block = decoded.block.clip(min=0, max=last)
    is_cycle = program.row_of_block >= 0
    for moves, min_count in ((decoded.is_feed, 2), (decoded.kind == Kind.RAPID, 1)):
        is_cycle &= np.bincount(block[moves], minlength=last + 1)[:last] >= min_count
    cycles = np.flatnonzero(is_cycle)
    if not len(cycles):
        return np.asarray(rows)
    order = np.argsort(block, kind="stable")
    lows, highs = (np.searchsorted(block[order], cycles, side=side) for side in ("left", "right"))
    for cycle, low, high in zip(cycles, lows, highs, strict=True):
        moves = order[low:high]
        first = int(program.row_of_block[cycle]) - int(decoded.is_feed[moves].argmax())
        planned_kinds = written.kind[max(first, 0) : first + len(moves)]
        if first >= 0 and np.array_equal(decoded.kind[moves], planned_kinds):
            rows[moves] = np.arange(first, first + len(moves), dtype=rows.dtype)
    return np.asarray(rows)


def _program_request(
    job: Job,
    target: LoadedTarget,
    planned_path: Toolpath,
    compensation: CompensatedToolpath | None,
) -> ProgramRequest | None:
    """Return what the job asks of a program: the planned moves, written and read back. None if
    planning found an error (which is reported already). `compensation` is `planned_path`
    compensated against the mechanics."""
    from camtool.planning.settings import safe_z_of
    from camtool.verification.conformance import ProgramRequest

    if worst(planned_path.findings) >= Severity.ERROR:
        return None
    machine = target.machine
    wanted_path = planned_path if compensation is None else compensation.toolpath
    program = target.target.write(wanted_path, machine)
    units = [target.target.unit_mm(machine, axis) for axis in machine.axes]
    written = target.target.read(program.data, machine)
    return ProgramRequest(
        written=written,
        wanted=wanted_path,
        unit_mm=max(units[:2]),
        unit_z_mm=units[2],
        feed_named=_is_feed_named(
            job, machine, wanted_path, _row_from(program, written, wanted_path)
        ),
        feed_unit_mm_min=machine.feed.unit_mm_min,
        safe_z_mm=safe_z_of(job, machine),
        safe_z_named=job.safe_z_mm is not None,
    )


def _is_feed_named(job: Job, machine: Machine, wanted_path: Toolpath, row_from: Indices) -> Bools:
    """Return the mask (N,) of written rows whose feed the job names, or follows from one that it
    names. `row_from` (N,): the row of `wanted_path` for each of them, −1 for none."""
    import numpy as np

    from camtool.planning.settings import feeds_of

    named: list[float] = []
    for operation in job.operations:
        feeds = feeds_of(operation, machine)
        if operation.feed_mm_min is not None:
            named += [feeds.cut_mm_min, feeds.plunge_mm_min]
        elif operation.plunge_feed_mm_min is not None:
            named.append(feeds.plunge_mm_min)
    return np.asarray(np.isin(wanted_path.feed[row_from], named) & (row_from >= 0))


def _merge_findings(
    *groups: tuple[Finding, ...], left_out: Collection[Finding] = ()
) -> tuple[Finding, ...]:
    """Return all findings in order, without repeats and without those `left_out`."""
    every = dict.fromkeys(finding for group in groups for finding in group)
    return tuple(finding for finding in every if finding not in left_out)
