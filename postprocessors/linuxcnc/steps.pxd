"""The C types of `steps`."""

cimport cython
from libc.stdint cimport uint8_t

from camtool.kernels.types cimport Int

@cython.locals(axis=Int, way=double, along=double, whole=double)
cdef double _share(double[:, ::1] points, Int base, Int end, Int point) noexcept  # inline

@cython.locals(k=Int, axis=Int, same=bint, square=double)
cdef bint _joins(double[:, ::1] points, Int base, Int new, double tolerance) noexcept

@cython.locals(k=Int, base=Int, number=Int, axis=Int, j=Int, reached=double, whole=double)
cpdef void merge_lines(
    double[:, ::1] points, uint8_t[::1] apart, double[:] tolerance, Int[::1] chain,
    double[:, ::1] moved
) noexcept
