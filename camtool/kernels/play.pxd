"""The C types of `play`."""

cimport cython
from libc.stdint cimport uint64_t

from camtool.kernels.types cimport Int

cdef uint64_t _mixed(uint64_t word) noexcept  # inline

@cython.locals(k=Int, part=Int, key=uint64_t, total=uint64_t, word=uint64_t)
cdef double deviate(Int seed, Int stream, Int number) noexcept

cdef (double, double, bint) turned(
    double position, double furthest, double direction, double least
) noexcept  # inline

cdef double taken_along(double slide, double motor, double low, double high) noexcept  # inline

@cython.locals(axis=Int, run=Int, count=Int, k=Int, reversed_=bint)
cpdef void play_fill(
    const double[:, ::1] positions, Int[::1] offsets, double[:, ::1] axes, double[:, ::1] states,
    double[:, ::1] out, Int[:, ::1] turns
) noexcept

@cython.locals(axis=Int, run=Int, number=Int, before=Int, k=Int, reversed_=bint)
cpdef void play_varied_fill(
    const double[:, ::1] positions, Int[::1] offsets, double[:, ::1] axes, double[:, ::1] states,
    double[:, ::1] plays, double[::1] shares, double[::1] scatter, Int seed, double[:, ::1] out,
    Int[:, ::1] turns
) noexcept

@cython.locals(least=Int, most=Int, k=Int, change=Int)
cpdef Int way_of(Int before, Int[::1] positions) noexcept

@cython.locals(count=Int, begin=Int, reversals=Int, k=Int, motor=double)
cpdef Int play_block(
    Int way, double[::1] positions, double[::1] axis, double[::1] state, double[::1] out
) noexcept  # wide

@cython.locals(reversals=Int, k=Int, reversed_=bint)
cdef Int _step_by_step(
    double[::1] positions, double[::1] axis, double[::1] state, double[::1] out
) noexcept
