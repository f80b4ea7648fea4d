"""What must not change the figures (chunks, place, direction), and the trace for pictures."""

import numpy as np
import pytest

from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification.verify import Case, VerifyOptions, judge
from tests.oracles.dense_moves import chunk, cut, follow
from tests.oracles.judged import MACHINE, STEP, UM, grid, sample_part
from tests.targets import on


def test_chunk_size_changes_nothing() -> None:
    decoded, wanted = sample_part(shift=3 * STEP).finish(), sample_part().finish()
    case = Case(decoded, on(MACHINE), wanted, None, VerifyOptions())

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
    one = judge(Case(decoded, on(MACHINE), wanted, None, VerifyOptions()), chunks).report
    two = judge(
        Case(carry(decoded), on(MACHINE), carry(wanted), None, VerifyOptions()), there
    ).report
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

    case = Case(decoded, on(MACHINE), decoded, None, VerifyOptions(trace_points=300))
    chunks = [
        piece if piece.ledger.row[0] != 11 else chunk(11, piece.commanded, spike)
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
    case = Case(decoded, on(MACHINE), None, None, VerifyOptions(trace_points=100))
    assert len(judge(case, follow(decoded, 5)).trace.points) <= 100
