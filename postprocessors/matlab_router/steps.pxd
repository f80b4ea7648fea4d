"""The C types of `steps`."""

cimport cython
from libc cimport math
from libc.stdint cimport uint8_t

from camtool.kernels.types cimport Int

cdef class Slaves:
    cdef int[:, ::1] lines
    cdef Int[:, ::1] slaves
    cdef Int[::1] table, clock, loops
    cdef double[:, ::1] axes, motors
    cdef double[::1] pauses, begin, ticks
    cdef uint8_t[::1] ended
    cdef double lag
    cdef bint text

cdef Int _int32(Int value) noexcept

@cython.locals(
    phase=Int, shown=Int, change=Int, drive=Int, left=Int, fast=Int, speed=Int, ref=Int, kid=Int,
    kpd=Int
)
cdef void listed_loop(double[::1] motor, Int[::1] slave, double[::1] axis, Int[::1] table) noexcept

cdef void text_loop(double[::1] motor, Int[::1] slave, double[::1] axis, Int top) noexcept

@cython.locals(phase=Int, shown=Int)
cdef Int _seen_way(Int[::1] slave, double[::1] axis, Int up) noexcept

@cython.locals(
    stage=Int, wanted=Int, up=Int, wraps=Int, here=Int, turn=Int, way=Int, left=Int, ahead=bint
)
cdef Int to_go_of(Int[::1] slave, double[::1] axis, Int sense) noexcept

cdef void next_stage(double[::1] motor, Int[::1] slave, double moment) noexcept

@cython.locals(amount=Int)
cdef void start_line(double[::1] motor, Int[::1] slave, bint text) noexcept

@cython.locals(_=Int, low=double, high=double, moment=double, better=double)
cdef double _moment(double way, double speed, double aim, double tau, double most) noexcept

@cython.locals(count=Int, new=Int, phase=Int, reached=bint, end=double, fade=double)
cdef (double, bint) _glide(
    double[::1] motor, Int[::1] slave, double[::1] axis, double aim, Int sense, double ticks,
    Int to_go
) noexcept

@cython.locals(phase=Int, count=Int, k=Int)
cdef double _home(
    double[::1] motor, Int[::1] slave, double[::1] axis, double at, Int tick
) noexcept

@cython.locals(
    sense=Int, to_go=Int, turns=bint, reached=bint, toward=double, at=double, until=double,
    ticks=double
)
cdef void _advance(
    double[::1] motor, Int[::1] slave, double[::1] axis, Int tick, bint text
) noexcept

@cython.locals(
    index=Int, lines=int[:, ::1], slaves=Int[:, ::1], motors=double[:, ::1], begin=double[::1]
)
cdef void _open(Slaves all_, Int line) noexcept

@cython.locals(lines=int[:, ::1], motors=double[:, ::1], begin=double[::1])
cdef void _close(Slaves all_, Int line, Int tick) noexcept

@cython.locals(first=Int, second=Int, axis=Int, ahead=Int, lines=int[:, ::1], begin=double[::1])
cdef Int _row(Slaves all_, Int line, Int tick) noexcept

@cython.locals(moving=bint)
cdef bint _all_still(Int[:, ::1] slaves) noexcept

@cython.locals(index=Int)
cdef void _given_up(double[:, ::1] motors, Int[:, ::1] slaves, Int tick) noexcept

@cython.locals(
    top=Int, count=Int, filled=Int, tick=Int, line=Int, index=Int, lines=int[:, ::1],
    slaves=Int[:, ::1], table=Int[::1], slave=Int[::1], clock=Int[::1], all_=Slaves, text=bint,
    motors=double[:, ::1], axes=double[:, ::1], begin=double[::1], motor=double[::1],
    axis=double[::1]
)
cpdef (Int, bint) slaves_fill(program, state, account, Int[:, ::1] out, Int[::1] row)
