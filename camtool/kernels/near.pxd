"""The C types of `near`."""

cimport cython
from libc cimport math

from camtool.kernels.types cimport Int

cdef class Near:
    cdef const double[:, :] start, end, heights
    cdef const int[:] arc
    cdef double[:, ::1] arcs, points
    cdef double limit, window
    cdef double[::1] distance, apart, box
    cdef Int[::1] move, count, order, waiting
    cdef int[::1] candidates

@cython.locals(
    k=Int, height=Int, axis=Int, middle=double, end=Int, split=Int, part=Int, larger=bint,
    candidates=int[::1], waiting=Int[::1]
)
cpdef divide(
    Int low, Int high, Int first, Int last, Near near, Int[::1] found, double[::1] distance
)

@cython.locals(
    side=Int, axis=Int, n=Int, longest=double, middle=double, least=double, most=double,
    value=double, points=double[:, ::1], order=Int[::1], box=double[::1]
)
cdef (Int, double) _set_box(Int low, Int high, Near near) noexcept

@cython.locals(
    n=Int, k=Int, arc=Int, end=Int, room=double, window=double, low_x=double, low_y=double,
    high_x=double, high_y=double, x=double, y=double, wide=double, tall=double, z=double,
    to_z=double, around=double, ax=double, ay=double, bx=double, by=double, dx=double, dy=double,
    side=double, near_x=double, near_y=double, radius=double, candidates=int[::1],
    start="const double[:, :]", ends="const double[:, :]", heights="const double[:, :]",
    arcs=double[:, ::1], box=double[::1]
)
cdef Int _keep_near(Int first, Int last, Near near) noexcept

@cython.locals(rise=double, arc=Int, length=double, dx=double, dy=double)
cdef double _slope(Near near, Int k) noexcept  # inline

@cython.locals(split=Int, n=Int, point=Int, points=double[:, ::1], order=Int[::1])
cdef Int _divided(Int low, Int high, Int axis, double middle, Near near) noexcept

@cython.locals(
    arc=Int, from_z=double, rise=double, window=double, ax=double, ay=double, bx=double, by=double,
    share=double, dx=double, dy=double, px=double, py=double, square=double, apart=double,
    arcs=double[:, ::1], sine=double, to_a=double, to_b=double
)
cdef double _apart(Near near, Int k, double x, double y, double z) noexcept  # inline

@cython.locals(angle=double, sweep=double)
cdef double _share_of_arc(
    double[:, ::1] arcs, Int arc, double ax, double ay, double px, double py, double sine
) noexcept

@cython.locals(
    i=Int, point=Int, n=Int, count=Int, best=double, away=double, x=double, y=double, z=double,
    points=double[:, ::1], order=Int[::1], candidates=int[::1], apart=double[::1]
)
cdef void _compare(Int low, Int high, Int first, Int last, Near near) noexcept

@cython.locals(
    i=Int, point=Int, n=Int, at=Int, away=double, x=double, y=double, z=double,
    points=double[:, ::1], order=Int[::1], candidates=int[::1]
)
cdef void _list(
    Int low, Int high, Int first, Int last, Near near, Int[::1] found, double[::1] distance
) noexcept
