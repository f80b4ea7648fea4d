"""The piece that readers make of an entity, and the cleaning of pieces.

Tolerance: POSITION_EPS_MM, below which two points are one; it decides what is a repeated point,
what has no length, and what is drawn twice.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.drawing import Skipped
from camtool.geometry.polylines import POSITION_EPS_MM, Floats

MAX_COORDINATE_MM = 1e9
"""Beyond this doubles cannot tell positions apart that differ by POSITION_EPS_MM."""


@dataclass(frozen=True, eq=False)
class Piece:
    """One entity: `vertices` (n, 3) of x, y, bulge in mm, and where it came from.

    A closed piece may repeat its first point at its end. `source` begins with the kind of the
    entity ("CIRCLE 2F", "path outline"). `line_type` as a DXF names it, "" elsewhere.
    """

    vertices: Floats
    closed: bool
    layer: str
    colour: str
    source: str
    line_type: str = ""

    @property
    def where(self) -> str:
        """For messages: layer and source."""
        return f"layer {self.layer}, {self.source}"

    @property
    def kind(self) -> str:
        """The first word of the source."""
        return self.source.partition(" ")[0]


def cleaned(pieces: Sequence[Piece], file: str) -> tuple[list[Piece], list[Skipped]]:
    """The pieces without repeated points, each drawn once, and the count of what went.

    DrawingError when a number is not finite or beyond MAX_COORDINATE_MM.
    """
    whole: list[Piece] = []
    seen: set[tuple[str, str, bool, bytes]] = set()
    gone: Counter[tuple[str, str]] = Counter()
    for piece in pieces:
        _check(piece, file)
        vertices, repeated = without_repeats(piece.vertices, piece.closed)
        if len(vertices) < 2:
            gone[piece.kind, "has no length"] += 1
            continue
        if repeated:
            gone[f"point of {piece.kind}", "is repeated"] += repeated
        # There and back along one line encloses nothing: it is that line, once.
        flat = piece.closed and len(vertices) == 2 and not vertices[:, 2].any()
        closed = piece.closed and not flat
        key = (piece.layer, piece.colour, closed, _shape(vertices, closed))
        if key in seen:
            gone[piece.kind, "is drawn twice"] += 1
            continue
        seen.add(key)
        whole.append(replace(piece, vertices=vertices, closed=closed))
    return whole, [Skipped(kind, count, why) for (kind, why), count in gone.items()]


def without_repeats(vertices: Floats, closed: bool) -> tuple[Floats, int]:
    """The vertices (m, 3) without segments below POSITION_EPS_MM, and how many went.

    A closed path's repeated first point at its end goes uncounted: it says "closed" once more.
    """
    steps = np.hypot(*np.diff(vertices[:, :2], axis=0).T)
    kept = vertices
    if (steps <= POSITION_EPS_MM).any():
        kept = _kept(vertices)
    repeated = len(vertices) - len(kept)
    if closed:
        while len(kept) > 1 and np.hypot(*(kept[-1, :2] - kept[0, :2])) <= POSITION_EPS_MM:
            kept = kept[:-1]
    return kept, repeated


def _kept(vertices: Floats) -> Floats:
    """Each vertex that lies off the one kept before it; a bulge belongs to what leaves."""
    rows = [vertices[0].copy()]
    for vertex in vertices[1:]:
        if np.hypot(vertex[0] - rows[-1][0], vertex[1] - rows[-1][1]) > POSITION_EPS_MM:
            rows.append(vertex.copy())
        else:
            rows[-1][2] = vertex[2]
    return np.array(rows)


def _shape(vertices: Floats, closed: bool) -> bytes:
    """The same bytes for the same path in either direction and, when closed, from any start."""
    # Adding 0 makes −0 and 0 one.
    grid = np.round(vertices / POSITION_EPS_MM) + 0.0
    if not closed:
        grid[-1, 2] = 0.0
    back = grid[::-1].copy()
    back[:, 2] = -np.roll(back[:, 2], -1) + 0.0
    if closed:
        grid, back = (np.roll(way, -_least(way), axis=0) for way in (grid, back))
    return min(grid.tobytes(), back.tobytes())


def _least(grid: Floats) -> int:
    """The row of least x, then least y, then least bulge."""
    return int(np.lexsort((grid[:, 2], grid[:, 1], grid[:, 0]))[0])


def _check(piece: Piece, file: str) -> None:
    """DrawingError when a number of the piece is no position in a drawing."""
    if not np.isfinite(piece.vertices).all():
        raise DrawingError("a number is not finite", file=file, where=piece.where)
    furthest = float(np.abs(piece.vertices[:, :2]).max(initial=0.0))
    if furthest > MAX_COORDINATE_MM:
        raise DrawingError(
            f"a point lies {furthest:.6g} mm away, where micrometres are lost",
            file=file,
            where=piece.where,
            mend="move the drawing to its origin, or name its unit with --units",
        )
