"""Judging made motions whose errors are known: every figure against a formula or dense points."""

import numpy as np
import pytest

from camtool.errors import ProgramError
from camtool.findings import Severity
from camtool.records import replace
from camtool.simulation.motion import one_row
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind
from camtool.verification.cuts import cut_moves
from camtool.verification.verify import Case, VerifyOptions, judge
from tests.oracles.dense_moves import circle, cut, dense_distance, follow, points_of
from tests.oracles.judged import MACHINE, STEP, UM, grid, judged, sample_part
from tests.targets import on


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
        shake = wobble[int(piece.ledger.row[0])][: len(piece.commanded)]
        commanded, slide = piece.commanded.copy(), piece.slide.copy()
        commanded[:, :2] += shake[:, :2]
        slide[:, :2] = commanded[:, :2] + shake[:, 2:]
        chunks.append(replace(piece, commanded=commanded, slide=slide))
    case = Case(decoded, on(MACHINE), wanted, None, VerifyOptions())
    error = judge(case, chunks).report.error_um

    feeds = [m for m in decoded if m.kind != Kind.RAPID and m.start[:2] != m.end[:2]]
    feeds += [m for m in decoded if m.kind == Kind.ARC_CCW]
    clouds = {m.index: np.array(points_of(m, 20_000)) for m in feeds}
    target = np.concatenate([np.array(points_of(m, 20_000)) for m in wanted if m.index in clouds])
    inner, lag, total = [], [], []
    for piece in chunks:
        row = int(piece.ledger.row[0])
        if row in clouds:
            for commanded, slide in zip(piece.commanded[:, :2], piece.slide[:, :2], strict=True):
                inner.append(dense_distance(commanded, clouds[row]))
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
    assert found.report.error_um.total.rms == pytest.approx(50.0, abs=1e-6)


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


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e308, -1e300, 1.1e9])
@pytest.mark.parametrize("mover", ["commanded", "slide"])
def test_places_beyond_all_machines_are_refused_and_never_judged(mover: str, value: float) -> None:
    """The judge is compiled with the promise of finite numbers: others led its indices astray."""
    decoded = sample_part().finish()
    case = Case(decoded, on(MACHINE), decoded, None, VerifyOptions(), None)
    for axis in (0, 1):
        for sample in (0, 37, 999):
            points = np.zeros((1000, 3))
            chunk = one_row(2, points, points.copy())
            getattr(chunk, mover)[sample, axis] = value
            with pytest.raises(ProgramError, match="leave every machine"):
                judge(case, [chunk])
    points = np.full((1000, 3), np.nan)
    points[:, :2] = 0.0  # Z is not looked at
    judge(case, [one_row(2, points, points.copy())])


def test_positions_at_the_very_limit_are_judged() -> None:
    decoded = sample_part().finish()
    case = Case(decoded, on(MACHINE), decoded, None, VerifyOptions(), None)
    row = int(np.flatnonzero(cut_moves(decoded, flat_cuts=False).is_cut)[0])
    points = np.full((1000, 3), 1e9)
    found = judge(case, [one_row(row, points, -points)]).report
    assert found.error_um.mechanics.max == pytest.approx(2e9 * np.sqrt(2) * UM)
    assert np.isfinite(found.error_um.total.max)
