"""The C types of `offsets`."""

cimport cython
from libc cimport math
from libc.stdint cimport uint8_t

from camtool.kernels.types cimport Int

@cython.locals(leaves=Int, node=Int, row=Int, k=Int, tree=double[:, ::1])
cpdef tree_of(double[:, ::1] boxes)

@cython.locals(k=Int)
cdef void _widen(double[:, ::1] tree, Int node, double[:, ::1] boxes, Int row) noexcept

@cython.locals(leaves=Int, span=Int, low=Int)
cdef (Int, Int) rows_under(double[:, ::1] tree, Int node, Int count) noexcept

cdef double apart_square(double[:, ::1] tree, Int node, double x, double y) noexcept  # inline

@cython.locals(left=Int, right=Int)
cdef Int wait_for_children(
    double[:, ::1] tree, Int node, double x, double y, Int[::1] stack, Int height
) noexcept

cdef bint touch(double[:, ::1] one, Int i, double[:, ::1] other, Int j) noexcept  # inline

@cython.locals(rows=double[:, ::1], i=Int)
cpdef curve_rows(double[:, ::1] start, double[:, ::1] end, double[::1] bulge)

@cython.locals(
    dx=double, dy=double, chord=double, grown=double, cosine=double, sine=double, turn=double
)
cdef void set_curve_row(
    double[:, ::1] rows, Int i, double ax, double ay, double bx, double by, double b
) noexcept

@cython.locals(boxes=double[:, ::1], i=Int)
cpdef curve_boxes(double[:, ::1] curves, double margin)

cdef double gap_to(double[:, ::1] curves, Int i, double x, double y) noexcept  # inline

@cython.locals(ahead=bint)
cdef double distance_to(double[:, ::1] curves, Int i, double x, double y) noexcept  # inline

@cython.locals(before=bint, half=double, chord=double)
cpdef double along(double[:, ::1] curves, Int i, double x, double y) noexcept

cpdef (double, double) point_on(double[:, ::1] curves, Int i, double t) noexcept  # inline

@cython.locals(boxes=double[:, ::1], i=Int)
cpdef kite_boxes(double[:, ::1] kites)

cdef double depth_in(double[:, ::1] kites, Int i, double x, double y) noexcept  # inline

@cython.locals(leaves=Int, height=Int, node=Int, low=Int, row=Int)
cpdef double deepest(
    double[:, ::1] kites, double[:, ::1] tree, double x, double y, double best, double enough,
    Int[::1] stack
) noexcept

@cython.locals(
    leaves=Int, height=Int, node=Int, low=Int, row=Int, near=Int, far=Int
)
cdef double least_below(
    double[:, ::1] curves, double[:, ::1] tree, double x, double y, double best, double enough,
    Int[::1] stack, double[::1] apart
) noexcept

@cython.locals(found=double[::1], apart=double[::1], i=Int, stack=Int[::1])
cpdef nearest_distances(double[:, ::1] points, double[:, ::1] curves, double[:, ::1] tree)

@cython.locals(more=Int[:, ::1])
cdef twice_the_room(Int[:, ::1] found)

@cython.locals(
    found=Int[:, ::1], stack=Int[::1], i=Int, leaves=Int, count=Int, height=Int,
    node=Int, low=Int, row=Int
)
cpdef curves_within(
    double[:, ::1] points, double[::1] reach, double[:, ::1] curves, double[:, ::1] tree
)

cdef class SegmentTree:
    cdef const double[:, :] vertices
    cdef double[:, ::1] nodes, rows
    cdef const int[:] begin, end, order
    cdef Int[::1] kept
    cdef Int leaf

@cython.locals(
    slot=Int, first=Int, last=Int, k=Int, at=Int, begin=Int, end=Int, ax=double, ay=double,
    bx=double, by=double
)
cdef (Int, Int) _rows_of(SegmentTree tree, Int leaf) noexcept

@cython.locals(
    found=double[::1], stack=Int[::1], apart=double[::1], nodes=double[:, ::1],
    rows=double[:, ::1], leaves=Int, i=Int, x=double, y=double, best=double, height=Int, node=Int,
    low=Int, high=Int, k=Int, near=Int, far=Int, to_near=double, to_far=double
)
cpdef distances_from(double[:, ::1] points, SegmentTree tree)

@cython.locals(
    found=Int[:, ::1], stack=Int[::1], nodes=double[:, ::1],
    rows=double[:, ::1], leaves=Int, count=Int, i=Int, x=double, y=double, limit=double,
    height=Int, node=Int, low=Int, high=Int, k=Int
)
cpdef segments_within(double[:, ::1] points, double[::1] reach, SegmentTree tree)

@cython.locals(
    leaves=Int, count=Int, height=Int, node=Int, low=Int, row=Int
)
cpdef Int gathered(
    double[:, ::1] curves, double[:, ::1] tree, double x, double y, double reach, Int[::1] rows,
    Int[::1] stack
) noexcept

@cython.locals(k=Int)
cdef double _too_near(
    double[:, ::1] curves, double[:, ::1] tree, double[:, ::1] kites, double[:, ::1] kite_tree,
    Int[::1] rows, Int count, double x, double y, double distance, double spare, double enough,
    Int[::1] stack, double[::1] apart
) noexcept

@cython.locals(
    ends=double[:, ::1], curves=double[:, ::1], tree=double[:, ::1], kites=double[:, ::1],
    kite_tree=double[:, ::1], i=Int, count=Int, way=Int, _=Int, rows=Int[::1], stack=Int[::1],
    apart=double[::1]
)
cpdef trimmed_ends(double[:, ::1] elements, near, (double, double) limits)

@cython.locals(
    places=double[::1], valid=uint8_t[::1], i=Int, last=Int, whole=Int, count=Int, k=Int, row=Int,
    curves=double[:, ::1], tree=double[:, ::1], kites=double[:, ::1], kite_tree=double[:, ::1],
    rows=Int[::1], stack=Int[::1], apart=double[::1]
)
cpdef far_enough(
    double[:, ::1] elements, Int[::1] element, double[:, ::1] span, near, (double, double) limits
)

@cython.locals(
    first=Int, last=Int, other_first=Int, other_last=Int, pairs=Int[:, ::1], leaves=Int,
    other_leaves=Int, count=Int, height=Int, i=Int, a=Int, b=Int, child=Int, low=Int, far_low=Int,
    j=Int, far=Int, left=Int[::1], right=Int[::1]
)
cpdef pairs_of(
    double[:, ::1] boxes, double[:, ::1] tree, double[:, ::1] others, double[:, ::1] other_tree,
    bint own
)

@cython.locals(
    room=Int, count=Int, k=Int, more=Int, m=Int, i=Int, j=Int, rows=Int[:, ::1],
    found=double[:, ::1]
)
cpdef meetings_of(double[:, ::1] a, double[:, ::1] b, Int[:, ::1] pairs, double eps)

@cython.locals(count=Int, k=Int)
cdef Int _meet(
    double[:, ::1] a, double[:, ::1] b, Int i, Int j, double eps, double[:, ::1] found, Int at
) noexcept

@cython.locals(k=Int)
cdef bint _known(
    double[:, ::1] a, double[:, ::1] b, Int i, Int j, double x, double y, double eps,
    double[:, ::1] found, Int at, Int count
) noexcept

@cython.locals(row=Int, k=Int)
cdef Int _taken(
    double[:, ::1] a, double[:, ::1] b, Int i, Int j, double x, double y, double eps,
    double[:, ::1] found, Int at, Int count
) noexcept

cdef double _fraction(double length, double whole, double eps) noexcept  # inline

cdef (double, double) _tangent_after(double[:, ::1] curves, Int i, double length) noexcept  # inline

cdef (double, double, double, double) _common_points(
    double[:, ::1] a, double[:, ::1] b, Int i, Int j
) noexcept

@cython.locals(
    group=Int[::1], first=Int[::1], node=Int[::1], i=Int, count=Int, j=Int, root=Int, one=Int,
    hits=Int, other=Int, low=Int, high=Int
)
cpdef merged(double[:, :] points, double[::1] skew, Int[::1] order, double eps)

cdef Int _root(Int[::1] group, Int i) noexcept

@cython.locals(begins=Int[::1], rows=Int[::1], row=Int, key=Int)
cdef grouped(Int[::1] keys, Int count)

@cython.locals(
    key=Int, gap=Int, i=Int, row=Int, j=Int, rows=Int[::1], begins=Int[::1], some=Int[::1]
)
cpdef in_order(Int[::1] keys, double[::1] t, Int count)

cdef bint _after(double[::1] t, Int one, Int other) noexcept

@cython.locals(
    keep=uint8_t[::1], near=Int[::1], from_node=Int[::1], to_node=Int[::1], rows=Int[::1],
    begins=Int[::1], row=Int, node=Int, count=Int, k=Int, far=Int, m=Int, other=Int
)
cpdef doubles_left(
    double[:, ::1] elements, Int[::1] element, double[::1] middle_t, ends, double eps
)

@cython.locals(
    ends_here=bint, first=Int, last=Int, keep=uint8_t[::1], node=Int, height=Int, k=Int, row=Int,
    end=Int, side=Int, stack=Int[::1], leaving=Int[::1], first_leaving=Int[::1], arriving=Int[::1],
    first_arriving=Int[::1], leave=Int[::1], arrive=Int[::1]
)
cpdef leading_on(Int[::1] from_node, Int[::1] to_node, Int count)

@cython.locals(
    unused=uint8_t[::1], seen=Int[::1], from_node=Int[::1], to_node=Int[::1], leaving=Int[::1],
    first=Int[::1], path=Int[::1], rows=Int[::1], begins=Int[::1], ways=Int[::1], node=Int,
    loops=Int, start=Int, count=Int, length=Int, last=Int, chosen=Int, low=Int, k=Int
)
cpdef traced(double[:, ::1] elements, Int[::1] element, double[:, ::1] span, ends)

@cython.locals(k=Int, best=Int, others=Int, way=Int)
cdef Int _leftmost(
    double[:, ::1] elements, Int[::1] element, double[:, ::1] span, Int last, uint8_t[::1] unused,
    Int[::1] ways
) noexcept

cdef (double, double) _tangent(double[:, ::1] elements, Int i, double t) noexcept

@cython.locals(
    vertices=double[:, ::1], span=double[:, ::1], offsets=Int[::1], element=Int[::1],
    from_node=Int[::1], to_node=Int[::1], rows=Int[::1], begins=Int[::1], ways=Int[::1], run=Int,
    first=Int, low=Int, count=Int, k=Int, last=Int, row=Int, closed=uint8_t[::1]
)
cpdef written(slices, double[:, ::1] nodes, double[::1] sweeps, runs, double eps)

cdef bint _goes_on(Int[::1] element, double[:, ::1] span, Int last, Int row) noexcept

@cython.locals(k=Int)
cdef Int _first(Int[::1] element, double[:, ::1] span, Int[::1] ways) noexcept

@cython.locals(
    count=Int, left=Int, row=Int, place=Int, height=Int, following=Int, earlier=Int, k=Int,
    there=uint8_t[::1], after=Int[::1], before=Int[::1], stack=Int[::1]
)
cdef Int _cleaned(double[:, ::1] vertices, bint closed, double eps)

cdef double _length(double[:, ::1] vertices, Int one, Int other) noexcept

@cython.locals(i=Int, found=uint8_t[::1], stack=Int[::1])
cpdef insides(double[:, ::1] points, double[:, ::1] curves, double[::1] bulge, double[:, ::1] tree)

@cython.locals(leaves=Int, height=Int, node=Int, low=Int, row=Int, odd=bint)
cdef bint is_inside(
    double[:, ::1] curves, double[::1] bulge, double[:, ::1] tree, double x, double y,
    Int[::1] stack
) noexcept

@cython.locals(crosses=bint, in_circle=bint, on_left=bint)
cdef bint _counts(double[:, ::1] curves, Int i, double bulge, double x, double y) noexcept  # inline

@cython.locals(
    said=Int[::1], stack=Int[::1], n=Int, k=Int, curves=double[:, ::1], tree=double[:, ::1],
    bulge=double[::1], apart=double[::1]
)
cpdef holds(double[:, ::1] points, Int[::1] begins, ring, Int[::1] paths, double eps)

