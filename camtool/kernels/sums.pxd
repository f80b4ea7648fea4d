"""The C types of `sums`."""

cimport cython

from camtool.kernels.types cimport Int

@cython.locals(k=Int)
cdef double total(double[::1] values, Int low, Int high) noexcept  # wide

@cython.locals(k=Int)
cdef double square_total(double[::1] values, Int low, Int high) noexcept  # wide

@cython.locals(k=Int)
cdef double largest(double[::1] values, Int low, Int high) noexcept  # wide

@cython.locals(k=Int)
cdef double smallest(double[::1] values, Int low, Int high) noexcept  # wide
