"""The C types of `motion`."""

cimport cython

from camtool.kernels.types cimport Int

@cython.locals(
    leg=Int, filled=Int, passes=Int, run=Int, axis=Int, position=Int, k=Int, size=Int, sense=Int,
    count=Int
)
cpdef void legs_fill(
    Int done, Int[:, ::1] begin, Int[:, ::1] way, double[::1] step_mm, double[:, ::1] out
) noexcept

@cython.locals(i=Int, j=Int)
cpdef void entry_speeds(
    double[::1] gain, double[::1] limit, Int window, double reached, double[::1] entry
) noexcept
