"""Distinct values and rows: as numpy.unique finds them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from camtool.arrays import columns_of, distinct, distinct_rows

NUMBERS = st.integers(-4, 4)


KINDS = st.sampled_from([np.float64, np.int64, np.int32])


@given(KINDS.flatmap(lambda kind: arrays(kind, array_shapes(max_dims=2), elements=NUMBERS)))
def test_distinct_values(values: np.ndarray) -> None:
    ours = distinct(values)
    assert ours.dtype == values.dtype
    assert np.array_equal(ours, np.unique(values))
    assert len(distinct(values[:0])) == 0


@given(arrays(np.int64, st.tuples(st.integers(0, 8), st.integers(1, 3)), elements=NUMBERS))
def test_distinct_rows(rows: np.ndarray) -> None:
    assert np.array_equal(distinct_rows(rows), np.unique(rows, axis=0))


@given(st.integers(0, 40), st.integers(1, 3), st.integers(0, 1000))
def test_columns_are_reduced_as_rows_are(count: int, width: int, seed: int) -> None:
    rows = np.random.default_rng(seed).normal(size=(count, width))
    columns = columns_of(rows)
    assert all(column.flags.c_contiguous for column in columns)
    assert np.array_equal(columns.sum(axis=0), rows.sum(axis=1))
    assert np.array_equal(columns.T, rows)
