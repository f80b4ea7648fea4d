"""The C types of `chaining`."""

cimport cython
from libc cimport math
from libc.stdint cimport int32_t, uint8_t

from camtool.kernels.types cimport Int

@cython.locals(total=Int, one=Int[::1], other=Int[::1], none=Int[::1])
cpdef near_pairs(Int[:, ::1] cells, double[:, ::1] points, double reach, Int most)

@cython.locals(
    i=Int, count=Int, low=Int, number=Int, found=Int, after=Int, group=Int, column=Int, row=Int,
    j=Int
)
cdef Int _pairs(
    Int[:, ::1] cells, double[:, ::1] points, double reach, Int most, Int[::1] one, Int[::1] other
) noexcept

cdef bint _before(Int[:, ::1] cells, Int i, Int group, Int column, Int row) noexcept  # inline

cdef Int top(Int[::1] above, Int item) noexcept

@cython.locals(k=Int, i=Int, a=Int, b=Int, above=Int[::1])
cpdef clusters(Int count, Int[::1] one, Int[::1] other)

@cython.locals(joined=Int, k=Int, a=Int, b=Int, s=Int, t=Int)
cpdef Int join(
    Int[::1] one, Int[::1] other, Int[::1] mates, Int[::1] above, Int[::1] segments, Int[::1] arcs
) noexcept

cdef bint encloses(Int segments, Int arcs) noexcept  # inline

@cython.locals(
    count=Int, index=Int, size=Int, chains=Int, end=Int, start=Int, entries=Int[::1],
    begins=Int[::1], rings=uint8_t[::1], seen=uint8_t[::1]
)
cpdef walk(Int[::1] mates, uint8_t[::1] wanted)

@cython.locals(start=Int)
cdef Int first_end(Int[::1] mates, Int end) noexcept

@cython.locals(
    made=Int, index=Int, start=Int, last=Int, height=Int, end=Int, label=Int, m=Int, k=Int,
    before=Int, begin=Int, close=Int, segments=Int, arcs=Int, less=Int, fewer=Int,
    until=Int[:, ::1], where=Int[::1], stack=Int[::1], done=bint, near=bint
)
cpdef Int split_loops(
    Int[::1] starts, Int[::1] mates, Int[::1] node, double[:, ::1] points, double reach,
    Int[:, ::1] weights
)

@cython.locals(end=Int, segments=Int, arcs=Int)
cdef (Int, Int) _ring_weight(Int start, Int[::1] mates, Int[:, ::1] weights) noexcept

@cython.locals(m=Int, label=Int)
cdef void _forget(Int[::1] entries, Int low, Int high, Int[::1] node, Int[::1] where) noexcept

cdef double _apart(double[:, ::1] points, Int one, Int other) noexcept  # inline

@cython.locals(
    count=Int, i=Int, ring=Int, column=Int, row=Int, stop=Int, j=Int, nearest=Int[::1],
    at_side=bint, distance=double[::1]
)
cpdef nearest_others(
    Int[:, ::1] cells, double[:, ::1] points, double size, double least, double reach
)

@cython.locals(low=Int, high=Int, middle=Int)
cdef Int _first(Int[:, ::1] cells, Int column, Int row) noexcept

@cython.locals(count=Int, room=Int[::1], one=Int[::1], other=Int[::1])
cpdef touching(double[:, ::1] boxes, Int[::1] same, Int[::1] differ, uint8_t[::1] asked, Int most)

@cython.locals(count=Int, i=Int, j=Int)
cdef Int _touching(
    double[:, ::1] boxes, Int[::1] same, Int[::1] differ, uint8_t[::1] asked, Int most,
    Int[::1] one, Int[::1] other
) noexcept

@cython.locals(slots=Int, heads=int32_t[::1], before=int32_t[::1], latest=int32_t[::1])
cpdef latest_near(double[:, ::1] places, Int[::1] begins, double reach)

@cython.locals(
    path=Int, first=Int, i=Int, j=Int, x=double, y=double, column=Int, row=Int, best=Int,
    beside=Int, above=Int, own=Int
)
cdef void _latest_near(
    double[:, ::1] places, Int[::1] begins, double reach, int32_t[::1] heads,
    int32_t[::1] before, int32_t[::1] latest
) noexcept

cdef Int _cell(double place, double size) noexcept  # inline

cdef Int _slot(Int column, Int row, Int slots) noexcept  # inline
