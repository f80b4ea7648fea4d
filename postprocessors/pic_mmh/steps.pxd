"""The C types of `steps`."""

cimport cython
from libc cimport math
from camtool.kernels.judging cimport Judge, judge_block
from camtool.kernels.play cimport play_block, way_of
from camtool.kernels.types cimport Int

cdef class Room:
    cdef Int[::1] path_x, path_y, state, other, tracker
    cdef double[::1] registers

@cython.locals(turn=Int, sx=Int, sy=Int, along_x=Int, along_y=Int)
cpdef (Int, Int) heading(Int x, Int y, bint clockwise) noexcept  # inline

cpdef Int rounded_radius(Int x, Int y) noexcept

@cython.locals(turn=Int, entered=Int, sx=Int, sy=Int, ex=Int, ey=Int)
cpdef Int expected_quadrants(Int x, Int y, bint clockwise, Int end_x, Int end_y) noexcept

@cython.locals(
    x=Int, y=Int, entered=Int, seen=Int, least=Int, k=Int, square=Int, nearest=Int, apart=Int,
    wanted=bint
)
cdef void scan(
    Int[::1] path_x, Int[::1] path_y, Int count, Int end_x, Int end_y, Int[::1] tracker, Int low,
    Int high
) noexcept

@cython.locals(only_x=Int, only_y=Int, both=Int, move_x=bint, move_y=bint)
cdef (Int, Int, Int, Int, Int, Int, Int) _advance(
    Int x, Int y, Int error, Int sx, Int sy, Int delta_x, Int delta_y
) noexcept  # inline

@cython.locals(invariant=Int, diagonal=Int)
cdef Int _run_length(Int m, Int n, Int way, Int error, Int room) noexcept

@cython.locals(first=Int, k=Int, size=Int, here=double, invariant=double)
cdef void _run(
    Int m, Int n, Int way, Int error, Int[::1] out_m, Int[::1] out_n, Int low, Int high
) noexcept  # wide

@cython.locals(
    x=Int, y=Int, error=Int, sx=Int, sy=Int, room=Int, filled=Int, run=Int, _=Int, m=Int, n=Int,
    way=Int, upto=Int, delta_x=Int, delta_y=Int, at=Int, met=bint, by_x=bint
)
cdef (Int, bint) direct_search_run(
    Int[::1] state, Int end_x, Int end_y, Int[::1] out_x, Int[::1] out_y
) noexcept

@cython.locals(
    x=Int, y=Int, error=Int, sx=Int, sy=Int, m=Int, n=Int, way=Int, run=Int, size=Int, _=Int,
    invariant=Int, delta_x=Int, delta_y=Int, by_x=bint
)
cpdef void skip(Int[::1] state, Int count) noexcept

@cython.locals(done=Int, apart=Int, run=Int)
cpdef Int first_at(Int[::1] state, Int end_x, Int end_y, Int limit) noexcept

@cython.locals(
    done=Int, best=Int, least=Int, off_x=Int, off_y=Int, square=Int, run=Int, x=Int, y=Int,
    error=Int, sx=Int, sy=Int
)
cpdef (Int, Int) nearest_to(Int[::1] state, Int end_x, Int end_y, Int low, Int high) noexcept

@cython.locals(x=Int, y=Int, error=Int, sx=Int, sy=Int, filled=Int, met=bint, x_grows=bint)
cdef (Int, bint) _stairs(
    Int[::1] state, Int end_x, Int end_y, Int[::1] out_x, Int[::1] out_y
) noexcept

@cython.locals(x=Int, y=Int, filled=Int, passes=Int, pulse=bint, limit=double)
cdef (Int, Int, bint) _dda_line(
    Int a, Int b, double[::1] registers, Int[::1] counters, Int[::1] out_x, Int[::1] out_y
) noexcept

cdef (Int, Int, Int, Int) _arc_pass(
    Int grow, Int shrink, Int radius, Int in_grow, Int in_shrink
) noexcept  # inline

@cython.locals(
    x=Int, y=Int, sx=Int, sy=Int, radius=Int, in_grow=Int, in_shrink=Int, filled=Int, passes=Int,
    grow=Int, shrink=Int, new_grow=Int, new_shrink=Int, x_grows=bint, met=bint
)
cdef (Int, Int, bint) _dda_arc(
    Int[::1] state, Int end_x, Int end_y, Int[::1] out_x, Int[::1] out_y
) noexcept

@cython.locals(k=Int, radius=Int, x=Int, y=Int, sx=Int, sy=Int, clockwise=bint)
cdef void start_leg(Int[::1] leg, Int method, bint rounded, Int[::1] state) noexcept

@cython.locals(filled=Int, met=bint)
cdef (Int, Int, bint) fill_leg(
    Int[::1] leg, Int method, Int[::1] state, double[::1] registers, Int[::1] out_x, Int[::1] out_y
) noexcept

@cython.locals(k=Int, sign_x=Int, sign_y=Int)
cdef void turn_round(Int[::1] leg, Int[::1] path_x, Int[::1] path_y, Int count) noexcept

@cython.locals(
    x=Int, y=Int, entered=Int, end_x=Int, end_y=Int, to_x=Int, to_y=Int, found=Int, k=Int,
    reached=bint, short=bint
)
cdef Int _passes(
    Int[::1] path_x, Int[::1] path_y, Int count, Int[::1] leg, Int[::1] tracker, Int expected
) noexcept

@cython.locals(
    expected=Int, size=Int, end_x=Int, end_y=Int, low=Int, high=Int, seen=Int, at=Int, filled=Int,
    _=Int, best=Int, off_x=Int, off_y=Int, nearest=Int, part_x=Int[::1], part_y=Int[::1], met=bint
)
cdef void _stop(
    Int[::1] leg, Int method, bint rounded, Int reading, Int[::1] path_x, Int[::1] path_y,
    double[::1] registers, Int[::1] state, Int[::1] tracker, Int[::1] out
) noexcept

@cython.locals(
    expected=Int, end_x=Int, end_y=Int, low=Int, high=Int, first=Int, last=Int, done=Int, at=Int,
    to_x=Int, to_y=Int, entered=Int, x=Int, y=Int, short=Int, run=Int, _=Int
)
cdef void _stop_by_closed_form(
    Int[::1] leg, bint rounded, Int reading, Int[::1] state, Int[::1] out
) noexcept

@cython.locals(done=Int, x=Int, y=Int, run=Int)
cdef Int _enter(Int[::1] state, Int count) noexcept

@cython.locals(
    number=Int, method=Int, reading=Int, path_x=Int[::1], path_y=Int[::1], tracker=Int[::1],
    leg=Int[::1], state=Int[::1], stop=Int[::1], rounded=bint, registers=double[::1]
)
cpdef void arc_stops(Int[:, ::1] legs, (Int, bint, Int) how, Int[:, ::1] out)

@cython.locals(
    row=Int, method=Int, reading=Int, x=Int, y=Int, said_x=Int, said_y=Int, end_x=Int, end_y=Int,
    path_x=Int[::1], path_y=Int[::1], tracker=Int[::1], leg=Int[::1], out=Int[::1], state=Int[::1],
    rounded=bint, registers=double[::1]
)
cpdef void run_on(
    Int[::1] moves, Int[::1] start, Int[:, ::1] ends, Int[:, ::1] centres, (Int, bint, Int) how,
    Int[::1] samples
)

@cython.locals(k=Int)
cdef void _copy(Int[::1] from_, Int[::1] to) noexcept

@cython.locals(
    size=Int, end_x=Int, end_y=Int, filled=Int, _=Int, off_x=Int, off_y=Int, tracker=Int[::1],
    state=Int[::1], path_x=Int[::1], path_y=Int[::1], met=bint, registers=double[::1]
)
cdef (Int, bint) _run_ahead(
    Int[::1] leg, Int method, Int entered, Int low, Int high, Room room
) noexcept

@cython.locals(last=Int, sign_x=Int, sign_y=Int, known=bint)
cdef (Int, Int) _ways(
    Int[::1] leg, Int method, Int[::1] before, Int[::1] after, Int at_x, Int at_y, Int[::1] path_x,
    Int[::1] path_y
) noexcept

cdef bint _is_near(Int low, Int high, Int end) noexcept  # inline

@cython.locals(k=Int, entered=Int, last=Int, to_x=Int, to_y=Int, near=bint)
cdef (Int, bint) _passed(
    Int[::1] leg, Int x, Int y, Int[::1] path_x, Int[::1] path_y, Int way_x, Int way_y
) noexcept

@cython.locals(origin=Int, k=Int, way_on=Int, count=Int)
cdef void _follow(
    Int[::1] leg, Int axis, Int way, Int[::1] steps, Int at, double step_mm, double[::1] play,
    double[::1] state, Int[::1] counts, double[::1] commanded, double[::1] slide
) noexcept  # wide

cdef void _deepen(Int[::1] leg, double[::1] state, Int[::1] counts) noexcept

@cython.locals(
    number=Int, method=Int, leg=Int[::1], count=Int[::1], judge=Judge, room=Room, rounded=bint,
    axes=double[:, ::1], states=double[:, ::1]
)
cpdef void judge_legs(
    Int[:, ::1] legs, (Int, bint) how, double step_mm, mechanics, Int[:, ::1] counts, task, sums
)

@cython.locals(
    x=Int, y=Int, end_x=Int, end_y=Int, at_x=Int, at_y=Int, low=Int, high=Int, expected=Int,
    entered=Int, left=Int, size=Int, filled=Int, passes=Int, way_x=Int, way_y=Int, more=Int,
    path_x=Int[::1], path_y=Int[::1], state=Int[::1], other=Int[::1], arc=bint, careful=bint,
    met=bint, near=bint, registers=double[::1]
)
cdef void _judge_leg(
    Int[::1] leg, Int method, double step_mm, double[:, ::1] axes, double[:, ::1] states,
    Int[::1] count, Judge judge, Room room
) noexcept
