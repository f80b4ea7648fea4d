"""Drilled holes: are all there, as deep as wanted, and no others?

A hole is a place where the tool is fed straight down below the stock top and back, in as many
pecks as it likes, without any cut in XY before it leaves the place: no contour begins with it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Ints
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.rapids import STOCK_TOP_MM
from camtool.verify.cuts import Bools, CutMoves, cutting_rows, moved_lengths
from camtool.verify.places import and_more, at_point, block_name


@dataclass(frozen=True, eq=False)
class Holes:
    """H holes of `toolpath`: where, (H, 2) mm, the height of their bottoms (H,) mm, and the row
    (H,) that reached it first."""

    toolpath: Toolpath
    at: Floats
    bottom_mm: Floats
    row: Ints

    def __len__(self) -> int:
        return len(self.row)


def holes_of(toolpath: Toolpath) -> Holes:
    """The holes that a toolpath drills, in order."""
    flat = toolpath.is_motion & (moved_lengths(toolpath) > POSITION_EPS_MM)
    flat |= toolpath.kind == Kind.HOME_XY
    cutting = cutting_rows(toolpath, flat_cuts=False)
    # A stay at one place lies between two moves in XY; neither may cut.
    stay = np.cumsum(flat)
    movers = np.flatnonzero(flat)
    cut = np.zeros(len(movers) + 2, dtype=np.bool_)
    cut[1:-1] = cutting[movers]
    running = np.cumsum(toolpath.kind == Kind.END) == 0
    down = toolpath.is_feed & ~flat & (toolpath.end[:, 2] < STOCK_TOP_MM - POSITION_EPS_MM)
    rows = np.flatnonzero(down & running & ~cut[stay] & ~cut[stay + 1])
    order = rows[np.lexsort((rows, toolpath.end[rows, 2], stay[rows]))]
    deepest = order[np.flatnonzero(np.diff(stay[order], prepend=-1))]
    return Holes(toolpath, toolpath.end[deepest, :2], toolpath.end[deepest, 2], deepest)


def contours_drilled(
    cuts: CutMoves, holes: Holes, limits_mm: tuple[float, float]
) -> tuple[Bools, Bools]:
    """(C,) which contours a hole stands for, and (H,) which holes do: all of the contour lies
    within the first limit of the hole, and is as deep within the second.

    A contour smaller than what a dialect can say comes out as a plunge, and cuts the same.
    """
    import shapely

    drilled = np.zeros(cuts.contour_count, dtype=np.bool_)
    stands = np.zeros(len(holes), dtype=np.bool_)
    if not len(holes) or not len(drilled):
        return drilled, stands
    contour = cuts.contour[cuts.segments.path]
    begin = np.flatnonzero(np.diff(contour, prepend=-1))
    boxes = segment_boxes(cuts.segments)
    low = np.minimum.reduceat(boxes[:, :2], begin)
    high = np.maximum.reduceat(boxes[:, 2:], begin)
    bottom = np.minimum.reduceat(cuts.z[:, 0], begin)
    room = limits_mm[0] - 0.5 * np.hypot(*(high - low).T)
    tiny = np.flatnonzero(room >= 0.0)
    middles = shapely.points(0.5 * (low + high)[tiny])
    tree = shapely.STRtree(shapely.points(holes.at))
    one, hole = tree.query(middles, predicate="dwithin", distance=room[tiny])
    same = np.abs(bottom[tiny[one]] - holes.bottom_mm[hole]) <= limits_mm[1]
    drilled[contour[begin[tiny[one[same]]]]] = True
    stands[hole[same]] = True
    return drilled, stands


def hole_findings(
    decoded: Holes,
    wanted: Holes,
    limits_mm: tuple[float, float],
    stand: tuple[Bools, Bools],
) -> tuple[Finding, ...]:
    """CONTOUR_MISSING for holes that the program does not drill, EXTRA_CUT for others: within the
    limits in XY and in height. `stand`: which decoded and which wanted holes stand for contours
    of the other side, as `contours_drilled` tells."""
    return (
        *_unpaired(wanted, decoded, limits_mm, stand[1], Code.CONTOUR_MISSING),
        *_unpaired(decoded, wanted, limits_mm, stand[0], Code.EXTRA_CUT),
    )


def _unpaired(
    holes: Holes, others: Holes, limits_mm: tuple[float, float], stand: Bools, code: Code
) -> Iterator[Finding]:
    here, paired = _paired(holes, others, limits_mm)
    alone = np.flatnonzero(~paired & ~stand).tolist()
    what = "is not drilled by the program" if code == Code.CONTOUR_MISSING else "was not wanted"
    for number, hole in enumerate(alone):
        more = and_more(number, len(alone), "holes")
        row, depth = int(holes.row[hole]), STOCK_TOP_MM - float(holes.bottom_mm[hole])
        how = ": there is one of another depth" if here[hole] else ""
        yield Finding(
            code,
            Severity.ERROR,
            f"a hole {depth:.3f} mm deep {what}{how}{more}",
            where=f"{block_name(holes.toolpath, row)} at {at_point(holes.at[hole])}",
            measured=depth,
            unit="mm",
        )
        if more:
            return


def _paired(holes: Holes, others: Holes, limits_mm: tuple[float, float]) -> tuple[Bools, Bools]:
    """(H,), (H,) which holes have another one at their place, and which one as deep too."""
    import shapely

    here, same = np.zeros(len(holes), dtype=np.bool_), np.zeros(len(holes), dtype=np.bool_)
    if len(holes) and len(others):
        tree = shapely.STRtree(shapely.points(others.at))
        points = shapely.points(holes.at)
        mine, theirs = tree.query(points, predicate="dwithin", distance=limits_mm[0])
        here[mine] = True
        deep = np.abs(holes.bottom_mm[mine] - others.bottom_mm[theirs]) <= limits_mm[1]
        same[mine[deep]] = True
    return here, same
