"""The C types of `fits`."""

cimport cython
from libc cimport math
from libc.stdint cimport uint8_t

from camtool.kernels.offsets cimport apart_square, rows_under, tree_of, wait_for_children
from camtool.kernels.types cimport Int

@cython.locals(degree=Int, i=Int)
cpdef (double, double, double, double) evaluate(double[:, :, ::1] pieces, Int k, double u) noexcept

@cython.locals(i=Int, j=Int, row=Int, k=Int, here=double, out=double[:, ::1])
cpdef samples_between(double[:, :, ::1] pieces, double[:] t)

cpdef double speed(double[:, :, ::1] pieces, Int k, double u) noexcept

@cython.locals(exponent=Int)
cdef (double, double) aside(
    double[:, :, ::1] pieces, Int k, double u, double side, double least
) noexcept

@cython.locals(_=Int)
cdef double slowest(double[:, :, ::1] pieces, Int k, double low, double high) noexcept

@cython.locals(
    i=Int, count=Int, before=Int, after=Int, side=Int, here=double, u=double, tip=double,
    fastest=double, speeds=double[::1], out=double[::1]
)
cdef first_steps(double[:, :, ::1] pieces, Int k, Int each)

@cython.locals(turn=Int, bends=bint, reach=double, off=double)
cdef bint too_coarse(
    double[:, :, ::1] pieces, Int k, double[:, ::1] before, Int i, double[:, ::1] behind, Int j,
    double tolerance
) noexcept

@cython.locals(
    count=Int, i=Int, depth=Int, column=Int, last=Int, top=Int, fine=bint, fastest=double,
    least=double, stack=double[:, ::1], out=double[:, ::1], grid=double[::1]
)
cdef piece_rows(double[:, :, ::1] pieces, Int k, Int each, double tolerance, Int most)

@cython.locals(dx=double, dy=double)
cdef void fill_row(
    double[:, :, ::1] pieces, Int k, double u, double least, double[:, ::1] rows, Int i
) noexcept

@cython.locals(
    each=Int, count=Int, k=Int, i=Int, column=Int, last=Int, apart=double, x=double, y=double,
    out=double[:, ::1], rows=double[:, ::1], grown=double[:, ::1], corner=uint8_t[::1]
)
cpdef curve_rows(double[:, :, ::1] pieces, Int steps, double tolerance)

cpdef double distance_to_arc(
    double px, double py, double ax, double ay, double bx, double by, double bulge
) noexcept  # inline

cdef double half_angle(double ax, double ay, double bx, double by) noexcept  # inline

cpdef (double, double, double, double) biarc(
    double start_x, double start_y, double leave_x, double leave_y, double end_x, double end_y,
    double arrive_x, double arrive_y
) noexcept

cdef double distance_to_biarc(
    double px, double py, double start_x, double start_y, double end_x, double end_y,
    (double, double, double, double) pair
) noexcept  # inline

cdef (double, double, double, double) over(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int high
) noexcept  # inline

@cython.locals(i=Int, j=Int, a=Int, b=Int, out=double[::1])
cpdef step_errors(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int[::1] rows,
    double[:, :, ::1] probes
)

@cython.locals(i=Int, off=double)
cpdef double span_error(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int high
) noexcept

@cython.locals(i=Int)
cdef bint span_holds(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int high,
    double target
) noexcept

@cython.locals(i=Int)
cdef double arc_error(double[:, ::1] point, Int low, Int high, double bulge) noexcept

@cython.locals(best=Int, beyond=Int, high=Int, tries=Int, reach=Int, ahead=Int)
cpdef Int longest_span(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int furthest,
    Int guess, double target
) noexcept

@cython.locals(level=bint)
cdef double single_bulge(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int high,
    double target
) noexcept

@cython.locals(beyond=Int, best=Int, high=Int)
cdef (Int, double) longest_single(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int least,
    Int most, Int guess, double target
) noexcept

@cython.locals(count=Int, i=Int, last=Int, out=Int[::1], turned=double[::1])
cdef furthest_nodes(double[:, ::1] leave, double[:, ::1] arrive, uint8_t[::1] corner)

@cython.locals(row=Int, best=Int, whence=Int, low=Int, begin=Int, high=Int, first=bint)
cdef (Int, Int, double) furthest_state(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int[::1] limit,
    Int[::1] states, Int now, Int guess, double target
) noexcept

@cython.locals(
    count=Int, row=Int, now=Int, guess=Int, m=Int, spans=Int, best=Int, before=Int, low=Int,
    place=Int, high=Int, limit=Int[::1], states=Int[::1], whence=Int[::1], ends=Int[::1],
    first=double, jx=double, jy=double, second=double, bulge=double, pairs=double[:, ::1],
    bulges=double[::1]
)
cdef longest_spans(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, uint8_t[::1] corner,
    double target
)

cdef Int lines_for(double ax, double ay, double bx, double by, double bulge, double off) noexcept

@cython.locals(
    spans=Int, count=Int, s=Int, k=Int, total=Int, i=Int, made=Int, j=Int, owner=Int[::1],
    parts=Int[::1], first=Int[::1], arcs=double[:, ::1], rows=double[:, ::1]
)
cdef chain(double[:, ::1] point, Int[::1] ends, double[:, ::1] pairs, double tolerance)

@cython.locals(two=Int, bulge=double, sweep=double)
cdef double common_bulge(double[:, ::1] rows, Int one, double end_x, double end_y) noexcept

@cython.locals(
    count=Int, i=Int, last=Int, places=Int[::1], end_x=double, end_y=double, bulge=double,
    out=double[:, ::1]
)
cdef joined(double[:, ::1] rows, double size)

@cython.locals(
    each=Int, s=Int, last=Int, i=Int, low=Int, high=Int, row=Int, bulge=double, nearest=double,
    x=double, y=double, ax=double, ay=double, bx=double, by=double, out=double[::1]
)
cdef deviations(
    double[:, ::1] samples, Int[::1] ends, Int[::1] first, double[:, ::1] vertices, Int[::1] places
)

@cython.locals(i=Int)
cdef (double, double, double) summary(double[:, ::1] samples, double[::1] off) noexcept

@cython.locals(
    ends=Int[::1], first=Int[::1], places=Int[::1], point=double[:, ::1], arrive=double[:, ::1],
    leave=double[:, ::1], pairs=double[:, ::1], rows=double[:, ::1], vertices=double[:, ::1],
    off=double[::1], corner=uint8_t[::1]
)
cpdef fit_nodes(nodes, double[:, ::1] samples, double target, double tolerance)

@cython.locals(k=Int)
cdef bint lengths_agree(double[:, ::1] points, Int low, Int high) noexcept

@cython.locals(k=Int)
cdef bint is_straight(double[:, ::1] points, Int low, Int high, double noise) noexcept

@cython.locals(count=Int, k=Int)
cpdef (double, double, double) circle_of(double[:, ::1] points, Int low, Int high) noexcept

@cython.locals(k=Int, rough=double, fourth=double, sweep=double, largest=double)
cdef (Int, double, double, double, double) judge(
    double[:, ::1] points, Int low, Int high, double noise, double tolerance, double[::1] off
) noexcept

@cython.locals(
    best=Int, beyond=Int, size=Int, rest=Int, doubled=Int, high=Int, is_=Int, cx=double, cy=double,
    radius=double, sweep=double
)
cdef (Int, Int, double, double, double, double) longest_run(
    double[:, ::1] points, Int low, double noise, double tolerance, double[::1] off
) noexcept

@cython.locals(
    count=Int, low=Int, done=Int, high=Int, is_=Int, cx=double, cy=double, radius=double,
    sweep=double, out=double[:, ::1], off=double[::1]
)
cpdef find_runs(double[:, ::1] points, double noise, double tolerance)

@cython.locals(i=Int, row=Int, bulge=double, nearest=double, largest=double, off=double)
cpdef double furthest_off(double[:, ::1] points, double[:, ::1] arcs) noexcept

@cython.locals(
    count=Int, row=Int, best_row=Int, best_other=Int, first=Int, last=Int, other=Int,
    stack=Int[::1], tree=double[:, ::1]
)
cpdef (double, Int, Int) closest(
    const double[:, :] start, const double[:, :] end, double[::1] bulge, double[:, ::1] boxes,
    Int[::1] path
)

@cython.locals(
    other=Int, row=Int, index=Int, found=Int[::1], stack=Int[::1], _=double, x=double, y=double,
    ax=double, ay=double, bx=double, by=double, tree=double[:, ::1]
)
cpdef nearest_rows(
    double[:, ::1] points, const double[:, :] start, const double[:, :] end, double[::1] bulge,
    double[:, ::1] boxes
)

@cython.locals(leaves=Int, found=Int, height=Int, node=Int, row=Int, low=Int, high=Int, own=bint)
cdef (double, Int) _from_point(
    double x, double y, const double[:, :] start, const double[:, :] end, double[::1] bulge,
    double[:, ::1] tree, Int first, Int last, double best, Int[::1] stack
) noexcept
