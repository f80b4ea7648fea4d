"""Judging made motions whose errors are known: every figure against a formula or dense points."""

import math
from dataclasses import replace

import numpy as np
import pytest

from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Drawing, FitError, Units
from camtool.geometry.polylines import Polyline, Polylines
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verify.verify import Case, Verification, VerifyOptions, judge
from tests.oracles.dense_moves import (
    chunk,
    circle,
    cut,
    dense_distance,
    follow,
    pic_mmh,
    points_of,
    square,
)

MACHINE = pic_mmh()
STEP = MACHINE.axes.x.coded_step_mm
UM = 1000.0


def grid(mm: float) -> float:
    """On the controller's grid, so that nothing is rounded away."""
    return round(mm / STEP) * STEP


def sample_part(*, shift: float = 0.0) -> ToolpathBuilder:
    """A square, a circle and an open stroke, all on the grid."""
    b = square(ToolpathBuilder(), grid(1.0 + shift), grid(1.0), grid(1.0))
    circle(b, grid(4.0 + shift), grid(2.0), grid(0.75))
    cut(b, grid(1.0 + shift), grid(3.0)).line(grid(2.0 + shift), grid(3.5), feed=1)
    return b.rapid(z=0.2)


def judged(
    decoded: Toolpath, wanted: Toolpath | None = None, bend=lambda points: points, **options
) -> Verification:
    case = Case(decoded, MACHINE, wanted, None, VerifyOptions(**options))
    return judge(case, follow(decoded, bend=bend))


def codes(found: Verification) -> list[Code]:
    return [finding.code for finding in found.findings]


def test_a_perfect_machine_makes_no_error() -> None:
    decoded = sample_part().finish()
    for wanted in (None, decoded):
        error = judged(decoded, wanted).report.error_um
        assert error.interpolation.max == pytest.approx(0.0, abs=1e-6)
        assert error.mechanics.max == 0.0
        assert error.total.max == pytest.approx(0.0, abs=1e-6)
        assert (error.rounding.max is None) == (wanted is None)
        assert error.fit.max is None


def test_a_shift_of_the_slides_is_mechanics_and_shows_in_the_total() -> None:
    decoded = sample_part().finish()
    found = judged(decoded, decoded, lambda points: points + np.array([0.003, 0.004])).report
    assert found.error_um.mechanics.max == pytest.approx(5.0, abs=1e-6)
    assert found.error_um.mechanics.rms == pytest.approx(5.0, abs=1e-6)
    assert found.error_um.interpolation.max == pytest.approx(0.0, abs=1e-6)
    assert 4.0 - 1e-6 <= found.error_um.total.max <= 5.0 + 1e-6
    (ring,) = found.circles
    assert ring.Fmax_um == pytest.approx(5.0, abs=0.01)
    assert ring.Fmin_um == pytest.approx(-5.0, abs=0.01)
    assert ring.G_um < 0.05
    assert [d.error_percent for d in found.dimensions] == pytest.approx([0.0] * 6, abs=1e-4)


@pytest.mark.parametrize("shift_steps", [7, 20])
def test_a_shift_of_the_program_is_rounding_and_shows_in_the_total(shift_steps: int) -> None:
    shift = shift_steps * STEP
    found = judged(sample_part(shift=shift).finish(), sample_part().finish()).report.error_um
    assert found.rounding.max == pytest.approx(shift * UM, rel=1e-3)
    assert found.total.max == pytest.approx(shift * UM, rel=1e-3)
    assert found.interpolation.max == pytest.approx(0.0, abs=1e-6)
    assert found.mechanics.max == 0.0


def test_every_figure_is_that_of_dense_points() -> None:
    decoded, wanted = sample_part(shift=5 * STEP).finish(), sample_part().finish()
    rng = np.random.default_rng(7)
    wobble = {row: rng.normal(0, 0.004, (50, 4)) for row in range(len(decoded))}
    chunks = []
    for piece in follow(decoded, 50):
        shake = wobble[piece.row][: len(piece.commanded)]
        commanded, slide = piece.commanded.copy(), piece.slide.copy()
        commanded[:, :2] += shake[:, :2]
        slide[:, :2] = commanded[:, :2] + shake[:, 2:]
        chunks.append(replace(piece, commanded=commanded, slide=slide))
    case = Case(decoded, MACHINE, wanted, None, VerifyOptions())
    error = judge(case, chunks).report.error_um

    feeds = [m for m in decoded if m.kind != Kind.RAPID and m.start[:2] != m.end[:2]]
    feeds += [m for m in decoded if m.kind == Kind.ARC_CCW]
    clouds = {m.index: np.array(points_of(m, 20_000)) for m in feeds}
    target = np.concatenate([np.array(points_of(m, 20_000)) for m in wanted if m.index in clouds])
    inner, lag, total = [], [], []
    for piece in chunks:
        if piece.row in clouds:
            for commanded, slide in zip(piece.commanded[:, :2], piece.slide[:, :2], strict=True):
                inner.append(dense_distance(commanded, clouds[piece.row]))
                lag.append(float(np.hypot(*(slide - commanded))))
                total.append(dense_distance(slide, target))
    for values, figure in ((inner, error.interpolation), (lag, error.mechanics)):
        assert figure.max == pytest.approx(max(values) * UM, abs=1e-2)
        assert figure.rms == pytest.approx(np.sqrt(np.mean(np.square(values))) * UM, abs=1e-2)
    assert error.total.max == pytest.approx(max(total) * UM, abs=1e-2)
    assert error.total.rms == pytest.approx(np.sqrt(np.mean(np.square(total))) * UM, abs=1e-2)
    exact = np.percentile(total, 95, method="inverted_cdf") * UM
    assert error.total.p95 == pytest.approx(exact, rel=0.005)


def test_the_total_is_taken_against_the_own_contour_not_against_a_neighbour() -> None:
    """A slide that lags by the distance of two lines lies on the wrong one: that is an error."""
    b = cut(ToolpathBuilder(), grid(1.0), grid(1.0)).line(grid(3.0), grid(1.0), feed=1)
    cut(b, grid(1.0), grid(1.05)).line(grid(3.0), grid(1.05), feed=1)
    decoded = b.finish()
    found = judged(decoded, decoded, lambda points: points + np.array([0.0, 0.05]))
    assert found.report.error_um.total.max == pytest.approx(50.0, abs=1e-6)


def test_wanted_contours_that_overlap_are_told_apart_by_the_whole_contour() -> None:
    b = cut(ToolpathBuilder(), grid(2.5), grid(1.0))
    b.arc(grid(1.5), grid(1.0), centre=(grid(2.0), grid(1.0)), ccw=True, feed=1)
    b.line(grid(1.5), grid(2.0), feed=1)
    wanted = circle(b, grid(2.0), grid(1.0), grid(0.5)).finish()
    found = judged(wanted, wanted, lambda points: points * 1.001).report
    assert [item.radius_mm for item in found.circles] == [pytest.approx(0.5, abs=1e-4)]
    by_name = {item.name: item for item in found.dimensions}
    assert by_name["contour 2 Y"].predicted_mm == pytest.approx(1.001, abs=1e-3)
    assert found.error_um.rounding.max == pytest.approx(0.0, abs=1e-6)


def test_two_wanted_contours_cut_in_one_go_are_taken_row_by_row() -> None:
    corner = (grid(1.0), grid(1.0))
    wanted = cut(ToolpathBuilder(), *corner).line(grid(2.0), grid(1.0), feed=1)
    cut(wanted, grid(2.0), grid(1.0)).line(grid(2.0), grid(2.0), feed=1).rapid(z=0.2)
    decoded = cut(ToolpathBuilder(), *corner).line(grid(2.0), grid(1.0), feed=1)
    decoded.line(grid(2.0), grid(2.0), feed=1).rapid(z=0.2)
    found = judged(decoded.finish(), wanted.finish(), lambda points: points + 0.002)
    assert [f for f in found.findings if f.severity == Severity.ERROR] == []
    assert found.report.error_um.total.max == pytest.approx(2.0, abs=0.9)
    assert found.report.error_um.rounding.max == pytest.approx(0.0, abs=1e-6)


def test_sizes_of_part_and_contours_with_their_sign() -> None:
    decoded = sample_part().finish()
    found = judged(decoded, decoded, lambda points: points * [1.01, 0.98]).report
    by_name = {d.name: d for d in found.dimensions}
    assert list(by_name) == [
        "part X",
        "part Y",
        "contour 1 X",
        "contour 1 Y",
        "contour 2 X",
        "contour 2 Y",
    ]
    for name, item in by_name.items():
        assert item.error_percent == pytest.approx(1.0 if name[-1] == "X" else -2.0, abs=1e-3)
    assert by_name["contour 2 X"].nominal_mm == pytest.approx(1.5, abs=1e-3)
    assert by_name["part X"].nominal_mm == pytest.approx(3.75, abs=1e-3)


def test_a_size_that_is_nominally_nothing_has_no_percentage() -> None:
    b = cut(ToolpathBuilder(), grid(1.0), grid(1.0)).line(grid(3.0), grid(1.0), feed=1)
    along, across = judged(b.finish()).report.dimensions
    assert along.error_percent == pytest.approx(0.0, abs=1e-6)
    assert across.error_percent is None


def test_closure_is_the_gap_of_the_slides_on_closed_contours_only() -> None:
    decoded = sample_part().finish()
    seen = 0

    def drift(points: np.ndarray) -> np.ndarray:
        nonlocal seen
        seen += 1
        return points + np.array([seen * 1e-3, 0.0])

    # The square is rows 3 to 6: a µm more each row, so four from its start to its end.
    assert judged(decoded, decoded, drift).report.closure_um == pytest.approx(4.0, abs=1e-6)
    open_stroke = cut(ToolpathBuilder(), 1, 1).line(2, 1, feed=1).finish()
    assert judged(open_stroke).report.closure_um is None


def test_a_dropped_contour_is_missing() -> None:
    b = sample_part()
    decoded = b.finish()
    wanted = circle(b, grid(2.0), grid(2.2), grid(0.1)).finish()
    found = judged(decoded, wanted)
    (missing,) = [f for f in found.findings if f.code == Code.CONTOUR_MISSING]
    assert missing.severity == Severity.ERROR
    assert "100% of contour 4" in missing.message
    assert missing.measured is not None
    assert missing.measured > 0.05
    assert Code.EXTRA_CUT not in codes(found)


def test_an_added_contour_is_extra() -> None:
    b = sample_part()
    wanted = b.finish()
    decoded = circle(b, grid(2.0), grid(2.2), grid(0.1)).finish()
    found = judged(decoded, wanted)
    assert Code.CONTOUR_MISSING not in codes(found)
    (extra,) = [f for f in found.findings if f.code == Code.EXTRA_CUT]
    assert "move 22 near (2." in extra.where


def test_a_short_missing_line_is_found() -> None:
    b = cut(ToolpathBuilder(), 1, 1).line(2, 1, feed=1)
    decoded = b.finish()
    wanted = b.line(2.0, 1.012, feed=1).finish()
    found = judged(decoded, wanted)
    (missing,) = [f for f in found.findings if f.code == Code.CONTOUR_MISSING]
    assert missing.measured == pytest.approx(0.012, rel=0.02)


def test_the_wrong_depth_is_a_missing_and_an_extra_cut() -> None:
    wanted = sample_part().finish()
    z = np.where(wanted.end[:, 2] < 0, -0.05, wanted.end[:, 2])
    decoded = replace(wanted, end=np.column_stack([wanted.end[:, :2], z]))
    found = judged(decoded, wanted)
    assert codes(found).count(Code.CONTOUR_MISSING) == 3
    assert codes(found).count(Code.EXTRA_CUT) == 3
    assert "at its depth" in found.findings[0].message
    assert found.report.error_um.rounding.max == pytest.approx(0.0, abs=1e-6)


def test_a_program_that_lost_its_plunges_cuts_nothing() -> None:
    wanted = sample_part().finish()
    decoded = replace(wanted, end=np.column_stack([wanted.end[:, :2], np.zeros(len(wanted))]))
    found = judged(decoded, wanted)
    assert codes(found).count(Code.CONTOUR_MISSING) == 3
    assert Code.NO_MOTION in codes(found)
    assert found.report.error_um.total.max is None


def test_a_program_without_any_z_is_judged_as_a_drawing() -> None:
    b = ToolpathBuilder().rapid(grid(1), grid(1)).line(grid(2), grid(1), feed=1)
    found = judged(b.finish(), None, lambda points: points + np.array([0.0, 0.002]))
    assert found.report.contours == 1
    assert found.report.error_um.total.max == pytest.approx(2.0, abs=1e-6)


def test_air_moves_count_in_time_and_steps_but_not_in_errors() -> None:
    decoded = ToolpathBuilder().rapid(z=0.2).rapid(3, 3).line(4, 4, feed=1).finish()
    found = judged(decoded, None, lambda points: points + 1.0).report
    assert found.time_s == 3 * 400
    assert found.time_split_s.cutting == 0.0
    assert found.steps.x == 3 * 400
    assert found.error_um.total.max is None


def test_reversals_are_told_apart_and_too_many_are_a_warning() -> None:
    decoded = sample_part().finish()

    def chunks(reversals: int):
        for piece in follow(decoded, 10):
            yield replace(piece, reversals=np.array([reversals, 1, 1]))

    case = Case(decoded, MACHINE, None, None, VerifyOptions())
    found = judge(case, chunks(1))
    cutting = 6
    assert found.report.reversals.x == len(decoded)
    assert found.report.reversals.cutting.x == cutting
    assert found.report.reversals.air.x == len(decoded) - cutting
    assert Code.MANY_REVERSALS not in codes(found)
    many = judge(case, chunks(2))
    (warning,) = [f for f in many.findings if f.code == Code.MANY_REVERSALS]
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
            if piece.row == 3:
                missed = piece.commanded.copy()
                missed[-1, :2] = end[:2] + np.array([STEP, -STEP])
                yield replace(piece, commanded=missed, ended=False)
            else:
                yield piece

    found = judge(Case(decoded, MACHINE, None, None, VerifyOptions()), chunks())
    (finding,) = [f for f in found.findings if f.code == Code.ARC_MISSES_END]
    assert finding.severity == Severity.ERROR
    assert finding.where.startswith("block 12,")
    assert finding.measured == pytest.approx(math.sqrt(2.0))
    assert finding.unit == "steps"
    assert found.report.blocks == 12


def test_travel_play_homing_and_rapids_in_stock() -> None:
    b = cut(ToolpathBuilder(), -1.0, 1.0).line(9.5, 1.0, feed=1).rapid(9.5, 2.0).rapid(z=0.2)
    found = judged(b.event(Kind.HOME_Z).finish())
    (travel,) = [f for f in found.findings if f.code == Code.OUT_OF_TRAVEL]
    assert (travel.measured, travel.limit) == (pytest.approx(10.5), 10.0)
    assert travel.where.startswith("axis X")
    (play,) = [f for f in found.findings if f.code == Code.PLAY_NOT_KNOWN]
    assert play.where == "axis Z"
    (rapid,) = [f for f in found.findings if f.code == Code.EXTRA_CUT]
    assert rapid.where.startswith("move 5")
    assert codes(found).count(Code.RETURN_TO_MACHINE_ZERO) == 1


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
    (finding,) = [f for f in found.findings if f.code == Code.NO_MOTION]
    assert finding.severity == Severity.WARNING
    assert found.report.dimensions == ()
    assert found.report.error_um.total.max is None
    assert len(found.trace.points) >= 1


def test_findings_of_all_stages_are_merged_once() -> None:
    shared = Finding(Code.FEED_ABOVE_LIMIT, Severity.ERROR, "too fast", where="block 4")
    other = Finding(Code.CONTOUR_TOO_SMALL, Severity.WARNING, "lost")
    drawn = Finding(Code.UNITLESS, Severity.WARNING, "no unit")
    plain = sample_part().finish()
    paths = Polylines.of([Polyline(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))])
    drawing = Drawing(
        paths, ("0",), ("",), ("",), "a.dxf", Units("mm", 1.0, "said"), FitError(2e-4, 1e-4),
        findings=(drawn, shared),
    )  # fmt: skip
    decoded, wanted = replace(plain, findings=(shared,)), replace(plain, findings=(other, shared))
    found = judge(Case(decoded, MACHINE, wanted, drawing, VerifyOptions()), follow(decoded, 10))
    assert codes(found)[:3] == [Code.UNITLESS, Code.FEED_ABOVE_LIMIT, Code.CONTOUR_TOO_SMALL]
    assert codes(found).count(Code.FEED_ABOVE_LIMIT) == 1
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
    missing = [f for f in found.findings if f.code == Code.CONTOUR_MISSING]
    assert len(missing) == 20
    assert missing[-1].message.endswith("and 10 more contours")


def test_chunk_size_changes_nothing() -> None:
    decoded, wanted = sample_part(shift=3 * STEP).finish(), sample_part().finish()
    case = Case(decoded, MACHINE, wanted, None, VerifyOptions())

    def bend(points: np.ndarray) -> np.ndarray:
        return points * 1.001

    whole = judge(case, follow(decoded, 400, bend)).report
    pieces = judge(case, follow(decoded, 400, bend, pieces=9)).report
    assert pieces.to_json() == whole.to_json()


@pytest.mark.parametrize("move", ["moved", "turned", "mirrored"])
def test_a_moved_turned_or_mirrored_case_has_the_same_figures(move: str) -> None:
    def carried(points: np.ndarray) -> np.ndarray:
        x, y = points[..., 0], points[..., 1]
        moved = (x + 7000 * STEP, y - 9000 * STEP)  # whole steps: the grid moves along
        pair = {"moved": moved, "turned": (-y, x), "mirrored": (-x, y)}[move]
        return np.stack(pair, axis=-1)

    def carry(toolpath: Toolpath) -> Toolpath:
        kind = toolpath.kind.copy()
        if move == "mirrored":
            kind[toolpath.kind == Kind.ARC_CCW] = Kind.ARC_CW
        start = np.append(carried(toolpath.start[:2]), toolpath.start[2])
        end = np.column_stack([carried(toolpath.end[:, :2]), toolpath.end[:, 2]])
        return replace(toolpath, kind=kind, start=start, end=end, centre=carried(toolpath.centre))

    decoded, wanted = sample_part(shift=4 * STEP).finish(), sample_part().finish()
    chunks = list(follow(decoded, 300, lambda points: points + 0.004 * np.sin(40 * points)))
    there = [
        replace(
            piece,
            commanded=np.column_stack([carried(piece.commanded[:, :2]), piece.commanded[:, 2]]),
            slide=np.column_stack([carried(piece.slide[:, :2]), piece.slide[:, 2]]),
        )
        for piece in chunks
    ]
    one = judge(Case(decoded, MACHINE, wanted, None, VerifyOptions()), chunks).report
    two = judge(Case(carry(decoded), MACHINE, carry(wanted), None, VerifyOptions()), there).report
    for source in ("rounding", "interpolation", "mechanics", "total"):
        for name in ("max", "rms"):
            here, other = (getattr(getattr(r.error_um, source), name) for r in (one, two))
            assert other == pytest.approx(here, abs=2e-6), (source, name)
    assert two.closure_um == pytest.approx(one.closure_um, abs=2e-6)
    assert two.circles[0].G_um == pytest.approx(one.circles[0].G_um, rel=1e-3)
    sizes_one, sizes_two = ({d.name: d for d in r.dimensions} for r in (one, two))
    swap = {"X": "Y", "Y": "X"} if move == "turned" else {"X": "X", "Y": "Y"}
    for name, item in sizes_one.items():
        other = sizes_two[name[:-1] + swap[name[-1]]]
        assert other.predicted_mm == pytest.approx(item.predicted_mm, abs=2e-6)


def test_the_trace_is_bounded_and_keeps_the_peak_and_the_row_ends() -> None:
    decoded = sample_part().finish()
    peak = np.array([grid(4.0) + 0.9, grid(2.0)])

    def spike(points: np.ndarray) -> np.ndarray:
        bent = points.copy()
        bent[np.hypot(*(points - [grid(4.75), grid(2.0)]).T).argmin()] = peak
        return bent

    case = Case(decoded, MACHINE, decoded, None, VerifyOptions(trace_points=300))
    chunks = [
        piece if piece.row != 11 else chunk(11, piece.commanded, spike)
        for piece in follow(decoded, 5000)
    ]
    found = judge(case, chunks)
    trace = found.trace
    assert 50 < len(trace.points) <= 300
    assert trace.error_mm.max() * UM == pytest.approx(found.report.error_um.total.max, abs=1e-5)
    assert trace.points[trace.error_mm.argmax()].tolist() == peak.tolist()
    assert (np.diff(trace.row) >= 0).all()
    assert set(trace.row.tolist()) == set(range(len(decoded)))
    ends = {tuple(np.round(end, 6)) for end in decoded.end[:, :2]}
    assert ends - {tuple(point) for point in np.round(trace.points, 6)} == set()
    assert set(trace.row[trace.cutting].tolist()) == {3, 4, 5, 6, 11, 16}
    assert (trace.error_mm[~trace.cutting] == 0.0).all()


def test_more_rows_than_trace_points_are_thinned() -> None:
    b = cut(ToolpathBuilder(), 1, 1)
    for number in range(400):
        b.line(1 + 0.01 * number, 1 + 0.01 * (number % 2), feed=1)
    decoded = b.finish()
    case = Case(decoded, MACHINE, None, None, VerifyOptions(trace_points=100))
    assert len(judge(case, follow(decoded, 5)).trace.points) <= 100
