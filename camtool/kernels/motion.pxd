from libc.stdint cimport int32_t
from camtool.kernels.types cimport Int


cdef class Ways:
    cdef const double[::1] start
    cdef const double[:, ::1] end
    cdef const int32_t[::1] arm
    cdef const double[:, ::1] arms
    cdef void put(self, Int row, double share, double *point) noexcept
