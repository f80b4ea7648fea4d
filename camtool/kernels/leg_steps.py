"""Legs of the PIC18F8720's program: what they are, and the interpolator that makes their steps.

A leg is what one interpolator makes: a line of X and Y, an arc, or a line of Z. Its positions come
in blocks, from a state of a few whole numbers that goes on. Exact: integers, as in the kernels of
the methods.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import bare, inner
from camtool.kernels.dda import dda_arc_fill, dda_arc_start, dda_line_fill
from camtool.kernels.direct_search import direct_search_fill, direct_search_start
from camtool.kernels.heading import rounded_radius
from camtool.kernels.stairs import stairs_fill, stairs_start

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

(ROW, KIND, FROM_X, FROM_Y, A, B, ORIGIN_X, ORIGIN_Y, SIGN_X, SIGN_Y, END_X, END_Y, CW, STOP) = (
    range(14)
)
"""Columns of a leg, in steps: the row; what it is; where X and Y stand before; how far a line
goes (of Z: in A, its sign in CW), or where an arc starts about its centre; the start of a
line or the centre of an arc, and the signs that its positions are taken with; the end of an arc
about its centre; whether it is clockwise; after how many samples an arc stops, −1: where it stands
on its end."""

LEG_COLUMNS = 14
"""How many columns."""

LINE, ARC, DEPTH = range(3)
"""Kinds of legs."""

DSM, STAIRS, DDA = range(3)
"""Methods of arcs."""

STATE = 8
"""Numbers of a state: as many as the method with the longest one has."""


@inner
def start_leg(leg: Ints, method: int, rounded: bool, state: Ints) -> None:
    """Set the state (8,) to the start of a leg; that of a line is where its counters are."""
    for k in range(len(state)):
        state[k] = 0
    if leg[KIND] != ARC:
        return
    x, y, clockwise = leg[A], leg[B], leg[CW] != 0
    error = x * x + y * y - rounded_radius(x, y) ** 2 if rounded else 0
    if method == DSM:
        begun = direct_search_start(x, y, clockwise, error)
    elif method == STAIRS:
        begun = stairs_start(x, y, clockwise, error)
    else:
        begun = dda_arc_start(x, y, clockwise)
    for k in range(len(begun)):
        state[k] = begun[k]


@bare
def fill_leg(
    leg: Ints, method: int, state: Ints, registers: Floats, out: Ints
) -> tuple[int, int, bool]:
    """Rows filled, passes run, whether the last one is the end."""
    if leg[KIND] != ARC:
        filled, passes, met = dda_line_fill(leg[A], leg[B], registers, state, out)
    elif method == DDA:
        filled, passes, met = dda_arc_fill(state, leg[END_X], leg[END_Y], out)
    elif method == DSM:
        filled, met = direct_search_fill(state, leg[END_X], leg[END_Y], out)
        passes = filled
    else:
        filled, met = stairs_fill(state, leg[END_X], leg[END_Y], out)
        passes = filled
    return filled, passes, met


@bare
def turn_round(leg: Ints, path_x: Ints, path_y: Ints) -> None:
    """Give the positions of a line their signs; a line of Z leaves X and Y where they are."""
    sign_x, sign_y = leg[SIGN_X], leg[SIGN_Y]
    if leg[KIND] == DEPTH:
        sign_x = sign_y = 0
    for k in range(len(path_x)):
        path_x[k] *= sign_x
    for k in range(len(path_y)):
        path_y[k] *= sign_y
