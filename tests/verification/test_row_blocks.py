"""Figures of rows that come in blocks, against loops over all of them; blocks of any size."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.kernels import judging as at
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind
from camtool.verification import slides
from camtool.verification.cuts import CutMoves, cut_moves
from camtool.verification.figures import RowBlock, RowFigures
from camtool.verification.matching import Match
from camtool.verification.verify import Case, VerifyOptions, judge
from tests.oracles.dense_moves import follow, pic_mmh
from tests.oracles.judged import MACHINE, STEP, sample_part
from tests.oracles.whole_rows import contours, missed, most, whole_rows, worst
from tests.targets import on
from tests.verification.test_steps import both_ways, random_program

STEPS_MM = 0.5, 0.25


def made(rng: np.random.Generator, count: int) -> tuple[CutMoves, Match, np.ndarray]:
    """Rows with columns of few values, so that many are equal."""
    b = ToolpathBuilder()
    for _ in range(count):
        x, y = rng.integers(0, 4, 2) / 4.0
        if rng.integers(2):
            b.line(x, y, rng.integers(-1, 2), feed=1.0)
        else:
            b.arc(x, y, centre=(9.0, 9.0), ccw=True, feed=1.0)
    cuts = cut_moves(b.finish(), flat_cuts=False)
    contour = np.sort(rng.integers(-1, 4, count))
    none = np.full(count, -1)
    match = Match(none, contour, none, none, rng.integers(0, 3, count) / 8.0)
    columns = rng.integers(0, 4, (count, at.ROW_COLUMNS)) / 4.0
    columns[:, at.SAMPLES] = rng.integers(0, 3, count)
    columns[:, at.KNOWN] = np.where(cuts.is_cut, columns[:, at.SAMPLES], 0)
    columns[~cuts.is_cut, at.TOTAL_SQUARES] = columns[~cuts.is_cut, at.TOTAL_SUM] = 0.0
    columns[columns[:, at.SAMPLES] == 0, at.COMMANDED_X : at.COMMANDED_Y + 1] = np.nan
    return cuts, match, columns


@given(st.integers(0, 2**32 - 1), st.integers(0, 30), st.integers(1, 9))
def test_blocks_are_summed_up_as_all_rows_are(seed: int, count: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    cuts, match, columns = made(rng, count)
    found = RowFigures(cuts, match, STEPS_MM, 5)
    found.books.ended[:] = ended = rng.random(count) < 0.8
    for low in range(0, count, size):
        here = slice(low, low + size)
        found.add(RowBlock(low, columns[here], cuts.is_cut[here]))
    rows = whole_rows(columns, cuts.is_cut, match, cuts.toolpath, ended)
    for figure, name in ((found.inner, "inner"), (found.lag, "lag"), (found.whole, "total")):
        assert figure.max == pytest.approx(most(rows, name), nan_ok=True)
        assert figure.row == next((k for k, r in enumerate(rows) if r[name] == figure.max), -1)
    assert found.inner.count == found.lag.count == sum(one["samples"] for one in rows)
    known = sum(one["known"] for one in rows)
    assert found.whole.count == known
    if known:
        squares, total = (sum(one[name] for one in rows) for name in ("squares", "sum"))
        assert found.whole.rms == pytest.approx(math.sqrt(squares / known))
        assert found.mean_mm == pytest.approx(total / known)
    for mine, arc in ((found.lines_mm, False), (found.arcs_mm, True)):
        expected = most([one for one in rows if one["arc"] == arc], "inner")
        assert mine == pytest.approx(expected, nan_ok=True)
    assert np.array_equal(found.total, [one["total"] for one in rows], equal_nan=True)
    assert found.worst.found.tolist() == [pytest.approx(one) for one in worst(rows, 5)]
    for one, other in zip(found.contours.figures(), contours(rows), strict=True):
        assert (one.contour, one.row, one.at_mm, one.max_mm) == other[:4]
        figures = one.rms_mm, one.mean_mm, one.interpolation_mm, one.mechanics_mm, one.fit_mm
        assert figures == pytest.approx(other[4:])
    others = [one for one in rows if one["ended"]]
    for ends, which in ((found.missed, rows), (found.missed_by_others, others)):
        assert (ends.count, ends.row, ends.most_mm) == pytest.approx(missed(which, STEPS_MM))
    assert sorted(found.books.endless) == np.flatnonzero(~ended).tolist()


@pytest.mark.parametrize("rows", [1, 3, 7])
def test_the_size_of_blocks_changes_nothing(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    decoded, wanted = sample_part(shift=3 * STEP).finish(), sample_part().finish()
    case = Case(decoded, on(MACHINE), wanted, None, VerifyOptions())
    whole = judge(case, follow(decoded, 400, lambda points: points * 1.001))
    ran = random_program(np.random.default_rng(3))
    fused = both_ways(ran, pic_mmh())
    monkeypatch.setattr(slides, "ROWS_AT_ONCE", rows)
    parts = judge(case, follow(decoded, 400, lambda points: points * 1.001, pieces=3))
    fused_parts = both_ways(ran, pic_mmh())
    assert Kind.DWELL in ran.kind
    for one, other in ((whole, parts), *zip(fused, fused_parts, strict=True)):
        assert other.report.to_json() == one.report.to_json()
        assert np.array_equal(other.rows.total, one.rows.total, equal_nan=True)
        assert other.rows.seconds == pytest.approx(one.rows.seconds)
        assert np.array_equal(other.trace.points, one.trace.points)
        assert np.array_equal(other.trace.cutting, one.trace.cutting)
