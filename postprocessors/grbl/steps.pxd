"""The C types of `steps`."""

cimport cython

from camtool.kernels.types cimport Int

@cython.locals(
    k=Int, block=Int, event=Int, most=Int, count=Int, axis=Int, size=Int, sign=Int, taken=Int,
    counter=Int, position=Int, m=Int, start=Int[:, ::1], way=Int[:, ::1]
)
cpdef void step_lines_fill(
    blocks, (Int, Int) first, double[::1] step_mm, double[:, ::1] out
) noexcept
