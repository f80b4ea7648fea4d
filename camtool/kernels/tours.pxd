"""The C types of `tours`."""

cimport cython
from libc cimport math

from camtool.kernels.types cimport Int

cdef class Route:
    cdef double[:, ::1] ends
    cdef Int[::1] turned, first, near, near_first, after, after_first, earlier, earlier_first
    cdef Int free
    cdef bint one_way
    cdef Int[::1] item, place, row

cdef class Step:
    cdef double gain
    cdef Int low, high, other, flip, who, new_row
    cdef void set(
        self, double gain, Int low, Int high, Int other, Int flip, Int who, Int new_row
    ) noexcept

cdef class Branches:
    cdef double[:, ::1] points, box
    cdef Int[::1] rows, begin, size, live, leaf, waiting

cdef double gap(Route tour, Int one, Int other) noexcept  # inline

cdef Int row_at(Route tour, Int position) noexcept  # inline

@cython.locals(one=Int, other=Int)
cpdef void reverse(Route tour, Int low, Int high) noexcept

@cython.locals(position=Int, item=Int, k=Int, one=Int, other=Int, longer=double)
cpdef double turning(Route tour, Int low, Int high) noexcept

@cython.locals(position=Int, item=Int, k=Int)
cpdef bint may_swap(Route tour, Int low, Int high, Int other) noexcept

@cython.locals(left=Int, right=Int, one=Int, other=Int)
cpdef double gain_of_reversal(Route tour, Int low, Int high) noexcept

@cython.locals(left=Int, right=Int, one=Int, end_one=Int, two=Int, end_two=Int, before=double)
cpdef double gain_of_swap(Route tour, Int low, Int high, Int other, Int flip) noexcept

@cython.locals(low=Int, high=Int, other=Int, middle=Int)
cdef Int take(Route tour, Step step, Int[:, ::1] log, Int logged) noexcept

cdef Int _reversed(Route tour, Int low, Int high, Int[:, ::1] log, Int logged) noexcept

@cython.locals(k=Int)
cdef void undo(Route tour, Int[:, ::1] log, Int logged) noexcept

@cython.locals(
    count=Int, levels=Int, leaves=Int, nodes=Int, node=Int, low=Int, middle=Int, high=Int, k=Int,
    begin=Int[::1], size=Int[::1], rows=Int[::1], leaf=Int[::1], box=double[:, ::1], wide=double,
    tall=double
)
cpdef tree_of(double[:, :] points)

@cython.locals(k=Int, x=double, y=double)
cdef void _bound(
    double[:, :] points, Int[::1] rows, Int low, Int high, double[:, ::1] box, Int node
) noexcept

@cython.locals(pivot=double, left=Int, right=Int, row=Int)
cdef void _halve(
    double[:, :] points, Int[::1] rows, Int low, Int middle, Int high, Int axis
) noexcept

@cython.locals(node=Int)
cpdef void switch(Branches tree, Int row, Int change) noexcept

cdef double _apart(Branches tree, Int node, double x, double y) noexcept  # inline

@cython.locals(left_first=bint)
cdef Int _halves_wait(
    Branches tree, Int node, double x, double y, Int[::1] waiting, Int top
) noexcept

@cython.locals(
    top=Int, leaves=Int, node=Int, k=Int, row=Int, found=Int, waiting=Int[::1], best=double,
    apart=double, dx=double, dy=double
)
cpdef Int nearest_row(Branches tree, Int[::1] on, double x, double y) noexcept

@cython.locals(
    top=Int, leaves=Int, node=Int, k=Int, other=Int, count=Int, waiting=Int[::1], x=double,
    y=double, left=double, right=double, below=double, above=double, dx=double, dy=double
)
cpdef Int nearest_owners(
    Branches tree, Int[::1] owner, Int row, Int most, Int quarter, Int[::1] found,
    double[::1] apart
) noexcept

cdef bint _looks_to(Int quarter, double dx, double dy) noexcept  # inline

@cython.locals(at=Int, k=Int)
cdef void _enter(Int[::1] found, double[::1] apart, Int most, Int owner, double distance) noexcept

cdef bint _before(double distance, Int owner, Int[::1] found, double[::1] apart, Int at) noexcept  # inline

@cython.locals(
    branches=Branches, i=Int, rank=Int, count=Int, row=Int, chosen=Int, item=Int, k=Int, later=Int,
    rows=Int[::1], owner=Int[::1], on=Int[::1], waiting=Int[::1], x=double, y=double
)
cpdef nearest_first(
    tree, double[:, ::1] ends, Int[::1] first, Int[::1] after_first, Int[::1] after,
    Int[::1] waits, double[::1] start
)

@cython.locals(
    branches=Branches, total=Int, i=Int, places=Int, most=Int, place=Int, k=Int, quarter=Int,
    wanted=Int, hits=Int, m=Int, item=Int, most_of_item=Int, place_first=Int[::1],
    near_first=Int[::1], near=Int[::1], seen=Int[::1], found=Int[::1], apart=double[::1]
)
cpdef neighbours(tree, Int[::1] owner, Int count)

@cython.locals(
    count=Int, rows_in_all=Int, row=Int, rank=Int, low=Int, high=Int, r=Int, chosen=Int, last=Int,
    came_from=Int[::1], rows=Int[::1], best=double, x=double, y=double, length=double, home=double,
    cost=double[::1]
)
cpdef best_rows(
    double[:, ::1] ends, Int[::1] first, Int[::1] order, double[::1] start, double[::1] goal
)

@cython.locals(head=Int, size=Int, item=Int, gained=double)
cdef (double, Int) shorten(
    Route tour, Int[::1] queue, Int[::1] waits, Int count, Int[:, ::1] log, Int logged, Step step
) noexcept

@cython.locals(item=Int)
cdef Int _wait(
    Route tour, Int[::1] queue, Int[::1] waits, Int head, Int count, Int position
) noexcept

@cython.locals(last=Int, middle=Int, at=Int, k=Int)
cdef Int _touched_wait(
    Route tour, Step step, Int[::1] queue, Int[::1] waits, Int head, Int count
) noexcept

@cython.locals(
    turned=Int, k=Int, at=Int, last=Int, row=Int, left=Int, right=Int, near=Int, spot=Int,
    other=Int, alone=bint, reach=double, lifted=double
)
cdef void best_step(Route tour, Int item, Step best) noexcept

@cython.locals(other=Int, at=Int, row=Int, left=Int, right=Int)
cdef void _other_row(Route tour, Int item, Step best) noexcept

@cython.locals(gain=double)
cdef void _reversal(Route tour, Int low, Int high, Step best) noexcept

@cython.locals(length=Int, low=Int, high=Int)
cdef void _part(Route tour, Int at, Int way, Int spot, bint turn, Step best) noexcept

@cython.locals(gain=double)
cdef void _swap(Route tour, Int low, Int high, Int other, Int flip, Step best) noexcept

@cython.locals(
    at=Int, k=Int, left=Int, right=Int, row=Int, first=Int, count=Int, other=Int, low=Int,
    high=Int, end=Int, gain=double, found=double, there=double
)
cdef void _single(Route tour, Int item, Int spot, double lifted, Step best) noexcept

@cython.locals(
    items=Int, waiting=Int, may_undo=Int, kick=Int, logged=Int, low=Int, high=Int, other=Int,
    log=Int[:, ::1], queue=Int[::1], waits=Int[::1], route=Route, step=Step, room=Step,
    gained=double, gain=double
)
cpdef double kicked(tour, Int kicks, Int seed)
