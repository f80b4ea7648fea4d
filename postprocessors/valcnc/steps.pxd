"""The C types of `steps`."""

cimport cython
from libc cimport math

from camtool.kernels.types cimport Int

@cython.locals(
    n=Int, column=Int, full=bint, x=double, y=double, end_x=double, end_y=double, alpha=double,
    theta=double, i=double, j=double
)
cpdef Int arc_angles(
    Int[::1] turn, double[::1] begin, double[:, ::1] ends, double[:, ::1] offset, bint computed,
    double[:, ::1] out
) noexcept
