"""Rows of the builder: one by one, by columns, and in any mixture the same."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import COLUMNS, Kind, Toolpath

PARTS = st.lists(st.tuples(st.integers(1, 40), st.booleans()), min_size=1, max_size=12)
"""How many rows, and whether they come by columns."""


def built(parts: list[tuple[int, bool]]) -> ToolpathBuilder:
    path, done = ToolpathBuilder(), 0
    for count, by_columns in parts:
        path.block, path.source, path.run = count, "odd" if count % 2 else "", done
        ends = np.arange(done, done + count, dtype=np.float64)[:, None] + [0.0, 0.25, 0.5]
        if by_columns:
            feed = np.full(count, 7.0)
            path.moves(
                kind=np.full(count, int(Kind.LINE)),
                end=ends,
                centre=np.full((count, 2), np.nan),
                feed=feed,
            )
        else:
            for x, y, z in ends.tolist():
                path.line(x, y, z, feed=7.0)
        done += count
    return path


def same(one: Toolpath, other: Toolpath) -> bool:
    columns = ((getattr(one, name), getattr(other, name)) for name in COLUMNS)
    return all(np.array_equal(a, b, equal_nan=a.dtype == np.float64) for a, b in columns)


@given(PARTS)
def test_columns_are_rows(parts: list[tuple[int, bool]]) -> None:
    mixed, single = built(parts), built([(count, False) for count, _ in parts])
    assert len(mixed) == len(single) == sum(count for count, _ in parts)
    assert same(mixed.finish(), single.finish())
    assert np.array_equal(mixed.runs, single.runs)


@given(PARTS, PARTS)
def test_a_finished_path_stays_while_the_builder_goes_on(
    parts: list[tuple[int, bool]], more: list[tuple[int, bool]]
) -> None:
    path = built(parts)
    first, runs = path.finish(), path.runs
    kept = [getattr(first, name).copy() for name in COLUMNS]
    for count, _ in more:
        path.line(0.0, feed=float(count))
    assert len(path.finish()) == len(first) + len(more)
    for name, column in zip(COLUMNS, kept, strict=True):
        assert np.array_equal(getattr(first, name), column, equal_nan=column.dtype == np.float64)
        assert np.array_equal(
            getattr(path.finish(), name)[: len(first)], column, equal_nan=column.dtype == float
        )
    assert len(runs) == len(first)


def test_a_column_of_equal_rows_is_one_row() -> None:
    path = ToolpathBuilder().line(1.0, feed=7.0).line(2.0, feed=7.0)
    first = path.finish()
    assert [name for name in COLUMNS if getattr(first, name).strides[0] == 0] == [
        "kind", "centre", "feed", "value", "source", "block", "mode"
    ]  # fmt: skip
    assert path.event(Kind.DWELL, -0.0).event(Kind.DWELL, 0.0).finish().kind.tolist() == [
        *[Kind.LINE] * 2, *[Kind.DWELL] * 2
    ]  # fmt: skip
    assert np.signbit(path.finish().value[2:]).tolist() == [True, False]
    assert first.picked(np.array([1, 0, 1])).feed.strides == (0,)


def test_no_rows() -> None:
    path = ToolpathBuilder()
    assert len(path) == len(path.finish()) == len(path.runs) == 0
