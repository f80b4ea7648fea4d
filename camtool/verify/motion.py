"""What is counted over the whole motion: steps, reversals, time, and arcs that never end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import Ints
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verify.cuts import Bools
from camtool.verify.rows import RowFigures


@dataclass(frozen=True, eq=False)
class Tally:
    """Sums over the whole program; reversals and times also apart for cutting and the rest.
    `compensation_s` is a part of cutting and air."""

    steps: Ints
    iterations: int
    reversals: Ints
    cutting_reversals: Ints
    cutting_s: float
    air_s: float
    dwell_s: float
    compensation_s: float
    gave_up: dict[int, tuple[float, float]]
    """Rows whose stop test was never met, and where in XY (mm) the simulation left them."""

    @property
    def time_s(self) -> float:
        """Cutting, air moves and dwells together."""
        return self.cutting_s + self.air_s + self.dwell_s


def tally_of(rows: RowFigures, decoded: Toolpath, is_cut: Bools) -> Tally:
    """The sums over all rows; `is_cut` (N,) tells those that cut."""
    ledger, dwell = rows.ledger, decoded.kind == Kind.DWELL
    air = ~is_cut & ~dwell
    missed = np.flatnonzero(~ledger.ended).tolist()
    return Tally(
        steps=ledger.steps.sum(axis=0),
        iterations=int(ledger.iterations.sum()),
        reversals=ledger.reversals.sum(axis=0),
        cutting_reversals=ledger.reversals[is_cut].sum(axis=0),
        cutting_s=float(ledger.duration_s[is_cut].sum()),
        air_s=float(ledger.duration_s[air].sum()),
        dwell_s=float(ledger.duration_s[dwell].sum()),
        compensation_s=float(ledger.compensation_s.sum()),
        gave_up={
            row: (float(rows.commanded_end[row, 0]), float(rows.commanded_end[row, 1]))
            for row in missed
        },
    )
