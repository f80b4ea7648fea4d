"""Pieces to contours: checked, mended, joined; and how far the contours lie from what was drawn.

    pieces ──clean_pieces──▶ paths, each once ──heal_contours──▶ contours, and counts (`Healing`)
    pieces × contours ──distance_from_drawn──▶ mm

Cleaning checks numbers, takes out repeated points and keeps each piece once. Its tolerance is
POSITION_EPS_MM, below which two points are one; it decides what is a repeated point, what has no
length, and what is drawn twice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints
from camtool.errors import DrawingError, GeometryError
from camtool.geometry.boxes import moves_of, nearest_pairs
from camtool.geometry.chain import Kinds, chain, numbered
from camtool.geometry.drawing import Gap, Healing, Skipped
from camtool.geometry.intersect import self_crossings_of
from camtool.geometry.measure import path_lengths, point_at
from camtool.geometry.overlaps import SAME_LINE_MM, without_overlaps
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    SEGMENTS_AT_ONCE,
    Polylines,
    Segments,
    encloses,
    next_vertices,
    segment_rows,
    without_repeats,
)
from camtool.geometry.simplify import recognise_arcs, without_tiny
from camtool.importers.options import ReadOptions
from camtool.importers.pieces import MAX_COORDINATE_MM, MAX_POINTS, Piece, too_many_points

IS_DRAWN_TWICE = "is drawn twice"


class Cleaned(Struct, frozen=True, eq=False):
    """Paths, the piece that each came from (M,), and counts of what was left out.

    `duplicates` pieces, with a length of `duplicates_mm`, were drawn twice."""

    lines: Polylines
    piece: Ints
    skipped: tuple[Skipped, ...] = ()
    duplicates: int = 0
    duplicates_mm: float = 0.0


def clean_pieces(pieces: Sequence[Piece], file: str) -> Cleaned:
    """Return the pieces as paths without repeated points and each drawn once, and the counts of
    what was left out.

    DrawingError when a number is not finite or beyond MAX_COORDINATE_MM, or a piece is no path."""
    if not pieces:
        return Cleaned(Polylines.of([]), np.empty(0, dtype=np.int64))
    vertices, counts = _columns(pieces, file)
    closed = np.array([piece.closed for piece in pieces], dtype=np.bool_)
    keep, repeated = without_repeats(vertices, counts, closed)
    owner = np.repeat(np.arange(len(pieces)), counts)[keep]
    vertices = _select_rows(vertices, keep)
    remaining = np.bincount(owner, minlength=len(pieces))
    long_enough = remaining >= 2
    closed &= encloses(vertices, owner, remaining)
    skips = _kinds(pieces, ~long_enough, "has no length")
    points = _kinds(pieces, long_enough & (repeated > 0), "is repeated", repeated, "point of ")
    rows = np.flatnonzero(long_enough)
    lasting = [pieces[row] for row in rows.tolist()]
    vertices = _select_rows(vertices, long_enough[owner])
    vertices.flags.writeable = False
    lines = _lines(vertices, remaining[rows], closed[rows], lasting, file)
    is_first = _drawn_once(lines, [(piece.layer, piece.colour) for piece in lasting])
    is_repeated = np.zeros(len(pieces), dtype=np.bool_)
    is_repeated[rows[~is_first]] = True
    lengths = path_lengths(lines)
    return Cleaned(
        lines=lines.select(np.flatnonzero(is_first)),
        piece=rows[is_first],
        skipped=(*skips, *points, *_kinds(pieces, is_repeated, IS_DRAWN_TWICE)),
        duplicates=int(np.count_nonzero(~is_first)),
        duplicates_mm=float(lengths[~is_first].sum()),
    )


def _select_rows(rows: Floats, is_chosen: Bools) -> Floats:
    """Return the chosen rows; the same array, not a copy, if all are chosen."""
    return rows if is_chosen.all() else rows[is_chosen]


def is_placed(piece: Piece) -> bool:
    """Return True if every number of a piece is finite, and every point within
    MAX_COORDINATE_MM."""
    vertices = piece.vertices
    is_near = (np.abs(vertices[:, :2]) <= MAX_COORDINATE_MM).all()
    return bool(is_near and np.isfinite(vertices).all())


def _columns(pieces: Sequence[Piece], file: str) -> tuple[Floats, Ints]:
    """Return the vertices (N, 3) of all pieces in one array, and the number of vertices of each
    piece.

    DrawingError when one is not finite or too far away."""
    counts = np.array([len(piece.vertices) for piece in pieces], dtype=np.int64)
    if counts.sum() > MAX_POINTS:
        raise too_many_points(file)
    vertices = np.concatenate([piece.vertices for piece in pieces], dtype=np.float64)
    finite = np.asarray(np.isfinite(vertices).all(axis=1))
    is_near = (np.abs(vertices[:, :2]) <= MAX_COORDINATE_MM).all(axis=1)
    if (finite & is_near).all():
        return vertices, counts
    row = int(np.argmin(finite & is_near))
    where = pieces[int(np.searchsorted(np.cumsum(counts), row, side="right"))].where
    if not finite[row]:
        raise DrawingError("a number is not finite", file=file, where=where)
    raise DrawingError(
        f"a point lies {np.abs(vertices[row, :2]).max():.6g} mm away, too far to be"
        " exact to a micrometre",
        file=file,
        where=where,
        mend="move the drawing to its origin, or name its unit with --units",
    )


def _kinds(
    pieces: Sequence[Piece],
    is_chosen: Bools,
    reason: str,
    times: Ints | None = None,
    before: str = "",
) -> list[Skipped]:
    """Return counts of the chosen pieces by kind, with the reason why they are left out.

    `times` (of each piece) counts a piece more than once; `before` is put before the kind."""
    counts: Counter[str] = Counter()
    for index in np.flatnonzero(is_chosen).tolist():
        counts[pieces[index].kind] += 1 if times is None else int(times[index])
    return [Skipped(before + kind, count, reason) for kind, count in counts.items()]


def _lines(
    vertices: Floats, counts: Ints, closed: Bools, pieces: Sequence[Piece], file: str
) -> Polylines:
    """Return the pieces as Polylines; DrawingError, which names the piece, for one that is no
    path."""
    try:
        return Polylines(vertices, np.concatenate([[0], np.cumsum(counts)]), closed)
    except GeometryError as error:
        row = int(str(error.where).removeprefix("path ").partition(",")[0])
        raise DrawingError(error.message, file=file, where=pieces[row].where) from error


_Words = npt.NDArray[np.uint64]


def _drawn_once(lines: Polylines, styles: Iterable[tuple[str, str]]) -> Bools:
    """Return a mask (M,), false for each path that repeats an earlier one: same style, same
    segments.

    Each segment is a number (`segment_numbers`); a path is the sum of its segments, the same from
    any start. With 64 bits, the chance that two different paths among a million are taken for the
    same is one in thirty million."""
    count = len(lines)
    if not count:
        return np.empty(0, dtype=np.bool_)
    every = np.arange(len(lines.vertices))
    segment = segment_numbers(lines.vertices, every, next_vertices(lines.offsets))
    segment[lines.offsets[1:][~lines.closed] - 1] = 0
    kind = 2 * numbered(list(styles), count) + lines.closed
    key = _mix_bits(np.add.reduceat(segment, lines.offsets[:-1]) + _mix_bits(kind.view(np.uint64)))
    is_first = np.zeros(count, dtype=np.bool_)
    is_first[np.unique(key, return_index=True)[1]] = True
    return is_first


def segment_numbers(vertices: Floats, begin: Ints | Indices, end: Ints | Indices) -> _Words:
    """Return a 64-bit hash (K,) of each segment, from its rounded ends and bulge; the same in both
    directions.

    `begin` and `end` (K,) are the rows of its ends in `vertices` (N, 3)."""
    numbers = np.empty(len(begin), dtype=np.uint64)
    for first in range(0, len(begin), SEGMENTS_AT_ONCE):
        batch = slice(first, first + SEGMENTS_AT_ONCE)
        # Adding 0 turns −0 into 0, so that both give the same number.
        grid, next_grid = (
            (np.round(vertices[rows[batch]] / POSITION_EPS_MM) + 0.0).astype(np.int64)
            for rows in (begin, end)
        )
        point, onward = (
            _mix_bits(_mix_bits(place[:, 0].view(np.uint64)) + place[:, 1].view(np.uint64))
            for place in (grid, next_grid)
        )
        bend = np.where(onward < point, -grid[:, 2], grid[:, 2]).view(np.uint64)
        segment = _mix_bits(_mix_bits(np.minimum(point, onward)) + np.maximum(point, onward))
        numbers[batch] = _mix_bits(segment + bend)
    return numbers


def _mix_bits(words: _Words) -> _Words:
    """Return the numbers hashed over 64 bits (the finalizer of SplitMix64, Steele and others
    2014)."""
    word = words + np.uint64(0x9E3779B97F4A7C15)
    word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return word ^ (word >> np.uint64(31))


# Healing: remove overlaps, join ends, recognise arcs (if the options ask for it), merge tiny
# segments. Each stage is a function of camtool.geometry; this section calls them in order and
# counts the repairs.

TINY_SHARE = 0.5
"""Segments up to this share of the tolerance are merged into their neighbours."""


class Healed(Struct, frozen=True, eq=False):
    """Contours; `members`, the pieces that each is made of; the gaps; and counts of the
    repairs."""

    lines: Polylines
    members: tuple[tuple[int, ...], ...]
    closed_gaps: tuple[Gap, ...]
    open_gaps: tuple[Gap, ...]
    healing: Healing


def gap_of(options: ReadOptions) -> float:
    """Return the distance, mm, below which open ends are joined; ends within POSITION_EPS_MM
    always are."""
    return max(options.gap_mm, POSITION_EPS_MM) if options.chain_gaps else POSITION_EPS_MM


def heal_contours(pieces: Sequence[Piece], clean: Cleaned, options: ReadOptions) -> Healed:
    """Return the contours joined from the cleaned pieces, without overlaps, and with arcs
    recognised if the options ask for it."""
    lasting = [pieces[index] for index in clean.piece.tolist()]
    places = [("" if options.across_layers else piece.layer, piece.colour) for piece in lasting]
    tolerance = min(SAME_LINE_MM, options.tolerance_mm)
    single = without_overlaps(clean.lines, numbered(places, len(lasting)), tolerance)
    sources = clean.piece[single.source]
    members = [pieces[index] for index in sources.tolist()]
    layers = [piece.layer for piece in members]
    kinds = Kinds(
        groups=None if options.across_layers else layers,
        styles=[(piece.colour, piece.line_type) for piece in members],
        layers=layers,
    )
    chained = chain(single.lines, gap_of(options), kinds=kinds)
    lines, arcs = _recognise_arcs(chained.lines, options)
    merged = without_tiny(lines, TINY_SHARE * options.tolerance_mm)
    rows = _members(chained.members, sources)
    return Healed(
        lines=merged.lines,
        members=rows,
        closed_gaps=chained.closed_gaps,
        open_gaps=chained.open_gaps,
        healing=Healing(
            duplicates=clean.duplicates,
            duplicates_mm=clean.duplicates_mm,
            overlaps=single.count,
            overlaps_mm=single.length_mm,
            tiny_merged=merged.count,
            arcs_recognised=arcs,
            branches=chained.branches,
            crossings=self_crossings_of(merged.lines, [pieces[one[0]].layer for one in rows]),
        ),
    )


def _members(chains: tuple[tuple[int, ...], ...], sources: Ints) -> tuple[tuple[int, ...], ...]:
    """Return for each chain of paths the pieces that it is made of, each once; `sources` gives the
    piece of each path."""
    if np.array_equal(sources, np.arange(len(sources))):
        return chains
    rows = sources.tolist()
    return tuple(tuple(dict.fromkeys(rows[index] for index in one)) for one in chains)


def _recognise_arcs(lines: Polylines, options: ReadOptions) -> tuple[Polylines, int]:
    """Return the paths with chords on one circle replaced by arcs, if the options ask for it, and
    the number of arcs."""
    if not options.recognise_arcs:
        return lines, 0

    results = [recognise_arcs(path, options.tolerance_mm) for path in lines]
    return Polylines.of(path for path, _ in results), sum(count for _, count in results)


# How far contours lie from what was drawn: fitting and mending together, measured.
#
# Readers say how far their curves lie from the arcs of each piece. What became of the pieces is
# measured, not followed through the stages that clean and mend, so that nothing can be left out:
#
#     pieces × paths ──same segments──▶ as the reader says
#                    └─other ones─────▶ distances there and back, and what the reader says
#
# Distances are to true lines and arcs, from points along each segment (`PLACES`). Between lines
# the ends have the largest one, between the chords of an arc and the arc their middles.

PLACES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Parameters of a segment at which its distance is measured."""


def distance_from_drawn(pieces: Sequence[Piece], lines: Polylines) -> Floats:
    """Return (N, 2) mm for the segment that leaves each vertex of `lines`: the largest and the rms
    distance between it and what was drawn as `pieces`."""
    zeros = np.broadcast_to(0.0, (len(lines.vertices), 2))  # one number, seen as many
    drawn, drawn_off = _drawn_segments(pieces)
    if not len(drawn) or not len(lines):
        return zeros
    rows = segment_rows(lines).astype(np.int32)
    result = _Joined(lines.vertices, rows, next_vertices(lines.offsets)[rows].astype(np.int32))
    drawn_as, made_as = drawn.numbers(), result.numbers()
    stays, is_gone = _is_among(made_as, drawn_as), ~_is_among(drawn_as, made_as)
    if not drawn_off.any() and not is_gone.any() and stays.all():
        return zeros
    distances = np.zeros((len(lines.vertices), 2))
    if drawn_off.any():
        order = np.argsort(drawn_as, kind="stable")
        numbers, first = np.unique(drawn_as[order], return_index=True)
        max_distances = np.maximum.reduceat(drawn_off[drawn.begin[order]], first, axis=0)
        distances[rows[stays]] = max_distances[np.searchsorted(numbers, made_as[stays])]
    if is_gone.any() or not stays.all():
        del drawn_as, made_as  # frees memory for the index
        _add_distances(
            drawn, drawn_off, result, np.flatnonzero(is_gone), np.flatnonzero(~stays), distances
        )
    return distances


class _Joined(Struct, frozen=True, eq=False):
    """K segments, each between the vertices of the rows `begin` and `end` (K,) of `vertices` (N,
    3)."""

    vertices: Floats
    begin: Indices
    end: Indices

    def __len__(self) -> int:
        return len(self.begin)

    def numbers(self) -> _Words:
        """Return the hash (K,) of each segment (`segment_numbers`)."""
        return segment_numbers(self.vertices, self.begin, self.end)

    def of(self, indices: Ints) -> Segments:
        """Return the segments with these indices (K,) as lines and arcs."""
        begin = self.vertices[self.begin[indices]]
        return Segments.between(begin[:, :2], self.vertices[self.end[indices], :2], begin[:, 2])


def _is_among(numbers: _Words, candidates: _Words) -> Bools:
    """Return a mask (K,) of the numbers that occur among the candidates, of which there is at
    least one."""
    ordered = np.sort(candidates)
    positions = np.searchsorted(ordered, numbers)
    return np.asarray(ordered[np.minimum(positions, len(ordered) - 1, out=positions)] == numbers)


def _drawn_segments(pieces: Sequence[Piece]) -> tuple[_Joined, Floats]:
    """Return the segments of the pieces that have a length, and the errors (N, 2) mm that the
    reader stated for the segment that leaves each vertex."""
    lasting = [piece for piece in pieces if len(piece.vertices)]
    counts = np.array([0, *(len(piece.vertices) for piece in lasting)])
    offsets = np.cumsum(counts)
    every = [piece.vertices for piece in lasting] or [np.empty((0, 3))]
    vertices = every[0] if len(every) == 1 else np.concatenate(every)
    drawn_off = np.broadcast_to(0.0, (len(vertices), 2))  # one number, seen as many
    if any(piece.off_mm is not None for piece in lasting):
        drawn_off = np.zeros((len(vertices), 2))
        for k, piece in enumerate(lasting):
            if piece.off_mm is not None:
                drawn_off[offsets[k] : offsets[k + 1]] = piece.off_mm
    following = next_vertices(offsets)
    has_length = (
        np.hypot(*(vertices[following, k] - vertices[:, k] for k in (0, 1))) > POSITION_EPS_MM
    )
    has_length[offsets[1:][[not piece.closed for piece in lasting]] - 1] = False
    rows = np.flatnonzero(has_length).astype(np.int32)
    return _Joined(vertices, rows, following[rows].astype(np.int32)), drawn_off


def _add_distances(
    drawn: _Joined, drawn_off: Floats, result: _Joined, is_gone: Ints, new: Ints, off_mm: Floats
) -> None:
    """Raise `off_mm` (N, 2), in place, to the distances between segments that have no equal on the
    other side.

    `is_gone` are rows of drawn segments that no result equals, `new` those of the result that no
    drawn one equals. Distances are measured from drawn to result and from result to drawn, and the
    reader's own error is added."""
    # From drawn segments to the result: to the nearest segment, and to others nearly as near.
    for rows, distances, point, row in _near_segments(drawn, is_gone, result, 2.0):
        total = distances[point, None] + drawn_off[drawn.begin[rows[point]]]
        np.maximum.at(off_mm, result.begin[row], total)
    # From the result to what was drawn.
    for rows, distances, point, row in _near_segments(result, new, drawn, 1.0):
        total = distances[point, None] + drawn_off[drawn.begin[row]]
        np.maximum.at(off_mm, result.begin[rows[point]], total)


def _near_segments(
    segments: _Joined, indices: Ints, other_segments: _Joined, times: float
) -> Iterator[tuple[Ints, Floats, Ints, Ints]]:
    """Yield, for batches of the segments `indices`, the distances of points along them to the
    nearest other segment.

    Each batch gives for its P points the segment (P,) and the distance (P,) mm, then pairs (J,),
    (J,) of a point and another segment whose distance is at most `times` the nearest one."""
    if not len(indices):
        return
    moves = moves_of(other_segments.of(np.arange(len(other_segments))))
    for first in range(0, len(indices), SEGMENTS_AT_ONCE):
        batch = indices[first : first + SEGMENTS_AT_ONCE]
        row = np.repeat(np.arange(len(batch)), len(PLACES))
        points = point_at(segments.of(batch), row, np.tile(PLACES, len(batch)))
        distances, point, other = nearest_pairs(points, moves, times, POSITION_EPS_MM)
        # Positions within POSITION_EPS_MM of each other are one.
        distances = np.where(distances > POSITION_EPS_MM, distances, 0.0)
        yield batch[row], distances, point, other
