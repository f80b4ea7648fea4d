"""Judge a program: simulate its decoded moves on the machine and compare with what was wanted.

    decoded ─quantised─▶ as the controller rounds it
    quantised, wanted ─cuts─▶ lines and arcs that cut, by contour
    quantised × wanted ─coverage─▶ rounding error, missing and extra cuts, match of the rows
    decoded ─simulate─▶ chunks ─slides─▶ rows: errors, circles, extents, trace
    all of it ─▶ Report and Trace

Every distance is to true lines and arcs. Memory grows with the rows of the program, not with the
steps of the machine."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Indices
from camtool.findings import Finding
from camtool.progress import Progress
from camtool.records import replace
from camtool.simulation.controller import FusedRun
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import Chunk
from camtool.toolpath.moves import Toolpath, toolpath_extents
from camtool.units import UM_PER_MM
from camtool.verification import report as record
from camtool.verification.case import SAMPLE_MM, TRACE_POINTS, Case, VerifyOptions
from camtool.verification.circles import NO_FIGURES, full_circles
from camtool.verification.coverage import Coverage, Side, cover, direction_findings
from camtool.verification.cuts import CutMoves, is_flat, loops, row_lengths
from camtool.verification.dimensions import LoopedCuts, SlideExtents, sizes
from camtool.verification.figures import Figure, RowFigures, Tally, contour_names, tally_of
from camtool.verification.matching import Goal, match_through_compensation, own_match
from camtool.verification.motion_findings import motion_findings
from camtool.verification.report import (
    BaselineReport,
    EngagementReport,
    Planned,
    Report,
    finding_reports,
    rounded,
    rounded_or_none,
)
from camtool.verification.shape import (
    CommandedMotion,
    WantedShape,
    cutter_of,
    machined_shape,
    overcut_findings,
    points_wanted,
    wanted_shape,
)
from camtool.verification.slides import Paths, SeenCircle, SlidePass, SlideTrace, trace_size
from camtool.version import __version__

if TYPE_CHECKING:
    from camtool.verification.conformance import Conformance

__all__ = ["Case", "Verification", "VerifyOptions", "judge", "verify"]


@dataclass(frozen=True, eq=False)
class Verification:
    """The result of a verification: the report; the findings in it; the case; the path of the
    slides for pictures; the figures of each row; the moves with which the path was compared
    (`wanted`), and the row of these that each decoded row follows (`follows` (N,), −1 for none);
    and the full circles."""

    report: Report
    trace: SlideTrace
    findings: tuple[Finding, ...]
    case: Case
    rows: RowFigures
    wanted: CutMoves
    follows: Indices
    circles: tuple[SeenCircle, ...] = ()

    def with_findings(self, findings: tuple[Finding, ...]) -> Verification:
        """Return the verification, and the report in it, with these findings."""
        return replace(self, report=self.report.with_findings(findings), findings=findings)

    def with_planning(self, plan: Planned, before: BaselineReport | None) -> Verification:
        """Return the verification with the figures of planning in its report."""
        report = replace(self.report, planned=plan, before=before)
        return replace(self, report=report)

    def with_engagement(self, rows: tuple[EngagementReport, ...] | None) -> Verification:
        """Return the verification with the engagement of each operation in its report."""
        return replace(self, report=replace(self.report, engagement=rows))


def verify(case: Case, progress: Progress | None = None) -> Verification:
    """Simulate the program of a case and judge it against the wanted moves, if there are any.

    `progress` is told how many rows are judged. Raises what `LoadedTarget.simulate` raises."""
    decoded, target, options = case.decoded, case.target, case.simulation
    target.check_options(options)
    fused = target.model.fused_run(decoded, target.machine, options)
    motion = fused or target.simulate(decoded, replace(options, rapids=False))
    return judge(case, motion, progress)


def judge(
    case: Case, motion: Iterable[Chunk] | FusedRun, progress: Progress | None = None
) -> Verification:
    """Judge a case by the chunks of its motion, or by a run that is judged while it is
    simulated."""
    progress = progress or Progress()
    paths, coverage, conformance, direction_faults = compare_cuts(case)
    cuts, wanted_cuts = paths.decoded, paths.wanted
    cutter = cutter_of(case.options, cuts) if case.options.shape else None
    shape_points = points_wanted(cuts, cutter)
    # Slides may curve where their program does not: the shape needs no fewer points than pictures,
    # and is the same whether there are any.
    min_points = max(shape_points, TRACE_POINTS) if shape_points else 0
    points = max(case.options.trace_points, min_points)
    own_cuts, looped = _with_loops(case, paths)
    sizes_of = SlideExtents(case.decoded.start, own_cuts, looped, coverage.match)
    steps_mm = case.machine.axes.x.coded_step_mm, case.machine.axes.y.coded_step_mm
    worst, keep = case.options.worst, case.options.keep_ledger
    rows = RowFigures(cuts, coverage.match, steps_mm, worst, keep_ledger=keep)
    size = trace_size(case.decoded, case.spacing_mm, points)
    slides = SlidePass(paths, coverage.match, (rows, sizes_of), size)
    if isinstance(motion, Iterable):
        for chunk in motion:
            slides.add(chunk)
            progress.done = int(chunk.row[-1]) + 1 if len(chunk.row) else progress.done
    else:
        slides.run(motion, progress)
    trace = slides.finish()
    tally = tally_of(rows.books, case.decoded, cuts.is_cut)
    extents = toolpath_extents(case.decoded)
    motion_faults = motion_findings(cuts, case, tally, extents, rows)
    shape = None
    if shape_points and cutter is not None:
        shape = wanted_shape(wanted_cuts, cutter, case.options.kept)
    plan_findings = () if case.wanted is None else case.wanted.findings
    overcut = overcut_findings(shape, {finding.code for finding in plan_findings})
    findings = _all_findings(
        case, coverage, conformance, (*direction_faults, *motion_faults, *overcut)
    )
    result = ReportBuilder(case, cuts, looped, coverage, slides, tally, conformance)
    report = result.report(extents, findings, trace, shape)
    follows = coverage.match.row
    return Verification(
        report, trace, findings, case, rows, wanted_cuts, follows, slides.seen_circles()
    )


def compare_cuts(case: Case) -> tuple[Paths, Coverage, Conformance | None, tuple[Finding, ...]]:
    """Compare the decoded with the wanted cuts. Return the paths by which the slides are judged,
    the coverage, the conformance (None if nothing else is asked of the program), and CUT_OTHER_WAY
    findings. The search tables are freed on return."""
    # Where the wanted moves have no motion in Z, all feed moves cut.
    flat_cuts = case.wanted is None or is_flat(case.wanted)
    quantised = case.target.model.quantised(case.decoded, case.machine)
    decoded = Side.of(quantised, flat_cuts=flat_cuts)
    wanted_side = decoded if case.wanted is None else Side.of(case.wanted, flat_cuts=flat_cuts)
    circles = full_circles(wanted_side.cuts, case.coverage_mm)
    goal = Goal(wanted_side.moves, circles, case.coverage_mm, case.depth_mm)
    conformance = _conformance(case, flat_cuts=flat_cuts)
    # Faults that conformance or registration reports are not reported again.
    is_judged = case.registration is None and not (conformance and conformance.place)
    coverage = _coverage(
        case, (decoded, wanted_side), goal, flat_cuts=flat_cuts, is_judged=is_judged
    )
    direction_faults = _direction_findings(case, decoded, wanted_side, flat_cuts=flat_cuts)
    paths = Paths(decoded.cuts, wanted_side.cuts, circles, case.depth_mm)
    return paths, coverage, conformance, direction_faults


def _with_loops(case: Case, paths: Paths) -> tuple[LoopedCuts, LoopedCuts]:
    """Return the decoded and the wanted cuts with their loops."""
    own_cuts = LoopedCuts(paths.decoded, loops(paths.decoded, case.coverage_mm))
    if paths.wanted is paths.decoded:
        return own_cuts, own_cuts
    return own_cuts, LoopedCuts(paths.wanted, loops(paths.wanted, case.coverage_mm))


def _coverage(
    case: Case, sides: tuple[Side, Side], goal: Goal, *, flat_cuts: bool, is_judged: bool
) -> Coverage:
    """Match the decoded side to the wanted one and compare both. If the job compensates, the
    decoded side is compared with the compensated moves, and the match is carried over to the
    wanted ones."""
    decoded, wanted_side = sides
    if case.wanted is None:
        return Coverage(own_match(decoded.cuts, goal.circles), Figure(), ())
    programmed = goal  # what the program should say
    if case.compensated is not None:
        wanted_side = Side.of(case.compensated.toolpath, flat_cuts=flat_cuts)
        programmed = Goal(wanted_side.moves, [], goal.limit_mm, goal.depth_mm)
    row_from = case.row_from if wanted_side.toolpath is case.written_from else None
    coverage = cover(decoded, wanted_side, programmed, SAMPLE_MM, row_from, is_judged=is_judged)
    if case.compensated is None:
        return coverage
    return replace(
        coverage, match=match_through_compensation(coverage.match, case.compensated.row, goal)
    )


def _direction_findings(
    case: Case, decoded: Side, wanted_side: Side, *, flat_cuts: bool
) -> tuple[Finding, ...]:
    """Return CUT_OTHER_WAY findings for contours cut in the direction opposite to the moves they
    were written from."""
    if case.written_from is None:
        return ()
    source = wanted_side
    if wanted_side.toolpath is not case.written_from:
        source = Side.of(case.written_from, flat_cuts=flat_cuts)
    limits = case.coverage_mm, case.depth_mm
    return tuple(direction_findings(decoded.moves, source.moves, limits, SAMPLE_MM, case.row_from))


def _conformance(case: Case, *, flat_cuts: bool) -> Conformance | None:
    if case.asked is None:
        return None
    from camtool.verification.conformance import conformance_of

    return conformance_of(case.decoded, case.asked, flat_cuts=flat_cuts, sample_mm=SAMPLE_MM)


def _all_findings(
    case: Case, coverage: Coverage, conformance: Conformance | None, motion: tuple[Finding, ...]
) -> tuple[Finding, ...]:
    """Return the findings of all stages in order, without repeats. Where the program cuts is
    judged by registration if there was one, else by conformance, else by coverage."""
    if case.registration is not None:
        places = case.registration.findings
    elif conformance is not None and conformance.place:
        places = conformance.place
    else:
        places = coverage.findings
    groups = (
        case.drawing.findings if case.drawing is not None else (),
        case.wanted.findings if case.wanted is not None else (),
        case.decoded.findings,
        places,
        () if conformance is None else conformance.settings,
        motion,
    )
    return tuple(dict.fromkeys(finding for group in groups for finding in group))


# The results as the report's record: mm to µm, NaN to null.


class ReportBuilder(Struct, frozen=True, eq=False):
    """The results of all stages, from which the report is made."""

    case: Case
    cuts: CutMoves
    goal: LoopedCuts
    coverage: Coverage
    slides: SlidePass
    tally: Tally
    conformance: Conformance | None = None

    def report(
        self,
        extents: Floats,
        findings: tuple[Finding, ...],
        trace: SlideTrace,
        shape: WantedShape | None = None,
    ) -> Report:
        """Return the report of the verification.

        `extents` (3, 2): least and greatest X, Y, Z of the decoded toolpath, mm; `trace`: the
        simulated positions of the slides; `shape`: the wanted shape, None if it is not compared.
        """
        case, tally = self.case, self.tally
        options = case.options
        link_s = case.machine.link.seconds(options.line_bytes or 0, tally.time_s)
        x, y, z = ((rounded(low), rounded(high)) for low, high in extents)
        return Report(
            target=case.machine.target.name,
            source=options.source,
            moves=int(case.decoded.is_motion.sum()),
            blocks=_blocks(case),
            bytes=options.size_bytes,
            extents_mm=record.ExtentsMm(x=x, y=y, z=z),
            time_s=rounded(tally.time_s + link_s),
            steps=_steps(tally),
            reversals=_reversals(tally),
            error_um=self._errors(),
            closure_um=rounded_or_none(self.slides.extents.closure_mm, UM_PER_MM),
            dimensions=self._dimensions(),
            circles=self._circles(),
            findings=finding_reports(findings),
            contours=self.cuts.contour_count,
            time_split_s=_time_split(tally, link_s),
            interpolator=case.target.model.interpolation(
                case.decoded, case.machine, case.simulation
            ),
            camtool_version=__version__,
            contour_errors=self._contours(),
            bidirectional=self._both_ways(),
            unreached=self._unreached(),
            shape=self._shape(trace, shape),
            worst=self._worst(),
            assumptions=assumptions(case),
            asked=self._asked(),
            against="program" if case.wanted is None or case.wanted.drawn is None else "drawing",
            found=None if case.registration is None else case.registration.report,
        )

    def _errors(self) -> record.Errors:
        rows, step = self.slides.rows, self.case.step_mm
        inside, total = rows.inner, rows.whole
        return record.Errors(
            fit=self._fit(),
            rounding=_max_rms(self.coverage.rounding),
            interpolation=record.InterpolationFigures(
                max=rounded_or_none(inside.max, UM_PER_MM),
                rms=rounded_or_none(inside.rms, UM_PER_MM),
                p95=rounded_or_none(inside.p95, UM_PER_MM),
                lines_max=rounded_or_none(rows.lines_mm, UM_PER_MM),
                arcs_max=rounded_or_none(rows.arcs_mm, UM_PER_MM),
                lines_steps=rounded_or_none(rows.lines_mm / step),
                arcs_steps=rounded_or_none(rows.arcs_mm / step),
            ),
            mechanics=_max_rms(rows.lag),
            total=record.ErrorFigures(
                rounded_or_none(total.max, UM_PER_MM),
                rounded_or_none(total.rms, UM_PER_MM),
                rounded_or_none(total.p95, UM_PER_MM),
                rounded_or_none(rows.mean_mm, UM_PER_MM),
            ),
            depth_max=rounded_or_none(_depth_error_mm(self.case, self.cuts), UM_PER_MM),
        )

    def _fit(self) -> record.MaxRms:
        """Return the distance of the drawing from the wanted cutting moves (maximum and rms, µm),
        without the part that placing it adds. The rms is over the moves that are not exact."""
        drawn, rows = self.goal.cuts.toolpath.drawn, self.goal.cuts.rows
        if self.case.wanted is None or drawn is None or not len(rows):
            return record.MaxRms()
        largest, rms = np.maximum(drawn.off_mm[rows] - drawn.datum_off_mm, 0.0).T
        length = np.where(largest > 0.0, row_lengths(self.goal.cuts.toolpath)[rows], 0.0)
        mean = float((length * rms**2).sum()) / (float(length.sum()) or 1.0)
        return record.MaxRms(
            rounded(float(largest.max()) * UM_PER_MM), rounded(math.sqrt(mean) * UM_PER_MM)
        )

    def _off_um(self, off_mm: float) -> float | None:
        """Convert a distance from the drawing to µm; None if such distances are not known."""
        is_known = self.case.wanted is not None and self.case.wanted.drawn is not None
        return rounded(off_mm * UM_PER_MM) if is_known else None

    def _dimensions(self) -> tuple[record.DimensionReport, ...]:
        if self.case.machine.spindle.turns == "work":  # its sizes are not those of its levels
            return ()
        return tuple(
            record.DimensionReport(
                name=size.name,
                nominal_mm=rounded(size.nominal_mm),
                predicted_mm=rounded(size.predicted_mm),
                error_percent=rounded_or_none(size.error_percent),
                of="edge" if size.of_edge else "centre",
            )
            for size in sizes(self.slides.extents, self.goal, self.case.coverage_mm)
        )

    def _circles(self) -> tuple[record.CircleReport, ...]:
        match, off_mm = self.coverage.match, np.zeros(len(self.slides.circles) + 1)
        # the last entry stands for index −1, none
        np.maximum.at(off_mm, match.circle, match.off_mm)
        return tuple(
            record.CircleReport(
                centre_mm=(rounded(circle.centre_mm[0]), rounded(circle.centre_mm[1])),
                radius_mm=rounded(circle.radius_mm),
                G_um=rounded_or_none(figures.circular_mm, UM_PER_MM),
                Fmax_um=rounded_or_none(figures.radial_max_mm, UM_PER_MM),
                Fmin_um=rounded_or_none(figures.radial_min_mm, UM_PER_MM),
                D_um=rounded_or_none(figures.radial_mean_mm, UM_PER_MM),
                direction="ccw" if circle.ccw else "cw",
                z_mm=rounded(circle.z_mm),
                step_um=tuple(rounded_or_none(value, UM_PER_MM) for value in reversal.step),
                spike_um=tuple(rounded_or_none(value, UM_PER_MM) for value in reversal.spike),
                B_um=tuple(rounded_or_none(value, UM_PER_MM) for value in reversal.value),
                fit_um=self._off_um(float(off_mm[k])),
            )
            for k, circle, figures, reversal in zip(
                range(len(self.slides.circles)),
                self.slides.circles,
                self.slides.circle_figures,
                self.slides.reversing,
                strict=True,
            )
            if figures is not NO_FIGURES and reversal is not None
        )

    def _both_ways(self) -> tuple[record.BothWaysReport, ...]:
        return tuple(
            record.BothWaysReport(
                centre_mm=(rounded(one.circle.centre_mm[0]), rounded(one.circle.centre_mm[1])),
                radius_mm=rounded(one.circle.radius_mm),
                Gb_um=rounded_or_none(one.circular_mm, UM_PER_MM),
                D_um=rounded_or_none(one.radial_mean_mm, UM_PER_MM),
            )
            for one in self.slides.both_ways
        )

    def _contours(self) -> tuple[record.ContourReport, ...]:
        names = contour_names(self.goal.cuts)
        return tuple(
            record.ContourReport(
                name=names[one.contour],
                max_um=rounded(one.max_mm * UM_PER_MM),
                rms_um=rounded(one.rms_mm * UM_PER_MM),
                mean_um=rounded(one.mean_mm * UM_PER_MM),
                at_mm=(rounded(one.at_mm[0]), rounded(one.at_mm[1])),
                block=_block(self.case, one.row),
                interpolation_um=rounded(one.interpolation_mm * UM_PER_MM),
                mechanics_um=rounded(one.mechanics_mm * UM_PER_MM),
                fit_um=self._off_um(one.fit_mm),
            )
            for one in self.slides.rows.contours.figures()
        )

    def _worst(self) -> tuple[record.WorstReport, ...]:
        return tuple(
            record.WorstReport(
                block=_block(self.case, int(row)),
                move=int(row) + 1,
                at_mm=(rounded(x), rounded(y)),
                total_um=rounded(total_mm * UM_PER_MM),
                interpolation_um=rounded_or_none(inner_mm, UM_PER_MM),
                mechanics_um=rounded_or_none(lag_mm, UM_PER_MM),
                source=self._source(int(row)),
                fit_um=self._off_um(float(self.coverage.match.off_mm[int(row)])),
            )
            for row, total_mm, inner_mm, lag_mm, x, y in self.slides.rows.worst.found.tolist()
        )

    def _source(self, row: int) -> str:
        """Return layer and entity of the wanted move that a decoded row follows."""
        wanted_row = int(self.coverage.match.row[row])
        return self.goal.cuts.toolpath.text(wanted_row) if wanted_row >= 0 else ""

    def _unreached(self) -> record.UnreachedReport:
        missed_ends = self.slides.rows.missed
        return record.UnreachedReport(missed_ends.count, rounded(missed_ends.most_mm * UM_PER_MM))

    def _asked(self) -> record.AskedReport | None:
        request, conformance = self.case.asked, self.conformance
        if request is None or conformance is None:
            return None
        return record.AskedReport(
            moves=conformance.moves,
            alike=conformance.alike,
            off_um=rounded(conformance.off_mm * UM_PER_MM),
            limit_um=rounded(request.limits_mm[0] * UM_PER_MM),
        )

    def _shape(self, trace: SlideTrace, goal: WantedShape | None) -> record.ShapeReport | None:
        if goal is None:
            return None
        case = self.case
        motion = CommandedMotion(case.decoded, case.machine, case.options.effects)
        shape = machined_shape(trace, motion, goal)
        if shape is None:
            return None
        return record.ShapeReport(
            tool_diameter_mm=rounded(shape.diameter_mm),
            overcut_mm2=rounded(shape.overcut_mm2),
            overcut_um=rounded(shape.overcut_mm * UM_PER_MM),
            undercut_mm2=rounded(shape.undercut_mm2),
            undercut_um=rounded(shape.undercut_mm * UM_PER_MM),
        )


def _depth_error_mm(case: Case, cuts: CutMoves) -> float:
    """Return the largest difference in height between the slide and the quantised moves, mm, at
    the ends of rows that cut; NaN if none does.

    Within a row Z does not reverse, and it ends where the program says, so its error follows from
    the ends of the rows alone, whatever the controller does between them."""
    toolpath = cuts.toolpath
    if not cuts.is_cut.any():
        return math.nan
    mechanics = Mechanics(case.machine, toolpath.start, case.options.effects)

    def deviation(part: Toolpath) -> Floats:
        slide, _ = mechanics.follow(part.end, np.array([0, len(part)]))
        return np.abs(slide[:, 2] - part.end[:, 2])

    return float(toolpath.by_parts(deviation)[cuts.is_cut].max())


def assumptions(case: Case) -> tuple[str, ...]:
    """Return the assumptions behind times and figures, one sentence each."""
    link = case.machine.link
    assumed = case.target.model.assumptions(case.decoded, case.machine)
    if link.baud is None:
        return (*assumed, "the program is in the controller before it runs")
    timing = "block by block, before each is cut" if link.wait == "sequential" else "while it runs"
    return (*assumed, f"the program comes at {link.baud:g} baud, {timing}")


def _block(case: Case, row: int) -> int | None:
    """Return the block (from 1) from which a row was read, None if no program was read."""
    block = int(case.decoded.block[row])
    return block + 1 if block >= 0 else None


def _max_rms(figure: Figure) -> record.MaxRms:
    return record.MaxRms(
        rounded_or_none(figure.max, UM_PER_MM), rounded_or_none(figure.rms, UM_PER_MM)
    )


def _blocks(case: Case) -> int | None:
    highest = int(case.decoded.block.max(initial=-1))
    return highest + 1 if highest >= 0 else None


def _steps(tally: Tally) -> record.StepCounts:
    x, y, z = tally.steps.tolist()
    return record.StepCounts(x, y, z, tally.iterations, tally.cutting_iterations)


def _time_split(tally: Tally, link_s: float) -> record.TimeSplit:
    return record.TimeSplit(
        cutting=rounded(tally.cutting_s),
        air=rounded(tally.air_s),
        dwell=rounded(tally.dwell_s),
        compensation=rounded(tally.compensation_s),
        link=rounded(link_s),
    )


def _reversals(tally: Tally) -> record.Reversals:
    x, y, z = tally.reversals.tolist()
    return record.Reversals(
        x,
        y,
        z,
        cutting=record.AxisCounts(*tally.cutting_reversals.tolist()),
        air=record.AxisCounts(*(tally.reversals - tally.cutting_reversals).tolist()),
    )
