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
    """(K + M,) mm: for each path 0 and the sums of its lengths (K,) so far; path i has the
    segments first[i] to first[i + 1]."""
    cdef Int path, k
    cdef double total
    cdef double[::1] found
    found = np.empty(len(lengths) + len(first) - 1)
    for path in range(len(first) - 1):
        total = 0.0
        for k in range(first[path], first[path + 1]):
            found[k + path] = total
            total += lengths[k]
        found[first[path + 1] + path] = total
    return np.asarray(found)


cdef inline double begin_of(Tracks tracks, Int path, Int u) noexcept:
    """The length at which segment u of a path begins, counted on through the laps."""
    cdef Int count, at
    cdef double lap
    count = tracks.first[path + 1] - tracks.first[path]
    at = tracks.first[path] + path
    lap = math.floor(float(u) / float(count))
    return float(lap * tracks.reach[at + count] + tracks.reach[at + u - <Int>lap * count])


cdef inline Int row_of(Tracks tracks, Int path, Int u) noexcept:
    """The row of segment u of a path, counted on through the laps."""
    cdef Int count
    count = tracks.first[path + 1] - tracks.first[path]
    return int(tracks.first[path] + u - int(math.floor(float(u) / float(count))) * count)


cdef inline double size_of(Tracks tracks, Int path, Int u) noexcept:
    """The length of segment u of a path, counted on through the laps."""
    cdef Int at
    at = row_of(tracks, path, u) + path
    return float(tracks.reach[at + 1] - tracks.reach[at])


cdef Int last_before(Tracks tracks, Int path, double length) noexcept:
    """The last segment of a path that begins at a length or before it; the first when none does.

    `length` lies on the path itself, not further round.
    """
    cdef Int at, low, high, middle
    at = tracks.first[path] + path
    low, high = 0, tracks.first[path + 1] - tracks.first[path]
    while high - low > 1:
        middle = (low + high) // 2
        if tracks.reach[at + middle] <= length:
            low = middle
        else:
            high = middle
    return int(low)


cdef (double, double) point(Tracks tracks, Int row, double t) noexcept:
    """The point of a segment at the fraction t of its length."""
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
    """The point of a path at a length; ends of open paths reach no further."""
    cdef Int at, u
    cdef double total, part
    at = tracks.first[path] + path
    total = tracks.reach[at + tracks.first[path + 1] - tracks.first[path]]
    if tracks.closed[path]:
        length = math.fmod(length, total)
        if length < 0.0:
            length += total
    u = last_before(tracks, path, length)
    part = (length - tracks.reach[at + u]) / (tracks.reach[at + u + 1] - tracks.reach[at + u])
    return point(tracks, tracks.first[path] + u, min(max(part, 0.0), 1.0))


cdef (Int, Int) span(Tracks tracks, Int path, double begin, double end) noexcept:
    """The first and the last of the segments of a path between two lengths, begin < end."""
    cdef Int count, limit, here, first, last
    cdef double total, low_lap, high_lap
    count = tracks.first[path + 1] - tracks.first[path]
    total = tracks.reach[tracks.first[path] + path + count]
    low_lap = high_lap = 0.0
    if tracks.closed[path]:
        low_lap, high_lap = math.floor(begin / total), math.floor(end / total)
    limit = (int(high_lap) + 1) * count
    here = int(low_lap) * count + last_before(tracks, path, begin - low_lap * total)
    first = max(here - 1, int(low_lap) * count)
    while first < limit and begin_of(tracks, path, first) + size_of(tracks, path, first) <= (
        begin + NEAR_MM
    ):
        first += 1
    if first == limit or begin_of(tracks, path, first) >= end - NEAR_MM:
        return here, here  # shorter than NEAR_MM: a piece of the one there
    last = first
    while last + 1 < limit and begin_of(tracks, path, last + 1) < end - NEAR_MM:
        last += 1
    return first, last


cdef (double, double) part_of(Tracks tracks, Int path, Int u, double begin, double end) noexcept:
    """The fractions of segment u of a path at which a piece begins and ends on it."""
    cdef double start, size, low, high
    start, size = begin_of(tracks, path, u), size_of(tracks, path, u)
    low = (begin - start) / size if begin - start > NEAR_MM else 0.0
    high = (end - start) / size if start + size - end > NEAR_MM else 1.0
    return low, high


cdef (double, double) start_of(
    Tracks tracks, Int path, double begin, double end, Int first, Int last
) noexcept:
    """The point at which a piece of a path begins, whose `span` is from `first` to `last`."""
    cdef Int u
    cdef double begins, stops
    u = last if end < begin else first
    begins, stops = part_of(tracks, path, u, min(begin, end), max(begin, end))
    return point(tracks, row_of(tracks, path, u), stops if end < begin else begins)


cdef double[:, ::1] grown(double[:, ::1] vertices, Int count, Int wanted):
    """Room for so many vertices, the first `count` of them kept."""
    cdef double[:, ::1] more
    if wanted <= len(vertices):
        return vertices
    more = np.empty((max(2 * len(vertices), wanted), 4))
    more[:count] = vertices[:count]
    return np.asarray(more)


cdef Int write_piece(
    Tracks tracks, Int path, double begin, double end, Int first, Int last, double[:, ::1] out,
    Int at
) noexcept:
    """Write the vertices of a piece of a path behind row `at` of `out`, its start, which takes the
    first bulge; return the row of its last vertex. The z is the length of the piece so
    far. `first` and `last`: the piece's `span` from the lower length to the higher one."""
    cdef bint back
    cdef double low, high, done, begins, stops, after, _, whole, part, bulge, x, y, from_x, from_y
    cdef double length
    cdef Int k, u, row
    back = end < begin
    low, high = min(begin, end), max(begin, end)
    done = 0.0
    from_x, from_y = start_of(tracks, path, begin, end, first, last)
    for k in range(last - first + 1):
        u = last - k if back else first + k
        row = row_of(tracks, path, u)
        begins, stops = part_of(tracks, path, u, low, high)
        whole = tracks.bulge[row]
        part = stops - begins
        bulge = whole if part == 1.0 else math.tan(part * math.atan(whole))
        if back:
            bulge = 0.0 - bulge
            x, y = point(tracks, row, begins)
        elif k < last - first:
            after, _ = part_of(tracks, path, u + 1, low, high)
            x, y = point(tracks, row_of(tracks, path, u + 1), after)
        else:
            x, y = point(tracks, row, stops)
        length = math.hypot(x - from_x, y - from_y)
        if bulge != 0.0:
            length *= (1.0 + bulge * bulge) * math.atan(bulge) / bulge
        done += length
        out[at, 3] = bulge
        at += 1
        out[at, 0], out[at, 1], out[at, 2], out[at, 3] = x, y, done, 0.0
        from_x, from_y = x, y
    return at


cpdef piece(Tracks tracks, Int path, double begin, double end):
    """(k, 4) x, y, length so far and bulge of a path from one length to another, backwards when
    `end` is the lower one. The last bulge is 0."""
    cdef Int first, last
    cdef double[:, ::1] out
    first, last = span(tracks, path, min(begin, end), max(begin, end))
    out = np.empty((last - first + 2, 4))
    out[0, 0], out[0, 1] = start_of(tracks, path, begin, end, first, last)
    out[0, 2] = 0.0
    write_piece(tracks, path, begin, end, first, last, out, 0)
    return np.asarray(out)


cpdef lifted(Tracks tracks, Int[::1] path, Int[::1] first, double[::1] length, double[::1] z):
    """(N, 4) x, y, z, bulge of R runs, one after the other, and where each of them begins
    (R + 1,).

    Run i follows path[i] (R,) from point to point of its profile, the lengths and heights (P,) of
    the rows first[i] to first[i + 1]: straight up or down where the length stays, else with z in
    proportion to the length. Its last bulge is 0.
    """
    cdef Int run, of, k, j, at, was, low, high
    cdef double begin, end, below, above, here, total
    cdef Int[::1] runs
    cdef double[:, ::1] out
    out = np.empty((2 * len(length) + len(tracks.bulge), 4))
    runs, at = np.empty(len(path) + 1, np.int64), -1
    for run in range(len(path)):
        of = path[run]
        runs[run] = at + 1
        out = grown(out, at + 1, at + 2)
        at += 1
        out[at, 0], out[at, 1] = place(tracks, of, length[first[run]])
        out[at, 2], out[at, 3] = z[first[run]], 0.0
        for k in range(first[run], first[run + 1] - 1):
            begin, end, below, above = length[k], length[k + 1], z[k], z[k + 1]
            if abs(end - begin) <= NEAR_MM:
                if abs(above - below) > NEAR_MM:
                    out = grown(out, at + 1, at + 2)
                    at += 1
                    out[at, 0], out[at, 1] = out[at - 1, 0], out[at - 1, 1]
                    out[at, 2], out[at, 3] = above, 0.0
                continue
            low, high = span(tracks, of, min(begin, end), max(begin, end))
            out = grown(out, at + 1, at + 3 + high - low)
            was, here = at, out[at, 2]
            at = write_piece(tracks, of, begin, end, low, high, out, at)
            total = out[at, 2]
            for j in range(was + 1, at + 1):
                out[j, 2] = below + (above - below) * out[j, 2] / total
            out[was, 2] = here
    runs[len(path)] = at + 1
    return np.asarray(out[: at + 1]), np.asarray(runs)
