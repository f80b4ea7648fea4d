"""The C types of `passes`."""

cimport cython
from libc cimport math

from camtool.kernels.types cimport Int

cdef class Tracks:
    cdef double[:, ::1] start, end
    cdef double[::1] bulge, reach
    cdef Int[::1] first, closed

@cython.locals(path=Int, k=Int, total=double, found=double[::1])
cpdef reaches(double[::1] lengths, Int[::1] first)

@cython.locals(count=Int, at=Int, lap=double)
cdef double begin_of(Tracks tracks, Int path, Int u) noexcept  # inline

@cython.locals(count=Int)
cdef Int row_of(Tracks tracks, Int path, Int u) noexcept  # inline

@cython.locals(at=Int)
cdef double size_of(Tracks tracks, Int path, Int u) noexcept  # inline

@cython.locals(at=Int, low=Int, high=Int, middle=Int)
cdef Int last_before(Tracks tracks, Int path, double length) noexcept

@cython.locals(
    ax=double, ay=double, bx=double, by=double, sweep=double, along=double, across=double,
    ratio=double, turn=double, x=double
)
cdef (double, double) point(Tracks tracks, Int row, double t) noexcept

@cython.locals(at=Int, total=double, u=Int, part=double)
cdef (double, double) place(Tracks tracks, Int path, double length) noexcept

@cython.locals(
    count=Int, total=double, low_lap=double, high_lap=double, limit=Int, here=Int, first=Int,
    last=Int
)
cdef (Int, Int) span(Tracks tracks, Int path, double begin, double end) noexcept

@cython.locals(start=double, size=double, low=double, high=double)
cdef (double, double) part_of(
    Tracks tracks, Int path, Int u, double begin, double end
) noexcept

@cython.locals(u=Int, begins=double, stops=double)
cdef (double, double) start_of(
    Tracks tracks, Int path, double begin, double end, Int first, Int last
) noexcept

@cython.locals(more=double[:, ::1])
cdef double[:, ::1] grown(double[:, ::1] vertices, Int count, Int wanted)

@cython.locals(
    back=bint, low=double, high=double, done=double, k=Int, u=Int, row=Int,
    begins=double, stops=double, after=double, _=double, whole=double, part=double, bulge=double,
    x=double, y=double, from_x=double, from_y=double, length=double
)
cdef Int follow(
    Tracks tracks, Int path, double begin, double end, Int first, Int last, double[:, ::1] out,
    Int at
) noexcept

@cython.locals(first=Int, last=Int, out=double[:, ::1])
cpdef piece(Tracks tracks, Int path, double begin, double end)

@cython.locals(
    run=Int, of=Int, k=Int, j=Int, at=Int, was=Int, begin=double, end=double, below=double,
    above=double, here=double, total=double, low=Int, high=Int, runs=Int[::1], out=double[:, ::1]
)
cpdef lifted(Tracks tracks, Int[::1] path, Int[::1] first, double[::1] length, double[::1] z)
