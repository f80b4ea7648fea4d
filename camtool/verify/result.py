"""All that was measured, turned into the report's record: mm to µm, NaN to null."""

from __future__ import annotations

from dataclasses import dataclass

from camtool import __version__
from camtool.findings import Finding
from camtool.geometry.polylines import Floats
from camtool.verify import report as record
from camtool.verify.case import Case
from camtool.verify.circles import UNSEEN
from camtool.verify.coverage import Coverage
from camtool.verify.cuts import CutMoves
from camtool.verify.dimensions import RowSlides, closure_mm, places_between, sizes
from camtool.verify.figures import Figure
from camtool.verify.motion import Tally
from camtool.verify.report import Report, certain, number
from camtool.verify.rows import RowFigures
from camtool.verify.slides import SlidePass, largest

UM = 1000.0
"""µm in a mm."""


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

    def report(self, extents: Floats, findings: tuple[Finding, ...]) -> Report:
        """The report; `extents` (3, 2) mm of the decoded toolpath."""
        case, tally = self.case, self.tally
        options = case.options
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
            time_s=certain(tally.time_s),
            steps=_steps(tally),
            reversals=_reversals(tally),
            error_um=self._errors(),
            closure_um=number(closure_mm(self.cuts, slides, case.coverage_mm), UM),
            dimensions=self._dimensions(slides),
            circles=self._circles(),
            findings=record.reported(findings),
            contours=self.cuts.contour_count,
            time_split_s=_time_split(tally),
            interpolator=_interpolator(case),
            camtool_version=__version__,
        )

    def _errors(self) -> record.Errors:
        slides, drawing = self.slides, self.case.drawing
        fit = record.MaxRms()
        if drawing is not None:
            fit = record.MaxRms(number(drawing.fit.max_mm, UM), number(drawing.fit.rms_mm, UM))
        inside, step = slides.interpolation(), self.case.step_mm
        is_arc = self.cuts.toolpath.is_arc
        lines_mm = largest(self.rows.interpolation, ~is_arc)
        arcs_mm = largest(self.rows.interpolation, is_arc)
        total = slides.total()
        return record.Errors(
            fit=fit,
            rounding=_max_rms(self.coverage.rounding),
            interpolation=record.InterpolationFigures(
                max=number(inside.max, UM),
                rms=number(inside.rms, UM),
                p95=number(inside.p95, UM),
                lines_max=number(lines_mm, UM),
                arcs_max=number(arcs_mm, UM),
                lines_steps=number(lines_mm / step),
                arcs_steps=number(arcs_mm / step),
            ),
            mechanics=_max_rms(slides.mechanics()),
            total=record.ErrorFigures(
                number(total.max, UM),
                number(total.rms, UM),
                number(total.p95, UM),
            ),
        )

    def _dimensions(self, slides: RowSlides) -> tuple[record.Dimension, ...]:
        match = self.coverage.match
        found = sizes(self.cuts, slides, self.wanted, match, self.case.coverage_mm)
        return tuple(
            record.Dimension(
                name=size.name,
                nominal_mm=certain(size.nominal_mm),
                predicted_mm=certain(size.predicted_mm),
                error_percent=number(size.error_percent),
            )
            for size in found
        )

    def _circles(self) -> tuple[record.CircleReport, ...]:
        return tuple(
            record.CircleReport(
                centre_mm=(certain(circle.centre_mm[0]), certain(circle.centre_mm[1])),
                radius_mm=certain(circle.radius_mm),
                G_um=number(figures.circular_mm, UM),
                Fmax_um=number(figures.radial_max_mm, UM),
                Fmin_um=number(figures.radial_min_mm, UM),
                D_um=number(figures.radial_mean_mm, UM),
                direction="ccw" if circle.ccw else "cw",
                z_mm=certain(circle.z_mm),
            )
            for circle, figures in zip(
                self.slides.circles, self.slides.circle_figures, strict=True
            )
            if figures is not UNSEEN
        )


def _max_rms(figure: Figure) -> record.MaxRms:
    return record.MaxRms(number(figure.max, UM), number(figure.rms, UM))


def _interpolator(case: Case) -> str:
    """How the controller makes lines and arcs."""
    from camtool.simulation.models import model_of

    return model_of(case.machine).interpolation(case.machine, case.simulation)


def _blocks(case: Case) -> int | None:
    if case.options.blocks is not None:
        return case.options.blocks
    highest = int(case.decoded.block.max(initial=-1))
    return highest + 1 if highest >= 0 else None


def _steps(tally: Tally) -> record.Steps:
    x, y, z = tally.steps.tolist()
    return record.Steps(x, y, z, tally.iterations)


def _time_split(tally: Tally) -> record.TimeSplit:
    return record.TimeSplit(
        cutting=certain(tally.cutting_s), air=certain(tally.air_s), dwell=certain(tally.dwell_s)
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
