"""The C types of `discs`."""

cimport cython
from libc cimport math

from camtool.kernels.types cimport Int

@cython.locals(
    at=(double, double, double, double, double, double), k=Int, own=Int, corner=Int, best=Int,
    links=Int[:, ::1], x=double, y=double, nx=double, ny=double, sx=double, sy=double,
    radius=double, table=double[:, ::1], boxes=double[:, ::1]
)
cpdef void largest_discs(
    boundary, Int[::1] row, double[::1] t, Int[:, ::1] guess, double[:, ::1] result,
    Int[::1] partner
) noexcept

@cython.locals(chord=double, half=double)
cpdef (double, double, double, double) frame(double[:, ::1] table, Int own, double t) noexcept

@cython.locals(half=double, chord=double)
cdef (double, double) _from_corner(
    double tx, double ty, double[:, ::1] table, Int own, double t
) noexcept

cdef Int _at_convex_corner(Int[:, ::1] links, Int own, double t) noexcept

@cython.locals(
    other=Int, home=Int, turn=Int, block=Int, best=Int, x=double, y=double, radius=double,
    found=double, dx=double, dy=double
)
cdef (double, Int) _largest(
    double[:, ::1] table, Int[:, ::1] links, double[:, ::1] boxes, Int own, Int guess,
    Int other_guess, (double, double, double, double, double, double) at, bint at_start
) noexcept

@cython.locals(
    turns=(double, double), sight=(double, double, double, double), before=bint, behind=bint,
    corner=bint, as_point=bint, found=double
)
cdef double _limit(
    double[:, ::1] table, Int[:, ::1] links, Int own, Int other,
    (double, double, double, double, double, double) at, double radius, bint at_start
) noexcept

@cython.locals(before=Int)
cdef double _turn(double[:, ::1] table, Int[:, ::1] links, Int own) noexcept

@cython.locals(before=Int, behind=Int, over=bint)
cdef double _least(double[:, ::1] table, Int[:, ::1] links, Int own, Int other) noexcept

@cython.locals(begins=bint, ends=bint, g=double, found=double)
cdef double _touching(
    double[:, ::1] table, Int own, (double, double, double, double) sight,
    (double, double, double, double, double, double) at, double radius, double least,
    (double, double) turns
) noexcept

cdef double _place(double[:, ::1] table, Int other, double cx, double cy) noexcept
