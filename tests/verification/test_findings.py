"""What a judgement must notice: missing and extra cuts, endless arcs, travel, reversals."""

import math

import numpy as np
import pytest

from camtool.findings import Finding, Severity
from camtool.geometry.drawing import Drawing, Units
from camtool.geometry.polylines import Polyline, Polylines
from camtool.importers.findings import DrawingCode
from camtool.planning.findings import PlanningCode
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind
from camtool.toolpath.wanted import DrawnEdges
from camtool.verification.findings import VerificationCode
from camtool.verification.verify import Case, VerifyOptions, judge
from tests.oracles.dense_moves import circle, cut, follow, pic_mmh, square
from tests.oracles.judged import MACHINE, STEP, codes, grid, judged, sample_part
from tests.targets import on


def test_a_dropped_contour_is_missing() -> None:
    b = sample_part()
    decoded = b.finish()
    wanted = circle(b, grid(2.0), grid(2.2), grid(0.1)).finish()
    found = judged(decoded, wanted)
    (missing,) = [f for f in found.findings if f.code == VerificationCode.CONTOUR_MISSING]
    assert missing.severity == Severity.ERROR
    assert "100% of contour 4" in missing.message
    assert missing.measured is not None
    assert missing.measured > 0.05
    assert VerificationCode.EXTRA_CUT not in codes(found)


def test_an_added_contour_is_extra() -> None:
    b = sample_part()
    wanted = b.finish()
    decoded = circle(b, grid(2.0), grid(2.2), grid(0.1)).finish()
    found = judged(decoded, wanted)
    assert VerificationCode.CONTOUR_MISSING not in codes(found)
    (extra,) = [f for f in found.findings if f.code == VerificationCode.EXTRA_CUT]
    assert "move 22 near (2." in extra.where


def test_a_short_missing_line_is_found() -> None:
    b = cut(ToolpathBuilder(), 1, 1).line(2, 1, feed=1)
    decoded = b.finish()
    wanted = b.line(2.0, 1.012, feed=1).finish()
    found = judged(decoded, wanted)
    (missing,) = [f for f in found.findings if f.code == VerificationCode.CONTOUR_MISSING]
    assert missing.measured == pytest.approx(0.012, rel=0.02)


@pytest.mark.parametrize("radius", [0.1, 0.02])
def test_a_circle_the_other_way_round(radius: float) -> None:
    """Wherever it starts, in one piece or in halves."""
    wanted = circle(square(ToolpathBuilder(), 1, 1, 1), 3, 3, radius).finish()
    same = square(ToolpathBuilder(), 1, 1, 1)
    cut(same, 3, 3 + radius).arc(3, 3 - radius, centre=(3, 3), ccw=True, feed=1)
    same.arc(3, 3 + radius, centre=(3, 3), ccw=True, feed=1)
    assert VerificationCode.CUT_OTHER_WAY not in codes(judged(same.finish(), wanted))
    other = square(ToolpathBuilder(), 1, 1, 1)
    cut(other, 3, 3 + radius).arc(3, 3 + radius, centre=(3, 3), ccw=False, feed=1)
    found = judged(other.finish(), wanted)
    (turned,) = [f for f in found.findings if f.code == VerificationCode.CUT_OTHER_WAY]
    assert turned.severity == Severity.ERROR
    assert not {VerificationCode.CONTOUR_MISSING, VerificationCode.EXTRA_CUT} & set(codes(found))


def test_an_open_line_may_run_either_way() -> None:
    wanted = cut(ToolpathBuilder(), 1, 1).line(2, 1, feed=1).line(2, 2, feed=1).finish()
    back = cut(ToolpathBuilder(), 2, 2).line(2, 1, feed=1).line(1, 1, feed=1).finish()
    assert VerificationCode.CUT_OTHER_WAY not in codes(judged(back, wanted))


def test_the_wrong_depth_is_a_missing_and_an_extra_cut() -> None:
    wanted = sample_part().finish()
    z = np.where(wanted.end[:, 2] < 0, -0.05, wanted.end[:, 2])
    decoded = replace(wanted, end=np.column_stack([wanted.end[:, :2], z]))
    found = judged(decoded, wanted)
    assert codes(found).count(VerificationCode.CONTOUR_MISSING) == 3
    assert codes(found).count(VerificationCode.EXTRA_CUT) == 3
    assert "at its depth" in found.findings[0].message
    assert found.report.error_um.rounding.max == pytest.approx(0.0, abs=1e-6)


def test_a_program_that_lost_its_plunges_cuts_nothing() -> None:
    wanted = sample_part().finish()
    decoded = replace(wanted, end=np.column_stack([wanted.end[:, :2], np.zeros(len(wanted))]))
    found = judged(decoded, wanted)
    assert codes(found).count(VerificationCode.CONTOUR_MISSING) == 3
    assert VerificationCode.NO_MOTION in codes(found)
    assert found.report.error_um.total.max is None


def test_reversals_are_told_apart_and_too_many_are_a_warning() -> None:
    decoded = sample_part().finish()

    def chunks(reversals: int):
        for piece in follow(decoded, 10):
            counted = np.array([[reversals, 1, 1]])
            yield replace(piece, ledger=replace(piece.ledger, reversals=counted))

    case = Case(decoded, on(MACHINE), None, None, VerifyOptions())
    found = judge(case, chunks(1))
    cutting = 6
    assert found.report.reversals.x == len(decoded)
    assert found.report.reversals.cutting.x == cutting
    assert found.report.reversals.air.x == len(decoded) - cutting
    assert VerificationCode.MANY_REVERSALS not in codes(found)
    # Their errors do not grow with the part: the thesis's larger ones bore as many.
    assert VerificationCode.MANY_REVERSALS not in codes(judge(case, chunks(2)))
    machine = pic_mmh("limits.small_part_mm=5")
    many = judge(replace(case, target=on(machine)), chunks(2))
    (warning,) = [f for f in many.findings if f.code == VerificationCode.MANY_REVERSALS]
    assert (warning.measured, warning.limit) == (18.0, 16.0)
    assert warning.severity == Severity.WARNING


def test_an_arc_that_never_ends_is_an_error_with_its_block() -> None:
    b = cut(ToolpathBuilder(), grid(2.0), grid(1.0))
    b.block = 11
    b.arc(grid(1.0), grid(2.0), centre=(grid(1.0), grid(1.0)), ccw=True, feed=1)
    decoded = b.finish()
    end = decoded.end[-1].copy()

    def chunks():
        for piece in follow(decoded, 10):
            if piece.ledger.row[0] == 3:
                missed = piece.commanded.copy()
                missed[-1, :2] = end[:2] + np.array([STEP, -STEP])
                ledger = replace(piece.ledger, ended=np.array([False]))
                yield replace(piece, commanded=missed, ledger=ledger)
            else:
                yield piece

    found = judge(Case(decoded, on(MACHINE), None, None, VerifyOptions()), chunks())
    (finding,) = [f for f in found.findings if f.code == ProgramCode.ARC_MISSES_END]
    assert finding.severity == Severity.ERROR
    assert finding.where.startswith("block 12,")
    assert finding.measured == pytest.approx(math.sqrt(2.0))
    assert finding.unit == "steps"
    assert found.report.blocks == 12


def test_travel_play_and_homing() -> None:
    b = cut(ToolpathBuilder(), -1.0, 1.0).line(9.5, 1.0, feed=1).rapid(9.5, 2.0).rapid(z=0.2)
    found = judged(b.event(Kind.HOME_Z).finish())
    (travel,) = [f for f in found.findings if f.code == ProgramCode.OUT_OF_TRAVEL]
    assert (travel.measured, travel.limit) == (pytest.approx(10.5), 10.0)
    assert travel.where.startswith("axis X")
    (play,) = [f for f in found.findings if f.code == ProgramCode.PLAY_NOT_KNOWN]
    assert play.where == "axis Z"
    assert codes(found).count(VerificationCode.RETURN_TO_MACHINE_ZERO) == 1


@pytest.mark.parametrize(
    "b",
    [
        ToolpathBuilder(),
        ToolpathBuilder().event(Kind.END),
        ToolpathBuilder().line(0, 0, feed=1),
        ToolpathBuilder().rapid(z=0.2).rapid(1, 1),
    ],
    ids=["empty", "end", "standing still", "air only"],
)
def test_programs_that_cut_nothing_are_told_so(b: ToolpathBuilder) -> None:
    found = judged(b.finish())
    (finding,) = [f for f in found.findings if f.code == VerificationCode.NO_MOTION]
    assert finding.severity == Severity.WARNING
    assert found.report.dimensions == ()
    assert found.report.error_um.total.max is None
    assert len(found.trace.points) >= 1


def test_findings_of_all_stages_are_merged_once() -> None:
    shared = Finding(ProgramCode.FEED_ABOVE_LIMIT, Severity.ERROR, "too fast", where="block 4")
    other = Finding(PlanningCode.CONTOUR_TOO_SMALL, Severity.WARNING, "lost")
    drawn = Finding(DrawingCode.UNITLESS, Severity.WARNING, "no unit")
    plain = sample_part().finish()
    paths = Polylines.of([Polyline(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))])
    drawing = Drawing(
        paths, ("0",), ("",), ("",), "a.dxf", Units("mm", 1.0, "said"),
        findings=(drawn, shared),
    )  # fmt: skip
    decoded, wanted = replace(plain, findings=(shared,)), replace(plain, findings=(other, shared))
    off, nothing = np.tile([2e-4, 1e-4], (len(wanted), 1)), np.zeros((0, 2, 2))
    edge, none = np.full(len(wanted), -1), np.zeros(0, dtype=np.bool_)
    drawn_lines = DrawnEdges(off, edge, nothing, nothing, edge[:0], none, none)
    wanted = replace(wanted, drawn=drawn_lines)
    found = judge(
        Case(decoded, on(MACHINE), wanted, drawing, VerifyOptions()), follow(decoded, 10)
    )
    assert codes(found)[:3] == [
        DrawingCode.UNITLESS,
        ProgramCode.FEED_ABOVE_LIMIT,
        PlanningCode.CONTOUR_TOO_SMALL,
    ]
    assert codes(found).count(ProgramCode.FEED_ABOVE_LIMIT) == 1
    assert [item.code for item in found.report.findings] == [code.name for code in codes(found)]
    assert found.report.error_um.fit.max == pytest.approx(0.2)
    assert found.report.error_um.fit.rms == pytest.approx(0.1)
    fewer = found.with_findings((other,))
    assert [item.code for item in fewer.report.findings] == ["CONTOUR_TOO_SMALL"]
    assert fewer.findings == (other,)


def test_many_findings_of_a_kind_are_cut_short() -> None:
    wanted = ToolpathBuilder()
    for number in range(30):
        square(wanted, grid(1 + 0.1 * number), 1, grid(0.05))
    decoded = square(ToolpathBuilder(), 1, 2, grid(0.05)).finish()
    found = judged(decoded, wanted.finish())
    missing = [f for f in found.findings if f.code == VerificationCode.CONTOUR_MISSING]
    assert len(missing) == 20
    assert missing[-1].message.endswith("and 10 more contours")
