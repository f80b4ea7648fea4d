"""Paths of lines and arcs followed from length to length, forwards or backwards, up and down.

Arrays in, arrays out.

A piece of a line or an arc keeps to it: the part f of an arc of the bulge b has the bulge
tan(f · atan b), and its ends lie at fractions of the sweep, as in `camtool.geometry.measure`.
Lengths below 0 and beyond the whole of a closed path are further round: segment u of lap l is row
u − l n of the n segments. What makes it exact: a vertex within `NEAR_MM` of an end of a piece is
that end, and vertices between are those of the path. `tests/oracles/passes.py` is the twin.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.types cimport Int

import numpy as np

from camtool.arrays import Floats, Ints

# Lengths that differ by no more than this are one (POSITION_EPS_MM of camtool.geometry).
cdef double NEAR_MM = 1e-6


cdef class Tracks:
    """M paths as the loops read them: `start`, `end` (K, 2) mm and `bulge` (K,) of all segments;
    path i has the segments first[i] to first[i + 1] (M + 1,), is `closed` (M,) or not (1 or 0),
    and the lengths to the starts of its segments, and to its end, are reach[first[i] + i] and what
    follows it (K + M,) mm."""

    cdef double[:, ::1] start, end
    cdef double[::1] bulge, reach
    cdef Int[::1] first, closed

    def __init__(
        self, start: Floats, end: Floats, bulge: Floats, first: Ints, closed: Ints, reach: Floats
    ) -> None:
        self.start, self.end, self.bulge = start, end, bulge
        self.first, self.closed, self.reach = first, closed, reach


cpdef reaches(double[::1] lengths, Int[::1] first):
    """Return (K + M,) mm: for each path 0 and the cumulative sums of its lengths (K,); path i has
    the segments first[i] to first[i + 1]."""
    cdef Int path, k
    cdef double total
    cdef double[::1] totals
    totals = np.empty(len(lengths) + len(first) - 1)
    for path in range(len(first) - 1):
        total = 0.0
        for k in range(first[path], first[path + 1]):
            totals[k + path] = total
            total += lengths[k]
        totals[first[path + 1] + path] = total
    return np.asarray(totals)


cdef inline double begin_of(Tracks tracks, Int path, Int u) noexcept:
    """Return the length at which segment u of a path begins; u counts on through the laps."""
    cdef Int count, offset
    cdef double lap
    count = tracks.first[path + 1] - tracks.first[path]
    offset = tracks.first[path] + path
    lap = math.floor(float(u) / float(count))
    return float(lap * tracks.reach[offset + count] + tracks.reach[offset + u - <Int>lap * count])


cdef inline Int row_of(Tracks tracks, Int path, Int u) noexcept:
    """Return the row of segment u of a path; u counts on through the laps."""
    cdef Int count
    count = tracks.first[path + 1] - tracks.first[path]
    return int(tracks.first[path] + u - int(math.floor(float(u) / float(count))) * count)


cdef inline double size_of(Tracks tracks, Int path, Int u) noexcept:
    """Return the length of segment u of a path; u counts on through the laps."""
    cdef Int offset
    offset = row_of(tracks, path, u) + path
    return float(tracks.reach[offset + 1] - tracks.reach[offset])


cdef Int last_before(Tracks tracks, Int path, double length) noexcept:
    """Return the last segment of a path that begins at or before a length; the first when none
    does.

    `length` lies on the path itself, not in a later lap.
    """
    cdef Int offset, low, high, middle
    offset = tracks.first[path] + path
    low, high = 0, tracks.first[path + 1] - tracks.first[path]
    while high - low > 1:
        middle = (low + high) // 2
        if tracks.reach[offset + middle] <= length:
            low = middle
        else:
            high = middle
    return int(low)


cdef (double, double) point(Tracks tracks, Int row, double t) noexcept:
    """Return the point of a segment at the fraction t of its length."""
    cdef double ax, ay, bx, by, sweep, along, across, ratio, turn, x
    ax, ay = tracks.start[row, 0], tracks.start[row, 1]
    bx, by = tracks.end[row, 0], tracks.end[row, 1]
    sweep = 4.0 * math.atan(tracks.bulge[row])
    along, across = t, 0.0
    if sweep != 0.0:
        ratio = math.sin(0.5 * t * sweep) / math.sin(0.5 * sweep)
        turn = 0.5 * (t - 1.0) * sweep
        along, across = ratio * math.cos(turn), ratio * math.sin(turn)
    x = (1.0 - along) * ax + along * bx - across * (by - ay)
    return x, (1.0 - along) * ay + along * by + across * (bx - ax)


cdef (double, double) place(Tracks tracks, Int path, double length) noexcept:
    """Return the point of a path at a length; beyond the ends of an open path, its end."""
    cdef Int offset, u
    cdef double total, part
    offset = tracks.first[path] + path
    total = tracks.reach[offset + tracks.first[path + 1] - tracks.first[path]]
    if tracks.closed[path]:
        length = math.fmod(length, total)
        if length < 0.0:
            length += total
    u = last_before(tracks, path, length)
    low = tracks.reach[offset + u]
    part = (length - low) / (tracks.reach[offset + u + 1] - low)
    return point(tracks, tracks.first[path] + u, min(max(part, 0.0), 1.0))


cdef (Int, Int) span(Tracks tracks, Int path, double begin, double end) noexcept:
    """Return the first and the last of the segments of a path between two lengths, begin < end."""
    cdef Int count, limit, piece_at, first, last
    cdef double total, low_lap, high_lap
    count = tracks.first[path + 1] - tracks.first[path]
    total = tracks.reach[tracks.first[path] + path + count]
    low_lap = high_lap = 0.0
    if tracks.closed[path]:
        low_lap, high_lap = math.floor(begin / total), math.floor(end / total)
    limit = (int(high_lap) + 1) * count
    piece_at = int(low_lap) * count + last_before(tracks, path, begin - low_lap * total)
    first = max(piece_at - 1, int(low_lap) * count)
    while first < limit and begin_of(tracks, path, first) + size_of(tracks, path, first) <= (
        begin + NEAR_MM
    ):
        first += 1
    if first == limit or begin_of(tracks, path, first) >= end - NEAR_MM:
        return piece_at, piece_at  # shorter than NEAR_MM: a piece of the one there
    last = first
    while last + 1 < limit and begin_of(tracks, path, last + 1) < end - NEAR_MM:
        last += 1
    return first, last


cdef (double, double) part_of(Tracks tracks, Int path, Int u, double begin, double end) noexcept:
    """Return the fractions of segment u of a path at which a piece begins and ends on it."""
    cdef double start, size, low, high
    start, size = begin_of(tracks, path, u), size_of(tracks, path, u)
    low = (begin - start) / size if begin - start > NEAR_MM else 0.0
    high = (end - start) / size if start + size - end > NEAR_MM else 1.0
    return low, high


cdef (double, double) start_of(
    Tracks tracks, Int path, double begin, double end, Int first, Int last
) noexcept:
    """Return the point at which a piece of a path begins, whose `span` is from `first` to
    `last`."""
    cdef Int u
    cdef double begins, stops
    u = last if end < begin else first
    begins, stops = part_of(tracks, path, u, min(begin, end), max(begin, end))
    return point(tracks, row_of(tracks, path, u), stops if end < begin else begins)


cdef double[:, ::1] grown(double[:, ::1] vertices, Int count, Int needed):
    """Return `vertices` with room for `needed` of them, the first `count` kept."""
    cdef double[:, ::1] more
    if needed <= len(vertices):
        return vertices
    more = np.empty((max(2 * len(vertices), needed), 4))
    more[:count] = vertices[:count]
    return np.asarray(more)


cdef Int write_piece(
    Tracks tracks, Int path, double begin, double end, Int first, Int last,
    double[:, ::1] vertices,
    Int index
) noexcept:
    """Write the vertices of a piece of a path into the rows of `vertices` behind row `index`,
    which is its start and takes the first bulge; return the row of the last vertex. The z is the
    length of the piece so far. `first` and `last`: the piece's `span` from the lower length to the
    higher one."""
    cdef bint is_reversed
    cdef double low, high, travelled, begins, stops, end_part, _, full_bulge, part, bulge, x
    cdef double y, from_x, from_y
    cdef double length
    cdef Int k, u, row
    is_reversed = end < begin
    low, high = min(begin, end), max(begin, end)
    travelled = 0.0
    from_x, from_y = start_of(tracks, path, begin, end, first, last)
    for k in range(last - first + 1):
        u = last - k if is_reversed else first + k
        row = row_of(tracks, path, u)
        begins, stops = part_of(tracks, path, u, low, high)
        full_bulge = tracks.bulge[row]
        part = stops - begins
        bulge = full_bulge if part == 1.0 else math.tan(part * math.atan(full_bulge))
        if is_reversed:
            bulge = 0.0 - bulge
            x, y = point(tracks, row, begins)
        elif k < last - first:
            end_part, _ = part_of(tracks, path, u + 1, low, high)
            x, y = point(tracks, row_of(tracks, path, u + 1), end_part)
        else:
            x, y = point(tracks, row, stops)
        length = math.hypot(x - from_x, y - from_y)
        if bulge != 0.0:
            length *= (1.0 + bulge * bulge) * math.atan(bulge) / bulge
        travelled += length
        vertices[index, 3] = bulge
        index += 1
        vertices[index, 0], vertices[index, 1], vertices[index, 2], vertices[index, 3] = (
            x, y, travelled, 0.0
        )
        from_x, from_y = x, y
    return index


cpdef piece(Tracks tracks, Int path, double begin, double end):
    """Return (k, 4) x, y, length so far and bulge of a path from one length to another,
    backwards when `end` is the lower one. The last bulge is 0."""
    cdef Int first, last
    cdef double[:, ::1] vertices
    first, last = span(tracks, path, min(begin, end), max(begin, end))
    vertices = np.empty((last - first + 2, 4))
    vertices[0, 0], vertices[0, 1] = start_of(tracks, path, begin, end, first, last)
    vertices[0, 2] = 0.0
    write_piece(tracks, path, begin, end, first, last, vertices, 0)
    return np.asarray(vertices)


cpdef lifted(Tracks tracks, Int[::1] path, Int[::1] first, double[::1] length, double[::1] z):
    """Return (N, 4) x, y, z, bulge of R runs, one after the other, and where each of them begins
    (R + 1,).

    Run i follows path[i] (R,) from point to point of its profile, the lengths and heights (P,) of
    the rows first[i] to first[i + 1]: vertical where the length does not change, else with z in
    proportion to the length. Its last bulge is 0.
    """
    cdef Int run, of, k, j, index, was, low, high
    cdef double begin, end, below, above, position, total
    cdef Int[::1] runs
    cdef double[:, ::1] vertices
    vertices = np.empty((2 * len(length) + len(tracks.bulge), 4))
    runs, index = np.empty(len(path) + 1, np.int64), -1
    for run in range(len(path)):
        of = path[run]
        runs[run] = index + 1
        vertices = grown(vertices, index + 1, index + 2)
        index += 1
        vertices[index, 0], vertices[index, 1] = place(tracks, of, length[first[run]])
        vertices[index, 2], vertices[index, 3] = z[first[run]], 0.0
        for k in range(first[run], first[run + 1] - 1):
            begin, end, below, above = length[k], length[k + 1], z[k], z[k + 1]
            if abs(end - begin) <= NEAR_MM:
                if abs(above - below) > NEAR_MM:
                    vertices = grown(vertices, index + 1, index + 2)
                    index += 1
                    vertices[index, 0], vertices[index, 1] = (
                        vertices[index - 1, 0], vertices[index - 1, 1]
                    )
                    vertices[index, 2], vertices[index, 3] = above, 0.0
                continue
            low, high = span(tracks, of, min(begin, end), max(begin, end))
            vertices = grown(vertices, index + 1, index + 3 + high - low)
            was, position = index, vertices[index, 2]
            index = write_piece(tracks, of, begin, end, low, high, vertices, index)
            total = vertices[index, 2]
            for j in range(was + 1, index + 1):
                vertices[j, 2] = below + (above - below) * vertices[j, 2] / total
            vertices[was, 2] = position
    runs[len(path)] = index + 1
    return np.asarray(vertices[: index + 1]), np.asarray(runs)
