"""Judge a program: run its decoded moves on the machine's model and compare with what was wanted.

    decoded ─held─▶ as the controller rounds it
    held, wanted ─cuts─▶ lines and arcs that cut, by contour
    held × wanted ─coverage─▶ rounding error, what is missing or extra, whose row is whose
    decoded ─simulate─▶ chunks ─slides─▶ rows: errors, circles, extents, trace
    all of it ─▶ Report and Trace

Every distance is to true lines and arcs. Memory grows with the rows of the program, not with the
steps of the machine.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import msgspec

from camtool.findings import Finding
from camtool.geometry.drawing import Drawing
from camtool.machine.model import Machine
from camtool.simulation.motion import Chunk
from camtool.simulation.simulate import (
    StepsOnTheWay,
    check_options,
    model_of,
    simulate,
    steps_on_the_way,
)
from camtool.toolpath.moves import Bent, Toolpath, toolpath_extents
from camtool.verify.against import Held, hold
from camtool.verify.asked import Asked
from camtool.verify.case import Case, VerifyOptions
from camtool.verify.circles import full_circles
from camtool.verify.compare import Target
from camtool.verify.coverage import Coverage, Drilled, cover
from camtool.verify.cuts import CutMoves, cut_moves, is_flat
from camtool.verify.direction import cut_other_way
from camtool.verify.figures import Figure
from camtool.verify.holes import contours_drilled, hole_findings, holes_of
from camtool.verify.match import Goal, carried_match, own_match
from camtool.verify.motion import tally_of
from camtool.verify.noticed import motion_findings
from camtool.verify.records import Before, Planned
from camtool.verify.report import Report
from camtool.verify.result import Result
from camtool.verify.rows import RowFigures
from camtool.verify.shape import cutter_of, overcut_findings, points_wanted, wanted_shape
from camtool.verify.slides import SeenCircle, SlidePass
from camtool.verify.trace import Trace, trace_size

__all__ = ["Case", "Verification", "VerifyOptions", "judge", "verify"]


@dataclass(frozen=True, eq=False)
class Verification:
    """The report, all findings that are in it, the slides' path for pictures, what became of
    each row, the moves that the slides' path was judged against, and full circles."""

    report: Report
    trace: Trace
    findings: tuple[Finding, ...]
    rows: RowFigures
    wanted: CutMoves
    circles: tuple[SeenCircle, ...] = ()

    def with_findings(self, findings: tuple[Finding, ...]) -> Verification:
        """The same with these findings, in the report too."""
        return replace(self, report=self.report.with_findings(findings), findings=findings)

    def with_planning(self, planned: Planned, before: Before | None) -> Verification:
        """The same with what planning gained in the report."""
        report = msgspec.structs.replace(self.report, planned=planned, before=before)
        return replace(self, report=report)


def verify(
    decoded: Toolpath,
    machine: Machine,
    *,
    wanted: Toolpath | None = None,
    drawing: Drawing | None = None,
    options: VerifyOptions | None = None,
    sent: Bent | None = None,
    asked: Asked | None = None,
    said: Toolpath | None = None,
) -> Verification:
    """Simulate `decoded` on `machine` and judge it; against `wanted` when there is one.

    `drawing` gives the fitting error and its findings; `sent` is what the program was written from
    where `wanted` was bent; `asked` is what else its job asks for, `said` what the program was
    written from. Toolpaths are in the work frame.
    """
    case = Case(decoded, machine, wanted, drawing, options or VerifyOptions(), sent, asked, said)
    check_options(machine, case.simulation)
    steps = steps_on_the_way(decoded, machine, case.simulation)
    return judge(case, steps or simulate(decoded, machine, case.simulation))


def judge(case: Case, motion: Iterable[Chunk] | StepsOnTheWay) -> Verification:
    """Judge a case by the chunks of its motion, whoever made them, or by a controller that is run
    on the way."""
    # Without Z on either side, all feed moves are taken to cut.
    flat_cuts = case.wanted is None or is_flat(case.wanted)
    held = model_of(case.machine).held(case.decoded, case.machine)
    decoded = Target(cut_moves(held, flat_cuts=flat_cuts))
    wanted = decoded
    if case.wanted is not None:
        wanted = Target(cut_moves(case.wanted, flat_cuts=flat_cuts))
    circles = full_circles(wanted.cuts, case.coverage_mm)
    goal = Goal(wanted, circles, case.coverage_mm, case.depth_mm)
    coverage = _coverage(case, decoded, goal, flat_cuts=flat_cuts)
    held_against = _held_against(case, flat_cuts=flat_cuts)
    cutter = cutter_of(case.options, decoded.cuts)
    shaped = points_wanted(decoded.cuts, cutter)
    points = max(case.options.trace_points, shaped or 0)
    size = trace_size(case.decoded, case.spacing_mm, points)
    slides = SlidePass(decoded, goal, coverage.match, size)
    if isinstance(motion, Iterable):
        for chunk in motion:
            slides.add(chunk)
    else:
        slides.run(motion)
    slides.finish()
    rows = slides.rows
    tally = tally_of(rows, case.decoded, decoded.cuts.is_cut)
    extents = toolpath_extents(case.decoded)
    noticed = motion_findings(decoded.cuts, case, tally, extents, rows)
    shape = None
    if shaped and cutter is not None:
        shape = wanted_shape(wanted.cuts, cutter, case.options.kept)
    said = () if case.wanted is None else case.wanted.findings
    over = overcut_findings(shape, {finding.code for finding in said})
    turned = _turned(case, decoded, flat_cuts=flat_cuts)
    findings = _all_findings(case, coverage, held_against, (*turned, *noticed, *over))
    result = Result(case, decoded.cuts, wanted.cuts, coverage, slides, rows, tally, held_against)
    trace = slides.trace()
    report = result.report(extents, findings, trace, shape)
    return Verification(report, trace, findings, rows, wanted.cuts, slides.seen())


def _coverage(case: Case, decoded: Target, goal: Goal, *, flat_cuts: bool) -> Coverage:
    if case.wanted is None:
        return Coverage(own_match(decoded.cuts, goal.circles), Figure(), ())
    said = goal  # what the program should say
    if case.sent is not None:
        cuts = cut_moves(case.sent.toolpath, flat_cuts=flat_cuts)
        said = Goal(Target(cuts), [], goal.limit_mm, goal.depth_mm)
    limits = goal.limit_mm, goal.depth_mm
    bores = holes_of(decoded.cuts.toolpath)
    wanted_bores = holes_of(said.target.cuts.toolpath)
    missing, stand = contours_drilled(said.target.cuts, bores, limits)
    extra, wanted_stand = contours_drilled(decoded.cuts, wanted_bores, limits)
    coverage = cover(decoded, said, case.options.sample_mm, Drilled(missing, extra))
    holes = hole_findings(bores, wanted_bores, limits, (stand, wanted_stand))
    match = coverage.match
    if case.sent is not None:
        match = carried_match(match, case.sent.row, goal)
    return replace(coverage, match=match, findings=(*coverage.findings, *holes))


def _turned(case: Case, decoded: Target, *, flat_cuts: bool) -> tuple[Finding, ...]:
    if case.said is None:
        return ()
    said = Target(cut_moves(case.said, flat_cuts=flat_cuts))
    limits = case.coverage_mm, case.depth_mm
    return tuple(cut_other_way(decoded, said, limits, case.options.sample_mm))


def _held_against(case: Case, *, flat_cuts: bool) -> Held | None:
    if case.asked is None:
        return None
    return hold(case.decoded, case.asked, flat_cuts=flat_cuts, sample_mm=case.options.sample_mm)


def _all_findings(
    case: Case, coverage: Coverage, held: Held | None, motion: tuple[Finding, ...]
) -> tuple[Finding, ...]:
    """Findings of every stage once, in the order of the stages. What lies beside what was asked
    by more than the dialect's resolution is found by coverage too, where it is far: once is
    enough."""
    places = coverage.findings if held is None or not held.place else held.place
    groups = (
        case.drawing.findings if case.drawing is not None else (),
        case.wanted.findings if case.wanted is not None else (),
        case.decoded.findings,
        places,
        () if held is None else held.settings,
        motion,
    )
    return tuple(dict.fromkeys(finding for group in groups for finding in group))
