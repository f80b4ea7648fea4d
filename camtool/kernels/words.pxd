"""The C types of `words`."""

cimport cython
from camtool.kernels.types cimport Int

@cython.locals(size=Int, decimals=Int, digits=Int, rest=Int, end=Int, k=Int, place=Int)
cdef Int _put_number(Int value, Int[::1] style, unsigned char[::1] out, Int at) noexcept

@cython.locals(columns=Int, at=Int, row=Int, begin=Int, column=Int, k=Int)
cpdef void put_words(
    Int[:, ::1] values, unsigned char[:, ::1] written, unsigned char[::1] fixed,
    Int[::1] fixed_ends, Int[:, ::1] styles, bint blanks, unsigned char[::1] out, Int[::1] ends
) noexcept
