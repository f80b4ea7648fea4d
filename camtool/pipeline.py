"""The whole way in five calls: what the commands and batches run.

    post_drawing     Drawing + Job + target → program, read back, simulated and judged
    verify_program   bytes of a program (anybody's) → judged, against a drawing if there is one
    convert_program  bytes of one target's program → the program of another, judged as above
    picture          any of the values on the way → the scene that `camtool.preview` draws
    compare_program  one program, run several ways

Nothing here reads or writes a file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import TYPE_CHECKING, get_args

from camtool.errors import OptionError, ProgramError
from camtool.findings import Finding, Severity, worst
from camtool.patterns import guess
from camtool.units import UM_PER_MM

if TYPE_CHECKING:
    from collections.abc import Iterator

    from camtool.arrays import Bools, Floats
    from camtool.geometry.drawing import Drawing
    from camtool.machine.controllers import Interpolator
    from camtool.machine.model import Machine
    from camtool.machine.registry import LoadedTarget
    from camtool.pictures.overlay import Overlay
    from camtool.pictures.scene import Line, Playback, Round, Scene, Table, Worst
    from camtool.planning.items import Step
    from camtool.planning.job import Job
    from camtool.simulation.motion import Effects
    from camtool.toolpath.moves import Bent, Toolpath
    from camtool.toolpath.program import Listing, Program
    from camtool.toolpath.wanted import Kept
    from camtool.verification.case import Cone
    from camtool.verification.conformance import Asked
    from camtool.verification.contrast import Variant
    from camtool.verification.report import Before, Gates, PlannedOperation, Report
    from camtool.verification.verify import Verification, VerifyOptions


__all__ = [
    "Judging",
    "Posted",
    "Way",
    "compare_picture",
    "compare_program",
    "convert_program",
    "listing_of",
    "picture",
    "points_for",
    "post_drawing",
    "posted_scene",
    "read_program",
    "verify_program",
]


# Programs made, read back and judged: of a drawing, of any program, of another program.


@dataclass(frozen=True)
class Judging:
    """How a program is judged: the interpolator in place of the controller's own, the parts of
    the mechanics that act (None: all), the limits that make findings (None: none), and whether
    it was posted bent against the mechanics; how many of the worst moves are listed, and how many
    points of the slides' path are kept (None: as usual)."""

    interpolator: Interpolator | None = None
    effects: Effects | None = None
    gates: Gates | None = None
    compensated: bool = False
    worst: int | None = None
    trace_points: int | None = None


@dataclass(frozen=True, eq=False)
class Goal:
    """What a program is held against: the wanted toolpath, the drawing in its frame, what was
    sent where that was bent, what else the job asks for, and what it was written from; None where
    there is none."""

    wanted: Toolpath | None = None
    drawing: Drawing | None = None
    sent: Bent | None = None
    asked: Asked | None = None
    said: Toolpath | None = None


@dataclass(frozen=True, eq=False)
class Posted:
    """What `post_drawing` made. `program` is None when planning found an error; `verification`
    is None then, and when it was not asked for. `findings` are those of all stages. `before` is
    the same job without what it does against reversals and play, where it does any of that."""

    wanted: Toolpath
    program: Program | None
    decoded: Toolpath | None
    verification: Verification | None
    findings: tuple[Finding, ...]
    before: Posted | None = None

    @property
    def failed(self) -> bool:
        """True when a finding is an error: such a program must not be written."""
        return worst(self.findings) >= Severity.ERROR


def post_drawing(
    drawing: Drawing,
    job: Job,
    target: LoadedTarget,
    *,
    check: bool = True,
    compensate: bool = False,
    gates: Gates | None = None,
    trace_points: int | None = None,
) -> Posted:
    """Plan, write, read back, simulate and judge; `check=False` leaves out the last two;
    `compensate` bends what is written against the machine's mechanics; `trace_points` of the
    slides' path are kept at most (None: as usual)."""
    from camtool.planning.checks import doubts
    from camtool.planning.plan import planned

    plan = planned(drawing, job, target.machine)
    wanted = plan.toolpath
    doubtful = doubts(plan.steps, starts_spindle=getattr(target.post, "starts_spindle", False))
    findings = _merged(drawing.findings, wanted.findings, tuple(doubtful))
    if worst(findings) >= Severity.ERROR:
        return Posted(wanted, None, None, None, findings)
    sent = _bent(wanted, target.machine) if compensate else None
    written = wanted if sent is None else sent.toolpath
    program = target.post.write(written, target.machine)
    decoded = target.post.read(program.data, target.machine)
    # What the writer said of its blocks, the reader need not say again in other words.
    said = {finding.code for finding in program.findings}
    repeated = {finding for finding in decoded.findings if finding.code in said}
    findings = _merged(findings, program.findings, decoded.findings, without=repeated)
    if not check:
        return Posted(wanted, program, decoded, None, findings)
    from camtool.planning.drawn import kept_of
    from camtool.verification.case import TRACE_POINTS
    from camtool.verification.report import Planned, certain
    from camtool.verification.verify import VerifyOptions

    plain = _plainly(drawing, job, target, compensate=compensate)
    # Runs that never turn back are judged by the whole contours that they are parts of.
    whole = plan
    if _plain(job) != job and sent is None:
        whole = planned(drawing, job, target.machine, undivided=True)
    verification = _judged(
        program.data,
        decoded,
        target,
        Goal(whole.toolpath, plan.placed, sent, said=written),
        VerifyOptions(
            source=drawing.file,
            tool_diameter_mm=tool_mm(job),
            cone=cone_of(job),
            kept=kept_of(whole.steps),
            trace_points=trace_points or TRACE_POINTS,
        ),
    )
    beyond = _beyond(verification, gates)
    findings = _merged(findings, verification.findings, beyond, without=repeated)
    verification = verification.with_planning(
        Planned(
            rapid_drawn_mm=certain(sum(step.rapid_drawn_mm for step in plan.steps)),
            rapid_mm=certain(sum(step.rapid_mm for step in plan.steps)),
            operations=tuple(_reported(step) for step in plan.steps if step.runs),
        ),
        _before(plain),
    )
    judged = verification.with_findings(findings)
    return Posted(wanted, program, decoded, judged, findings, plain)


def verify_program(
    data: bytes,
    target: LoadedTarget,
    *,
    source: str,
    drawing: Drawing | None = None,
    job: Job | None = None,
    judging: Judging | None = None,
) -> tuple[Toolpath, Verification]:
    """(decoded toolpath, verification) of any program of the target; against `drawing` planned
    with `job` when there is one. ProgramError names file, block and column."""
    from camtool.planning.job import Job
    from camtool.simulation.motion import ALL
    from camtool.verification.case import TRACE_POINTS, WORST_LISTED
    from camtool.verification.verify import VerifyOptions

    judging = judging or Judging()
    decoded = read_program(data, target, source)
    goal = Goal()
    kept: tuple[Kept, ...] = ()
    if drawing is not None:
        from camtool.planning.drawn import kept_of
        from camtool.planning.plan import planned

        wanted, machine = job or Job(), target.machine
        plan = planned(drawing, wanted, machine)
        sent = _bent(plan.toolpath, machine) if judging.compensated else None
        asked = _asked(wanted, target, plan.toolpath, sent)
        if sent is None and _plain(wanted) != wanted:
            plan = planned(drawing, wanted, machine, undivided=True)
        goal, kept = Goal(plan.toolpath, plan.placed, sent, asked), kept_of(plan.steps)
    options = VerifyOptions(
        interpolator=judging.interpolator,
        effects=judging.effects or ALL,
        source=source,
        tool_diameter_mm=tool_mm(job or Job()),
        cone=cone_of(job or Job()),
        kept=kept,
        worst=WORST_LISTED if judging.worst is None else judging.worst,
        trace_points=judging.trace_points or TRACE_POINTS,
    )
    found = _judged(data, decoded, target, goal, options)
    beyond = _beyond(found, judging.gates)
    return decoded, found.with_findings((*found.findings, *beyond)) if beyond else found


def convert_program(
    data: bytes,
    source: LoadedTarget,
    target: LoadedTarget,
    *,
    file: str,
    feed_mm_min: float | None = None,
    check: bool = True,
) -> Posted:
    """A program of one target as the program of another, read back and judged against the first.

    What the first controller decodes is what the second one shall do; where its part zero was set
    is left out, since a program begins there. Cuts that are too fast for the second machine get
    its highest feed; `feed_mm_min` takes the place of all feeds. ProgramError names file, block
    and column.
    """
    from camtool.toolpath.lower import at_feed, carried_over, within_feeds
    from camtool.verification.verify import VerifyOptions

    decoded = read_program(data, source, file)
    same = source.machine.target.dialect == target.machine.target.dialect
    wanted = decoded if same else carried_over(decoded)
    if feed_mm_min is not None:
        wanted = at_feed(wanted, feed_mm_min)
    else:
        wanted = within_feeds(wanted, target.machine)
    if worst(wanted.findings) >= Severity.ERROR:
        return Posted(wanted, None, None, None, wanted.findings)
    program = target.post.write(wanted, target.machine)
    again = target.post.read(program.data, target.machine)
    said = {finding.code for finding in program.findings}
    repeated = {finding for finding in again.findings if finding.code in said}
    findings = _merged(wanted.findings, program.findings, again.findings, without=repeated)
    if not check:
        return Posted(wanted, program, again, None, findings)
    options = VerifyOptions(source=file)
    judged = _judged(program.data, again, target, Goal(wanted, said=wanted), options)
    findings = _merged(findings, judged.findings, without=repeated)
    return Posted(wanted, program, again, judged.with_findings(findings), findings)


def _reported(step: Step) -> PlannedOperation:
    """How an operation cuts, for the report."""
    from camtool.planning.checks import IN_PASSES, deepest_pass
    from camtool.verification.report import PlannedOperation

    operation, setting = step.operation, step.setting
    in_passes = operation.kind in IN_PASSES
    return PlannedOperation(
        name=operation.name,
        kind=operation.kind,
        tool_diameter_mm=operation.tool.diameter_mm,
        spindle_rpm=operation.spindle_rpm,
        feed_mm_min=setting.feeds.cut_mm_min,
        plunge_mm_min=setting.feeds.plunge_mm_min,
        depth_mm=-setting.levels_mm[-1],
        passes=len(setting.levels_mm) if in_passes else None,
        deepest_pass_mm=deepest_pass(setting) if in_passes else None,
    )


def _beyond(verification: Verification, gates: Gates | None) -> tuple[Finding, ...]:
    """What exceeds the limits."""
    if gates is None:
        return ()
    from camtool.verification.report import gate_findings

    return tuple(gate_findings(verification.report, gates))


def _bent(wanted: Toolpath, machine: Machine) -> Bent:
    """What the controller must be told for its slides to come out on `wanted`."""
    from camtool.planning.compensating import compensated

    return compensated(wanted, machine)


def _plain(job: Job) -> Job:
    """The job without what it does against reversals."""
    return replace(job, minimise="rapids", approach=False)


def _plainly(
    drawing: Drawing, job: Job, target: LoadedTarget, *, compensate: bool
) -> Posted | None:
    """The job made without what is done against reversals and play; None when nothing is."""
    plain = _plain(job)
    return None if plain == job and not compensate else post_drawing(drawing, plain, target)


def _before(plain: Posted | None) -> Before | None:
    """Its figures, for the report."""
    from camtool.verification.report import Before

    if plain is None:
        return None
    if plain.verification is None or plain.failed:
        return Before()
    report = plain.verification.report
    cutting, air = report.reversals.cutting, report.reversals.air
    return Before(cutting.x + cutting.y, air.x + air.y, report.error_um.total.max, report.time_s)


def read_program(data: bytes, target: LoadedTarget, file: str) -> Toolpath:
    """The decoded program; ProgramError names the file too."""
    try:
        toolpath: Toolpath = target.post.read(data, target.machine)
    except ProgramError as error:
        error.file = error.file or file
        raise
    return toolpath


def tool_mm(job: Job) -> float | None:
    """The diameter of the one tool that all operations cut with, mm; None for several or none."""
    diameters = {operation.tool.diameter_mm for operation in job.operations}
    return (diameters.pop() or None) if len(diameters) == 1 else None


def cone_of(job: Job) -> Cone | None:
    """The shape of the V bit that all operations cut with; None for other tools, and several."""
    from camtool.verification.case import Cone

    tools = [operation.tool for operation in job.operations]
    shapes = {(tool.kind, tool.tip_angle_rad, tool.tip_diameter_mm) for tool in tools}
    if len(shapes) != 1:
        return None
    kind, angle, tip = shapes.pop()
    return Cone(0.5 * tip, math.tan(0.5 * angle)) if kind == "v" and angle is not None else None


def _judged(
    data: bytes, decoded: Toolpath, target: LoadedTarget, goal: Goal, options: VerifyOptions
) -> Verification:
    """Simulated, and compared with what was wanted and drawn."""
    from camtool.verification.verify import verify

    line_bytes = getattr(target.post, "line_bytes", None)
    sent = len(data) if line_bytes is None else line_bytes(data, target.machine)
    stray_mm = getattr(target.post, "stray_mm", None)
    stray = 0.0 if stray_mm is None else stray_mm(target.machine)
    sized = replace(options, size_bytes=len(data), line_bytes=sent, stray_mm=stray)
    return verify(
        decoded,
        target.machine,
        wanted=goal.wanted,
        drawing=goal.drawing,
        options=sized,
        sent=goal.sent,
        asked=goal.asked,
        said=goal.said,
    )


def _asked(job: Job, target: LoadedTarget, planned: Toolpath, sent: Bent | None) -> Asked | None:
    """What the job asks for, in moves as the dialect would say them; None where it asks for what
    cannot be made, which is said already. `sent` is `planned` bent against the mechanics."""
    from camtool.planning.settings import safe_z_of
    from camtool.verification.conformance import Asked

    if worst(planned.findings) >= Severity.ERROR:
        return None
    machine = target.machine
    wanted = planned if sent is None else sent.toolpath
    program = target.post.write(wanted, machine)
    unit = getattr(target.post, "unit_mm", None)
    units = [
        max(axis.coded_step_mm, axis.resolution_mm or 0.0) if unit is None else unit(machine)
        for axis in machine.axes
    ]
    written, blocks = target.post.read(program.data, machine), len(program.row_of_block)
    return Asked(
        written=written,
        wanted=wanted,
        unit_mm=max(units[:2]),
        unit_z_mm=units[2],
        feed_said=_feed_said(job, machine, wanted, program)[written.block.clip(max=blocks)],
        feed_unit_mm_min=machine.feed.unit_mm_min,
        safe_z_mm=safe_z_of(job, machine),
        safe_z_said=job.safe_z_mm is not None,
    )


def _feed_said(job: Job, machine: Machine, wanted: Toolpath, program: Program) -> Bools:
    """(B + 1,) the blocks of a program whose feed the job names, or derives from what it names;
    the last is False, for rows of no block."""
    import numpy as np

    from camtool.planning.settings import feeds_of

    said: list[float] = []
    for operation in job.operations:
        feeds = feeds_of(operation, machine)
        if operation.feed_mm_min is not None:
            said += [feeds.cut_mm_min, feeds.plunge_mm_min]
        elif operation.plunge_feed_mm_min is not None:
            said.append(feeds.plunge_mm_min)
    row = np.append(program.row_of_block, -1)
    return np.asarray(np.isin(wanted.feed[row], said) & (row >= 0))


def _merged(
    *groups: tuple[Finding, ...], without: Collection[Finding] = ()
) -> tuple[Finding, ...]:
    """All findings once, in order, but for those `without`."""
    every = dict.fromkeys(finding for group in groups for finding in group)
    return tuple(finding for finding in every if finding not in without)


# One program, run several ways: by other interpolators, with other play, without a part of it.

WINDOW_STEPS = 30.0
"""The picture shows so many steps of the coarser axis to each side of the worst place ..."""

WINDOW_ERRORS = 1.5
"""... or so many times the largest error, where that is more ..."""

WHOLE = 2.0
"""... or the whole path, unless it is this many times larger than that."""


ROOM = 0.25
"""Paths are taken from a window larger by this share to each side: the page may show more."""


@dataclass(frozen=True, eq=False)
class Way:
    """One way to run a program: its name, the target with its settings, how it is judged."""

    name: str
    target: LoadedTarget
    judging: Judging


def compare_program(
    data: bytes,
    ways: Sequence[Way],
    *,
    source: str,
    drawing: Drawing | None = None,
    job: Job | None = None,
) -> list[Variant]:
    """The program read and judged each way; raises as `verify_program` does."""
    from camtool.verification.contrast import Variant

    variants = []
    for way in ways:
        _, found = verify_program(
            data, way.target, source=source, drawing=drawing, job=job, judging=way.judging
        )
        variants.append(Variant(way.name, way.target.machine, found))
    return variants


def compare_picture(
    data: bytes, ways: Sequence[Way], variants: Sequence[Variant], *, title: str
) -> Overlay:
    """The paths laid over each other about the place of the largest error: slides, or commanded
    positions where only the interpolator differs."""
    import numpy as np

    from camtool.pictures.overlay import Overlay
    from camtool.simulation.motion import ALL, Options
    from camtool.simulation.simulate import model_of, simulate
    from camtool.verification.contrast import strokes_within, worst_place
    from camtool.verification.cuts import cut_moves

    commanded = all(way.judging.interpolator is not None for way in ways)
    first = ways[0].target
    decoded = first.post.read(data, first.machine)
    wanted = model_of(first.machine).held(decoded, first.machine)
    window = _window(wanted, variants)
    room = ROOM * (window[:, 1] - window[:, 0]).max()
    around = window + np.array([-room, room])
    runs = []
    for way in ways:
        machine = way.target.machine
        options = Options(way.judging.interpolator, way.judging.effects or ALL)
        moves = way.target.post.read(data, machine)
        cutting = cut_moves(moves, flat_cuts=True).is_cut
        chunks = simulate(moves, machine, options)
        runs.append((way.name, strokes_within(chunks, cutting, around, commanded=commanded)))
    what = "commanded positions" if commanded else "paths of the slides"
    x, y = worst_place(variants)
    note = f"{what}; the largest error of all is near ({x:.3f}, {y:.3f}) mm"
    return Overlay(title, window, wanted, runs, (note,))


def _window(wanted: Toolpath, variants: Sequence[Variant]) -> Floats:
    """[[xmin, xmax], [ymin, ymax]] mm: what the picture shows."""
    import numpy as np

    from camtool.toolpath.moves import toolpath_extents
    from camtool.verification.contrast import worst_place

    step = max(
        max(variant.machine.axes.x.coded_step_mm, variant.machine.axes.y.coded_step_mm)
        for variant in variants
    )
    error_um = max(variant.verification.report.error_um.total.max or 0.0 for variant in variants)
    half = max(WINDOW_STEPS * step, WINDOW_ERRORS * error_um / UM_PER_MM)
    whole = toolpath_extents(wanted)[:2]
    size = float((whole[:, 1] - whole[:, 0]).max())
    if size <= 2.0 * half * WHOLE:
        pad = max(0.05 * size, error_um / UM_PER_MM, step)
        return np.asarray(whole + np.array([-pad, pad]))
    x, y = worst_place(variants)
    return np.array([[x - half, x + half], [y - half, y + half]])


# Which ways to run a program are held against each other: interpolators, mechanics, values.

EFFECTS = ("play", "compensation", "scale", "squareness", "repeatability")
"""The parts of the mechanics that can be left out."""

AXES_OF = {"backlash": "backlash_mm", "compensation": "compensation_mm", "step": "real_step_mm"}
"""Short names for a key of both X and Y."""

Load = Callable[[Sequence[str]], "LoadedTarget"]
"""The target, with more settings such as "axes.x.backlash_mm=0.2" over it."""


def ways_of(what: str, load: Load, judging: Judging) -> list[Way]:
    """What `what` stands for: `interpolators`, `mechanics`, or KEY=VALUE,VALUE,...

    OptionError for anything else, and MachineError for values that the machine cannot have.
    """
    if what == "interpolators":
        return _interpolators(load(()), judging)
    if what == "mechanics":
        return _mechanics(load(()), judging)
    key, equals, values = what.partition("=")
    if not equals or not values.strip():
        raise OptionError(
            f"{what!r} is nothing to compare",
            where="--compare",
            mend="write interpolators, mechanics, backlash=0,0.1,0.2 or KEY=VALUE,VALUE,...",
        )
    return [
        Way(f"{key}={value.strip()}", load(_settings(key.strip(), value.strip())), judging)
        for value in values.split(",")
    ]


def altered(target: LoadedTarget, settings: Sequence[str]) -> LoadedTarget:
    """The target with settings over its machine; MachineError names the wrong one."""
    from msgspec import to_builtins

    from camtool.machine.loader import build_machine

    if not settings:
        return target
    machine = build_machine(to_builtins(target.machine), str(target.file), None, settings)
    target.post.check(machine)
    return replace(target, machine=machine)


def left_out(names: Sequence[str]) -> Effects:
    """The mechanics without these effects; OptionError for others."""
    from camtool.simulation.motion import ALL

    unknown = [name for name in names if name not in EFFECTS]
    if unknown:
        raise OptionError(
            f"{unknown[0]!r} is no part of the mechanics",
            where="--without",
            mend=f"{guess(unknown[0], EFFECTS)}one of {', '.join(EFFECTS)}",
        )
    return replace(ALL, **dict.fromkeys(names, False))


def _interpolators(target: LoadedTarget, judging: Judging) -> list[Way]:
    from camtool.machine.controllers import Interpolator

    names = get_args(Interpolator)
    return [Way(name, target, replace(judging, interpolator=name)) for name in names]


def _mechanics(target: LoadedTarget, judging: Judging) -> list[Way]:
    """With all of it, without each part that acts, and without any."""
    from camtool.simulation.motion import IDEAL

    return [
        Way("as it is", target, judging),
        *(
            Way(f"without {name}", target, replace(judging, effects=left_out((name,))))
            for name in EFFECTS
            if _matters(name, target.machine)
        ),
        Way("ideal", target, replace(judging, effects=IDEAL)),
    ]


def _matters(effect: str, machine: Machine) -> bool:
    """Whether leaving out this part of the mechanics can change anything."""
    axes = list(machine.axes)
    return {
        "play": any(axis.backlash_mm for axis in axes) or any(machine.play_map.used),
        "compensation": any(axis.compensation_mm for axis in axes),
        "scale": any(axis.real_step_mm != axis.coded_step_mm for axis in axes),
        "squareness": machine.mechanics.squareness_rad != 0.0,
        "repeatability": any(axis.repeatability_mm for axis in axes),
    }[effect]


def _settings(key: str, value: str) -> tuple[str, ...]:
    """The setting of a key of the machine, or of a short name of both X and Y."""
    if key in AXES_OF:
        return tuple(f"axes.{axis}.{AXES_OF[key]}={value}" for axis in "xy")
    return (f"{key}={value}",)


# Any value on the way from drawing to report as the scene that `camtool.preview` draws.


def picture(
    *,
    title: str,
    drawing: Drawing | None = None,
    job: Job | None = None,
    toolpath: Toolpath | None = None,
    verification: Verification | None = None,
    machine: Machine | None = None,
    listing: Callable[[], Listing | None] | None = None,
) -> Scene:
    """The scene of whatever is there; with a verification, the slides' path by its error.

    `job` tells where it places the drawing in the work frame; `listing` gives the program's lines
    to the viewer.
    """
    from camtool.pictures.scene import Scene, scene_of_drawing

    if drawing is not None and toolpath is None:
        return replace(scene_of_drawing(drawing), title=title)
    if drawing is not None and job is not None:
        from camtool.planning.place import place

        drawing = place(drawing, job)
    trace = verification.trace if verification is not None else None
    # A V bit is as wide as it is deep: one width for all of its path would be false.
    even = job is not None and cone_of(job) is None
    return Scene(
        title=title,
        drawing=drawing,
        toolpath=toolpath,
        trace_points=trace.points if trace is not None else None,
        trace_error_mm=trace.error_mm if trace is not None else None,
        trace_cutting=trace.cutting if trace is not None else None,
        travel_mm=_travel(toolpath, machine),
        notes=verification.report.notes() if verification is not None else (),
        wanted=verification.wanted.segments if verification is not None else None,
        worst=worst_places(verification),
        tool_mm=tool_mm(job) if job is not None and even else None,
        rounds=() if verification is None else rounds_of(verification),
        run=_run(toolpath, verification, machine, listing),
    )


def posted_scene(
    posted: Posted,
    target: LoadedTarget,
    *,
    title: str = "",
    drawing: Drawing | None = None,
    job: Job | None = None,
) -> Scene:
    """The scene of what was posted: the program's moves, or those that were planned where there is
    none, with the slides' path where they were judged. The title is the drawing's name unless
    another one is given."""

    return picture(
        title=title or ("" if drawing is None else PurePath(drawing.file).name),
        drawing=drawing,
        job=job,
        toolpath=posted.decoded or posted.wanted,
        verification=posted.verification,
        machine=target.machine,
        listing=posted_listing(posted, target),
    )


def _run(
    toolpath: Toolpath | None,
    verification: Verification | None,
    machine: Machine | None,
    listing: Callable[[], Listing | None] | None,
) -> Callable[[], Playback] | None:
    """What makes the run, when the viewer asks for it."""
    if toolpath is None or machine is None:
        return None

    def run() -> Playback:
        return run_of(toolpath, verification, machine, None if listing is None else listing())

    return run


def rounds_of(verification: Verification) -> tuple[Round, ...]:
    """The full circles as polar plots show them, each with the same one gone round the other way
    where there is that."""
    import numpy as np

    from camtool.pictures.scene import Round
    from camtool.verification.circles import Pairs, both_ways

    seen = verification.circles
    pairs = Pairs([one.circle for one in seen])
    found = []
    for index, one in enumerate(seen):
        partner, both_mm = pairs.partner(index), math.nan
        if partner is not None:
            bins = np.concatenate([one.bins, seen[partner].bins])
            both_mm = both_ways(one.circle, bins).circular_mm
        figures = one.figures
        found.append(
            Round(
                one.circle.centre_mm,
                one.circle.radius_mm,
                one.circle.ccw,
                one.bins,
                figures.circular_mm,
                (figures.radial_max_mm, figures.radial_min_mm, figures.radial_mean_mm),
                one.reversing.value,
                None if partner is None else partner + 1,
                both_mm,
            )
        )
    return tuple(found)


def worst_places(verification: Verification | None) -> tuple[tuple[float, float], ...]:
    """Where the largest errors are, mm, the largest first."""
    if verification is None:
        return ()
    return tuple(one.at_mm for one in verification.report.worst)


def _travel(toolpath: Toolpath | None, machine: Machine | None) -> tuple[float, float] | None:
    """The table's travel, mm, if the path lies in it with part zero at its lower-left corner:
    only then is there a place where the frame can honestly be drawn."""
    if toolpath is None or machine is None:
        return None
    from camtool.toolpath.moves import toolpath_extents

    x, y = machine.axes.x.travel_mm, machine.axes.y.travel_mm
    (left, right), (low, high), _ = toolpath_extents(toolpath).tolist()
    if x is None or y is None or left < 0.0 or low < 0.0 or right > x or high > y:
        return None
    return x, y


# What the viewer shows besides a picture: seconds, errors, the program's lines, the report.

LINES_SHOWN = 200
"""A table of the viewer has no more lines than this; the JSON report has them all."""

POINTS_OF_A_PAGE = 400_000
"""The viewer is given so many points of the slides' path: enough for the ends of 200,000 moves and
the largest error within each."""

NAME_WIDTH = 11
"""Characters of the report's text before the figures of a line."""


def points_for(picture: str | None) -> int | None:
    """How many points of the slides' path a picture of this name wants; None: as usual."""
    return POINTS_OF_A_PAGE if (picture or "").lower().endswith(".html") else None


def listing_of(
    data: bytes, target: LoadedTarget, toolpath: Toolpath
) -> Callable[[], Listing | None]:
    """What gives the program block by block, when asked: None where its dialect cannot say which
    bytes are which."""

    def listing() -> Listing | None:
        make = getattr(target.post, "listing", None)
        if make is None:
            return None
        made: Listing = make(data, target.machine)
        last = int(toolpath.block.max()) if len(toolpath) else -1
        return made if last < len(made.blocks) else None

    return listing


def posted_listing(posted: Posted, target: LoadedTarget) -> Callable[[], Listing | None] | None:
    """The same of what was posted; None where nothing was."""
    if posted.program is None or posted.decoded is None:
        return None
    return listing_of(posted.program.data, target, posted.decoded)


def run_of(
    toolpath: Toolpath,
    verification: Verification | None,
    machine: Machine,
    listing: Listing | None,
) -> Playback:
    """How the toolpath runs: as simulated where there is a verification, else by its feeds."""
    from dataclasses import replace

    from camtool.pictures.scene import Playback, by_feed

    blocks = () if listing is None else listing.blocks
    if verification is None:
        run = by_feed(toolpath, machine.rapid_mm_min)
    else:
        report, rows = verification.report, verification.rows
        run = Playback(
            seconds=rows.ledger.duration_s,
            error_mm=rows.total,
            trace_row=verification.trace.row,
            tables=tuple(_tables(report)),
            worst=_worst_places(report),
        )
    if listing is None:
        return run
    return replace(run, blocks=blocks, binary=listing.binary)


def _worst_places(report: Report) -> tuple[Worst, ...]:
    from camtool.pictures.scene import Worst

    return tuple(Worst(item.at_mm) for item in report.worst)


def _tables(report: Report) -> Iterator[Table]:
    """The report's figures; tables without a line are left out."""
    from camtool.pictures.scene import Line, Table

    lines = report.to_text(findings=False).splitlines()
    facts = [(line[:NAME_WIDTH].strip(), line[NAME_WIDTH:].strip()) for line in lines]
    yield Table("Report", (), tuple(map(Line, facts)))
    for title, columns, found in (_findings(report), _worst(report), _contours(report)):
        if found:
            yield Table(title, columns, tuple(found[:LINES_SHOWN]))


def _findings(report: Report) -> tuple[str, tuple[str, ...], list[Line]]:
    from camtool.pictures.scene import Line

    lines = [
        Line((item.severity, item.code, item.where, item.message)) for item in report.findings
    ]
    return "Findings", ("severity", "code", "where", "message"), lines


def _worst(report: Report) -> tuple[str, tuple[str, ...], list[Line]]:
    """The worst moves; the report counts them from 1."""
    from camtool.pictures.scene import Line

    lines = [
        Line(
            (
                str(index),
                str(item.move if item.block is None else item.block),
                _um(item.total_um),
                _um(item.interpolation_um),
                _um(item.mechanics_um),
                _place(item.at_mm),
                item.source,
            ),
            item.move - 1,
        )
        for index, item in enumerate(report.worst, 1)
    ]
    names = ("", "block", "error µm", "interpolation µm", "mechanics µm", "near mm", "from")
    return "Worst moves", names, lines


def _contours(report: Report) -> tuple[str, tuple[str, ...], list[Line]]:
    from camtool.pictures.scene import Line

    lines = [
        Line(
            (item.name, _um(item.max_um), _um(item.rms_um), _um(item.mean_um), _place(item.at_mm))
        )
        for item in sorted(report.contour_errors, key=lambda item: -item.max_um)
    ]
    return "Contours", ("contour", "max µm", "rms µm", "mean µm", "worst near mm"), lines


def _um(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _place(at_mm: tuple[float, float]) -> str:
    return f"({at_mm[0]:.3f}, {at_mm[1]:.3f})"
