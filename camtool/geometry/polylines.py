"""Polylines of lines and circular arcs: the one shape of geometry in camtool.

A vertex is (x, y, bulge), in mm. The bulge of a vertex belongs to the segment that leaves it:

    bulge = tan(sweep / 4),   CCW positive,   0 = straight line,   ±1 = half circle.

Many polylines are held together in columns (`Polylines`), as ragged arrays: `vertices` of all
paths one after the other, `offsets` where each begins, `closed` per path. Everything is checked
once, here, so that no function behind needs to: finite numbers, |bulge| ≤ 1, and no segment
shorter than `POSITION_EPS_MM`. Arrays are read-only.

`Segments` is the working form of the pure functions beside this file: one row per segment."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.errors import GeometryError

POSITION_EPS_MM = 1e-6
"""Two positions nearer than this are equal."""

SEGMENTS_AT_ONCE = 1 << 16

BULGE_EPS = 1e-12
"""|bulge| may exceed 1 by rounding alone, by no more than this, and is then set to ±1; a bulge
below this is a line: the arc deviates from its chord c by |bulge|·c/2, less than an atom at 1
m."""


@dataclass(frozen=True, eq=False)
class Polyline:
    """A path of lines and arcs: `vertices` (n, 3) of x, y, bulge in mm; n ≥ 2.

    The bulge of the last vertex of an open path has no segment and is stored as 0.
    Raises GeometryError when the numbers are no polyline."""

    vertices: Floats
    closed: bool = False

    def __post_init__(self) -> None:
        vertices = _check_vertices(self.vertices, np.array([0, len(self.vertices)]), [self.closed])
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "closed", bool(self.closed))

    @classmethod
    def _trusted(cls, vertices: Floats, closed: bool) -> Polyline:
        """Return a polyline of vertices that were checked before and are read-only."""
        path = object.__new__(cls)
        object.__setattr__(path, "vertices", vertices)
        object.__setattr__(path, "closed", closed)
        return path

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self.vertices) - (0 if self.closed else 1)

    @property
    def start(self) -> Floats:
        """First point (2,)."""
        return self.vertices[0, :2]

    @property
    def end(self) -> Floats:
        """Last point (2,): the first one when closed."""
        return self.vertices[0 if self.closed else -1, :2]


@dataclass(frozen=True, eq=False)
class Polylines:
    """Many paths in columns: `vertices` (N, 3), `offsets` (M+1,), `closed` (M,).

    Path i owns vertices[offsets[i]:offsets[i+1]]. Raises GeometryError, naming path and vertex."""

    vertices: Floats
    offsets: Ints
    closed: Bools

    def __post_init__(self) -> None:
        offsets = np.array(self.offsets, dtype=np.int64)
        closed = np.array(self.closed, dtype=np.bool_)
        vertices = _check_vertices(self.vertices, offsets, closed)
        offsets.flags.writeable = closed.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "offsets", offsets)
        object.__setattr__(self, "closed", closed)

    @classmethod
    def of(cls, paths: Iterable[Polyline]) -> Polylines:
        """Return the columns of single paths, which were checked when they were made."""
        items = list(paths)
        counts = np.array([0] + [len(path.vertices) for path in items], dtype=np.int64)
        vertices = [path.vertices for path in items] or [np.empty((0, 3))]
        columns = (
            vertices[0] if len(vertices) == 1 else np.concatenate(vertices),
            np.cumsum(counts),
            np.array([path.closed for path in items], dtype=np.bool_),
        )
        return cls._trusted(*columns)

    @classmethod
    def joined(cls, parts: Sequence[Polylines]) -> Polylines:
        """Return the paths of all parts, one part after the other; the part itself if it alone has
        paths."""
        parts = [part for part in parts if len(part)]
        if len(parts) == 1:
            return parts[0]
        counts = [np.diff(part.offsets) for part in parts]
        return cls._trusted(
            np.concatenate([np.empty((0, 3)), *(part.vertices for part in parts)]),
            np.cumsum(np.concatenate([np.zeros(1, dtype=np.int64), *counts])),
            np.concatenate([np.empty(0, dtype=np.bool_), *(part.closed for part in parts)]),
        )

    def __len__(self) -> int:
        """Return the number of paths."""
        return len(self.closed)

    def __getitem__(self, index: int) -> Polyline:
        if not -len(self) <= index < len(self):
            raise IndexError(f"path {index} of {len(self)}")
        index %= len(self)
        low, high = self.offsets[index], self.offsets[index + 1]
        return Polyline._trusted(self.vertices[low:high], bool(self.closed[index]))

    def __iter__(self) -> Iterator[Polyline]:
        bounds = pairwise(self.offsets.tolist())
        for (begin, end), is_closed in zip(bounds, self.closed.tolist(), strict=True):
            yield Polyline._trusted(self.vertices[begin:end], is_closed)

    def select(self, indices: Iterable[int] | Ints) -> Polylines:
        """Return the paths of these indices, in this order; self if every path is selected.
        IndexError for an index out of range."""
        if not isinstance(indices, np.ndarray):
            indices = np.fromiter((int(index) for index in indices), dtype=np.int64)
        selection: Ints = indices.astype(np.int64)
        is_missing = (selection < -len(self)) | (selection >= len(self))
        if is_missing.any():
            raise IndexError(f"path {selection[np.argmax(is_missing)]} of {len(self)}")
        selection %= max(len(self), 1)
        if np.array_equal(selection, np.arange(len(self))):
            return self
        counts = np.diff(self.offsets)[selection]
        offsets = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(counts)])
        rows = np.arange(offsets[-1]) + np.repeat(self.offsets[selection] - offsets[:-1], counts)
        return Polylines._trusted(self.vertices[rows], offsets, self.closed[selection])

    @classmethod
    def _trusted(cls, vertices: Floats, offsets: Ints, closed: Bools) -> Polylines:
        """Wrap columns that were checked before; they become read-only."""
        lines = object.__new__(cls)
        for name, column in (("vertices", vertices), ("offsets", offsets), ("closed", closed)):
            column.flags.writeable = False
            object.__setattr__(lines, name, column)
        return lines


def next_vertices(offsets: Ints) -> Ints:
    """Return for each vertex (N,) the row of the next one of its path, for the last one that of
    the first."""
    following = np.arange(1, offsets[-1] + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    return following


def segment_rows(lines: Polylines) -> Ints:
    """Return for each segment (K,) the row of the vertex that it leaves, in the order of
    `Segments.of`."""
    keep = np.ones(len(lines.vertices), dtype=np.bool_)
    keep[lines.offsets[1:][~lines.closed] - 1] = False
    return np.flatnonzero(keep)


class Segments(Struct, frozen=True, eq=False, dict=True):
    """Lines and arcs in columns, K rows; `path` (K,) says which polyline each came from.

    `start`, `end` (K, 2) mm; `bulge` (K,). What follows from these is computed when it is asked
    for: for arcs `centre` (K, 2) mm, `radius` (K,) mm and the signed `sweep` (K,) rad; lines have
    centre NaN, radius inf and sweep 0. `start_angle` (K,) rad is the direction from the centre to
    the start (NaN for lines).

        s = sweep/4, b = tan s, chord c = |end − start|:
        radius = c (1 + b²) / (4 |b|);
        centre = midpoint + (1 − b²)/(4b) · (chord vector turned by +90°)."""

    start: Floats
    end: Floats
    bulge: Floats
    path: Ints

    @classmethod
    def of(cls, lines: Polyline | Polylines) -> Segments:
        """Return the segments of all paths, in order."""
        if isinstance(lines, Polyline):
            lines = Polylines.of([lines])
        return cls.leaving(lines, segment_rows(lines))

    @classmethod
    def batches(cls, lines: Polylines) -> Iterator[Segments]:
        """Yield all segments of the paths, in order, in batches of at most SEGMENTS_AT_ONCE."""
        rows = segment_rows(lines)
        for first in range(0, len(rows), SEGMENTS_AT_ONCE):
            yield cls.leaving(lines, rows[first : first + SEGMENTS_AT_ONCE])

    @classmethod
    def leaving(cls, lines: Polylines, rows: Ints) -> Segments:
        """Return the segments that leave these vertices (K,), none of which is the end of an open
        path."""
        vertices, offsets = lines.vertices, lines.offsets
        path = np.searchsorted(offsets, rows, side="right") - 1
        following = rows + 1
        last = following == offsets[path + 1]
        following[last] = offsets[path[last]]
        # np.take is several times as fast as indexing.
        start, end = (
            vertices.take(outgoing, axis=0)[:, :2].copy() for outgoing in (rows, following)
        )
        return cls.between(start, end, vertices[rows, 2], path)

    @classmethod
    def between(
        cls, start: Floats, end: Floats, bulge: Floats, path: Ints | None = None
    ) -> Segments:
        """Return segments from their end points (K, 2) and bulges (K,)."""
        return cls(start, end, bulge, np.zeros(len(bulge), np.int64) if path is None else path)

    def __len__(self) -> int:
        return len(self.bulge)

    def __getitem__(self, rows: Bools | Ints | slice) -> Segments:
        """Return the segments that a mask, indices or a slice select."""
        return Segments(self.start[rows], self.end[rows], self.bulge[rows], self.path[rows])

    @property
    def is_arc(self) -> Bools:
        """Mask (K,) of the rows that are arcs."""
        return np.asarray(self.bulge != 0.0)

    @cached_property
    def centre(self) -> Floats:
        """Centres (K, 2) of arcs, mm; NaN for lines."""
        chord, safe = self.end - self.start, np.where(self.is_arc, self.bulge, 1.0)
        normal = np.column_stack([-chord[:, 1], chord[:, 0]])
        middle = 0.5 * (self.start + self.end) + ((1.0 - safe**2) / (4.0 * safe))[:, None] * normal
        return np.where(self.is_arc[:, None], middle, np.nan)

    @cached_property
    def radius(self) -> Floats:
        """Radii (K,) of arcs, mm; infinite for lines."""
        chord, safe = self.end - self.start, np.where(self.is_arc, self.bulge, 1.0)
        length = np.hypot(chord[:, 0], chord[:, 1])
        return np.where(self.is_arc, length * (1.0 + safe**2) / (4.0 * np.abs(safe)), np.inf)

    @cached_property
    def sweep(self) -> Floats:
        """Signed sweeps (K,), rad; 0 for lines."""
        return np.asarray(4.0 * np.arctan(self.bulge))

    @cached_property
    def start_angle(self) -> Floats:
        """Directions (K,) from the centre to the start, rad; NaN for lines."""
        spoke = self.start - self.centre
        return np.asarray(np.arctan2(spoke[:, 1], spoke[:, 0]))


def _check_vertices(vertices: Floats, offsets: Ints, closed: Bools | list[bool]) -> Floats:
    """Return the vertices, read-only and normalised (not copied if they are both already);
    GeometryError when they are no polylines."""
    array = np.asarray(vertices, dtype=np.float64)
    is_own = array is vertices and array.flags.owndata and not array.flags.writeable
    if not is_own:
        array = np.array(vertices, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise GeometryError(f"vertices have shape {array.shape}, wanted (N, 3) of x, y, bulge")
    is_closed = np.asarray(closed, dtype=np.bool_)
    counts = np.diff(offsets)
    if len(offsets) != len(is_closed) + 1 or offsets[0] != 0 or offsets[-1] != len(array):
        raise GeometryError("offsets do not divide the vertices into the paths")
    if np.any(counts < 2):
        raise GeometryError("a path needs two points", where=f"path {np.argmax(counts < 2)}")
    if _is_normal(array, offsets, is_closed):
        array.flags.writeable = False
        return array
    bulge = array[:, 2].copy()
    bulge[offsets[1:][~is_closed] - 1] = 0.0
    finite = np.isfinite(array[:, :2]).all(axis=1) & np.isfinite(bulge)
    _refuse(~finite, "a number is not finite", offsets)
    is_large = np.abs(bulge) > 1.0
    _refuse(np.abs(bulge) > 1.0 + BULGE_EPS, "|bulge| above 1: split the arc", offsets)
    bulge[is_large] = np.sign(bulge[is_large])
    bulge[np.abs(bulge) < BULGE_EPS] = 0.0
    if bulge.tobytes() != array[:, 2].tobytes():
        array = array.copy() if is_own else array
        array[:, 2] = bulge
    array.flags.writeable = False
    lines = Polylines._trusted(array, offsets, is_closed)
    is_short = np.concatenate([np.empty(0, np.bool_), *map(_is_short, Segments.batches(lines))])
    if is_short.any():
        repeated = np.zeros(len(array), dtype=np.bool_)
        repeated[segment_rows(lines)] = is_short
        _refuse(repeated, "a point is repeated", offsets)
    return array


def _is_normal(array: Floats, offsets: Ints, is_closed: Bools) -> bool:
    """Return True if nothing is to be refused or changed. Most polylines are so, and have few
    vertices: this takes a tenth of the time of finding what is wrong with them."""
    size = np.abs(array)
    bulge, last = array[:, 2], offsets[1:] - 1
    steps = np.diff(array[:, :2], axis=0)
    gaps = np.hypot(steps[:, 0], steps[:, 1])
    gaps[last[:-1]] = np.inf
    closing = array[last[is_closed], :2] - array[offsets[:-1][is_closed], :2]
    return bool(
        size.max(initial=0.0) < np.inf
        and size[:, 2].max(initial=0.0) <= 1.0
        and not bulge[last[~is_closed]].any()
        and not bulge[size[:, 2] < BULGE_EPS].tobytes().strip(b"\0")
        and gaps.min(initial=np.inf) > POSITION_EPS_MM
        and np.hypot(closing[:, 0], closing[:, 1]).min(initial=np.inf) > POSITION_EPS_MM
    )


def _is_short(segments: Segments) -> Bools:
    """Return the mask (K,) of the segments whose ends are one position."""
    chord = segments.end - segments.start
    return np.asarray(np.hypot(chord[:, 0], chord[:, 1]) <= POSITION_EPS_MM)


def _refuse(is_bad: Bools, message: str, offsets: Ints) -> None:
    """Raise GeometryError, with path and vertex, for the first row of the mask `is_bad`, if there
    is one."""
    if not is_bad.any():
        return
    row = int(np.argmax(is_bad))
    path = int(np.searchsorted(offsets, row, side="right")) - 1
    raise GeometryError(message, where=f"path {path}, vertex {row - int(offsets[path])}")


# Reversing, rotating, another start: the results are always new polylines.


def reverse(p: Polyline) -> Polyline:
    """Return the path travelled backwards; a closed one still begins at its first vertex."""
    count = len(p.vertices)
    order = np.arange(count)[::-1]
    if p.closed:
        order = np.roll(order, 1)
    vertices = p.vertices[order]
    # The segment that left vertex i now leaves vertex i + 1 and bends to the other side.
    vertices[:, 2] = 0.0 - p.vertices[(order - 1) % count, 2]
    return Polyline(vertices, p.closed)


def reverse_lines(lines: Polylines, is_chosen: Bools | None = None) -> Polylines:
    """Return the paths with all, or those of the mask `is_chosen` (M,), travelled backwards, as
    `reverse` does."""
    if is_chosen is not None and not is_chosen.any():
        return lines
    counts = np.diff(lines.offsets)
    low, count = np.repeat(lines.offsets[:-1], counts), np.repeat(counts, counts)
    place = np.arange(len(low)) - low
    sources = np.where(np.repeat(lines.closed, counts), count - place, count - 1 - place) % count
    bulge = 0.0 - lines.vertices[low + (sources - 1) % count, 2]
    if is_chosen is not None:
        is_reversed = np.repeat(is_chosen, counts)
        sources = np.where(is_reversed, sources, place)
        bulge = np.where(is_reversed, bulge, lines.vertices[:, 2])
    vertices = lines.vertices[low + sources]
    vertices[:, 2] = bulge
    return Polylines._trusted(vertices, lines.offsets, lines.closed)


def rotate(p: Polyline, angle_rad: float) -> Polyline:
    """Return the path turned about (0, 0) by an angle, CCW positive."""
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    x, y, bulge = p.vertices.T
    vertices = np.column_stack([cosine * x - sine * y, sine * x + cosine * y, bulge])
    return Polyline(vertices, p.closed)


def begin_at(p: Polyline, start_index: int) -> Polyline:
    """Return a closed path with this vertex as its start; GeometryError for an open path."""
    if not p.closed:
        raise GeometryError("an open path can only begin at an end")
    return Polyline(np.roll(p.vertices, -start_index, axis=0), True)


def begin_lines_at(lines: Polylines, begins: Ints) -> Polylines:
    """Return the paths with other starts, as `begin_at` does: `begins` (M,) are vertices of each
    path, 0 for open ones."""
    if not (lines.closed | (begins == 0)).all():
        raise GeometryError("an open path can only begin at an end")
    if not begins.any():
        return lines
    counts = np.diff(lines.offsets)
    low, count = np.repeat(lines.offsets[:-1], counts), np.repeat(counts, counts)
    place = (np.arange(len(low)) - low + np.repeat(begins, counts)) % count
    return Polylines._trusted(lines.vertices[low + place], lines.offsets, lines.closed)


# Repeated points are removed from paths, whatever made them coincide (a drawing that repeats them,
# a scale that brings them together).
#
# Tolerance: POSITION_EPS_MM, below which two points are one. A point stays where it is, so no path
# moves by more than that.


def without_repeats(vertices: Floats, counts: Ints, closed: Bools) -> tuple[Bools, Ints]:
    """Return the mask (N,) of the vertices to keep, and for each path the number of points (M,)
    that it repeats.

    `vertices` (N, 3) of x, y, bulge, mm, path after path, `counts` (M,) of each. A vertex is
    dropped when it coincides with the one kept before it, which takes over its bulge, in place: a
    bulge belongs to the segment that leaves. The first point of a closed path, repeated at its
    end, is dropped without being counted: it says "closed" once more."""
    first = np.cumsum(counts) - counts
    filled = counts > 0
    begins = np.zeros(len(vertices), dtype=np.bool_)
    begins[first[filled]] = True
    step = np.hypot(*np.diff(vertices[:, :2], axis=0, prepend=np.nan).T)
    keep = begins | ~(step <= POSITION_EPS_MM)
    owner = np.repeat(np.arange(len(counts)), counts)
    for path in distinct(owner[~keep]).tolist():
        rows = slice(int(first[path]), int(first[path] + counts[path]))
        _leave_out(vertices[rows], keep[rows])
    repeated = np.bincount(owner[~keep], minlength=len(counts)).astype(np.int64)
    _drop_closing(vertices, keep, owner, first, closed & filled)
    return keep, repeated


def encloses(vertices: Floats, owner: Ints, counts: Ints) -> Bools:
    """Return the mask (M,), false for paths of two vertices without a bulge: closed, they would
    run to and fro along one line.

    `owner` (N,) is the path of each vertex, `counts` (M,) the number of vertices of each path."""
    bent = np.bincount(owner, weights=vertices[:, 2] != 0.0, minlength=len(counts))
    return np.asarray((counts != 2) | (bent != 0.0))


def _leave_out(path: Floats, keep: Bools) -> None:
    """Drop repeated vertices of one path by changing `keep` and bulges in place.

    `keep` comes with false for vertices that coincide with the one before them. It becomes false
    for those that coincide with the last one kept, which takes the bulge of the last of them."""
    next_row = 0
    for row in np.flatnonzero(~keep).tolist():
        if row < next_row:
            continue
        last, next_row = row - 1, row
        while (
            next_row < len(path)
            and math.dist(path[next_row, :2], path[last, :2]) <= POSITION_EPS_MM
        ):
            keep[next_row] = False
            path[last, 2] = path[next_row, 2]
            next_row += 1
        if next_row < len(path):
            keep[next_row] = True
            next_row += 1


def _drop_closing(vertices: Floats, keep: Bools, owner: Ints, first: Ints, closed: Bools) -> None:
    """Drop vertices at the end of closed paths that coincide with their first one, by changing
    `keep` in place."""
    waiting = closed.copy()
    while waiting.any():
        rows = np.flatnonzero(keep)
        is_last = np.append(owner[rows][1:] != owner[rows][:-1], True) & waiting[owner[rows]]
        last = rows[is_last]
        begin = first[owner[last]]
        distances = np.hypot(*(vertices[last, :2] - vertices[begin, :2]).T)
        is_double = (distances <= POSITION_EPS_MM) & (last != begin)
        keep[last[is_double]] = False
        waiting[:] = False
        waiting[owner[last[is_double]]] = True
