"""All that was measured, turned into the report's record: mm to µm, NaN to null."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool import __version__
from camtool.findings import Finding
from camtool.geometry.polylines import Floats
from camtool.units import UM_PER_MM
from camtool.verify import records as record
from camtool.verify.against import Held
from camtool.verify.by_row import (
    contour_figures,
    contour_name,
    mean_error_mm,
    missed_ends,
    worst_rows,
)
from camtool.verify.case import Case
from camtool.verify.circles import UNSEEN
from camtool.verify.coverage import Coverage
from camtool.verify.cuts import CutMoves, moved_lengths
from camtool.verify.depth import depth_error_mm
from camtool.verify.dimensions import RowSlides, closure_mm, places_between, sizes
from camtool.verify.figures import Figure
from camtool.verify.motion import Tally
from camtool.verify.report import Report, certain, number, reported
from camtool.verify.rows import RowFigures
from camtool.verify.shape import Wanted as WantedShape
from camtool.verify.shape import machined_shape
from camtool.verify.slides import SlidePass, largest
from camtool.verify.trace import Trace


@dataclass(frozen=True, eq=False)
class Result:
    """All that was measured, on its way into the report."""

    case: Case
    cuts: CutMoves
    wanted: CutMoves
    coverage: Coverage
    slides: SlidePass
    rows: RowFigures
    tally: Tally
    held: Held | None = None

    def report(
        self,
        extents: Floats,
        findings: tuple[Finding, ...],
        trace: Trace,
        shape: WantedShape | None = None,
    ) -> Report:
        """The report; `extents` (3, 2) mm of the decoded toolpath, `trace` of the slides, and the
        `shape` that they should make, where one is looked at."""
        case, tally = self.case, self.tally
        options = case.options
        link_s = case.machine.link.seconds(options.line_bytes or 0, tally.time_s)
        slides = RowSlides(
            self.rows.low,
            self.rows.high,
            places_between(case.decoded.start[:2], self.rows.slide_end),
        )
        x, y, z = ((certain(low), certain(high)) for low, high in extents)
        return Report(
            target=case.machine.target.name,
            source=options.source,
            moves=int(case.decoded.is_motion.sum()),
            blocks=_blocks(case),
            bytes=options.size_bytes,
            extents_mm=record.ExtentsMm(x=x, y=y, z=z),
            time_s=certain(tally.time_s + link_s),
            steps=_steps(tally),
            reversals=_reversals(tally),
            error_um=self._errors(),
            closure_um=number(closure_mm(self.cuts, slides, case.coverage_mm), UM_PER_MM),
            dimensions=self._dimensions(slides),
            circles=self._circles(),
            findings=reported(findings),
            contours=self.cuts.contour_count,
            time_split_s=_time_split(tally, link_s),
            interpolator=_interpolator(case),
            camtool_version=__version__,
            contour_errors=self._contours(),
            bidirectional=self._both_ways(),
            unreached=self._unreached(),
            shape=self._shape(trace, shape),
            worst=self._worst(),
            assumptions=assumptions(case),
            asked=self._asked(),
            against="program" if case.wanted is None or case.wanted.drawn is None else "drawing",
        )

    def _errors(self) -> record.Errors:
        slides = self.slides
        inside, step = slides.interpolation(), self.case.step_mm
        is_arc = self.cuts.toolpath.is_arc
        lines_mm = largest(self.rows.interpolation, ~is_arc)
        arcs_mm = largest(self.rows.interpolation, is_arc)
        total = slides.total()
        return record.Errors(
            fit=self._fit(),
            rounding=_max_rms(self.coverage.rounding),
            interpolation=record.InterpolationFigures(
                max=number(inside.max, UM_PER_MM),
                rms=number(inside.rms, UM_PER_MM),
                p95=number(inside.p95, UM_PER_MM),
                lines_max=number(lines_mm, UM_PER_MM),
                arcs_max=number(arcs_mm, UM_PER_MM),
                lines_steps=number(lines_mm / step),
                arcs_steps=number(arcs_mm / step),
            ),
            mechanics=_max_rms(slides.mechanics()),
            total=record.ErrorFigures(
                number(total.max, UM_PER_MM),
                number(total.rms, UM_PER_MM),
                number(total.p95, UM_PER_MM),
                number(mean_error_mm(self.rows), UM_PER_MM),
            ),
            depth_max=number(depth_error_mm(self.case, self.cuts), UM_PER_MM),
        )

    def _fit(self) -> record.MaxRms:
        """How far what was drawn lies from the wanted moves that cut; the rms over those moves
        that it lies off."""
        drawn, rows = self.wanted.toolpath.drawn, self.wanted.rows
        if self.case.wanted is None or drawn is None or not len(rows):
            return record.MaxRms()
        largest, rms = drawn.off_mm[rows].T
        length = np.where(largest > 0.0, moved_lengths(self.wanted.toolpath)[rows], 0.0)
        mean = float((length * rms**2).sum()) / (float(length.sum()) or 1.0)
        return record.MaxRms(
            certain(float(largest.max()) * UM_PER_MM), certain(math.sqrt(mean) * UM_PER_MM)
        )

    def _off_um(self, off_mm: Floats) -> float | None:
        """The largest of some rows' distances from what was drawn; None where nobody knows."""
        known = self.case.wanted is not None and self.case.wanted.drawn is not None
        return certain(float(off_mm[:, 0].max(initial=0.0)) * UM_PER_MM) if known else None

    def _dimensions(self, slides: RowSlides) -> tuple[record.Dimension, ...]:
        match = self.coverage.match
        found = sizes(self.cuts, slides, self.wanted, match, self.case.coverage_mm)
        return tuple(
            record.Dimension(
                name=size.name,
                nominal_mm=certain(size.nominal_mm),
                predicted_mm=certain(size.predicted_mm),
                error_percent=number(size.error_percent),
                of="edge" if size.of_edge else "centre",
            )
            for size in found
        )

    def _circles(self) -> tuple[record.CircleReport, ...]:
        return tuple(
            record.CircleReport(
                centre_mm=(certain(circle.centre_mm[0]), certain(circle.centre_mm[1])),
                radius_mm=certain(circle.radius_mm),
                G_um=number(figures.circular_mm, UM_PER_MM),
                Fmax_um=number(figures.radial_max_mm, UM_PER_MM),
                Fmin_um=number(figures.radial_min_mm, UM_PER_MM),
                D_um=number(figures.radial_mean_mm, UM_PER_MM),
                direction="ccw" if circle.ccw else "cw",
                z_mm=certain(circle.z_mm),
                step_um=tuple(number(value, UM_PER_MM) for value in turned.step),
                spike_um=tuple(number(value, UM_PER_MM) for value in turned.spike),
                B_um=tuple(number(value, UM_PER_MM) for value in turned.value),
                fit_um=self._off_um(self.coverage.match.off_mm[self.coverage.match.circle == k]),
            )
            for k, circle, figures, turned in zip(
                range(len(self.slides.circles)),
                self.slides.circles,
                self.slides.circle_figures,
                self.slides.reversing,
                strict=True,
            )
            if figures is not UNSEEN and turned is not None
        )

    def _both_ways(self) -> tuple[record.BothWaysReport, ...]:
        return tuple(
            record.BothWaysReport(
                centre_mm=(certain(one.circle.centre_mm[0]), certain(one.circle.centre_mm[1])),
                radius_mm=certain(one.circle.radius_mm),
                Gb_um=number(one.circular_mm, UM_PER_MM),
                D_um=number(one.radial_mean_mm, UM_PER_MM),
            )
            for one in self.slides.both_ways
        )

    def _contours(self) -> tuple[record.ContourReport, ...]:
        return tuple(
            record.ContourReport(
                name=contour_name(self.wanted, one.contour),
                max_um=certain(one.max_mm * UM_PER_MM),
                rms_um=certain(one.rms_mm * UM_PER_MM),
                mean_um=certain(one.mean_mm * UM_PER_MM),
                at_mm=(certain(one.at_mm[0]), certain(one.at_mm[1])),
                block=_block(self.case, one.row),
                interpolation_um=certain(one.interpolation_mm * UM_PER_MM),
                mechanics_um=certain(one.mechanics_mm * UM_PER_MM),
                fit_um=self._off_um(np.array([[one.fit_mm]])),
            )
            for one in contour_figures(self.rows, self.coverage.match)
        )

    def _worst(self) -> tuple[record.WorstReport, ...]:
        rows = self.rows
        return tuple(
            record.WorstReport(
                block=_block(self.case, row),
                move=row + 1,
                at_mm=(certain(rows.total_at[row, 0]), certain(rows.total_at[row, 1])),
                total_um=certain(rows.total[row] * UM_PER_MM),
                interpolation_um=number(rows.interpolation[row], UM_PER_MM),
                mechanics_um=number(rows.mechanics[row], UM_PER_MM),
                source=self._source(row),
                fit_um=self._off_um(self.coverage.match.off_mm[row : row + 1]),
            )
            for row in worst_rows(rows, self.case.options.worst).tolist()
        )

    def _source(self, row: int) -> str:
        """Layer and entity of the wanted move that a decoded row follows."""
        wanted = int(self.coverage.match.row[row])
        return self.wanted.toolpath.text(wanted) if wanted >= 0 else ""

    def _unreached(self) -> record.UnreachedReport:
        axes = self.case.machine.axes
        steps = axes.x.coded_step_mm, axes.y.coded_step_mm
        missed = missed_ends(self.rows, self.cuts.toolpath, steps)
        return record.UnreachedReport(missed.count, certain(missed.most_mm * UM_PER_MM))

    def _asked(self) -> record.AskedReport | None:
        asked, held = self.case.asked, self.held
        if asked is None or held is None:
            return None
        return record.AskedReport(
            moves=held.moves,
            alike=held.alike,
            off_um=certain(held.off_mm * UM_PER_MM),
            limit_um=certain(asked.limits_mm[0] * UM_PER_MM),
        )

    def _shape(self, trace: Trace, wanted: WantedShape | None) -> record.ShapeReport | None:
        if wanted is None:
            return None
        shape = machined_shape(trace, self.case.decoded, wanted)
        if shape is None:
            return None
        return record.ShapeReport(
            tool_diameter_mm=certain(shape.diameter_mm),
            overcut_mm2=certain(shape.overcut_mm2),
            overcut_um=certain(shape.overcut_mm * UM_PER_MM),
            undercut_mm2=certain(shape.undercut_mm2),
            undercut_um=certain(shape.undercut_mm * UM_PER_MM),
        )


def assumptions(case: Case) -> tuple[str, ...]:
    """What the times and figures take for granted."""
    from camtool.simulation.simulate import model_of

    link = case.machine.link
    said = model_of(case.machine).assumptions(case.decoded, case.machine)
    if link.baud is None:
        return (*said, "the program is in the controller before it runs")
    how = "block by block, before each is cut" if link.wait == "sequential" else "while it runs"
    return (*said, f"the program comes at {link.baud:g} baud, {how}")


def _block(case: Case, row: int) -> int | None:
    """The block (from 1) that a row was read from."""
    block = int(case.decoded.block[row])
    return block + 1 if block >= 0 else None


def _max_rms(figure: Figure) -> record.MaxRms:
    return record.MaxRms(number(figure.max, UM_PER_MM), number(figure.rms, UM_PER_MM))


def _interpolator(case: Case) -> str:
    """How the controller makes lines and arcs."""
    from camtool.simulation.simulate import model_of

    return model_of(case.machine).interpolation(case.decoded, case.machine, case.simulation)


def _blocks(case: Case) -> int | None:
    if case.options.blocks is not None:
        return case.options.blocks
    highest = int(case.decoded.block.max(initial=-1))
    return highest + 1 if highest >= 0 else None


def _steps(tally: Tally) -> record.Steps:
    x, y, z = tally.steps.tolist()
    return record.Steps(x, y, z, tally.iterations)


def _time_split(tally: Tally, link_s: float) -> record.TimeSplit:
    return record.TimeSplit(
        cutting=certain(tally.cutting_s),
        air=certain(tally.air_s),
        dwell=certain(tally.dwell_s),
        compensation=certain(tally.compensation_s),
        link=certain(link_s),
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
