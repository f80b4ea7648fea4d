"""The C types of `arcs`."""

cimport cython
from libc cimport math
from camtool.kernels.types cimport Int
from camtool_postprocessors.pic_mmh.steps cimport (
    direct_search_run, first_at, heading, nearest_to, rounded_radius, skip
)

cdef class LandingSearch:
    cdef double units_per_step
    cdef Int most_units
    cdef Int[::1] state, path_x, path_y, onward

@cython.locals(k=Int, room=Int, search=LandingSearch, out=Int[:, ::1])
cpdef land(
    Int[:, ::1] arcs, double[::1] sweeps, double units_per_step, Int most_units, double sagitta
)

cdef double _radius(Int x, Int y) noexcept  # inline

cdef Int _reach(double radius, double sagitta) noexcept

@cython.locals(x=Int, y=Int, sx=Int, sy=Int)
cdef void _begin(Int[::1] arc, Int error, Int[::1] state) noexcept

@cython.locals(met=Int, other=Int, radius=Int, error=Int)
cdef Int _hits(Int[::1] arc, Int x, Int y, Int low, Int high, Int[::1] state) noexcept

@cython.locals(size=Int, units=Int)
cdef bint _represents(Int steps, LandingSearch search) noexcept

@cython.locals(x=Int, y=Int, iteration=Int)
cdef bint _lands(Int[::1] arc, Int row, Int first, LandingSearch search) noexcept

@cython.locals(path_x=Int[::1], path_y=Int[::1])
cdef void _follow(Int[::1] arc, Int first, Int count, LandingSearch search) noexcept

@cython.locals(
    k=Int, turn=Int, along_x=Int, along_y=Int, on_x=Int, on_y=Int, path_x=Int[::1], path_y=Int[::1]
)
cdef void _mark_onward(Int[::1] arc, Int count, LandingSearch search) noexcept

cdef void _store_landing(Int row, Int first, LandingSearch search, Int[::1] out) noexcept

@cython.locals(
    radius=double, latest=double, end_x=Int, end_y=Int, low=Int, high=Int, met=Int, near=Int, _=Int, first=Int,
    count=Int, row=Int, least=Int, off_x=Int, off_y=Int, square=Int, upto=Int, room=Int,
    nearer=bint
)
cdef void _land(
    Int[::1] arc, double sweep_rad, double sagitta, LandingSearch search, Int[::1] out
) noexcept
