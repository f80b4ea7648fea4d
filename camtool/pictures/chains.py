"""Toolpaths and drawings seen from above: chains of lines and arcs, places, and path data.

A chain is an unbroken run of moves of one kind. Arcs stay arcs in the SVG; longer ones are written
as several, since the centre of a nearly half or full circle is ill-defined by its end points."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines, Segments
from camtool.pictures.svg import MM_DECIMALS, PathData
from camtool.toolpath.moves import Kind, Toolpath, rows_of

MAX_TAPERS = 30_000
"""Outlines of at most this many moves are drawn: more would make a picture of some 5 MB."""

TAPER_ARC_RAD = 0.2
"""Arcs along which a tool may become wider are taken as chords of this turn: of a circle of 1 mm
they are 5 µm off."""

MIN_TAPER_MM = 1e-6
"""A tool that cuts less than this wide at the surface counts as a point."""

MAX_ARC_RAD = 0.75 * math.pi
"""A longer arc is written as several: a half circle whose end lies δ beside its circle of radius
r, as rounded numbers do, would have its centre √(2 r δ) off."""

MOVES_AT_ONCE = 1 << 14
"""Number of moves of a chain that are examined, or written, in one batch."""


class Chain(Struct, frozen=True, eq=False):
    """A chain of n moves end to end: points (n+1, 2) mm; centre (n, 2) mm; sweep (n,) rad, 0 for
    lines."""

    points: Floats
    centre: Floats
    sweep: Floats
    closed: bool = False

    def lengths(self) -> Floats:
        """Return the true length (n,) mm of each move."""
        lengths = np.empty(len(self.sweep))
        for low, part in self.parts():
            chord = np.diff(part.points, axis=0)
            spoke = part.points[:-1] - part.centre
            arc = np.abs(part.sweep) * np.hypot(spoke[:, 0], spoke[:, 1])
            straight = np.hypot(chord[:, 0], chord[:, 1])
            lengths[low : low + len(arc)] = np.where(part.sweep == 0.0, straight, arc)
        return lengths

    def parts(self) -> Iterator[tuple[int, Chain]]:
        """Yield the moves as open chains of at most MOVES_AT_ONCE, each with the index of its
        first move."""
        for low in range(0, len(self.sweep), MOVES_AT_ONCE):
            high = low + MOVES_AT_ONCE
            points, centre = self.points[low : high + 1], self.centre[low:high]
            yield low, Chain(points, centre, self.sweep[low:high])

    def at(self, index: int, share: float) -> tuple[tuple[float, float], float]:
        """Return the point (x, y) mm at `share` (0 … 1) of move `index`, and the direction of
        travel there, rad."""
        begin, end = self.points[index], self.points[index + 1]
        sweep = float(self.sweep[index])
        if sweep == 0.0:
            dx, dy = (end - begin).tolist()
            return (float(begin[0]) + share * dx, float(begin[1]) + share * dy), math.atan2(dy, dx)
        cx, cy = self.centre[index].tolist()
        x, y = float(begin[0]) - cx, float(begin[1]) - cy
        angle = math.atan2(y, x) + share * sweep
        radius = math.hypot(x, y)
        heading = angle + math.copysign(math.pi / 2.0, sweep)
        return (cx + radius * math.cos(angle), cy + radius * math.sin(angle)), heading


class MoveChains(Struct, frozen=True, eq=False):
    """A toolpath from above: `feeds` (level), `ramps` (that change Z as well) and `rapids` as
    chains; `plunges` (P, 2) mm, where the tool goes straight down, but not from cut to cut;
    `starts` (S, 2) mm, where feeds in XY begin; each place once; `begin` (2,) mm, where the tool
    stands at first. What is cut at several depths is drawn once."""

    feeds: tuple[Chain, ...]
    ramps: tuple[Chain, ...]
    rapids: tuple[Chain, ...]
    plunges: Floats
    starts: Floats
    begin: Floats


def moves_of(toolpath: Toolpath) -> MoveChains:
    """Return the moves of a toolpath, grouped by how they are drawn."""
    cuts, slopes, rapid, is_downward = toolpath.by_parts(_how_drawn).T
    # A step straight down within a cut, as from one pass to the next, is not drawn as a plunge.
    follows = _follows(cuts, cuts | (toolpath.kind == Kind.RAPID))
    rapids, begins = np.flatnonzero(rapid), np.flatnonzero(cuts & ~follows)
    return MoveChains(
        feeds=_chains(toolpath, cuts & ~slopes),
        ramps=_chains(toolpath, slopes),
        rapids=_single_chains(toolpath.starts_of(rapids)[:, :2], toolpath.end[rapids, :2]),
        plunges=_places(toolpath.end[is_downward & ~follows, :2]),
        starts=_places(toolpath.starts_of(begins)[:, :2]),
        begin=toolpath.start[:2],
    )


def _how_drawn(toolpath: Toolpath) -> Bools:
    """Return four masks (N, 4): rows that cut in XY, those of them that change Z as well, rapids
    in XY, and feeds straight down."""
    step = toolpath.end - toolpath.starts
    across = np.hypot(step[:, 0], step[:, 1]) > POSITION_EPS_MM
    cuts = toolpath.is_feed & (across | toolpath.is_arc)
    slopes = cuts & (np.abs(step[:, 2]) > POSITION_EPS_MM)
    rapid = (toolpath.kind == Kind.RAPID) & across
    is_downward = toolpath.is_feed & ~cuts & (step[:, 2] < -POSITION_EPS_MM)
    return np.column_stack([cuts, slopes, rapid, is_downward])


def _follows(cuts: Bools, is_counted: Bools) -> Bools:
    """Return the mask (N,) of the rows before which the last row of `is_counted` is one of the
    `cuts`."""
    rows = np.flatnonzero(is_counted)
    marks = np.zeros(len(cuts), dtype=np.int8)
    # A counted row determines the rows after it, up to the next counted one.
    changes = np.flatnonzero(np.diff(cuts[rows], prepend=False))
    marks[rows[changes]] = np.where(cuts[rows[changes]], 1, -1)
    follows = np.zeros(len(cuts), dtype=np.bool_)
    follows[1:] = np.cumsum(marks[:-1], dtype=np.int8) > 0
    return follows


def _places(points: Floats) -> Floats:
    """Return each place once, in order of first occurrence."""
    _, first = np.unique(points, axis=0, return_index=True)
    return points[np.sort(first)]


def _chains(toolpath: Toolpath, is_chosen: Bools) -> tuple[Chain, ...]:
    """Return the chosen rows as chains, each line or arc once: passes at several depths, and a
    line there and back, look the same.

    No move in XY lies between the rows of a chain."""
    rows = np.flatnonzero(is_chosen)
    if not len(rows):
        return ()
    rows = rows[_first_times(toolpath, rows)]
    count = np.cumsum(toolpath.by_parts(_part_runs), dtype=np.int32)
    runs = np.split(rows, np.flatnonzero(np.diff(count[rows]) > 1) + 1)
    starts = toolpath.starts_of(np.array([run[0] for run in runs]))[:, None, :2]
    sweep = toolpath.sweeps()
    return tuple(
        Chain(
            np.concatenate([start, toolpath.end[run, :2]]),
            rows_of(toolpath.centre, run),
            sweep[run],
        )
        for start, run in zip(starts, runs, strict=True)
    )


def _part_runs(toolpath: Toolpath) -> Bools:
    """Return the mask (N,) of moves in XY and all rapids, which interrupt a chain."""
    across = (toolpath.starts[:, :2] != toolpath.end[:, :2]).any(axis=1)
    moves = toolpath.is_motion & (across | toolpath.is_arc)
    return np.asarray(moves | (toolpath.kind == Kind.RAPID))


def _first_times(toolpath: Toolpath, rows: Ints) -> Ints:
    """Return the ascending indices, into `rows`, of moves that are the first along their line or
    arc, in either direction."""
    begin, end = toolpath.starts_of(rows)[:, :2], toolpath.end[rows, :2]
    is_backward = (begin[:, 0] > end[:, 0]) | (
        (begin[:, 0] == end[:, 0]) & (begin[:, 1] > end[:, 1])
    )
    turn, arcs = np.zeros(len(rows)), np.flatnonzero(toolpath.is_arc[rows])
    sweep, is_full = toolpath.sweeps_of(rows[arcs]), (begin[arcs] == end[arcs]).all(axis=1)
    turn[arcs] = np.where(is_full, np.abs(sweep), np.where(is_backward[arcs], -sweep, sweep))
    begin[is_backward], end[is_backward] = end[is_backward], begin[is_backward]
    columns = [*begin.T, *end.T, turn]
    order = np.lexsort(columns[::-1])
    first = np.zeros(len(rows), dtype=np.bool_)
    first[:1] = True
    for column in columns:
        first[1:] |= np.diff(column[order]) != 0.0
    return np.sort(order[first])


def _single_chains(begin: Floats, end: Floats) -> tuple[Chain, ...]:
    """Return straight moves as chains, each once in either direction: dashes drawn over dashes
    would look like a line."""
    chains: dict[tuple[tuple[float, ...], ...], Chain] = {}
    for a, b in zip(begin, end, strict=True):
        chain = Chain(np.array([a, b]), np.full((1, 2), np.nan), np.zeros(1))
        chains.setdefault(tuple(sorted([tuple(a.tolist()), tuple(b.tolist())])), chain)
    return tuple(chains.values())


def chains_of(lines: Polylines) -> tuple[Chain, ...]:
    """Return a chain for each of the polylines."""
    all_segments = Segments.of(lines)
    cuts = np.searchsorted(all_segments.path, np.arange(len(lines) + 1))
    chains = []
    for path, closed in enumerate(lines.closed.tolist()):
        part = slice(int(cuts[path]), int(cuts[path + 1]))
        points = np.concatenate([all_segments.start[part], all_segments.end[part][-1:]])
        chains.append(
            Chain(points, all_segments.centre[part], all_segments.sweep[part], bool(closed))
        )
    return tuple(chains)


def chains_between(segments: Segments) -> tuple[Chain, ...]:
    """Return lines and arcs as chains; a new chain begins where a segment does not begin at the
    end of the one before."""
    if not len(segments):
        return ()
    is_break = np.hypot(*(segments.start[1:] - segments.end[:-1]).T) > POSITION_EPS_MM
    bounds = [0, *(np.flatnonzero(is_break) + 1).tolist(), len(segments)]
    return tuple(
        Chain(
            np.concatenate([segments.start[low : low + 1], segments.end[low:high]]),
            segments.centre[low:high],
            segments.sweep[low:high],
        )
        for low, high in pairwise(bounds)
    )


def path_data(chains: Iterable[Chain]) -> str:
    """Return the `d` of a path that shows the chains, in mm, Y up (the group around it flips)."""
    data = PathData(MM_DECIMALS)
    for chain in chains:
        data.move(*chain.points[0].tolist())
        # Closing the path draws its last line.
        drawn = len(chain.sweep) - int(chain.closed and chain.sweep[-1] == 0.0)
        for low, part in chain.parts():
            points, sweeps = part.points.tolist(), part.sweep.tolist()
            for index, sweep in enumerate(sweeps[: drawn - low]):
                if sweep != 0.0 and not _is_flat(part, index, sweep):
                    _arc(data, part, index, sweep)
                else:
                    data.line(*points[index + 1])
        if chain.closed:
            data.close()
    return str(data)


def _is_flat(chain: Chain, index: int, sweep: float) -> bool:
    """Return True if an arc lies nearer to its chord than `POSITION_EPS_MM`, so that a line is
    drawn.

    height = chord/2 · tan(sweep/4); renderers are inexact for radii of kilometres."""
    chord = math.dist(chain.points[index], chain.points[index + 1])
    return abs(sweep) < math.pi and 0.5 * chord * math.tan(abs(sweep) / 4.0) < POSITION_EPS_MM


def _arc(data: PathData, chain: Chain, index: int, sweep: float) -> None:
    begin, centre = chain.points[index], chain.centre[index]
    radius = math.hypot(*(begin - centre).tolist())
    count = max(math.ceil(abs(sweep) / MAX_ARC_RAD), 1)
    sweep /= count
    for k in range(1, count):
        data.arc(*chain.at(index, k / count)[0], radius=radius, sweep_rad=sweep)
    data.arc(*chain.points[index + 1].tolist(), radius=radius, sweep_rad=sweep)


def chains_box(chains: Sequence[Chain]) -> Floats | None:
    """Return the box [[xmin, xmax], [ymin, ymax]] mm of the true lines and arcs; None when there
    are none."""
    if not chains:
        return None
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for batch in _batches(chains):
        boxes = segment_boxes(_halved(batch))
        low = np.minimum(low, boxes[:, :2].min(axis=0))
        high = np.maximum(high, boxes[:, 2:].max(axis=0))
    return np.column_stack([low, high])


def _batches(chains: Iterable[Chain]) -> Iterator[list[Chain]]:
    """Yield all moves of the chains as lists of open chains, about MOVES_AT_ONCE moves in each."""
    batch: list[Chain] = []
    count = 0
    for chain in chains:
        for _, part in chain.parts():
            batch.append(part)
            count += len(part.sweep)
            if count >= MOVES_AT_ONCE:
                yield batch
                batch, count = [], 0
    if batch:
        yield batch


def _halved(chains: Sequence[Chain]) -> Segments:
    """Return all moves as segments, each arc as two halves: a full circle has no bulge."""
    begin = np.concatenate([chain.points[:-1] for chain in chains])
    end = np.concatenate([chain.points[1:] for chain in chains])
    centre = np.concatenate([chain.centre for chain in chains])
    sweep = np.concatenate([chain.sweep for chain in chains])
    is_arc = sweep != 0.0
    begin_arc, end_arc, turn = begin[is_arc], end[is_arc], sweep[is_arc] / 2.0
    spoke = begin_arc - centre[is_arc]
    cos, sin = np.cos(turn), np.sin(turn)
    rotated = [cos * spoke[:, 0] - sin * spoke[:, 1], sin * spoke[:, 0] + cos * spoke[:, 1]]
    middle = centre[is_arc] + np.column_stack(rotated)
    bulge = np.tan(turn / 4.0)
    return Segments.between(
        np.concatenate([begin[~is_arc], begin_arc, middle]),
        np.concatenate([end[~is_arc], middle, end_arc]),
        np.concatenate([np.zeros(int((~is_arc).sum())), bulge, bulge]),
    )


# Reversals: where X or Y turns back while the tool is fed, so that its backlash shows.
#
# Between the multiples of 90° an arc has one direction in X and one in Y; each such piece, and
# each line, has a sign per axis. An axis reverses where its sign differs from its last sign that
# was not 0, rapids included; a reversal counts where the piece after it is a feed.


QUARTER_RAD = 0.5 * np.pi

MIN_PIECE_RAD = 1e-9
"""Shorter pieces of an arc are not counted: it begins or ends at a multiple of 90°."""


class _Pieces(Struct, frozen=True, eq=False):
    """Monotone pieces of a toolpath: the start of each, (P, 2) mm, the signs of its motion in X
    and Y, (P, 2), and its row of the toolpath, (P,)."""

    begin: Floats
    signs: Ints
    row: Ints


def reversals_of(toolpath: Toolpath) -> Floats:
    """Return the places (R, 2) mm where X or Y reverses, in order; both may reverse at one."""
    pieces = _pieces(toolpath)
    is_reversal = _sign_changes(pieces.signs[:, 0]) | _sign_changes(pieces.signs[:, 1])
    return np.asarray(pieces.begin[is_reversal & toolpath.is_feed[pieces.row]])


def _sign_changes(signs: Ints) -> Bools:
    """Return the mask (P,) of nonzero signs that differ from the last nonzero one before."""
    changes: Bools = np.zeros(len(signs), dtype=np.bool_)
    moving = np.flatnonzero(signs)
    changes[moving[1:]] = signs[moving[1:]] != signs[moving[:-1]]
    return changes


def _pieces(toolpath: Toolpath) -> _Pieces:
    """Return all moves in their order, with arcs cut at the multiples of 90°, so that no piece
    reverses an axis."""
    starts, ends, sweeps = toolpath.starts[:, :2], toolpath.end[:, :2], toolpath.sweeps()
    rows = np.flatnonzero(toolpath.is_motion)
    is_arc = toolpath.is_arc[rows] & (sweeps[rows] != 0.0)
    spoke = np.where(is_arc[:, None], starts[rows] - toolpath.centre[rows], 0.0)
    sweep = np.where(is_arc, sweeps[rows], 0.0)
    angle = np.arctan2(spoke[:, 1], spoke[:, 0])
    first, inside = _quarters(angle, sweep)
    # A row of n inner quarters has the pieces 0 … n; piece k > 0 begins at the k-th of them.
    owners = np.repeat(np.arange(len(rows)), inside + 1)
    k = np.arange(len(owners)) - np.repeat(np.cumsum(inside + 1) - (inside + 1), inside + 1)
    sense = np.where(sweep[owners] < 0.0, -1.0, 1.0)
    quarter = (first[owners] + sense * (k - 1)) * QUARTER_RAD
    low = np.where(k == 0, angle[owners], quarter)
    high = np.where(k == inside[owners], (angle + sweep)[owners], quarter + sense * QUARTER_RAD)
    radius = np.hypot(spoke[:, 0], spoke[:, 1])[owners]
    origins = np.where(is_arc, toolpath.centre[rows].T, 0.0).T[owners]
    origins = origins + radius[:, None] * np.column_stack([np.cos(low), np.sin(low)])
    middle = 0.5 * (low + high)
    bent = np.column_stack([-sense * np.sin(middle), sense * np.cos(middle)])
    straight = (ends - starts)[rows][owners]
    arcs = is_arc[owners, None]
    return _Pieces(
        np.where(arcs & (k > 0)[:, None], origins, starts[rows][owners]),
        _signs(np.where(arcs, bent, straight)),
        rows[owners],
    )


def _quarters(begin: Floats, sweep: Floats) -> tuple[Floats, Ints]:
    """Return for arcs (A,) the first multiple of 90° strictly inside, in the order of travel, and
    the number of them; 0 for lines, of sweep 0."""
    low = np.minimum(begin, begin + sweep) + MIN_PIECE_RAD
    high = np.maximum(begin, begin + sweep) - MIN_PIECE_RAD
    low_quarter, high_quarter = np.ceil(low / QUARTER_RAD), np.floor(high / QUARTER_RAD)
    inside = np.where(sweep == 0.0, 0, np.maximum(high_quarter - low_quarter + 1.0, 0.0)).astype(
        np.int64
    )
    return np.where(sweep < 0.0, high_quarter, low_quarter), inside


def _signs(lengths: Floats) -> Ints:
    is_upward, is_downward = lengths > POSITION_EPS_MM, lengths < -POSITION_EPS_MM
    return is_upward.astype(np.int64) - is_downward.astype(np.int64)


def cuts_of(toolpath: Toolpath, is_chosen: Bools) -> tuple[Chain, ...]:
    """Return as chains those rows of the mask `is_chosen` (N,) that cut in XY, each line or arc
    once."""
    return _chains(toolpath, is_chosen & toolpath.by_parts(_how_drawn)[:, 0])


def tapers(
    toolpath: Toolpath, radius_at: Callable[[float], float], is_chosen: Bools | None = None
) -> tuple[Chain, ...]:
    """Return the outline, CCW, of each cut at the surface, for a tool whose radius changes with
    the depth.

    For each feed below the stock top (among the rows of `is_chosen` (N,)) it is the hull of the
    discs at both ends, of radius `radius_at(depth)` mm. () for more moves than MAX_TAPERS."""
    below = toolpath.is_feed & (np.minimum(toolpath.starts[:, 2], toolpath.end[:, 2]) < 0.0)
    rows = np.flatnonzero(below if is_chosen is None else below & is_chosen)
    if len(rows) > MAX_TAPERS:
        return ()
    starts, ends = toolpath.starts_of(rows), toolpath.end[rows]
    sweeps = np.where(toolpath.is_arc[rows], toolpath.sweeps_of(rows), 0.0)
    hulls = []
    for start, end, centre, sweep in zip(
        starts, ends, toolpath.centre[rows], sweeps.tolist(), strict=True
    ):
        places = _places_along(start, end, centre, sweep)
        radii = [radius_at(max(-z, 0.0)) for z in places[:, 2].tolist()]
        for k in range(len(places) - 1):
            hull = _hull(places[k, :2], radii[k], places[k + 1, :2], radii[k + 1])
            if hull is not None:
                hulls.append(hull)
    return tuple(hulls)


def _places_along(start: Floats, end: Floats, centre: Floats, sweep: float) -> Floats:
    """Return points (K, 3) mm along a move: the ends of a line, or of the chords of an arc."""
    count = math.ceil(abs(sweep) / TAPER_ARC_RAD)
    if count < 2:
        return np.stack([start, end])
    arc = Chain(np.stack([start[:2], end[:2]]), centre[None], np.array([sweep]))
    shares = np.linspace(0.0, 1.0, count + 1)
    z = start[2] + shares * (end[2] - start[2])
    return np.column_stack([[arc.at(0, share)[0] for share in shares.tolist()], z])


def _hull(one: Floats, radius: float, other: Floats, last: float) -> Chain | None:
    """Return the outline of two discs and what lies between them; None for points.

    Their common tangents touch both where the radius makes the angle φ with the line from one to
    the other, cos φ = (r − s) / d; there are none where one disc contains the other."""
    if max(radius, last) < MIN_TAPER_MM:
        return None
    gap = other - one
    distance = float(np.hypot(gap[0], gap[1]))
    if distance <= abs(radius - last) + MIN_TAPER_MM:
        centre, wide = (one, radius) if radius >= last else (other, last)
        return _round([(centre, wide, 0.0, 2.0 * math.pi)])
    angle = math.atan2(float(gap[1]), float(gap[0]))
    touch = math.acos((radius - last) / distance)
    start_disc = (one, radius, angle + touch, 2.0 * (math.pi - touch))
    return _round([start_disc, (other, last, angle - touch, 2.0 * touch)])


def _round(arcs: Sequence[tuple[Floats, float, float, float]]) -> Chain:
    """Return a closed chain of arcs (centre, radius, first angle, turn), each in two halves,
    joined by lines."""
    points, centres, sweeps = list[Floats](), list[Floats](), list[float]()
    for centre, radius, begin, turn in arcs:
        for k in range(3):
            angle = begin + 0.5 * k * turn
            points.append(centre + radius * np.array([math.cos(angle), math.sin(angle)]))
            centres.append(centre)
            sweeps.append(0.5 * turn if k < 2 and radius > MIN_TAPER_MM else 0.0)
    points.append(points[0])
    return Chain(np.array(points), np.array(centres), np.array(sweeps), closed=True)
