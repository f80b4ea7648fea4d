"""The C types of `judging`."""

cimport cython
from libc cimport math
from camtool.kernels.offsets cimport apart_square, wait_for_children
from camtool.kernels.types cimport Int

cdef class Curves:
    cdef const double[:, :] start, end
    cdef double[:, ::1] arcs
    cdef int[::1] arc

cdef class Search:
    cdef Curves curves
    cdef const double[:, :] heights
    cdef double[:, ::1] nodes
    cdef int[::1] order
    cdef Int[::1] found, stack, parts, by
    cdef double[::1] box, x, y, error, other
    cdef readonly Int looked

cdef class Judge:
    cdef Int low
    cdef Curves own
    cdef double[:, ::1] window, centre, directions, figures, trace
    cdef Int[:, ::1] rows, histograms
    cdef double[:, :, ::1] bins
    cdef double[::1] off, pen
    cdef Search search
    cdef double[::1] x, y, slide_x, slide_y, errors, size
    cdef Int[::1] bits
    cdef int[::1] places

@cython.locals(width=Int, lane=Int)
cdef double sum_of_lanes(double* lanes) noexcept  # inline

@cython.locals(width=Int, lane=Int)
cdef double largest_of_lanes(double* lanes) noexcept  # inline

@cython.locals(width=Int, lane=Int)
cdef double smallest_of_lanes(double* lanes) noexcept  # inline

@cython.locals(j=Int, k=Int, lane=Int, found=double, lanes="double[32]")
cpdef double largest(double[::1] values, Int low, Int high) noexcept  # wide

@cython.locals(k=Int, square=double, over=double)
cdef void _to_line(
    const double[:, :] start, const double[:, :] end, Int row, double[::1] x, double[::1] y,
    double[::1] errors
) noexcept  # wide

@cython.locals(k=Int, outside=Int, above_half=bint)
cdef bint _all_in_wedge(
    double[:, ::1] arcs, Int row, double[::1] x, double[::1] y
) noexcept  # wide

cdef double _depth(double from_start, double from_end, bint above_half) noexcept  # inline

cdef double _off(double above, double half, double part) noexcept  # inline

cdef double _outside(
    double px, double py, double radius, double half, double part
) noexcept  # inline

@cython.locals(k=Int, far=Int)
cdef void _to_circle(
    double[:, ::1] arcs, Int row, double[::1] x, double[::1] y, double[::1] errors
) noexcept  # wide

@cython.locals(k=Int, above_half=bint, inside=bint)
cdef void _to_arc(
    const double[:, :] start, const double[:, :] end, Int row, double[:, ::1] arcs, Int at,
    double[::1] x, double[::1] y, double[::1] errors
) noexcept  # wide

@cython.locals(at=Int)
cpdef void set_errors(
    Curves curves, Int row, double[::1] x, double[::1] y, double[::1] errors
) noexcept

cdef double smaller(double one, double other) noexcept  # inline

cdef double larger(double one, double other) noexcept  # inline

@cython.locals(j=Int, k=Int, same=Int)
cdef Int first_of(double[::1] values, Int low, Int high, double value) noexcept  # wide

cdef bint _counts(
    Int k, Int first, Int last, double z_low, double z_high, const double[:, :] heights
) noexcept  # inline

@cython.locals(
    leaves=Int, height=Int, node=Int, low=Int, place=Int, k=Int, nearest=Int, best=double,
    order=int[::1], stack=Int[::1], curves=Curves, nodes=double[:, ::1],
    heights="const double[:, :]", spot_x=double[::1], spot_y=double[::1], spot_error=double[::1]
)
cdef Int _nearest(
    double x, double y, double within, Int first, Int last, double z_low, double z_high,
    Search search
) noexcept

cdef double _looser(double limit) noexcept  # inline

@cython.locals(
    count=Int, k=Int, j=Int, lane=Int, middle_x=double, middle_y=double, way_x=double,
    way_y=double, px=double, py=double, long=double, wide=double, far=double,
    longs="double[32]", wides="double[32]", fars="double[32]"
)
cdef void _set_box(
    double[::1] x, double[::1] y, double[::1] errors, double[::1] box
) noexcept  # wide

@cython.locals(
    low_x=double, low_y=double, high_x=double, high_y=double, beside=double, reach=double
)
cdef bint _node_near(double[:, ::1] nodes, Int node, double[::1] box) noexcept  # inline

@cython.locals(
    at=Int, ax=double, ay=double, way_x=double, way_y=double, long=double, wide=double,
    px=double, py=double, along=double,
    beside=double, near_long=double, near_wide=double, far_long=double, far_wide=double,
    square=double, to_x=double, to_y=double, further=double, across=double, side=double,
    reach=double
)
cdef bint _move_near(Curves curves, Int k, double[::1] box) noexcept  # inline

@cython.locals(n=Int)
cdef bint _is_there(Curves curves, Int[::1] found, Int count, Int move) noexcept

@cython.locals(at=Int, there=Int, k=Int, axis=Int)
cdef bint _are_same(Curves curves, Int one, Int other) noexcept  # inline

@cython.locals(
    at=Int, ax=double, ay=double, bx=double, by=double, cx=double, cy=double, px=double,
    py=double, long=double, across=double, wide=double, end_x=double, end_y=double, to_a=double,
    to_b=double, from_start=double, from_end=double
)
cdef double _squareness(Curves curves, Int k, double x, double y) noexcept

@cython.locals(k=Int, less=double, square=double, curves=Curves, other=double[::1])
cdef void _lowered(
    double[::1] x, double[::1] y, Int move, Search search, double[::1] errors, Int[::1] by
) noexcept

@cython.locals(
    leaves=Int, height=Int, node=Int, low=Int, place=Int, k=Int, count=Int, most=Int, some=Int,
    order=int[::1], stack=Int[::1], found=Int[::1], curves=Curves, nodes=double[:, ::1],
    heights="const double[:, :]", box=double[::1]
)
cdef Int _list_near(
    double[::1] x, double[::1] y, double[::1] errors, Int own, Int first, Int last, double z_low,
    double z_high, Search search
) noexcept

@cython.locals(
    begin=Int, end=Int, height=Int, low=Int, high=Int, middle=Int, k=Int, n=Int, near=Int,
    told=bint, far=double, curves=Curves, parts=Int[::1], by=Int[::1], found=Int[::1],
    mine=Int[::1], here_x=double[::1], here_y=double[::1], here=double[::1]
)
cpdef bint nearest_errors(
    double[::1] x, double[::1] y, Int own, Int first, Int last, double z_low, double z_high,
    Search search, double[::1] out
) noexcept

@cython.locals(k=Int)
cdef Int _first_off(double[::1] errors, Int low) noexcept

@cython.locals(end=Int, k=Int)
cdef Int _end_of_off(double[::1] errors, Int low) noexcept

@cython.locals(which=Int)
cdef Int _bin_of(double x, double y, double[:, ::1] directions) noexcept

@cython.locals(j=Int, k=Int, outside=Int, out=bint)
cdef Int _stay(
    double[::1] x, double[::1] y, Int low, double cx, double cy, double[:, ::1] directions,
    Int which
) noexcept  # wide

@cython.locals(done=Int, which=Int, stay=Int)
cpdef void fill_bins(
    double[::1] x, double[::1] y, double cx, double cy, double[:, ::1] directions,
    double[:, ::1] bins
) noexcept

@cython.locals(
    j=Int, k=Int, lane=Int, px=double, py=double, square=double, sum_x=double, sum_y=double,
    least=double, most=double, sums_x="double[32]", sums_y="double[32]", leasts="double[32]",
    mosts="double[32]"
)
cdef void _add(
    double[::1] x, double[::1] y, Int low, Int high, double cx, double cy, double[:, ::1] bins,
    Int which
) noexcept  # wide

@cython.locals(k=Int)
cdef void _place(
    double[::1] x, double[::1] y, Int low, double cx, double cy, double square,
    double[:, ::1] bins, Int which, Int column
) noexcept

@cython.locals(at=Int)
cdef void _write(double[::1] pen, double x, double y, double error, double[:, ::1] trace) noexcept

cdef void _end_run(double[::1] pen, double[:, ::1] trace) noexcept

cdef void end_row(double[::1] pen, double[:, ::1] trace) noexcept

@cython.locals(count=Int, low=Int, high=Int, at=Int, left=Int, peak=double)
cpdef void trace_block(
    Int row, double[::1] x, double[::1] y, double[::1] error, double most, double[::1] pen,
    double[:, ::1] trace
) noexcept

@cython.locals(
    j=Int, k=Int, lane=Int, low_x=double, low_y=double, high_x=double, high_y=double, most=double,
    sum_=double, here_x=double, here_y=double, off_x=double, off_y=double, square=double,
    lows_x="double[32]", lows_y="double[32]", highs_x="double[32]", highs_y="double[32]",
    mosts="double[32]", sums="double[32]"
)
cdef (double, double) _spread(
    double[:, ::1] figures, Int row, double[::1] x, double[::1] y, double[::1] slide_x,
    double[::1] slide_y
) noexcept  # wide

@cython.locals(
    j=Int, k=Int, lane=Int, leading=Int, most=double, squares=double, signed=double,
    mosts="double[32]", sums="double[32]", signs="double[32]"
)
cdef (double, double, double) _sizes(
    double[::1] errors, double off, double[::1] size, Int[::1] bits, int[::1] places
) noexcept  # wide

cdef int _place_of(Int bits, Int turn) noexcept  # inline

@cython.locals(k=Int)
cdef void _count(int[::1] places, Int count, Int[:, ::1] histograms, Int which) noexcept

@cython.locals(
    last=Int, own=Int, of_program=Int, k=Int, circle=Int, first=Int, upto=Int, beside=Int,
    search=Search, rows=Int[:, ::1], bits=Int[::1],
    places=int[::1], shown=double, most=double, squares=double, signed=double,
    figures=double[:, ::1], window=double[:, ::1], bins=double[:, ::1], x=double[::1],
    y=double[::1], slide_x=double[::1], slide_y=double[::1], errors=double[::1],
    size=double[::1], pen=double[::1]
)
cdef void judge_block(Int row, Int count, Judge judge) noexcept

@cython.locals(
    done=Int, count=Int, k=Int, axis=Int, judge=Judge, near=bint, slide_x=double[::1],
    slide_y=double[::1], x=double[::1], y=double[::1]
)
cpdef judge_samples(Int[::1] row, double[:, ::1] commanded, double[:, ::1] slide, task, sums)
