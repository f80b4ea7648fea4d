"""The chunks of a motion, row by row: what tests look at."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest

from camtool.arrays import Floats, Ints
from camtool.simulation.motion import Chunk


@dataclass
class RowMotion:
    """All that the chunks say of one row, added up; `parts` is in how many of them it is."""

    commanded: Floats = field(default_factory=lambda: np.empty((0, 3)))
    slide: Floats = field(default_factory=lambda: np.empty((0, 3)))
    duration_s: float = 0.0
    compensation_s: float = 0.0
    iterations: int = 0
    steps: Ints = field(default_factory=lambda: np.zeros(3, dtype=np.int64))
    reversals: Ints = field(default_factory=lambda: np.zeros(3, dtype=np.int64))
    ended: bool = True
    parts: int = 0


def assert_same_rows(whole: list[RowMotion], parts: list[RowMotion]) -> None:
    """Fail unless both runs of a program, in chunks of other sizes, are the same row by row."""
    for one, many in zip(whole, parts, strict=True):
        for name in ("commanded", "slide", "steps", "reversals", "iterations", "ended"):
            assert np.array_equal(getattr(one, name), getattr(many, name)), name
        assert one.duration_s == pytest.approx(many.duration_s)
        assert one.compensation_s == pytest.approx(many.compensation_s)


def rows_of(chunks: Iterable[Chunk]) -> list[RowMotion]:
    """The rows of a motion from 0 to the last that is in a ledger; they must come in order."""
    return list(each_row(chunks))


def each_row(chunks: Iterable[Chunk]) -> Iterator[RowMotion]:
    """The same, each as soon as it is whole: a long motion need not lie in memory."""
    number, one = -1, RowMotion()
    for chunk in chunks:
        ledger = chunk.ledger
        assert (np.diff(ledger.row) > 0).all()
        assert (np.diff(chunk.row) >= 0).all()
        first = np.searchsorted(chunk.row, ledger.row, "left").tolist()
        last = np.searchsorted(chunk.row, ledger.row, "right").tolist()
        assert sum(last) - sum(first) == len(chunk.row), "a sample's row is in no ledger"
        for k, row in enumerate(ledger.row.tolist()):
            if row == number + 1:
                if number >= 0:
                    yield one
                number, one = row, RowMotion()
            assert row == number, "a row is missing, or comes too late"
            here = slice(first[k], last[k])
            one.commanded = np.concatenate([one.commanded, chunk.commanded[here]])
            one.slide = np.concatenate([one.slide, chunk.slide[here]])
            one.duration_s += float(ledger.duration_s[k])
            one.compensation_s += float(ledger.compensation_s[k])
            one.iterations += int(ledger.iterations[k])
            one.steps = one.steps + ledger.steps[k]
            one.reversals = one.reversals + ledger.reversals[k]
            one.ended = one.ended and bool(ledger.ended[k])
            one.parts += 1
    if number >= 0:
        yield one
