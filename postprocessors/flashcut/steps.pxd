"""The C types of `steps`."""

cimport cython

from camtool.kernels.types cimport Int

cdef class Timers:
    cdef Int[::1] what, half_period, move_row, steps, under_way, row, duration_ms
    cdef Int[:, ::1] steps_of_rows
    cdef double[:, ::1] target, commanded
    cdef const double[::1] origin
    cdef double[::1] step_mm, programmed, here
    cdef double added
    cdef bint from_reached, late_longer

@cython.locals(steps=Int, here=double)
cdef Int _displacement(Int axis, double target, bint sensed, Timers timers) noexcept

@cython.locals(
    what=Int, half_period=Int, longer=Int, shorter=Int, short_way=Int, along_x=Int, along_y=Int,
    long_way=Int, n=Int, m=Int, every=Int, short_every=Int, under_way=Int[::1]
)
cdef void _begin(Int move, Timers timers) noexcept

@cython.locals(
    axis=Int, left=Int, gap=Int, longer=Int, shorter=Int, sense=Int, short_sense=Int, every=Int,
    short_every=Int, count=Int, short_count=Int, k=Int, steps=Int[::1], under_way=Int[::1],
    rows=Int[::1], fires=bint, commanded=double[:, ::1], step_mm=double[::1], here=double[::1]
)
cdef Int _run(Timers timers, Int row, Int first) noexcept

@cython.locals(k=Int, move=Int, done=Int, row=Int, before=Int, timers=Timers)
cpdef (Int, Int) timers_fill(moves, Int first, rules, counters, issued)
