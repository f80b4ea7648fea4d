from camtool.kernels.types cimport Int

cpdef enum:
    # Samples that are judged together: their columns stay in a processor's second cache, and what
    # a block costs besides them is shared by many.
    BLOCK = 1536

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

cdef void judge_block(Int row, Int count, Judge judge) noexcept
