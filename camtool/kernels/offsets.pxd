from camtool.kernels.types cimport Int

cpdef enum:
    # Size of a stack of nodes: far more than twice the levels of any tree.
    DEPTH = 128

cpdef tree_of(double[:, ::1] boxes)
cdef (Int, Int) rows_under(double[:, ::1] tree, Int node, Int count) noexcept nogil
cdef double apart_square(double[:, ::1] tree, Int node, double x, double y) noexcept nogil
cdef Int wait_for_children(
    double[:, ::1] tree, Int node, double x, double y, Int[::1] stack, Int height
) noexcept nogil
