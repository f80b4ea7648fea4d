"""Where an axis turns back while the tool is fed: there its play shows.

An arc goes one way in X and in Y between the multiples of 90°; each such piece, and each line, has
a sign per axis. An axis turns where its sign is another than the last one that was not 0, rapids
included; a turn counts where the piece behind it is a feed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.toolpath.moves import Toolpath

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

QUARTER_RAD = 0.5 * np.pi

LEAST_PIECE_RAD = 1e-9
"""Of an arc that begins or ends at a multiple of 90°, no shorter piece is taken for its own."""


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Where P pieces begin, (P, 2) mm, and the signs of X and Y on each, (P, 2); `row` (P,) of
    the toolpath."""

    begin: Floats
    signs: Ints
    row: Ints


def turns_of(toolpath: Toolpath) -> Floats:
    """(R, 2) mm: the places, in order; both axes may turn at one."""
    pieces = _pieces(toolpath)
    turned = _turned(pieces.signs[:, 0]) | _turned(pieces.signs[:, 1])
    return np.asarray(pieces.begin[turned & toolpath.is_feed[pieces.row]])


def _turned(signs: Ints) -> Bools:
    """(P,) whether the sign is another than the last one before it that was not 0."""
    found: Bools = np.zeros(len(signs), dtype=np.bool_)
    moving = np.flatnonzero(signs)
    found[moving[1:]] = signs[moving[1:]] != signs[moving[:-1]]
    return found


def _pieces(toolpath: Toolpath) -> _Pieces:
    """All moves in their order, arcs cut at the multiples of 90°."""
    starts, ends, sweeps = toolpath.starts[:, :2], toolpath.end[:, :2], toolpath.sweeps()
    rows = np.flatnonzero(toolpath.is_motion)
    is_arc = toolpath.is_arc[rows] & (sweeps[rows] != 0.0)
    spoke = np.where(is_arc[:, None], starts[rows] - toolpath.centre[rows], 0.0)
    sweep = np.where(is_arc, sweeps[rows], 0.0)
    angle = np.arctan2(spoke[:, 1], spoke[:, 0])
    first, inside = _quarters(angle, sweep)
    # A row of n inner quarters has the pieces 0 … n; piece k > 0 begins at the k-th of them.
    of = np.repeat(np.arange(len(rows)), inside + 1)
    k = np.arange(len(of)) - np.repeat(np.cumsum(inside + 1) - (inside + 1), inside + 1)
    way = np.where(sweep[of] < 0.0, -1.0, 1.0)
    quarter = (first[of] + way * (k - 1)) * QUARTER_RAD
    low = np.where(k == 0, angle[of], quarter)
    high = np.where(k == inside[of], (angle + sweep)[of], quarter + way * QUARTER_RAD)
    radius = np.hypot(spoke[:, 0], spoke[:, 1])[of]
    turned = np.where(is_arc, toolpath.centre[rows].T, 0.0).T[of]
    turned = turned + radius[:, None] * np.column_stack([np.cos(low), np.sin(low)])
    middle = 0.5 * (low + high)
    bent = np.column_stack([-way * np.sin(middle), way * np.cos(middle)])
    straight = (ends - starts)[rows][of]
    arcs = is_arc[of, None]
    return _Pieces(
        np.where(arcs & (k > 0)[:, None], turned, starts[rows][of]),
        _signs(np.where(arcs, bent, straight)),
        rows[of],
    )


def _quarters(begin: Floats, sweep: Floats) -> tuple[Floats, Ints]:
    """Of arcs (A,): the first multiple of 90° strictly inside, in the order of travel, and how
    many there are. Lines, of sweep 0, have none."""
    low = np.minimum(begin, begin + sweep) + LEAST_PIECE_RAD
    high = np.maximum(begin, begin + sweep) - LEAST_PIECE_RAD
    least, most = np.ceil(low / QUARTER_RAD), np.floor(high / QUARTER_RAD)
    inside = np.where(sweep == 0.0, 0, np.maximum(most - least + 1.0, 0.0)).astype(np.int64)
    return np.where(sweep < 0.0, most, least), inside


def _signs(lengths: Floats) -> Ints:
    up, down = lengths > POSITION_EPS_MM, lengths < -POSITION_EPS_MM
    return up.astype(np.int64) - down.astype(np.int64)
