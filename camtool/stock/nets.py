"""The nets of a board after its cut: proved to be apart from each other, and whole.

The copper is a layer of the stock as thick as the job says. At the bottom of that layer a move
leaves a groove as wide as the tool is there; the slides are nowhere farther than `beside_mm` from
the moves. So the groove of the narrowest tool and path is cut for sure, and none is wider than
that of the widest:

- two nets are apart if no connected copper outside of the narrowest grooves holds parts of both:
  dead copper between them joins them as a track would;
- a net is whole if its copper outside of the widest grooves is in one piece, by itself or by
  copper that is left beside it.

Arcs of the drawing and round ends of grooves become chords within FLAT_MM, on the side that keeps
this true for grooves."""

from __future__ import annotations

import math

import numpy as np
import shapely
from msgspec import Struct
from shapely.geometry.base import BaseGeometry

from camtool.arrays import Floats, Ints
from camtool.geometry.measure import chords_of
from camtool.geometry.polylines import Polylines, Segments
from camtool.stock.moves import StockMoves
from camtool.stock.wanted import CopperNets

FLAT_MM = 5e-4
"""Chords of drawn arcs lie within this of them."""

QUARTER = 16
"""Number of chords of a quarter of a round end: at a radius of 0.1 mm they are within 0.12 µm of
it."""

SPECK_MM = 0.05
"""Pieces of a net without room for a disc of this diameter are chips, not conductors."""

MARGIN_MM = 5.0
"""Width of the copper assumed around the drawing, if the job does not give the size of the
blank."""

WIDTH_ROUNDS = 12
"""Rounds of the bisection for the narrowest copper: to 1/4000 of the widest."""


class NetFault(Struct, frozen=True):
    """A fault of nets (by number) at a place (x, y), mm: two nets that are joined, or one that is
    cut apart (`other` None) or cut away entirely (`pieces` 0)."""

    net: int
    other: int | None
    at_mm: tuple[float, float]
    pieces: int = 0


class Width(Struct, frozen=True):
    """The width of a narrowest place, mm, and its position."""

    width_mm: float
    at_mm: tuple[float, float]


class NetReport(Struct, frozen=True):
    """The nets of a board after the cut. `gap`: the narrowest groove between a piece of copper of
    a net and another piece; `copper`: the least width of the copper that is left of any net."""

    nets: int
    shorts: tuple[NetFault, ...]
    opens: tuple[NetFault, ...]
    gap: Width | None
    copper: Width | None


def judge_nets(
    moves: StockMoves, copper: CopperNets, box_mm: tuple[float, float, float, float] | None
) -> NetReport:
    """Judge the nets of copper after these moves.

    `box_mm`: the blank (left, low, right, high); None: MARGIN_MM around the contours."""
    nets = list(shapely.get_parts(_area(copper.contours)))
    if not nets:
        return NetReport(0, (), (), None, None)
    low_x, low_y, high_x, high_y = box_mm or (
        *(min(values) - MARGIN_MM for values in zip(*(n.bounds[:2] for n in nets), strict=True)),
        *(max(values) + MARGIN_MM for values in zip(*(n.bounds[2:] for n in nets), strict=True)),
    )
    blank = shapely.union_all([shapely.box(low_x, low_y, high_x, high_y), *nets])
    narrow_cut, wide_cut = (
        _grooves(moves, -copper.thickness_mm, widest=False),
        _grooves(moves, -copper.thickness_mm, widest=True),
    )
    sure = _pieces_of(blank.difference(narrow_cut), nets)
    shorts = [
        NetFault(first, second, _between(nets[first], nets[second]))
        for first, second in _joined(sure)
    ]
    remaining = _pieces_of(blank.difference(wide_cut), nets)
    opens = [
        NetFault(net, None, _middle(nets[net]), len(parts))
        for net, parts in enumerate(remaining.of_net)
        if len(parts) != 1
    ]
    return NetReport(
        nets=len(nets),
        shorts=tuple(shorts),
        opens=tuple(opens),
        gap=_least_gap(sure),
        copper=_least_copper([net.difference(wide_cut) for net in nets]),
    )


def _area(contours: Polylines) -> BaseGeometry:
    """Return the region with an odd number of contours around it."""
    rings = [
        shapely.LinearRing(chords_of(Segments.of(path), FLAT_MM, min_count=2).once)
        for path in contours
    ]
    return shapely.build_area(shapely.GeometryCollection(rings))


# Grooves at the bottom of the copper.


def _grooves(moves: StockMoves, z_mm: float, *, widest: bool) -> BaseGeometry:
    """Return the area that the moves cut through the copper: an upper bound if `widest`, else a
    lower bound."""
    high = np.maximum(moves.start[:, 2], moves.end[:, 2])
    low = np.minimum(moves.start[:, 2], moves.end[:, 2])
    depth = z_mm - (low if widest else high)
    rows = np.flatnonzero(depth > 0.0)
    table = moves.table[moves.tool[rows]]
    radius = _radii(table, depth[rows]) + (moves.beside_mm if widest else -moves.beside_mm)
    if widest:  # chords about the round ends, not within them
        radius = radius / math.cos(math.pi / (4.0 * QUARTER))
    rows, radius = rows[radius > 0.0], radius[radius > 0.0]
    if not len(rows):
        return shapely.Polygon()
    begin = _runs(moves, rows, radius)
    lines = [
        shapely.LineString(np.concatenate([moves.start[run[:1], :2], moves.end[run, :2]]))
        for run in np.split(rows, begin[1:])
    ]
    return shapely.union_all(shapely.buffer(np.array(lines), radius[begin], quad_segs=QUARTER))


def _radii(table: Floats, above_tip: Floats) -> Floats:
    """Return the radii (M,) of cutters (rows of the table (M, 4)) at heights (M,) above their
    tips."""
    radius, flat, corner, rise = table.T
    below = np.maximum(corner - above_tip, 0.0)
    round_mm = np.sqrt(np.maximum(corner * corner - below * below, 0.0))
    cone_mm = np.divide(above_tip, rise, out=np.full(len(rise), np.inf), where=rise > 0.0)
    return np.asarray(np.minimum(radius, flat + np.where(corner > 0.0, round_mm, cone_mm)))


def _runs(moves: StockMoves, rows: Ints, radius: Floats) -> Ints:
    """Return the indices among `rows` at which a run of connected moves with equal radius
    begins."""
    follows = (np.diff(rows) == 1) & (np.diff(radius) == 0.0)
    meets = (moves.start[rows[1:], :2] == moves.end[rows[:-1], :2]).all(axis=1)
    return np.concatenate([[0], np.flatnonzero(~(follows & meets)) + 1])


# Connected copper, and the nets in it.


class _Pieces(Struct, frozen=True, eq=False):
    """The connected pieces of copper, and for each net the indices of the pieces that hold a part
    of it."""

    pieces: list[BaseGeometry]
    of_net: list[list[int]]


def _pieces_of(copper: BaseGeometry, nets: list[BaseGeometry]) -> _Pieces:
    pieces = list(shapely.get_parts(copper))
    tree = shapely.STRtree(pieces)
    of_net = []
    for net in nets:
        near = tree.query(net, predicate="intersects").tolist()
        of_net.append(sorted(k for k in near if _conducts(pieces[k].intersection(net))))
    return _Pieces(pieces, of_net)


def _conducts(copper: BaseGeometry) -> bool:
    """Return True if the copper has room for a disc of SPECK_MM; smaller specks are ignored."""
    if copper.area < math.pi * (0.5 * SPECK_MM) ** 2:
        return False
    return not shapely.buffer(copper, -0.5 * SPECK_MM).is_empty


def _joined(copper: _Pieces) -> list[tuple[int, int]]:
    """Return pairs of nets that share a piece of copper: the lowest-numbered net of the piece with
    each other one."""
    nets_in: dict[int, list[int]] = {}
    for net, pieces in enumerate(copper.of_net):
        for piece in pieces:
            nets_in.setdefault(piece, []).append(net)
    pairs = {(nets[0], net) for nets in nets_in.values() for net in nets[1:]}
    return sorted(pairs)


def _between(one: BaseGeometry, other: BaseGeometry) -> tuple[float, float]:
    """Return the middle (x, y) of the shortest line between two areas of copper."""
    (x1, y1), (x2, y2) = shapely.get_coordinates(shapely.shortest_line(one, other)).tolist()
    return 0.5 * (x1 + x2), 0.5 * (y1 + y2)


def _middle(net: BaseGeometry) -> tuple[float, float]:
    point = net.representative_point()
    return point.x, point.y


def _least_gap(copper: _Pieces) -> Width | None:
    """Return the narrowest groove between a piece that belongs to a net and any other piece, None
    if there is none."""
    tree = shapely.STRtree(copper.pieces)
    best: Width | None = None
    for number in sorted({piece for pieces in copper.of_net for piece in pieces}):
        piece = copper.pieces[number]
        reach = math.inf if best is None else best.width_mm
        others = [
            k
            for k in tree.query(piece, predicate="dwithin", distance=min(reach, 1e6)).tolist()
            if k != number and _conducts(copper.pieces[k])
        ]
        for k in others:
            width = float(piece.distance(copper.pieces[k]))
            if best is None or width < best.width_mm:
                best = Width(width, _between(piece, copper.pieces[k]))
    return best


def _least_copper(nets: list[BaseGeometry]) -> Width | None:
    """Return the narrowest neck among all nets: width and place. The width is the largest for
    which each net, eroded by half of it, is still one piece. None if no copper is left."""
    best: Width | None = None
    for net in nets:
        if not _conducts(net):
            continue
        high = math.inf if best is None else best.width_mm
        width = _bottleneck(net, high)
        if width is not None and width < high:
            worn = shapely.buffer(net, -0.5 * width * (1.0 + 2.0**-WIDTH_ROUNDS))
            best = Width(width, _narrow_place(net, worn))
    return best


def _bottleneck(net: BaseGeometry, below_mm: float) -> float | None:
    """Return the width of the narrowest neck of a net, by bisection; None if it is not less than
    `below_mm`."""
    widest = 2.0 * float(shapely.maximum_inscribed_circle(net).length)
    high = min(below_mm, widest)
    if below_mm <= widest and _holds(net, below_mm):
        return None
    low = 0.0
    for _ in range(WIDTH_ROUNDS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _holds(net, middle) else (low, middle)
    return low


def _holds(net: BaseGeometry, width_mm: float) -> bool:
    """Return True if a net, eroded by half of `width_mm`, is still one piece and not empty."""
    worn = shapely.buffer(net, -0.5 * width_mm)
    return sum(map(_conducts, shapely.get_parts(worn))) <= 1 and not worn.is_empty


def _narrow_place(net: BaseGeometry, worn: BaseGeometry) -> tuple[float, float]:
    """Return the place of the narrowest neck: between the pieces into which the eroded net
    (`worn`) falls, or the net's middle if it vanished."""
    parts = [part for part in shapely.get_parts(worn) if not part.is_empty]
    if len(parts) < 2:
        return _middle(net)
    return _between(parts[0], parts[1])
