"""How deep the tool really goes: play, scale and scatter of Z.

Z runs one way within each row and ends where the program says, so what becomes of it follows from
the ends of the rows alone, whatever the controller does in between.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.verify.case import Case
from camtool.verify.cuts import CutMoves


def depth_error_mm(case: Case, cuts: CutMoves) -> float:
    """The largest difference in height between the slide and the moves as held, at the ends of
    rows that cut, mm; NaN when none does."""
    from camtool.simulation.mechanics import Mechanics

    toolpath = cuts.toolpath
    if not cuts.is_cut.any():
        return math.nan
    mechanics = Mechanics(case.machine, toolpath.start, case.options.effects)
    slide, _ = mechanics.follow(toolpath.end, np.array([0, len(toolpath)]))
    return float(np.abs(slide[:, 2] - toolpath.end[:, 2])[cuts.is_cut].max())
