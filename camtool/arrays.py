"""Array types: float64, int64, int32, int8, bool and uint8, of any shape.

Docstrings give the shape and the unit where an array is used: `(K, 2)` mm."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Number = TypeVar("Number", bound="np.generic[Any]")

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Indices = npt.NDArray[np.int32]
Codes = npt.NDArray[np.int8]
Bools = npt.NDArray[np.bool_]
Octets = npt.NDArray[np.uint8]


def columns_of(rows: npt.NDArray[Number]) -> npt.NDArray[Number]:
    """Return rows (N, K) as columns (K, N), each of them contiguous.

    numpy reduces a column in one loop, but rows of two or three numbers in N of them, which takes
    20 to 40 times as long; the sum of a row has the same order in both."""
    return np.ascontiguousarray(rows.T)


def distinct(values: npt.NDArray[Number]) -> npt.NDArray[Number]:
    """Return the values (K,) of an array in ascending order, without repeats.

    `numpy.unique` loads `numpy.ma` to ask whether the array is masked, which takes 7 ms of each
    command."""
    ordered = np.sort(values, axis=None)
    is_first = np.ones(len(ordered), dtype=np.bool_)
    np.not_equal(ordered[1:], ordered[:-1], out=is_first[1:])
    return ordered[is_first]


def distinct_rows(values: npt.NDArray[Number]) -> npt.NDArray[Number]:
    """Return the rows of an array (J, K) in ascending order, without repeats."""
    # With the counts numpy.unique does not ask whether the array is masked.
    return np.asarray(np.unique(values, axis=0, return_counts=True)[0])
