"""Sizes of machined features: where the tool's envelope lies along circles and edges.

Stations stand along a feature as drawn, each with the normal that points to the side of the tool.
Where the tool's centre moves from a to b, a tool of radius r clears all within r of that segment.
Along the normal of a station, at u = 0 in its own axes (u along the feature, v along the normal),
the cleared region begins at the least v of

    the discs:   v_a − √(r² − u_a²),   v_b − √(r² − u_b²)
    the side:    a + λ (b − a) − r N,   λ from u = 0,  0 ≤ λ ≤ 1,

N being the unit normal of b − a with N_v > 0. The least over all segments is where the machined
edge lies: above 0 material is left, below 0 too much is cut. With r = 0 it is where the path
crosses the normal.

A feature is cut in passes, and each pass clears all above its own depth, too: at a depth z the
segments count that lie no higher. So what is cleared grows from the deepest pass to the surface:
the least and the largest clearance are there. But where a pass is raised over a tab, or comes down
a ramp, other stations are cut at other depths, and places and zones neither grow nor shrink. So
sizes are taken at all depths at which moves lie, and the extreme ones are those of the feature.

Sizes of it are those of ISO 14405-1 (two-point sizes, the least-squares size) and zones of ISO
1101 (minimum zones, as linear programmes in the deviations, which are small beside the feature).
Not modelled: surface texture, taper of the tool, burrs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.inspection.features import (
    BoundDimension,
    CircleFeature,
    DistanceEnd,
    EdgeFeature,
    Feature,
)
from camtool.records import replace

CIRCLE_STATIONS = 360
"""Stations on a whole circle: an even number, so that each has one opposite."""

EDGE_STATIONS = 128

REACHED_MM = 5e-4
"""Where the planned edge is farther than this from its own middle, the tool cannot reach (corners
narrower than it), or another cut crosses: stations there are not measured. Planned moves are
exact to a fifth of this."""

MIN_CUT_SHARE = 0.25

LEVEL_SHARE = 0.5
"""A depth at which fewer of the stations are cut than this part of those at the surface (the end
of a ramp) is not measured by itself."""

MAX_LEVELS = 200
"""Largest number of depths at which a feature is measured; a cut with more (a helix of many arcs)
is measured at so many, evenly spaced."""

SAME_LEVEL_MM = 1e-6

ON_PATH_SHARE = 0.25
"""A tool whose centre comes nearer to a feature than this part of its radius runs along it: the
feature is then its path, not its edge."""

BESIDE_MM = 0.5
"""Moves are searched up to this beyond the tool's radius from a feature: slides may be that far
from the planned path."""


class SweptSegments(Struct, frozen=True, eq=False, dict=True):
    """K segments of the path of a tool: from `a` to `b` (K, 2) mm, `radius` (K,) mm of the tool at
    the surface, the least height `z` (K,) mm to which it cuts, and the wanted row (K,) of each.
    For a tapered tool, whose radius is that at the surface only, `z` is infinite."""

    a: Floats
    b: Floats
    radius: Floats
    z: Floats
    row: Ints

    def of(self, selection: Ints | Bools) -> SweptSegments:
        """Return the segments that a mask or indices select."""
        return SweptSegments(
            self.a[selection],
            self.b[selection],
            self.radius[selection],
            self.z[selection],
            self.row[selection],
        )

    def of_rows(self, rows: Ints) -> SweptSegments:
        """Return the segments of these wanted rows (R,), which are sorted."""
        order, row = self._by_row
        first, last = np.searchsorted(row, rows), np.searchsorted(row, rows, side="right")
        counts = last - first
        place = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        return self.of(order[np.repeat(first, counts) + place])

    @cached_property
    def _by_row(self) -> tuple[Ints, Ints]:
        order = np.argsort(self.row, kind="stable")
        return order, self.row[order]

    def wider(self, by_mm: float) -> SweptSegments:
        """Return the segments with a tool radius larger by `by_mm`; paths of tools without width
        stay as they are."""
        radius = np.where(self.radius > 0.0, np.maximum(self.radius + by_mm, 0.0), 0.0)
        return SweptSegments(self.a, self.b, radius, self.z, self.row)


class Stations(Struct, frozen=True, eq=False):
    """Points at which a feature is measured: places (S, 2) mm, unit normals (S, 2) towards the
    tool, and the mask `measured` (S,) of those on the feature.

    `wide`: distance between neighbours, in radians or mm."""

    places: Floats
    normals: Floats
    measured: Bools
    wide: float


class Cut(Struct, frozen=True, eq=False):
    """The cut of a feature: the `side` on which the tool runs (+1: outside of a circle, left of an
    edge), `on_path` if it runs along the feature, the wanted `rows` that cut it, its stations, and
    the mask (L, S) of stations that are cut at each of L depths. The moves that cut at least to
    `levels_mm` count at each depth; these fall from the surface (infinite), where all count, to
    the deepest."""

    side: int
    on_path: bool
    rows: Ints
    stations: Stations
    levels_mm: Floats
    seen: Bools


def stations_of(feature: Feature, side: int) -> Stations:
    """Return the stations of a feature, evenly spaced, with normals towards the tool's `side`."""
    if isinstance(feature, CircleFeature):
        wide = 2.0 * math.pi / CIRCLE_STATIONS
        angle = np.arange(0.5 * wide, 2.0 * math.pi, wide)
        spoke = np.column_stack([np.cos(angle), np.sin(angle)])
        places = np.asarray(feature.centre_mm) + feature.radius_mm * spoke
        on_arc = feature.has(angle)
        return Stations(places, side * spoke, on_arc, wide)
    share = (np.arange(EDGE_STATIONS) + 0.5) / EDGE_STATIONS
    along = feature.along
    places = np.asarray(feature.start_mm) + share[:, None] * feature.length_mm * along
    normal = side * np.array([-along[1], along[0]])
    every = np.ones(EDGE_STATIONS, dtype=np.bool_)
    normals = np.broadcast_to(normal, places.shape)
    return Stations(places, normals, every, feature.length_mm / EDGE_STATIONS)


SURFACE = np.array([math.inf])
"""The single level at which all moves count."""


def envelope(
    feature: Feature,
    stations: Stations,
    swept: SweptSegments,
    mask: Bools,
    *,
    levels_mm: Floats = SURFACE,
    above_mm: float = 0.0,
) -> Floats:
    """Return the position (L, S) mm of the machined edge along each station's normal at L falling
    depths; above 0 material is left.

    Only the stations of `mask` (L, S) are computed. It is infinite where no segment clears the
    station; with `above_mm` also where what clears it lies more than that above the middle of all.

    Segments that cross a normal themselves are measured first, which is quick and gives a bound:
    of the others only those can matter whose discs reach below it."""
    crossing = _envelope(feature, stations, swept, mask, levels_mm, -math.inf)
    bound = math.inf
    finite = mask & np.isfinite(crossing)
    if finite.any() and above_mm:
        middles = [
            np.median(row[cut]) for row, cut in zip(crossing, finite, strict=True) if cut.any()
        ]
        bound = float(max(middles)) + above_mm
    elif finite.sum() == mask.sum():
        bound = float(crossing[finite].max(initial=-math.inf))
    remaining = _envelope(feature, stations, swept, mask, levels_mm, bound)
    return np.minimum(crossing, remaining)


def _envelope(
    feature: Feature,
    stations: Stations,
    swept: SweptSegments,
    mask: Bools,
    levels_mm: Floats,
    bound_mm: float,
) -> Floats:
    """Return the `envelope` (L, S) mm of the segments that can reach below `bound_mm`; with −∞, of
    those that cross a normal themselves."""
    positions = np.full((len(levels_mm), len(stations.places)), np.inf)
    segment, station = _pairs(feature, stations, swept, bound_mm)
    # The deepest level to which a segment reaches; the shallower ones follow at the end.
    level = np.searchsorted(-levels_mm, -swept.z + SAME_LEVEL_MM, side="right") - 1
    is_wanted: Bools = np.asarray(mask.any(axis=0))
    keep = is_wanted[station] & (level[segment] >= 0)
    segment, station = segment[keep], station[keep]
    if not len(segment):
        return positions
    level = level[segment]
    (x, y), (normal_x, normal_y) = stations.places.T[:, station], stations.normals.T[:, station]
    radius = swept.radius[segment]
    (ax, ay), (bx, by) = swept.a.T[:, segment], swept.b.T[:, segment]
    ax, ay, bx, by = ax - x, ay - y, bx - x, by - y
    ua, va = ax * normal_y - ay * normal_x, ax * normal_x + ay * normal_y
    ub, vb = bx * normal_y - by * normal_x, bx * normal_x + by * normal_y
    wide = radius > 0.0
    for u, v in ((ua, va), (ub, vb)):
        under = wide & (np.abs(u) <= radius)
        low = v[under] - np.sqrt(radius[under] ** 2 - u[under] ** 2)
        np.minimum.at(positions, (level[under], station[under]), low)
    du, dv = ub - ua, vb - va
    length = np.hypot(du, dv)
    moves = np.flatnonzero(du != 0.0)
    du, dv, length = du[moves], dv[moves], length[moves]
    # N is (−dv, du) or (dv, −du) over the length, with a v above 0.
    nu, nv = -dv * np.sign(du) / length, np.abs(du) / length
    share = (radius[moves] * nu - ua[moves]) / du
    crosses = (share >= 0.0) & (share <= 1.0)
    low = va[moves] - radius[moves] * nv + share * dv
    np.minimum.at(positions, (level[moves][crosses], station[moves][crosses]), low[crosses])
    positions = np.minimum.accumulate(positions[::-1], axis=0)[::-1]
    positions[~mask] = np.inf
    return positions


def _pairs(
    feature: Feature, stations: Stations, swept: SweptSegments, bound_mm: float
) -> tuple[Ints, Ints]:
    """Return the rows of pairs of a segment and a station whose normal its discs may reach below
    `bound_mm`."""
    count = len(stations.places)
    if isinstance(feature, CircleFeature):
        centre = np.asarray(feature.centre_mm)
        from_a, from_b = swept.a - centre, swept.b - centre
        step = from_b - from_a
        share = -(from_a * step).sum(axis=1) / np.maximum((step * step).sum(axis=1), 1e-300)
        nearest_mm = np.hypot(*(from_a + np.clip(share, 0.0, 1.0)[:, None] * step).T)
        farthest = np.maximum(np.hypot(*from_a.T), np.hypot(*from_b.T))
        outer = float(stations.normals[0] @ (stations.places[0] - centre)) > 0.0
        least_v = nearest_mm - feature.radius_mm if outer else feature.radius_mm - farthest
        reach = _reach(swept.radius, least_v, bound_mm)
        sine = reach / np.maximum(nearest_mm, 1e-300)
        half = np.where(sine >= 1.0, math.pi, np.arcsin(np.minimum(sine, 1.0)))
        first = np.arctan2(from_a[:, 1], from_a[:, 0])
        last = np.arctan2(from_b[:, 1], from_b[:, 0])
        turn = np.mod(last - first + math.pi, 2.0 * math.pi) - math.pi
        low, high = first + np.minimum(turn, 0.0) - half, first + np.maximum(turn, 0.0) + half
    else:
        start, along = np.asarray(feature.start_mm), feature.along
        s = (swept.a - start) @ along, (swept.b - start) @ along
        v = np.minimum(
            (swept.a - start) @ stations.normals[0], (swept.b - start) @ stations.normals[0]
        )
        reach = _reach(swept.radius, v, bound_mm)
        low, high = np.minimum(*s) - reach, np.maximum(*s) + reach
    first_at = np.ceil(low / stations.wide - 0.5).astype(np.int64)
    last_at = np.floor(high / stations.wide - 0.5).astype(np.int64)
    if isinstance(feature, EdgeFeature):
        first_at, last_at = np.maximum(first_at, 0), np.minimum(last_at, count - 1)
    counts = np.clip(last_at - first_at + 1, 0, count)
    segment = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(segment)) - np.repeat(np.cumsum(counts) - counts, counts)
    station = np.mod(first_at[segment] + place, count)
    return segment, station


def _reach(radius: Floats, least_v: Floats, bound_mm: float) -> Floats:
    """Return how far (K,) mm beside a normal the centre of a disc may lie, if the disc is to reach
    below `bound_mm` on it.

    The centre is no lower than `least_v`: v − √(r² − u²) ≤ bound needs u² ≤ r² − (v − bound)²."""
    if bound_mm == -math.inf:
        return np.zeros(len(radius))
    below = np.maximum(least_v - bound_mm, 0.0)
    return np.where(below < radius, np.sqrt(np.maximum(radius**2 - below**2, 0.0)), 0.0)


# Assignment of moves to features.


def cut_of(feature: Feature, wanted_moves: SweptSegments) -> Cut | None:
    """Return how the wanted moves cut a feature; None if they do not.

    A tool that tapers makes a feature only where it runs along it, or where its edge at the
    surface is the feature itself: a chamfer is none."""
    straight = np.isfinite(wanted_moves.z)
    walls = _cut_of(feature, wanted_moves.of(straight))
    tapering = _cut_of(feature, wanted_moves.of(~straight))
    if tapering is not None and tapering[1] <= REACHED_MM:
        return walls[0] if walls is not None and walls[1] <= REACHED_MM else tapering[0]
    return None if walls is None else walls[0]


def _cut_of(feature: Feature, wanted_moves: SweptSegments) -> tuple[Cut, float] | None:
    """Return the cut of a feature by these moves, and their distance from it, mm; None if they do
    not cut it."""
    near_moves = _near_feature(feature, wanted_moves)
    v, is_beside = _offsets(feature, wanted_moves, near_moves)
    near_moves, v = near_moves[is_beside], v[is_beside]
    if not len(near_moves):
        return None
    radius = wanted_moves.radius[near_moves]
    tapers = np.isinf(wanted_moves.z[near_moves])
    inner = np.abs(v) <= np.where(tapers, 0.0, ON_PATH_SHARE * radius) + REACHED_MM
    on_path = bool(inner.any())
    if on_path:
        side, own_moves = 1, near_moves[inner]
    else:
        best = int(np.argmin(np.abs(np.abs(v) - radius)))
        side = 1 if v[best] > 0.0 else -1
        own_moves = near_moves[side * v > ON_PATH_SHARE * radius]
    rows = distinct(wanted_moves.row[own_moves])
    chosen_moves = wanted_moves.of(np.isin(wanted_moves.row, rows))
    if on_path:
        chosen_moves = replace(chosen_moves, radius=np.zeros(len(chosen_moves.a)))
    stations = stations_of(feature, side)
    levels = _levels(chosen_moves)
    every = np.broadcast_to(stations.measured, (len(levels), len(stations.measured)))
    planned_edges = envelope(
        feature, stations, chosen_moves, every, levels_mm=levels, above_mm=2.0 * REACHED_MM
    )
    is_cut = np.isfinite(planned_edges)
    middles = []
    for row, is_seen in zip(planned_edges, is_cut, strict=True):
        middles.append(float(np.median(row[is_seen])) if is_seen.any() else math.inf)
        is_seen[is_seen] = np.abs(row[is_seen] - middles[-1]) <= REACHED_MM
    counts = is_cut.sum(axis=1)
    if counts[0] < MIN_CUT_SHARE * stations.measured.sum():
        return None
    is_deep_enough = counts >= LEVEL_SHARE * counts[0]
    cut = Cut(side, on_path, rows, stations, levels[is_deep_enough], is_cut[is_deep_enough])
    return cut, abs(middles[0])


def _levels(swept: SweptSegments) -> Floats:
    """Return the heights (L,) mm of all moves, falling; the first is infinite: there all moves
    count, tapered tools too."""
    heights = distinct(np.round(swept.z[np.isfinite(swept.z)] / SAME_LEVEL_MM) * SAME_LEVEL_MM)
    below = heights[:-1][::-1]
    if len(below) >= MAX_LEVELS:
        below = below[np.linspace(0, len(below) - 1, MAX_LEVELS - 1).round().astype(np.int64)]
    return np.concatenate([SURFACE, below])


def _near_feature(feature: Feature, swept: SweptSegments) -> Ints:
    """Return the indices of the segments whose boxes come within reach of the box of the
    feature."""
    if isinstance(feature, CircleFeature):
        low = np.asarray(feature.centre_mm) - feature.radius_mm
        high = np.asarray(feature.centre_mm) + feature.radius_mm
    else:
        low = np.minimum(feature.start_mm, feature.end_mm)
        high = np.maximum(feature.start_mm, feature.end_mm)
    reach = (swept.radius + BESIDE_MM)[:, None]
    low_ends, high_ends = np.minimum(swept.a, swept.b), np.maximum(swept.a, swept.b)
    return np.flatnonzero(((high_ends >= low - reach) & (low_ends <= high + reach)).all(axis=1))


def _offsets(feature: Feature, swept: SweptSegments, indices: Ints) -> tuple[Floats, Bools]:
    """Return the distances (J,) mm of the midpoints of segments from the feature, and the mask of
    those beside it and within reach.

    Distances are above 0 outside of a circle and left of an edge."""
    middle = 0.5 * (swept.a[indices] + swept.b[indices])
    if isinstance(feature, CircleFeature):
        spoke = middle - np.asarray(feature.centre_mm)
        v = np.hypot(spoke[:, 0], spoke[:, 1]) - feature.radius_mm
        is_beside = feature.has(np.arctan2(spoke[:, 1], spoke[:, 0]))
    else:
        along = feature.along
        arms = middle - np.asarray(feature.start_mm)
        v = arms @ np.array([-along[1], along[0]])
        s = arms @ along
        is_beside = (s >= 0.0) & (s <= feature.length_mm)
    return v, np.asarray(is_beside & (np.abs(v) <= swept.radius[indices] + BESIDE_MM))


# Sizes of envelopes.


class MachinedSize(Struct, frozen=True):
    """A dimension as machined, mm: its least-squares size, and the least and the largest of its
    local sizes. For a tolerance zone all three are its width."""

    fit_mm: float
    low_mm: float
    high_mm: float


def edge_at(feature: Feature, cut: Cut, swept: SweptSegments) -> Floats:
    """Return the position (L, S) mm of the machined edge of a feature at each depth, outwards from
    a circle and to the left of an edge; NaN where it is not cut.

    `swept` is the path of the slides."""
    edges = envelope(feature, cut.stations, swept, cut.seen, levels_mm=cut.levels_mm)
    edges[~np.isfinite(edges)] = np.nan
    return np.asarray(cut.side * edges)


def rows_of(swept: SweptSegments, cut: Cut, feature: Feature) -> SweptSegments:
    """Return the segments of the slides near a feature that belong to the moves that cut it."""
    own_moves = swept.of_rows(cut.rows)
    own_moves = own_moves.of(_near_feature(feature, own_moves))
    return replace(own_moves, radius=np.zeros(len(own_moves.a))) if cut.on_path else own_moves


def size_of(
    bound: BoundDimension, cuts: Sequence[Cut], edges: Sequence[Floats]
) -> MachinedSize | None:
    """Return the size of a dimension; None if one of its features is not cut.

    `edges` are the positions (L, S) of the machined edges, as from `edge_at`, in the order of
    `bound.features`. Below the deepest cut of a feature its deepest edge counts."""
    levels = [cut.levels_mm for cut in cuts]
    values = sizes_of(bound, levels, [each[None] for each in edges])[0]
    return MachinedSize(*values.tolist()) if np.isfinite(values).all() else None


def sizes_of(
    bound: BoundDimension, levels_mm: Sequence[Floats], edges_of_features: Sequence[Floats]
) -> Floats:
    """Return best fit, least and largest local size (N, 3) mm of N parts at once.

    `edges_of_features` (N, L, S) are the positions of the edges of each feature at its depths
    `levels_mm` (L,); NaN where one is not cut. A station counts if it is cut on all N parts."""
    every = distinct(np.concatenate(levels_mm))[::-1]
    sizes_by_level: list[Floats] = []
    last: list[Floats] = []
    for level in every.tolist():
        edges_here = [
            edges[:, min(int(np.searchsorted(-own_levels, -level)), edges.shape[1] - 1)]
            for own_levels, edges in zip(levels_mm, edges_of_features, strict=True)
        ]
        if last and all(map(_are_equal, edges_here, last)):
            continue
        last = edges_here
        if all(_cut_on_all(each).sum() >= MIN_STATIONS for each in edges_here):
            sizes_by_level.append(_sizes(bound, edges_here))
    if not sizes_by_level:
        return np.full((len(edges_of_features[0]), 3), math.nan)
    fit, low, high = sizes_by_level[0].T
    for each in sizes_by_level[1:]:
        low, high = np.minimum(low, each[:, 1]), np.maximum(high, each[:, 2])
    return np.column_stack([fit, low, high])


def distinct_levels(nodes: Floats) -> Ints:
    """Return the indices of the depths at which the edges of a feature, on any of M parts, differ
    from those at the next deeper index returned.

    `nodes` (M, L, S) mm are the positions of the edges."""
    kept_levels = [nodes.shape[1] - 1]
    for level in range(nodes.shape[1] - 2, -1, -1):
        if not _are_equal(nodes[:, level], nodes[:, kept_levels[-1]]):
            kept_levels.append(level)
    return np.array(kept_levels[::-1])


def _are_equal(one: Floats, other: Floats) -> bool:
    """Return True if the edges have equal positions, and therefore equal sizes."""
    return bool(np.allclose(one, other, rtol=0.0, atol=SAME_LEVEL_MM, equal_nan=True))


MIN_STATIONS = 3


def _cut_on_all(offsets: Floats) -> Bools:
    """Return the mask (S,) of the stations that are cut on all parts (N, S)."""
    return np.asarray(np.isfinite(offsets).all(axis=0))


def _sizes(bound: BoundDimension, edges: Sequence[Floats]) -> Floats:
    """Return the sizes (N, 3) mm of N parts whose features have their edges at `edges` (N, S)
    each."""
    kind = bound.dimension.kind
    if kind == "distance":
        first, second = (
            _values(end, each, bound.direction)
            for end, each in zip(bound.ends, edges, strict=True)
        )
        return _distances_between(first, second)
    if kind == "profile":
        return _zones(2.0 * np.nanmax(np.abs(edges[0]), axis=1))
    feature, offsets = bound.features[0], edges[0]
    is_cut = _cut_on_all(offsets)
    if isinstance(feature, EdgeFeature):
        place = np.linspace(-1.0, 1.0, len(is_cut))[is_cut]
        table = np.column_stack([np.ones(len(place)), place])
        return _zones(_widths(table, offsets[:, is_cut]))
    points = _circle_points(feature, offsets)
    centre, radius = fit_circles(points, np.asarray(feature.centre_mm))
    if kind == "position":
        return _zones(2.0 * np.hypot(*(centre - np.asarray(feature.centre_mm)[:, None])))
    spoke = points - centre[..., None]
    rho = _lengths(spoke)
    angle = np.arctan2(spoke[1, 0], spoke[0, 0])
    if kind == "roundness":
        table = np.column_stack([np.ones(len(angle)), np.cos(angle), np.sin(angle)])
        return _zones(_widths(table, rho - radius[:, None]))
    if kind == "radius":
        return np.column_stack([radius, rho.min(axis=1), rho.max(axis=1)])
    local = 2.0 * rho
    if feature.is_closed and len(angle) >= 0.5 * CIRCLE_STATIONS:
        local = rho + _interpolate(angle + math.pi, angle, rho, 2.0 * math.pi)
    return np.column_stack([2.0 * radius, local.min(axis=1), local.max(axis=1)])


def _zones(wide_mm: Floats) -> Floats:
    """Return the sizes (N, 3) of tolerance zones of these widths (N,): best fit, least and largest
    are equal."""
    return np.column_stack([wide_mm, wide_mm, wide_mm])


def _interpolate(
    x: Floats, nodes_x: Floats, values: Floats, period: float | None = None
) -> Floats:
    """Return values (N, Q) at x (Q,), interpolated linearly between those (N, J) at `nodes_x`
    (J,), which may wrap around after a period."""
    number = np.arange(len(nodes_x), dtype=np.float64)
    if period is not None:
        nodes_x, x = np.mod(nodes_x, period), np.mod(x, period)
    order = np.argsort(nodes_x, kind="stable")
    nodes_x, values = nodes_x[order], values[:, order]
    if period is not None:
        nodes_x = np.concatenate([nodes_x[-1:] - period, nodes_x, nodes_x[:1] + period])
        values = np.concatenate([values[:, -1:], values, values[:, :1]], axis=1)
        number = np.arange(len(nodes_x), dtype=np.float64)
    place = np.interp(x, nodes_x, number)
    row = np.minimum(place.astype(np.int64), len(nodes_x) - 2)
    share = place - row
    return np.asarray(values[:, row] * (1.0 - share) + values[:, row + 1] * share)


def _circle_points(circle: CircleFeature, offsets: Floats) -> Floats:
    """Return the points of machined circles where they are cut, by angle: X and Y (2, N, J) mm."""
    stations = stations_of(circle, 1)
    is_cut = _cut_on_all(offsets)
    places, normals = stations.places[is_cut].T[:, None], stations.normals[is_cut].T[:, None]
    return np.asarray(places + offsets[:, is_cut] * normals)


def _lengths(vectors: Floats) -> Floats:
    """Return the lengths (N, J) of vectors (2, N, J).

    Squares of sizes of parts are far from the limits of floats, so that the root is exact enough
    and much faster than `numpy.hypot`."""
    x, y = vectors
    return np.asarray(np.sqrt(x * x + y * y))


CENTRE_ROUNDS = 50
"""Largest number of iterations for a centre; three or four are usual."""

CENTRE_MM = 1e-9


def fit_circles(points: Floats, near_mm: Floats) -> tuple[Floats, Floats]:
    """Fit circles to points (2, N, J) by least squares of radial distances; return centres (2, N)
    and radii (N,), mm. `near_mm` (2,) is a place near the centres.

    Gauss-Newton with the derivatives of the first circle about `near_mm`, from which the others
    differ by micrometres: with d = |p − c| and u = (p − c)/d, [u, 1] (δc, R) = d."""
    spoke = points[:, 0].T - near_mm
    distance = np.hypot(spoke[:, 0], spoke[:, 1])
    terms = np.column_stack([spoke / distance[:, None], np.ones(len(spoke))])
    inverse = np.linalg.pinv(terms)[:2]
    centre = np.repeat(near_mm[:, None], points.shape[1], axis=1)
    for _ in range(CENTRE_ROUNDS):
        distances = _lengths(points - centre[..., None])
        # Sums, not products of matrices, whose last digits may differ from run to run.
        move = np.stack([(distances * row).sum(axis=1) for row in inverse])
        centre = centre + move
        if np.abs(move).max() < CENTRE_MM:
            break
    return centre, _lengths(points - centre[..., None]).mean(axis=1)


class _Values(Struct, frozen=True, eq=False):
    """The positions of one end of a distance on N parts: values (N, J) mm along the direction of
    measurement, their places (J,) mm across it (None: a point), and the values (N,) of its best
    fit."""

    values: Floats
    across: Floats | None
    fit_mm: Floats


def _values(end: DistanceEnd, offsets: Floats, direction: Floats) -> _Values:
    feature, is_cut = end.feature, _cut_on_all(offsets)
    if isinstance(feature, EdgeFeature):
        stations = stations_of(feature, 1)
        points = stations.places[is_cut] + offsets[:, is_cut, None] * stations.normals[is_cut]
        across = points[0] @ np.array([-direction[1], direction[0]])
        values = points @ direction
        return _Values(values, across, values.mean(axis=1))
    points = _circle_points(feature, offsets)
    if end.how == "centre":
        middle = direction @ fit_circles(points, np.asarray(feature.centre_mm))[0]
        return _Values(middle[:, None], None, middle)
    extreme = end.side * (end.side * np.tensordot(direction, points, axes=1)).max(axis=1)
    return _Values(extreme[:, None], None, extreme)


def _distances_between(first: _Values, second: _Values) -> Floats:
    """Return the distance (N, 3), best fit, least and largest, of two ends on N parts.

    It is measured point by point if both are edges side by side, otherwise between any two of
    their points."""
    fit = second.fit_mm - first.fit_mm
    if first.across is not None and second.across is not None:
        low, high = second.across.min(), second.across.max()
        is_beside = (first.across >= low) & (first.across <= high)
        if is_beside.any():
            across = first.across[is_beside]
            local = _interpolate(across, second.across, second.values) - first.values[:, is_beside]
            return np.column_stack([fit, local.min(axis=1), local.max(axis=1)])
    smallest = second.values.min(axis=1) - first.values.max(axis=1)
    greatest = second.values.max(axis=1) - first.values.min(axis=1)
    return np.column_stack([fit, smallest, greatest])


# Minimum zones. With deviations e_i and the functions of a line or a circle in a table T (a
# constant and the place along it; a constant, cos and sin),
#
#     minimise h   subject to   −h ≤ e_i − T_i x ≤ h,
#
# is a linear programme of three or four unknowns, and 2 h is the width of the zone.


def _widths(table: Floats, offsets: Floats) -> Floats:
    """Return the widths (N,) mm of the narrowest zones that contain deviations (N, J) less a
    combination of the functions `table` (J, K)."""
    ones = np.ones((len(table), 1))
    rows = np.vstack([np.hstack([table, ones]), np.hstack([-table, ones])])
    middle = offsets.mean(axis=1, keepdims=True)
    bounds = np.hstack([offsets - middle, middle - offsets])
    goal = np.append(np.zeros(table.shape[1]), 1.0)
    return np.maximum(2.0 * minimise_many(goal, rows, bounds)[:, -1], 0.0)


MAX_EXCHANGES = 500
"""Largest number of exchanges in a linear programme; about ten are usual."""

VIOLATION_EPS_MM = 1e-12
"""A condition that is violated by at most this counts as satisfied."""


def minimise(goal: Floats, rows: Floats, bounds: Floats) -> Floats:
    """Return x (K,) that minimises goal · x subject to rows (J, K) x ≥ bounds (J,)."""
    return np.asarray(minimise_many(goal, rows, bounds[None])[0])


def minimise_many(goal: Floats, rows: Floats, bounds: Floats) -> Floats:
    """Return x (N, K), each of which minimises goal · x subject to the same rows and its own
    bounds (N, J).

    Uses the dual simplex method, from a wide box: K conditions hold exactly; the most violated one
    replaces one of them until none is violated. Conditions that are optimal for the first bounds
    are a start for all, which differ little."""
    wide = 1e3 * (1.0 + np.abs(bounds).max(axis=1, initial=0.0))
    signs = np.where(goal >= 0.0, 1.0, -1.0)
    every = np.vstack([rows, np.diag(signs)])
    limits = np.hstack([bounds, np.repeat(-wide[:, None], len(goal), axis=1)])
    active = np.arange(len(rows), len(every))[None]
    _, active = _exchange(goal, every, limits[:1], active)
    return _exchange(goal, every, limits, np.repeat(active, len(bounds), axis=0))[0]


def _exchange(goal: Floats, every: Floats, limits: Floats, active: Ints) -> tuple[Floats, Ints]:
    """Return x (N, K) and its active conditions (N, K), after exchanging the given ones until none
    is violated.

    Conditions are the rows `every` (J, K) with `limits` (N, J)."""
    active, solutions = active.copy(), np.zeros(active.shape)
    open_ = np.arange(len(active))
    for _ in range(MAX_EXCHANGES):
        own_active = active[open_]
        basis = every[own_active]
        active_limits = np.take_along_axis(limits[open_], own_active, axis=1)
        x = np.linalg.solve(basis, active_limits[..., None])[..., 0]
        solutions[open_] = x
        violation = limits[open_] - x @ every.T
        enters = violation.argmax(axis=1)
        transposed = np.swapaxes(basis, 1, 2)
        price = np.linalg.solve(transposed, np.broadcast_to(goal, x.shape)[..., None])[..., 0]
        change = np.linalg.solve(transposed, every[enters][..., None])[..., 0]
        may = change > VIOLATION_EPS_MM
        ratio = np.divide(price, change, out=np.full_like(price, np.inf), where=may)
        leaves = ratio.argmin(axis=1)
        each = np.arange(len(open_))
        goes_on = (violation[each, enters] > VIOLATION_EPS_MM) & may.any(axis=1)
        open_, each = open_[goes_on], each[goes_on]
        if not len(open_):
            break
        active[open_, leaves[each]] = enters[each]
    return solutions, active
